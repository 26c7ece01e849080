"""Pull-out: a steady turn, then the rudder amidships; done to both sides."""

from __future__ import annotations

import math

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Leg
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.ready import Readings, Ready, run_trial
from towtank.trials.start import angle, fin_limit, setting
from towtank.trials.trajectory import Trajectory

TURNING, SETTLING = 12.0, 20.0
"""Lengths travelled in the turn, and after the rudder is put amidships."""
LEFT = 0.1
"""Share of the settling over which the residual rate is the mean."""


def pull_out(
    model: Model,
    rudder: Quantity = "15 deg",
    speed: Quantity | None = None,
    *,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Turn with +rudder, amidships until settled, turn with -rudder, amidships again; one record.

    Parameters
    ----------
    rudder : text with a unit or radians.   speed : approach speed.   hold_depth : see ``turning_circle``.

    Indices: turning rate in each turn and residual rate at the end of each pull-out [deg/s] ("plus" and "minus": after
    +rudder and -rudder), decay [s]: time in which the excess over the residual rate falls to 1/e. A stable craft has
    the same residual rate, zero, from both sides; an unstable one keeps turning to the side it came from.

    Source     ittc75040201, pull-out test.

    Raises
    ------
    InputError
        Rudder zero, beyond the fins, or without a unit.
    """
    return run_trial(model, pull_out_ready(model, rudder, speed, hold_depth, pilot))


def pull_out_ready(
    model: Model,
    rudder: Quantity = "15 deg",
    speed: Quantity | None = None,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The pull-out, ready to fly; arguments as in ``pull_out``. Its readings need the channel ``turn`` on record."""
    dr = angle(rudder, "rudder", fin_limit(model), "the limit of the fins")
    if dr == 0.0:
        raise InputError('rudder: 0 deg makes no turn to pull out of. Give an angle such as "15 deg".')
    s = setting(model, speed, pilot, piloted=hold_depth)
    plan = (
        ("turn plus", dr, TURNING),
        ("out plus", 0.0, (1.0 - LEFT) * SETTLING),
        ("left plus", 0.0, LEFT * SETTLING),
        ("turn minus", -dr, TURNING + 3.0),
        ("out minus", 0.0, (1.0 - LEFT) * SETTLING),
        ("left minus", 0.0, LEFT * SETTLING),
    )
    legs = tuple(
        Leg(name, s.orders(rudder=order, dive=float(hold_depth)), lengths * s.convective)
        for name, order, lengths in plan
    )
    return Ready(
        name=f"pull-out-{abs(np.degrees(dr)):g}deg", kind="pull-out", loop="open", setting=s, legs=legs,
        interval=s.convective / 16.0, read=lambda flights: {**_side(flights, "plus"), **_side(flights, "minus")},
        needs=("turn",),
    )  # fmt: skip


def _side(flights: Flights, word: str) -> Readings:
    turn, out, left = (f"{part} {word}" for part in ("turn", "out", "left"))
    rate = flights.at(turn, "turn", event=False)
    residual = _heading_change(flights, out, left) / flights.duration(left)
    begin, end = flights.when(turn, event=False), flights.when(left, event=False)
    decay = [_decay(flights, i, *numbers) for i, numbers in enumerate(zip(begin, end, rate, residual, strict=True))]
    return {
        f"turning_rate_{word}": (np.degrees(rate), "deg/s"),
        f"residual_rate_{word}": (np.degrees(residual), "deg/s"),
        f"decay_{word}": (np.array(decay), "s"),
    }


def _heading_change(flights: Flights, before: str, leg: str) -> Array:
    """Heading change (N,) [rad] in ``leg``, which follows ``before``."""
    return flights.at(leg, "psi", event=False) - flights.at(before, "psi", event=False)


def _decay(flights: Flights, i: int, begin: float, end: float, rate: float, residual: float) -> float:
    """Time [s] in which the excess over the ``residual`` falls to 1/e; NaN if it does not.

    Between the samples the rate is taken as a straight line.
    """
    inside = (flights.time > begin) & (flights.time <= end)
    time = np.concatenate([[begin], flights.time[inside]])
    rates = np.concatenate([[rate], flights.series("turn")[i, inside]])
    excess = np.abs(rates - residual) - abs(rate - residual) / math.e
    below = np.flatnonzero(excess < 0.0)
    if not len(below):
        return float("nan")
    after = int(below[0])
    return float(np.interp(0.0, excess[[after, after - 1]], time[[after, after - 1]]) - begin)
