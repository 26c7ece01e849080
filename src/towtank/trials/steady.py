"""Steady turns as solutions of the equations: the S-curve of yaw rate against rudder, without integration in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from towtank.errors import TrialError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.trials.pilot.allocation import allocation
from towtank.trials.start import Setting


@dataclass(frozen=True)
class SteadyTurns:
    """Steady turns at constant depth, by rising turning rate; N points.

    rate (N,) : turning rate psidot [rad/s].   rudder, elevator (N,) [rad].   speed (N,) [m/s].   drift, pitch, roll
    (N,) [rad].
    """

    rate: Array
    rudder: Array
    elevator: Array
    speed: Array
    drift: Array
    pitch: Array
    roll: Array

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


def steady_turns(model: Model, setting: Setting, largest: float, points: int = 25) -> SteadyTurns:
    """Steady turns from -``largest`` to +``largest`` [rad/s] at constant depth and the thrust of ``setting``.

    The turning rate is the parameter of the continuation: at a given rate there is one rudder angle even where the
    S-curve of an unstable craft folds back. Roll is damped by the pilot's aileron if the setting has one. Points where
    no steady turn is found end the curve.

    Source     Zero accelerations in ``Model.rates`` with p = -psidot sin(theta), q = psidot cos(theta) sin(phi),
               r = psidot cos(theta) cos(phi); solved by scipy's hybrid method.
    Valid      Fins are not limited, so that the curve is smooth; compare the rudder with the limit.

    Raises
    ------
    TrialError
        No steady turn at all.
    """
    up = _branch(model, setting, np.linspace(0.0, largest, points))
    down = _branch(model, setting, np.linspace(0.0, -largest, points))
    rows = np.array([*reversed(down), *up[1:]])
    if len(rows) < 5:
        raise TrialError(
            f"steady turns of {model.craft.name}: none found near straight flight at {setting.speed:g} m/s. "
            + (setting.trim.why or "The craft may have no rudder (Nuudr, Yuudr zero).")
        )
    rate, u, v, w, phi, theta, de, dr = rows.T
    return SteadyTurns(rate, dr, de, np.sqrt(u * u + v * v + w * w), np.arctan2(-v, u), theta, phi)


def turning_diameter(model: Model, setting: Setting, rudder: float) -> float:
    """Diameter [m] of the tightest steady turn that takes no more than ``rudder`` [rad]; infinite if there is none."""
    turns = steady_turns(model, setting, 0.5 / setting.convective, points=13)
    able = (np.abs(turns.rudder) <= rudder) & (np.abs(turns.rate) > 0.0)
    return float((2.0 * turns.speed[able] / np.abs(turns.rate[able])).min()) if able.any() else float("inf")


def _branch(model: Model, setting: Setting, rates: Array) -> list[tuple[float, ...]]:
    s, U, length = setting, setting.speed, model.craft.length
    mixed = allocation(model.craft).fins
    pilot = s.helm.pilot
    scale = np.array([U, U, U, 1.0, 1.0, 1.0, 1.0])
    size = np.array([U, U, U, U / length, U / length, U / length, U]) * U / length

    def residual(unknown: Array, rate: float) -> Array:
        u, v, w, phi, theta, de, dr = (float(x) for x in unknown * scale)
        p, q, r = -rate * np.sin(theta), rate * np.cos(theta) * np.sin(phi), rate * np.cos(theta) * np.cos(phi)
        state = [0.0, 0.0, 0.0, phi, theta, 0.0, u, v, w, float(p), float(q), float(r)]
        da = 0.0 if pilot is None else pilot.aileron(state)
        fins = mixed((dr, de, da))
        rates = model.rates([*state, *fins], fins, s.thrust)
        return np.array([*rates[6:12], rates[2] * U / length]) / size

    guess = np.array([s.trim.u, 0.0, s.trim.w, 0.0, s.trim.pitch, s.trim.elevator, 0.0]) / scale
    out: list[tuple[float, ...]] = []
    before = guess
    for rate in rates:
        found = root(residual, guess, args=(float(rate),), tol=1e-9)
        if np.abs(found.fun).max() > 1e-6 or found.x[0] <= 0.05:
            break
        out.append((float(rate), *(found.x * scale)))
        # The next guess lies on the line through the last two solutions.
        guess, before = (2.0 * found.x - before, found.x) if len(out) > 1 else (found.x, found.x)
        # hybr steps in proportion to each unknown: round-off in place of a zero would leave it without a step.
        guess = np.where(np.abs(guess) < 1e-10, 0.0, guess)
    return out
