"""From captive runs to derivatives: one weighted regression over all runs and all six loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import mode
from typing import TYPE_CHECKING, Any

import numpy as np

from towtank.derive import quality, weights
from towtank.derive.consistency import consistency
from towtank.derive.convert import about_point
from towtank.derive.cycles import settled
from towtank.derive.expand import Expansion, expand
from towtank.derive.fin_fit import fit_fin_curve
from towtank.derive.fourier import fourier
from towtank.derive.identify import Method, identify
from towtank.derive.mesh import mesh_covariance
from towtank.derive.origin import Origin, origin_slopes
from towtank.derive.regress import Covariance, block_jackknife
from towtank.derive.robust import Loss
from towtank.derive.screen import DRIFT_LIMIT_DEG, FIN_LIMIT_DEG, name_of, screen
from towtank.derive.table import Derivatives, Reference
from towtank.derive.verdicts import Judged, Verdict, judged
from towtank.frames import Array
from towtank.provenance import provenance
from towtank.tank.run import Run

if TYPE_CHECKING:
    from towtank.grid.study import GridStudy


def derive(
    runs: Sequence[Run],
    *,
    weight_steady: float | None = None,
    about: float | None = None,
    length: float | None = None,
    mix_levels: bool = False,
    screening: bool = True,
    grid: GridStudy | None = None,
    optional: Sequence[str] = (),
    covariance: Covariance = block_jackknife,
    loss: Loss | None = None,
) -> Derivatives:
    """Derivatives of a craft from its captive runs.

    Parameters
    ----------
    runs : of one craft, in one water, about one origin.
    weight_steady : lambda, the share of steady drift (incidence) against sway (heave); by default 0.7 for L/D > 8 and
        0.5 for fuller craft. ``quality["sensitivity"]`` shows what 0, 0.5 and 1 would give.
    about : distance aft of the nose [m] of the point the result refers to; the runs' origin by default.
    length : reference length [m] of the primed values; the runs' by default.
    mix_levels : allow runs of several levels of evidence in one fit.
    screening : test every run against the fit to the others; without it, only the range of the model decides.
    grid : study of the runs' meshes, whose uncertainty enters the weights and the covariance ``mesh``.
    optional : groups of ``symbols.OPTIONAL`` to fit as well: "third-order", "Xuuvv".
    covariance : estimator of the fit's covariance, out of ``derive.regress``.   loss : ``derive.robust.huber``, or None
        for least squares.

    Returns
    -------
    Derivatives in SI with covariance, variant "lumped". Main values are the wide-range fit; ``origin`` the slopes;
    ``fin_curve`` the fin loads beyond the linear range, where straight runs go there.

    Raises
    ------
    DeriveError
        No runs, numbers that are not finite, runs that do not belong together, or nothing that can be identified.
    InputError
        A grid study of another craft, level or mesh.

    Source     perron, sections 2.2 and 2.3; THEORY sections 2 to 4.
    Departure  One regression on all samples in place of formulae per test; docs/derive.md.
    Valid      Drift to 20 deg, fins to 20 deg, ahead.
    """
    within, outside = screen(tuple(runs), mix_levels)
    share = weights.default_share(within) if weight_steady is None else float(weight_steady)
    mesh = _mesh(grid, within)
    method = Method(share, tuple(optional), covariance, loss)
    found = judged(within, method, mesh) if screening else _unjudged(within, method, mesh)
    result = _derivatives(_Fitted(tuple(runs), outside, found, method))
    checks = [check.document() for check in consistency(result)]
    return about_point(replace(result, quality={**result.quality, "consistency": checks}), about, length)


@dataclass(frozen=True)
class _Fitted:
    """What a set of derivatives is made of. outside : (name, reason) of the runs beyond the range of the model."""

    given: tuple[Run, ...]
    outside: tuple[tuple[str, str], ...]
    judged: Judged
    method: Method


def _mesh(grid: GridStudy | None, runs: Sequence[Run]) -> Array | None:
    if grid is None:
        return None
    from towtank.grid.spread import mesh_uncertainty

    return mesh_uncertainty(grid, runs)


def _unjudged(runs: tuple[Run, ...], method: Method, mesh: Array | None) -> Judged:
    samples = settled(runs)
    return Judged(runs, samples, identify(runs, samples, method, mesh=mesh), {}, mesh)


def _derivatives(it: _Fitted) -> Derivatives:
    runs, samples, solved = it.judged.runs, it.judged.samples, it.judged.solved
    unknowns = solved.fit.unknowns
    expansion = expand(solved.choice, runs[0].symmetry, unknowns[:, 0], solved.covariance)
    members = expansion.matrix @ unknowns
    spread = members[:, 1:] - members[:, :1]
    names = [name_of(run, it.given) for run in runs]
    terms = dict(zip(expansion.names, members, strict=True))
    origin = origin_slopes(runs, samples, terms)
    curve, no_curve = fit_fin_curve(_not_rejected(it), terms)
    flat = np.zeros((len(members), len(members)))
    return Derivatives(
        craft=runs[0].craft,
        level=" + ".join(sorted({run.level for run in runs})),
        variant="lumped",
        reference=Reference(runs[0].length, mode(run.speed for run in runs), runs[0].density, runs[0].origin_from_nose),
        names=expansion.names,
        values=members[:, 0],
        covariance_fit=expansion.matrix @ solved.covariance @ expansion.matrix.T,
        covariance_mesh=mesh_covariance(runs, solved, expansion, it.judged.mesh),
        covariance_model=spread @ spread.T / spread.shape[1] if spread.shape[1] else flat,
        runs=quality.rests_on(expansion, solved, names),
        rejected=(*it.outside, *it.judged.rejected),
        origin=origin.values,
        origin_std=origin.std,
        quality=_quality(it, names, expansion, origin, spread) | ({"fin_curve": no_curve} if no_curve else {}),
        provenance=provenance({name: run.id for name, run in zip(names, runs, strict=True)}),
        fin_curve=curve,
    )


def _not_rejected(it: _Fitted) -> tuple[Run, ...]:
    """The runs given, those beyond the range of the model among them, without those that screening rejected."""
    rejected = {name for name, _ in it.judged.rejected}
    return tuple(run for run in it.given if name_of(run, it.given) not in rejected)


def _quality(it: _Fitted, names: Sequence[str], expansion: Expansion, origin: Origin, spread: Array) -> dict[str, Any]:
    """Numbers about the fit. spread (terms, members) : model-form ensemble of the terms less their nominal values."""
    runs, samples = it.judged.runs, it.judged.samples
    return {
        "symmetry": runs[0].symmetry,
        "body": {"diameter": runs[0].diameter},
        "weight_steady": it.method.weight_steady,
        "range_deg": DRIFT_LIMIT_DEG,
        "fins_range_deg": FIN_LIMIT_DEG,
        "runs": len(runs),
        "samples": int(samples.run.size),
        "screening": _screening(it),
        **quality.summary(runs, names, samples, it.judged.solved, expansion),
        "origin": {
            "method": origin.method,
            "order": list(origin.values),
            "covariance": origin.covariance.tolist(),
            "with_terms": (origin.spread @ spread.T / max(spread.shape[1], 1)).tolist() if origin.values else [],
        },
        "fourier": fourier(runs, samples),
    }


def _screening(it: _Fitted) -> dict[str, Any]:
    """Run -> verdict as plain content, in the order of the runs given: of all of them, or none without screening."""
    if not it.judged.verdicts:
        return {}
    why = dict(it.outside)
    exploratory = {name_of(run, it.given) for run in it.given if run.exploratory}
    beyond = {
        name: Verdict("exploratory" if name in exploratory else "rejected", 0.0, reason) for name, reason in why.items()
    }
    found = {**beyond, **it.judged.verdicts}
    return {name: found[name].document() for name in (name_of(run, it.given) for run in it.given)}
