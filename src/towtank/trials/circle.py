"""Turning circle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.helm import Helm, sinking
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.integrate import Event, Flight, Leg, free_run
from towtank.trials.outcome import trajectory
from towtank.trials.start import Setting, angle, fin_limit, setting
from towtank.trials.trajectory import Trajectory

LONGEST = 240.0
"""Lengths travelled after which a turn that has not gone round is given up."""
SHARES = (1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0)
TURNS = (90.0, 180.0, 360.0, 540.0)
"""Heading changes [deg] at which a leg ends; the last quarter turn gives the steady values."""


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
    [s], drift angle [deg], speed loss [%], yaw rate [deg/s]. Transfer and diameters count towards the side of the turn.

    Source     ittc75040201: distances from the execute, at 90 and 180 deg of heading change.

    Raises
    ------
    InputError
        Rudder zero, beyond the fins, or without a unit.
    """
    dr = angle(rudder, "rudder", fin_limit(model), "the limit of the fins")
    if dr == 0.0:
        raise InputError('rudder: 0 deg makes no turning circle. Give an angle such as "15 deg".')
    s = setting(model, speed, pilot, piloted=hold_depth)
    helm = replace(s.helm, rudder=dr, depth=0.0) if hold_depth else replace(s.helm, rudder=dr, pilot=None)
    flight = free_run(
        model, s.state, _legs(helm, LONGEST * s.convective), thrust=s.thrust, interval=s.convective / 20.0
    )
    return trajectory(
        model, s, flight, name=f"turning-{np.degrees(dr):g}deg", kind="turning circle", loop="open",
        indices=_indices(model, s, flight), status=_status(flight),
    )  # fmt: skip


def _legs(helm: Helm, longest: float) -> list[Leg]:
    return [
        Leg(f"to {turn:g} deg", helm, longest * share, turned(np.radians(turn)))
        for turn, share in zip(TURNS, SHARES, strict=True)
    ]


def turned(change: float) -> Event:
    """Event at a heading change [rad] of either sign from a northerly start."""

    def event(y: Sequence[float]) -> float:
        return abs(y[5]) - change

    return event


def _status(flight: Flight) -> str | None:
    missing = [mark.leg for mark in flight.marks if mark.ended == "time"]
    if not missing:
        return None
    reached = np.degrees(np.abs(flight.state[:, 5]).max())
    return (
        f"ended early: heading changed by {reached:.0f} deg in {LONGEST:g} lengths, 540 deg wanted. The rudder is too "
        "weak for a circle; give more rudder"
    )


def _indices(model: Model, s: Setting, flight: Flight) -> dict[str, tuple[float, str]]:
    length = model.craft.length
    quarter, half, full = (flight.mark(f"to {turn:g} deg") for turn in TURNS[:3])
    nan = float("nan")
    side = float(np.sign(flight.state[-1, 5])) or 1.0
    advance = float(quarter.state[0]) if quarter else nan
    transfer = side * float(quarter.state[1]) if quarter else nan
    tactical = side * float(half.state[1]) if half else nan
    out = {
        "advance": (advance, "m"),
        "transfer": (transfer, "m"),
        "tactical_diameter": (tactical, "m"),
        "advance_lengths": (advance / length, ""),
        "tactical_diameter_lengths": (tactical / length, ""),
        "time_to_90": (quarter.time if quarter else nan, "s"),
        "time_to_180": (half.time if half else nan, "s"),
        "time_to_360": (full.time if full else nan, "s"),
    }
    return {**out, **_steady(s, flight, length)}


def _steady(s: Setting, flight: Flight, length: float) -> dict[str, tuple[float, str]]:
    """Means over the last quarter turn."""
    state = flight.state
    last = np.abs(state[:, 5]) > np.abs(state[-1, 5]) - np.pi / 2.0
    if np.abs(state[-1, 5]) < np.pi or last.sum() < 4:
        last = np.zeros(len(state), bool)
        last[-4:] = True
    time, turning = flight.time[last], state[last]
    rate = float((turning[-1, 5] - turning[0, 5]) / (time[-1] - time[0]))
    mean = _mean(time)
    speed = mean(np.linalg.norm(turning[:, 6:9], axis=1))
    drift = mean(np.arctan2(-turning[:, 7], turning[:, 6]))
    level = mean(np.linalg.norm(turning[:, 6:9], axis=1) * np.cos(_climb(turning)))
    diameter = 2.0 * level / abs(rate) if rate != 0.0 else float("nan")
    return {
        "steady_diameter": (diameter, "m"),
        "steady_diameter_lengths": (diameter / length, ""),
        "yaw_rate": (float(np.degrees(rate)), "deg/s"),
        "drift_angle": (float(np.degrees(drift)), "deg"),
        "speed_loss": (100.0 * (1.0 - speed / s.speed), "%"),
        "roll_in_turn": (float(np.degrees(mean(turning[:, 3]))), "deg"),
    }


def _mean(time: Array) -> Callable[[Array], float]:
    return lambda values: float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _climb(state: Array) -> Array:
    """Angle of the path below the horizontal [rad]."""
    speed = np.linalg.norm(state[:, 6:9], axis=1)
    down = np.array([sinking(row) for row in state.tolist()])
    return np.asarray(np.arcsin(np.clip(down / speed, -1.0, 1.0)))
