"""The gate: a log of any origin in, ``SeaLog`` out. Behind it every number is SI, in our axes, at the body origin.

The order is always the same: read, clock, units, one time base, positions, axes, fins, sensor places, doubts. Each step
adds a sentence to ``SeaLog.conversions``; what is doubtful goes into ``flags``.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.field.log import CHANNELS, Flag, SeaLog
from towtank.field.reading.axes import turned
from towtank.field.reading.clock import Order, ordered, times_of
from towtank.field.reading.derived import finished_angles, made
from towtank.field.reading.doubts import doubts_of
from towtank.field.reading.levers import sensors_of, to_origin
from towtank.field.reading.mapping import GIVEN, Channel, LogMap
from towtank.field.reading.merging import merged, stood
from towtank.field.reading.note import MARK, numbers
from towtank.field.reading.opening import Opened, clock_of, lane_of, opened
from towtank.field.reading.raw import Group, Raw, Rows
from towtank.field.reading.values import Series, column_in_si, held_out, rows_where
from towtank.frames import Array
from towtank.provenance import provenance
from towtank.quantity import si


def read_sea_log(
    source: Path | str, mapping: Path | str | LogMap | None = None, *, craft: str | Path | None = None
) -> SeaLog:
    """A log of a craft at sea.

    Parameters
    ----------
    source : CSV, netCDF, MAT, MOOS .alog, ROS 1 .bag, folder of a ROS 2 bag, folder of IMC messages as CSV, or a log
        that towtank wrote.
    mapping : TOML file of schema towtank/sea-log/1, or the name of a ready schema; not needed for files that a ready
        schema or towtank itself describes.
    craft : of the library or a craft.toml, in place of the one that the mapping names.

    Raises
    ------
    InputError
        The file or the mapping cannot be used; with file, line or key, and what to do.
    """
    path = Path(source)
    found = opened(path, mapping, craft)
    if isinstance(found, SeaLog):
        return found
    said: list[str] = list(found.said)
    series, flags, absolute, zero = _series(found, said)
    time, columns = merged(series, found.mapping.clock, said)
    columns = _held(found, columns, said)
    first = float(time[0])
    columns, datum = made(columns, found.mapping, _datum(found), said)
    if found.mapping.datum is None and found.raw.note.get("datum", datum) is None:
        datum = None
    columns = turned(columns, found.mapping.axes, said)
    columns = finished_angles(time, columns, found.mapping, said)
    columns, lost = _finished(time, columns, found, said)
    flags = (*_joined(flags), *lost, *_all_faults(found.raw, time))
    limits = {
        key: _limits(key, channel) for key, channel in found.channels.items() if channel.limits and key in columns
    }
    flags = (*flags, *doubts_of(time, columns, limits))
    if not columns:
        raise InputError(f"{path}: nothing of a record is mapped. Name columns in [channels].")
    return _log(
        path, found, time - first, columns, _epoch(found, absolute, zero, first), datum, _moved(flags, first), said
    )


def _held(found: Opened, columns: dict[str, Array], said: list[str]) -> dict[str, Array]:
    """Values that stand until the next one; in a log of towtank's own each is written at each instant."""
    names = [
        key
        for key, channel in found.channels.items()
        if channel.hold and key in columns and "towtank" not in found.raw.note
    ]
    if names:
        said.append(f"{', '.join(names)}: a value stands until the next one")
    return {key: stood(values) if key in names else values for key, values in columns.items()}


def _joined(flags: Sequence[Flag]) -> tuple[Flag, ...]:
    """Flags of several tables on the same span as one."""
    same: dict[tuple[str, str, float, float, int], list[Flag]] = {}
    for flag in flags:
        key = (flag.kind, flag.channel, round(flag.start, 6), round(flag.end, 6), flag.count)
        same.setdefault(key, []).append(flag)
    return tuple(
        replace(some[0], words=some[0].words + (f" (and {len(some) - 1} more tables)" if len(some) > 1 else ""))
        for some in same.values()
    )


@dataclass(frozen=True)
class _Lane:
    """Rows of one table that share a clock: times, order, and which rows of the file they are."""

    group: Group
    order: Order
    rows: Rows


def _series(found: Opened, said: list[str]) -> tuple[dict[str, Series], tuple[Flag, ...], bool, float]:
    """Channels with their times [s] from a zero [s]; flags of their clocks; whether the zero counts from 1970."""
    lanes: dict[tuple[str, ...], _Lane] = {}
    raw_times: dict[tuple[str, ...], Array] = {}
    flags: list[Flag] = []
    absolute = False
    for channel in found.channels.values():
        key = lane_of(channel, found)
        if key in lanes:
            continue
        group = found.raw.groups[found.place(channel)[0]]
        rows = rows_where(group, channel)
        if not len(rows):
            continue
        times, counted = times_of(group, clock_of(channel, found), found.mapping.clock)
        absolute = absolute or counted
        order = ordered(times[rows], found.mapping.clock, group.table.title)
        lanes[key], raw_times[key] = _Lane(group, order, rows), order.time
        # What is given only when it changes has no rate that a hole could be seen by.
        flags += [flag for flag in order.flags if not (channel.hold and flag.kind == "gap")]
    if not lanes:
        raise InputError(f"{found.raw.title}: no sample of any channel. Correct where = in [channels].")
    zero = float(np.floor(min(float(times[0]) for times in raw_times.values()))) if absolute else 0.0
    stamps = {key: lane.order.time - zero for key, lane in lanes.items()}
    series = {}
    empty: list[str] = []
    for name, channel in found.channels.items():
        key = lane_of(channel, found)
        if key not in lanes:
            said.append(f"{name}: no row is as its where says; left out")
            continue
        lane = lanes[key]
        _, column = found.place(channel)
        values = column_in_si(lane.group, column, name, channel, said)[lane.rows][lane.order.rows]
        if channel.optional and not np.isfinite(values).any():
            empty.append(name)
            continue
        if channel.held:
            values, again = held_out(values)
            said.append(f"{name}: {again} values that repeat the last one are taken as not measured")
        series[name] = Series(stamps[key], values)
    if empty:
        said.append(f"nothing was measured of {', '.join(empty)}")
    return series, tuple(_moved(flags, zero)), absolute, zero


def _moved(flags: tuple[Flag, ...] | list[Flag], by: float) -> tuple[Flag, ...]:
    return tuple(replace(f, start=f.start - by, end=f.end - by) if f.kind != "format" else f for f in flags)


def _datum(found: Opened) -> tuple[float, float] | None:
    given = found.mapping.datum
    if given is not None:
        return si(given.latitude, "rad", "datum.latitude"), si(given.longitude, "rad", "datum.longitude")
    noted = found.raw.note.get("datum")
    return (float(noted[0]), float(noted[1])) if isinstance(noted, list) and len(noted) == 2 else None


def _finished(
    time: Array, columns: dict[str, Array], found: Opened, said: list[str]
) -> tuple[dict[str, Array], tuple[Flag, ...]]:
    """Fins in our sense, channels at the body origin."""
    if found.mapping.fins == "vehicle":
        columns = _own_fins(columns, found.craft, said)
    places = sensors_of(found.channels, found.mapping.sensors, found.craft)
    columns, flags = to_origin(time, columns, places, said)
    return {name: columns[name] for name in CHANNELS if name in columns}, flags


def _own_fins(columns: dict[str, Array], craft: Craft | None, said: list[str]) -> dict[str, Array]:
    if craft is None:
        raise InputError(
            'fins = "vehicle": the sense of each fin is in the craft file. Name the craft, or write fins = "towtank" '
            "for angles that are right-handed about the outward span."
        )
    out = dict(columns)
    turned_round = []
    for i, fin in enumerate(craft.fins):
        for name in (f"delta{i + 1}", f"command{i + 1}"):
            if name in out and fin.sign != 1.0:
                out[name] = fin.sign * out[name]
                turned_round.append(name)
    said.append(f"fins in the sense of the vehicle: {', '.join(turned_round) or 'none'} times -1 ({craft.name})")
    return out


def _limits(key: str, channel: Channel) -> tuple[float, float]:
    low, high = channel.limits or (0.0, 0.0)
    unit = "" if GIVEN[key][0] == "1" else GIVEN[key][0]
    return si(low, unit, f"channels.{key}.limits"), si(high, unit, f"channels.{key}.limits")


def _all_faults(raw: Raw, time: Array) -> list[Flag]:
    start, end = 0.0, float(time[-1] - time[0])
    out = [Flag("format", "time", start, end, fault.count, fault.words) for fault in raw.faults]
    for name, group in raw.groups.items():
        for column, count in group.spoilt.items():
            if group.rows > count:
                where = f"{name}: " if name else ""
                words = f"{where}{count} cells of {column!r} hold no number: taken as not measured"
                out.append(Flag("format", "time", start, end, count, words))
    return out


def _epoch(found: Opened, absolute: bool, zero: float, first: float) -> float | None:
    if "epoch" in found.raw.note and found.raw.note["epoch"] is None:
        return None
    if absolute:
        return zero + first
    if found.raw.epoch is not None:
        return found.raw.epoch + first
    noted = found.raw.note.get("epoch")
    return float(noted) + first if isinstance(noted, int | float) else None


def _log(
    path: Path, found: Opened, time: Array, columns: Mapping[str, Array], epoch: float | None,
    datum: tuple[float, float] | None, flags: tuple[Flag, ...], said: list[str],
) -> SeaLog:  # fmt: skip
    mapping, note = found.mapping, found.raw.note
    std, bias = numbers(note, "std"), numbers(note, "bias")
    assumed = {str(name) for name in note.get("assumed", []) if str(name) in CHANNELS}
    for key, channel in found.channels.items():
        unit = "" if GIVEN[key][0] == "1" else GIVEN[key][0]
        for table, given, word in ((std, channel.std, "std"), (bias, channel.bias, "bias")):
            for name in _MADE.get(key, (key,)):
                if given is not None and name in columns:
                    table[name] = si(given, _NOISE.get(key, unit), f"channels.{key}.{word}")
                    assumed |= {name} if channel.assumed else set()
    made_up = mapping.synthetic or bool(note.get("synthetic")) or path.stem.endswith(MARK)
    kept = {"std": std, "bias": bias}
    return SeaLog(
        name=mapping.name or str(note.get("name") or "") or path.stem,
        craft=found.craft.name if found.craft else mapping.craft or str(note.get("craft") or ""),
        time=time, channels=dict(columns), synthetic=made_up, epoch=epoch, datum=datum, flags=flags,
        std={k: v for k, v in kept["std"].items() if k in columns},
        bias={k: v for k, v in kept["bias"].items() if k in columns},
        assumed=tuple(name for name in CHANNELS if name in assumed and name in columns),
        conversions=tuple(dict.fromkeys(said)),
        provenance=provenance(_hashes(path), format=found.format, mapping=found.mapping_name),
    )  # fmt: skip


_MADE: Mapping[str, tuple[str, ...]] = {"latitude": ("x",), "longitude": ("y",), "pressure": ("z",)}
_NOISE: Mapping[str, str] = {"latitude": "m", "longitude": "m", "pressure": "m"}
"""Channels made from others take the noise of them in metres."""


def _hashes(path: Path) -> dict[str, str]:
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.is_file())
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest()[:16] for file in files}
