"""Carry out a design study: lines, a grid, each change alone, and the search for the least drag under the goals."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, brentq, minimize

from towtank.cluster.ledger import Failed, Result
from towtank.cluster.work import each_once
from towtank.craft.craft import Craft
from towtank.craft.hydrostatics import TRIM_LIMIT
from towtank.design.goal import Goal, all_met, least_margin, slender_goal
from towtank.design.point import Changes, Question, work, work_with_trials
from towtank.design.power import drive_of
from towtank.design.study import DesignStudy, Point, canonical, companions
from towtank.errors import InputError, TowtankError
from towtank.frames import Array
from towtank.progress import Progress, Silent
from towtank.provenance import VERSION, digest, provenance
from towtank.sweep.point import model_of
from towtank.sweep.sweep import Axis, axis_of
from towtank.sweep.vary import KINDS
from towtank.tank.fast.tank import LEVEL

LEDGER = "design"
"""Folder of the finished points in the study folder."""
VALUES = 5
"""Values of an axis in lines and grid unless told otherwise."""
EVALUATIONS = 50
"""Points that the search may ask for."""
REFINEMENTS = 6
"""Points spent on where one change alone meets the goals."""
REFUSED = 2.0
"""Drag over that of the craft as given that the search is told of a variant that cannot be built."""
SMALL, WORTH = 0.1, 2e-3
"""A change of less than this share of its range is tried without; it is left out where that costs less than this share
of drag."""
FURTHER, EDGE = 1.25, 2e-3
"""Changes are taken so many times as far, or as little far, to where the goals are just met; within so much of it."""
NEAR = 1e-4
"""Distance to a bound, in shares of the range, within which the bound itself is taken."""
INSIDE, INSIDE_SHAPE = 0.003, 0.002
"""Margins that the search asks for, of smooth goals and of others: it ends on its bound, within its last step."""
FIRST_STEP, LAST_STEP = 0.2, 0.01
"""Steps of the search in shares of the ranges: the first, and the one at which it ends."""


def axes_of(craft: Craft, texts: Sequence[str]) -> tuple[Axis, ...]:
    """Axes of a study from texts such as ``"fin_span=1:2.5"``: first, last, and the number of values if it is given.

    Without texts: span and chord of the fins, height, taper and length of strakes.

    Raises
    ------
    InputError
        A text that cannot be read, or an axis that cannot be searched.
    """
    standard = [f"strake_height=0:{0.3 * craft.diameter:.3g}", "strake_taper=0.2:1", "strake_length=0.04 L:0.2 L"]
    if craft.fins:
        standard = ["fin_span=1:2.5", standard[0], "fin_chord=0.8:1.6", *standard[1:]]
    wanted = [text if text.count(":") != 1 else f"{text}:{VALUES}" for text in (texts or standard)]
    axes = tuple(axis_of(craft, text) for text in wanted)
    names = [axis.name for axis in axes]
    if len(set(names)) < len(names):
        raise InputError(f"axes {', '.join(names)}: an axis is named twice. Give each once.")
    for axis in axes:
        if axis.name == "speed":
            raise InputError("speed is no change of the craft. Give the design speed with --speed, or see --range.")
        if len(set(axis.values)) < 2:
            raise InputError(f"axis {axis.name}: a study needs a range such as {axis.name}=LOW:HIGH.")
    lacking = [name for name in names if name.startswith("strake_") and name != "strake_height"]
    if lacking and not craft.strakes and "strake_height" not in names:
        raise InputError(
            f"{lacking[0]}: {craft.name} has no strakes. Add strake_height=0:{0.3 * craft.diameter:.3g} to the axes."
        )
    return axes


@dataclass
class Evaluator:
    """Points of one study, each worked out once and kept in the folder ``out``."""

    question: Question
    out: Path
    workers: int = 1
    progress: Progress = field(default_factory=Silent)
    program: str = VERSION
    given: Mapping[str, float] = field(default_factory=dict)
    points: dict[Changes, Point] = field(default_factory=dict)
    columns: dict[str, str] = field(default_factory=dict)

    def many(self, wanted: Sequence[Changes], task: str = "design") -> list[Point]:
        """Points of ``wanted``, with several processes where there are some to do."""
        plain = [canonical(changes, self.given) for changes in wanted]
        fresh = [changes for changes in dict.fromkeys(plain) if changes not in self.points]
        for changes, point in zip(fresh, self._done(work, fresh, task), strict=True):
            self.points[changes] = point
        return [self.points[changes] for changes in plain]

    def one(self, changes: Changes) -> Point:
        """One point."""
        return self.many([changes])[0]

    def trials(self, wanted: Sequence[Changes]) -> None:
        """Add the indices of trials to some points."""
        fresh = list(dict.fromkeys(wanted))
        for changes, flown in zip(fresh, self._done(work_with_trials, fresh, "trials"), strict=True):
            point = self.points[changes]
            notes = tuple(dict.fromkeys((*point.notes, *flown.notes, *((flown.failed,) if flown.failed else ()))))
            self.points[changes] = Point(
                changes, {**point.values, **flown.values}, notes, point.failed, point.key
            )  # fmt: skip

    def _done(
        self, job: Callable[[Question, Changes], Mapping[str, Any]], items: list[Changes], task: str
    ) -> list[Point]:
        common = digest([self.question, self.question.tank.settings(), job.__name__, self.program], 16)
        keys = [f"{self.question.craft.name[:60]}-{digest([common, changes], 16)}" for changes in items]
        found: dict[int, Result] = {}
        if items:
            found = dict(
                each_once(
                    job, self.question, items, keys=keys, ledger=self.out / LEDGER, workers=self.workers,
                    progress=self.progress, task=task,
                )
            )  # fmt: skip
        return [self._point(changes, keys[i], found[i]) for i, changes in enumerate(items)]

    def _point(self, changes: Changes, key: str, result: Result) -> Point:
        if isinstance(result, Failed):
            return Point(changes, failed=result.message, key=key)
        self.columns |= {name: unit for name, unit in result["units"].items() if name not in self.columns}
        values = {name: math.nan if value is None else float(value) for name, value in result["values"].items()}
        return Point(changes, values, tuple(result["notes"]), key=key)


def run_design(
    question: Question,
    axes: tuple[Axis, ...],
    goals: tuple[Goal, ...],
    out: Path | str,
    *,
    workers: int = 1,
    evaluations: int = EVALUATIONS,
    progress: Progress | None = None,
    program: str = VERSION,
) -> DesignStudy:
    """Lines over every axis, a grid over the first two, each change alone, and the search.

    Parameters
    ----------
    axes : what may be changed and how far.   goals : what must be reached; those of validity and trim are added.
    out : study folder. A finished point is a file ``design/<key>.json`` at once, and not done again.
    evaluations : points the search may ask for.

    Raises
    ------
    InputError
        An axis that cannot be searched.
    TowtankError
        The craft as given cannot be evaluated, or the work was interrupted; finished points stay.
    """
    craft = question.craft
    given = {axis.name: _given(craft, axis.name) for axis in axes}
    told = Evaluator(question, Path(out), workers, progress or Silent(), program, given)
    base = told.one(())
    if base.failed:
        raise TowtankError(f"design {craft.name}: the craft as given cannot be evaluated: {base.failed}")
    goals = (*goals, *_own_goals(axes, base))
    lines = {axis.name: _line(axes, axis, given[axis.name]) for axis in axes}
    grid: list[Changes] = (
        [((axes[0].name, a), (axes[1].name, b)) for a in axes[0].values for b in axes[1].values] if axes[1:] else []
    )
    told.many([changes for line in lines.values() for changes in line] + grid)
    alone = {axis.name: _alone(told, axis, lines[axis.name], goals) for axis in axes}
    _search(told, axes, given, goals, evaluations)
    _polish(told, axes, given, goals)
    best = _simplest(list(told.points.values()), goals)
    named = [point.changes for point in (base, best, *alone.values()) if point is not None]
    told.trials(named)
    return DesignStudy(
        craft=craft.name, level=LEVEL, speed=craft.speed, target=question.target, hotel=question.hotel,
        drive=vars(drive_of(model_of(craft, question.tank), question.efficiency)), goals=goals, axes=axes, given=given,
        base=told.points[()], points=tuple(told.points.values()),
        alone={name: told.points[point.changes] if point else None for name, point in alone.items()},
        best=told.points[best.changes] if best else None, columns=dict(told.columns),
        provenance=provenance(
            {"craft": digest(craft, 16)}, tank=question.tank.settings(), evaluations=evaluations, source=program,
            assumed=list(craft.assumed),
        ),
    )  # fmt: skip


def _given(craft: Craft, name: str) -> float:
    try:
        return KINDS[name].base(craft)
    except TowtankError:
        return math.nan


def _own_goals(axes: Sequence[Axis], base: Point) -> tuple[Goal, ...]:
    """What every design must keep: strakes within their theory, and no more tilt at rest than is given or usual."""
    out = [slender_goal()] if any(axis.name.startswith("strake_") for axis in axes) else []
    if any(axis.name.startswith("cg_") for axis in axes):
        limit = max(math.degrees(TRIM_LIMIT), base.values["tilt_at_rest"])
        reason = "beyond it slow runs need elevator all the time"
        out.append(Goal("tilt at rest", "tilt_at_rest", limit, False, "deg", reason))
    return tuple(out)


def _line(axes: Sequence[Axis], axis: Axis, base: float) -> list[Changes]:
    beside = companions(axes, axis, base)
    return [(*beside, (axis.name, value)) for value in axis.values]


def _cheapest(points: Collection[Point], goals: Sequence[Goal]) -> Point | None:
    met = [point for point in points if not point.failed and all_met(goals, point.values)]
    return min(met, key=lambda point: float(point.values["drag"]), default=None)


def _simplest(points: Collection[Point], goals: Sequence[Goal]) -> Point | None:
    """Of the points that meet the goals for hardly more than the least drag, the one with the fewest changes."""
    least = _cheapest(points, goals)
    if least is None:
        return None
    limit = (1.0 + WORTH) * least.values["drag"]
    met = [p for p in points if not p.failed and all_met(goals, p.values) and p.values["drag"] <= limit]
    return min(met, key=lambda point: (len(point.changes), point.values["drag"]))


def _polish(told: Evaluator, axes: Sequence[Axis], given: Mapping[str, float], goals: Sequence[Goal]) -> None:
    """Take the best point, all its changes alike, to where it just meets the goals; then without each small change.

    Source     Brent's method on the least margin along the line from the craft as given.
    """
    done = [point for point in told.points.values() if not point.failed]
    start = _cheapest(done, goals) or max(done, key=lambda point: least_margin(goals, point.values))
    _to_the_edge(told, axes, given, goals, start.changes)
    best = _cheapest(list(told.points.values()), goals)
    if best is None:
        return
    for axis in axes:
        change = dict(best.changes).get(axis.name, given[axis.name]) - given[axis.name]
        if math.isfinite(change) and 0.0 < abs(change) <= SMALL * (max(axis.values) - min(axis.values)):
            _to_the_edge(told, axes, given, goals, tuple(item for item in best.changes if item[0] != axis.name))


def _to_the_edge(
    told: Evaluator, axes: Sequence[Axis], given: Mapping[str, float], goals: Sequence[Goal], changes: Changes
) -> None:
    """Ask for the point on the line through ``changes`` where the least margin is zero, from the side that meets it."""
    steps = [(axis, value) for axis in axes for name, value in changes if name == axis.name]

    def margin(t: float) -> float:
        point = told.one(tuple((axis.name, _further(axis, given[axis.name], value, t)) for axis, value in steps))
        return -1.0 if point.failed else least_margin(goals, point.values)

    if not steps:
        return
    low, high = (1.0 / FURTHER, 1.0) if margin(1.0) >= 0.0 else (1.0, FURTHER)
    if margin(low) < 0.0 < margin(high):
        margin(brentq(margin, low, high, xtol=EDGE, maxiter=REFINEMENTS, disp=False) + EDGE)


def _further(axis: Axis, base: float, value: float, t: float) -> float:
    """``value`` moved from ``base`` to ``t`` times its distance, within the range; as it is where there is no base."""
    moved = base + t * (value - base) if math.isfinite(base) else value
    return float(np.clip(moved, min(axis.values), max(axis.values)))


def _alone(told: Evaluator, axis: Axis, line: list[Changes], goals: Sequence[Goal]) -> Point | None:
    """The least-drag point of ``line`` that meets the goals, refined where a margin changes its sign.

    Source     Brent's method on the least margin.
    """
    at = sorted((dict(changes)[axis.name], changes) for changes in line)
    values, points = [value for value, _ in at], told.many([changes for _, changes in at])
    margins = [-1.0 if point.failed else least_margin(goals, point.values) for point in points]
    beside = tuple(item for item in line[0] if item[0] != axis.name)
    tried = list(points)

    def margin(value: float) -> float:
        tried.append(told.one((*beside, (axis.name, value))))
        return -1.0 if tried[-1].failed else least_margin(goals, tried[-1].values)

    span = values[-1] - values[0]
    for i in range(len(values) - 1):
        if margins[i] * margins[i + 1] < 0.0:
            root = brentq(margin, values[i], values[i + 1], xtol=0.01 * span, maxiter=REFINEMENTS, disp=False)
            beyond = root + math.copysign(0.01 * span, margins[i + 1] - margins[i])
            margin(float(np.clip(beyond, values[0], values[-1])))
    return _cheapest(tried, goals)


def _search(
    told: Evaluator,
    axes: Sequence[Axis],
    given: Mapping[str, float],
    goals: Sequence[Goal],
    evaluations: int,
) -> None:
    """Look for less drag within the ranges of ``axes``, from the best point so far; every point asked for is kept.

    Source     COBYQA of scipy (ragonneau2022): derivative-free, with bounds and constraints.
    """
    low = np.array([min(axis.values) for axis in axes])
    span = np.array([max(axis.values) for axis in axes]) - low
    done = [point for point in told.points.values() if not point.failed]
    start = _cheapest(done, goals) or max(done, key=lambda point: least_margin(goals, point.values))
    base = told.points[()].values["drag"]
    seen: dict[bytes, Point] = {}

    def at(share: Array) -> Point:
        inside = np.where(share < NEAR, 0.0, np.where(share > 1.0 - NEAR, 1.0, share))
        if inside.tobytes() not in seen:
            values = low + span * inside
            seen[inside.tobytes()] = told.one(
                tuple((axis.name, float(v)) for axis, v in zip(axes, values, strict=True))
            )
            told.progress.step("search", f"{len(seen)} of {evaluations}")
        return seen[inside.tobytes()]

    def drag(share: Array) -> float:
        point = at(share)
        return REFUSED if point.failed else point.values["drag"] / base

    def margins(share: Array) -> Array:
        point = at(share)
        return np.array([-1.0 if point.failed else goal.margin(point.values) for goal in goals])

    told.progress.start("search", evaluations)
    try:
        minimize(
            drag, (_place(axes, given, start) - low) / span, method="COBYQA", bounds=Bounds(0.0, 1.0),
            constraints=NonlinearConstraint(margins, [INSIDE if g.smooth else INSIDE_SHAPE for g in goals], np.inf),
            options={"maxfev": evaluations, "initial_tr_radius": FIRST_STEP, "final_tr_radius": LAST_STEP},
        )  # fmt: skip
    finally:
        told.progress.done("search")


def _place(axes: Sequence[Axis], given: Mapping[str, float], point: Point) -> Array:
    """Values of all ``axes`` at ``point``: what it does not change is as given, within the ranges."""
    changed = dict(point.changes)
    out = []
    for axis in axes:
        value = changed.get(axis.name, given[axis.name])
        middle = 0.5 * (min(axis.values) + max(axis.values))
        out.append(np.clip(value if math.isfinite(value) else middle, min(axis.values), max(axis.values)))
    return np.array(out)
