"""The verdict in words: short paragraphs, each number with its level and what limits it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.table import Comparison, Requirement, Verdict


def sentences(v: Verdict) -> str:
    """Paragraphs of the verdict, parted by empty lines."""
    paragraphs = [
        _straight(v),
        _vertical(v),
        _level(v),
        _pilot(v.requirements, v.comparison),
        _asked(v),
        _limits(v),
    ]
    return "\n\n".join(p for p in paragraphs if p)


def _sure(probability: float, drawn: str) -> str:
    if probability > 0.995 or probability < 0.005:
        return f"This holds for practically all of {drawn}"
    return f"The probability of being stable is {100.0 * probability:.0f} % ({drawn})"


def _mode(c: PlaneCriteria) -> str:
    if not np.isfinite(c.doubling):
        return "is neutral"
    return f"doubles in {c.doubling:.0f} s" if c.doubling > 0.0 else f"halves in {-c.doubling:.0f} s"


def _index(c: PlaneCriteria) -> str:
    low, high = c.index_range
    band = f", 90 % between {low:.2f} and {high:.2f}" if high > low else ""
    wide = ""
    if c.slopes == "origin":
        has = np.isfinite(c.index_wide)
        wide = (
            f"; {c.index_wide:.2f} on the wide fit" if has else "; none on the wide fit, whose linear terms do not damp"
        )
    where = "on slopes at the origin" if c.slopes == "origin" else "on the wide fit"
    return f"{c.index:.2f} {where}{band}{wide}"


def _straight(v: Verdict) -> str:
    c = v.horizontal
    word = "directionally stable" if c.stable else "directionally unstable"
    held = "it settles on a new straight course" if c.stable else "it does not hold a straight course by itself"
    return (
        f"With fixed fins at {v.speed:g} m/s {v.craft} is {word}: after a disturbance {held}, and the least damped "
        f"motion {_mode(c)}. The index G_h is {_index(c)}. {_sure(c.probability, v.drawn)}."
    )


def _vertical(v: Verdict) -> str:
    c = v.vertical
    word = "stable" if c.stable else "unstable"
    text = (
        f"In the vertical plane, with its righting moment, it is {word} at this speed; the least damped motion "
        f"{_mode(c)}. The index G_v, which leaves the righting moment out, is {_index(c)}. "
        f"{_sure(c.probability, v.drawn)}."
    )
    limit = next((x for x in v.criteria if x.name == "critical_speed"), None)
    if limit and c.stable and np.isfinite(limit.value):
        text += f" Above {limit.value:.2f} m/s it is unstable, one drawn craft in twenty above {limit.low:.2f} m/s."
    reversal = v.elevator_reversal_speed
    if reversal is None:
        return text
    ratio = v.speed / reversal
    if ratio < 1.0:
        tail = "so the elevator acts reversed on depth at this speed; fly faster, or reduce the righting moment"
    elif ratio < 1.3:
        less = 100.0 * (1.0 - 1.0 / ratio)
        tail = f"only {less:.0f} % below this speed; a turn that slows the craft can cost depth control"
    else:
        tail = "well below this speed"
    return f"{text} The elevator reverses its effect on depth below {reversal:.2f} m/s, {tail}."


def _level(v: Verdict) -> str:
    need = next((r for r in v.requirements if r.name == "level flight"), None)
    return "" if need is None or need.met else f"As loaded the craft cannot keep depth: {need.note}."


def _pilot(requirements: Sequence[Requirement], comparison: Sequence[Comparison]) -> str:
    need = next((r for r in requirements if r.name == "pilot stable"), None)
    if need is None:
        return ""
    if not need.met:
        return f"No autopilot from this model: {need.note}."
    rows = {row.quantity: row for row in comparison}
    parts = ["An autopilot designed from this model stabilises heading, depth and roll"]
    course = rows.get("course held")
    if course is not None:
        parts.append(
            f"it ends a heading step within {abs(course.closed):.1f} deg, where the craft left to itself wandered off "
            f"by {abs(course.open):.0f} deg"
        )
    over = rows.get("overshoot")
    if over is not None and np.isfinite(over.open):
        parts.append(f"overshoot falls from {over.open:.0f} deg in the open-loop zigzag to {over.closed:.1f} deg")
    elif over is not None:
        parts.append(f"its heading overshoot is {over.closed:.1f} deg; the open-loop zigzag could not be completed")
    cost = rows.get("fin effort")
    if cost is not None:
        parts.append(f"it costs {cost.closed:.1f} deg rms of fin angle on the mission")
    travel = rows.get("fin travel")
    if travel is not None:
        parts.append(f"the fins travel {travel.closed:.2f} deg per metre")
    return "; ".join(parts) + "."


def _asked(v: Verdict) -> str:
    """How many requirements are met, which are not, and what decides them."""
    asked = [r for r in v.requirements if r.sense]
    if not asked:
        return ""
    missed = [r for r in asked if not r.met]
    text = f"Of {len(asked)} requirements {len(asked) - len(missed) or 'none'} " + (
        "are met." if len(asked) - len(missed) != 1 else "is met."
    )
    if missed:
        text += f" Not met: {'; '.join(_missed(r) for r in missed)}."
    if np.isfinite(v.together):
        text += f" All that are put to single craft are met together with a probability of {100.0 * v.together:.0f} %."
    return text


def _missed(r: Requirement) -> str:
    if not np.isfinite(r.value):
        return f"{r.name}, which has no number here"
    value = f"{r.value:.3g} {r.unit}".strip()
    bar = (
        ""
        if r.wanted is None
        else f" with a probability of {100.0 * r.wanted:.0f} %, and has {_percent(r.probability)}"
    )
    driver = f", driven by {r.drivers[0].coefficient}" if r.drivers else ""
    return f"{r.name} ({value}, {r.sense} {r.limit:.3g}{bar}{driver})"


def _percent(probability: float) -> str:
    return f"{100.0 * probability:.0f} %" if np.isfinite(probability) else "none"


def _limits(v: Verdict) -> str:
    text = f"Level of these claims: {v.level}."
    if v.dominant:
        text += f" The derivatives that decide the horizontal index most are {_listed(v.dominant)}."
    if v.level == "semi-empirical":
        text += " Tests in a viscous-flow code or a physical tank at these conditions would narrow them."
    if v.notes:
        text += " " + " ".join(v.notes)
    return text


def _listed(dominant: Sequence[tuple[str, float]]) -> str:
    return " and ".join(f"{name} ({100.0 * share:.0f} % of its spread)" for name, share in dominant)
