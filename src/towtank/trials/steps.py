"""Steps of heading and of depth under the pilot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Gauge, Leg, Stat
from towtank.errors import InputError
from towtank.frames import Array, rotation
from towtank.model.equations import STILL, Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.ready import Readings, Ready, run_trial
from towtank.trials.start import Setting, angle, setting, span
from towtank.trials.trajectory import Trajectory

LEAD = 2.0
"""Lengths travelled on the old order before the step."""
HEADING_LENGTHS, DEPTH_LENGTHS = 40.0, 70.0
"""Lengths travelled after the step."""
LARGEST = np.radians(175.0)
"""Largest change of heading [rad]. The pilot turns the shorter way round, which half a turn does not have: round-off
would choose the side."""
BAND = 0.05
"""Share of the step within which the craft counts as settled."""
LEVELS = (0.1, 0.9, 1.0 - BAND, 1.0 + BAND)
"""Shares of the step at which a response is timed."""


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
    change : new heading minus old; text with a unit or radians, positive to starboard, at most 175 deg.
    speed : through the water, [m/s] or text.   pilot : designed from the model when not given.
    current : (3,) velocity of the water [m/s, NED].   lengths : distance run after the order.

    Indices: rise time (10 to 90 %), settling time (to 5 % of the step) [s], overshoot [deg] and [%], error at the end
    [deg], largest change of depth [m], effort of the fins.

    Raises
    ------
    InputError
        A change of zero, beyond 175 deg either way, or without a unit.
    """
    return run_trial(model, heading_step_ready(model, change, speed, pilot, current, lengths))


def heading_step_ready(
    model: Model,
    change: Quantity = "30 deg",
    speed: Quantity | None = None,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    lengths: float = HEADING_LENGTHS,
) -> Ready:
    """The heading step, ready to fly; arguments as in ``heading_step``."""
    step = angle(change, "change", LARGEST, "too near half a turn, beyond which the shorter way round is the other")
    if step == 0.0:
        raise InputError('change: a heading step of 0 deg tells nothing. Give an angle such as "30 deg".')
    s, away = setting(model, speed, pilot), Gauge("z", absolute=True)
    return Ready(
        name=f"heading-step-{np.degrees(step):g}deg", kind="heading step", loop="closed", setting=s,
        legs=_legs(s, lengths, heading=step), interval=s.convective / 16.0, gauges=(*_gauges("psi", step), away),
        start=adrift(s, current), current=drifting(current),
        read=lambda flights: {
            **_response(flights, "psi", step, "deg", float(np.degrees(1.0))),
            "largest_depth_error": (flights.over(away, Stat.HIGH), "m"),
        },
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
    return run_trial(model, depth_step_ready(model, change, speed, pilot, current, lengths))


def depth_step_ready(
    model: Model,
    change: Quantity | None = None,
    speed: Quantity | None = None,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    lengths: float = DEPTH_LENGTHS,
) -> Ready:
    """The depth step, ready to fly; arguments as in ``depth_step``."""
    step = model.craft.length / 3.0 if change is None else span(change, model.craft.length, "change")
    if step == 0.0:
        raise InputError('change: a depth step of 0 m tells nothing. Give a distance such as "2 m".')
    s, away = setting(model, speed, pilot), Gauge("psi", absolute=True)
    return Ready(
        name=f"depth-step-{step:.3g}m", kind="depth step", loop="closed", setting=s,
        legs=_legs(s, lengths, depth=step), interval=s.convective / 16.0, gauges=(*_gauges("z", step), away),
        start=adrift(s, current), current=drifting(current),
        read=lambda flights: {
            **_response(flights, "z", step, "m", 1.0),
            "largest_heading_error": (np.degrees(flights.over(away, Stat.HIGH)), "deg"),
        },
    )  # fmt: skip


def _legs(s: Setting, lengths: float, **changed: float) -> tuple[Leg, Leg]:
    """The old order, heading and depth zero, then the ``changed`` one."""
    return (
        Leg("before", s.orders(steer=1.0, dive=1.0), LEAD * s.convective),
        Leg("after", s.orders(steer=1.0, dive=1.0, **changed), lengths * s.convective),
    )


def adrift(s: Setting, current: Sequence[float]) -> Array:
    """Start (12 + n,) of a craft at its approach speed through water that moves with ``current`` (3,) [m/s, NED].

    The speed over ground is the speed through the water plus the current.

    Raises
    ------
    InputError
        Not three finite numbers, or a current as fast as the craft.
    """
    water = np.asarray(current, dtype=float)
    if water.shape != (3,) or not np.all(np.isfinite(water)):
        raise InputError(f"current {current!r}: give three finite numbers, north, east, down [m/s].")
    if float(np.linalg.norm(water)) >= s.speed:
        raise InputError(
            f"current {np.linalg.norm(water):.3g} m/s is not below the craft's {s.speed:.3g} m/s; it cannot make way "
            "against it. Give a slower current or a higher speed."
        )
    start = s.state.copy()
    start[6:9] += rotation(s.state[3:6]).T @ water
    return start


def drifting(current: Sequence[float]) -> tuple[float, float, float]:
    """``current`` as three floats."""
    north, east, down = (float(x) for x in current)
    return north, east, down


def _gauges(channel: str, step: float) -> tuple[Gauge, ...]:
    """Watches of ``channel`` at the ``LEVELS`` of ``step``, in their order."""
    return tuple(Gauge(channel, share * step) for share in LEVELS)


def _response(flights: Flights, channel: str, step: float, unit: str, factor: float) -> Readings:
    """Rise, settling, overshoot and last error of a step; NaN where it was not flown to its end."""
    low, high, inner, outer = _gauges(channel, step)
    begin, share = flights.when("before", event=False), flights.at("after", channel, event=False) / step
    rise = flights.stat("after", high, Stat.FIRST) - flights.stat("after", low, Stat.FIRST)
    inside = np.abs(share - 1.0) <= BAND
    left = np.fmax(flights.stat("after", inner, Stat.LAST), flights.stat("after", outer, Stat.LAST)) - begin
    farthest = flights.stat("after", low, Stat.HIGH if step > 0.0 else Stat.LOW) / step
    overshoot = np.maximum(farthest - 1.0, 0.0)
    return {
        "rise_time": (rise, "s"),
        "settling_time": (np.where(inside, left, np.nan), "s"),
        "overshoot": (overshoot * abs(step) * factor, unit),
        "overshoot_share": (100.0 * overshoot, "%"),
        "last_error": ((share - 1.0) * step * factor, unit),
    }
