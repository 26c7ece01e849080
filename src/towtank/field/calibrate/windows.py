"""A record in windows of shooting: what was measured in each, how surely, and where its motion is first looked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.loop import channels, observed
from towtank.errors import InputError
from towtank.field.calibrate.settings import ASSUMED_STD, LEFT_OUT, Settings
from towtank.field.drive import Drive, drive_of
from towtank.field.log import MEASURED, SeaLog
from towtank.frames import Array
from towtank.model.equations import STATE, Model

WATER = ("turbulence_north", "turbulence_east", "turbulence_down")
STATES = (*STATE, *WATER)
"""Unknowns of the start of a window: the motion, and the current in it less the mean of the record."""
SHARED = ("thrust", "current_north", "current_east", "current_down")
"""Unknowns that last a record, before its biases."""
SHORTEST = 2
"""Ticks of the shortest window."""
OFFSET = 1e-12
"""A stated bias at or below which a channel has none."""

Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Windows:
    """W windows of at most n ticks of a record.

    first, ticks (W,) : place and length of each.   linked (W,) : the next window goes on where it ends.
    channels (C,) : those seen: STATE, then other measured ones.   measured (W, n, C) : at the ends of the ticks, 0
        where nothing was.   weight (W, n, C) : 1 / std, 0 where nothing was.   std : of each measured channel.
    assumed : channels whose std nobody stated.   biased : channels with a bias, as places.   bias : its prior std.
    guess (W, 15) : where the search starts.   delta (W, fins) : fin angles at the start of each window [rad].
    left_out : samples left out because they are flagged.
    """

    log: SeaLog
    drive: Drive
    first: Numbers
    ticks: Numbers
    linked: NDArray[np.bool_]
    channels: tuple[str, ...]
    measured: Array
    weight: Array
    std: dict[str, float]
    assumed: tuple[str, ...]
    biased: Numbers
    bias: Array
    guess: Array
    delta: Array
    left_out: int

    @property
    def shared(self) -> tuple[str, ...]:
        """Names of the unknowns that last the record."""
        return (*SHARED, *(f"bias_{self.channels[i]}" for i in self.biased))

    @property
    def time(self) -> Array:
        """Start (W,) of each window [s]."""
        return np.asarray(self.drive.time[self.first])

    @property
    def used(self) -> dict[str, int]:
        """Samples of each channel that take part."""
        counts = (self.weight > 0.0).sum(axis=(0, 1))
        return {name: int(counts[self.channels.index(name)]) for name in self.std}


def windows_of(model: Model, log: SeaLog, settings: Settings, drive: Drive | None = None) -> Windows:
    """The windows of ``log``. drive : of it, when there is one already.

    Raises
    ------
    InputError
        Nothing of the motion was measured, or nowhere what drove the craft is known for two ticks.
    """
    drive = drive if drive is not None else drive_of(_smooth(model), log)
    size = max(SHORTEST, round(settings.window / drive.clock.tick))
    first, ticks, linked = _cut(drive.whole, size)
    if not len(first):
        raise InputError(
            f"log {log.name}: nowhere is known for {SHORTEST} samples on end what drove the fins. Look at its flags "
            "(towtank log) and at the columns of the fins."
        )
    seen, left_out = _without_flagged(log, drive)
    able = channels(len(model.craft.fins))[: observed(len(model.craft.fins))]
    used = [name for name in seen if name in able and np.isfinite(seen[name]).any()]
    if not used:
        raise InputError(
            f"log {log.name}: no channel of the motion was measured ({', '.join(MEASURED)}). Map at least its heading "
            "and its rate of turn."
        )
    every = (*STATE, *(name for name in used if name not in STATE))
    std = {name: _std(log, name) for name in used}
    measured, weight = np.zeros((len(first), size, len(every))), np.zeros((len(first), size, len(every)))
    at = first[:, None] + 1 + np.arange(size)
    inside = np.arange(size) < ticks[:, None]
    at = np.where(inside, at, 0)
    for name in used:
        values = seen[name][at]
        held = np.isfinite(values) & inside
        place = every.index(name)
        measured[..., place] = np.where(held, values, 0.0)
        weight[..., place] = held / std[name]
    biased = np.array([every.index(name) for name in used if log.bias.get(name, 0.0) > OFFSET], dtype=np.int64)
    bias = np.array([log.bias[every[i]] for i in biased])
    delta = drive.delta if drive.measured else _lagged(drive)
    return Windows(
        log, drive, first, ticks, linked, every, measured, weight, std, tuple(n for n in used if n not in log.std),
        biased, bias, _guess(log, drive, seen)[first], delta[first], left_out,
    )  # fmt: skip


def _std(log: SeaLog, name: str) -> float:
    """Standard deviation of a channel; one stated as nothing still has the noise of its storage."""
    return max(float(log.std.get(name, ASSUMED_STD[name])), 1e-4 * ASSUMED_STD[name])


def _smooth(model: Model) -> Model:
    """``model`` without dead band and play of the fins, at which a run has no slopes."""
    none: dict[str, Any] = {"dead_band": 0.0, "backlash": 0.0}
    return replace(model, craft=replace(model.craft, fins=tuple(replace(fin, **none) for fin in model.craft.fins)))


def _cut(whole: NDArray[np.bool_], size: int) -> tuple[Numbers, Numbers, NDArray[np.bool_]]:
    """First tick, length, and whether the next goes on, of windows of ``size`` ticks in ``whole`` (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
    first: list[int] = []
    ticks: list[int] = []
    linked: list[bool] = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start < SHORTEST:
            continue
        begins = list(range(int(start), int(end), size))
        if end - begins[-1] < SHORTEST:
            end = begins.pop()
        ends = [*begins[1:], int(end)]
        first += begins
        ticks += [b - a for a, b in zip(begins, ends, strict=True)]
        linked += [True] * (len(begins) - 1) + [False]
    return np.array(first, dtype=np.int64), np.array(ticks, dtype=np.int64), np.array(linked, dtype=bool)


def _without_flagged(log: SeaLog, drive: Drive) -> tuple[dict[str, Array], int]:
    """The measured channels with NaN where a flag says that a sample is not one, and how many were left out."""
    seen, count = {name: values.copy() for name, values in drive.seen.items()}, 0
    for flag in log.flags:
        if flag.kind in LEFT_OUT and flag.channel in seen:
            half = 0.5 * drive.clock.tick * (1.0 - 1e-6)
            hit = (drive.time >= flag.start - half) & (drive.time <= flag.end + half)
            count += int(np.isfinite(seen[flag.channel][hit]).sum())
            seen[flag.channel][hit] = np.nan
    return seen, count


def _guess(log: SeaLog, drive: Drive, seen: dict[str, Array]) -> Array:
    """Where the search starts (N + 1, 15): what was measured, by straight lines, else straight ahead."""
    time = drive.time
    out = np.zeros((len(time), len(STATES)))

    def told(*names: str) -> Array | None:
        for name in names:
            held = np.isfinite(seen.get(name, np.full(1, np.nan)))
            if held.any():
                return np.interp(time, time[held], seen[name][held])
        return None

    for i, names in enumerate((("x",), ("y",), ("z",), ("phi",), ("theta",), ("psi",), ("ahead", "u", "speed"),
                               ("slip", "v"), ("plunge", "w"), ("p",), ("q",), ("r",))):  # fmt: skip
        found = told(*names)
        if found is not None:
            out[:, i] = found
    if told("psi") is None and told("x") is not None and told("y") is not None:
        out[:, 5] = np.unwrap(np.arctan2(np.gradient(out[:, 1], time), np.gradient(out[:, 0], time)))
    if told("ahead", "u", "speed") is None:
        ordered = log["speed_order"]
        known = np.isfinite(ordered)
        out[:, 6] = np.interp(time, log.time[known], ordered[known]) if known.any() else drive.model.craft.speed
    return out


def _lagged(drive: Drive) -> Array:
    """Angles (N + 1, n) of fins that follow the angles asked with their lag, limits of angle and of rate [rad].

    Source     The actuator of the model (``towtank.model.fins.actuator_rates``), in closed form over a tick: at the
               limit of rate until the rest is what the lag takes off at that rate, then by the lag.
    """
    from towtank.pilot.orders import ORDERS

    fins = drive.model.craft.fins
    out = np.zeros((len(drive.time), len(fins)))
    for i, fin in enumerate(fins):
        asked = np.clip(drive.orders[:, ORDERS.index(f"fin{i + 1}")], -fin.max_angle, fin.max_angle).tolist()
        angle, column = asked[0], [asked[0]]
        knee = fin.max_rate * fin.time_constant
        for wanted in asked:
            rest, left = wanted - angle, drive.clock.tick
            if abs(rest) > knee:
                turning = min(left, (abs(rest) - knee) / fin.max_rate)
                rest -= np.sign(rest) * fin.max_rate * turning
                left -= turning
            angle = wanted - rest * float(np.exp(-left / fin.time_constant))
            column.append(angle)
        out[:, i] = column
    return out
