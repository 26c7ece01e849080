"""Weights of the regression: how far each load of each run is trusted, and how steady and oscillatory tests share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.derive.cycles import family_of
from towtank.derive.system import System
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.symbols import LOADS
from towtank.tank.run import Run

FLOOR = 0.01
"""Smallest residual that is believed, as a share of the load's root mean square in the run (or kind, when steady)."""

WEIGHT_STEADY = {"slender": 0.7, "full": 0.5}
"""Default lambda: of slender craft, which drift far in a turn, and of fuller ones, for which both tests count alike.

Source     perron, section 2.2 (steady drift weighs more for slender craft, after Miller et al.); the numbers are this
           project's (THEORY section 4).
"""

SLENDER = 8.0
"""L/D above which a craft is slender."""

PAIRS = (("drift", "sway", "YKN"), ("incidence", "heave", "ZM"))
"""Steady kind, oscillatory kind, and the loads on which lambda shares the weight between the two."""

_END = 1e-6  # at lambda 0 or 1 the outvoted side keeps this share, so that Yvdot and the like stay determined


def default_share(runs: Sequence[Run]) -> float:
    """Share lambda by the slenderness L/D of the hull; that of slender craft where the diameter is not known."""
    known = [run.length / run.diameter for run in runs if run.diameter > 0.0]
    return WEIGHT_STEADY["slender" if not known or known[0] > SLENDER else "full"]


def load_scale(system: System) -> Array:
    """Root mean square (6,) of each load over all runs, each run counting once; never zero."""
    scale = np.sqrt((system.power / system.count[:, None]).mean(axis=0))
    return np.asarray(np.where(scale > 0.0, scale, np.where(scale.max() > 0.0, scale.max(), 1.0)))


def spread(system: System, runs: Sequence[Run], unknowns: Array) -> Array:
    """Standard deviation (R, 6) of each load of each run about the fit ``unknowns`` (n,).

    An oscillation is judged by its own residual. A steady run is a single number, so the steady runs of one kind share
    theirs; mixed ones (a turn with drift) are a kind of their own. Never below FLOOR of the load, nor 1e-3 of the
    load's size over all runs.
    """
    mean_square = system.squares(unknowns) / system.count[:, None]
    power = system.power / system.count[:, None]
    families = [family_of(run) for run in runs]
    for kind in {name for name, run in zip(families, runs, strict=True) if run.steady}:
        at = [i for i, name in enumerate(families) if name == kind]
        mean_square[at], power[at] = mean_square[at].mean(axis=0), power[at].mean(axis=0)
    smallest = np.maximum(FLOOR**2 * power, (1e-3 * load_scale(system)) ** 2)
    return np.asarray(np.sqrt(np.maximum(mean_square, smallest)))


def family(system: System, runs: Sequence[Run], weight_steady: float) -> Array:
    """Weight (R, 6) of a sample of each load of each run before its spread is considered.

    A run counts once, however finely it was sampled. Where steady and oscillatory tests of the same motion are both
    there, J = (1 - lambda) J_vpmm / n_vpmm + lambda J_steady / n_steady shares their joint weight.

    Source     perron, section 2.3, which refers to Miller et al. for the weighting of steady drift.
    Departure  The formula of Miller et al. is not public; the form of J is this project's.
    Valid      0 <= lambda <= 1.
    """
    if not 0.0 <= weight_steady <= 1.0:
        raise DeriveError(
            f"derive: weight_steady is {weight_steady:g}. It is the share of steady drift against sway, "
            "so it lies between 0 (sway only) and 1 (steady drift only)."
        )
    share = np.repeat(1.0 / system.count[:, None], 6, axis=1)
    lam = min(max(weight_steady, _END), 1.0 - _END)
    for steady, oscillatory, loads in PAIRS:
        a = [i for i, run in enumerate(runs) if family_of(run) == steady]
        b = [i for i, run in enumerate(runs) if run.kind == oscillatory]
        if a and b:
            for load in (LOADS.index(name) for name in loads):
                share[a, load] = lam * (len(a) + len(b)) / system.count[a].sum()
                share[b, load] = (1.0 - lam) * (len(a) + len(b)) / system.count[b].sum()
    return share
