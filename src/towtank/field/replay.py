"""A record flown again by the model: once, or by many craft at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from towtank.engine.plan import Clock, Ended, Leg, Log
from towtank.engine.run import ONE, Ensemble, fly
from towtank.engine.start import at
from towtank.field.begin import Beginning
from towtank.field.course import Course, Part, course_of
from towtank.field.log import MEASURED, SeaLog
from towtank.frames import Array, rotation
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.progress import Progress, Silent

LEGS = 300
"""Most legs of one call of the engine, whose arrays grow with legs times craft."""
NUMBERS = 6_000_000
"""Most numbers of the log of one call: 48 MB."""
KEPT = (*MEASURED, "rudder", "elevator", "aileron")
"""Channels of the engine that a replay keeps, beside the fins."""


@dataclass(frozen=True)
class Scatter:
    """M craft that fly side by side, and where each begins.

    columns : parameter of the engine -> (M,).   current (M, 3) : standard normal numbers that multiply the standard
    error of the current; those of the state at each begin are drawn from ``seed``.
    bias : channel -> (M,), offset of its sensor all along: the craft begins that much lower than the record says; of
    ``delta<i>``, that much lower stands fin i.
    """

    columns: Mapping[str, Array]
    current: Array
    seed: int = 0
    bias: Mapping[str, Array] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of craft."""
        return len(self.current)


@dataclass(frozen=True)
class Replay:
    """Motion of M craft along a record.

    course : what was flown.   time (N + 1,) [s] : of the record.   channels : name of ``KEPT`` or ``delta<i>`` ->
    (M, N + 1), NaN where nothing was flown or the craft was lost; heading unwrapped from that of the record.
    lost (M,) : parts in which a craft did not come to the end.
    """

    course: Course
    time: Array
    channels: Mapping[str, Array]
    lost: NDArray[np.int64]
    words: tuple[str, ...] = field(default_factory=tuple)

    def __getitem__(self, name: str) -> Array:
        """Channel (M, N + 1)."""
        return self.channels[name]

    @property
    def loop(self) -> str:
        """The loop: open, or closed by a pilot."""
        return self.course.loop


def replay(
    model: Model,
    log: SeaLog,
    *,
    pilot: Pilot | None = None,
    horizon: float | None = None,
    start: Beginning | None = None,
    speed: float | None = None,
    progress: Progress | None = None,
) -> Replay:
    """Fly ``model`` as ``log`` was flown: in open loop with its fin angles, or with its orders through ``pilot``.

    Parameters are those of ``towtank.field.course.course_of``.

    Raises
    ------
    InputError
        A record of another craft, without what drives it, or without a part of two seconds in one piece.
    """
    return flown(course_of(model, log, pilot=pilot, horizon=horizon, start=start, speed=speed), progress=progress)


def flown(
    course: Course,
    scatter: Scatter | None = None,
    *,
    names: Sequence[str] = KEPT,
    finer: int = 1,
    progress: Progress | None = None,
) -> Replay:
    """Fly ``course``, once or by the craft of ``scatter``.

    names : channels that are kept, beside the fins.   finer : factor on the RK4 steps of a tick.
    """
    bars = progress or Silent()
    clock = Clock(course.clock.tick, course.clock.steps * finer)
    fins = [f"delta{i + 1}" for i in range(len(course.model.craft.fins))]
    kept = (*names, *fins)
    count = scatter.count if scatter else 1
    ticks = len(course.drive.time)
    kind = np.float64 if count == 1 else np.float32
    out = {name: np.full((count, ticks), np.nan, dtype=kind) for name in kept}
    lost = np.zeros(count, dtype=np.int64)
    bars.start("replay", len(course.parts))
    for number, part in enumerate(course.parts):
        block, gone = _part(course, part, scatter, kept, clock, number)
        for i, name in enumerate(kept):
            out[name][:, part.first : part.last + 1] = block[:, :, i]
        lost += gone
        bars.step("replay")
    bars.done("replay")
    words = course.words
    if lost.any():
        words = (*words, f"{int((lost > 0).sum())} of {count} craft left the range of the model before a part ended")
    return Replay(course, course.drive.time, out, lost, words)


def _part(
    course: Course, part: Part, scatter: Scatter | None, kept: Sequence[str], clock: Clock, number: int
) -> tuple[Array, NDArray[np.int64]]:
    """Channels (M, ticks + 1, C) of one part, and which craft were lost (M,)."""
    count = scatter.count if scatter else 1
    starts, columns = _starts(course, part, scatter, number)
    offsets = _offsets(course, scatter)
    block = np.full((count, part.last - part.first + 1, len(kept)), np.nan)
    gone = np.zeros(count, dtype=bool)
    psi = list(kept).index("psi") if "psi" in kept else None
    turned = np.full(count, part.begin.state[5])
    done = part.first
    for legs, ticks in _pieces(course, part, count * len(kept)):
        flights = fly(
            course.model, starts[0], legs, thrust=course.drive.thrust, pilot=course.pilot, clock=clock,
            current=part.begin.current.tolist(), log=Log(tuple(kept), course.every),
            ensemble=Ensemble(count, columns, starts, _shifted(legs, offsets)) if scatter else ONE,
        )  # fmt: skip
        rows = flights.log
        if psi is not None:
            # The engine unwraps from the start of a call: each goes on where the one before it ended.
            rows[:, :, psi] += (2.0 * np.pi * np.round((turned - rows[:, 0, psi]) / (2.0 * np.pi)))[:, None]
            turned = np.where(np.isfinite(rows[:, -1, psi]), rows[:, -1, psi], turned)
        rows[gone] = np.nan
        place = done - part.first
        block[:, place : place + ticks + 1] = rows
        gone |= flights.ended != Ended.DONE
        starts, done = _handed_on(starts, flights.state, gone), done + ticks
        if gone.all():
            break
    return block, gone.astype(np.int64)


def _starts(course: Course, part: Part, scatter: Scatter | None, number: int) -> tuple[Array, dict[str, Array]]:
    """Starts (M, 13 + n + 3) of the engine and the parameters of its ensemble.

    Source     The state of each craft is that of the record plus normal errors of its standard error. What is known
               through the water moves over ground with the current that was drawn.
    """
    begin, fins = part.begin, np.nan_to_num(course.delta[part.first]) if course.pilot else None
    memory = course.memory

    def one(state: Array) -> Array:
        if fins is None:
            return course.drive.start(part.first, state)
        return at(np.concatenate([state, fins]), memory)

    if scatter is None:
        return one(begin.state)[None], {}
    flow = scatter.current * begin.current_std
    random = np.random.default_rng((scatter.seed, number))
    states = begin.state + random.standard_normal((scatter.count, 12)) * begin.state_std
    for i, name in enumerate(begin.channels):
        states[:, i] -= scatter.bias.get(name, 0.0)
    moved = flow @ rotation(begin.state[3:6])
    states[:, 6:9] += np.where(begin.through, moved, 0.0)
    columns = {**scatter.columns}
    if begin.current_std.any():
        columns |= {
            f"current_{word}": begin.current[i] + flow[:, i] for i, word in enumerate(("north", "east", "down"))
        }
    starts = np.stack([one(state) for state in states])
    for i, off in _offsets(course, scatter).items():
        starts[:, 13 + i] += off
    return starts, columns


def _offsets(course: Course, scatter: Scatter | None) -> dict[int, Array]:
    """Place of a fin -> offset (M,) [rad] of its angle from that of the record; in open loop only."""
    if scatter is None or course.pilot is not None:
        return {}
    fins = range(len(course.model.craft.fins))
    return {i: -scatter.bias[f"delta{i + 1}"] for i in fins if f"delta{i + 1}" in scatter.bias}


def _shifted(legs: Sequence[Leg], offsets: Mapping[int, Array]) -> dict[str, Array]:
    """Orders of the fins (M, legs) with their offsets. The lag of an actuator passes an offset as it is."""
    names = {i: f"fin{i + 1}" for i in offsets}
    return {
        names[i]: off[:, None] + np.array([[getattr(leg.orders, names[i]) for leg in legs]])
        for i, off in offsets.items()
    }


def _handed_on(starts: Array, ends: Array, gone: NDArray[np.bool_]) -> Array:
    """Where the next call begins: where the last one ended, its quaternions of the length 1; lost craft stay behind."""
    stay = gone | ~np.isfinite(ends).all(axis=1)
    out = np.where(stay.reshape(-1, 1), starts, ends)
    out[:, 3:7] /= np.linalg.norm(out[:, 3:7], axis=1, keepdims=True)
    return np.asarray(out)


def _pieces(course: Course, part: Part, width: int) -> list[tuple[list[Leg], int]]:
    """Legs and ticks of each call of the engine: one leg for each run of equal orders."""
    tick = course.drive.clock.tick
    rows = course.orders[part.first : part.last]
    most = max(1, NUMBERS // width)
    new = np.any(rows[1:] != rows[:-1], axis=1)
    edges = [0, *(np.flatnonzero(new) + 1).tolist(), len(rows)]
    pieces: list[tuple[list[Leg], int]] = []
    legs: list[Leg] = []
    held = 0
    for a, b in pairwise(edges):
        while a < b:
            take = min(b - a, most - held)
            orders = Orders(*(float(x) for x in rows[a]))
            legs.append(Leg(f"{part.first + a}", orders, take * tick))
            a, held = a + take, held + take
            if len(legs) >= LEGS or held >= most:
                pieces.append((legs, held))
                legs, held = [], 0
    return [*pieces, (legs, held)] if legs else pieces
