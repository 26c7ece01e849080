"""Open against closed loop: the same numbers without and with the pilot."""

from __future__ import annotations

import math
from collections.abc import Sequence

from towtank.trials.trajectory import Trajectory
from towtank.verdict.fins import FinUse
from towtank.verdict.table import Comparison


def comparison(trajectories: Sequence[Trajectory], fins: Sequence[FinUse] = ()) -> tuple[Comparison, ...]:
    """Open- against closed-loop numbers of the trials at hand: course, overshoot, depth, roll, effort of the fins."""
    straight, zigzag = _first(trajectories, "straight run"), _first(trajectories, "zigzag, horizontal")
    heading, mission = _first(trajectories, "heading step"), _first(trajectories, "lawnmower")
    depth, circle = _first(trajectories, "depth step"), _first(trajectories, "turning circle")
    survey = mission or heading
    rows = []
    if straight and heading:
        rows.append(_row("course held", straight, "heading_change", heading, "last_error", "deg"))
    if zigzag and heading:
        rows.append(_row("overshoot", zigzag, "first_overshoot", heading, "overshoot", "deg"))
    if straight and depth:
        rows.append(_row("depth held", straight, "depth_change", depth, "last_error", "m"))
    if not survey:
        return tuple(rows)
    if circle or zigzag:
        rows.append(_row("largest roll", circle or zigzag, "largest_roll", survey, "largest_roll", "deg"))
    base = zigzag or straight
    for name, key, unit in (
        ("fin effort", "fin_rms", "deg"),
        ("fin travel", "fin_travel", "deg/m"),
        ("fin saturation", "fin_saturation", "%"),
    ):
        rows.append(_row(name, base, key, survey, key, unit))
    used = {use.trial: use for use in fins}
    if survey.name in used:
        left, right = used.get(base.name) if base else None, used[survey.name]
        note = rows[-1].note
        rows += [
            Comparison("fin range used", left.use if left else math.nan, right.use, "%", note),
            Comparison("drag of the deflected fins", left.drag if left else math.nan, right.drag, "N", note),
            Comparison("its share in the resistance", left.share if left else math.nan, right.share, "%", note),
        ]
    return tuple(rows)


def notes(trajectories: Sequence[Trajectory]) -> tuple[str, ...]:
    """Trials that ended early, and what their notes repeat."""
    early = [f"Trial {t.name} {t.status}." for t in trajectories if t.status != "done"]
    shared = {note for t in trajectories for note in t.provenance.get("notes", []) if note.startswith("Ballasted")}
    moved = [note.replace("for this trial", "for its manoeuvring trials") for note in sorted(shared)]
    return (*early, *moved)


def _first(trajectories: Sequence[Trajectory], kind: str) -> Trajectory | None:
    return next((t for t in trajectories if t.kind == kind), None)


def _row(name: str, open_: Trajectory | None, key: str, closed: Trajectory, other: str, unit: str) -> Comparison:
    left = open_.indices.get(key, (math.nan, unit))[0] if open_ else math.nan
    right = closed.indices.get(other, (math.nan, unit))[0]
    return Comparison(name, left, right, unit, f"{open_.name if open_ else 'no open-loop trial'} against {closed.name}")
