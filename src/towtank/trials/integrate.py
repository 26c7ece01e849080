"""Free running: the model under a helm, integrated in time by scipy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from towtank.errors import TrialError
from towtank.frames import Array
from towtank.model.equations import STILL, Model
from towtank.pilot.helm import EXTRA, Helm

METHOD = "RK23"
RELATIVE = 1e-4
ABSOLUTE = 1e-5
"""Method and tolerances, chosen by measurement (docs/trials.md). The lag of the fins, not accuracy, limits the step of
an explicit method, so the cheapest step wins. The absolute tolerance is in units of each state's natural size."""
STEEPEST = math.radians(85.0)
FASTEST = 10.0
"""A trial ends beyond this pitch [rad], where the Euler angles lose their meaning, or this multiple of the speed."""

Event = Callable[[Any], float]
"""A function of the state (12 + n_fins + 3,) whose change of sign ends a leg."""


@dataclass(frozen=True)
class Leg:
    """Part of a trial under one helm. It ends when ``until`` changes sign, or after ``within`` [s].

    When ``required`` is set and the event does not come, the legs that follow are not run.
    A helm change is a leg boundary, so the integrator never steps across a jump of the command.
    """

    name: str
    helm: Helm
    within: float
    until: Event | None = None
    required: bool = False


@dataclass(frozen=True)
class Mark:
    """End of a leg: its name, time [s], state (12 + n_fins + 3,), and what ended it, "event" or "time"."""

    leg: str
    time: float
    state: Array
    ended: str


@dataclass(frozen=True)
class Flight:
    """Samples of all legs on one uniform time grid; N samples.

    time (N,) [s]; state (N, 12 + n_fins + 3); leg (N,) index into ``legs``; marks : ends of the legs.
    status : "done", or "ended early: ..." with the reason.   evaluations : calls of the right-hand side.
    """

    time: Array
    state: Array
    leg: Array
    legs: tuple[Leg, ...]
    marks: tuple[Mark, ...]
    status: str
    evaluations: int

    def mark(self, leg: str) -> Mark | None:
        """End of the leg called ``leg`` by its event, or None when the event did not come."""
        return next((m for m in self.marks if m.leg == leg and m.ended == "event"), None)

    def within(self, leg: str) -> NDArray[np.bool_]:
        """True (N,) for the samples of the leg called ``leg``."""
        return np.isin(self.leg, [i for i, item in enumerate(self.legs) if item.name == leg])


@dataclass
class _Record:
    time: list[Array] = field(default_factory=list)
    state: list[Array] = field(default_factory=list)
    leg: list[Array] = field(default_factory=list)
    legs: list[Leg] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    evaluations: int = 0


def free_run(
    model: Model,
    start: Sequence[float] | Array,
    legs: Iterable[Leg],
    *,
    thrust: float,
    interval: float,
    current: Sequence[float] = STILL,
) -> Flight:
    """Run ``model`` from ``start`` through ``legs``.

    Parameters
    ----------
    start : state (12 + n_fins + 3,): the craft's, then the helm's own states.
    legs : in order.
    thrust [N]; interval : between samples [s]; current (3,) [m/s, NED].

    Raises
    ------
    TrialError
        No legs, or a start that is not finite.
    """
    now = np.asarray(start, dtype=float)
    size = 12 + len(model.craft.fins) + EXTRA
    if now.shape != (size,) or not np.all(np.isfinite(now)):
        raise TrialError(
            f"trial of {model.craft.name}: the start needs {size} finite numbers (12 of the craft, one per fin, "
            f"{EXTRA} of the helm), got shape {now.shape}. Build it with trials.start."
        )
    record, time, status = _Record(), 0.0, "done"
    for leg in legs:
        time, now, status = _leg(model, leg, time, now, thrust, interval, current, record)
        if status != "done" or (leg.required and record.marks[-1].ended == "time"):
            break
    if not record.legs:
        raise TrialError(f"trial of {model.craft.name}: no leg to run. Give at least one.")
    return Flight(
        np.concatenate(record.time),
        np.concatenate(record.state),
        np.concatenate(record.leg),
        tuple(record.legs),
        tuple(record.marks),
        status,
        record.evaluations,
    )


def _leg(
    model: Model,
    leg: Leg,
    time: float,
    now: Array,
    thrust: float,
    interval: float,
    current: Sequence[float],
    record: _Record,
) -> tuple[float, Array, str]:
    """Integrate one leg; append its samples; return time, state and status at its end."""
    end = time + leg.within
    first = math.ceil(time / interval - 1e-9) + (1 if record.time and _on_grid(time, interval) else 0)
    grid = interval * np.arange(first, math.floor(end / interval + 1e-9) + 1)
    grid = np.clip(grid, time, end)
    asked = grid if len(grid) and grid[-1] == end else np.append(grid, end)
    events = [_terminal(_lost(max(model.craft.speed, math.hypot(*now[6:9]))))]
    events += [_terminal(leg.until)] if leg.until is not None else []
    solved = solve_ivp(
        _rates(model, leg.helm, thrust, current),
        (time, end),
        now,
        METHOD,
        asked,
        events=events,
        rtol=RELATIVE,
        atol=_absolute(model, len(now)),
        first_step=min(0.01, 0.1 * leg.within),
    )
    times, states = np.asarray(solved.t, dtype=float), np.reshape(np.asarray(solved.y).T, (-1, len(now)))
    kept = min(len(times), len(grid))
    record.evaluations += solved.nfev
    record.time.append(times[:kept])
    record.state.append(states[:kept])
    record.leg.append(np.full(kept, len(record.legs)))
    record.legs.append(leg)
    if solved.status == 0:
        record.marks.append(Mark(leg.name, end, states[-1], "time"))
        return end, states[-1], "done"
    if solved.status < 0:
        stop, state = (float(times[-1]), states[-1]) if len(times) else (time, now)
        return stop, state, f"ended early: the motion is no longer finite after {stop:.1f} s ({solved.message})"
    which = next(i for i, t in enumerate(solved.t_events) if len(t))
    stop, state = float(solved.t_events[which][-1]), np.asarray(solved.y_events[which][-1])
    if which == 1:
        record.marks.append(Mark(leg.name, stop, state, "event"))
        return stop, state, "done"
    return stop, state, _loss(stop, state)


def _on_grid(time: float, interval: float) -> bool:
    return abs(time / interval - round(time / interval)) < 1e-9


def _rates(model: Model, helm: Helm, thrust: float, current: Sequence[float]) -> Callable[[float, Array], list[float]]:
    craft_states = 12 + len(model.craft.fins)
    mixed = helm.allocation.fins

    def rates(_: float, y: Array) -> list[float]:
        values = y.tolist()
        state = values[:craft_states]
        try:
            command, own = helm.order(state, values[craft_states:])
            return [*model.rates(state, mixed(command), thrust, current), *own]
        except (OverflowError, ValueError):
            # A trial step may overshoot into numbers that have no sine; the integrator then takes a smaller one.
            return [math.nan] * len(values)

    return rates


def _lost(speed: float) -> Event:
    """Positive while the craft is neither upright on its tail nor beyond any speed it can have."""

    def lost(y: Sequence[float]) -> float:
        return min(STEEPEST - abs(y[4]), 1.0 - math.hypot(y[6], y[7], y[8]) / (FASTEST * speed))

    return lost


def _loss(time: float, state: Array) -> str:
    if abs(state[4]) > 0.99 * STEEPEST:
        return (
            f"ended early: pitch reached {math.degrees(state[4]):.0f} deg after {time:.1f} s, where heading "
            "and roll are no longer defined"
        )
    return f"ended early: the speed reached {math.hypot(*state[6:9]):.3g} m/s after {time:.1f} s, beyond any real craft"


def _terminal(event: Event) -> Callable[[float, Array], float]:
    def wrapped(_: float, y: Array) -> float:
        return float(event(y))

    wrapped.terminal = True  # type: ignore[attr-defined]
    return wrapped


def _absolute(model: Model, size: int) -> Array:
    """Absolute tolerances (size,): lengths, angles, speeds and rates of the craft, fins and helm."""
    length, speed = model.craft.length, model.craft.speed
    scale = np.ones(size)
    scale[0:3], scale[6:9], scale[9:12] = length, speed, speed / length
    return np.asarray(ABSOLUTE * scale)
