"""Direct spiral: the rudder is stepped from one side to the other and back, and the yaw rate is read at every step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Leg
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity
from towtank.trials.ready import Readings, Ready, run_trial
from towtank.trials.start import Setting, angle, fin_limit, setting
from towtank.trials.steady import SteadyTurns, steady_turns
from towtank.trials.trajectory import Trajectory

STEPS = (1.0, 0.7, 0.45, 0.3, 0.2, 0.1, 0.0)
"""Rudder steps as shares of the largest angle, closer towards amidships where a loop would be."""
FIRST, EACH = 10.0, 5.0
"""Lengths travelled on the first step and on each of the others before the rate is read."""
WATCHED = 0.25
"""Share of a step, its last, over which the change of the rate says how steady the step was."""


def spiral(
    model: Model,
    largest: Quantity = "15 deg",
    speed: Quantity | None = None,
    *,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Quasi-steady spiral from +largest to -largest rudder and back, with the algebraic S-curve beside it.

    Parameters
    ----------
    largest : rudder; text with a unit or radians.   speed : approach speed.   hold_depth : see ``turning_circle``.

    Indices: loop width [deg of rudder, between the angles at which the rate changes sign] and height [deg/s, between
    the branches at zero rudder], both zero for a stable craft but for the lag of the steps; slope of yaw rate against
    rudder at zero [1/s]; ``residual_change``: the largest change of the rate over the last quarter of a step, in per
    cent of the largest rate, which says how steady the steps were; width, height and slope of the algebraic curve.
    ``provenance["curves"]`` holds "spiral" (rudder [deg], rate [deg/s], sweep) and "steady turns" (rudder, rate,
    drift [deg], speed [m/s]).

    Source     ittc75040201, direct (Dieudonne) spiral.
    Valid      The measured width is known to within one rudder step near its edges.
    """
    return run_trial(model, spiral_ready(model, largest, speed, hold_depth, pilot))


def spiral_ready(
    model: Model,
    largest: Quantity = "15 deg",
    speed: Quantity | None = None,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The spiral, ready to fly; arguments as in ``spiral``."""
    limit = angle(largest, "largest", fin_limit(model), "the limit of the fins")
    s = setting(model, speed, pilot, piloted=hold_depth)
    rudders = limit * np.array([*STEPS, *(-x for x in reversed(STEPS[:-1]))])
    sweep = np.concatenate([rudders, rudders[::-1][1:]])
    turns = steady_turns(model, s.speed)
    # Turning slows the craft down, so a length takes longer than at the approach speed.
    reached = np.abs(turns.rudder) <= 1.05 * abs(limit)
    convective = s.convective * s.speed / max(float(turns.speed[reached].min()), 0.3 * s.speed)
    return Ready(
        name=f"spiral-{np.degrees(limit):g}deg", kind="spiral", loop="open", setting=s,
        legs=held_steps(_orders(s, sweep, float(hold_depth)), _lasting(len(sweep), convective)),
        interval=s.convective / 8.0, read=lambda flights: _indices(flights, rudders), alone=algebraic(turns),
        curves=lambda flights: _curves(flights, sweep, turns),
    )  # fmt: skip


def _orders(s: Setting, sweep: Array, dive: float) -> list[Orders]:
    return [s.orders(rudder=float(rudder), dive=dive) for rudder in sweep]


def _lasting(steps: int, convective: float) -> list[float]:
    return [(EACH if i else FIRST) * convective for i in range(steps)]


def held_steps(orders: Sequence[Orders], lasting: Sequence[float]) -> tuple[Leg, ...]:
    """Two legs for each order, "step N settling" and "step N", its last quarter; ``lasting`` [s] each."""
    legs = []
    for i, (order, seconds) in enumerate(zip(orders, lasting, strict=True)):
        legs += [
            Leg(f"step {i} settling", order, (1.0 - WATCHED) * seconds), Leg(f"step {i}", order, WATCHED * seconds),
        ]  # fmt: skip
    return tuple(legs)


def step_rates(flights: Flights, steps: int) -> tuple[Array, Array]:
    """Turning rate (N, steps) [rad/s] at the end of every step, and its change over the part that is watched."""
    end = np.stack([flights.at(f"step {i}", "turn", event=False) for i in range(steps)], axis=-1)
    before = np.stack([flights.at(f"step {i} settling", "turn", event=False) for i in range(steps)], axis=-1)
    return end, end - before


def residual(end: Array, change: Array) -> Array:
    """Largest of the changes (N, steps) in per cent of the largest rate ``end`` (N, steps)."""
    largest = np.fmax.reduce(np.abs(end), axis=1)
    with np.errstate(all="ignore"):
        share = 100.0 * np.fmax.reduce(np.abs(change), axis=1) / largest
    # A craft that has not turned at all was steady.
    return np.where(largest == 0.0, 0.0, share)


def _indices(flights: Flights, rudders: Array) -> Readings:
    rate, change = step_rates(flights, 2 * len(rudders) - 1)
    down, up = rate[:, : len(rudders)], rate[:, len(rudders) - 1 :][:, ::-1]
    return {**_loop(rudders, down, up), "residual_change": (residual(rate, change), "%")}


def _loop(rudders: Array, down: Array, up: Array) -> Readings:
    """Width, height and slope from the two sweeps (N, K) over the same rudder angles (K,); NaN unless all were run."""
    middle = int(np.argmin(np.abs(rudders)))
    mean = 0.5 * (down + up)
    slope = (mean[:, middle + 1] - mean[:, middle - 1]) / (rudders[middle + 1] - rudders[middle - 1])
    height = np.abs(down[:, middle] - up[:, middle])
    missing = np.isnan(down).any(axis=1) | np.isnan(up).any(axis=1)
    width = np.abs(_turnover(rudders, down) - _turnover(rudders, up))
    return {
        "loop_width": (np.where(missing, np.nan, np.degrees(width)), "deg"),
        "loop_height": (np.where(missing, np.nan, np.degrees(height)), "deg/s"),
        "slope": (np.where(missing, np.nan, slope), "1/s"),
    }


def _turnover(rudders: Array, rate: Array) -> Array:
    """Rudder (N,) [rad] at which the yaw rate (N, K) of a sweep changes sign, by straight lines between the steps."""
    turned = np.diff(np.sign(rate), axis=1) != 0.0
    k, rows = np.argmax(turned, axis=1), np.arange(len(rate))
    before, after = rate[rows, k], rate[rows, k + 1]
    with np.errstate(all="ignore"):
        at = rudders[k] - before * (rudders[k + 1] - rudders[k]) / (after - before)
    return np.where(turned.any(axis=1), at, np.nan)


def _curves(flights: Flights, sweep: Array, turns: SteadyTurns) -> dict[str, Any]:
    """The measured curve of one craft, as far as it got, and the algebraic one."""
    rate = step_rates(flights, len(sweep))[0][0]
    got = int(np.count_nonzero(~np.isnan(rate)))
    down = min((len(sweep) + 1) // 2, got)
    return {
        "spiral": {
            "rudder": np.degrees(sweep[:got]),
            "rate": np.degrees(rate[:got]),
            "sweep": ["down"] * down + ["up"] * (got - down),
        },
        "steady turns": steady_curve(turns),
    }


def steady_curve(turns: SteadyTurns) -> dict[str, Array]:
    """A curve of steady turns as it is kept with a trial: rudder, drift [deg], rate [deg/s], speed [m/s]."""
    return {
        "rudder": np.degrees(turns.rudder),
        "rate": np.degrees(turns.rate),
        "drift": np.degrees(turns.drift),
        "speed": turns.speed,
    }


def algebraic(turns: SteadyTurns) -> dict[str, tuple[float, str]]:
    """Width, height and slope of the algebraic curve, as indices."""
    return {
        "loop_width_algebraic": (float(np.degrees(turns.rudder_span())), "deg"),
        "loop_height_algebraic": (float(np.degrees(turns.rate_span())), "deg/s"),
        "slope_algebraic": (turns.slope(), "1/s"),
    }
