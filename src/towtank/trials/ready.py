"""A trial made ready for a craft: what is flown, and how its numbers are read, for one craft or for many like it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.clock import clock_of
from towtank.engine.flights import Flights
from towtank.engine.plan import Clock, Ended, Gauge, Leg, Log, Stat
from towtank.engine.run import ONE, Ensemble, fly
from towtank.engine.start import at
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.provenance import provenance
from towtank.trials.start import Setting
from towtank.trials.trajectory import Trajectory

Readings = Mapping[str, tuple[Array, str]]
"""Index name -> (values (N,), unit); NaN where a craft did not get that far."""

ROLL, PITCH = Gauge("phi", absolute=True), Gauge("theta", absolute=True)
SPEED = Gauge("speed")
FIN_SQUARE, FIN_LARGEST = Gauge("fin_square"), Gauge("fin_largest")
FIN_USE = Gauge("fin_use", 0.995)
COMMON = (ROLL, PITCH, SPEED, FIN_SQUARE, FIN_LARGEST, FIN_USE)
"""Gauges of every trial."""


@dataclass(frozen=True)
class Ready:
    """A trial ready to fly.

    name, kind, loop : of the trajectory.   setting : start.   legs : flown.   gauges : watched beside ``COMMON``.
    interval : between samples of the record [s].   current (3,) [m/s, NED].
    read : flights of N craft -> the trial's own indices.   status : flights of one craft -> why its numbers are not
    complete, or None.   curves : flights of one craft -> plain series that belong to the trial.
    start : state (12 + n,) where it is not the setting's.   alone : indices of one craft that are not flown.
    needs : channels whose record ``read`` takes; a Monte Carlo study keeps no others.
    """

    name: str
    kind: str
    loop: str
    setting: Setting
    legs: tuple[Leg, ...]
    interval: float
    read: Callable[[Flights], Readings]
    gauges: tuple[Gauge, ...] = ()
    current: tuple[float, float, float] = STILL
    status: Callable[[Flights], str | None] = lambda flights: None
    curves: Callable[[Flights], Mapping[str, Any]] = lambda flights: {}
    start: Array | None = None
    alone: Mapping[str, tuple[float, str]] | None = None
    needs: tuple[str, ...] = ()


def fly_ready(
    model: Model, trial: Ready, ensemble: Ensemble = ONE, *, record: bool | Log = True, clock: Clock | None = None,
    **options: Any,
) -> Flights:  # fmt: skip
    """Fly ``trial``. ``options`` go to ``towtank.engine.run.fly``.

    record : True keeps all channels at its interval, False nothing, a ``Log`` what it says.   clock : ``clock_of`` the
    trial's speed when left out.
    """
    clock = clock or clock_of(model, trial.setting.speed)
    state = trial.setting.state if trial.start is None else trial.start
    every = Log(every=max(1, round(trial.interval / clock.tick)))
    log = record if isinstance(record, Log) else every if record else None
    return fly(
        model, at(state, trial.setting.memory), trial.legs, thrust=trial.setting.thrust, pilot=trial.setting.pilot,
        current=trial.current, clock=clock, log=log, gauges=(*COMMON, *trial.gauges), ensemble=ensemble, **options,
    )  # fmt: skip


def readings(model: Model, trial: Ready, flights: Flights) -> Readings:
    """All flown indices of ``trial`` (N,): its own, then those every trial has."""
    return {**trial.read(flights), **_common(model, trial, flights)}


def run_trial(model: Model, trial: Ready) -> Trajectory:
    """Fly ``trial`` once and read it."""
    flights = fly_ready(model, trial)
    fins = len(model.craft.fins)
    kept = np.flatnonzero(~np.isnan(flights.log[0, :, 0]))

    def channel(*names: str) -> Array:
        columns = [flights.series(name)[0, kept] for name in names]
        return np.stack(columns, axis=-1) if columns else np.zeros((len(kept), 0))

    time = flights.time[kept]
    leg = np.minimum(np.searchsorted(flights.mark_time[0][: _flown(flights)], time, side="right"), len(trial.legs) - 1)
    indices = {name: (float(values[0]), unit) for name, (values, unit) in readings(model, trial, flights).items()}
    return Trajectory(
        name=trial.name, kind=trial.kind, loop=trial.loop, craft=model.craft.name, level=model.derivatives.level,
        time=time, position=channel("x", "y", "z"), attitude=channel("phi", "theta", "psi"),
        nu=channel("u", "v", "w", "p", "q", "r"), delta=channel(*(f"delta{i + 1}" for i in range(fins))),
        command=channel("rudder", "elevator", "aileron"),
        setpoint=_setpoints(trial, leg, flights.series("heading")[0, kept]),
        indices={**indices, **(trial.alone or {})}, status=_status(trial, flights),
        provenance=_provenance(model, trial, flights),
    )  # fmt: skip


def _setpoints(trial: Ready, leg: NDArray[np.int64], heading: Array) -> dict[str, Array]:
    """What was asked of the pilot at each sample, NaN where nothing was; ``leg`` (S,) that each is in.

    Always heading [rad] and depth [m]; turn [rad/s], pitch [rad] and throttle where a leg has such an order.
    """
    orders = [item.orders for item in trial.legs]
    steered = np.array([o.piloted * max(o.steer, o.track) for o in orders])[leg] == 1.0
    dived = np.array([o.piloted * o.dive for o in orders])[leg] == 1.0
    turning, pitching = (np.array([getattr(o, key) for o in orders])[leg] == 1.0 for key in ("turning", "pitching"))

    def where(asked: NDArray[np.bool_], values: Array) -> Array:
        return np.where(asked, values, np.nan)

    def ordered(name: str) -> Array:
        return np.array([float(getattr(o, name)) for o in orders])[leg]

    trimmed = trial.setting.trim.pitch
    found = {"heading": where(steered & ~turning, heading), "depth": where(dived & ~pitching, ordered("depth"))}
    more = {
        "turn": where(steered & turning, ordered("turn")),
        "pitch": where(dived & pitching, ordered("pitch") + trimmed),
    }
    found |= {name: values for name, values in more.items() if np.isfinite(values).any()}
    return found | ({"throttle": ordered("throttle")} if any(o.throttle != 1.0 for o in orders) else {})


def _flown(flights: Flights) -> int:
    """Legs the first trajectory has ended."""
    return int(np.count_nonzero(~np.isnan(flights.mark_time[0])))


def _common(model: Model, trial: Ready, flights: Flights) -> Readings:
    """Indices that every trial has: duration, changes, extremes, effort of the fins.

    The duration is that of the whole trial, the others are of the finished legs and NaN where none was: an unfinished
    leg ends with a craft that ran away.
    """
    degrees = np.degrees
    lasting = flights.finished_time
    start = trial.setting.state if trial.start is None else trial.start
    out: dict[str, tuple[Array, str]] = {
        "duration": (flights.end_time, "s"),
        "depth_change": (last(flights, "z") - start[2], "m"),
        "largest_roll": (degrees(flights.over(ROLL, Stat.HIGH)), "deg"),
        "largest_pitch": (degrees(flights.over(PITCH, Stat.HIGH)), "deg"),
    }
    if not model.craft.fins:
        return out
    path = flights.over(SPEED, Stat.INTEGRAL)
    with np.errstate(all="ignore"):
        out |= {
            "fin_rms": (degrees(np.sqrt(flights.over(FIN_SQUARE, Stat.INTEGRAL) / lasting)), "deg"),
            "fin_largest": (degrees(flights.over(FIN_LARGEST, Stat.HIGH)), "deg"),
            "fin_travel": (degrees(last(flights, "fin_travel")) / path, "deg/m"),
            "fin_saturation": (100.0 * flights.over(FIN_USE, Stat.ABOVE) / lasting, "%"),
        }
    return out


def last(flights: Flights, channel: str) -> Array:
    """Channel (N,) at the end of the last leg that was ended; NaN where none was."""
    done = np.count_nonzero(~np.isnan(flights.mark_time), axis=1)
    values = flights.mark[np.arange(len(flights)), np.maximum(done - 1, 0), flights.names.index(channel)]
    return np.where(done > 0, values, np.nan)


def _status(trial: Ready, flights: Flights) -> str:
    ended, time = Ended(int(flights.ended[0])), float(flights.end_time[0])
    if ended is Ended.NOT_FINITE:
        return f"ended early: the motion is no longer finite after {time:.1f} s"
    if ended is Ended.TOO_FAST:
        return f"ended early: the speed ran away after {time:.1f} s, beyond any real craft"
    return trial.status(flights) or "done"


def _provenance(model: Model, trial: Ready, flights: Flights) -> dict[str, Any]:
    s, clock = trial.setting, clock_of(model, trial.setting.speed)
    marks = [
        {"leg": trial.legs[i].name, "time": float(flights.mark_time[0, i]), "ended": ended}
        for i, ended in enumerate(np.where(flights.by_event[0], "event", "time").tolist())
        if not np.isnan(flights.mark_time[0, i])
    ]
    return provenance(
        speed=s.speed,
        thrust=s.thrust,
        trim={"pitch": s.trim.pitch, "elevator": s.trim.elevator, "level": s.trim.holds},
        current=list(trial.current),
        marks=marks,
        notes=list(s.notes),
        curves=dict(trial.curves(flights)),
        engine={"path": flights.path, "control_period": clock.tick, "step": clock.tick / clock.steps},
    )
