"""How a trial begins: level, straight, trimmed if the craft can be."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.algebra import MATH
from towtank.model.equations import Model
from towtank.pilot.allocation import RUDDER_FIRST, allocation, share
from towtank.pilot.design import design_pilot
from towtank.pilot.law import Pilot, schedule
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity, si

STEEPEST_TRIM = np.radians(30.0)
_LENGTHS = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*L\s*")
"""A number of craft lengths."""


@dataclass(frozen=True)
class Trim:
    """Level, straight flight at the thrust of ``speed`` [m/s].

    pitch, elevator [rad]; u, w [m/s]. ``holds`` is False when the craft cannot fly level: ``why`` then says so, and
    the numbers are those of a craft let go level with its fins at rest.
    """

    speed: float
    pitch: float = 0.0
    elevator: float = 0.0
    u: float = 0.0
    w: float = 0.0
    holds: bool = True
    why: str = ""


def level_trim(model: Model, speed: float) -> Trim:
    """Pitch and elevator that carry the craft's weight residual at constant depth and ``speed`` [m/s].

    Source     Zero accelerations u, w, q and zdot = 0 in the model's own equations, solved by scipy's hybrid method.
    """
    elevator = model.craft.mixing[:, 1] if model.craft.fins else np.zeros(0)
    scale = np.array([speed, speed, 1.0, 1.0])
    thrust = model.thrust(speed)

    def residual(unknown: Array) -> Array:
        u, w, theta, de = unknown * scale
        state = [0.0, 0.0, 0.0, 0.0, theta, 0.0, u, 0.0, w, 0.0, 0.0, 0.0, *(elevator * de)]
        rates = model.rates(state, state[12:], thrust)
        return np.array([rates[6], rates[8], rates[10] * model.craft.length, rates[2] * speed / model.craft.length])

    let_go = Trim(speed, u=speed, holds=False)
    if not model.craft.fins:
        level = np.allclose(residual(np.array([1.0, 0.0, 0.0, 0.0])), 0.0, atol=1e-9)
        return replace(let_go, holds=True) if level else replace(let_go, why="the craft has no fins to trim with")
    found = root(residual, np.array([1.0, 0.0, 0.0, 0.0]), tol=1e-10)
    u, w, theta, de = found.x * scale
    if not found.success or u <= 0.2 * speed:
        return replace(let_go, why=f"no level flight balances the weight residual at {speed:g} m/s")
    fins = allocation(model.craft)
    largest = share((0.0, float(de), 0.0), fins.rows, fins.limits, RUDDER_FIRST, MATH)[1]
    if abs(largest) < 0.999 * abs(de) or abs(theta) > STEEPEST_TRIM:
        return replace(
            let_go,
            why=f"level flight at {speed:g} m/s needs {np.degrees(de):.0f} deg of elevator (limit "
            f"{np.degrees(abs(largest)):.0f}) and {np.degrees(theta):.0f} deg of pitch (limit 30)",
        )
    return Trim(speed, float(theta), float(de), float(u), float(w))


def slowest_level_speed(model: Model, fastest: float = 5.0) -> float | None:
    """Slowest speed [m/s], to 1 %, from which on the craft can carry its weight residual level.

    None if it cannot even at ``fastest`` times its own speed.
    """
    speeds = model.craft.speed * np.geomspace(0.3, fastest, 25)
    # The fastest that it cannot carry its weight residual at, looked for from above.
    first = next((i for i in reversed(range(len(speeds))) if not level_trim(model, float(speeds[i])).holds), -1)
    if first == len(speeds) - 1:
        return None
    if first < 0:
        return float(speeds[0])
    low, high = float(speeds[first]), float(speeds[first + 1])
    while high / low > 1.01:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if level_trim(model, middle).holds else (middle, high)
    return high


def ballasted(model: Model) -> Model:
    """``model`` with the displaced mass made equal to the mass: the craft trimmed to neutral for its trials."""
    mass = replace(model.craft.mass, displaced_mass=model.craft.mass.mass)
    return replace(model, craft=replace(model.craft, mass=mass))


@dataclass(frozen=True)
class Setting:
    """What every trial starts from.

    speed [m/s], trim.   state (12 + n,) : x y z, phi theta psi, u v w p q r, fins, as in ``STATE``.
    memory (3,) : of the steering, its trims [rad] and the integral of the guidance [m].   pilot : None in open loop.
    thrust [N].   convective : time in which the craft travels its own length [s].
    """

    speed: float
    trim: Trim
    state: Array
    memory: tuple[float, float, float]
    pilot: Pilot | None
    thrust: float
    convective: float

    @property
    def notes(self) -> tuple[str, ...]:
        """What limits the trial, in words."""
        pilot = self.pilot.notes if self.pilot else ()
        return pilot if self.trim.holds else (*pilot, f"Not trimmed: {self.trim.why}. The craft changes depth.")

    def orders(self, **changes: float) -> Orders:
        """Orders in trim, with ``changes``: the elevator at its trim; the pilot, if there is one, without an order."""
        at_trim = Orders(piloted=1.0 if self.pilot else 0.0, elevator=self.trim.elevator)
        return replace(at_trim, **changes)


def setting(model: Model, speed: Quantity | None, pilot: Pilot | None = None, *, piloted: bool = True) -> Setting:
    """Start of a trial at ``speed`` (the craft's own by default), on a northerly course at depth 0.

    A craft that flies ``piloted`` gets a pilot designed for this speed unless one is given; otherwise it has none.

    Raises
    ------
    InputError
        The speed is not positive.
    """
    U = model.craft.speed if speed is None else si(speed, "m/s", "speed")
    if U <= 0.0:
        raise InputError(f"speed {U:g} m/s: a free-running trial needs forward speed. Give a positive one.")
    trim = level_trim(model, U)
    pilot = (pilot or design_pilot(model, U)) if piloted else None
    fins = _at_start(model, model.craft.mixing[:, 1] * trim.elevator) if model.craft.fins else np.zeros(0)
    # The elevator's trim carries what the pitch feedback asks for in level flight: the pilot starts at rest.
    asked = float(schedule(pilot, trim.u, MATH)) * (pilot.pitch * trim.pitch + pilot.heave * trim.w) if pilot else 0.0
    carried = trim.elevator + asked if pilot else 0.0
    state = [0.0, 0.0, 0.0, 0.0, trim.pitch, 0.0, trim.u, 0.0, trim.w, 0.0, 0.0, 0.0, *fins]
    return Setting(U, trim, np.array(state), (0.0, carried, 0.0), pilot, float(model.thrust(U)), model.craft.length / U)


def _at_start(model: Model, delta: Array) -> Array:
    """Fin angles (n,) [rad] that start at ``delta`` but for jammed fins and those that do not reach it."""
    fins = model.constants.fins
    stuck, limits = np.array(fins.stuck), np.array(fins.max_angle)
    return np.asarray(np.clip(np.where(stuck > 0.0, fins.stuck_angle, delta), -limits, limits))


def angle(value: Quantity, where: str, limit: float, reason: str) -> float:
    """Angle [rad] of text such as ``"10 deg"`` or of a number in radians.

    Raises
    ------
    InputError
        Not an angle, or beyond ``limit`` [rad]; ``reason`` says why there is a limit.
    """
    text = f"{value} rad" if isinstance(value, int | float) and not isinstance(value, bool) else value
    number = si(text, "rad", where)
    if abs(number) > limit * (1.0 + 1e-9):
        raise InputError(
            f"{where}: {np.degrees(number):.4g} deg is beyond {np.degrees(limit):.4g} deg, {reason}. Numbers without a "
            f'unit are radians; write for example "{np.degrees(limit) / 2.0:.3g} deg".'
        )
    return number


def span(value: Quantity, length: float, where: str) -> float:
    """Distance [m] of text such as ``"200 m"``, of craft lengths such as ``"5 L"``, or of a number in metres.

    length : of the craft [m].

    Raises
    ------
    InputError
        Not a distance.
    """
    lengths = _LENGTHS.fullmatch(value) if isinstance(value, str) else None
    return float(lengths[1]) * length if lengths else si(value, "m", where)


def fin_limit(model: Model) -> float:
    """Largest rudder or elevator [rad] that every fin can follow."""
    peak = np.abs(model.craft.mixing[:, :2]).max(axis=1)
    limits = [fin.max_angle / p for fin, p in zip(model.craft.fins, peak, strict=True) if p > 1e-9]
    return float(min(limits)) if limits else 0.0
