"""Lawnmower: parallel legs at constant depth, the survey pattern of an AUV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.helm import LineOfSight
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity, si
from towtank.trials.integrate import Event, Flight, Leg, free_run
from towtank.trials.outcome import trajectory
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
"""A leg is given up after this multiple of the time it should take."""


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
    [m], rms over all of the long legs [m], rms depth error on them [m], time [s], distance [m], effort of the fins.

    Raises
    ------
    InputError
        No legs, a leg shorter than 8 craft lengths, a spacing below 4: the turns would take up the legs.
    """
    length = model.craft.length
    s = setting(model, speed, pilot)
    diameter = min(turning_diameter(model, s.speed, RUDDER_SHARE * fin_limit(model)), WIDEST * length)
    long_ = max(25.0 * length, 3.0 * diameter) if leg_length is None else si(leg_length, "m", "leg_length")
    short = max(10.0 * length, 1.5 * diameter) if spacing is None else si(spacing, "m", "spacing")
    if legs < 1 or long_ < 8.0 * length or short < 4.0 * length:
        raise InputError(
            f"lawnmower of {legs} legs, {long_:.3g} m long, {short:.3g} m apart: needs at least one leg, legs of "
            f"{8.0 * length:.3g} m and a spacing of {4.0 * length:.3g} m (8 and 4 craft lengths), or the turns take up "
            "the legs. Give longer legs or a wider spacing."
        )
    below = si(depth, "m", "depth")
    start = s.state.copy()
    start[6:9] += adrift(s, current)
    lines = _lines(legs, long_, short, _lookahead(s, length))
    early = max(2.0 * length, 0.5 * diameter)
    track = [_leg(s, f"leg {i + 1}", line, below, early, current) for i, line in enumerate(lines)]
    flight = free_run(model, start, track, thrust=s.thrust, interval=s.convective / 8.0, current=tuple(current))
    lost = next((m.leg for m in flight.marks if m.ended == "time"), None)
    status = lost and (
        f"ended early: {lost} was not completed in {PATIENCE:g} times the time it should take; the craft does not hold "
        "the track"
    )
    return trajectory(
        model, s, flight, name="lawnmower", kind="lawnmower", loop="closed",
        indices=_indices(flight, lines, below), status=status, current=current,
        curves={"track": {"north": [p[0] for p in _corners(lines)], "east": [p[1] for p in _corners(lines)]}},
    )  # fmt: skip


def _lookahead(s: Setting, length: float) -> float:
    gain = s.helm.pilot.heading if s.helm.pilot else 0.0
    return max(3.0 * length, LOOKAHEAD * s.speed / gain) if gain > 0.0 else 3.0 * length


def _lines(legs: int, long_: float, short: float, lookahead: float) -> list[LineOfSight]:
    """Long and short legs in order."""
    corners = [(0.0, 0.0)]
    for i in range(legs):
        north, east = corners[-1]
        corners.append((north + (long_ if i % 2 == 0 else -long_), east))
        if i < legs - 1:
            corners.append((corners[-1][0], east + short))
    gain = 1.0 / (DRIFT * lookahead)
    return [
        LineOfSight(a, b, lookahead, gain) for a, b in pairwise(corners)
    ]  # fmt: skip


def _corners(lines: list[LineOfSight]) -> list[tuple[float, float]]:
    return [lines[0].start, *(line.end for line in lines)]


def _leg(s: Setting, name: str, line: LineOfSight, depth: float, early: float, current: Sequence[float]) -> Leg:
    """One straight leg; it ends ``early`` [m] before its corner, so that the turn ends on the next one."""
    against = math.hypot(current[0], current[1])
    expected = line.length / max(s.speed - against, 0.2 * s.speed)
    across = current[1] * math.cos(line.course) - current[0] * math.sin(line.course)
    scaled = replace(line, gain=line.gain * s.speed, crab=math.asin(across / s.speed))
    helm = replace(s.helm, guidance=scaled, depth=depth, current=drifting(current))
    return Leg(name, helm, PATIENCE * expected, _passed(line, early), required=True)


def _passed(line: LineOfSight, early: float) -> Event:
    def event(y: Sequence[float]) -> float:
        return line.along_and_across(y[0], y[1])[0] - (line.length - early)

    return event


def _indices(flight: Flight, lines: list[LineOfSight], depth: float) -> dict[str, tuple[float, str]]:
    whole: list[Array] = []
    settled: list[Array] = []
    deep: list[Array] = []
    for i, line in enumerate(lines):
        inside = flight.leg == i
        if i % 2 or not inside.any():
            continue
        places = flight.state[inside]
        both = np.array([line.along_and_across(n, e) for n, e in places[:, :2]])
        on = both[:, 0] > 0.5 * line.length
        whole.append(both[:, 1])
        settled.append(both[on, 1])
        deep.append(places[on, 2] - depth)
    path = float(np.linalg.norm(np.diff(flight.state[:, :3], axis=0), axis=1).sum())
    return {
        "off_track_rms": (_rms(settled), "m"),
        "off_track_largest": (max((float(np.abs(x).max()) for x in settled if len(x)), default=float("nan")), "m"),
        "off_track_rms_whole": (_rms(whole), "m"),
        "depth_error_rms": (_rms(deep), "m"),
        "distance": (path, "m"),
    }


def _rms(pieces: list[Array]) -> float:
    values = np.concatenate(pieces) if pieces else np.zeros(0)
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")
