"""Acceleration from rest, and stopping: by itself or with the propeller astern."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Ended, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity
from towtank.trials.ready import SPEED, Readings, Ready, last, run_trial
from towtank.trials.start import Setting, setting
from towtank.trials.trajectory import Trajectory

SHARES = (0.5, 0.9, 0.95)
"""Shares of the speed ordered at which an acceleration is read."""
COASTED = 0.2
"""Share of the approach speed at which a craft that coasts counts as stopped: its speed falls as 1/time."""
PATIENCE = 5.0
"""The trial is given up after this multiple of the time that surge alone would take."""
UNKNOWN = 100.0
"""Lengths at the approach speed that stand for that time where the model has no resistance."""
MOST_ASTERN = 4.0
"""Largest thrust astern, as a multiple of the thrust ahead."""


@dataclass(frozen=True)
class Surge:
    """Motion ahead by itself: inertia du/dt = throttle resistance speed^2 - resistance u|u|.

    inertia [kg], with the added mass; resistance [kg/m]; speed [m/s] that the full thrust keeps.

    Source     The surge equation of the model without sway, heave and rotation, integrated in closed form.
    Valid      Constant thrust; a propeller with a table gives more thrust as the craft slows down.
    """

    inertia: float
    resistance: float
    speed: float

    @property
    def time(self) -> float:
        """Time scale [s], inertia / (resistance speed)."""
        return self.inertia / (self.resistance * self.speed)

    @property
    def length(self) -> float:
        """Distance scale [m], inertia / resistance."""
        return self.inertia / self.resistance

    def gained(self, share: float) -> tuple[float, float]:
        """Time [s] and distance [m] from rest to a ``share`` of the speed: u = speed tanh(t / time)."""
        t = math.atanh(share)
        return self.time * t, self.length * math.log(math.cosh(t))

    def lost(self, share: float, throttle: float) -> tuple[float, float]:
        """Time [s] and distance [m] from the speed to a ``share`` of it under a ``throttle`` of zero or below.

        Coasting, u = speed / (1 + t / time); astern, the tangent takes the place of the fraction.
        """
        if throttle == 0.0:
            return self.time * (1.0 / share - 1.0), self.length * math.log(1.0 / share)
        root = math.sqrt(-throttle)
        angle = math.atan(1.0 / root) - math.atan(share / root)
        return self.time * angle / root, 0.5 * self.length * math.log((1.0 - throttle) / (share * share - throttle))


def surge(model: Model, speed: float) -> Surge | None:
    """Surge of ``model`` at the thrust of ``speed`` [m/s]; None without resistance or with a propeller's table."""
    resistance = -float(model.constants.c.Xuu)
    if resistance <= 0.0 or model.constants.screw is not None:
        return None
    return Surge(float(model.mass_matrix[0, 0]), resistance, speed)


def acceleration(
    model: Model,
    speed: Quantity | None = None,
    *,
    hold_course: bool = False,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """From rest, with the thrust of ``speed`` from the execute on.

    Parameters
    ----------
    speed : that the thrust keeps, [m/s] or text.   hold_course : the pilot holds the heading; otherwise the rudder is
        amidships.   hold_depth : see ``turning_circle``.

    Indices: time [s] and distance [m] to 50, 90 and 95 % of the speed; the same of surge alone in closed form.

    Raises
    ------
    InputError
        The speed is not positive.
    """
    return run_trial(model, acceleration_ready(model, speed, hold_course, hold_depth, pilot))


def acceleration_ready(
    model: Model,
    speed: Quantity | None = None,
    hold_course: bool = False,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The acceleration, ready to fly; arguments as in ``acceleration``."""
    s = setting(model, speed, pilot, piloted=hold_course or hold_depth)
    alone, start = surge(model, s.speed), s.state.copy()
    start[6:9] = 0.0
    orders = _orders(s, 1.0, hold_course, hold_depth)
    wait = PATIENCE * (alone.gained(SHARES[-1])[0] if alone else UNKNOWN * s.convective)
    legs = tuple(
        Leg(_to(share), orders, wait, Until("ahead", share * s.speed), required=True) for share in SHARES
    )  # fmt: skip
    return Ready(
        name="acceleration", kind="acceleration", loop=_loop(hold_course), setting=s, legs=legs,
        interval=s.convective / 8.0, start=start, read=_gained, status=lambda flights: _status(flights, s),
        alone=_gained_alone(alone) if alone else None,
        curves=lambda flights: _curve(alone, 1.0, flights),
    )  # fmt: skip


def stopping(
    model: Model,
    throttle: float = -1.0,
    speed: Quantity | None = None,
    *,
    hold_course: bool = False,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Thrust astern, or none, from straight flight until the craft has stopped in the water.

    Parameters
    ----------
    throttle : thrust as a multiple of that of the approach: -1 as much astern (crash stop), 0 the propeller stopped
        (stopping inertia test).   speed : approach speed.   hold_course, hold_depth : see ``acceleration``.

    Indices: head reach along the first course, track reach along the path, lateral deviation to starboard [m], the
    reaches in lengths, heading change [deg], time to half the speed and to the stop [s]; track reach and times of surge
    alone in closed form. A craft that coasts counts as stopped at 20 % of the approach speed.

    Source     ittc75040201, stopping test and stopping inertia test; imo2002: head and track reach.
    Departure  A stopped propeller has no drag. A propeller's table is held at its first row astern.

    Raises
    ------
    InputError
        A throttle ahead, or beyond four times the thrust of the approach.
    """
    return run_trial(model, stopping_ready(model, throttle, speed, hold_course, hold_depth, pilot))


def stopping_ready(
    model: Model,
    throttle: float = -1.0,
    speed: Quantity | None = None,
    hold_course: bool = False,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The stop, ready to fly; arguments as in ``stopping``."""
    if not -MOST_ASTERN <= throttle <= 0.0:
        raise InputError(
            f"throttle {throttle:g}: a stop takes a thrust astern, -1 for as much as the approach took ahead, or 0 for "
            f"none; the limit is {-MOST_ASTERN:g}, twice the shaft speed of the approach."
        )
    s = setting(model, speed, pilot, piloted=hold_course or hold_depth)
    alone, end = surge(model, s.speed), 0.0 if throttle else COASTED
    orders = _orders(s, throttle, hold_course, hold_depth)
    wait = PATIENCE * (alone.lost(end, throttle)[0] if alone else UNKNOWN * s.convective)
    legs = tuple(
        Leg(name, orders, wait, Until("ahead", share * s.speed), required=True)
        for name, share in (("to half speed", 0.5), ("to stop", end))
    )
    word = "astern" if throttle else "coasting"
    return Ready(
        name=f"stopping-{word}" + (f"-{-throttle:g}" if throttle not in (0.0, -1.0) else ""),
        kind=f"stopping, {word}", loop=_loop(hold_course), setting=s, legs=legs, interval=s.convective / 16.0,
        read=lambda flights: _lost(flights, model.craft.length), status=lambda flights: _status(flights, s),
        alone=_lost_alone(alone, throttle, end) if alone else None,
        curves=lambda flights: _curve(alone, throttle, flights),
    )  # fmt: skip


def _orders(s: Setting, throttle: float, hold_course: bool, hold_depth: bool) -> Orders:
    return s.orders(throttle=throttle, steer=float(hold_course), dive=float(hold_depth))


def _loop(hold_course: bool) -> str:
    return "closed" if hold_course else "open"


def _percent(share: float) -> str:
    return f"{100.0 * share:g}_percent"


def _to(share: float) -> str:
    return f"to {100.0 * share:g} %"


def _track(flights: Flights, leg: str) -> Array:
    """Path (N,) [m] from the start to the end of ``leg``, where that came by its event."""
    until = flights.leg(leg) + 1
    path = flights.stats[:, :until, flights.gauges.index(SPEED), Stat.INTEGRAL].sum(axis=1)
    return np.where(flights.by_event[:, until - 1], path, np.nan)


def _gained(flights: Flights) -> Readings:
    times = {f"time_to_{_percent(x)}": (flights.when(_to(x)), "s") for x in SHARES}
    return times | {f"distance_to_{_percent(x)}": (_track(flights, _to(x)), "m") for x in SHARES}


def _gained_alone(alone: Surge) -> dict[str, tuple[float, str]]:
    times = {f"time_to_{_percent(x)}_closed_form": (alone.gained(x)[0], "s") for x in SHARES}
    return times | {f"distance_to_{_percent(x)}_closed_form": (alone.gained(x)[1], "m") for x in SHARES}


def _lost(flights: Flights, length: float) -> Readings:
    head, track = flights.at("to stop", "x"), _track(flights, "to stop")
    return {
        "head_reach": (head, "m"),
        "track_reach": (track, "m"),
        "head_reach_lengths": (head / length, ""),
        "track_reach_lengths": (track / length, ""),
        "lateral_deviation": (flights.at("to stop", "y"), "m"),
        "heading_change": (np.degrees(flights.at("to stop", "psi")), "deg"),
        "time_to_half_speed": (flights.when("to half speed"), "s"),
        "time_to_stop": (flights.when("to stop"), "s"),
    }


def _lost_alone(alone: Surge, throttle: float, end: float) -> dict[str, tuple[float, str]]:
    time, distance = alone.lost(end, throttle)
    return {
        "track_reach_closed_form": (distance, "m"),
        "time_to_half_speed_closed_form": (alone.lost(0.5, throttle)[0], "s"),
        "time_to_stop_closed_form": (time, "s"),
    }


def _status(flights: Flights, s: Setting) -> str | None:
    if flights.ended[0] != Ended.LATE:
        return None
    late = flights.legs[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1]
    share = 100.0 * float(last(flights, "ahead")[0]) / s.speed
    return (
        f"ended early: the speed stood at {share:.0f} % of {s.speed:g} m/s after {late.within:.0f} s, and did not get "
        f"{late.name}; {s.trim.why or 'what turns or pitches the craft takes its thrust'}"
    )


def _curve(alone: Surge | None, throttle: float, flights: Flights) -> dict[str, Any]:
    """Speed of surge alone over time: the closed form beside the record."""
    if alone is None:
        return {}
    time = np.linspace(0.0, float(flights.end_time[0]), 61)
    t = time / alone.time
    if throttle > 0.0:
        speed = alone.speed * np.tanh(t)
    elif throttle == 0.0:
        speed = alone.speed / (1.0 + t)
    else:
        root = math.sqrt(-throttle)
        left = np.maximum(math.atan(1.0 / root) - root * t, 0.0)
        speed = alone.speed * root * np.tan(left)
    return {"closed form": {"time": time, "speed": speed}}
