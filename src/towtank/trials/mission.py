"""Lawnmower: parallel legs at constant depth, the survey pattern of an AUV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Ended, Gauge, Leg, Stat, Until
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.guidance import Point, line
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity, si
from towtank.trials.ready import SPEED, Readings, Ready, run_trial
from towtank.trials.start import Setting, fin_limit, setting
from towtank.trials.steady import turning_diameter
from towtank.trials.steps import adrift, drifting
from towtank.trials.trajectory import Trajectory

LOOKAHEAD = 2.5
"""Distance ahead at which the craft aims for the leg, in distances travelled in the time of the heading loop, 1/heading
gain; not below 3 lengths. The guidance must be slower than the heading loop it stands on."""
DRIFT = 3.0
"""Multiple of the lookahead in which the guidance takes out the drift of a cross current."""
WIDEST = 12.0
"""Turning diameter, in lengths, beyond which the pattern is not widened any more."""
RUDDER_SHARE = 0.6
"""Share of the rudder range that the turns between legs are planned with."""
PATIENCE = 3.0
"""A leg is given up after this multiple of the time it should take. Coming onto a long leg may use all of it; the
rest of the leg has its own share beside that."""
SETTLED = 0.5
"""Share of a long leg after which the craft should have come onto it."""
LEFT = 1.0
"""Least length of a line, in craft lengths, that the turn at its end leaves over."""

_ACROSS, _DEEP = Gauge("across", absolute=True), Gauge("z")


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
    legs : number of long legs.   leg_length, spacing : [m] or text; when not given, 25 and 10 craft lengths or 3
        and 1.5 turning diameters, whichever is more.
    depth : below the start, [m] or text.   speed : through the water.   current : (3,) [m/s, NED].

    Indices: rms and largest distance off the long legs after the craft has come onto them (half a leg, and to the end)
    [m], rms over all of the long legs [m], rms depth error where the craft has come on [m], distance [m], effort of the
    fins.

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
    diameter = min(turning_diameter(model, s.speed, RUDDER_SHARE * fin_limit(model)), WIDEST * length)
    early = max(2.0 * length, 0.5 * diameter)
    long_ = max(25.0 * length, 3.0 * diameter) if leg_length is None else si(leg_length, "m", "leg_length")
    short = max(10.0 * length, 1.5 * diameter) if spacing is None else si(spacing, "m", "spacing")
    _room(legs, long_, short, length, early)
    below, start = si(depth, "m", "depth"), adrift(s, current)
    corners = _corners(legs, long_, short)
    pieces = _pieces(s, corners, below, early, _lookahead(s, length), drifting(current))
    return Ready(
        name="lawnmower", kind="lawnmower", loop="closed", setting=s, legs=tuple(piece.leg for piece in pieces),
        interval=s.convective / 8.0, gauges=(_ACROSS, _DEEP), start=start, current=drifting(current),
        read=lambda flights: _indices(flights, pieces, below), status=lambda flights: _status(flights, pieces),
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


@dataclass(frozen=True)
class _Piece:
    """A leg of the run: ``line`` [-] counts the lines of the pattern from one; the long ones are odd.

    settled : on a long line, and beyond the part in which the craft comes onto it.
    """

    leg: Leg
    line: int
    settled: bool

    @property
    def long(self) -> bool:
        """On a long line."""
        return self.line % 2 == 1


def _lookahead(s: Setting, length: float) -> float:
    gain = s.pilot.heading if s.pilot else 0.0
    return max(3.0 * length, LOOKAHEAD * s.speed / gain) if gain > 0.0 else 3.0 * length


def _corners(legs: int, long_: float, short: float) -> list[Point]:
    """Ends of the long and short lines in order."""
    corners = [(0.0, 0.0)]
    for i in range(legs):
        north, east = corners[-1]
        corners.append((north + (long_ if i % 2 == 0 else -long_), east))
        if i < legs - 1:
            corners.append((corners[-1][0], east + short))
    return corners


def _pieces(
    s: Setting,
    corners: Sequence[Point],
    depth: float,
    early: float,
    lookahead: float,
    current: tuple[float, float, float],
) -> tuple[_Piece, ...]:
    """The lines as legs. One ends ``early`` [m] before its corner, so that the turn ends on the next line."""
    pieces = []
    for i, (a, b) in enumerate(pairwise(corners), start=1):
        length, course = math.dist(a, b), math.atan2(b[1] - a[1], b[0] - a[0])
        crab = math.asin((current[1] * math.cos(course) - current[0] * math.sin(course)) / s.speed)
        entries = line(a, b, lookahead, s.speed / (DRIFT * lookahead), crab)
        orders = s.orders(dive=1.0, depth=depth, **entries)
        expected = length / max(s.speed - math.hypot(current[0], current[1]), 0.2 * s.speed)
        level, half = length - early, SETTLED * length
        split = i % 2 == 1
        if split:
            onto = Leg(f"leg {i} coming on", orders, PATIENCE * expected, Until("along", half), required=True)
            pieces.append(_Piece(onto, i, False))
        within = (1.0 - SETTLED if split else 1.0) * PATIENCE * expected
        pieces.append(_Piece(Leg(f"leg {i}", orders, within, Until("along", level), required=True), i, split))
    return tuple(pieces)


def _status(flights: Flights, pieces: Sequence[_Piece]) -> str | None:
    if flights.ended[0] != Ended.LATE:
        return None
    lost = pieces[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1].line
    return (
        f"ended early: leg {lost} was not completed in {PATIENCE:g} times the time it should take; the craft does not "
        "hold the track"
    )


def _indices(flights: Flights, pieces: Sequence[_Piece], depth: float) -> Readings:
    """Sums over the legs that were ended, in time or not; NaN where there was none."""
    lasting = np.diff(flights.mark_time, axis=1, prepend=0.0)
    settled = np.array([piece.settled for piece in pieces])
    long_ = np.array([piece.long for piece in pieces])

    def over(gauge: Gauge, stat: Stat) -> Array:
        return flights.stats[:, :, flights.gauges.index(gauge), stat]

    deep = over(_DEEP, Stat.SQUARE) - 2.0 * depth * over(_DEEP, Stat.INTEGRAL) + depth * depth * lasting
    return {
        "off_track_rms": (_rms(over(_ACROSS, Stat.SQUARE), lasting, settled), "m"),
        "off_track_largest": (np.fmax.reduce(over(_ACROSS, Stat.HIGH)[:, settled], axis=1, initial=np.nan), "m"),
        "off_track_rms_whole": (_rms(over(_ACROSS, Stat.SQUARE), lasting, long_), "m"),
        "depth_error_rms": (_rms(deep, lasting, settled), "m"),
        "distance": (flights.over(SPEED, Stat.INTEGRAL), "m"),
    }


def _rms(squares: Array, lasting: Array, legs: Array) -> Array:
    """Root of the mean over time of what has the integrals ``squares`` (N, L), over ``legs`` (L,)."""
    time = np.nansum(lasting[:, legs], axis=1)
    with np.errstate(all="ignore"):
        mean = np.nansum(squares[:, legs], axis=1) / time
    return np.sqrt(np.maximum(np.where(time > 0.0, mean, np.nan), 0.0))
