"""What a run is asked to do: legs with orders and ends, gauges, the clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from towtank.engine.loop import channels, observed
from towtank.errors import InputError
from towtank.frames import Array
from towtank.pilot.orders import ORDERS, Orders

MOST_GAUGES = 32


class Stat(IntEnum):
    """What a gauge holds for every leg."""

    LOW = 0
    LOW_TIME = 1
    HIGH = 2
    HIGH_TIME = 3
    INTEGRAL = 4
    SQUARE = 5
    ABOVE = 6
    """Time above the level [s]."""
    FIRST = 7
    """First crossing of the level [s]; NaN without one."""
    LAST = 8


class Ended(IntEnum):
    """What ended a trajectory."""

    DONE = 0
    NOT_FINITE = 1
    TOO_FAST = 2
    LATE = 3
    """A required event did not come in its leg's time."""
    STOPPED = 4
    """Interrupted before it was run."""


@dataclass(frozen=True)
class Until:
    """A leg ends when ``channel`` (its magnitude if ``absolute``) passes ``level`` from the side the leg began on.

    A leg that begins on its level takes its side from the first motion away from it. The heading psi is unwrapped; roll
    phi jumps at 180 deg, which counts as passing. What the steering keeps (rudder, trims, ...) cannot be waited for.
    """

    channel: str
    level: float
    absolute: bool = False


@dataclass(frozen=True)
class Gauge:
    """Watch ``channel`` (its magnitude if ``absolute``) in every leg; ``level`` is for times above and crossings."""

    channel: str
    level: float = 0.0
    absolute: bool = False


@dataclass(frozen=True)
class Leg:
    """Part of a run under one set of orders. It ends by ``until``, or after ``within`` [s].

    When ``required`` is set and the event does not come, the trajectory ends there.
    """

    name: str
    orders: Orders
    within: float
    until: Until | None = None
    required: bool = False


@dataclass(frozen=True)
class Clock:
    """Control period ``tick`` [s] and the number of RK4 ``steps`` in it.

    The command is held over a tick. A leg's end cuts a tick where it falls, and the new orders act at once.
    """

    tick: float = 0.1
    steps: int = 2

    def __post_init__(self) -> None:
        if not (self.tick > 0.0 and np.isfinite(self.tick) and isinstance(self.steps, int) and self.steps >= 1):
            raise InputError(
                f"clock: tick {self.tick:g} s with {self.steps} steps. Give a positive period and one step or more."
            )


@dataclass(frozen=True)
class Log:
    """Channels kept over time, every ``every`` ticks. No names: all channels."""

    names: tuple[str, ...] = ()
    every: int = 1

    def __post_init__(self) -> None:
        if not (isinstance(self.every, int) and self.every >= 1):
            raise InputError(f"log: every {self.every!r} ticks. Give a whole number, one or more.")


def leg_table(legs: Sequence[Leg], fins: int) -> Array:
    """Legs as rows of numbers for the loop.

    Raises
    ------
    InputError
        No legs, a duration that is not positive, an order that is not finite, or an unknown channel.
    """
    if not legs:
        raise InputError("run: no leg to run. Give at least one.")
    rows = []
    for leg in legs:
        orders = [float(getattr(leg.orders, name)) for name in ORDERS]
        if not (leg.within > 0.0 and np.isfinite(leg.within)):
            raise InputError(f"leg {leg.name}: within {leg.within:g} s. Give a positive, finite duration.")
        if not np.all(np.isfinite(orders)):
            raise InputError(f"leg {leg.name}: an order is not finite ({leg.orders}). Give finite numbers.")
        end = [-1.0, 0.0, 0.0]
        if leg.until is not None:
            end = [_awaited(leg, leg.until, fins), float(leg.until.absolute), leg.until.level]
        rows.append([leg.within, *end, float(leg.required), *orders])
    return np.array(rows)


def _awaited(leg: Leg, until: Until, fins: int) -> int:
    """Place of the channel a leg waits for."""
    found = place(until.channel, fins)
    if not np.isfinite(until.level):
        raise InputError(f"leg {leg.name}: until {until.channel} = {until.level}. Give a finite level.")
    if found >= observed(fins) and until.channel != "fin_travel":
        raise InputError(
            f"leg {leg.name}: {until.channel} is kept by the steering and jumps at a control period, so no moment can "
            "be found at which it passes a level. Wait for a channel of the motion."
        )
    return found


def gauge_table(gauges: Sequence[Gauge], fins: int) -> Array:
    """Gauges as rows of numbers for the loop.

    Raises
    ------
    InputError
        More than the loop has room for, or an unknown channel.
    """
    if len(gauges) > MOST_GAUGES:
        raise InputError(f"run: {len(gauges)} gauges; the loop has room for {MOST_GAUGES}. Use fewer, or log channels.")
    for gauge in gauges:
        if not np.isfinite(gauge.level):
            raise InputError(f"gauge of {gauge.channel}: level {gauge.level}. Give a finite level.")
    return np.array([[place(g.channel, fins), float(g.absolute), g.level] for g in gauges]).reshape(-1, 3)


def place(channel: str, fins: int) -> int:
    """Place of ``channel`` among the channels.

    Raises
    ------
    InputError
        No channel of this name.
    """
    names = channels(fins)
    if channel not in names:
        raise InputError(f"run: no channel {channel!r}. Choose from {', '.join(names)}.")
    return names.index(channel)
