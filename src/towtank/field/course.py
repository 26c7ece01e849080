"""What is replayed: the orders of a record in open or closed loop, cut where it has holes or a horizon ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.engine.clock import clock_of
from towtank.engine.plan import Clock
from towtank.errors import InputError
from towtank.field.begin import Beginning, beginning
from towtank.field.current import Current, mean_current
from towtank.field.drive import Drive, bridged, drive_of
from towtank.field.log import FINS, SeaLog
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import FIN_ORDERS, ORDERS, Orders

SHORTEST = 2.0
"""Shortest part of a record [s] that is replayed."""
OPEN_HORIZON = 30.0
"""Time [s] after which a replay in open loop begins again: some times that in which a yaw-unstable craft leaves its
course by the smallest error."""
COMMANDS = ("heading_order", "turn_order", "depth_order", "pitch_order")
"""Channels a pilot follows."""


@dataclass(frozen=True)
class Part:
    """Ticks ``first`` to ``last`` of a record, flown from ``begin`` in one go."""

    first: int
    last: int
    begin: Beginning


@dataclass(frozen=True)
class Course:
    """A record made ready to be replayed.

    drive : its ticks, samples and thrust.   model : what flies it.   pilot : None in open loop.
    orders (N, len(ORDERS)) : of each tick.   delta (N + 1, n) [rad] : fins at the begin of a part.
    clock : of the engine; ``every`` of its ticks are one of the record.   memory (3,) : of the pilot at a begin.
    parts : what is flown.   current : over the whole record.   horizon [s] : after which it begins again, None for
    never.   words : what was assumed.
    """

    drive: Drive
    model: Model
    pilot: Pilot | None
    orders: Array
    delta: Array
    clock: Clock
    every: int
    memory: tuple[float, float, float]
    parts: tuple[Part, ...]
    current: Current
    horizon: float | None
    words: tuple[str, ...]

    @property
    def loop(self) -> str:
        """The loop: open, or closed by a pilot."""
        return "open" if self.pilot is None else "closed"


def course_of(
    model: Model,
    log: SeaLog,
    *,
    pilot: Pilot | None = None,
    horizon: float | None = None,
    start: Beginning | None = None,
    speed: float | None = None,
) -> Course:
    """``log`` as a course for ``model``: in open loop with its fin angles, or with its orders through ``pilot``.

    Parameters
    ----------
    pilot : flies the orders of the record; None replays the fins.
    horizon [s] : after which the replay begins again from the record; None flies every part in one go.
    start : where the first part begins and the current of all; estimated from the record when left out.
    speed [m/s] : whose thrust the throttle multiplies, as in ``drive_of``.

    Raises
    ------
    InputError
        A record of another craft, without what drives it, or without a part of ``SHORTEST`` seconds in one piece.
    """
    _same_craft(model, log)
    if horizon is not None and not horizon >= SHORTEST:
        raise InputError(
            f"replay of {log.name}: a horizon of {horizon:g} s is shorter than {SHORTEST:g} s, in which a state cannot "
            "be told from its noise. Give a longer one, or 0 for none."
        )
    drive = drive_of(model, log if pilot is None else _without_fins(model, log), speed=speed)
    telling = drive if pilot is None or log.fins != len(model.craft.fins) else drive_of(model, log, speed=speed)
    current = (
        mean_current(telling, log) if start is None else Current(start.current, start.current_std, "current: given")
    )
    orders, whole, memory, words = drive.orders, drive.whole, (0.0, 0.0, 0.0), tuple[str, ...]()
    clock, every = drive.clock, 1
    if pilot is not None:
        orders, known, memory, words = _commanded(model, log, drive, pilot)
        whole = drive.whole & known
        clock, every = _piloted_clock(model, drive)
    pieces = _cut(log, whole, drive.clock.tick, horizon)
    parts = tuple(
        Part(a, b, start if start is not None and i == 0 else beginning(telling, a, current))
        for i, (a, b) in enumerate(pieces)
    )
    lost = len(drive.orders) - sum(b - a for a, b in pieces)
    if lost:
        words = (
            *words,
            f"{lost * drive.clock.tick:.3g} s of the record are not flown: what drove the craft is missing",
        )
    delta = drive.delta if pilot is None else _fins_seen(model, log, drive)
    return Course(
        drive, drive.model, pilot, orders, delta, clock, every, memory, parts, current, horizon,
        (current.words, *_said(parts), *words),
    )  # fmt: skip


def _said(parts: Sequence[Part]) -> list[str]:
    """What was assumed at the begins, each once, with the number of parts it is said of."""
    counted = Counter(word for part in parts for word in part.begin.words)
    n = len(parts)
    return [f"{word} (at {count} of {n} begins)" if n > 1 else word for word, count in counted.items()]


def _same_craft(model: Model, log: SeaLog) -> None:
    if log.craft and log.craft != model.craft.name:
        raise InputError(
            f"log {log.name}: it is a record of {log.craft}, and the model is of {model.craft.name}. Give the study of "
            f"that craft; if they are one, name the craft {model.craft.name!r} when the log is read."
        )


def _without_fins(model: Model, log: SeaLog) -> SeaLog:
    """The record with all fins at rest: in closed loop they are moved by the pilot."""
    fins = {f"{word}{i + 1}" for word in ("delta", "command") for i in range(FINS)}
    kept = {name: values for name, values in log.channels.items() if name not in fins | {"aileron"}}
    none = np.zeros(len(log.time))
    return replace(log, channels={**kept, "rudder": none, "elevator": none})


def _cut(log: SeaLog, whole: NDArray[np.bool_], tick: float, horizon: float | None) -> list[tuple[int, int]]:
    """Ticks (first, last) of the runs of ``whole``, at most ``horizon`` long, none below ``SHORTEST``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    step = len(whole) if horizon is None else max(1, round(horizon / tick))
    least = SHORTEST / tick - 1e-9
    pieces = [
        (a, min(a + step, last))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        for a in range(int(first), int(last), step)
        if min(a + step, last) - a >= least
    ]
    if not pieces:
        longest = max((last - first for first, last in zip(edges[::2], edges[1::2], strict=True)), default=0) * tick
        raise InputError(
            f"log {log.name}: its longest part without a hole in what drove the craft is {longest:.3g} s, and "
            f"{SHORTEST:g} s are needed. Give a longer record, or look at its flags."
        )
    return [(int(a), int(b)) for a, b in pieces]


def _piloted_clock(model: Model, drive: Drive) -> tuple[Clock, int]:
    """The control period of the pilot: a whole share of the record's tick, no longer than that of the engine."""
    usual = clock_of(model, model.craft.speed)
    every = max(1, int(np.ceil(drive.clock.tick / usual.tick - 1e-6)))
    steps = max(1, int(np.ceil(drive.clock.steps / every)))
    return Clock(drive.clock.tick / every, steps), every


def _commanded(
    model: Model, log: SeaLog, drive: Drive, pilot: Pilot
) -> tuple[Array, NDArray[np.bool_], tuple[float, float, float], tuple[str, ...]]:
    """Orders (N, len(ORDERS)) to a pilot, where they are known (N,), the pilot's memory, what was assumed.

    An order holds until the next. Where a heading and a rate of turn are ordered, or a depth and a pitch, the later
    counts, and the heading and the depth when both are of one moment.
    """
    from towtank.trials.start import setting

    if not any(log.has(name) or np.isfinite(log[name]).any() for name in COMMANDS):
        raise InputError(
            f"log {log.name}: it holds no order ({', '.join(COMMANDS)}), so no pilot can fly it again. Map the columns "
            "of what was ordered, or replay its fins in open loop (--open)."
        )
    at = setting(model, pilot.speed, pilot)
    base = Orders(piloted=1.0, elevator=at.trim.elevator)
    table = {name: np.full(len(drive.orders), float(getattr(base, name))) for name in ORDERS}
    table["throttle"] = drive.orders[:, ORDERS.index("throttle")]
    known = np.ones(len(drive.orders), dtype=bool)
    words: list[str] = []
    planes = (
        ("heading", "turn", "steer", "turning", "rudder", 0.0),
        ("depth", "pitch", "dive", "pitching", "elevator", at.trim.pitch),
    )
    for first, second, switch, other, fin, off in planes:
        one, since = held(log, f"{first}_order", drive.time)
        two, later = held(log, f"{second}_order", drive.time)
        ordered = np.isfinite(since) | np.isfinite(later)
        if ordered.any():
            use = np.nan_to_num(later, nan=-1.0) > np.nan_to_num(since, nan=-1.0)
            table[switch][:], table[other] = 1.0, use.astype(float)
            table[first], table[second] = np.where(use, 0.0, one), np.where(use, two - off, 0.0)
            known &= ordered
        elif log.has(fin):
            angle, _ = held(log, fin, drive.time)
            table[fin] = np.where(np.isfinite(angle), angle, table[fin])
            words.append(f"no {first} is ordered: the {fin} is as logged")
        else:
            words.append(f"no {first} is ordered: the {fin} rests at its trim")
    for name in FIN_ORDERS:
        table[name][:] = 0.0
    words.append("the pilot begins with the trims of level flight")
    orders = np.nan_to_num(np.stack([table[name] for name in ORDERS], axis=1))
    return orders, known, at.memory, tuple(words)


def held(log: SeaLog, name: str, at: Array) -> tuple[Array, Array]:
    """The last sample of a channel at each tick that begins at ``at`` (N + 1,), and its time; NaN before the first."""
    ticks = at[:-1]
    there = np.isfinite(log[name])
    if not there.any():
        return np.full(len(ticks), np.nan), np.full(len(ticks), np.nan)
    own, values = log.time[there], log[name][there]
    # A sample up to a thousandth of a tick late is of this tick: times are written with few digits.
    place = np.searchsorted(own, ticks + 1e-3 * (at[1] - at[0]), side="right") - 1
    found = place >= 0
    place = np.maximum(place, 0)
    return np.where(found, values[place], np.nan), np.where(found, own[place], np.nan)


def _fins_seen(model: Model, log: SeaLog, drive: Drive) -> Array:
    """Fin angles (N + 1, n) that the record holds, 0 where it does not."""
    n = len(model.craft.fins)
    names = [f"delta{i + 1}" for i in range(n)]
    if not n or not log.has(*names):
        return np.zeros((len(drive.time), n))
    return np.stack([bridged(log.time, log[name], drive.time)[0] for name in names], axis=1)
