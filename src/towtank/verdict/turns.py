"""Steady turns of many craft at once, and the instability loop that they form: algebra, no integration in time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from towtank.frames import Array
from towtank.model.algebra import NUMPY
from towtank.model.equations import LEVEL, Constants, total_load
from towtank.symbols import LOADS, RATES
from towtank.verdict.many import Many, masses

LARGEST, POINTS = 0.6, 25
"""Largest yaw rate r L/u and number of points of a side, as in ``towtank.trials.steady``."""
ROWS = [0, 1, 5]
"""Surge, sway, yaw: the loads that are zero."""
NUDGE = 1e-6
"""Step of the slopes. The residual is of second degree in the unknowns, so the error of a slope is of this size."""
MIRROR = np.array([1.0, -1.0, -1.0])[:, None, None]
"""Surge, sway, yaw or u, v, rudder of the turn to the other side."""
SETTLED, NEWTON = 1e-9, 12
"""Largest residual of a solution, as accelerations in U2/L and U2/L2; most iterations for a point."""


@dataclass(frozen=True)
class ManyTurns:
    """Steady turns of n craft, by rising curvature. NaN where a craft has none.

    curvature (P,) [1/m].   rate [rad/s], rudder [rad] : (n, P).
    """

    curvature: Array
    rate: Array
    rudder: Array

    def loop(self) -> tuple[Array, Array]:
        """Width [rad of rudder] and height [rad/s] (n,) of the instability loop; 0 where the curve is single-valued.

        Source     As ``SteadyTurns.rudder_span`` and ``rate_span``: the first fold to either side of straight flight,
                   rates that need no rudder.
        """
        width, height = np.full(len(self.rudder), np.nan), np.full(len(self.rudder), np.nan)
        there = np.isfinite(self.rudder)
        for pattern in np.unique(there, axis=0):
            if pattern.sum() < 5:
                continue
            rows = np.flatnonzero((there == pattern).all(axis=1))
            x = self.curvature[pattern]
            rudder, rate = (CubicSpline(x, values[rows][:, pattern].T) for values in (self.rudder, self.rate))
            folds = _padded(rudder.derivative().roots(extrapolate=False))
            port = np.fmax.reduce(np.where(folds < 0.0, folds, np.nan), axis=1)
            starboard = np.fmin.reduce(np.where(folds > 0.0, folds, np.nan), axis=1)
            ends = _at(rudder, np.stack([port, starboard], axis=-1))
            free = _at(rate, _padded(rudder.roots(extrapolate=False)))
            width[rows] = np.nan_to_num(np.abs(ends[:, 1] - ends[:, 0]))
            height[rows] = np.nan_to_num(np.fmax.reduce(free, axis=1) - np.fmin.reduce(free, axis=1))
        return width, height


def _padded(roots: np.ndarray[tuple[int], np.dtype[np.object_]]) -> Array:
    """Roots (n,) of arrays as (n, k), at least two columns, NaN beyond."""
    out = np.full((len(roots), max(2, *(len(found) for found in roots))), np.nan)
    for row, found in zip(out, roots, strict=True):
        row[: len(found)] = found
    return out


def _at(spline: CubicSpline, x: Array) -> Array:
    """Each of n curves at its own points x (n, k)."""
    known = np.where(np.isnan(x), spline.x[0], x)
    i = np.clip(np.searchsorted(spline.x, known, side="right") - 1, 0, len(spline.x) - 2)
    c, t = spline.c[:, i, np.arange(len(x))[:, None]], known - spline.x[i]
    return np.asarray(np.where(np.isnan(x), np.nan, ((c[0] * t + c[1]) * t + c[2]) * t + c[3]))


def many_turns(craft: Many, speed: float, points: int = POINTS) -> ManyTurns:
    """Steady turns of every craft at the thrust of the best estimate at ``speed`` [m/s].

    Source     As ``towtank.trials.steady.steady_turns``: zero loads X, Y, N at given curvature, w, p, q, phi and theta
               zero. Newton's method on all craft at once, from the point before on the curve.
    Departure  A free-running craft pitches and rolls in a turn; fins are not limited.
    """
    residual = _Residual(craft, speed)
    side = LARGEST / craft.model.craft.length * np.linspace(0.0, 1.0, points) ** 1.5
    up = _branch(residual, side, len(craft))
    down = MIRROR * up if residual.mirrored() else _branch(residual, -side, len(craft))
    curvature = np.concatenate([-side[:0:-1], side])
    u, _, rudder = np.concatenate([down[..., :0:-1], up], axis=-1)
    return ManyTurns(curvature, curvature * u * speed, rudder)


def _branch(residual: _Residual, curvatures: Array, count: int) -> Array:
    """u/U, v/U, rudder as (3, n, P); NaN from the first point on that a craft has no turn at."""
    x = before = np.array([np.ones(count), np.zeros(count), np.zeros(count)])
    out, lost = [], np.zeros(count, dtype=bool)
    for i, curvature in enumerate(curvatures):
        # The guess lies on the line through the last two solutions.
        stride = (curvature - curvatures[i - 1]) / (curvatures[i - 1] - curvatures[i - 2]) if i > 1 else 0.0
        guess, before = x + stride * (x - before), x
        x, settled = _solve(residual, guess, float(curvature))
        lost |= ~settled | (x[0] <= 0.05)
        x = np.where(lost, before, x)
        out.append(np.where(lost, np.nan, x))
    return np.stack(out, axis=-1)


def _solve(residual: _Residual, guess: Array, curvature: float) -> tuple[Array, NDArray[np.bool_]]:
    """Solution (3, n) and whether it was found (n,)."""
    x, settled = guess, np.zeros(guess.shape[1], dtype=bool)
    for _ in range(NEWTON):
        # One call for the point and its three neighbours.
        near = x[:, None] + NUDGE * np.vstack([np.zeros(3), np.eye(3)]).T[:, :, None]
        f = residual(near, curvature)
        settled = np.abs(f[:, 0]).max(axis=0) < SETTLED
        if settled.all():
            break
        slope = np.moveaxis((f[:, 1:] - f[:, :1]) / NUDGE, -1, 0)
        singular = ~(np.abs(np.linalg.det(slope)) > 0.0)
        slope = np.where((settled | singular)[:, None, None], np.eye(3), slope)
        move = np.linalg.solve(slope, f[:, 0].T[..., None])[..., 0].T
        x = np.where(settled | singular, x, x - np.clip(move, -0.3, 0.3))
    return x, settled


class _Residual:
    """Loads X, Y, N of n craft in a steady turn over their masses, in U2/L, U2/L and U2/L2."""

    def __init__(self, craft: Many, speed: float) -> None:
        model, length = craft.model, craft.model.craft.length
        self.k, self.speed, self.thrust = _constants(craft), speed, float(model.thrust(speed))
        self.length = length
        self.mixing = [float(share) for share in model.craft.mixing[:, 0]]
        size = np.array([speed, speed, speed / length]) * speed / length
        self.mass = (
            np.diagonal(masses(model, craft.columns), axis1=1, axis2=2)[:, ROWS].T[:, None, :] * size[:, None, None]
        )

    def __call__(self, x: Array, curvature: float) -> Array:
        """Residual (3, k, n) at x (3, k, n): u/U, v/U, rudder [rad]."""
        u, v, rudder = x[0] * self.speed, x[1] * self.speed, x[2]
        zero = np.zeros_like(u)
        nu, delta = [u, v, zero, zero, zero, curvature * u], [share * rudder for share in self.mixing]
        load = total_load(self.k, nu, LEVEL, delta, self.thrust, NUMPY)
        return np.array([zero + load[row] for row in ROWS]) / self.mass

    def mirrored(self) -> bool:
        """True when turns to port are the mirror image of those to starboard, for every craft."""
        at = np.array([0.9, 0.1, 0.2])[:, None, None]
        x, curvature = np.broadcast_to(at, self.mass.shape), 0.3 / self.length
        there, back = self(x, curvature), MIRROR * self(MIRROR * x, -curvature)
        return bool(np.allclose(there, back, rtol=0.0, atol=SETTLED * max(float(np.abs(there).max()), 1.0)))


def _constants(craft: Many) -> Constants:
    """What the load needs, entries that differ as (n,)."""
    k = craft.model.constants
    values = {**vars(k.c), **{name: column for name, column in craft.columns.items() if hasattr(k.c, name)}}

    def added(load: str, rate: str, known: float) -> object:
        column = craft.columns.get(f"{load}{rate}dot")
        return known if column is None or not column.any() else column

    table = [[added(a, b, x) for b, x in zip(RATES, row, strict=True)] for a, row in zip(LOADS, k.added, strict=True)]
    return replace(k, body=craft.body, c=SimpleNamespace(**values), added=table)
