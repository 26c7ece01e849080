"""More than three meshes: a power law by weighted least squares, with its scatter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from towtank.frames import Array

LOWEST, HIGHEST = 0.5, 2.0
"""Observed orders that are believed; outside them an expansion of fixed order is fitted instead."""
STEEPEST = 10.0
"""Bound on the search for the order, both ways."""
STEPS = 81
"""Points of the first search for the order; the best one is then refined."""
ALTERNATIVES = ((1.0,), (2.0,), (1.0, 2.0))
"""Orders of the expansions that stand in for an order not believed."""


@dataclass(frozen=True)
class PowerFit:
    """phi = limit + sum of a_k h^(p_k), fitted to n values.

    order : the observed order of the one-term fit; ``used`` the orders of the fit kept.
    limit : value at h = 0.   fitted (n,) : of the fit at the meshes.   scatter : standard deviation about it.
    """

    order: float
    used: tuple[float, ...]
    limit: float
    fitted: Array
    scatter: float


def observed_fit(phi: Array, size: Array) -> tuple[float, bool]:
    """Order of the best one-term fit of values (n,) over sizes (n,), and whether it is the weighted one (1/h).

    Source     eca2014, section 3: unweighted and weighted, the one with less scatter is kept.
    """
    found = [(_search(phi, size, weights), weighted) for weights, weighted in _weights(size)]
    (_, order), weighted = min(found, key=lambda item: item[0][0])
    return order, weighted


def power_fit(phi: Array, size: Array) -> PowerFit:
    """Fit of a monotone set of n > 3 values.

    Parameters
    ----------
    phi, size : (n,) values and representative mesh sizes.

    Source     eca2014: weights 1/h or none, whichever leaves less scatter; phi0 + a h^p when 0.5 <= p <= 2; for a
               larger p the better of a h and a h^2; for a smaller one also a h + b h^2.
    Departure  The two-term expansion needs five meshes, so that its scatter keeps two degrees of freedom.
    Valid      Values that converge: the caller looks at the sign of the order first.
    """
    order, _ = observed_fit(phi, size)
    if LOWEST <= order <= HIGHEST:
        kinds: tuple[tuple[float, ...], ...] = ((order,),)
    else:
        kinds = tuple(kind for kind in ALTERNATIVES if len(kind) == 1 or (order < LOWEST and len(phi) > 4))
    fits = [
        (*_linear(phi, size, weights, kind, kind[0] == order), kind) for kind in kinds for weights, _ in _weights(size)
    ]
    scatter, limit, fitted, used = min(fits, key=lambda item: item[0])
    return PowerFit(order, used, limit, fitted, scatter)


def difference_order(phi: Array, size: Array) -> float:
    """Order p at which the changes shrink: |change| over the step in h goes with h^(p - 1). Infinite without two.

    It tells an oscillation that closes in (p > 0) from one that grows.

    Source     eca2014 and its forerunner: an oscillatory set converges when its differences shrink.
    """
    change, step = np.abs(np.diff(phi)), -np.diff(size)
    kept = change > 0.0
    if kept.sum() < 2:
        return math.inf
    h = np.sqrt(size[1:] * size[:-1])
    return 1.0 + float(np.polyfit(np.log(h[kept]), np.log(change[kept] / step[kept]), 1)[0])


def _weights(size: Array) -> tuple[tuple[Array, bool], ...]:
    inverse = 1.0 / size
    return (np.full(len(size), 1.0 / len(size)), False), (inverse / inverse.sum(), True)


def _search(phi: Array, size: Array, weights: Array) -> tuple[float, float]:
    """Least scatter and the order that gives it; order 0 is the logarithm of h."""

    def scatter(p: float) -> float:
        return _linear(phi, size, weights, (p,), True)[0]

    grid = np.linspace(-STEEPEST, STEEPEST, STEPS)
    best = int(np.argmin([scatter(p) for p in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, STEPS - 1)]
    found = minimize_scalar(scatter, bounds=(low, high), method="bounded", options={"xatol": 1e-10})
    return float(found.fun), float(found.x)


def _linear(
    phi: Array, size: Array, weights: Array, orders: tuple[float, ...], searched: bool
) -> tuple[float, float, Array]:
    """Scatter, limit and fitted values (n,) of the expansion in ``orders``; ``searched``: the order is an unknown too.

    The scatter has n - unknowns degrees of freedom; weights add up to 1.
    """
    h = size / size.max()
    columns = [_power(h, p) for p in orders]
    matrix = np.stack([np.ones_like(h), *columns], axis=1)
    root = np.sqrt(weights)
    solved = np.linalg.lstsq(matrix * root[:, None], phi * root, rcond=None)[0]
    fitted = matrix @ solved
    unknowns = matrix.shape[1] + int(searched)
    free = max(len(phi) - unknowns, 1)
    scatter = math.sqrt(float(len(phi) * (weights * (phi - fitted) ** 2).sum()) / free)
    return scatter, float(solved[0]), fitted


def _power(h: Array, p: float) -> Array:
    """h^p, at p = 0 the logarithm: the one-term fit then has the same shape on both sides."""
    return np.log(h) if abs(p) < 1e-9 else np.asarray(h**p)
