"""Craft that swim through a varying current: the truth behind a synthetic record.

The engine holds one current in a run. In a steady, uniform current a trial is one run of it, up to an hour. In any
other it is flown in pieces of ``Environment.piece`` seconds, each with the current at the craft's depth and time when
it begins. State and memory of the steering go from piece to piece, and so does what is left of a leg. The state holds
velocities over ground: when the current changes by dc, the velocity through the water changes by -dc at once, as if the
craft swam into an eddy with a sharp edge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.clock import clock_of
from towtank.engine.flights import Flights
from towtank.engine.form import form_of
from towtank.engine.plan import Clock, Ended, Leg, Log, Until
from towtank.engine.run import FASTEST, Ensemble, fly
from towtank.engine.start import at
from towtank.errors import InputError
from towtank.field.log import FINS
from towtank.field.sea_water import Environment, eddies, mean_current
from towtank.frames import Array, rotation
from towtank.model.equations import Model
from towtank.pilot.orders import FIN_ORDERS
from towtank.progress import Progress, Silent
from towtank.quantity import Quantity
from towtank.trials.ready import Ready
from towtank.trials.start import setting

STILL_SEA = Environment()
LONGEST_PIECE = 3600.0
"""Longest piece [s] in a steady, uniform current."""
SAME = 1e-9
"""Times [s] closer than this are one; the loop of the engine takes the same."""
_POSE = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
_SEEN = ("speed", "ahead", "slip", "plunge", "rudder", "elevator", "aileron", "heading", "fin_travel")
_COUNTED = ("psi", "fin_travel")
"""Channels that the engine counts from the start of a run; a leg that waits for one is told what went before."""

DRIFT = 1e-7
"""Departure of a quaternion's length from 1 that is taken out between pieces; the engine refuses 1e-6."""


@dataclass(frozen=True)
class Swim:
    """N craft in a sea, without any error of measurement.

    time (S,) [s] : every control period.   channels : name of ``towtank.field.log.CHANNELS`` -> (N, S) [SI], NaN after
    a craft's end and where nothing was ordered.   current (N, S, 3) [m/s, NED] that each feels.   leg (S,) : number of
    the leg under way.   ended (N,) : as in ``Ended``; end_time (N,) [s].   marks : end of each leg [s].
    """

    model: Model
    trial: Ready
    environment: Environment
    clock: Clock
    time: Array
    channels: Mapping[str, Array]
    current: Array
    leg: NDArray[np.int64]
    ended: NDArray[np.int64]
    end_time: Array
    marks: tuple[float, ...]
    parameters: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.ended)


def timed(
    model: Model, legs: Sequence[Leg], speed: Quantity | None = None, *, piloted: bool = True, name: str = "swim"
) -> Ready:
    """``legs`` as a trial that begins level at ``speed``, the craft's own when left out; ``piloted`` with a pilot."""
    s = setting(model, speed, piloted=piloted)
    return Ready(
        name=name, kind="swim", loop="closed" if piloted else "open", setting=s, legs=tuple(legs),
        interval=s.convective / 16.0, read=lambda flights: {},
    )  # fmt: skip


def swim(
    model: Model, trial: Ready, environment: Environment = STILL_SEA, *, count: int = 1,
    parameters: Mapping[str, Array] | None = None, clock: Clock | None = None, progress: Progress | None = None,
    threads: int | None = None,
) -> Swim:  # fmt: skip
    """Let ``count`` craft swim the legs of ``trial`` through the sea.

    Parameters
    ----------
    trial : from the library, a file or ``timed``; its own current is added to that of the sea.   parameters : what
    differs between the craft, as in ``Ensemble``: name -> (count,).   clock : ``clock_of`` the trial's speed when left
    out.

    Each craft begins at the trial's speed through the water, has eddies of its own, and the same orders. With one craft
    legs may end by events. Where fins have a dead band or play, each piece takes their angle for the last command they
    answered, so a command within the band may be answered anew.

    Raises
    ------
    InputError
        Several craft under legs that end by events; a pilot whose sensors are not exact, in a current that is not
        steady and uniform; a current that is not below the trial's speed; whatever ``fly`` refuses.
    """
    clock = clock or clock_of(model, trial.setting.speed)
    _check(trial, environment, count)
    voyage = _Voyage(model, trial, environment, clock, count, dict(parameters or {}), threads)
    progress = progress or Silent()
    progress.start("sea", voyage.pieces)
    while not voyage.over:
        voyage.fly_piece()
        progress.step("sea")
    progress.done("sea")
    return voyage.swim()


def _check(trial: Ready, environment: Environment, count: int) -> None:
    waiting = [leg.name for leg in trial.legs if leg.until is not None]
    if count > 1 and waiting:
        raise InputError(
            f"leg {waiting[0]!r} of {trial.name} ends by an event, which comes to each of {count} craft at a time "
            "of its own. Let one craft swim at a time, or give legs that end by time."
        )
    pieces = not environment.steady or sum(leg.within for leg in trial.legs) > LONGEST_PIECE
    if pieces and trial.setting.pilot is not None and not trial.setting.pilot.sensors.exact:
        raise InputError(
            "the pilot's sensors have noise, which the engine draws anew in each piece of constant current; an "
            "offset would not last. Give a pilot with exact sensors; the record gets its noise from the instruments."
        )
    water = np.linalg.norm(np.asarray(environment.current) + np.asarray(trial.current))
    if water >= trial.setting.speed:
        raise InputError(
            f"a mean current of {water:.3g} m/s is not below the craft's {trial.setting.speed:.3g} m/s; it cannot "
            "make way against it. Give a slower current or a faster trial."
        )


@dataclass
class _Voyage:
    """Craft under way; ``fly_piece`` takes them one piece on."""

    model: Model
    trial: Ready
    environment: Environment
    clock: Clock
    count: int
    parameters: dict[str, Array]
    threads: int | None

    def __post_init__(self) -> None:
        trial, env, tick = self.trial, self.environment, self.clock.tick
        longest = sum(leg.within for leg in trial.legs)
        piece = min(longest + tick, LONGEST_PIECE) if env.steady else env.piece
        self.ticks = max(1, round(piece / tick))
        self.step = self.ticks * tick
        self.pieces = max(1, int(np.ceil(longest / self.step - SAME)))
        self.gusts = eddies(env, self.step, self.count, self.pieces) if any(env.turbulence) else None
        state = np.array(trial.setting.state if trial.start is None else trial.start, dtype=float)
        state[6:9] += rotation(state[3:6]).T @ mean_current(env, state[2])
        self.state = np.tile(at(state, trial.setting.memory), (self.count, 1))
        self.fastest = FASTEST * max(float(np.linalg.norm(state[6:9])), self.model.craft.speed)
        self.fins = len(self.model.craft.fins)
        self.names = (*_POSE, *(f"delta{i + 1}" for i in range(self.fins)), *_SEEN)
        self.begun = 0
        self.leg, self.left = 0, trial.legs[0].within
        self.before = dict.fromkeys(_COUNTED, 0.0)
        self.before["psi"] = float(state[5])
        self.ended = np.full(self.count, Ended.DONE, dtype=np.int64)
        self.end_time = np.zeros(self.count)
        self.logs: list[Array] = []
        self.currents: list[Array] = []
        self.under: list[NDArray[np.int64]] = []
        self.marks: list[float] = []

    @property
    def over(self) -> bool:
        """True when all legs are done or no craft is left."""
        return self.leg >= len(self.trial.legs) or bool((self.ended != Ended.DONE).all())

    def fly_piece(self) -> None:
        """One piece of constant current: flown again whenever an event shows where a leg ends in it."""
        current = mean_current(self.environment, self.state[:, 2], self.trial.current)
        if self.gusts is not None:
            current = current + self.gusts[:, self.begun]
        taken: dict[int, float] = {}
        turns, plan = 0.0, self._plan({}, 0.0)
        while True:
            flights = self._fly([leg for _, leg in plan], current)
            if (flights.ended == Ended.STOPPED).any():
                raise KeyboardInterrupt
            slip = round((float(flights.log[0, 0, self.names.index("psi")]) - self._heading(turns)) / (2.0 * np.pi))
            turns, taken = turns + slip, ({} if slip else {**taken, **self._events(plan, flights)})
            again = self._plan(taken, turns)
            if again == plan:
                break
            plan = again
        self._keep(plan, flights, current)

    def _heading(self, turns: float) -> float:
        """Heading [rad] at which the engine begins to count: ``before`` brought to half a turn, and ``turns``."""
        psi = self.before["psi"]
        return float(psi - 2.0 * np.pi * np.round(psi / (2.0 * np.pi)) + 2.0 * np.pi * turns)

    def _plan(self, taken: Mapping[int, float], turns: float) -> list[tuple[int, Leg]]:
        """Legs of this piece with their numbers; ``taken`` [s] by those that an event ended."""
        out: list[tuple[int, Leg]] = []
        i, left, used = self.leg, self.left, 0.0
        while i < len(self.trial.legs) and used < self.step - SAME:
            leg, room = self.trial.legs[i], self.step - used
            ends = left <= room + SAME
            lasting = left if ends else room
            until = self._until(leg.until, turns) if leg.until else None
            out.append((i, replace(leg, within=lasting, until=until, required=leg.required and ends)))
            used += taken.get(i, lasting)
            if not ends and i not in taken:
                break
            i += 1
            left = self.trial.legs[i].within if i < len(self.trial.legs) else 0.0
        return out

    def _until(self, until: Until, turns: float) -> Until:
        """``until`` in what the engine counts since the piece began."""
        if until.channel not in _COUNTED:
            return until
        counted = self.before[until.channel]
        gone = counted - self._heading(turns) if until.channel == "psi" else counted
        if abs(gone) < SAME:
            return until
        level = float(np.copysign(until.level, counted)) if until.absolute else until.level
        return Until(until.channel, level - gone)

    def _fly(self, legs: Sequence[Leg], current: Array) -> Flights:
        names = ("current_north", "current_east", "current_down")
        flow = {name: np.ascontiguousarray(current[:, i]) for i, name in enumerate(names)}
        return fly(
            self.model, self.state[0], legs, thrust=self.trial.setting.thrust, pilot=self.trial.setting.pilot,
            clock=self.clock, log=Log(self.names), threads=self.threads,
            ensemble=Ensemble(self.count, {**self.parameters, **flow}, start=self.state), seed=self.environment.seed,
        )  # fmt: skip

    def _events(self, plan: Sequence[tuple[int, Leg]], flights: Flights) -> dict[int, float]:
        """Number of each leg that an event ended -> time [s] spent in it, of one craft."""
        marks = np.concatenate([[0.0], flights.mark_time[0]])
        done = flights.by_event[0] & np.isfinite(flights.mark_time[0])
        return {i: float(marks[k + 1] - marks[k]) for k, (i, _) in enumerate(plan) if done[k] and self.count == 1}

    def _keep(self, plan: Sequence[tuple[int, Leg]], flights: Flights, current: Array) -> None:
        """Log of the piece, and where the next one begins."""
        log = flights.log[:, : self.ticks + 1].copy()
        begin, alive = self.begun * self.step, self.ended == Ended.DONE
        log[~alive] = np.nan
        speed = np.nan_to_num(np.linalg.norm(flights.state[:, 7:10], axis=1), nan=np.inf)
        ended = np.where((flights.ended == Ended.DONE) & (speed > self.fastest), Ended.TOO_FAST, flights.ended)
        self.ended = np.where(alive, ended, self.ended)
        self.end_time = np.where(alive, begin + flights.end_time, self.end_time)
        self.state = np.where((self.ended == Ended.DONE)[:, None], unit(flights.state), self.state)
        one = int(np.argmax(alive))
        marks = flights.mark_time[one]
        last = log.shape[1] - 1
        where = np.searchsorted(marks[np.isfinite(marks)] - 1e-6, self.clock.tick * np.arange(last + 1), side="right")
        numbers = np.array([i for i, _ in plan])[np.minimum(where, len(plan) - 1)]
        self.logs.append(log)
        self.under.append(numbers)
        self.currents.append(current)
        self._hand_on(plan, marks, begin, flights.by_event[one])
        self.begun += 1
        if not self.over:
            psi, travel = (self.names.index(name) for name in _COUNTED)
            self.before["psi"] += float(log[one, last, psi] - log[one, 0, psi])
            self.before["fin_travel"] += float(log[one, last, travel])

    def _hand_on(
        self, plan: Sequence[tuple[int, Leg]], marks: Array, begin: float, by_event: NDArray[np.bool_]
    ) -> None:
        """The leg that is under way at the end of the piece, and its time that is left."""
        for (i, leg), mark, event in zip(plan, marks, by_event, strict=True):
            if not np.isfinite(mark):
                return
            left = self.left - leg.within
            if event or left <= SAME:
                self.marks.append(begin + float(mark))
                self.leg = i + 1
                self.left = self.trial.legs[self.leg].within if self.leg < len(self.trial.legs) else 0.0
            else:
                self.left = left

    def swim(self) -> Swim:
        """What was flown."""
        n = self.ticks
        log = np.concatenate([*(piece[:, :n] for piece in self.logs), self.logs[-1][:, n:]], axis=1)
        under = np.concatenate([*(piece[:n] for piece in self.under), self.under[-1][n:]])
        flow = np.repeat(np.stack(self.currents, axis=1), n, axis=1)
        flow = np.concatenate([flow, flow[:, -1:]], axis=1)[:, : log.shape[1]]
        kept = np.isfinite(log[:, :, 0]).any(axis=0)
        log, under, flow = log[:, kept], under[kept], flow[:, kept]
        time = self.clock.tick * np.flatnonzero(kept)
        raw = {name: log[:, :, i] for i, name in enumerate(self.names)}
        raw["psi"] = np.unwrap(raw["psi"], axis=1)
        return Swim(
            self.model, self.trial, self.environment, self.clock, np.asarray(time, dtype=float),
            _channels(self, raw, under), flow, under, self.ended, self.end_time, tuple(self.marks), self.parameters,
        )  # fmt: skip


def _channels(voyage: _Voyage, raw: dict[str, Array], under: NDArray[np.int64]) -> dict[str, Array]:
    """Channels of a record from those of the engine: the motion, what was asked of fins and propeller, the orders."""
    heading = raw.pop("heading")
    raw.pop("fin_travel")
    orders = [leg.orders for leg in voyage.trial.legs]
    alive = np.isfinite(raw["x"])

    def ordered(name: str) -> Array:
        return np.array([float(getattr(o, name)) for o in orders])[under]

    out = dict(raw)
    if not form_of(voyage.model).damaged:
        granted = np.stack([raw[name] for name in ("rudder", "elevator", "aileron")], axis=-1)
        asked = granted @ np.asarray(voyage.model.craft.mixing, dtype=float).T
        for i in range(min(voyage.fins, FINS)):
            out[f"command{i + 1}"] = asked[..., i] + np.where(alive, ordered(FIN_ORDERS[i]), np.nan)
    out |= _driven(voyage, ordered("throttle"), alive)
    return out | _orders(voyage, ordered, heading, alive)


def _driven(voyage: _Voyage, throttle: Array, alive: NDArray[np.bool_]) -> dict[str, Array]:
    """Revolutions of the propeller, or the thrust of a craft whose propeller is not known; the speed ordered."""
    s, screw = voyage.trial.setting, voyage.model.constants.screw
    base = np.asarray(voyage.parameters.get("thrust", s.thrust), dtype=float)
    thrust = np.where(alive, base.reshape(-1, 1) * throttle, np.nan)
    speed = np.where(alive & (throttle == 1.0), s.speed, np.nan)
    out = {"speed_order": speed} if np.isfinite(speed).any() else {}
    if screw is None:
        return out | {"thrust": thrust}
    return out | {"revolutions": np.sign(thrust) * np.sqrt(np.abs(thrust) / screw.force_per_square)}


def _orders(voyage: _Voyage, ordered: Any, heading: Array, alive: NDArray[np.bool_]) -> dict[str, Array]:
    """What was asked of the pilot, NaN where nothing was."""
    steered = (ordered("piloted") * np.maximum(ordered("steer"), ordered("track")) == 1.0) & alive
    dived = (ordered("piloted") * ordered("dive") == 1.0) & alive
    turning, pitching = ordered("turning") == 1.0, ordered("pitching") == 1.0
    found = {
        "heading_order": np.where(steered & ~turning, heading, np.nan),
        "turn_order": np.where(steered & turning, ordered("turn"), np.nan),
        "depth_order": np.where(dived & ~pitching, ordered("depth"), np.nan),
        "pitch_order": np.where(dived & pitching, ordered("pitch") + voyage.trial.setting.trim.pitch, np.nan),
    }
    return {name: values for name, values in found.items() if np.isfinite(values).any()}


def unit(states: Array) -> Array:
    """``states`` (N, 13 + ...) with quaternions of length 1 where the steps have moved the length by ``DRIFT``.

    The engine takes a start of length 1 only. The rotation is that of the quaternion's direction; it is not changed.
    """
    size = np.linalg.norm(states[:, 3:7], axis=1, keepdims=True)
    out = states.copy()
    out[:, 3:7] = np.where(np.abs(size - 1.0) > DRIFT, states[:, 3:7] / np.maximum(size, DRIFT), states[:, 3:7])
    return out
