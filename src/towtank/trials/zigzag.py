"""Zigzag, in the horizontal plane with the rudder or in the vertical plane with the elevator."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Gauge, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity
from towtank.trials import start
from towtank.trials.ready import Readings, Ready, last, run_trial
from towtank.trials.trajectory import Trajectory

LONGEST = 25.0
"""Lengths travelled after which a leg whose angle is not reached ends the trial."""
EXECUTES = 4


@dataclass(frozen=True)
class _Plane:
    """What swings: gauges of its angle and rate, the control that swings it, the derivative, the word for it."""

    angle: Gauge
    rate: Gauge
    control: str
    effect: str
    word: str


_PLANES = {
    "horizontal": _Plane(Gauge("psi"), Gauge("turn"), "rudder", "Nuudr", "heading"),
    "vertical": _Plane(Gauge("theta"), Gauge("q"), "elevator", "Muude", "pitch"),
}


@dataclass(frozen=True)
class _Swing:
    """The trial in numbers: control angle, execute angle, trimmed control and angle [rad], side of the first swing."""

    plane: _Plane
    control: float
    execute: float
    neutral: float
    trimmed: float
    side: float


def zigzag(
    model: Model,
    angle: Quantity = "10 deg",
    heading: Quantity = "10 deg",
    speed: Quantity | None = None,
    *,
    plane: str = "horizontal",
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Control put over to alternate sides each time the heading (or pitch) has swung to the execute angle.

    Parameters
    ----------
    angle : rudder or elevator; text with a unit or radians. SNAME sign: the first execute is to port (or nose down)
        when positive.   heading : execute angle of heading, or of pitch from its trimmed value.
    plane : "horizontal" or "vertical"; the elevator angle counts from trim.
    hold_depth : in the horizontal plane, depth held and roll damped by the pilot; see ``turning_circle``. In the
        vertical plane the heading is held by the pilot instead.

    Indices: first and second overshoot [deg], initial turning time (execute to the execute angle), time to check the
    first and the second swing (execute to rate zero), reach, period [s]. NaN where the craft did not get that far; the
    status then says why.

    Source     ittc75040201, zigzag test.

    Raises
    ------
    InputError
        Another plane; an angle of zero, beyond the fins, or without a unit.
    """
    return run_trial(model, zigzag_ready(model, angle, heading, speed, plane, hold_depth, pilot))


def zigzag_ready(
    model: Model,
    angle: Quantity = "10 deg",
    heading: Quantity = "10 deg",
    speed: Quantity | None = None,
    plane: str = "horizontal",
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The zigzag, ready to fly; arguments as in ``zigzag``."""
    if plane not in _PLANES:
        raise InputError(f'plane {plane!r}: a zigzag is "horizontal" (rudder) or "vertical" (elevator).')
    swings, vertical = _PLANES[plane], plane == "vertical"
    control = start.angle(angle, "angle", start.fin_limit(model), "the limit of the fins")
    execute = start.angle(heading, "heading", np.radians(60.0), "beyond which a zigzag is a turning circle")
    if control == 0.0 or execute <= 0.0:
        raise InputError(f"zigzag {angle}/{heading}: both angles must differ from zero, the execute angle positive.")
    s = start.setting(model, speed, pilot, piloted=hold_depth)
    side = float(np.sign((model.derivatives[swings.effect] or -1.0) * control))
    neutral, trimmed = (s.trim.elevator, s.trim.pitch) if vertical else (0.0, 0.0)
    swing = _Swing(swings, control, execute, neutral, trimmed, side)
    held = s.orders(**{"steer" if vertical else "dive": float(hold_depth)})
    return Ready(
        name=f"zigzag-{abs(np.degrees(control)):g}-{np.degrees(execute):g}" + ("-vertical" if vertical else ""),
        kind=f"zigzag, {plane}", loop="open", setting=s, legs=_legs(swing, held, LONGEST * s.convective),
        interval=s.convective / 20.0, gauges=(swings.angle, swings.rate),
        read=lambda flights: _indices(swing, flights), status=lambda flights: _status(swing, flights),
    )  # fmt: skip


def _legs(swing: _Swing, held: Orders, within: float) -> tuple[Leg, ...]:
    """A leg to the first execute; then after every execute one back to the start and one on to the other side."""
    legs: list[Leg] = []

    def leg(name: str, control: float, goal: float) -> None:
        orders = replace(held, **{swing.plane.control: swing.neutral + control})
        until = Until(swing.plane.angle.channel, swing.trimmed + goal)
        legs.append(Leg(name, orders, within, until, required=True))

    for i in range(EXECUTES):
        sign = -1.0 if i % 2 else 1.0
        if i:
            leg(f"back {i + 1}", sign * swing.control, 0.0)
        leg(f"swing {i + 1}", sign * swing.control, sign * swing.side * swing.execute)
    leg(f"swing {EXECUTES + 1}", -sign * swing.control, 0.0)
    return tuple(legs)


def _status(swing: _Swing, flights: Flights) -> str | None:
    if flights.by_event[0].all():
        return None
    late = flights.legs[int(np.argmin(flights.by_event[0]))].name
    word, wanted = swing.plane.word, np.degrees(swing.execute)
    if late == "swing 1":
        gauge = swing.plane.angle
        ends = [np.degrees(flights.over(gauge, stat)[0] - swing.trimmed) for stat in (Stat.LOW, Stat.HIGH)]
        return (
            f"ended early: did not respond. {word} changed by {max(ends, key=abs):.2g} deg of the {wanted:g} deg "
            f"wanted in {LONGEST:g} lengths; the {swing.plane.control} is too weak against the craft's own moments"
        )
    stood = np.degrees(last(flights, swing.plane.angle.channel)[0] - swing.trimmed)
    return (
        f"ended early: after execute {late.split()[1]} the {word} stood at {stood:.3g} deg and did not come back in "
        f"{LONGEST:g} lengths; the craft does not answer this {swing.plane.control} angle"
    )


def _indices(swing: _Swing, flights: Flights) -> Readings:
    """Times [s] from the first execute, overshoots [deg]."""
    return {
        "initial_turning_time": (flights.when("swing 1"), "s"),
        **_check(swing, flights, 1, "first"),
        **_check(swing, flights, 2, "second"),
        "reach": (flights.when("back 2"), "s"),
        "period": (flights.when("swing 4") - flights.when("swing 2"), "s"),
    }


def _check(swing: _Swing, flights: Flights, execute: int, word: str) -> Readings:
    """How far and how long the craft swings on after an execute, before it comes back to its start."""
    leg, side = f"back {execute + 1}", swing.side if execute % 2 else -swing.side
    far, when = (Stat.HIGH, Stat.HIGH_TIME) if side > 0.0 else (Stat.LOW, Stat.LOW_TIME)
    height = side * (flights.stat(leg, swing.plane.angle, far) - swing.trimmed) - swing.execute
    stop = flights.stat(leg, swing.plane.rate, Stat.FIRST)
    checked: Array = np.where(np.isnan(stop), flights.stat(leg, swing.plane.angle, when), stop)
    came_back = ~np.isnan(flights.when(leg))
    return {
        f"{word}_overshoot": (np.where(came_back, np.degrees(np.maximum(height, 0.0)), np.nan), "deg"),
        f"time_to_check_{word}": (np.where(came_back, checked - flights.when(f"swing {execute}"), np.nan), "s"),
    }
