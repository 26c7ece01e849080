"""A mission made to tell the coefficients: many sines on the fins, weaves, turns, depth steps, several speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from towtank.engine.clock import clock_of
from towtank.engine.plan import Leg
from towtank.errors import InputError, TrialError
from towtank.field.log import FINS
from towtank.field.sea_water import check_seed
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import linearise
from towtank.pilot.orders import FIN_ORDERS
from towtank.quantity import Quantity
from towtank.trials.ready import Ready
from towtank.trials.start import Setting, fin_limit, setting

_Card = TypeVar("_Card")

HOLD = 1.0 / 16.0
"""Lengths travelled under one order of the fins."""
BASE = 24.0
"""Lengths travelled in the longest period of the sines."""
HARMONICS = range(3, 25)
"""Multiples of the base frequency: periods from 8 lengths to 1, around the modes of a slender craft."""
SHARE = (0.12, 0.10, 0.08)
"""Root mean square of the sines of rudder, elevator and aileron, as shares of the fins' limit."""
BLOCK = 8.0
"""Lengths travelled in one block."""
THROTTLES = (1.0, 0.49, 1.96, 0.72, 1.44)
"""Thrust of the blocks as a multiple of that of the set speed. Steady speeds would be 0.7 to 1.4 of it; a block ends
before the craft is there."""
MANOEUVRES = ("weave", "turn to starboard", "depth step", "turn to port", "sines alone")
DEEP = 3.0
"""Lengths below the surface at the start."""
STEP = 0.5
"""Change of depth of a depth step, in lengths."""
WEAVE = np.radians(15.0)
"""Change of heading to either side in a weave."""
SWEEPS = 4
"""Sides of a weave in a block."""
OPEN = 0.25
"""Rudder of turns and weaves in open loop as a share of the limit of the fins."""
TURN = 0.5
"""Rate of turn ordered as a share of the pilot's limit."""
LONGEST = 24.0 * 60.0
"""Longest mission [min]."""


def identification_ready(model: Model, minutes: float, seed: int = 0, speed: Quantity | None = None) -> Ready:
    """The mission, ready to fly; its legs end by time.

    Parameters
    ----------
    minutes : length, rounded to whole orders.   seed : of the phases of the sines and of the order of the blocks.
    speed : about which it is flown, [m/s] or text; the craft's own when left out.

    Sines act on rudder, elevator and aileron all the time, each on frequencies of its own. Beside them every block of
    8 lengths has a manoeuvre and a thrust. A pilot holds the depth where one can be designed. A craft that is not
    stable in yaw is steered by the pilot too, and the sines are added to what it asks; a stable one has its rudder in
    open loop.

    Source     morelli2012: sines of interleaved frequencies on several controls at once.
    Departure  Phases are drawn, not those of the least peak; amplitudes are equal.

    Raises
    ------
    InputError
        A craft without fins or with more than a record holds, minutes that are not positive or too many, a speed that
        is not positive, or a seed that is no seed.
    """
    n = len(model.craft.fins)
    if not 0 < n <= FINS:
        raise InputError(f"survey of {model.craft.name}: the craft has {n} fins; the sines move 1 to {FINS} of them.")
    if not (np.isfinite(minutes) and 0.0 < minutes <= LONGEST):
        raise InputError(f"survey: {minutes:g} minutes. Give a time above zero and up to {LONGEST:g} minutes.")
    s = _setting(model, speed)
    tick = clock_of(model, s.speed).tick
    hold = tick * max(1, round(HOLD * s.convective / tick))
    count = max(1, round(60.0 * minutes / hold))
    fins = _sines(model, np.asarray(hold / s.convective * np.arange(count)), seed) @ model.craft.mixing.T
    per_block = max(1, round(BLOCK * s.convective / hold))
    blocks = list(_blocks(model, s, -(-count // per_block), seed))
    legs = tuple(_leg(s, blocks[i // per_block], (i % per_block) / per_block, hold, fins[i], i) for i in range(count))
    start = s.state.copy()
    start[2] = DEEP * model.craft.length
    return Ready(
        name=f"survey-{minutes:g}min-{seed}", kind="identification mission",
        loop="closed" if blocks[0].steered else "open", setting=s, legs=legs, interval=s.convective / 16.0,
        read=lambda flights: {}, start=start,
    )  # fmt: skip


def identification_legs(model: Model, minutes: float, seed: int = 0, speed: Quantity | None = None) -> tuple[Leg, ...]:
    """Legs of ``identification_ready``, which has the same arguments and errors."""
    return identification_ready(model, minutes, seed, speed).legs


@dataclass(frozen=True)
class _Block:
    """A manoeuvre of 8 lengths.

    throttle : thrust as a multiple.   side : to which a weave begins, 1 or -1.   turn : 1 to starboard, -1 to port, 0
    none.   depth [m], heading [rad] : about which it is flown.   steered : by the pilot, at the ``rate`` of turn
    [rad/s]; else in open loop with the ``rudder`` [rad].
    """

    manoeuvre: str
    throttle: float
    side: float
    turn: float
    depth: float
    heading: float
    steered: bool
    rate: float
    rudder: float


def _setting(model: Model, speed: Quantity | None) -> Setting:
    """Start with a pilot, or without one where none can be designed."""
    try:
        return setting(model, speed)
    except TrialError:
        return setting(model, speed, piloted=False)


def _sines(model: Model, lengths: Array, seed: int) -> Array:
    """Angles (count, 3) [rad] of rudder, elevator and aileron, after so many ``lengths`` (count,)."""
    draw = np.random.default_rng([check_seed(seed), 1])
    out = np.zeros((len(lengths), 3))
    for axis, share in enumerate(SHARE):
        own = np.array(HARMONICS)[axis::3]
        phases = draw.uniform(0.0, 2.0 * np.pi, len(own))
        waves = np.sin(2.0 * np.pi * own * lengths[:, None] / BASE + phases)
        out[:, axis] = share * fin_limit(model) * np.sqrt(2.0 / len(own)) * waves.sum(axis=1)
    return out


def _blocks(model: Model, s: Setting, count: int, seed: int) -> Iterator[_Block]:
    """Manoeuvres in a drawn order, each as often as the others; the heading goes on from block to block."""
    draw = np.random.default_rng([check_seed(seed), 2])
    steered = s.pilot is not None and not _stable(model, s.speed)
    rate, rudder = TURN * s.pilot.turn_limit if s.pilot else 0.0, OPEN * fin_limit(model)
    kinds = _dealt(draw, MANOEUVRES, count)
    throttles = _dealt(draw, THROTTLES, count)
    level, side, heading = DEEP * model.craft.length, 1.0, 0.0
    depth = level
    for kind, throttle in zip(kinds, throttles, strict=True):
        side = -side if kind == "weave" else side
        if kind == "depth step":
            depth = level + (STEP * model.craft.length if depth == level else 0.0)
        turn = {"turn to starboard": 1.0, "turn to port": -1.0}.get(kind, 0.0)
        yield _Block(kind, throttle, side, turn, depth, heading, steered, rate, rudder)
        heading += turn * rate * BLOCK * s.convective


def _dealt(draw: np.random.Generator, cards: Sequence[_Card], count: int) -> list[_Card]:
    """``count`` of the ``cards``, from decks shuffled one after the other."""
    rounds = [[cards[i] for i in draw.permutation(len(cards))] for _ in range(-(-count // len(cards)))]
    return [card for deck in rounds for card in deck][:count]


def _stable(model: Model, speed: float) -> bool:
    """True when the craft at ``speed`` [m/s] with its fins at rest keeps a straight course.

    Source     Eigenvalues of v, r in the linear model about level flight.
    """
    part = linearise(model, speed).part(("v", "r"), ("rudder",))
    return bool(part.eigenvalues.real.max() < 0.0)


def _leg(s: Setting, block: _Block, share: float, hold: float, fins: Array, number: int) -> Leg:
    """One order of the fins, ``share`` 0..1 into its block; ``fins`` (n,) [rad] are the angles of the sines."""
    piloted = float(s.pilot is not None)
    side = block.side * (1.0 if int(share * SWEEPS) % 2 == 0 else -1.0)
    weave = side if block.manoeuvre == "weave" else 0.0
    changes = {"throttle": block.throttle, "dive": piloted, "depth": block.depth}
    changes |= dict(zip(FIN_ORDERS, fins.tolist(), strict=False))
    if not block.steered:
        changes["rudder"] = (weave - block.turn) * block.rudder
    elif block.turn:
        changes |= {"steer": 1.0, "turning": 1.0, "turn": block.turn * block.rate}
    else:
        changes |= {"steer": 1.0, "heading": block.heading + weave * WEAVE}
    return Leg(f"{block.manoeuvre} {number + 1}", s.orders(**changes), hold)
