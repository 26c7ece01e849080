"""Waypoint mission: straight lines from point to point in a current, each at its depth and speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from towtank.engine.flights import Flights
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity, si
from towtank.trials.lines import (
    GAUGES,
    LEFT,
    SETTLED,
    Line,
    Piece,
    flown,
    lost,
    off_track,
    thrust_energy,
    turn_diameter,
)
from towtank.trials.ready import Readings, Ready, run_trial
from towtank.trials.start import Setting, level_trim, setting, span
from towtank.trials.steps import adrift, drifting
from towtank.trials.trajectory import Trajectory

SHARPEST = 1.5
"""Largest tan(half the change of course) for the distance at which a turn begins; a sharper one swings beyond."""
DEPTH_WITHIN = 0.5
"""Craft lengths off its depth within which a waypoint counts as passed."""
SLOWEST, FASTEST = 0.5, 2.0
"""Range of a leg's speed as a multiple of the mission's, for which the pilot is designed."""


@dataclass(frozen=True)
class Waypoint:
    """A point to pass. north, east, depth : from the start, [m] or text, ``"5 L"`` counts craft lengths.

    speed : on the way to it through the water, [m/s] or text; the mission's when not given.
    """

    north: Quantity
    east: Quantity
    depth: Quantity = 0.0
    speed: Quantity | None = None


def waypoint_mission(
    model: Model,
    waypoints: Sequence[Waypoint | Sequence[Quantity]],
    speed: Quantity | None = None,
    *,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    name: str = "waypoint-mission",
) -> Trajectory:
    """From the start, heading north at depth 0, along straight lines to each waypoint in turn.

    The craft knows the current and heads into it; the throttle makes the speed of each leg. A depth is ordered at the
    start of its leg. A turn begins before its waypoint, so that it ends on the next line.

    Parameters
    ----------
    waypoints : ``Waypoint`` or (north, east), (north, east, depth), (north, east, depth, speed).
    speed : of the start, and of legs that give none; the pilot is designed for it.   current : (3,) [m/s, NED].
    name : of the file.

    Indices: as the ``lawnmower``, and the largest error of depth where a waypoint is passed [m], mean speed over ground
    [m/s], work of the thrust [J] and by distance [J/m]. The status says which leg was not completed, or which waypoint
    was passed off its depth, and why.

    Raises
    ------
    InputError
        No waypoint, one that is no point; a leg too short for the turn at its end, steeper than the pilot dives, slower
        than the current, or at a speed the pilot is not designed for.
    """
    return run_trial(model, waypoint_mission_ready(model, waypoints, speed, pilot, current, name))


def waypoint_mission_ready(
    model: Model,
    waypoints: Sequence[Waypoint | Sequence[Quantity]],
    speed: Quantity | None = None,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    name: str = "waypoint-mission",
) -> Ready:
    """The mission, ready to fly; arguments as in ``waypoint_mission``."""
    s, length = setting(model, speed, pilot), model.craft.length
    points = [_point(i, item, length, s.speed) for i, item in enumerate(waypoints, start=1)]
    if not points:
        raise InputError("mission: no waypoint. Give at least one, north and east of the start.")
    start, water = adrift(s, current), drifting(current)
    lines = _lines(points, length, 0.5 * turn_diameter(model, s.speed))
    for i, (line, above) in enumerate(zip(lines, (0.0, *(line.depth for line in lines)), strict=False), start=1):
        _check(i, line, above, s, length, math.hypot(*water))
    pieces = flown(s, lines, length, water)
    weak = {line.speed: _weakness(model, s, line.speed) for line in lines}
    track = zip(*((0.0, 0.0, 0.0), *(point[:3] for point in points)), strict=True)
    curves = {"track": {word: list(values) for word, values in zip(("north", "east", "depth"), track, strict=True)}}
    return Ready(
        name=name, kind="waypoint mission", loop="closed", setting=s, legs=tuple(piece.leg for piece in pieces),
        interval=s.convective / 8.0, gauges=GAUGES, start=start, current=water,
        read=lambda flights: _indices(flights, pieces, s.thrust), curves=lambda _: curves,
        status=lambda flights: lost(flights, pieces) or _off_depth(flights, pieces, length, weak),
    )  # fmt: skip


def _point(i: int, item: Waypoint | Sequence[Quantity], length: float, speed: float) -> tuple[float, ...]:
    """North, east, depth [m] and speed [m/s] of waypoint ``i``."""
    if not isinstance(item, Waypoint):
        if isinstance(item, str) or not 2 <= len(item) <= 4:
            raise InputError(f"waypoint {i}: {item!r} is no point. Give north, east and, if need be, depth and speed.")
        item = Waypoint(*item)
    where = f"waypoint {i}"
    place = [span(getattr(item, word), length, f"{where}, {word}") for word in ("north", "east", "depth")]
    return (*place, speed if item.speed is None else si(item.speed, "m/s", f"{where}, speed"))


def _lines(points: Sequence[tuple[float, ...]], length: float, radius: float) -> list[Line]:
    """Lines from the start through ``points``; ``radius`` [m] of the turns.

    Source     A turn through an angle a of the given radius touches both lines radius tan(a / 2) from the corner.
    """
    corners = [(0.0, 0.0), *((point[0], point[1]) for point in points)]
    courses = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(corners)]
    lines = []
    for i, (a, b) in enumerate(pairwise(corners)):
        turn = math.remainder(courses[i + 1] - courses[i], math.tau) if i + 1 < len(courses) else 0.0
        early = max(2.0 * length, radius) * min(math.tan(0.5 * abs(turn)) if abs(turn) < 3.0 else SHARPEST, SHARPEST)
        settled = math.dist(a, b) * (1.0 - SETTLED) >= early + LEFT * length
        lines.append(Line(a, b, points[i][2], points[i][3], early, settled))
    return lines


def _check(i: int, line: Line, above: float, s: Setting, length: float, current: float) -> None:
    """Refuse a line that this craft cannot fly. ``above`` [m] : depth before it."""
    where = f"leg {i}"
    if not SLOWEST * s.speed <= line.speed <= FASTEST * s.speed:
        raise InputError(
            f"{where}: {line.speed:.4g} m/s. The pilot of a mission at {s.speed:g} m/s is good for "
            f"{SLOWEST * s.speed:.4g} to {FASTEST * s.speed:.4g} m/s. Change the leg's speed or the mission's."
        )
    if current >= line.speed:
        raise InputError(
            f"{where}: {line.speed:.4g} m/s makes no way against a current of {current:.3g} m/s. Give a higher speed."
        )
    if line.length < line.early + LEFT * length:
        raise InputError(
            f"{where} is {line.length:.4g} m long; the turn at its end begins {line.early:.4g} m before the waypoint, "
            f"and {LEFT * length:.3g} m should be left. Move the waypoints apart, or make the turn less sharp."
        )
    slope = math.atan2(abs(line.depth - above), line.length)
    steepest = s.pilot.pitch_limit if s.pilot else math.inf
    if slope > steepest:
        raise InputError(
            f"{where} changes depth by {abs(line.depth - above):.4g} m in {line.length:.4g} m, a slope of "
            f"{math.degrees(slope):.1f} deg; the pilot pitches {math.degrees(steepest):.3g} deg at most. Give the leg "
            f"at least {abs(line.depth - above) / math.tan(steepest):.4g} m, or less depth."
        )


def _weakness(model: Model, s: Setting, speed: float) -> str:
    """What keeps the craft from its depth at ``speed`` [m/s], in words; empty where nothing is known to."""
    trim = level_trim(model, speed)
    if not trim.holds:
        return trim.why
    if s.pilot and speed < s.pilot.reversal:
        return f"the elevator acts reversed on depth below {s.pilot.reversal:.3g} m/s"
    return ""


def _passed(pieces: Sequence[Piece]) -> list[tuple[str, Line]]:
    """Name of the leg that ends each line, and the line."""
    return [(piece.leg.name, piece.line) for piece in pieces if not piece.leg.name.endswith("coming on")]


def _missed(flights: Flights, pieces: Sequence[Piece]) -> Array:
    """Errors of depth (N, lines) [m] at the ends of the lines; NaN where a line was not completed."""
    return np.stack([flights.at(name, "z") - line.depth for name, line in _passed(pieces)], axis=-1)


def _off_depth(flights: Flights, pieces: Sequence[Piece], length: float, weak: Mapping[float, str]) -> str | None:
    errors = _missed(flights, pieces)[0]
    off = np.flatnonzero(np.abs(errors) > DEPTH_WITHIN * length)
    if not len(off):
        return None
    i = int(off[0])
    line = _passed(pieces)[i][1]
    why = weak[line.speed] or "the fins do not bring the craft to its depth in this distance"
    return (
        f"not completed: waypoint {i + 1} was passed {abs(errors[i]):.3g} m {'below' if errors[i] > 0.0 else 'above'} "
        f"its depth of {line.depth:.4g} m; {why}"
    )


def _indices(flights: Flights, pieces: Sequence[Piece], thrust: float) -> Readings:
    found = off_track(flights, pieces)
    distance, work = found["distance"][0], thrust_energy(flights, thrust)
    with np.errstate(all="ignore"):
        mean, by = distance / flights.finished_time, work / distance
    return {
        **found,
        "depth_error_at_waypoints": (np.fmax.reduce(np.abs(_missed(flights, pieces)), axis=1), "m"),
        "mean_speed": (mean, "m/s"),
        "thrust_energy": (work, "J"),
        "thrust_energy_per_distance": (by, "J/m"),
    }
