"""Steady turns as solutions of the equations: the S-curve of yaw rate against rudder, without integration in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from towtank.errors import TrialError
from towtank.frames import Array
from towtank.model.equations import Model


@dataclass(frozen=True)
class SteadyTurns:
    """Steady turns in the horizontal plane, by rising yaw rate; N points.

    rate (N,) : yaw rate [rad/s].   rudder, drift (N,) [rad].   speed (N,) [m/s].
    """

    rate: Array
    rudder: Array
    drift: Array
    speed: Array

    def rudder_span(self) -> float:
        """Rudder [rad] between the folds of the curve: the width of the spiral's loop; 0 for a single-valued curve.

        Source     Folds where d(rudder)/d(rate) changes sign, from a cubic through the points.
        """
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(self.rate, self.rudder)
        folds = spline.derivative().roots(extrapolate=False)
        heights = spline(folds)
        return float(np.ptp(heights)) if len(heights) > 1 else 0.0

    def slope(self) -> float:
        """d(rate)/d(rudder) at zero rate [1/s]; its sign is that of the rudder's effect on a stable craft."""
        i = int(np.argmin(np.abs(self.rate)))
        low, high = max(i - 1, 0), min(i + 1, len(self.rate) - 1)
        return float((self.rate[high] - self.rate[low]) / (self.rudder[high] - self.rudder[low]))

    def free_rate(self) -> float:
        """Largest turning rate [rad/s] with the rudder amidships: half the height of the loop; 0 when stable."""
        from scipy.interpolate import CubicSpline

        roots = CubicSpline(self.rate, self.rudder).roots(extrapolate=False)
        return float(np.abs(roots).max()) if len(roots) > 1 else 0.0


def steady_turns(model: Model, speed: float, largest: float, points: int = 25) -> SteadyTurns:
    """Steady turns from -``largest`` to +``largest`` [rad/s] at the thrust of ``speed`` [m/s].

    The yaw rate is the parameter of the continuation: at a given rate there is one rudder angle even where the S-curve
    of an unstable craft folds back. A branch ends where no steady turn is found.

    Source     Zero accelerations u, v, r in ``Model.rates`` with w, p, q, phi and theta zero; scipy's hybrid method.
    Departure  A free-running craft pitches and rolls in a turn; this curve leaves that out, as the classical one does.
    Valid      Fins are not limited, so that the curve is smooth; compare the rudder with the limit.

    Raises
    ------
    TrialError
        No steady turn at all.
    """
    up = _branch(model, speed, np.linspace(0.0, largest, points))
    down = _branch(model, speed, np.linspace(0.0, -largest, points))
    rows = np.array([*reversed(down), *up[1:]])
    if len(rows) < 5:
        raise TrialError(
            f"steady turns of {model.craft.name}: none found near straight flight at {speed:g} m/s. The craft has no "
            "rudder to turn with: look at Nuudr and Yuudr."
        )
    rate, u, v, dr = rows.T
    return SteadyTurns(rate, dr, np.arctan2(-v, u), np.hypot(u, v))


def turning_diameter(model: Model, speed: float, rudder: float) -> float:
    """Diameter [m] of the tightest steady turn that takes no more than ``rudder`` [rad]; infinite if there is none."""
    turns = steady_turns(model, speed, 0.5 * speed / model.craft.length, points=13)
    able = (np.abs(turns.rudder) <= rudder) & (np.abs(turns.rate) > 0.0)
    return float((2.0 * turns.speed[able] / np.abs(turns.rate[able])).min()) if able.any() else float("inf")


def _branch(model: Model, U: float, rates: Array) -> list[tuple[float, ...]]:
    length, thrust = model.craft.length, model.thrust(U)
    mixing = model.craft.mixing[:, 0]
    size = np.array([U, U, U / length]) * U / length

    def residual(unknown: Array, rate: float) -> Array:
        u, v, dr = unknown[0] * U, unknown[1] * U, unknown[2]
        fins = [float(m * dr) for m in mixing]
        out = model.rates([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, float(u), float(v), 0.0, 0.0, 0.0, rate, *fins], fins, thrust)
        return np.array([out[6], out[7], out[11]]) / size

    guess = before = np.array([1.0, 0.0, 0.0])
    rows: list[tuple[float, ...]] = []
    for rate in rates:
        found = root(residual, guess, args=(float(rate),), tol=1e-9)
        if np.abs(found.fun).max() > 1e-6 or found.x[0] <= 0.05:
            break
        rows.append((float(rate), found.x[0] * U, found.x[1] * U, found.x[2]))
        # The next guess lies on the line through the last two solutions.
        guess, before = (2.0 * found.x - before, found.x) if len(rows) > 1 else (found.x, found.x)
        # hybr steps in proportion to each unknown: round-off in place of a zero would leave it without a step.
        guess = np.where(np.abs(guess) < 1e-10, 0.0, guess)
    return rows
