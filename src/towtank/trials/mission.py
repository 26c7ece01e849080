"""Lawnmower: parallel legs at constant depth, the survey pattern of an AUV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from towtank.errors import InputError
from towtank.model.equations import STILL, Model
from towtank.pilot.guidance import Point
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.lines import GAUGES, LEFT, SETTLED, Line, flown, lost, off_track, turn_diameter
from towtank.trials.ready import Ready, run_trial
from towtank.trials.start import setting, span
from towtank.trials.steps import adrift, drifting
from towtank.trials.trajectory import Trajectory


def lawnmower(
    model: Model,
    legs: int = 4,
    leg_length: Quantity | None = None,
    spacing: Quantity | None = None,
    depth: Quantity = 0.0,
    speed: Quantity | None = None,
    *,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
) -> Trajectory:
    """Long legs north and south, joined by short legs to the east, under line-of-sight guidance and the pilot.

    The craft knows the current, as one with a bottom-tracking log does, and heads into it from the start of a leg.

    Parameters
    ----------
    legs : number of long legs.   leg_length, spacing : [m] or text, ``"5 L"`` counts craft lengths; when not given, 25
        and 10 craft lengths or 3 and 1.5 turning diameters, whichever is more.
    depth : below the start, [m] or text.   speed : through the water.   current : (3,) [m/s, NED].

    Indices: rms and largest distance off the long legs after the craft has come onto them (half a leg, and to the end)
    [m], rms over all of the long legs [m], rms and largest depth error where the craft has come on [m], distance [m],
    effort of the fins.

    Raises
    ------
    InputError
        No legs, or the turns would take up the legs. A turn begins half its diameter before a corner (2 craft lengths
        at the least); the spacing is at least one length more, and 4 lengths; a leg is twice that, and 8 lengths.
    """
    return run_trial(model, lawnmower_ready(model, legs, leg_length, spacing, depth, speed, pilot, current))


def lawnmower_ready(
    model: Model,
    legs: int = 4,
    leg_length: Quantity | None = None,
    spacing: Quantity | None = None,
    depth: Quantity = 0.0,
    speed: Quantity | None = None,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
) -> Ready:
    """The lawnmower, ready to fly; arguments as in ``lawnmower``."""
    length = model.craft.length
    s = setting(model, speed, pilot)
    early = max(2.0 * length, 0.5 * (diameter := turn_diameter(model, s.speed)))
    long_ = max(25.0 * length, 3.0 * diameter) if leg_length is None else span(leg_length, length, "leg_length")
    short = max(10.0 * length, 1.5 * diameter) if spacing is None else span(spacing, length, "spacing")
    _room(legs, long_, short, length, early)
    below, start = span(depth, length, "depth"), adrift(s, current)
    corners = _corners(legs, long_, short)
    lines = [Line(a, b, below, s.speed, early, i % 2 == 0) for i, (a, b) in enumerate(pairwise(corners))]
    pieces = flown(s, lines, length, drifting(current))
    return Ready(
        name="lawnmower", kind="lawnmower", loop="closed", setting=s, legs=tuple(piece.leg for piece in pieces),
        interval=s.convective / 8.0, gauges=GAUGES, start=start, current=drifting(current),
        read=lambda flights: off_track(flights, pieces), status=lambda flights: lost(flights, pieces),
        curves=lambda _: {"track": {"north": [p[0] for p in corners], "east": [p[1] for p in corners]}},
    )  # fmt: skip


def _room(legs: int, long_: float, short: float, length: float, early: float) -> None:
    """Refuse lines [m] that a craft of ``length`` [m] cannot fly when it turns ``early`` [m] before their ends.

    ``LEFT`` lengths of a short line are left before the next turn begins, or the craft would have to come back to end
    it; as much of a long one beyond the part in which the craft comes onto it, since the indices are of that rest. A
    single leg has no spacing.

    Raises
    ------
    InputError
        Too short, or no legs; the least of each for this craft is named.
    """
    need = early + LEFT * length
    least_long, least_short = max(8.0 * length, need / (1.0 - SETTLED)), max(4.0 * length, need)
    slack = 1.0 - 1e-9
    if legs < 1 or long_ < least_long * slack or (legs > 1 and short < least_short * slack):
        raise InputError(
            f"lawnmower of {legs} legs, {long_:.4g} m long, {short:.4g} m apart: this craft needs at least one leg, "
            f"legs of {_upwards(least_long)} m and a spacing of {_upwards(least_short)} m, or the turns take up the "
            f"legs: they begin {early:.3g} m before a corner. Give longer legs or a wider spacing."
        )


def _upwards(value: float) -> str:
    """``value`` rounded up to four digits, so that what is printed suffices."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    return f"{math.ceil(value / unit - 1e-6) * unit:.4g}"


def _corners(legs: int, long_: float, short: float) -> list[Point]:
    """Ends of the long and short lines in order."""
    corners = [(0.0, 0.0)]
    for i in range(legs):
        north, east = corners[-1]
        corners.append((north + (long_ if i % 2 == 0 else -long_), east))
        if i < legs - 1:
            corners.append((corners[-1][0], east + short))
    return corners
