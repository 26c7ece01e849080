"""Straight run: whether the craft holds its course with everything at rest."""

from __future__ import annotations

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Leg
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.ready import Readings, Ready, last, run_trial
from towtank.trials.start import Setting, angle, setting
from towtank.trials.trajectory import Trajectory

LENGTHS = 15.0
"""Lengths travelled when no duration is given."""
SAMPLES = 20.0
"""Samples in the time of one length."""


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
    return run_trial(model, straight_ready(model, speed, disturbance, lengths, hold_depth, pilot))


def straight_ready(
    model: Model,
    speed: Quantity | None = None,
    disturbance: Quantity = "0.1 deg",
    lengths: float = LENGTHS,
    hold_depth: bool = False,
    pilot: Pilot | None = None,
) -> Ready:
    """The straight run, ready to fly; arguments as in ``straight_run``."""
    drift = angle(disturbance, "disturbance", np.radians(10.0), "beyond which the run is no small disturbance")
    s = setting(model, speed, pilot, piloted=hold_depth)
    start = s.state.copy()
    start[7] = -start[6] * np.tan(drift)
    leg = Leg("run", s.orders(dive=1.0 if hold_depth else 0.0), lengths * s.convective)
    return Ready(
        name="straight", kind="straight run", loop="open", setting=s, legs=(leg,), start=start,
        interval=s.convective / SAMPLES, read=lambda flights: _indices(s, flights),
        needs=("v", "r"),
    )  # fmt: skip


def _indices(s: Setting, flights: Flights) -> Readings:
    return {
        "heading_change": (np.degrees(last(flights, "psi")), "deg"),
        "off_line": (last(flights, "y"), "m"),
        "growth": (np.array([_growth(s, flights, i) for i in range(len(flights))]), "1/s"),
        "speed_change": (100.0 * (last(flights, "speed") / s.speed - 1.0), "%"),
    }


def _growth(s: Setting, flights: Flights, i: int) -> float:
    """Rate [1/s] at which drift and yaw grow, from a straight line through the logarithm of their size."""
    size: Array = np.hypot(flights.series("v")[i] / s.speed, flights.series("r")[i] * s.convective)
    with np.errstate(invalid="ignore"):
        # The faster mode has died out after two lengths; beyond 0.05 the motion is no longer small.
        small = (flights.time > 2.0 * s.convective) & np.logical_and.accumulate(size < 0.05) & (size > 1e-9)
    return float(np.polyfit(flights.time[small], np.log(size[small]), 1)[0]) if small.sum() > 8 else float("nan")
