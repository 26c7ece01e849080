"""Robust regression: a load of a run that fits badly loses weight instead of pulling the fit towards itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from towtank.derive.regress import solve
from towtank.derive.system import System
from towtank.errors import DeriveError
from towtank.frames import Array

Loss = Callable[[System, Array], Array]
"""Gives the factor (R, 6) on the weight (R, 6) of each load of each run."""

TUNING = 1.345
"""Residual, in standard deviations, up to which the loss is quadratic: 95 % efficient on normal errors (huber1964)."""

_NORMAL = 0.6744897501960817  # median of the absolute value of a standard normal variable
_ROUNDS, _CLOSE = 100, 1e-8
_NO_LOAD = 1e-6  # share of the largest load of its kind below which a run has none: round-off, as in quality.residuals
_BELIEVED = 1e-3  # smallest scale, as a share of the load's rms over the runs that hold it: exact data stay exact


def huber(system: System, weight: Array) -> Array:
    """Factor (R, 6), 0 to 1, by which Huber's loss lowers the weight of each load of each run.

    The unit is a load of a run, not a sample: its residual is the root mean square over the run, in units of the
    weight. The scale of each load is the median of these over the runs that hold it, taken as that of normal errors,
    and at least a thousandth of the load.

    weight (R, 6) : of a sample of each load of each run, before the factor.

    Raises
    ------
    DeriveError
        The factors do not settle.

    Source     huber1964; the scale by the median absolute residual and the iteration by reweighting are those of
               statsmodels' RLM, with which a test agrees.
    Valid      Fewer than half of the runs are wrong, and none of them alone determines a term.
    """
    nominal, factor = replace(system, rhs=system.rhs[:, :1]), np.ones_like(weight)
    loads = np.sqrt(weight * system.power)
    held = loads > _NO_LOAD * loads.max(axis=0)
    for _ in range(_ROUNDS):
        size = np.sqrt(weight * system.squares(solve(nominal, weight * factor).unknowns[:, 0]))
        former, factor = factor, _factor(size, loads, held)
        if np.abs(factor - former).max() < _CLOSE:
            return factor
    raise DeriveError(
        f"derive: the robust weights of the runs have not settled after {_ROUNDS} rounds. Most runs then disagree with "
        "each other; look at the residuals, or fit without a robust loss."
    )


def _factor(size: Array, loads: Array, held: NDArray[np.bool_]) -> Array:
    """Huber's weights of the residuals ``size`` (R, 6), load by load; ``held`` (R, 6) where a run has the load."""
    factor = np.ones_like(size)
    for load in range(size.shape[1]):
        at = held[:, load]
        if at.any():
            least = _BELIEVED * np.sqrt((loads[at, load] ** 2).mean())
            scale = max(float(np.median(size[at, load])) / _NORMAL, least)
            factor[at, load] = np.minimum(1.0, TUNING * scale / np.maximum(size[at, load], least))
    return factor
