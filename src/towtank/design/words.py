"""What a design study says, in sentences and rows."""

from __future__ import annotations

import math

from towtank.design.cruise import KILOWATT_HOUR, Cruise
from towtank.design.study import DesignStudy, Point

ROWS = (
    ("P(stable) horizontal", "P_stable_h", "", 1.0),
    ("P(stable) vertical", "P_stable_v", "", 1.0),
    ("G_h", "G_h", "", 1.0),
    ("G_v", "G_v", "", 1.0),
    ("tactical diameter", "turning_circle.tactical_diameter_lengths", "L", 1.0),
    ("first overshoot, zigzag", "zigzag.first_overshoot", "deg", 1.0),
    ("elevator reversal speed", "elevator_reversal_speed", "m/s", 1.0),
    ("drag", "drag", "N", 1.0),
    ("of it fins", "drag_fins", "N", 1.0),
    ("of it strakes", "drag_strakes", "N", 1.0),
    ("energy per metre", "energy_per_metre", "J/m", 1.0),
    ("reach from the axis", "reach", "m", 1.0),
)
"""Rows of the comparison: words, column, unit, factor."""


def candidates(study: DesignStudy) -> list[tuple[str, Point]]:
    """The craft as given, each change alone that meets the goals, and the best, with their words."""
    out = [("as given", study.base)]
    out += [(f"{name} alone", point) for name, point in study.alone.items() if point is not None]
    if study.best is not None:
        out.append(("best", study.best))
    return out


def verdict(study: DesignStudy) -> list[str]:
    """Paragraphs: the craft as given, the best change, what one change alone does, what the numbers rest on."""
    base = study.base.values
    unstable = [words for letter, words in (("h", "horizontal"), ("v", "vertical")) if base[f"growth_{letter}"] >= 0.0]
    state = f"unstable in the {' and the '.join(unstable)} plane" if unstable else "stable in both planes"
    first = (
        f"At {study.speed:g} m/s with fixed fins {study.craft} as given is {state}: P(stable) is "
        f"{base['P_stable_h']:.2f} in the horizontal and {base['P_stable_v']:.2f} in the vertical plane. Asked for: "
        f"{'; '.join(goal.words() for goal in study.goals)}."
    )
    return [first, _best(study), _alone(study), _basis(study)]


def _best(study: DesignStudy) -> str:
    if study.best is None:
        near = study.nearest
        return (
            f"No variant within the ranges meets all of it. The nearest has {near.words(study.axes)}: P(stable) "
            f"{near.values['P_stable_h']:.2f} and {near.values['P_stable_v']:.2f}, drag "
            f"{percent(study.drag_rise(near))}. Widen the ranges, or give other axes."
        )
    if not study.best.changes:
        return "The craft as given meets it with the least drag."
    values = study.best.values
    return (
        f"The least drag that meets it: {study.best.words(study.axes)}. P(stable) is then {values['P_stable_h']:.3f} "
        f"and {values['P_stable_v']:.3f}; it costs {percent(study.drag_rise(study.best))} of drag and "
        f"{percent(study.range_change(study.best))} of range at this speed on the same energy.{_at_bounds(study)}"
    )


def _at_bounds(study: DesignStudy) -> str:
    """Axes whose bound stops the search."""
    assert study.best is not None
    held = [
        f"{axis.name} ({'lower' if value <= min(axis.values) else 'upper'})"
        for axis in study.axes
        for name, value in study.best.changes
        if name == axis.name and not min(axis.values) < value < max(axis.values)
    ]
    return f" It lies at a bound of {', '.join(held)}: a wider range may cost less." if held else ""


def _alone(study: DesignStudy) -> str:
    able = [
        f"{point.words(study.axes)}: drag {percent(study.drag_rise(point))}"
        for point in study.alone.values()
        if point is not None and point.changes
    ]
    unable = [name for name, point in study.alone.items() if point is None]
    words = [f"One change alone: {'; '.join(able)}."] if able else []
    if unable:
        words.append(f"Not by {' or '.join(unable)} alone within the range.")
    return " ".join(words)


def _basis(study: DesignStudy) -> str:
    assumed = study.provenance.get("assumed", [])
    geometry = " The geometry it starts from is partly assumed." if assumed else ""
    return (
        f"Level: {study.level}. Probabilities are shares of 2000 sampled sets of derivatives (+-0.005 near "
        f"{study.target:g} by the sampling). The variants displace what the craft as given does; ballast keeps the CG "
        f"over the centre of buoyancy. Efficiency {study.drive['overall']:.2f}, {study.drive['origin']}; hotel power "
        f"{study.hotel:g} W.{geometry}"
    )


def percent(share: float) -> str:
    """A change as it is printed."""
    return "no number" if math.isnan(share) else f"{100.0 * share:+.1f} %"


def cruise_words(it: Cruise) -> list[str]:
    """What the cruise study says, in sentences."""
    least = it.best_neutral
    way = "still water" if it.current == 0.0 else f"a current of {abs(it.current):g} m/s {_sense(it.current)} the craft"
    first = (
        f"Least energy per metre with {it.hotel:g} W of hotel power in {way}: ballasted to neutral {it.craft} flies "
        f"{least.speed:.3g} m/s on {least.energy:.4g} J/m, {1e-3 * KILOWATT_HOUR / least.energy:.3g} km per kWh. "
        f"In still water the closed form for a neutral craft is {it.closed:.3g} m/s."
    )
    if abs(it.residual) < 1.0:
        return [first]
    heavy = f"{abs(it.residual):.4g} N {'heavy' if it.residual > 0.0 else 'light'}"
    if it.best is None:
        return [first, f"As loaded it is {heavy}, and at no speed looked at can it carry that level."]
    ratio = it.best.energy / least.energy
    return [
        first,
        f"As loaded it is {heavy}. Carrying that by pitch and elevator, its best speed is {it.best.speed:.3g} m/s at "
        f"{math.degrees(it.best.pitch):.1f} deg of pitch and {math.degrees(it.best.elevator):.1f} deg of elevator, "
        f"on {it.best.energy:.4g} J/m: {ratio:.2f} times as much; {it.best.induced:.3g} N of its "
        f"{it.best.thrust:.3g} N of thrust are the price of the lift.",
    ]


def _sense(current: float) -> str:
    return "with" if current > 0.0 else "against"
