"""Spacing of points: the first cell at the wall from y+ and Re, geometric growth, and size functions along a line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from towtank.errors import TankError
from towtank.frames import Array

LOWEST_REYNOLDS = 1e4
"""Below it no turbulent friction line holds and y+ has no meaning."""


def friction(reynolds: float) -> float:
    """Mean friction coefficient of a flat plate.

    Source     ittc75020602: the ITTC-57 line, 0.075 / (log10 Re - 2)^2.
    Valid      Turbulent flow. Local friction is a tenth below the mean at Re 1e7, so y+ is on the high side.
    """
    return float(0.075 / (np.log10(max(reynolds, LOWEST_REYNOLDS)) - 2.0) ** 2)


def first_cell(y_plus: float, speed: float, length: float, viscosity: float) -> float:
    """Height [m] of the cell at the wall whose centre lies at ``y_plus`` on a plate of ``length`` [m].

    ``speed`` [m/s], ``viscosity`` (kinematic) [m2/s]. The friction velocity is that of ``friction``.
    """
    shear = speed * np.sqrt(0.5 * friction(speed * length / viscosity))
    return float(2.0 * y_plus * viscosity / shear)


def geometric(first: float, count: int, total: float) -> Array:
    """Positions (count + 1,) from 0 to ``total`` whose steps grow by one ratio from ``first``."""
    if first * count >= total:
        return np.linspace(0.0, total, count + 1)
    ratio = brentq(lambda q: first * np.expm1(count * np.log(q)) - total * (q - 1.0), 1.0 + 1e-9, 1e3)
    steps = ratio ** np.arange(count)
    return np.asarray(np.r_[0.0, np.cumsum(steps)] * total / steps.sum())


def two_sided(first: float, last: float, count: int, total: float) -> Array:
    """Positions (count + 1,) from 0 to ``total``: steps ``first`` and ``last`` at the ends, growing alike inwards."""
    x = np.linspace(0.0, total, 801)

    def spent(growth: float) -> Array:
        return cumulative(x, np.minimum(first + growth * x, last + growth * (total - x)))

    least = -0.9 * min(first, last) / total
    if spent(least)[-1] <= count:
        growth = least
    elif spent(20.0)[-1] >= count:
        growth = 20.0
    else:
        growth = brentq(lambda g: spent(g)[-1] - count, least, 20.0)
    cells = spent(growth)
    return np.asarray(np.interp(np.arange(count + 1), cells * count / cells[-1], x))


def cumulative(s: Array, size: Array) -> Array:
    """Cells (n,) spent from the start of the line ``s`` (n,) [m] when they have the local ``size`` (n,) [m]."""
    return np.asarray(np.r_[0.0, np.cumsum(0.5 * (1.0 / size[1:] + 1.0 / size[:-1]) * np.diff(s))])


def scaled(s: Array, size: Callable[[float], Array], count: float) -> Array:
    """Cells (n,) spent along ``s`` (n,) for the member of the family ``size(growth)`` that spends ``count`` in all.

    The growth of size away from fine places is what gives: it lies between 0.01 and 3.

    Raises
    ------
    TankError
        Even the fastest growth needs more cells.
    """
    if cumulative(s, size(3.0))[-1] > count:
        raise TankError(
            f"{count:g} cells along the hull do not reach: the caps and fins alone take "
            f"{cumulative(s, size(3.0))[-1]:.0f}. Raise `along`, or lower `around`, which sets the cells of the caps."
        )
    growth = 0.01
    if cumulative(s, size(growth))[-1] > count:
        growth = brentq(lambda g: cumulative(s, size(g))[-1] - count, 0.01, 3.0)
    cells = cumulative(s, size(growth))
    return np.asarray(cells * count / cells[-1])
