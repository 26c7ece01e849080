"""From a flight to a trajectory: the samples, the commands, the indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.effort import effort
from towtank.provenance import provenance
from towtank.trials.integrate import Flight
from towtank.trials.start import Setting
from towtank.trials.trajectory import Trajectory

Indices = Mapping[str, tuple[float, str]]


def trajectory(
    model: Model,
    setting: Setting,
    flight: Flight,
    *,
    name: str,
    kind: str,
    loop: str,
    indices: Indices,
    status: str | None = None,
    current: Sequence[float] = (0.0, 0.0, 0.0),
    curves: Mapping[str, Any] | None = None,
) -> Trajectory:
    """Trajectory of ``flight`` with ``indices`` and the effort of the fins.

    ``status`` stands in for the flight's when the flight itself went to its end. ``curves``: plain series that belong
    to the trial, such as yaw rate against rudder; kept in the provenance.
    """
    fins = len(model.craft.fins)
    orders = [_order(flight, i, fins) for i in range(len(flight.time))]
    delta = flight.state[:, 12 : 12 + fins]
    command = np.array([order[0] for order in orders]).reshape(-1, 3)
    loads = effort(flight.time, delta, flight.state[:, 6:9], [fin.max_angle for fin in model.craft.fins])
    return Trajectory(
        name=name,
        kind=kind,
        loop=loop,
        craft=model.craft.name,
        level=model.derivatives.level,
        time=flight.time,
        position=flight.state[:, 0:3],
        attitude=flight.state[:, 3:6],
        nu=flight.state[:, 6:12],
        delta=delta,
        command=command,
        setpoint={"heading": np.array([o[1] for o in orders]), "depth": np.array([o[2] for o in orders])},
        indices={**indices, **_common(flight, setting), **loads},
        status=flight.status if flight.status != "done" or status is None else status,
        provenance=provenance(
            speed=setting.speed,
            thrust=setting.thrust,
            trim={"pitch": setting.trim.pitch, "elevator": setting.trim.elevator, "level": setting.trim.holds},
            current=list(current),
            marks=[{"leg": m.leg, "time": m.time, "ended": m.ended} for m in flight.marks],
            notes=list(setting.notes),
            curves=dict(curves or {}),
            evaluations=flight.evaluations,
        ),
    )


def _order(flight: Flight, i: int, fins: int) -> tuple[tuple[float, float, float], float, float]:
    """Command, heading wanted and depth wanted of sample ``i``; NaN where there is no order."""
    helm = flight.legs[int(flight.leg[i])].helm
    row = flight.state[i].tolist()
    state, extra = row[: 12 + fins], row[12 + fins :]
    heading = helm.wanted_heading(state, extra[2])
    depth = np.nan if helm.depth is None else helm.depth
    return helm.order(state, extra)[0], np.nan if heading is None else heading, depth


def _common(flight: Flight, setting: Setting) -> dict[str, tuple[float, str]]:
    """Numbers every trial has: lasting time, change of depth, largest roll."""
    state = flight.state
    return {
        "duration": (float(flight.time[-1] - flight.time[0]), "s"),
        "depth_change": (float(state[-1, 2] - state[0, 2]), "m"),
        "largest_roll": (float(np.degrees(np.abs(state[:, 3]).max())), "deg"),
        "largest_pitch": (float(np.degrees(np.abs(state[:, 4]).max())), "deg"),
    }


def crossing(time: Array, values: Array, level: float) -> float:
    """First time [s] at which ``values`` (N,) pass ``level``; NaN if never. Cubic between the samples.

    Source     scipy.interpolate.CubicSpline.
    """
    from scipy.interpolate import CubicSpline

    if len(time) < 4:
        return float("nan")
    roots = CubicSpline(time, values - level).roots(extrapolate=False)
    return float(roots[0]) if len(roots) else float("nan")


def peak(time: Array, values: Array) -> tuple[float, float]:
    """Time [s] and height of the largest of ``values`` (N,), from a cubic through the samples."""
    from scipy.interpolate import CubicSpline

    if len(time) < 4:
        i = int(np.argmax(values))
        return float(time[i]), float(values[i])
    spline = CubicSpline(time, values)
    candidates = np.concatenate([[time[0], time[-1]], spline.derivative().roots(extrapolate=False)])
    heights = spline(candidates)
    return float(candidates[int(np.argmax(heights))]), float(heights.max())
