"""Numbers of a column in SI: counts, units, factors, offsets, numbers that stand for nothing, held values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import InputError
from towtank.field.reading.mapping import GIVEN, Channel
from towtank.field.reading.raw import Group, Rows
from towtank.frames import Array
from towtank.quantity import si

TURNED = ("psi", "heading_order")
"""Channels without jumps of a turn."""
ANGLES = ("phi", "theta", "pitch_order")
"""Channels between half a turn to both sides."""
UNITS: Mapping[str, str] = {
    "degrees": "deg", "degree": "deg", "°": "deg", "º": "deg", "radians": "rad", "degrees/s": "deg/s", "°/s": "deg/s",
    "deg/sec": "deg/s", "dps": "deg/s", "rad/sec": "rad/s", "Kn": "knot", "kn": "knot", "kts": "knot", "kt": "knot",
    "knots": "knot", "m/sec": "m/s", "meters": "m", "metres": "m",
}  # fmt: skip
"""Spelling of a unit in logs -> that of the gate."""


@dataclass(frozen=True)
class Series:
    """One channel: time (N,) [s], values (N,) [SI], NaN where nothing was measured."""

    time: Array
    values: Array


def column_in_si(group: Group, column: str, key: str, channel: Channel, said: list[str]) -> Array:
    """Values (N,) of a column in the SI unit of ``key``, NaN where nothing was measured.

    Raises
    ------
    InputError
        No such column, no number in it, a unit of another dimension or none where one is needed.
    """
    unit = GIVEN[key][0]
    place = group.table.find(column)
    where = f"{group.table.title}, column {group.table.names[place]!r}"
    raw = group.table.values[:, place]
    if group.rows and not np.isfinite(raw).any() and group.table.names[place] in group.texts:
        raise InputError(
            f"{where}: no number in it, the first cell is {group.texts[group.table.names[place]][0]!r}. Map another "
            "column, or state the separator or the decimal mark of the file."
        )
    if channel.missing:
        none = np.isin(raw, channel.missing)
        if none.any():
            said.append(f"{key}: {int(none.sum())} numbers that stand for nothing measured left out")
            raw = np.where(none, np.nan, raw)
    values = _calibrated(group, place, raw, key, unit, channel, where, said)
    if channel.factor != 1.0:
        said.append(f"{key} multiplied by {channel.factor:g}")
        values = values * channel.factor
    if channel.offset is not None:
        offset = si(channel.offset, _spelt(unit), f"channels.{key}.offset")
        said.append(f"{key}: {channel.offset} added")
        values = values + offset
    return np.asarray(values, dtype=float)


def _calibrated(
    group: Group, place: int, raw: Array, key: str, unit: str, channel: Channel, where: str, said: list[str]
) -> Array:
    """Raw numbers in SI, before factor and offset."""
    if channel.counts is not None:
        counts = channel.counts
        if counts.per_unit == 0.0:
            raise InputError(f"channels.{key}.counts: per_unit is zero. State the counts of one {counts.unit}.")
        said.append(
            f"{key} from counts: ({group.table.names[place]} - {counts.zero:g}) / {counts.per_unit:g} {counts.unit}"
        )
        return (raw - counts.zero) / counts.per_unit * _unit(counts.unit, unit, f"channels.{key}.counts.unit")
    if channel.points is not None:
        points = sorted((x, si(y, _spelt(unit), f"channels.{key}.points")) for x, y in channel.points)
        x, y = np.array([p[0] for p in points]), np.array([p[1] for p in points])
        if not (np.diff(x) > 0.0).all():
            raise InputError(f"channels.{key}.points: a raw number stands twice. Give each once.")
        said.append(f"{key} from {len(points)} points of {group.table.names[place]}, straight between and beyond them")
        return _through(raw, x, y)
    stated = UNITS.get(group.table.units[place], group.table.units[place])
    given = UNITS.get(channel.unit, channel.unit)
    if key == "revolutions" and (given or stated) in ("rpm", "RPM", "1/min", "rev/min"):
        if given and stated and given.lower() != stated.lower():
            raise InputError(f"{where}: the file says {stated!r} and the mapping {given!r}. Correct the mapping.")
        said.append(f"{key}: {given or stated} to 1/s")
        return raw / 60.0
    units = list(group.table.units)
    units[place] = "" if stated in ("1", "-", "counts") else stated
    table = replace(group.table, units=tuple(units), values=np.broadcast_to(raw[:, None], (len(raw), len(units))))
    exact = group.table.names[place]
    values = table.column(exact, _spelt(unit), given)
    if not (given or stated) and unit != "1":
        said.append(f"no unit is stated for {key}: taken as {unit}")
    elif (given or stated) not in (unit, "1", "-"):
        said.append(f"{key}: {given or stated} to {unit}")
    return values


def _through(raw: Array, x: Array, y: Array) -> Array:
    """Straight lines through points, the first and last of them continued."""
    place = np.clip(np.searchsorted(x, raw), 1, len(x) - 1)
    slope = (y[place] - y[place - 1]) / (x[place] - x[place - 1])
    return np.asarray(y[place - 1] + slope * (raw - x[place - 1]))


def _spelt(unit: str) -> str:
    return "" if unit == "1" else unit


def _unit(text: str, unit: str, where: str) -> float:
    return si(f"1 {UNITS.get(text, text)}", _spelt(unit), where)


def rows_where(group: Group, channel: Channel) -> Rows:
    """Rows in which the columns of ``channel.where`` hold what they should."""
    keep = np.ones(group.rows, dtype=bool)
    for column, value in channel.where.items():
        place = group.table.find(column)
        if isinstance(value, str):
            keep &= np.array([cell.strip() == value for cell in group.cells(column)])
        else:
            keep &= group.table.values[:, place] == value
    return np.flatnonzero(keep)


def held_out(values: Array) -> tuple[Array, int]:
    """Values (N,) without those that repeat the last one; and how many there were."""
    known = np.flatnonzero(np.isfinite(values))
    again = known[1:][values[known][1:] == values[known][:-1]]
    out = values.copy()
    out[again] = np.nan
    return out, len(again)


def unturned(values: Array) -> tuple[Array, int]:
    """Angles (N,) [rad] without jumps of a turn, and how many jumps there were.

    Valid      Less than half a turn between samples.
    """
    known = np.isfinite(values)
    out = values.copy()
    out[known] = np.unwrap(values[known])
    return out, int(np.sum(np.abs(np.diff(values[known]) - np.diff(out[known])) > np.pi))


def within_half_turn(values: Array) -> tuple[Array, int]:
    """Angles (N,) [rad] from -pi to pi, and how many were brought there."""
    out = (values + np.pi) % (2.0 * np.pi) - np.pi
    far = np.abs(np.nan_to_num(values)) > np.pi + 1e-9
    return np.where(far, out, values), int(far.sum())
