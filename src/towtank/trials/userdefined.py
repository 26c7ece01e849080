"""User-defined trials: commands over time or on conditions, and indices, from a TOML file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import MOST_GAUGES, Ended, Gauge, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import si
from towtank.trials import start
from towtank.trials.ready import COMMON, Ready, last, run_trial
from towtank.trials.schema import (
    HELD,
    SEEN,
    TIME,
    CommandTable,
    IndexTable,
    Number,
    Seen,
    TrialTable,
    closest,
    read_trial,
)
from towtank.trials.start import Setting
from towtank.trials.steps import adrift, drifting
from towtank.trials.trajectory import Trajectory
from towtank.trials.waypoints import Waypoint, waypoint_mission_ready

KIND = "user-defined"
PATIENCE = "100 L"
"""Longest wait for a condition where a command gives none."""
STEEPEST = np.radians(80.0)
OWN = ("duration", "depth_change", "largest_roll", "largest_pitch", "fin_rms", "fin_largest", "fin_travel",
       "fin_saturation")  # fmt: skip
"""Indices that every trial has."""


def trial_from_file(model: Model, path: Path | str, *, pilot: Pilot | None = None) -> Trajectory:
    """The trial that a TOML file describes: a list of commands, or a mission of waypoints. See ``docs/trials.md``.

    Parameters
    ----------
    path : of the file.   pilot : designed from the model when not given.

    Raises
    ------
    InputError
        The file cannot be read or has faults, an order is beyond the craft, or a quantity has no unit or a wrong one.
    """
    return run_trial(model, ready_from_file(model, path, pilot))


def ready_from_file(model: Model, path: Path | str, pilot: Pilot | None = None) -> Ready:
    """The trial of a file, ready to fly; arguments as in ``trial_from_file``."""
    table = read_trial(path)
    current = _current(table)
    if table.waypoint:
        points = [Waypoint(item.north, item.east, item.depth, item.speed) for item in table.waypoint]
        return waypoint_mission_ready(model, points, table.speed, pilot, current, table.name)
    s = start.setting(model, table.speed, pilot, piloted=table.loop == "closed")
    gate = _Gate(model, s)
    legs = _legs(gate, table)
    readers = [_reader(gate, name, item, legs) for name, item in table.index.items()]
    gauges = tuple(dict.fromkeys(gauge for reader in readers for gauge in reader.gauges))
    if len(gauges) > MOST_GAUGES - len(COMMON):
        raise InputError(
            f"{table.name}: the indices take {len(gauges)} gauges; a run has room for {MOST_GAUGES - len(COMMON)}. "
            "Leave some indices out."
        )
    return Ready(
        name=table.name, kind=KIND, loop=table.loop, setting=s, legs=legs, interval=s.convective / 16.0, gauges=gauges,
        start=adrift(s, current), current=drifting(current), status=_status,
        read=lambda flights: {reader.name: reader.read(flights) for reader in readers},
        curves=lambda _: {"file": {"text": Path(path).read_text("utf-8")}} if Path(path).is_file() else {},
    )  # fmt: skip


@dataclass(frozen=True)
class _Gate:
    """Numbers with units, for one craft at one speed."""

    model: Model
    s: Setting

    def value(self, given: Number, seen: Seen, where: str) -> float:
        """SI value of what is seen; distances may count craft lengths."""
        if seen.unit == "m":
            return start.span(given, self.model.craft.length, where)
        return si(given, seen.unit, where)

    def lasting(self, given: Number, where: str) -> float:
        """Time [s] of a time, or of craft lengths at the approach speed."""
        if isinstance(given, str) and given.strip().endswith("L"):
            seconds = start.span(given, self.s.convective, where)
        else:
            seconds = si(given, "s", where)
        if seconds <= 0.0:
            raise InputError(f'{where}: {given!r} is not positive. Give a time such as "20 s", or lengths, "5 L".')
        return seconds

    def until(self, text: str, where: str) -> Until:
        """``"heading 90 deg"``, ``"|roll| 5 deg"``."""
        found = re.fullmatch(r"\s*(\|?)\s*([a-z][a-z ]*?)\s*(\|?)\s+([-+.\d].*)", text)
        if not found or bool(found[1]) != bool(found[3]):
            raise InputError(
                f'{where}: {text!r} is no condition. Write what is seen and its value, "heading 90 deg"; with bars, '
                '"|heading| 90 deg", to either side.'
            )
        seen = _seen(found[2], SEEN, where)
        return Until(seen.channel, self.value(found[4], seen, where), absolute=bool(found[1]))


def _seen(word: str, known: Mapping[str, Seen], where: str) -> Seen:
    if word not in known:
        raise InputError(f"{where}: {word!r} is not seen in a run. {closest(word, known)}")
    return known[word]


def _current(table: TrialTable) -> Sequence[float]:
    if table.current is None:
        return STILL
    return [*(si(x, "m/s", f"{table.name}: current") for x in table.current), 0.0][:3]


def _legs(gate: _Gate, table: TrialTable) -> tuple[Leg, ...]:
    """Commands as legs; an order stands until another takes its place."""
    piloted = 1.0 if gate.s.pilot else 0.0
    orders = gate.s.orders(steer=piloted, dive=piloted)
    legs: list[Leg] = []
    for i, item in enumerate(table.command, start=1):
        name = item.name or f"command-{i}"
        where = f"{table.name}: command {i}" + (f" ({item.name})" if item.name else "")
        if any(name == leg.name for leg in legs):
            raise InputError(f"{where}: another command is called {name!r}. Give each its own name.")
        orders = _changed(gate, orders, item, where)
        if item.until is None:
            legs.append(Leg(name, orders, gate.lasting(item.lasting or 0.0, f"{where}, for")))
            continue
        until = gate.until(item.until, f"{where}, until")
        within = gate.lasting(PATIENCE if item.within is None else item.within, f"{where}, within")
        legs.append(Leg(name, orders, within, until, required=True))
    return tuple(legs)


def _changed(gate: _Gate, orders: Orders, item: CommandTable, where: str) -> Orders:
    """``orders`` with those of a command in place."""
    limit, craft = start.fin_limit(gate.model), gate.model.craft.name

    def angle(key: str, largest: float, reason: str) -> float:
        given = si(getattr(item, key), "rad", f"{where}, {key}")
        return start.angle(given, f"{where}, {key}", largest, reason)

    piloted = [key for key in ("heading", "turn", "depth", "pitch") if getattr(item, key) is not None]
    if piloted and not gate.s.pilot:
        raise InputError(
            f'{where}: {piloted[0]} is an order to the pilot, and loop = "open" has none. Order rudder or elevator, or '
            'write loop = "closed".'
        )
    changes: dict[str, float] = {}
    if item.rudder is not None:
        changes |= {"rudder": angle("rudder", limit, f"the limit of the fins of {craft}"), "steer": 0.0, "turning": 0.0}
    if item.heading is not None:
        heading = si(item.heading, "rad", f"{where}, heading")
        changes |= {"heading": heading, "steer": 1.0, "turning": 0.0}
    if item.turn is not None:
        changes |= {"turn": si(item.turn, "rad/s", f"{where}, turn"), "steer": 1.0, "turning": 1.0}
    if item.elevator is not None:
        over = angle("elevator", limit, f"the limit of the fins of {craft}")
        changes |= {"elevator": gate.s.trim.elevator + over, "dive": 0.0, "pitching": 0.0}
    if item.depth is not None:
        changes |= {"depth": gate.value(item.depth, SEEN["depth"], f"{where}, depth"), "dive": 1.0, "pitching": 0.0}
    if item.pitch is not None:
        pitch = angle("pitch", STEEPEST, "beyond which heading and roll lose their meaning")
        # The pilot's elevator trim holds the trimmed pitch, from which its order counts.
        changes |= {"pitch": pitch - gate.s.trim.pitch, "dive": 1.0, "pitching": 1.0}
    if item.throttle is not None:
        changes["throttle"] = si(item.throttle, "", f"{where}, throttle")
    return replace(orders, **changes)


@dataclass(frozen=True)
class _Reader:
    """How an index is read."""

    name: str
    gauges: tuple[Gauge, ...]
    read: Any


def _reader(gate: _Gate, name: str, item: IndexTable, legs: Sequence[Leg]) -> _Reader:
    where = f"index.{name}"
    if name in OWN:
        raise InputError(f"{where}: every trial has an index of this name. Choose another.")
    by_name = {leg.name: leg for leg in legs}
    for command in (item.at, item.since, *([item.during] if isinstance(item.during, str) else item.during or ())):
        if command is not None and command not in by_name:
            raise InputError(f"{where}: no command is called {command!r}. {closest(command, by_name)}")
    if item.at is not None:
        return _mark(gate, name, item, by_name)
    if item.of == TIME:
        raise InputError(f"{where}: time is read at the end of a command. Write at = {legs[-1].name!r}.")
    seen = _seen(item.of, {**SEEN, **HELD} if item.take else SEEN, f"{where}, of")
    if item.crossing is not None:
        return _crossing(gate, name, item, seen)
    during = list(by_name) if item.during is None else [item.during] if isinstance(item.during, str) else item.during
    return _statistic(gate, name, item, seen, during)


def _mark(gate: _Gate, name: str, item: IndexTable, legs: Mapping[str, Leg]) -> _Reader:
    """Value at the end of one command, less that at the end of another, less a number."""
    seen = Seen("", "s", "s") if item.of == TIME else _seen(item.of, {TIME: SEEN["depth"], **SEEN}, f"index.{name}, of")
    less = 0.0 if item.less is None else gate.value(item.less, seen, f"index.{name}, less")

    def end(flights: Flights, command: str) -> Array:
        event = legs[command].until is not None
        return flights.at(command, seen.channel, event=event) if seen.channel else flights.when(command, event=event)

    def read(flights: Flights) -> tuple[Array, str]:
        value = end(flights, item.at or "") - less
        return seen.factor * (value if item.since is None else value - end(flights, item.since)), seen.shown

    return _Reader(name, (), read)


def _crossing(gate: _Gate, name: str, item: IndexTable, seen: Seen) -> _Reader:
    """Time from the start of a command to the first or last crossing of a level."""
    gauge = Gauge(seen.channel, gate.value(item.level or 0.0, seen, f"index.{name}, level"))
    stat, command = Stat.FIRST if item.crossing == "first" else Stat.LAST, str(item.during)

    def read(flights: Flights) -> tuple[Array, str]:
        i = flights.leg(command)
        begin = flights.mark_time[:, i - 1] if i else 0.0
        return flights.stat(command, gauge, stat) - begin, "s"

    return _Reader(name, (gauge,), read)


def _statistic(gate: _Gate, name: str, item: IndexTable, seen: Seen, during: Sequence[str]) -> _Reader:
    """Extreme, mean or root mean square over commands, about a number; NaN unless all of them were flown."""
    size = item.take == "largest size"
    gauge = Gauge(seen.channel, absolute=size)
    less = 0.0 if item.less is None else gate.value(item.less, seen, f"index.{name}, less")

    def read(flights: Flights) -> tuple[Array, str]:
        def of(stat: Stat) -> Array:
            return np.stack([flights.stat(command, gauge, stat) for command in during], axis=-1)

        lasting = np.stack([flights.duration(command) for command in during], axis=-1).sum(axis=-1)
        mean = of(Stat.INTEGRAL).sum(axis=-1) / lasting
        if item.take == "rms":
            square = of(Stat.SQUARE).sum(axis=-1) / lasting - 2.0 * less * mean + less * less
            return seen.factor * np.sqrt(np.maximum(square, 0.0)), seen.shown
        if item.take == "mean":
            return seen.factor * (mean - less), seen.shown
        value = of(Stat.LOW).min(axis=-1) if item.take == "smallest" else of(Stat.HIGH).max(axis=-1)
        return seen.factor * (value - less), seen.shown

    return _Reader(name, (gauge,), read)


def _status(flights: Flights) -> str | None:
    if flights.ended[0] != Ended.LATE:
        return None
    leg = flights.legs[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1]
    until = leg.until
    word, seen = next((w, x) for w, x in SEEN.items() if until is not None and x.channel == until.channel)
    stood, wanted = seen.factor * float(last(flights, seen.channel)[0]), seen.factor * (until.level if until else 0.0)
    return (
        f"ended early: command {leg.name!r} waited {leg.within:.0f} s for a {word} of {wanted:.4g} {seen.shown}; it "
        f"stood at {stood:.4g}. Give more time (within), a stronger order, or another condition"
    )
