"""Blocks of the verdict: requirements with what drives them, closed-form criteria, use of the fins."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from towtank.figures import requirements as figures
from towtank.report.blocks import Block, Table, number, stated
from towtank.report.pictures import Sketchbook

if TYPE_CHECKING:
    from towtank.verdict.table import Requirement, Verdict


def asked(it: Verdict, book: Sketchbook) -> list[Block]:
    """What is asked of the craft: limits, margins, probabilities, drivers; then the checks that are no limits."""
    rows = [r for r in it.requirements if r.sense]
    checks = [r for r in it.requirements if not r.sense]
    blocks: list[Block] = []
    if rows:
        blocks.append(_limits(it, rows))
        words = "Requirements over the drawn craft. Green is met by the best estimate or by the share asked for."
        if any(math.isfinite(r.probability) for r in rows):
            blocks.append(book.draw(figures.chances, rows, it.level, it.drawn, caption=words))
            words = "Margins of the best estimate to the limits. Beside each bar, the coefficient that moves it most."
            blocks.append(book.draw(figures.margins, rows, it.level, it.drawn, caption=words))
        blocks.append(_sources(it, rows))
    if checks:
        blocks.append(_checks(it, checks))
    return blocks


def _limits(it: Verdict, rows: list[Requirement]) -> Table:
    cells = tuple(
        (
            r.name, number(r.value), f"{r.sense} {number(r.limit)}", r.unit, number(r.margin),
            number(r.margin_in_std, 2), _percent(r.probability) + (f" of {_percent(r.wanted)}" if r.wanted else ""),
            "met" if r.met else "not met", _drivers(r),
        )
        for r in rows
    )  # fmt: skip
    head = ("Requirement", "Best", "Limit", "Unit", "Margin", "in std", "Met by", "Result", "Driven by, for 1 % more")
    together = (
        f". All that are put to single craft are met together by {_percent(it.together)}"
        if math.isfinite(it.together) else ""
    )  # fmt: skip
    more = (
        f"Met by: share of {it.drawn}; those without the number count as not meeting it{together}. Driven by: change "
        "of the number for a coefficient 1 % larger in size, each moved alone by a standard uncertainty, or by 5 %"
    )
    return Table("Requirements", head, cells, stated(it.level, "std over the drawn craft", more=more))


def _drivers(r: Requirement) -> str:
    return ", ".join(f"{d.coefficient} {number(d.per_percent, 2)}" for d in r.drivers) or "-"


def _sources(it: Verdict, rows: list[Requirement]) -> Table:
    cells = tuple(
        (r.name, r.source or "not stated", "chosen" if r.assumed else "as in the source", r.note or "-") for r in rows
    )
    head = ("Requirement", "Source of the limit", "Limit", "Remark")
    return Table("Where the limits come from", head, cells, stated(it.level, "in the remark, where it was found"))


def _checks(it: Verdict, rows: list[Requirement]) -> Table:
    cells = tuple(
        (r.name, number(r.value), number(r.limit), r.unit, "met" if r.met else "not met", r.note or "-") for r in rows
    )
    head = ("Check", "Value", "Limit", "Unit", "Result", "Remark")
    return Table("Checks", head, cells, stated(it.level, "none stated; nominal model"))


def criteria(it: Verdict) -> list[Block]:
    """Closed-form numbers with their intervals; none in a verdict without them."""
    if not it.criteria:
        return []
    rows = tuple((c.words, _limit(c.value), f"{_limit(c.low)} to {_limit(c.high)}", c.unit) for c in it.criteria)
    more = (
        f"{it.drawn}. none: there is no such speed. The loop is that of steady turns without roll and pitch, on the "
        "wide fit. Periods are those of a craft at rest without damping; incidence against righting moment is a static "
        "balance, stability with the plane free to heave is the line below it"
    )
    head = ("Criterion", "Best", "5 to 95 %", "Unit")
    return [Table("Closed-form criteria", head, rows, stated(it.level, "over the drawn craft", more=more))]


def _limit(value: float) -> str:
    return "none" if math.isinf(value) else number(value, 3)


def fins(it: Verdict) -> list[Block]:
    """Range, reserve, travel and drag of the fins in every trial."""
    if not it.fins:
        return []
    rows = tuple(
        (
            use.trial, use.loop,
            *(number(x, 3) for x in (use.use, use.settled, use.saturated, use.aileron, use.travel)),
            *(number(x, 3) for x in (use.drag, use.share, use.power, use.roll)),
        )
        for use in it.fins
    )  # fmt: skip
    head = (
        "Trial", "Loop", "Range used [%]", "settled [%]", "At a limit [% of time]", "Left for roll [deg]",
        "Travel [deg/m]", "Drag [N]", "of the hull's [%]", "Power [W]",
        "Largest roll [deg]",
    )  # fmt: skip
    more = (
        "Range used: largest share of its limit that a fin reaches; settled and left for roll: mean of the last "
        "quarter of the trial. Drag: surge force of the deflected fins in the model, mean over the trial, which is "
        "also the energy for each metre [J/m]; its power is that drag times the speed. Work of the servos against "
        "hinge moments is not modelled; the travel stands for it"
    )
    return [Table("What the fins are asked for", head, rows, stated(it.level, "none stated; nominal model", more=more))]


def _percent(share: float | None) -> str:
    return f"{100.0 * share:.0f} %" if share is not None and math.isfinite(share) else "-"
