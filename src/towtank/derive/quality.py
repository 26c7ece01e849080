"""What is said about a fit beside its values: residuals, sensitivity, symmetry gaps, which run feeds which term."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from towtank.derive import weights
from towtank.derive.cycles import Samples, scatter
from towtank.derive.expand import Expansion
from towtank.derive.identify import Solved
from towtank.derive.regress import solve
from towtank.derive.select import Choice, independent
from towtank.derive.system import build
from towtank.frames import Array
from towtank.symbols import FOURFOLD_TIES, LOADS, STANDING
from towtank.tank.run import Run
from towtank.terms import term_loads

KEY_TERMS = ("Yuv", "Yvv", "Nuv", "Nvv", "Yur", "Yrr", "Nur", "Nrr", "Zuw", "Zww", "Muw", "Mww", "Xvv")
SENSITIVITY = (0.0, 0.5, 1.0)
"""Values of lambda at which the key terms are found again."""

RESTS = 0.01
"""Smallest share of the information on a term for which a run is named."""


def rests_on(expansion: Expansion, solved: Solved, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Term -> names of the runs that hold at least ``RESTS`` of the information on it."""
    system = solved.system
    information = np.zeros((len(names), len(system.names)))
    np.add.at(information, system.run, system.matrix**2 * solved.weight[system.run, system.load][:, None])
    share = information / np.maximum(information.sum(axis=0), 1e-300)
    carried = (share > RESTS).astype(float) @ np.abs(expansion.matrix.T) > 0.0
    return {
        term: tuple(name for name, there in zip(names, carried[:, j], strict=True) if there)
        for j, term in enumerate(expansion.names)
    }


def residuals(solved: Solved, names: Sequence[str]) -> dict[str, dict[str, dict[str, float]]]:
    """Run -> load -> root mean square residual [N, N m], and its share of the load's root mean square.

    Loads that are zero in a run are left out.
    """
    system = solved.system
    rms = np.sqrt(system.squares(solved.fit.unknowns[:, 0]) / system.count[:, None])
    size = np.sqrt(system.power / system.count[:, None])
    smallest = 1e-6 * weights.load_scale(system)
    return {
        name: {
            load: {"rms": float(rms[i, k]), "share": float(rms[i, k] / size[i, k])}
            for k, load in enumerate(LOADS)
            if size[i, k] > smallest[k]
        }
        for i, name in enumerate(names)
    }


def sensitivity(solved: Solved, expansion: Expansion, runs: Sequence[Run]) -> dict[str, dict[str, float]]:
    """Term -> lambda -> value, for the key terms."""
    out: dict[str, dict[str, float]] = {term: {} for term in KEY_TERMS if term in expansion.names}
    for lam in SENSITIVITY:
        share = weights.family(solved.system, runs, lam)
        if solved.trust is not None:
            share = share * solved.trust[:, None]
        nominal = replace(solved.system, rhs=solved.system.rhs[:, :1])
        values = expansion.matrix @ solve(nominal, share / solved.spread**2).unknowns[:, 0]
        for term in out:
            out[term][f"{lam:g}"] = float(values[expansion.names.index(term)])
    return out


def tie_gaps(runs: Sequence[Run], samples: Samples, solved: Solved) -> dict[str, dict[str, float]]:
    """Vertical-plane terms of a 4-fold craft found without the ties, against what the ties give them.

    Empty without heave, pitch or incidence runs.
    """
    if runs[0].symmetry != "fourfold" or not any(run.kind in ("heave", "pitch", "incidence") for run in runs):
        return {}
    names = tuple(name for name in solved.choice.order if name in STANDING)
    free = Choice(names, {name: (name, 1.0) for name in names}, {})
    nominal = replace(samples, loads=samples.loads[:1] - _optional_loads(samples, solved))
    system = build(nominal, free)
    scale = weights.load_scale(system)
    kept, reasons = independent(system.matrix / scale[system.load][:, None], names)
    free, system = free.keep([names[i] for i in kept], reasons), system.keep(kept)
    own = solve(system, solved.weight).unknowns[:, 0]
    out = {}
    for term, (base, sign) in FOURFOLD_TIES.items():
        if term in system.names and base in solved.system.names:
            tied = sign * float(solved.fit.unknowns[solved.system.names.index(base), 0])
            value = float(own[system.names.index(term)])
            out[term] = {"untied": value, "tied": tied, "difference": value - tied}
    return out


def _optional_loads(samples: Samples, solved: Solved) -> Array:
    """Loads (N, 6) of the optional terms as the ties give them: one check run of a plane cannot tell them apart."""
    unknowns = dict(zip(solved.system.names, solved.fit.unknowns[:, 0].tolist(), strict=True))
    values = {
        name: sign * unknowns[base]
        for name, (base, sign) in solved.choice.members.items()
        if name not in STANDING and base in unknowns
    }
    return term_loads(values, samples.nu, samples.nudot, samples.control)


def period_change(samples: Samples, names: Sequence[str]) -> dict[str, float]:
    """Run -> change of the loads from one settled period to the next, as a share of their root mean square.

    Source     THEORY section 8: below 1 % a cycle has settled.
    """
    change = scatter(samples, len(names))
    out = {}
    edges = np.searchsorted(samples.run, np.arange(len(names) + 1))
    for i, name in enumerate(names):
        power = (samples.loads[0, edges[i] : edges[i + 1]] ** 2).mean(axis=0)
        if np.isfinite(change[i]).all() and power.max() > 0.0:
            seen = power > 1e-6 * power.max()
            out[name] = float(np.sqrt((2.0 * change[i, seen] / power[seen]).max()))
    return out


def summary(
    runs: Sequence[Run], names: Sequence[str], samples: Samples, solved: Solved, expansion: Expansion
) -> dict[str, Any]:
    """The numbers of a fit as plain JSON content."""
    return {
        "condition_number": solved.fit.condition,
        "residual_floor": weights.FLOOR,
        "blocks": {"unit": solved.unit, "number": solved.blocks},
        "members": samples.loads.shape[0] - 1,
        "sensitivity": sensitivity(solved, expansion, runs),
        "gated": solved.gated,
        "not_excited": {k: v for k, v in solved.choice.left_out.items() if k not in solved.gated
                        and k not in expansion.copied},
        "by_reciprocity": expansion.copied,
        "symmetry_gaps": expansion.gaps,
        "tie_gaps": tie_gaps(runs, samples, solved),
        "residuals": residuals(solved, names),
        "period_change": period_change(samples, names),
        "flags": {name: list(run.flags) for name, run in zip(names, runs, strict=True) if run.flags},
    }  # fmt: skip
