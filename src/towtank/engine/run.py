"""Run one trajectory or many: on the compiled loop, in threads, or on numpy where there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from towtank.engine.clock import check_step, clock_of
from towtank.engine.flights import Flights
from towtank.engine.form import Form, form_of
from towtank.engine.library import Library, library
from towtank.engine.loop import KINEMATIC, MEMORY, channels
from towtank.engine.parameters import Places, parameters, varied
from towtank.engine.plan import Clock, Ended, Gauge, Leg, Log, Stat, gauge_table, leg_table, place
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.law import NO_PILOT, Pilot, Seen
from towtank.progress import Progress, Silent

FASTEST = 10.0
"""A trajectory is stopped beyond this multiple of the larger of the craft's speed and its own at its start."""


@dataclass(frozen=True)
class Arrays:
    """The arrays of a run, in and out, as the loop wants them; N trajectories."""

    common: Array
    which: Places
    varied: Array
    start: Array
    plan: Array
    gauge: Array
    channel: Places
    log: Array
    stats: Array
    marks: Array
    end: Array
    status: Array
    clock: Clock
    every: int
    fastest: Array
    sensors: Array
    seed: int

    @property
    def count(self) -> int:
        """Number of trajectories."""
        return len(self.status)


@dataclass(frozen=True)
class Ensemble:
    """What differs between N trajectories; what is not given is shared.

    parameters : name -> (N,), as in ``Form.names``: derivatives, ``m``, ``zG``, ``current_north``, ``thrust``, ...
    start (N, 13 + n + 3) : state and memory.   orders : order name -> (N,) or (N, legs).
    """

    count: int = 1
    parameters: Mapping[str, Array] = field(default_factory=dict)
    start: Array | None = None
    orders: Mapping[str, Array] = field(default_factory=dict)


_UNIT = 1e-6
"""Largest departure of a start's quaternion from the length 1."""

ONE = Ensemble()


def fly(
    model: Model,
    start: Sequence[float] | Array,
    legs: Sequence[Leg],
    *,
    thrust: float,
    pilot: Pilot | None = None,
    current: Sequence[float] = STILL,
    clock: Clock | None = None,
    log: Log | None = None,
    gauges: Sequence[Gauge] = (),
    ensemble: Ensemble = ONE,
    progress: Progress | None = None,
    threads: int | None = None,
    seed: int = 0,
) -> Flights:
    """Fly ``model`` through ``legs``.

    Parameters
    ----------
    start : (13 + n + 3,) state and memory of the steering, from ``towtank.engine.start.at``.
    thrust : [N].   current : (3,) [m/s, NED].   clock : control period and steps, ``clock_of`` when left out.
    log : what is kept over time, nothing when left out.   gauges : what is watched in every leg.
    ensemble : what differs between trajectories.   threads : that share them; all cores when left out.
    seed : of the noise of the pilot's sensors; each trajectory has its own.

    An interruption (Ctrl-C) keeps the trajectories that have ended; the others are marked ``Ended.STOPPED``. A run of
    less than a tenth of a second cannot be interrupted.

    Raises
    ------
    InputError
        A start, leg, gauge or parameter that cannot be used.
    """
    form, clock = form_of(model), clock or clock_of(model, model.craft.speed)
    check_step(model, clock, ensemble.parameters)
    _check(model, thrust, current, legs, log, gauges, ensemble, threads)
    arrays = _arrays(form, model, pilot or NO_PILOT, start, legs, thrust, current, clock, log, gauges, ensemble, seed)
    compiled = library(form)
    if compiled is not None:
        from towtank.engine.threads import run_threads

        run_threads(compiled, arrays, progress or Silent(), threads)
    else:
        from towtank.engine.reference import run_numpy

        run_numpy(form, arrays, progress or Silent())
    return _flights(form, model, arrays, legs, gauges, log, compiled)


def _check(
    model: Model, thrust: float, current: Sequence[float], legs: Sequence[Leg], log: Log | None,
    gauges: Sequence[Gauge], ensemble: Ensemble, threads: int | None,
) -> None:  # fmt: skip
    """Refuse what no form could fly."""
    flow = np.asarray(current, dtype=float)
    if flow.shape != (3,) or not np.all(np.isfinite([*flow, thrust])):
        raise InputError(
            f"run of {model.craft.name}: thrust {thrust} and current {current} must be finite, the current three "
            "numbers."
        )
    if ensemble.count < 1 or (threads is not None and threads < 1):
        raise InputError(f"run: {ensemble.count} trajectories on {threads} threads. Ask for one or more of each.")
    used = [
        *(log.names if log else ()),
        *(g.channel for g in gauges),
        *(leg.until.channel for leg in legs if leg.until),
    ]
    have = {f"delta{i + 1}" for i in range(len(model.craft.fins))}
    absent = [name for name in used if name.startswith("delta") and name not in have]
    if absent:
        raise InputError(f"run: no channel {absent[0]!r}. Craft {model.craft.name} has {len(have)} fins.")


def _arrays(
    form: Form, model: Model, pilot: Pilot, start: Sequence[float] | Array, legs: Sequence[Leg], thrust: float,
    current: Sequence[float], clock: Clock, log: Log | None, gauges: Sequence[Gauge], ensemble: Ensemble, seed: int,
) -> Arrays:  # fmt: skip
    count, fins = ensemble.count, form.fins
    names = channels(fins)
    common = parameters(form, model, pilot, thrust, current)
    which: Places = np.zeros(0, dtype=np.int64)
    values: Array = np.zeros((count, 0))
    if ensemble.parameters:
        which, values = varied(form, common, ensemble.parameters, count)
    begin = _start(model, form, start if ensemble.start is None else ensemble.start)
    plan = leg_table(legs, fins)
    if ensemble.orders:
        plan = _orders(plan, legs, ensemble)
    if begin.ndim == 2 and len(begin) != count:
        raise InputError(f"ensemble of {count}: the start holds {len(begin)} trajectories. Give one row for each.")
    logged: Places = np.array([place(name, fins) for name in (log.names or names)] if log else [], dtype=np.int64)
    longest = float(plan[..., 0].sum(axis=-1).max())
    samples = math.floor(longest / (clock.tick * log.every) + 1e-9) + 1 if log else 0
    speed = np.maximum(np.linalg.norm(begin[..., 7:10], axis=-1), model.craft.speed)
    return Arrays(
        common=common, which=which, varied=values, start=begin, plan=plan, gauge=gauge_table(gauges, fins),
        channel=logged, log=np.full((count, samples, len(logged)), np.nan),
        stats=np.full((count, len(legs), len(gauges), len(Stat)), np.nan),
        marks=np.full((count, len(legs), 2 + len(names)), np.nan),
        end=np.full((count, KINEMATIC + fins + len(MEMORY)), np.nan),
        status=np.tile([float(Ended.STOPPED), 0.0], (count, 1)),
        clock=clock, every=log.every if log else 1,
        fastest=np.ascontiguousarray(np.broadcast_to(FASTEST * speed, (count,))),
        sensors=np.zeros((0, 3)) if pilot.sensors.exact else pilot.sensors.table(Seen._fields, clock.tick), seed=seed,
    )  # fmt: skip


def _start(model: Model, form: Form, start: Sequence[float] | Array) -> Array:
    """Start in the form's own number of fins; fins that are not there stand at zero."""
    given = np.asarray(start, dtype=float)
    have = len(model.craft.fins)
    size = KINEMATIC + have + len(MEMORY)
    if given.shape[-1] != size or given.ndim > 2 or not np.all(np.isfinite(given)):
        raise InputError(
            f"run of {model.craft.name}: the start needs {size} finite numbers (13 of the craft with its quaternion, "
            f"{have} fin angles, 3 of the steering), got shape {given.shape}. Build it with towtank.engine.start.at."
        )
    if np.abs(np.linalg.norm(given[..., 3:7], axis=-1) - 1.0).max() > _UNIT:
        raise InputError(
            f"run of {model.craft.name}: the start's quaternion (entries 3 to 6) has not the length 1. Build the start "
            "with towtank.engine.start.at, or normalise it."
        )
    none = np.zeros((*given.shape[:-1], form.fins - have))
    return np.ascontiguousarray(np.concatenate([given[..., : size - 3], none, given[..., size - 3 :]], axis=-1))


def _orders(plan: Array, legs: Sequence[Leg], ensemble: Ensemble) -> Array:
    """A leg table for every trajectory."""
    from towtank.pilot.orders import ORDERS

    table = np.tile(plan, (ensemble.count, 1, 1))
    for name, values in ensemble.orders.items():
        if name not in ORDERS:
            raise InputError(f"ensemble: no order {name!r}. Choose from {', '.join(ORDERS)}.")
        given = np.asarray(values, dtype=float)
        if given.shape not in ((ensemble.count,), (ensemble.count, len(legs))) or not np.all(np.isfinite(given)):
            raise InputError(
                f"ensemble of {ensemble.count}: order {name} has the shape {given.shape}. Give finite numbers, one for "
                f"each trajectory ({ensemble.count},), or for each of its legs ({ensemble.count}, {len(legs)})."
            )
        table[:, :, 5 + ORDERS.index(name)] = given[:, None] if given.ndim == 1 else given
    return table


def _flights(
    form: Form, model: Model, a: Arrays, legs: Sequence[Leg], gauges: Sequence[Gauge], log: Log | None,
    compiled: Library | None,
) -> Flights:  # fmt: skip
    names, have = channels(form.fins), len(model.craft.fins)
    real = [i for i in range(a.end.shape[1]) if not KINEMATIC + have <= i < KINEMATIC + form.fins]
    return Flights(
        legs=tuple(legs),
        gauges=tuple(gauges),
        names=names,
        logged=(log.names or names) if log else (),
        time=np.asarray(a.clock.tick * a.every * np.arange(a.log.shape[1])),
        log=a.log,
        mark_time=a.marks[:, :, 0],
        by_event=a.marks[:, :, 1] == 1.0,
        mark=a.marks[:, :, 2:],
        stats=a.stats,
        ended=a.status[:, 0].astype(np.int64),
        end_time=a.status[:, 1],
        state=a.end[:, real],
        path="numpy" if compiled is None else compiled.target.name,
    )
