"""Page section: the design study and the speed of least energy per metre."""

from __future__ import annotations

import math
from functools import partial

from towtank.design.cruise import KILOWATT_HOUR, Cruise, Flight
from towtank.design.study import DesignStudy
from towtank.design.words import ROWS, candidates, cruise_words, percent, verdict
from towtank.figures import design as figures
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study

TITLE = "Design study"
UNCERTAINTY = "P(stable) holds that of the derivatives; none is stated for the other numbers"


def design(study: Study, book: Sketchbook) -> Section:
    """The best change under the goals, what each change alone does, contours, the Pareto set; the cruise speed."""
    blocks: list[Block] = []
    if study.design is not None:
        blocks += _design(study.design, book)
    else:
        blocks.append(missing("No design study was given.", STAGES["design"]))
    if study.cruise is not None:
        blocks += _cruise(study.cruise, book)
    return Section("design", TITLE, tuple(blocks))


def _design(it: DesignStudy, book: Sketchbook) -> list[Block]:
    words = verdict(it)
    blocks: list[Block] = [Text(words[0]), Text(words[1], "good" if it.best else "bad")]
    blocks += [Text(part) for part in words[2:] if part]
    blocks.append(_candidates(it))
    calls = [partial(figures.design_pareto, it)]
    if len(it.axes) > 1:
        calls.append(partial(figures.design_contours, it, "P_stable_h"))
    blocks.append(book.panels(calls, "Stability against drag; P(stable) over the first two axes.", (2.3,), len(calls)))
    lines = [axis.name for axis in it.axes if len([p for _, p in it.line(axis.name) if not p.failed]) > 1]
    for i in range(0, len(lines), 2):
        pair = [partial(figures.design_line, it, name) for name in lines[i : i + 2]]
        blocks.append(book.panels(pair, "One change alone: what it buys and what it costs.", (2.1,), len(pair)))
    return [*blocks, _goals(it), _pareto(it), *_remarks(it)]


def _candidates(it: DesignStudy) -> Table:
    found = candidates(it)
    head = ("Quantity", *(words for words, _ in found), "Unit")
    rows = [("changes", *(point.words(it.axes) for _, point in found), "")]
    for words, column, unit, factor in ROWS:
        values = [point.values.get(column, math.nan) for _, point in found]
        if any(math.isfinite(value) for value in values):
            rows.append((words, *(number(factor * value) for value in values), unit))
    rows.append(("drag, change", *(percent(it.drag_rise(point)) for _, point in found), ""))
    rows.append(("range on the same energy, change", *(percent(it.range_change(point)) for _, point in found), ""))
    return Table("The craft as given and its changes", head, tuple(rows), stated(it.level, UNCERTAINTY, axes=False))


def _goals(it: DesignStudy) -> Table:
    point = it.nearest
    rows = tuple(
        (goal.words(), number(point.values.get(goal.column, math.nan)), "met" if goal.met(point.values) else "missed",
         goal.reason)
        for goal in it.goals
    )  # fmt: skip
    whose = "the best point" if it.best else "the nearest point"
    return Table("Goals", ("Goal", f"Value of {whose}", "", "Why"), rows, stated(it.level, UNCERTAINTY, axes=False))


def _pareto(it: DesignStudy, most: int = 12) -> Table:
    points = it.pareto
    kept = points if len(points) <= most else [points[round(i * (len(points) - 1) / (most - 1))] for i in range(most)]
    columns = ("P_stable_h", "P_stable_v", "G_h")
    rows = tuple((p.words(it.axes), percent(it.drag_rise(p)), *(number(p.values[c], 3) for c in columns)) for p in kept)
    head = ("Changes", "Drag", "P(stable) horizontal", "P(stable) vertical", "G_h")
    words = f"{len(points)} points that no other beats in drag and in P(stable)"
    more = f"{len(kept)} of them are listed" if len(kept) < len(points) else ""
    return Table("Pareto set", head, rows, stated(it.level, f"{words}; {UNCERTAINTY}", axes=False, more=more))


def _remarks(it: DesignStudy) -> list[Block]:
    named = dict.fromkeys(note for _, point in candidates(it) for note in point.notes)
    return [Text(f"Remark: {note}") for note in named]


def _cruise(it: Cruise, book: Sketchbook) -> list[Block]:
    blocks: list[Block] = [Text(words) for words in cruise_words(it)]
    blocks.append(book.draw(figures.cruise_energy, it, caption="Energy per metre over ground; dots: the least."))
    head = ("", "Speed [m/s]", "Over ground [m/s]", "Pitch [deg]", "Elevator [deg]", "Thrust [N]", "Of it for lift [N]",
            "Propulsion [W]", "Energy [J/m]", "Range per kWh [km]")  # fmt: skip
    flown = [(words, f) for words, f in (("as loaded", it.best), ("ballasted to neutral", it.best_neutral)) if f]
    rows = tuple((words, *_flight(f)) for words, f in flown)
    more = f"Efficiency {it.drive.overall:.2f}: {it.drive.origin}"
    blocks.append(
        Table("Speed of least energy per metre", head, rows, stated(it.level, _band(it), axes=False, more=more))
    )
    return blocks


def _band(it: Cruise) -> str:
    if not math.isfinite(it.energy_std):
        return "none stated"
    return (
        f"energy +-{100.0 * it.energy_std:.1f} % by the standard uncertainty of the resistance; none of the efficiency"
    )


def _flight(f: Flight) -> tuple[str, ...]:
    values = (f.speed, f.ground, math.degrees(f.pitch), math.degrees(f.elevator), f.thrust, f.induced, f.propulsion,
              f.energy, 1e-3 * KILOWATT_HOUR / f.energy)  # fmt: skip
    return tuple(number(value) for value in values)
