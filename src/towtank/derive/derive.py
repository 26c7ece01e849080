"""From captive runs to derivatives: one weighted regression over all runs and all six loads."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import mode

import numpy as np

from towtank.derive import quality, weights
from towtank.derive.convert import about_point
from towtank.derive.cycles import settled
from towtank.derive.expand import expand
from towtank.derive.fourier import fourier
from towtank.derive.identify import identify
from towtank.derive.origin import origin_slopes
from towtank.derive.screen import DRIFT_LIMIT_DEG, FIN_LIMIT_DEG, name_of, screen
from towtank.derive.table import Derivatives, Reference
from towtank.provenance import provenance
from towtank.tank.run import Run


def derive(
    runs: Sequence[Run],
    *,
    weight_steady: float | None = None,
    about: float | None = None,
    length: float | None = None,
    mix_levels: bool = False,
) -> Derivatives:
    """Derivatives of a craft from its captive runs.

    Parameters
    ----------
    runs : of one craft, in one water, about one origin.
    weight_steady : lambda, the share of steady drift (incidence) against sway (heave); 0.7 by default, the value for
        L/D > 8; give 0.5 for fuller craft. ``quality["sensitivity"]`` shows what 0, 0.5 and 1 would give.
    about : distance aft of the nose [m] of the point the result refers to; the runs' origin by default.
    length : reference length [m] of the primed values; the runs' by default.
    mix_levels : allow runs of several levels of evidence in one fit.

    Returns
    -------
    Derivatives in SI with covariance, variant "lumped". Main values are the wide-range fit; ``origin`` the slopes.

    Raises
    ------
    DeriveError
        No runs, numbers that are not finite, runs that do not belong together, or nothing that can be identified.

    Source     perron, sections 2.2 and 2.3; THEORY sections 2 to 4.
    Departure  One regression on all samples in place of formulae per test; docs/derive.md.
    Valid      Drift to 20 deg, fins to 20 deg, ahead.
    """
    share = weights.WEIGHT_STEADY if weight_steady is None else float(weight_steady)
    kept, rejected = screen(tuple(runs), mix_levels)
    samples = settled(kept)
    solved = identify(kept, samples, share)
    unknowns = solved.fit.unknowns
    expansion = expand(solved.choice, kept[0].symmetry, unknowns[:, 0], solved.covariance)
    members = expansion.matrix @ unknowns
    spread = members[:, 1:] - members[:, :1]
    names = [name_of(run, kept) for run in kept]
    origin = origin_slopes(kept, samples, dict(zip(expansion.names, members, strict=True)))
    flat = np.zeros((len(members), len(members)))
    result = Derivatives(
        craft=kept[0].craft,
        level=" + ".join(sorted({run.level for run in kept})),
        variant="lumped",
        reference=Reference(kept[0].length, mode(run.speed for run in kept), kept[0].density, kept[0].origin_from_nose),
        names=expansion.names,
        values=members[:, 0],
        covariance_fit=expansion.matrix @ solved.covariance @ expansion.matrix.T,
        covariance_mesh=flat,
        covariance_model=spread @ spread.T / spread.shape[1] if spread.shape[1] else flat.copy(),
        runs=quality.rests_on(expansion, solved, names),
        rejected=rejected,
        origin=origin.values,
        origin_std=origin.std,
        quality={
            "weight_steady": share,
            "range_deg": DRIFT_LIMIT_DEG,
            "fins_range_deg": FIN_LIMIT_DEG,
            "runs": len(kept),
            "samples": int(samples.run.size),
            **quality.summary(kept, names, samples, solved, expansion),
            "origin": {
                "method": origin.method,
                "order": list(origin.values),
                "covariance": origin.covariance.tolist(),
            },
            "fourier": fourier(kept, samples),
        },
        provenance=provenance({name: run.id for name, run in zip(names, kept, strict=True)}),
    )
    return about_point(result, about, length)
