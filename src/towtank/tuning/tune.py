"""Tune a pilot: least error and fin effort over trials, speeds and drawn craft, with margins kept."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from towtank.errors import InputError, TrialError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import linearise
from towtank.pilot.design import design_pilot, steady_pitch_order
from towtank.pilot.law import Pilot
from towtank.pilot.loops import judged
from towtank.pilot.plant import block
from towtank.progress import Progress, Silent
from towtank.tuning.cases import USUAL, Case, cases
from towtank.tuning.cost import LOST, REST, Objective, Price, Tie, price
from towtank.tuning.fence import ALPHA, Fence, plane
from towtank.tuning.margins import RobustMargins, robust_margins
from towtank.tuning.noise import Noise, jitter

ROUNDS = 30
"""Most steps of the search."""
LITTLE = 1e-3
"""The search ends when ``PATIENCE`` steps in a row, some of them refused, gain less than this share of the cost."""
PATIENCE = 4
FASTER = 1.5
"""The second speed, in those of the pilot, where none are given."""
RAISED = 2
"""Times the fence is made ten times steeper when a search ended outside it."""
TASK = "tune"


@dataclass(frozen=True)
class Flown:
    """One flight of the best estimate: its cost and what it looks like.

    heading, roll [deg], depth [m] : rms errors.   fins [deg] : rms angle off level flight.   travel [deg/m].
    """

    name: str
    speed: float
    price: Price
    heading: float
    depth: float
    roll: float
    fins: float
    travel: float


@dataclass(frozen=True)
class Score:
    """A pilot on all flights.

    price : mean of all craft.   fence : cost of lacking margin.   noise : of fin speeds from the pilot's sensors.
    flights : of the best estimate.
    margins : at each speed; a speed at which the loop is not stable has none.
    """

    price: Price
    fence: float
    noise: float
    flights: tuple[Flown, ...]
    margins: tuple[RobustMargins | None, ...]

    @property
    def cost(self) -> float:
        """What is minimised."""
        return self.price.total + self.fence + self.noise

    @property
    def kept(self) -> bool:
        """True when every loop has the margins asked for at every speed."""
        return all(m is not None and min(one.disk.alpha for one in m.loops.values()) >= ALPHA for m in self.margins)


@dataclass(frozen=True)
class Tuned:
    """Result of a tuning.

    pilot, start : after and before.   before, after : their scores.   speeds [m/s], steps, drawn, seed : tuned on.
    weight : of the fence.   moved : gains that were free.   rounds, flights, seconds : spent.
    """

    pilot: Pilot
    start: Pilot
    before: Score
    after: Score
    speeds: tuple[float, ...]
    steps: tuple[str, ...]
    drawn: int
    seed: int
    weight: float
    moved: tuple[str, ...]
    rounds: int
    flights: int
    seconds: float


def tune(
    model: Model, pilot: Pilot | None = None, *, speeds: Sequence[float] | None = None,
    steps: Sequence[str] = USUAL, drawn: int = 3, seed: int = 20, rounds: int = ROUNDS, threads: int = 1,
    progress: Progress | None = None,
) -> Tuned:  # fmt: skip
    """Gains of least cost on ``model``, from those of ``pilot``, the cascade designed for it when not given.

    cost = mean over flights of [mean square of heading, depth and roll errors, of fin angles off level flight and of
    fin speeds, each over its acceptable size] + fence + noise. Sizes: 20 deg, half a length, 5 deg, a third of the
    fins' range, that third in a quarter of a length. Rudder and elevator begin a degree off, for the integrals.
    The fence is zero where each loop holds a factor 2 of gain either way and 37 deg of phase at every speed
    (``towtank.tuning.fence``). Sensors of the pilot that are not exact add the fin speeds their noise causes
    (``towtank.tuning.noise``); the flights themselves are seen exactly. The result is never dearer than the start.

    Parameters
    ----------
    speeds : [m/s]; the pilot's own and 1.5 times it when not given. Between them the law's schedule acts.
    steps : names in ``STEPS``.   drawn : craft from the uncertainty of the derivatives, beside the best estimate.
    seed : of the draws.   rounds : most steps of the search.   threads : that fly at a time.

    Source     Gauss-Newton in a trust region (scipy's ``trust-exact``), on the tangents of the flown loop.
    Departure  Slopes are those of the side of a limit that a flight is on; where a limit is passed, the search relies
               on the cost itself.
    Valid      Margins are those of the best estimate about straight flight.

    Raises
    ------
    InputError
        Unknown steps, speeds that cannot be flown, a count below zero.
    TrialError
        The start does not fly every case to its end.
    TowtankError
        No compiled engine, or python-control is not installed.
    """
    started, told = time.perf_counter(), progress or Silent()
    first = pilot or design_pilot(model)
    asked = tuple(float(u) for u in speeds) if speeds is not None else (first.speed, FASTER * first.speed)
    if rounds < 0:
        raise InputError(f"tuning: {rounds} rounds. Give zero, which only scores the start, or more.")
    flown = cases(model, first, asked, tuple(steps), drawn, seed)
    fence = Fence([plane(model, u) for u in asked], 0.0)
    noise = Noise([jitter(model, first.sensors, u) for u in asked])
    objective = Objective(first, flown, fence, noise, _tie(model, first), threads=threads)
    begin = objective.prices(first)
    lost = [case for case, one in zip(flown, begin, strict=True) if one.tracking >= LOST]
    if lost:
        raise TrialError(
            f"tuning of {first.craft}: {len(lost)} of {len(flown)} flights of the start run away, the first a "
            f"{lost[0].name} at {lost[0].speed:g} m/s. A search needs a start that flies: design one for these speeds."
        )
    size = float(np.mean([one.total for one in begin])) + noise.cost(first)
    objective.rest, weight = REST * size, 10.0 * size
    x, count = np.zeros(len(objective.names)), 0
    told.start(TASK, rounds)
    for _ in range(RAISED + 1):
        objective.fence = replace(fence, weight=weight)
        x, taken = _search(objective, x, rounds - count, told)
        count += taken
        if count >= rounds or objective.fence.kept(objective.pilot(x)):
            break
        weight *= 10.0
    told.done(TASK)
    best = objective.pilot(x)
    before, after = (_score(model, objective, one, asked) for one in (first, best))
    if not after.cost < before.cost:
        best, after = first, before
    note = f"Tuned on {', '.join(steps)} at {', '.join(f'{u:g}' for u in asked)} m/s with {drawn} drawn craft."
    final = judged(model, replace(best, notes=(*first.notes, note))) if best is not first else first
    return Tuned(
        final, first, before, after, asked, tuple(steps), drawn, seed, objective.fence.weight, objective.names, count,
        objective.flights, time.perf_counter() - started,
    )  # fmt: skip


def _tie(model: Model, pilot: Pilot) -> Tie:
    """The steady pitch order is affine in the gains of pitch and heave; its slope to that of pitch is 1."""
    plant = block(linearise(model, pilot.speed), ("w", "q", "theta"), "elevator")
    with_heave, without = (
        steady_pitch_order((plant, np.eye(3), np.array([heave, pilot.pitch_rate, pilot.pitch]))) for heave in (1.0, 0.0)
    )
    return Tie(with_heave - without)


def _search(objective: Objective, x: Array, rounds: int, told: Progress) -> tuple[Array, int]:
    """Point of least cost from ``x`` (n,) on and the number of steps taken."""
    objective.forget()
    if rounds == 0:
        return x, 0
    seen: list[float] = [objective.value(x)]

    def watch(intermediate_result: Any) -> None:
        seen.append(float(intermediate_result.fun))
        told.step(TASK, f"cost {seen[-1]:.4g}")
        if len(seen) > PATIENCE and seen[-1 - PATIENCE] - seen[-1] < LITTLE * seen[-1]:
            raise StopIteration

    found = minimize(
        objective.value, x, jac=objective.gradient, hess=objective.hessian, method="trust-exact", callback=watch,
        options={"initial_trust_radius": 0.3, "max_trust_radius": 1.0, "maxiter": rounds, "gtol": 1e-6 * seen[0]},
    )  # fmt: skip
    return np.asarray(found.x), len(seen) - 1


def _score(model: Model, objective: Objective, pilot: Pilot, speeds: Sequence[float]) -> Score:
    found, shown = [], []
    for case in objective.cases:
        seen = case.fly(pilot)
        found.append(price(case, seen))
        if case.craft == 0:
            shown.append(_flown(case, seen, found[-1]))
    mean = Price(*(float(np.mean([getattr(p, name) for p in found])) for name in ("tracking", "fins", "rates")))
    fence, noise = objective.fence.cost(pilot), objective.noise.cost(pilot)
    return Score(mean, fence, noise, tuple(shown), tuple(_margins(model, pilot, u) for u in speeds))


def _margins(model: Model, pilot: Pilot, speed: float) -> RobustMargins | None:
    try:
        return robust_margins(model, pilot, speed)
    except TrialError:
        return None


def _flown(case: Case, seen: Array, cost: Price) -> Flown:
    """What one flight looks like."""
    rms = np.sqrt(np.mean((seen - case.wanted) ** 2, axis=0))
    swept = np.abs(np.diff(seen[:, 3:], axis=0, prepend=case.wanted[None, 3:])).sum(axis=0).mean()
    return Flown(
        case.name, case.speed, cost, float(np.degrees(rms[0])), float(rms[1]), float(np.degrees(rms[2])),
        float(np.degrees(np.sqrt(np.mean(rms[3:] ** 2)))), float(np.degrees(swept)) / (case.speed * case.leg.within),
    )  # fmt: skip
