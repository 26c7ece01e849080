"""The regression from choice of terms to covariance: weights found from the data, roll terms gated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from towtank.derive import weights
from towtank.derive.cycles import Samples
from towtank.derive.regress import Covariance, Fit, block_jackknife, solve
from towtank.derive.robust import Loss
from towtank.derive.select import Choice, choose, independent
from towtank.derive.system import System, build
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.tank.run import Run

SIGNIFICANT = 3.0
"""Standard deviations a gated roll term must reach to enter the model of a craft whose symmetry allows it."""

REPEATED = 0.5
"""Share of a residual that repeats from period to period above which a run is one block, not each of its periods."""


@dataclass(frozen=True)
class Solved:
    """A regression. share, spread, weight (R, 6) : family weight times trust, standard deviation, weight of a sample.

    covariance (n, n) of the nominal unknowns, from ``blocks`` blocks of the kind ``unit``.
    gated : roll term -> value, std, in_model, why.   trust (R,) : factor on the weight of each run; None for ones.
    """

    choice: Choice
    system: System
    share: Array
    spread: Array
    weight: Array
    fit: Fit
    covariance: Array
    blocks: int
    unit: str
    gated: dict[str, dict[str, Any]] = field(default_factory=dict)
    trust: Array | None = None


@dataclass(frozen=True)
class Method:
    """How runs are fitted.

    weight_steady : lambda, the share of steady drift against sway, 0 to 1.
    optional : groups of ``symbols.OPTIONAL`` that are fitted as well.
    covariance : estimator out of ``regress``.   loss : ``robust.huber`` for a first fit that bad runs do not pull, and
        weights that fall with their residual in it; None for least squares.
    """

    weight_steady: float
    optional: Sequence[str] = ()
    covariance: Covariance = block_jackknife
    loss: Loss | None = None


def identify(
    runs: Sequence[Run],
    samples: Samples,
    method: Method,
    *,
    trust: Array | None = None,
    mesh: Array | None = None,
) -> Solved:
    """Choose the terms, weigh the runs by what is left of a first unweighted fit, solve, and gate the roll terms.

    Parameters
    ----------
    trust (R,) : factor on the weight of each run, 0 < t <= 1; None for ones.
    mesh (R, 6) : standard discretisation uncertainty of each load of each run [N, N m]; its square adds to the square
        of the residual that sets the weight. None where no grid study was made.

    Raises
    ------
    DeriveError
        The runs excite nothing, an unknown group of terms, lambda or ``trust`` outside 0..1.
    """
    factor = _trust(runs, trust)
    choice, system = _assemble(runs, samples, method.optional)
    plain = 1.0 / (system.count[:, None] * weights.load_scale(system) ** 2)
    lowered = np.ones_like(plain) if method.loss is None else method.loss(system, plain)
    first = solve(system, plain * lowered)
    spread = weights.spread(system, runs, first.unknowns[:, 0]) / np.sqrt(lowered)
    if mesh is not None:
        spread = np.hypot(spread, mesh)
    share = weights.family(system, runs, method.weight_steady) * factor[:, None]
    solved = weighted(choice, system, spread, share, method.covariance)
    gated = _gate(solved, runs[0].symmetry)
    out = {name: str(entry["why"]) for name, entry in gated.items() if not entry["in_model"]}
    if out:
        left = [i for i, name in enumerate(system.names) if name not in out]
        choice, system = choice.keep([system.names[i] for i in left], out), system.keep(left)
        solved = weighted(choice, system, spread, share, method.covariance)
    return replace(solved, gated=gated, trust=factor)


def _assemble(runs: Sequence[Run], samples: Samples, optional: Sequence[str]) -> tuple[Choice, System]:
    """The terms that the runs tell apart, and their linear system."""
    choice = choose(runs, samples, optional)
    if not choice.unknowns:
        raise DeriveError(
            "derive: the runs excite no term of the model. Give runs with speed, drift or an oscillation."
        )
    system = build(samples, choice)
    scale = weights.load_scale(system)
    kept, reasons = independent(system.matrix / scale[system.load][:, None], system.names)
    return choice.keep([system.names[i] for i in kept], reasons), system.keep(kept)


def _trust(runs: Sequence[Run], trust: Array | None) -> Array:
    """``trust`` checked; ones for None."""
    factor = np.ones(len(runs)) if trust is None else np.asarray(trust, dtype=float)
    if factor.shape != (len(runs),) or not ((factor > 0.0) & (factor <= 1.0)).all():
        raise DeriveError(
            f"derive: trust has shape {factor.shape} and lies outside 0..1 for {len(runs)} runs. It is a factor on the "
            "weight of each run, above 0 and at most 1; leave a run out to give it none."
        )
    return factor


def weighted(
    choice: Choice, system: System, spread: Array, share: Array, covariance: Covariance = block_jackknife
) -> Solved:
    """Solve with given spread and family weight (R, 6), with the covariance of independent blocks."""
    weight = share / spread**2
    fit = solve(system, weight)
    squares = weight * system.squares(fit.unknowns[:, 0])
    misfit = float(squares.sum() / (share * system.count[:, None]).sum())
    whole = _repeats(system, weight, squares)
    block = system.run if whole else system.run * (int(system.period.max()) + 1) + system.period
    estimate, blocks = covariance(fit, block, misfit), len(np.unique(block))
    unit = "run" if whole else "run and period"
    return Solved(choice, system, share, spread, weight, fit, estimate, blocks, unit)


def _repeats(system: System, weight: Array, squares: Array) -> bool:
    """True when most of the residual is the same in each period, so that periods are no independent witnesses."""
    seen = np.isfinite(system.fresh)
    residual = float(squares[seen].sum())
    fresh = float((weight * system.count[:, None] * np.where(seen, system.fresh, 0.0))[seen].sum())
    return residual > 0.0 and 1.0 - fresh / residual > REPEATED


def _gate(solved: Solved, symmetry: str) -> dict[str, dict[str, Any]]:
    """Value and standard uncertainty of each roll term that must vanish, or prove itself, and whether it enters."""
    forbidden = symmetry in ("fourfold", "mirror")
    power = solved.system.power[:, 3].sum()
    out: dict[str, dict[str, Any]] = {}
    for name in solved.choice.gated:
        i = solved.system.names.index(name)
        value, std = float(solved.fit.unknowns[i, 0]), float(np.sqrt(max(solved.covariance[i, i], 0.0)))
        effect = float(((solved.system.matrix[:, i] * value) ** 2).sum())
        significant = bool(abs(value) > SIGNIFICANT * std and effect > 1e-12 * power)
        why = "" if significant else f"within {SIGNIFICANT:g} standard deviations of zero"
        if forbidden:
            why = f"{symmetry} symmetry makes it zero" + (", yet the runs show it" if significant else "")
        out[name] = {"value": value, "std": std, "in_model": significant and not forbidden, "why": why}
    return out
