"""Straight lines flown one after the other under line-of-sight guidance: what a lawnmower and a mission share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Ended, Gauge, Leg, Stat, Until
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.guidance import Point, line
from towtank.trials.ready import SPEED, Readings, last
from towtank.trials.start import Setting, fin_limit
from towtank.trials.steady import turning_diameter

LOOKAHEAD = 2.5
"""Distance ahead at which the craft aims for the leg, in distances travelled in the time of the heading loop, 1/heading
gain; not below 3 lengths. The guidance must be slower than the heading loop it stands on."""
DRIFT = 3.0
"""Multiple of the lookahead in which the guidance takes out the drift of a cross current."""
WIDEST = 12.0
"""Turning diameter, in lengths, beyond which a pattern is not widened any more."""
RUDDER_SHARE = 0.6
"""Share of the rudder range that the turns between lines are planned with."""
PATIENCE = 3.0
"""A line is given up after this multiple of the time it should take. Coming onto a line may use all of it; the rest of
the line has its own share beside that."""
SETTLED = 0.5
"""Share of a line after which the craft should have come onto it."""
LEFT = 1.0
"""Least length of a line, in craft lengths, that the turn at its end leaves over."""

ACROSS, DEEP, AHEAD = Gauge("across", absolute=True), Gauge("z"), Gauge("ahead")
GAUGES = (ACROSS, DEEP, AHEAD)
"""Gauges that ``off_track`` and ``thrust_energy`` read."""


@dataclass(frozen=True)
class Line:
    """A line to fly: from ``start`` to ``end`` at ``depth`` [m] and ``speed`` [m/s] through the water.

    early [m] : distance before the end at which the next line takes over.   split : the part in which the craft comes
    onto the line is a leg of its own.
    """

    start: Point
    end: Point
    depth: float
    speed: float
    early: float
    split: bool

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return math.dist(self.start, self.end)

    @property
    def course(self) -> float:
        """[rad]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


@dataclass(frozen=True)
class Piece:
    """A leg of the run on line ``number``, counted from one.

    settled : on a line that is split, and beyond the part in which the craft comes onto it.
    """

    leg: Leg
    line: Line
    number: int
    settled: bool


def turn_diameter(model: Model, speed: float) -> float:
    """Diameter [m] that the turns between lines are planned with, at most ``WIDEST`` lengths."""
    return min(turning_diameter(model, speed, RUDDER_SHARE * fin_limit(model)), WIDEST * model.craft.length)


def flown(s: Setting, lines: Sequence[Line], length: float, current: tuple[float, float, float]) -> tuple[Piece, ...]:
    """``lines`` as legs for a craft of ``length`` [m]; the throttle makes the speed of each line.

    Source     Resistance and thrust grow with the square of speed: throttle = (speed of the line / approach speed)^2.
    """
    pieces = []
    for i, item in enumerate(lines, start=1):
        ahead = _lookahead(s, item.speed, length)
        crab = math.asin((current[1] * math.cos(item.course) - current[0] * math.sin(item.course)) / item.speed)
        entries = line(item.start, item.end, ahead, item.speed / (DRIFT * ahead), crab)
        orders = s.orders(dive=1.0, depth=item.depth, throttle=(item.speed / s.speed) ** 2, **entries)
        within = PATIENCE * item.length / max(item.speed - math.hypot(current[0], current[1]), 0.2 * item.speed)
        if item.split:
            half = Until("along", SETTLED * item.length)
            pieces.append(Piece(Leg(f"leg {i} coming on", orders, within, half, required=True), item, i, False))
            within *= 1.0 - SETTLED
        end = Until("along", item.length - item.early)
        pieces.append(Piece(Leg(f"leg {i}", orders, within, end, required=True), item, i, item.split))
    return tuple(pieces)


def _lookahead(s: Setting, speed: float, length: float) -> float:
    gain = s.pilot.heading if s.pilot else 0.0
    return max(3.0 * length, LOOKAHEAD * speed / gain) if gain > 0.0 else 3.0 * length


def lost(flights: Flights, pieces: Sequence[Piece]) -> str | None:
    """Why one craft did not complete its lines; None where it did."""
    if flights.ended[0] != Ended.LATE:
        return None
    piece = pieces[int(np.count_nonzero(~np.isnan(flights.mark_time[0]))) - 1]
    short = piece.line.length - piece.line.early - float(last(flights, "along")[0])
    off = float(last(flights, "across")[0])
    return (
        f"ended early: leg {piece.number} was not completed in {PATIENCE:g} times the time it should take; the craft "
        f"does not hold the track. It stood {short:.3g} m short and {abs(off):.3g} m to "
        f"{'starboard' if off > 0.0 else 'port'} of the line"
    )


def off_track(flights: Flights, pieces: Sequence[Piece]) -> Readings:
    """Distances off the lines [m], error of depth [m], distance run [m].

    Sums over the legs that were ended, in time or not; NaN where there was none.
    """
    lasting = np.diff(flights.mark_time, axis=1, prepend=0.0)
    settled = np.array([piece.settled for piece in pieces])
    whole = np.array([piece.line.split for piece in pieces])
    depth = np.array([piece.line.depth for piece in pieces])

    def over(gauge: Gauge, stat: Stat) -> Array:
        return flights.stats[:, :, flights.gauges.index(gauge), stat]

    deep = over(DEEP, Stat.SQUARE) - 2.0 * depth * over(DEEP, Stat.INTEGRAL) + depth * depth * lasting
    farthest = np.fmax(over(DEEP, Stat.HIGH) - depth, depth - over(DEEP, Stat.LOW))
    return {
        "off_track_rms": (_rms(over(ACROSS, Stat.SQUARE), lasting, settled), "m"),
        "off_track_largest": (_largest(over(ACROSS, Stat.HIGH), settled), "m"),
        "off_track_rms_whole": (_rms(over(ACROSS, Stat.SQUARE), lasting, whole), "m"),
        "depth_error_rms": (_rms(deep, lasting, settled), "m"),
        "depth_error_largest": (_largest(farthest, settled), "m"),
        "distance": (flights.over(SPEED, Stat.INTEGRAL), "m"),
    }


def thrust_energy(flights: Flights, thrust: float) -> Array:
    """Work of the thrust (N,) [J]: of each leg's throttle times ``thrust`` [N] over its way through the water.

    Valid      Constant thrust; with a propeller's table, while the craft keeps near the speed ordered.
    """
    ways = flights.stats[:, :, flights.gauges.index(AHEAD), Stat.INTEGRAL]
    forces = thrust * np.array([leg.orders.throttle for leg in flights.legs])
    return np.where(np.isnan(ways).all(axis=1), np.nan, np.nansum(ways * forces, axis=1))


def _largest(values: Array, legs: Array) -> Array:
    return np.asarray(np.fmax.reduce(values[:, legs], axis=1, initial=np.nan))


def _rms(squares: Array, lasting: Array, legs: Array) -> Array:
    """Root of the mean over time of what has the integrals ``squares`` (N, L), over ``legs`` (L,)."""
    time = np.nansum(lasting[:, legs], axis=1)
    with np.errstate(all="ignore"):
        mean = np.nansum(squares[:, legs], axis=1) / time
    return np.sqrt(np.maximum(np.where(time > 0.0, mean, np.nan), 0.0))
