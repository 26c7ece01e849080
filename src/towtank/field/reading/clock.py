"""Times of a log: from the columns of its clock to seconds, and which samples stand in order."""

from __future__ import annotations

import bisect
import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.field.log import Flag
from towtank.field.reading.mapping import Clock
from towtank.field.reading.raw import Group, Rows
from towtank.frames import Array
from towtank.quantity import si

DAY = 86400.0
GPS_EPOCH = 315964800.0
"""Start of GPS time, 1980-01-06, in seconds since 1970."""
WEEK = 604800.0
MATLAB_EPOCH = 719529.0
"""1970-01-01 as a day number of MATLAB."""
GAP = 3.0
"""Step, in median steps, above which samples are taken to be missing: two in a row. Judgement."""
JUMP = 3600.0
"""Hole [s] above which the words name a clock that was set as a second reason. Judgement."""
OUT_OF_ORDER = 0.5
"""Share of samples out of order above which the order of the file is not understood. Judgement."""
_TIME = re.compile(r"^(?P<h>\d{1,2}):(?P<m>\d{1,2})(?::(?P<s>\d{1,2}(?:[.,]\d*)?))?\s*(?P<half>[AaPp][Mm])?$")
_DATE = re.compile(r"^(?P<a>\d{1,4})[-/. ](?P<b>\d{1,2})[-/. ](?P<c>\d{1,4})$")
_SINCE = re.compile(r"^(?P<unit>\w+)\s+since\s+(?P<at>.+)$")


@dataclass(frozen=True)
class Order:
    """Samples that stand in order of time: rows of the file, their times [s], and what was found."""

    rows: Rows
    time: Array
    flags: tuple[Flag, ...]
    said: tuple[str, ...] = ()


def times_of(group: Group, columns: Sequence[str], clock: Clock) -> tuple[Array, bool]:
    """Times (N,) [s] of the rows of a group, NaN where unreadable; and whether they count from 1970 in UTC.

    Raises
    ------
    InputError
        No clock column, a unit that is none of time, or a column that does not hold what the kind says.
    """
    if not columns:
        if group.time is None:
            raise InputError(
                f'{group.table.title}: no clock is named. Write [clock] columns = ["t"]. The file has '
                f"{', '.join(group.table.names[:24])}."
            )
        return group.time, False
    back = si(clock.utc_offset, "s", "clock, utc_offset")
    if clock.kind == "iso":
        return _words(group.cells(columns[0]), _iso) - back, True
    if clock.kind == "time of day":
        return _past_midnight(_words(group.cells(columns[0]), _time_of_day)) - back, False
    if clock.kind == "date":
        return _dated(group, columns, clock) - back, True
    if clock.kind == "gps":
        return _gps(group, columns, clock), True
    return _numbers(group, columns[0], clock)


def _numbers(group: Group, column: str, clock: Clock) -> tuple[Array, bool]:
    where = f"{group.table.title}, column {column!r}"
    at = group.table.find(column)
    values = group.table.values[:, at]
    if not np.isfinite(values).any():
        shown = group.texts.get(group.table.names[at], ("nothing",))[0]
        raise InputError(
            f'{where}: no number in it (first cell {shown!r}), and the clock is of kind "{clock.kind}". Write kind = '
            '"iso", "date" or "time of day".'
        )
    if clock.kind == "matlab":
        return (values - MATLAB_EPOCH) * DAY - si(clock.utc_offset, "s", "clock, utc_offset"), True
    stated = group.table.units[at]
    if since := _SINCE.match(stated):
        zero = 0.0 if since["at"].strip() == "01/01/1970" else _zero(since["at"], where)
        return values * si(f"1 {since['unit']}", "s", where) + zero, True
    unit = stated if stated and clock.unit == "s" and _is_time(stated) else clock.unit
    return values * si(f"1 {unit}", "s", f"{where}, unit of the clock"), clock.kind == "epoch"


def _zero(text: str, where: str) -> float:
    try:
        return _iso(text)
    except ValueError:
        raise InputError(
            f"{where}: times count from {text!r}, which is no date in the order year-month-day. Write the zero as in "
            '"seconds since 2026-05-01 00:00:00".'
        ) from None


def _is_time(unit: str) -> bool:
    try:
        si(f"1 {unit}", "s")
    except InputError:
        return False
    return True


def _dated(group: Group, columns: Sequence[str], clock: Clock) -> Array:
    if len(columns) == 1:
        parts = [cell.strip().replace("T", " ").split(None, 1) for cell in group.cells(columns[0])]
        days, hours = [part[0] if part else "" for part in parts], [part[1] if len(part) > 1 else "" for part in parts]
    else:
        days, hours = list(group.cells(columns[0])), list(group.cells(columns[1]))
    return _words(days, lambda text: _date(text, clock.order)) + _words(hours, _time_of_day)


def _gps(group: Group, columns: Sequence[str], clock: Clock) -> Array:
    if len(columns) != 2:
        raise InputError(f'{group.table.title}: a GPS clock is [clock] columns = ["week", "seconds of week"].')
    week = group.table.values[:, group.table.find(columns[0])]
    seconds = group.table.values[:, group.table.find(columns[1])] * si(f"1 {clock.unit}", "s", "clock, unit")
    return GPS_EPOCH + WEEK * week + seconds - clock.leap_seconds


def _words(cells: Sequence[str], read: Callable[[str], float]) -> Array:
    out = np.full(len(cells), np.nan)
    first = ""
    for i, cell in enumerate(cells):
        try:
            out[i] = read(cell.strip())
        except (ValueError, OverflowError):
            first = first or cell
    if not np.isfinite(out).any():
        raise InputError(
            f"clock: {first!r} is not read as the time that its kind says. Correct kind, order or columns of [clock]."
        )
    return out


def _iso(text: str) -> float:
    found = datetime.datetime.fromisoformat(text.strip().replace("UTC", "").strip().replace("Z", "+00:00"))
    return (found if found.tzinfo else found.replace(tzinfo=datetime.UTC)).timestamp()


def _time_of_day(text: str) -> float:
    found = _TIME.match(text.strip())
    if found is None:
        raise ValueError(text)
    hour = int(found["h"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"].lower() == "pm" else 0)
    return hour * 3600.0 + int(found["m"]) * 60.0 + float((found["s"] or "0").replace(",", "."))


def _date(text: str, order: str) -> float:
    found = _DATE.match(text.strip())
    if found is None:
        raise ValueError(text)
    parts = dict(zip(order, (int(found[key]) for key in "abc"), strict=True))
    year = parts["y"] + (2000 if parts["y"] < 100 else 0)
    return datetime.datetime(year, parts["m"], parts["d"], tzinfo=datetime.UTC).timestamp()


def _past_midnight(seconds: Array) -> Array:
    """Times of day that go on over midnight: a day more after each fall of more than half a day."""
    known = np.flatnonzero(np.isfinite(seconds))
    days = np.cumsum(np.diff(seconds[known], prepend=seconds[known[0]]) < -0.5 * DAY)
    out = seconds.copy()
    out[known] += DAY * days
    return out


def ordered(time: Array, clock: Clock, where: str) -> Order:
    """The samples of a table in order of time; what is kept out is flagged with its count.

    One sample of several with the same time is kept, the first. Of those that then do not increase, the longest row
    that does is kept, so that one wrong stamp costs one sample, and a clock that was set back costs those of the
    shorter part that overlaps.

    Raises
    ------
    InputError
        No sample with a time, or half of them out of order.
    """
    kept = np.flatnonzero(np.isfinite(time))
    flags: list[Flag] = []
    said: list[str] = []
    if len(kept) < len(time):
        lost = len(time) - len(kept)
        flags.append(Flag("format", "time", 0.0, 0.0, lost, f"{where}: {lost} rows without a readable time: left out"))
    if clock.reset == "continue":
        time, moved = _continued(time, kept)
        flags += [Flag("clock", "time", at, at, 1, f"{where}: {words}") for at, words in moved]
    twice = np.zeros(len(kept), dtype=bool)
    twice[1:] = time[kept][1:] == time[kept][:-1]
    if twice.any():
        at = time[kept[twice]]
        flags.append(
            _flag("repeat", at, f"{where}: {int(twice.sum())} samples with the time of the one before: kept out")
        )
        kept = kept[~twice]
    rising = _longest(time[kept])
    if len(rising) < len(kept):
        out = np.setdiff1d(np.arange(len(kept)), rising)
        words = f"{where}: the clock goes back; {len(out)} samples out of order are kept out"
        flags.append(_flag("clock", time[kept[out]], words))
        if len(out) > OUT_OF_ORDER * len(kept):
            raise InputError(
                f"{where}: {len(out)} of {len(kept)} samples are out of order of time. Is another column the clock? "
                'For a clock that starts again write [clock] reset = "continue", or cut the file into one log for each.'
            )
        kept = kept[rising]
    if not len(kept):
        raise InputError(f"{where}: no sample has a time. Correct [clock], or export the log again.")
    return Order(kept, time[kept], (*flags, *_gaps(time[kept], where)), tuple(said))


def _flag(kind: str, at: Array, words: str) -> Flag:
    return Flag(kind, "time", float(at.min()), float(at.max()), len(at), words)


def _gaps(time: Array, where: str) -> list[Flag]:
    steps = np.diff(time)
    usual = float(np.median(steps)) if len(steps) else 0.0
    out = []
    for i in np.flatnonzero(steps > GAP * usual):
        missing = max(round(float(steps[i]) / usual) - 1, 1)
        also = ", or the clock was set" if steps[i] > JUMP else ""
        words = f"{where}: no sample for {steps[i]:.6g} s, where the steps are {usual:.4g} s{also}"
        out.append(Flag("gap", "time", float(time[i]), float(time[i + 1]), missing, words))
    return out


def _continued(time: Array, kept: Rows) -> tuple[Array, list[tuple[float, str]]]:
    """Times that go on with the median step where the clock starts again."""
    steps = np.diff(time[kept])
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
    shift, moved = np.zeros(len(kept)), []
    for i in np.flatnonzero(steps < 0.0):
        shift[i + 1 :] += usual - steps[i]
        moved.append((float(time[kept[i]] + shift[i]), f"the clock goes back by {-steps[i]:.6g} s; it is continued"))
    out = time.copy()
    out[kept] = time[kept] + shift
    return out, moved


def _longest(values: Array) -> Rows:
    """Places of the longest row of ``values`` that strictly increases.

    Source     fredman1975: piles whose tops are searched by halving.
    """
    tops: list[float] = []
    places: list[int] = []
    before = np.full(len(values), -1, dtype=np.intp)
    if len(values) < 2 or (np.diff(values) > 0.0).all():
        return np.arange(len(values), dtype=np.intp)
    for i, value in enumerate(values.tolist()):
        pile = bisect.bisect_left(tops, value)
        before[i] = places[pile - 1] if pile else -1
        if pile == len(tops):
            tops.append(value)
            places.append(i)
        else:
            tops[pile], places[pile] = value, i
    out = [places[-1]]
    while before[out[-1]] >= 0:
        out.append(int(before[out[-1]]))
    return np.array(out[::-1], dtype=np.intp)
