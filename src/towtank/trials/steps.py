"""Steps of heading and of depth under the pilot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity, si
from towtank.trials.integrate import Flight, Leg, free_run
from towtank.trials.outcome import crossing, peak, trajectory
from towtank.trials.start import Setting, angle, setting
from towtank.trials.trajectory import Trajectory

LEAD = 2.0
"""Lengths travelled on the old order before the step."""
HEADING_LENGTHS, DEPTH_LENGTHS = 40.0, 70.0
"""Lengths travelled after the step."""
BAND = 0.05
"""Share of the step within which the craft counts as settled."""


def heading_step(
    model: Model,
    change: Quantity = "30 deg",
    speed: Quantity | None = None,
    *,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    lengths: float = HEADING_LENGTHS,
) -> Trajectory:
    """Order a new heading; depth is held.

    Parameters
    ----------
    change : new heading minus old; text with a unit or radians, positive to starboard, at most 180 deg.
    speed : through the water, [m/s] or text.   pilot : designed from the model when not given.
    current : (3,) velocity of the water [m/s, NED].   lengths : distance run after the order.

    Indices: rise time (10 to 90 %), settling time (to 5 % of the step) [s], overshoot [deg] and [%], error at the end
    [deg], largest change of depth [m], effort of the fins.

    Raises
    ------
    InputError
        A change of zero, beyond 180 deg, or without a unit.
    """
    step = angle(change, "change", np.pi, "beyond which the other way round is shorter")
    if step == 0.0:
        raise InputError('change: a heading step of 0 deg tells nothing. Give an angle such as "30 deg".')
    s = setting(model, speed, pilot)
    flight = _run(model, s, current, lengths, (0.0, step), (0.0, 0.0))
    indices = _response(s, flight, flight.state[:, 5], step, "deg", float(np.degrees(1.0)))
    away = float(np.abs(flight.state[:, 2]).max())
    return trajectory(
        model, s, flight, name=f"heading-step-{np.degrees(step):g}deg", kind="heading step", loop="closed",
        indices={**indices, "largest_depth_error": (away, "m")}, current=current,
    )  # fmt: skip


def depth_step(
    model: Model,
    change: Quantity | None = None,
    speed: Quantity | None = None,
    *,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    lengths: float = DEPTH_LENGTHS,
) -> Trajectory:
    """Order a new depth; heading is held.

    Parameters
    ----------
    change : new depth minus old, [m] or text, positive down; a third of the craft's length when not given.

    Other parameters and indices as in ``heading_step``, with metres for degrees.

    Raises
    ------
    InputError
        A change of zero.
    """
    step = model.craft.length / 3.0 if change is None else si(change, "m", "change")
    if step == 0.0:
        raise InputError('change: a depth step of 0 m tells nothing. Give a distance such as "2 m".')
    s = setting(model, speed, pilot)
    flight = _run(model, s, current, lengths, (0.0, 0.0), (0.0, step))
    indices = _response(s, flight, flight.state[:, 2], step, "m", 1.0)
    away = float(np.degrees(np.abs(flight.state[:, 5]).max()))
    return trajectory(
        model, s, flight, name=f"depth-step-{step:.3g}m", kind="depth step", loop="closed",
        indices={**indices, "largest_heading_error": (away, "deg")}, current=current,
    )  # fmt: skip


def _run(
    model: Model,
    s: Setting,
    current: Sequence[float],
    lengths: float,
    headings: tuple[float, float],
    depths: tuple[float, float],
) -> Flight:
    start = s.state.copy()
    # The craft is at rest in the moving water: speed over ground is speed through the water plus the current.
    start[6:9] += adrift(s, current)
    helm = replace(s.helm, current=drifting(current))
    legs = [
        Leg("before", replace(helm, heading=headings[0], depth=depths[0]), LEAD * s.convective),
        Leg("after", replace(helm, heading=headings[1], depth=depths[1]), lengths * s.convective),
    ]
    return free_run(model, start, legs, thrust=s.thrust, interval=s.convective / 16.0, current=tuple(current))


def adrift(s: Setting, current: Sequence[float]) -> Array:
    """Velocity of the water (3,) [m/s] in the body axes of the start.

    Raises
    ------
    InputError
        Not three finite numbers, or a current as fast as the craft.
    """
    from towtank.frames import rotation

    water = np.asarray(current, dtype=float)
    if water.shape != (3,) or not np.all(np.isfinite(water)):
        raise InputError(f"current {current!r}: give three finite numbers, north, east, down [m/s].")
    if float(np.linalg.norm(water)) >= s.speed:
        raise InputError(
            f"current {np.linalg.norm(water):.3g} m/s is not below the craft's {s.speed:.3g} m/s; it cannot make way "
            "against it. Give a slower current or a higher speed."
        )
    return np.asarray(rotation(s.state[3:6]).T @ water)


def drifting(current: Sequence[float]) -> tuple[float, float, float]:
    """``current`` as three floats."""
    north, east, down = (float(x) for x in current)
    return north, east, down


def _response(
    s: Setting, flight: Flight, values: Array, step: float, unit: str, factor: float
) -> dict[str, tuple[float, str]]:
    """Rise, settling, overshoot and last error of a step."""
    begin = flight.marks[0].time if flight.marks else 0.0
    after = flight.within("after")
    time, share = flight.time[after] - begin, values[after] / step
    if len(time) < 8:
        return {}
    rise = crossing(time, share, 0.9) - crossing(time, share, 0.1)
    outside = np.flatnonzero(np.abs(share - 1.0) > BAND)
    settled = (
        np.nan
        if len(outside) and outside[-1] == len(share) - 1
        else float(time[outside[-1] + 1])
        if len(outside)
        else 0.0
    )
    overshoot = max(peak(time, share)[1] - 1.0, 0.0)
    size = abs(step) * factor
    return {
        "rise_time": (rise, "s"),
        "settling_time": (settled, "s"),
        "overshoot": (overshoot * size, unit),
        "overshoot_share": (100.0 * overshoot, "%"),
        "last_error": (float((share[-1] - 1.0) * step * factor), unit),
    }
