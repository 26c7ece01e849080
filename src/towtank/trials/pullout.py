"""Pull-out: a steady turn, then the rudder amidships; done to both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.integrate import Flight, Leg, free_run
from towtank.trials.outcome import trajectory
from towtank.trials.start import angle, fin_limit, setting
from towtank.trials.trajectory import Trajectory

TURNING, SETTLING = 12.0, 20.0
"""Lengths travelled in the turn, and after the rudder is put amidships."""


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
    dr = angle(rudder, "rudder", fin_limit(model), "the limit of the fins")
    if dr == 0.0:
        raise InputError('rudder: 0 deg makes no turn to pull out of. Give an angle such as "15 deg".')
    s = setting(model, speed, pilot, piloted=hold_depth)
    base = replace(s.helm, depth=0.0) if hold_depth else replace(s.helm, pilot=None)
    orders: Sequence[tuple[str, float, float]] = (
        ("turn plus", dr, TURNING),
        ("out plus", 0.0, SETTLING),
        ("turn minus", -dr, TURNING + 3.0),
        ("out minus", 0.0, SETTLING),
    )
    legs = [Leg(name, replace(base, rudder=order), lengths * s.convective) for name, order, lengths in orders]
    flight = free_run(model, s.state, legs, thrust=s.thrust, interval=s.convective / 16.0)
    indices = {**_side(flight, "plus", s.convective), **_side(flight, "minus", s.convective)}
    return trajectory(
        model, s, flight, name=f"pull-out-{abs(np.degrees(dr)):g}deg", kind="pull-out", loop="open", indices=indices
    )


def _side(flight: Flight, word: str, convective: float) -> dict[str, tuple[float, str]]:
    inside = flight.within(f"out {word}")
    if inside.sum() < 8:
        nan = float("nan")
        return {
            f"turning_rate_{word}": (nan, "deg/s"),
            f"residual_rate_{word}": (nan, "deg/s"),
            f"decay_{word}": (nan, "s"),
        }
    time, heading = flight.time[inside], flight.state[inside, 5]
    rate = np.gradient(heading, time)
    residual = float(np.mean(rate[-max(len(rate) // 10, 2) : -1]))
    excess = np.abs(rate - residual) - np.abs(rate[0] - residual) / np.e
    below = np.flatnonzero(excess < 0.0)
    return {
        f"turning_rate_{word}": (float(np.degrees(rate[0])), "deg/s"),
        f"residual_rate_{word}": (float(np.degrees(residual)), "deg/s"),
        f"decay_{word}": (float(time[below[0]] - time[0]) if len(below) else float("nan"), "s"),
    }
