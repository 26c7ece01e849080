"""Predictive control: rudder and elevator by a quadratic programme over a receding horizon, fins' limits included."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag, solve_discrete_are
from scipy.signal import cont2discrete

from towtank.engine.plan import Leg, Log
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.errors import InputError, TowtankError
from towtank.frames import Array
from towtank.model.linear import linearise_at
from towtank.pilot.loops import STATES
from towtank.pilot.orders import Orders
from towtank.tuning.cases import ASKEW, SEEN, Case

HELD = ("rudder", "elevator")
"""What is commanded; roll is left to the righting moment, as in every flight without a pilot."""
PER_LENGTH = 12.5
"""Decisions while the craft travels its length."""
HORIZON = 40
"""Decisions looked ahead: about three lengths. Beyond it the cost is that of the regulator without limits."""
LEARN = 0.1
"""Share of the last error of prediction that is taken for lasting."""
SPACING = 0.05
"""Logarithm of the speed between two models."""
SOLVERS = ("daqp", "qrqp")
"""Solvers of CasADi, the first that is there: dense active-set, and CasADi's own, seven times slower."""
_SEEN = ("z", "phi", "theta", "psi", "ahead", "slip", "plunge", "p", "q", "r")
"""Channels of the engine behind ``STATES``."""


@dataclass(frozen=True)
class Predicted:
    """A flight under predictive control.

    seen (ticks, 3 + n) : channels as of ``Case.fly``.   command (decisions, 2) : rudder and elevator asked [rad].
    seconds : of each decision, mean and longest.   period [s] : between decisions.   failed : decisions for which the
    programme had no solution and the last command was kept.
    """

    seen: Array
    command: Array
    seconds: tuple[float, float]
    period: float
    failed: int


@dataclass(frozen=True)
class Programme:
    """The quadratic programme of one decision, condensed to the changes of the commands.

    X = [state, lagged rudder and elevator, last command] (14,) as deviations from level flight on the ordered course.
    A (14, 14), B (14, 2) : over one decision.   hessian (2 N, 2 N), slope (2 N, 14) : of the cost in the changes; the
    slope is linear in X less its target.   target (14, 14) : X that holds the orders against a lasting error.
    sums (n N, 2 N), steps (n N, 2 N), held (n N, 14) : angles and changes of the n fins, from the changes and from X.
    level (n N,) : their angles in level flight.   limits, rates (n N,) : angle and change between decisions [rad].
    """

    A: Array
    B: Array
    hessian: Array
    slope: Array
    target: Array
    sums: Array
    steps: Array
    held: Array
    level: Array
    limits: Array
    rates: Array


def programme(case: Case, speed: float, period: float, horizon: int = HORIZON) -> Programme:
    """The programme at ``speed`` [m/s]: the cost is that of the tuning, with the regulator's behind the horizon.

    Source     Receding horizon with a terminal cost from the discrete Riccati equation (scipy); exact discretisation;
               a steady target for the estimated error, so that orders are held without standing error.
    Valid      About level, straight flight; one lag for all fins, the largest.
    """
    lag, n, m = max(float(fin.time_constant) for fin in case.model.craft.fins), len(STATES), len(HELD)
    state = np.where(np.arange(len(case.setting.state)) == 6, speed, case.setting.state)
    part = linearise_at(case.model, list(state), case.setting.thrust).part(STATES, HELD)
    whole = np.block([[part.A, part.B], [np.zeros((m, n)), -np.eye(m) / lag]])
    into = np.vstack([np.zeros((n, m)), np.eye(m) / lag])
    Ad, Bd = cont2discrete((whole, into, np.eye(n + m), np.zeros((n + m, m))), period)[:2]
    A, B = np.block([[Ad, Bd], [np.zeros((m, n + m)), np.eye(m)]]), np.vstack([Bd, np.eye(m)])
    mixing = np.asarray(case.model.craft.mixing, dtype=float)[:, :m]
    Q = np.zeros((len(A), len(A)))
    for name, scale in zip(SEEN, case.scale, strict=False):
        Q[STATES.index(name), STATES.index(name)] = scale**-2.0
    Q[n : n + m, n : n + m] = mixing.T @ mixing / case.scale[-1] ** 2
    # Fins that follow a change within a period move by it: their mean speed is the change over the period.
    R = mixing.T @ mixing / (period * case.rate) ** 2
    powers = [np.eye(len(A))]
    for _ in range(horizon):
        powers.append(A @ powers[-1])
    zero = np.zeros((len(A), m))
    moved = np.block([[powers[i - j] @ B if j <= i else zero for j in range(horizon)] for i in range(horizon)])
    heavy = moved.T @ block_diag(*[Q] * (horizon - 1), solve_discrete_are(A, B, Q, R))
    fins = case.model.craft.fins
    return Programme(
        A, B, heavy @ moved + block_diag(*[R] * horizon), heavy @ np.vstack(powers[1:]), _target(A),
        np.kron(np.tril(np.ones((horizon, horizon))), mixing), np.kron(np.eye(horizon), mixing),
        np.tile(np.hstack([np.zeros((len(fins), n + m)), mixing]), (horizon, 1)),
        np.tile(mixing @ [0.0, case.setting.trim.elevator], horizon),
        np.tile([float(fin.max_angle) for fin in fins], horizon),
        period * np.tile([float(fin.max_rate) for fin in fins], horizon),
    )  # fmt: skip


def _target(A: Array) -> Array:
    """Map (14, 14) from a lasting error b to the steady X = A X + b with heading and depth as ordered."""
    ordered = np.eye(len(A))[[STATES.index("psi"), STATES.index("z")]]
    inverse = np.linalg.pinv(np.vstack([A - np.eye(len(A)), ordered]), rcond=1e-10)
    return np.asarray(-inverse[:, : len(A)])


def fly_predictive(case: Case, horizon: int = HORIZON) -> Predicted:
    """Fly ``case`` under predictive control, one leg of the engine for each decision.

    The model of each decision is that of the speed through the water, in steps of ``SPACING``. The fins stand askew as
    in ``Case.start``; what the prediction misses is estimated and added to it. Commands are decided from the true
    state, at once.

    Source     Receding-horizon control of a linear model, the programme solved by CasADi's interface to ``SOLVERS``.
    Valid      Speeds that stay well above the elevator's inversion speed in the turn; pitch and rate of turn have no
               limit of their own.

    Raises
    ------
    TowtankError
        CasADi is not installed.
    InputError
        A horizon below 2.
    """
    if horizon < 2:
        raise InputError(f"predictive control: a horizon of {horizon} decisions. Look two or more ahead.")
    clock, s, ticks = case.record.clock, case.setting, len(case.record.row)
    every = max(1, round(s.convective / (PER_LENGTH * clock.tick)))
    plans: dict[int, Programme] = {}
    now, level, askew = at(s.state), np.array([0.0, s.trim.elevator]), ASKEW * (-1.0) ** case.craft
    seen, spent, commands, failed, solver = [], [], [], 0, None
    X, held = _deviation(case, None, np.zeros(2)), np.zeros(2)
    bias: Array = np.zeros(len(X))
    for first in range(0, ticks, every):
        pace = round(float(np.log(max(X[STATES.index("u")] + s.trim.u, 0.2 * s.speed) / s.speed)) / SPACING)
        if pace not in plans:
            plans[pace] = programme(case, s.speed * float(np.exp(SPACING * pace)), every * clock.tick, horizon)
        plan, solver = plans[pace], solver or _solver(plans[pace])
        begin = time.perf_counter()
        change, solved = _decide(solver, plan, X, plan.target @ bias)
        spent.append(time.perf_counter() - begin)
        held, failed = held + change, failed + (not solved)
        commands.append(held + level)
        expected = plan.A @ X + plan.B @ change
        leg = _leg(case.leg.orders, commands[-1] + askew, min(every, ticks - first) * clock.tick)
        flown = fly(case.model, now, [leg], thrust=s.thrust, clock=clock, log=Log(), threads=1)
        now, rows = flown.state[0], flown.log[0, 1:]
        seen.append(rows[:, [flown.names.index(name) for name in case.channels]])
        if not np.isfinite(rows).all():
            break
        X = _deviation(case, dict(zip(flown.names, rows[-1], strict=True)), held, X)
        bias = bias + LEARN * (X - expected - bias)
    out = np.full((ticks, len(case.channels)), np.nan)
    out[: sum(len(rows) for rows in seen)] = np.vstack(seen)
    out[:, 0] = np.unwrap(np.nan_to_num(out[:, 0]))
    return Predicted(out, np.array(commands), (float(np.mean(spent)), max(spent)), every * clock.tick, failed)


def _leg(orders: Orders, command: Array, within: float) -> Leg:
    asked = replace(orders, piloted=0.0, rudder=float(command[0]), elevator=float(command[1]))
    return Leg("predicted", asked, within)


def _deviation(case: Case, seen: dict[str, float] | None, held: Array, last: Array | None = None) -> Array:
    """X (14,) of the channels ``seen``; of the start of the flight without them."""
    s = case.setting
    trim = {"theta": s.trim.pitch, "ahead": s.trim.u, "plunge": s.trim.w}
    at_start = dict.fromkeys((*_SEEN, *case.channels), 0.0) | trim
    at_start |= dict(zip(case.channels[3:], s.state[12:], strict=True))
    got = at_start if seen is None else seen
    order = {"z": case.wanted[1], "psi": case.wanted[0]}
    x = np.array([got[name] - trim.get(name, 0.0) - order.get(name, 0.0) for name in _SEEN])
    psi = _SEEN.index("psi")
    near = 0.0 if last is None else last[psi]
    x[psi] = near + (x[psi] - near + np.pi) % (2.0 * np.pi) - np.pi
    angles = case.model.virtual([got[name] for name in case.channels[3:]])
    return np.concatenate([x, [angles[0], angles[1] - s.trim.elevator], held])


def _solver(plan: Programme) -> Any:
    try:
        import casadi as ca
    except ImportError:
        raise TowtankError(
            "predictive control needs CasADi, which is not installed. Install the extra: "
            'pip install "towtank[optimal]".'
        ) from None
    size, rows = len(plan.hessian), 2 * len(plan.limits)
    shapes = {"h": ca.Sparsity.dense(size, size), "a": ca.Sparsity.dense(rows, size)}
    name = next(name for name in SOLVERS if ca.has_conic(name))
    quiet = {"print_iter": False, "print_header": False} if name == "qrqp" else {}
    return ca.conic("decision", name, shapes, {"error_on_fail": False, **quiet})


def _decide(solver: Any, plan: Programme, X: Array, target: Array) -> tuple[Array, bool]:
    """First change of rudder and elevator (2,) [rad], zero where the programme has no solution; whether it has one."""
    standing = plan.held @ X + plan.level
    limits = np.concatenate([plan.limits, plan.rates])
    offset = np.concatenate([standing, np.zeros(len(standing))])
    found = solver(
        h=plan.hessian, g=plan.slope @ (X - target), a=np.vstack([plan.sums, plan.steps]), lba=-limits - offset,
        uba=limits - offset,
    )  # fmt: skip
    solved = bool(solver.stats()["success"])
    return (np.array(found["x"]).ravel()[: len(HELD)] if solved else np.zeros(len(HELD))), solved
