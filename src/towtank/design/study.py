"""What a design study is and what it found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.design.goal import Goal, all_met, least_margin
from towtank.design.point import Changes
from towtank.frames import Array
from towtank.sweep.sweep import Axis


@dataclass(frozen=True)
class Point:
    """A variant: what is changed, its numbers, or why there are none. No changes: the craft as given."""

    changes: Changes
    values: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    failed: str = ""
    key: str = ""

    def words(self, axes: Sequence[Axis]) -> str:
        """What is changed, as printed."""
        known = {axis.name: axis for axis in axes}
        return ", ".join(_words(known[name], value) for name, value in self.changes) or "as given"


@dataclass(frozen=True)
class DesignStudy:
    """Points of a design study and what follows from them.

    given : axis -> its value of the craft as given; NaN where it has none.   speed [m/s] : of the design.
    target : probability of stability asked for.   hotel [W].   drive : efficiency and its origin.
    alone : axis -> the least-drag point that meets the goals by this axis alone, or None.
    best : the point of least drag that meets all goals, or None.   columns : name -> unit.
    """

    craft: str
    level: str
    speed: float
    target: float
    hotel: float
    drive: Mapping[str, Any]
    goals: tuple[Goal, ...]
    axes: tuple[Axis, ...]
    given: Mapping[str, float]
    base: Point
    points: tuple[Point, ...]
    alone: Mapping[str, Point | None]
    best: Point | None
    columns: Mapping[str, str]
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def done(self) -> tuple[Point, ...]:
        """Points with numbers."""
        return tuple(point for point in self.points if not point.failed)

    @property
    def nearest(self) -> Point:
        """The point that misses the goals least; the best one where there is one."""
        return self.best or max(self.done, key=lambda point: least_margin(self.goals, point.values))

    @property
    def pareto(self) -> tuple[Point, ...]:
        """Points that no other beats in both drag and P(stable), by rising drag; goals of shape and trim are met."""
        others = [goal for goal in self.goals if not goal.column.startswith("P_stable")]
        kept: list[Point] = []
        held = sorted(
            (p for p in self.done if all_met(others, p.values)), key=lambda p: (p.values["drag"], -p.values["P_stable"])
        )
        for point in held:
            if not kept or point.values["P_stable"] > kept[-1].values["P_stable"]:
                kept.append(point)
        return tuple(kept)

    def drag_rise(self, point: Point) -> float:
        """Resistance over that of the craft as given, less one."""
        return point.values["drag"] / self.base.values["drag"] - 1.0

    def range_change(self, point: Point) -> float:
        """Distance on the same energy at the design speed, over that of the craft as given, less one."""
        return self.base.values["energy_per_metre"] / point.values["energy_per_metre"] - 1.0

    def line(self, name: str) -> list[tuple[float, Point]]:
        """(value, point) where only ``name`` is changed, with what it needs beside it; by rising value."""
        axis = next(axis for axis in self.axes if axis.name == name)
        beside = set(companions(self.axes, axis, self.given[name]))
        out = [(self.given[name], self.base)] if math.isfinite(self.given[name]) and not beside else []
        for point in self.points:
            own = [value for key, value in point.changes if key == name]
            if own and set(point.changes) == {*beside, (name, own[0])}:
                out.append((own[0], point))
        return sorted(out, key=lambda item: item[0])

    def grid(self, column: str) -> Array:
        """``column`` over the values of the first two axes, the others as given; NaN where there is no number."""
        first, second = self.axes[:2]
        known = {point.changes: point.values.get(column, math.nan) for point in self.done}

        def at(a: float, b: float) -> float:
            return known.get(canonical(((first.name, a), (second.name, b)), self.given), math.nan)

        return np.array([[at(a, b) for b in second.values] for a in first.values])


def _words(axis: Axis, value: float) -> str:
    shown = math.degrees(value) if axis.unit == "rad" else value
    return f"{axis.name} {shown:.4g} {axis.shown[1]}".rstrip()


def canonical(changes: Changes, given: Mapping[str, float]) -> Changes:
    """``changes`` without those that change nothing, sorted by name: one variant has one name.

    given : axis -> its value of the craft as given.
    """
    named = dict(changes)
    if named.get("strake_height") == 0.0:  # strakes that are not there have no length
        named = {name: value for name, value in named.items() if name == "strake_height" or "strake_" not in name}
    return tuple(sorted((name, value) for name, value in named.items() if value != given.get(name)))


def companions(axes: Sequence[Axis], axis: Axis, base: float) -> Changes:
    """What must change beside ``axis`` so that it has an object: strakes of the middle height, where there are none."""
    if not axis.name.startswith("strake_") or axis.name == "strake_height" or math.isfinite(base):
        return ()
    height = next((other for other in axes if other.name == "strake_height"), None)
    return () if height is None else (("strake_height", 0.5 * (min(height.values) + max(height.values))),)
