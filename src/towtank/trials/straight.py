"""Straight run: whether the craft holds its course with everything at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.integrate import Leg, free_run
from towtank.trials.outcome import trajectory
from towtank.trials.start import angle, setting
from towtank.trials.trajectory import Trajectory

LENGTHS = 15.0
"""Lengths travelled when no duration is given."""


def straight_run(
    model: Model,
    speed: Quantity | None = None,
    *,
    disturbance: Quantity = "0.1 deg",
    lengths: float = LENGTHS,
    hold_depth: bool = False,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Rudder amidships after a small drift angle; what grows is the craft's own instability.

    Parameters
    ----------
    speed : [m/s] or text.   disturbance : initial drift, text with a unit or radians.   lengths : distance to run.
    hold_depth : let the pilot hold depth; by default nothing moves, so that a heavy craft sinks as it would.

    Indices: heading change [deg], drift off the line [m], growth rate of the drift-and-yaw motion [1/s] measured on
    the record (positive: unstable), speed change [%], depth change [m].

    Raises
    ------
    InputError
        Speed not positive, a disturbance beyond 10 deg.
    """
    drift = angle(disturbance, "disturbance", np.radians(10.0), "beyond which the run is no small disturbance")
    s = setting(model, speed, pilot, piloted=hold_depth)
    helm = s.helm if hold_depth else replace(s.helm, pilot=None)
    start = s.state.copy()
    start[7] = -start[6] * np.tan(drift)
    leg = Leg("run", replace(helm, depth=0.0 if hold_depth else None), lengths * s.convective)
    flight = free_run(model, start, [leg], thrust=s.thrust, interval=s.convective / 20.0)
    state = flight.state
    size = np.hypot(state[:, 7] / s.speed, state[:, 11] * s.convective)
    # The faster mode has died out after two lengths; beyond 0.05 the motion is no longer small.
    small = (flight.time > 2.0 * s.convective) & np.logical_and.accumulate(size < 0.05) & (size > 1e-9)
    growth = float(np.polyfit(flight.time[small], np.log(size[small]), 1)[0]) if small.sum() > 8 else float("nan")
    indices = {
        "heading_change": (float(np.degrees(state[-1, 5])), "deg"),
        "off_line": (float(state[-1, 1]), "m"),
        "growth": (growth, "1/s"),
        "speed_change": (float(100.0 * (np.linalg.norm(state[-1, 6:9]) / s.speed - 1.0)), "%"),
    }
    return trajectory(
        model, s, flight, name="straight", kind="straight run", loop="open", indices=indices,
    )  # fmt: skip
