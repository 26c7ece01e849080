"""Turning circle."""

from __future__ import annotations

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Gauge, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity
from towtank.trials.ready import SPEED, Readings, Ready, last, run_trial
from towtank.trials.start import Setting, angle, fin_limit, setting
from towtank.trials.trajectory import Trajectory

LONGEST = 240.0
"""Lengths travelled after which a turn that has not gone round is given up."""
TURNS = {90: 1.0 / 6.0, 180: 1.0 / 6.0, 360: 1.0 / 3.0, 450: 1.0 / 6.0, 540: 1.0 / 6.0}
"""Heading change [deg] that ends a leg -> its share of ``LONGEST``. The last quarter turn gives the steady values."""

_DRIFT, _LEVEL_SPEED, _HEEL = Gauge("drift"), Gauge("level_speed"), Gauge("phi")


def turning_circle(
    model: Model,
    rudder: Quantity = "15 deg",
    speed: Quantity | None = None,
    *,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Rudder put over from straight flight and held through 540 deg of heading.

    Parameters
    ----------
    rudder : text with a unit or radians; SNAME sign, positive turns to port.
    speed : approach speed, [m/s] or text.
    hold_depth : the pilot holds depth with the elevator and damps roll, as in a turning trial at constant depth; the
        rudder is open loop. False leaves elevator and roll as trimmed, and a heavy craft sinks.

    Indices: advance, transfer, tactical diameter, steady diameter [m] (and in lengths), time to 90, 180 and 360 deg
    [s], drift angle [deg], speed loss [%], yaw rate [deg/s], roll [deg]. Transfer and diameters count towards the side
    of the turn.
    The steady values are means over the last quarter turn, or over the last 40 lengths where 540 deg are not reached.

    Source     ittc75040201, imo2002: distances from the execute, at 90 and 180 deg of heading change.

    Raises
    ------
    InputError
        Rudder zero, beyond the fins, or without a unit.
    """
    return run_trial(model, circle_ready(model, rudder, speed, hold_depth, pilot))


def circle_ready(
    model: Model,
    rudder: Quantity = "15 deg",
    speed: Quantity | None = None,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The turning circle, ready to fly; arguments as in ``turning_circle``."""
    dr = angle(rudder, "rudder", fin_limit(model), "the limit of the fins")
    if dr == 0.0:
        raise InputError('rudder: 0 deg makes no turning circle. Give an angle such as "15 deg".')
    s = setting(model, speed, pilot, piloted=hold_depth)
    length = model.craft.length
    return Ready(
        name=f"turning-{np.degrees(dr):g}deg", kind="turning circle", loop="open", setting=s,
        legs=_legs(s.orders(rudder=dr, dive=float(hold_depth)), LONGEST * s.convective),
        interval=s.convective / 20.0, gauges=(_DRIFT, _LEVEL_SPEED, _HEEL),
        read=lambda flights: {**_distances(flights, length), **_steady(flights, s, length)}, status=_status,
    )  # fmt: skip


def _legs(orders: Orders, longest: float) -> tuple[Leg, ...]:
    """Legs to every heading change of either sign from a northerly start."""
    return tuple(
        Leg(f"to {turn} deg", orders, longest * share, Until("psi", float(np.radians(turn)), absolute=True))
        for turn, share in TURNS.items()
    )


def _status(flights: Flights) -> str | None:
    if flights.by_event[0].all():
        return None
    reached = abs(np.degrees(last(flights, "psi")[0]))
    return (
        f"ended early: heading changed by {reached:.0f} deg in {LONGEST:g} lengths, 540 deg wanted. The rudder is too "
        "weak for a circle; give more rudder"
    )


def _distances(flights: Flights, length: float) -> Readings:
    side = np.where(last(flights, "psi") < 0.0, -1.0, 1.0)
    advance, transfer = flights.at("to 90 deg", "x"), side * flights.at("to 90 deg", "y")
    tactical = side * flights.at("to 180 deg", "y")
    return {
        "advance": (advance, "m"),
        "transfer": (transfer, "m"),
        "tactical_diameter": (tactical, "m"),
        "advance_lengths": (advance / length, ""),
        "transfer_lengths": (transfer / length, ""),
        "tactical_diameter_lengths": (tactical / length, ""),
        "time_to_90": (flights.when("to 90 deg"), "s"),
        "time_to_180": (flights.when("to 180 deg"), "s"),
        "time_to_360": (flights.when("to 360 deg"), "s"),
    }


def _steady(flights: Flights, s: Setting, length: float) -> Readings:
    """Means over the last leg; NaN where it was not flown to its end."""
    leg, before = "to 540 deg", "to 450 deg"
    lasting = flights.duration(leg)

    def mean(gauge: Gauge) -> Array:
        return flights.stat(leg, gauge, Stat.INTEGRAL) / lasting

    rate = (flights.at(leg, "psi", event=False) - flights.at(before, "psi", event=False)) / lasting
    diameter = 2.0 * mean(_LEVEL_SPEED) / np.where(rate == 0.0, np.nan, np.abs(rate))
    return {
        "steady_diameter": (diameter, "m"),
        "steady_diameter_lengths": (diameter / length, ""),
        "yaw_rate": (np.degrees(rate), "deg/s"),
        "drift_angle": (np.degrees(mean(_DRIFT)), "deg"),
        "speed_loss": (100.0 * (1.0 - mean(SPEED) / s.speed), "%"),
        "roll_in_turn": (np.degrees(mean(_HEEL)), "deg"),
    }
