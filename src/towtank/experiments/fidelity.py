"""Many cheap runs and few dear ones: the derivatives of one tank, corrected by runs of another that is trusted more."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.consistency import consistency
from towtank.derive.convert import about_point
from towtank.derive.cycles import Samples, settled
from towtank.derive.screen import name_of, screen
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.experiments.belief import SAME, Belief, Layout, Told, believe, each, told
from towtank.experiments.errors import ErrorModel
from towtank.experiments.update import Update, bought, index_row, origin_words, predictions, rests, shifts, warnings
from towtank.frames import Array
from towtank.grid.spread import mesh_uncertainty
from towtank.grid.study import GridStudy
from towtank.plan.kinds import CaptiveTest
from towtank.progress import Silent
from towtank.provenance import provenance
from towtank.tank.lpm import LpmTank
from towtank.tank.run import Run

INDEX = "G_h"
"""Name of the horizontal stability index among wanted values."""

WORTH = 1e-3
"""Least fall of the mean relative standard deviation for which a run is chosen. Judgement: a standard deviation that
rests on tens of runs is itself known to a tenth, so a thousandth is nothing."""


def correct(
    prior: Derivatives,
    runs: Sequence[Run],
    *,
    craft: Craft | None = None,
    grid: GridStudy | None = None,
    error: ErrorModel | None = None,
    doubt: float = 0.0,
) -> Derivatives:
    """The derivatives of ``prior``, corrected by ``runs`` of another tank.

    Parameters
    ----------
    prior : with its uncertainty, as ``derive`` gives it from the fast tank; variant "lumped".
    runs : of the same craft, all of one level, each once. Without runs the prior comes back.
    craft : gives the stability index, whose uncertainty is then told before and after each run.
    grid : study of the runs' meshes; its error of a load is one unknown factor in all runs of a kind.
    error : of the loads of the runs, beside what the model does not hold of them.
    doubt : share of each value by which the prior may be wrong beside its stated uncertainty.

    Returns
    -------
    Derivatives at both levels, the names of ``prior``. Each part of the covariance is what is left of the prior's part,
    plus, in "fit" the errors of the loads, in "mesh" those of ``grid``, in "model" the ensemble of the runs. Their sum
    is never above the prior's (with ``doubt``: the prior so widened). ``quality["fidelity"]`` says what each run
    bought, how far each value moved, and how well both sets predict the runs.

    Raises
    ------
    DeriveError
        Runs that do not belong together, or none within the range of the model.
    InputError
        Runs of another craft or water than the prior, runs that are in it already, or a variant that is not "lumped".

    Source     brysonho1975, ch. 12 (linear estimate with a Gaussian prior); jcgm100, ch. 5.
    Departure  A run counts once, however finely it is sampled. Ensemble and mesh error are unknowns that runs share.
    Valid      The range of the fit. Errors of different runs independent but for mesh and ensemble.
    """
    if not runs:
        return prior
    kept, outside = screen(tuple(runs))
    _refuse(prior, kept, doubt)
    belief = believe(about_point(prior, kept[0].origin_from_nose), doubt)
    mesh = np.zeros((len(kept), 6)) if grid is None else mesh_uncertainty(grid, kept)
    samples = settled(kept)
    groups = () if grid is None else tuple(sorted({run.kind for run in kept}))
    layout = Layout(len(belief.root), len(belief.slopes.values), groups, len(samples.loads) - 1)
    model = ErrorModel() if error is None else error
    own = each(samples, len(kept))
    wide = [
        told(belief, layout, run, part, m, model, local=False) for run, part, m in zip(kept, own, mesh, strict=True)
    ]
    local = [
        told(belief, layout, run, part, m, model, local=True) if run.steady else far
        for run, part, m, far in zip(kept, own, mesh, wide, strict=True)
    ]
    it = Update(belief, layout, kept, tuple(wide), tuple(local))
    return _result(it, own, outside, craft, {"error": asdict(model), "doubt": doubt})


def _refuse(prior: Derivatives, runs: Sequence[Run], doubt: float) -> None:
    first = runs[0]
    if prior.variant != "lumped":
        raise InputError(f"correct: the prior is of variant {prior.variant!r}. Give the set that derive wrote, lumped.")
    if prior.craft != first.craft:
        raise InputError(
            f"correct: the prior is of {prior.craft!r}, the runs of {first.craft!r}. One craft's runs say nothing of "
            "another's derivatives."
        )
    if not np.isclose(prior.reference.density, first.density, rtol=1e-6):
        raise InputError(
            f"correct: the prior is in water of {prior.reference.density:g} kg/m3, the runs of {first.density:g}. "
            "Values in SI grow with it; derive the prior in the water of the runs."
        )
    used = set(prior.provenance.get("inputs", {}).values())
    if twice := next((run for run in runs if run.id in used), None):
        raise InputError(f"correct: run {twice.id} is in the prior already, and would count twice. Leave it out.")
    if not 0.0 <= doubt < np.inf:
        raise InputError(f"correct: doubt {doubt} is not a share. Give 0.1 for a tenth of each value.")


def _result(
    it: Update, own: Sequence[Samples], outside: tuple[tuple[str, str], ...], craft: Craft | None, how: dict[str, Any]
) -> Derivatives:
    prior = it.belief.prior
    values, parts = it.terms()
    slopes, covariance = it.slopes()
    origin = dict(zip(it.belief.slopes.names, slopes.tolist(), strict=True))
    std = dict(zip(origin, np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist(), strict=True))
    names = [name_of(run, it.runs) for run in it.runs]
    levels = {*prior.level.split(" + "), *(run.level for run in it.runs)}
    found = replace(
        prior, level=" + ".join(sorted(levels)), values=values, covariance_fit=parts["fit"],
        covariance_mesh=parts["mesh"], covariance_model=parts["model"], runs=rests(it, names),
        rejected=(*prior.rejected, *outside), origin={**prior.origin, **origin}, origin_std={**prior.origin_std, **std},
        provenance=provenance({f"{run.level} {name}": run.id for name, run in zip(names, it.runs, strict=True)},
                              prior=dict(prior.provenance)),
    )  # fmt: skip
    words = origin_words(it)
    fidelity = {
        "prior": {"level": prior.level, "inputs": len(prior.provenance.get("inputs", {}))}, **how,
        **bought(it, names, origin, craft), "shift": shifts(found, prior),
        "predicts": predictions(it, names, own, values), "origin": words,
    }  # fmt: skip
    fidelity["warnings"] = warnings(fidelity["shift"])
    slopes_told = {"order": list(origin), "covariance": covariance.tolist(), "method": dict.fromkeys(origin, words)}
    checks = [check.document() for check in consistency(replace(found, quality={**prior.quality}))]
    quality = {**prior.quality, "origin": slopes_told, "consistency": checks, "fidelity": fidelity}
    return replace(found, quality=quality)


@dataclass(frozen=True)
class Choice:
    """A captive test worth doing next.

    cost : of it.   spent : with those before it.   before, after : expected standard deviation of each wanted value.
    fall : of the mean of these over the prior's.
    """

    test: CaptiveTest
    cost: float
    spent: float
    before: Mapping[str, float]
    after: Mapping[str, float]
    fall: float


def choose(
    prior: Derivatives,
    craft: Craft,
    tests: Sequence[CaptiveTest],
    cost: Callable[[CaptiveTest], float],
    budget: float,
    *,
    wanted: Sequence[str] = ("Yuv", "Nuv", "Yur", "Nur"),
    error: ErrorModel | None = None,
    doubt: float = 0.0,
    alike: float = 0.0,
) -> tuple[Choice, ...]:
    """The tests worth doing in the dearer tank, in order: each time the one that is expected to buy most for its cost.

    Parameters
    ----------
    prior, error, doubt : as in ``correct``.
    tests : to choose from. Those out of the range of the model are left out, and those that say the same as one before
        them, such as mirror images: on a symmetrical mesh they are the same run.
    cost : of a test, in any unit, such as ``OpenFoamTank.schedule(craft, tests).costs``.   budget : in the same unit.
    wanted : terms, or ("index",) for the horizontal stability index.
    alike : share by which each load errs alike in all runs of a kind, as by a coarse mesh: with it, a second run of a
        kind tells less.

    Returns
    -------
    The choices, none when nothing within the budget helps. What each buys is what ``correct`` finds when the runs
    measure what the prior predicts; a load that differs has another error.

    Raises
    ------
    InputError
        A wanted term that the prior does not hold, an index without a value, costs that are not positive.

    Source     fedorov1972 (one run at a time by its gain), with the gain divided by the cost.
    Departure  Greedy: dear runs that only help together are not found.
    """
    runs = [LpmTank(prior.as_dict()).run(craft, test, Silent()) for test in tests]
    inside = {run.id for run in screen(runs)[0]} if runs else set()
    pool = [(test, run, float(cost(test))) for test, run in zip(tests, runs, strict=True) if run.id in inside]
    if any(not price > 0.0 for *_, price in pool):
        raise InputError("choose: a test without cost would always be taken. Give a cost above zero for each test.")
    belief = believe(about_point(prior, craft.origin_from_nose), doubt)
    names, rows = _wanted(belief, craft, tuple(wanted))
    groups = tuple(sorted({run.kind for _, run, _ in pool})) if alike > 0.0 else ()
    layout = Layout(len(belief.root), len(belief.slopes.values), groups)
    model = ErrorModel() if error is None else error
    pool, wide = _different(pool, [_expected(belief, layout, run, model, alike, local=False) for _, run, _ in pool])
    if tuple(wanted) == ("index",):
        wide = [_expected(belief, layout, run, model, alike, local=True) for _, run, _ in pool]
    padded = np.concatenate([rows, np.zeros((len(rows), layout.size - rows.shape[1]))], axis=1)
    return _greedy(
        [(test, price, a.rows) for (test, _, price), a in zip(pool, wide, strict=True)], names, padded, budget
    )


def _expected(belief: Belief, layout: Layout, run: Run, error: ErrorModel, alike: float, *, local: bool) -> Told:
    """What a run is expected to say."""
    samples = settled([run])
    mesh = alike * np.sqrt((samples.loads[0] ** 2).mean(axis=0))
    return told(belief, layout, run, samples, mesh, error, local=local)


Candidate = tuple[CaptiveTest, Run, float]


def _different(pool: Sequence[Candidate], said: Sequence[Told]) -> tuple[list[Candidate], list[Told]]:
    """The candidates of which none before, of the same cost or less, says the same of the terms."""
    order = sorted(range(len(pool)), key=lambda i: pool[i][2])
    kept: list[int] = []
    for i in order:
        size = np.abs(said[i].square).max()
        if all(np.abs(said[i].square - said[j].square).max() > SAME * size for j in kept):
            kept.append(i)
    return [pool[i] for i in kept], [said[i] for i in kept]


def _wanted(belief: Belief, craft: Craft, wanted: tuple[str, ...]) -> tuple[tuple[str, ...], Array]:
    """Names of the wanted values, and what each is per unit of z (s, k + p)."""
    if wanted == ("index",):
        row = index_row(belief, belief.prior.origin, craft)
        if row is None:
            raise InputError(
                "choose: the prior's slopes at the origin give the stability index no value to aim at. Aim at terms."
            )
        return (INDEX,), row[None]
    if missing := [name for name in wanted if name not in belief.terms.names]:
        raise InputError(f"choose: the prior holds no {', '.join(missing)}. It holds {', '.join(belief.terms.names)}.")
    return wanted, np.array([belief.root[belief.terms.index[belief.terms.names.index(name)]] for name in wanted])


def _greedy(
    pool: list[tuple[CaptiveTest, float, Array]], names: Sequence[str], rows: Array, budget: float
) -> tuple[Choice, ...]:
    """The choices, of candidates (test, cost, rows (r, x)). rows (s, x) : the wanted values per unit of the state."""
    left, chosen, spent = list(pool), [], 0.0
    q = np.eye(rows.shape[1])
    first = np.sqrt(np.einsum("si,ij,sj->s", rows, q, rows))
    first = np.where(first > 0.0, first, 1.0)
    while left:
        now = np.sqrt(np.einsum("si,ij,sj->s", rows, q, rows))
        falls = []
        for _, price, a in left:
            fall = float(((now - _after(q, a, rows)) / first).mean())
            falls.append(fall if spent + price <= budget and fall > WORTH else -np.inf)
        rate = np.array(falls) / np.array([price for _, price, _ in left])
        best = int(np.argmax(rate))
        if not np.isfinite(falls[best]):
            break
        test, price, a = left.pop(best)
        after = _after(q, a, rows)
        gain = q @ a.T
        q = q - gain @ np.linalg.solve(np.eye(len(a)) + a @ gain, gain.T)
        spent += price
        said = [dict(zip(names, std.tolist(), strict=True)) for std in (now, after)]
        chosen.append(Choice(test, price, spent, said[0], said[1], falls[best]))
    return tuple(chosen)


def _after(q: Array, a: Array, rows: Array) -> Array:
    """Standard deviations (s,) of the wanted values after a run with rows ``a`` (r, x)."""
    gain = a @ q
    seen = gain @ rows.T
    fall = np.einsum("rs,rs->s", seen, np.linalg.solve(np.eye(len(a)) + gain @ a.T, seen))
    return np.asarray(np.sqrt(np.maximum(np.einsum("si,ij,sj->s", rows, q, rows) - fall, 0.0)))
