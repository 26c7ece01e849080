"""Steady turns as solutions of the equations: the S-curve of yaw rate against rudder, without integration in time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PPoly
from scipy.optimize import root

from towtank.errors import TrialError
from towtank.frames import Array
from towtank.model.equations import Model


@dataclass(frozen=True)
class SteadyTurns:
    """Steady turns in the horizontal plane, by rising curvature; N points.

    curvature (N,) : yaw rate over speed ahead [1/m].   rate (N,) : yaw rate [rad/s].   rudder, drift (N,) [rad].
    speed (N,) [m/s].
    """

    curvature: Array
    rate: Array
    rudder: Array
    drift: Array
    speed: Array

    def rudder_span(self) -> float:
        """Rudder [rad] between the folds of the curve: the width of the spiral's loop; 0 for a single-valued curve.

        Source     Folds where d(rudder)/d(curvature) changes sign, the first to either side of straight flight, from a
                   cubic through the points.
        """
        spline = self._rudder
        at = spline.derivative().roots(extrapolate=False)
        left, right = at[at < 0.0], at[at > 0.0]
        return float(abs(spline(left.max()) - spline(right.min()))) if len(left) and len(right) else 0.0

    def slope(self) -> float:
        """d(rate)/d(rudder) at zero rate [1/s]; its sign is that of the rudder's effect on a stable craft."""
        return float(self._rate.derivative()(0.0) / self._rudder.derivative()(0.0))

    def rate_span(self) -> float:
        """Difference of the turning rates [rad/s] that need no rudder: the height of the loop; 0 when stable."""
        roots = self._rudder.roots(extrapolate=False)
        return float(np.ptp(self._rate(roots))) if len(roots) > 1 else 0.0

    @cached_property
    def _rudder(self) -> PPoly:
        return self._over(self.rudder)

    @cached_property
    def _rate(self) -> PPoly:
        return self._over(self.rate)

    def _over(self, values: Array) -> PPoly:
        return CubicSpline(self.curvature, values)


@dataclass(frozen=True)
class MeasuredTurns(SteadyTurns):
    """Turns that were flown, fewer than those of a solution and far from each other at the ends.

    Source     Akima's cubic in its modified form (scipy), which does not swing beyond a steep step between two points.
    """

    def _over(self, values: Array) -> PPoly:
        return Akima1DInterpolator(self.curvature, values, method="makima")


def steady_turns(model: Model, speed: float, largest: float = 0.6, points: int = 25) -> SteadyTurns:
    """Steady turns with a yaw rate r L/u from -``largest`` to +``largest``, at the thrust of ``speed`` [m/s].

    The curvature is the parameter of the continuation: at a given curvature there is one rudder angle even where the
    S-curve of an unstable craft folds back, and one yaw rate even where the loss of speed makes the rate fall again. A
    branch ends where no steady turn is found.

    Source     Zero loads X, Y, N in ``Model.rates`` with w, p, q, phi and theta zero; scipy's hybrid method. Zero
               accelerations would hold a share of the rolling moment where the CG is low.
    Departure  A free-running craft pitches and rolls in a turn; this curve leaves that out, as the classical one does.
    Valid      Fins are not limited, so that the curve is smooth; compare the rudder with the limit.

    Raises
    ------
    TrialError
        No steady turn at all.
    """
    # Points crowd towards straight flight, where the curve bends most.
    curvatures = largest / model.craft.length * np.linspace(0.0, 1.0, points) ** 1.5
    up = _branch(model, speed, curvatures)
    down = _branch(model, speed, -curvatures)
    rows = np.array([*reversed(down), *up[1:]])
    if len(rows) < 5:
        raise TrialError(
            f"steady turns of {model.craft.name}: none found near straight flight at {speed:g} m/s. The craft has no "
            "rudder to turn with: look at Nuudr and Yuudr."
        )
    curvature, u, v, dr = rows.T
    return SteadyTurns(curvature, curvature * u, dr, np.arctan2(-v, u), np.hypot(u, v))


def turning_diameter(model: Model, speed: float, rudder: float) -> float:
    """Diameter [m] of the tightest steady turn that takes no more than ``rudder`` [rad]; infinite if there is none."""
    turns = steady_turns(model, speed, points=13)
    able = (np.abs(turns.rudder) <= rudder) & (np.abs(turns.rate) > 0.0)
    return float((2.0 * turns.speed[able] / np.abs(turns.rate[able])).min()) if able.any() else float("inf")


def _branch(model: Model, U: float, curvatures: Array) -> list[tuple[float, ...]]:
    length, thrust = model.craft.length, model.thrust(U)
    mixing = model.craft.mixing[:, 0]
    size = np.diag(model.mass_matrix)[[0, 1, 5]] * np.array([U, U, U / length]) * U / length

    def residual(unknown: Array, curvature: float) -> Array:
        u, v, dr = unknown[0] * U, unknown[1] * U, unknown[2]
        rate = float(curvature * u)
        fins = [float(m * dr) for m in mixing]
        out = model.rates([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, float(u), float(v), 0.0, 0.0, 0.0, rate, *fins], fins, thrust)
        return np.asarray((model.mass_matrix @ np.array(out[6:12]))[[0, 1, 5]] / size)

    guess = before = np.array([1.0, 0.0, 0.0])
    rows: list[tuple[float, ...]] = []
    for i, curvature in enumerate(curvatures):
        found = root(residual, guess, args=(float(curvature),), tol=1e-9)
        if np.abs(found.fun).max() > 1e-6 or found.x[0] <= 0.05:
            break
        rows.append((float(curvature), found.x[0] * U, found.x[1] * U, found.x[2]))
        # The next guess lies on the line through the last two solutions.
        guess = found.x
        if 0 < i < len(curvatures) - 1:
            stride = (curvatures[i + 1] - curvature) / (curvature - curvatures[i - 1])
            guess = found.x + stride * (found.x - before)
        before = found.x
        # hybr steps in proportion to each unknown: round-off in place of a zero would leave it without a step.
        guess = np.where(np.abs(guess) < 1e-10, 0.0, guess)
    return rows
