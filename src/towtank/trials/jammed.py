"""A mission with one fin jammed: at which angles it is completed, and what keeps it from being completed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.loop import KINEMATIC
from towtank.engine.plan import Ended
from towtank.engine.run import Ensemble
from towtank.engine.start import at
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.algebra import MATH
from towtank.model.equations import Model
from towtank.model.faults import Jammed
from towtank.pilot.allocation import ROLL_WEIGHT, Allocation, Damage, reallocate
from towtank.provenance import provenance
from towtank.trials.mission import lawnmower_ready
from towtank.trials.ready import Ready, fly_ready, readings
from towtank.trials.start import ballasted, level_trim

ANGLES = 9
"""Angles at which each fin is jammed, from limit to limit."""
OFF_TRACK, OFF_DEPTH = 2.0, 1.0
"""Rms distance off the track and rms depth error, in lengths, beyond which a mission flown to its end does not count as
completed: the spacing of a survey is some lengths."""
HELD = np.radians(0.5)
"""Part of a jammed fin's rudder, elevator or aileron that the other fins may leave over."""


@dataclass(frozen=True)
class JammedFins:
    """A mission flown with each of F fins jammed at each of A angles, by a pilot that knows of it.

    mission, level, craft, speed [m/s].   fins (F,) : names.   angle (F, A) [rad].   completed (F, A).
    why (F, A) : what keeps a mission from being completed, "" for one that is.
    off_track, depth_error (F, A) : rms [m].   fin_rms (F, A) [deg] : of all fins, the jammed one among them.
    left (F, A, 3) : rudder, elevator, aileron [rad] of the jammed fin that the other fins cannot take back.
    sound : the same numbers with sound fins: off track, depth error, fin rms.
    """

    craft: str
    mission: str
    level: str
    speed: float
    fins: tuple[str, ...]
    angle: Array
    completed: Array
    why: tuple[tuple[str, ...], ...]
    off_track: Array
    depth_error: Array
    fin_rms: Array
    left: Array
    sound: tuple[float, float, float]
    notes: tuple[str, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def share(self) -> float:
        """Share of the jams with which the mission is completed."""
        return float(np.mean(self.completed))


def jammed_fins(
    model: Model,
    angles: int = ANGLES,
    mission: Callable[[Model], Ready] = lawnmower_ready,
) -> JammedFins:
    """Fly ``mission`` with each fin jammed at ``angles`` angles between its limits, from the start of the run.

    Trim, thrust and gains are those of the sound craft. A craft that cannot carry its weight residual level is flown
    ballasted to neutral.

    Raises
    ------
    InputError
        Fewer than two angles, or a craft without fins.
    """
    if angles < 2 or not model.craft.fins:
        raise InputError(
            f"jammed fins of {model.craft.name}: {angles} angles of {len(model.craft.fins)} fins. Give two angles or "
            "more, the limits of the fin, and a craft with fins."
        )
    trim = level_trim(model, model.craft.speed)
    flown = model if trim.holds else ballasted(model)
    trial, n = mission(flown), len(flown.craft.fins)
    limits = np.array([fin.max_angle for fin in flown.craft.fins])
    grid = np.linspace(-1.0, 1.0, angles) * limits[:, None]
    damaged = flown.with_options(faults=(Jammed(flown.craft.fins[0].name, 0.0),))
    ensemble = _ensemble(trial, grid, n)
    flights = fly_ready(damaged, trial, ensemble, record=False)
    off_track, depth_error, fin_rms = _numbers(damaged, trial, flights).reshape(3, n, angles)
    left = np.array([[_left(flown, i, a) for a in row] for i, row in enumerate(grid)])
    ended = flights.ended.reshape(n, angles)
    why = tuple(
        tuple(_why(flown, Ended(int(e)), float(y), float(z), a) for e, y, z, a in zip(*row, strict=True))
        for row in zip(ended, off_track, depth_error, left, strict=True)
    )
    sound = _numbers(flown, trial, fly_ready(flown, trial, record=False))[:, 0]
    return JammedFins(
        craft=model.craft.name, mission=trial.name, level=model.derivatives.level, speed=trial.setting.speed,
        fins=tuple(fin.name for fin in flown.craft.fins), angle=grid,
        completed=np.array([[not word for word in row] for row in why]), why=why,
        off_track=off_track, depth_error=depth_error, fin_rms=fin_rms, left=left,
        sound=(float(sound[0]), float(sound[1]), float(sound[2])),
        notes=() if trim.holds else (f"Ballasted to neutral for this trial: {trim.why}.",),
        provenance=provenance(engine=flights.path),
    )  # fmt: skip


def _numbers(model: Model, trial: Ready, flights: Flights) -> Array:
    """Off track, depth error [m] and fin rms [deg] of N flights (3, N)."""
    found = readings(model, trial, flights)
    return np.array([found[name][0] for name in ("off_track_rms", "depth_error_rms", "fin_rms")])


def _ensemble(trial: Ready, grid: Array, n: int) -> Ensemble:
    """One craft for each fin and angle, the fin at its angle from the start."""
    count = grid.size
    fin = np.repeat(np.arange(n), grid.shape[1])
    angle = grid.ravel()
    stuck = {f"stuck{i}": (fin == i).astype(float) for i in range(n)}
    where = {f"stuck_angle{i}": np.where(fin == i, angle, 0.0) for i in range(n)}
    state = trial.setting.state if trial.start is None else trial.start
    start = np.tile(at(state, trial.setting.memory), (count, 1))
    start[np.arange(count), KINEMATIC + fin] = angle
    return Ensemble(count, {**stuck, **where}, start)


def _left(model: Model, fin: int, angle: float) -> Array:
    """Rudder, elevator, aileron (3,) [rad] of a fin jammed at ``angle`` [rad] that the others cannot take back."""
    fins, n = model.constants.fins, len(model.craft.fins)
    stuck, at_angle = [float(i == fin) for i in range(n)], [angle * float(i == fin) for i in range(n)]
    tail = Allocation(fins.mixing, fins.max_angle, Damage(fins.unmixing, stuck, at_angle))
    delta = reallocate([0.0, 0.0, 0.0], tail, [1.0, 1.0, ROLL_WEIGHT], MATH)
    return np.asarray(np.array(fins.unmixing, dtype=float) @ np.array(delta, dtype=float))


def _why(model: Model, ended: Ended, off_track: float, depth_error: float, left: Array) -> str:
    """What keeps a mission from being completed; "" for one that is."""
    length = model.craft.length
    lacks = [
        f"{np.degrees(abs(x)):.1f} deg of {word}"
        for x, word in zip(left, ("rudder", "elevator", "aileron"), strict=True)
        if abs(x) > HELD
    ]
    cause = f"; the other fins leave {' and '.join(lacks)} of the jammed one" if lacks else ""
    if ended is Ended.LATE:
        return f"the track is not held{cause}"
    if ended is not Ended.DONE:
        return f"the motion ran away{cause}"
    faults = []
    if not off_track <= OFF_TRACK * length:
        faults.append(f"{off_track:.3g} m off the track")
    if not depth_error <= OFF_DEPTH * length:
        faults.append(f"{depth_error:.3g} m off the depth")
    if not faults:
        return ""
    return f"{' and '.join(faults)} (rms){cause or '; the fins have no more left for it beside the jammed one'}"
