"""Direct spiral: the rudder is stepped from one side to the other and back, and the yaw rate is read at every step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.helm import Helm
from towtank.pilot.law import Pilot
from towtank.quantity import Quantity
from towtank.trials.integrate import Flight, Leg, free_run
from towtank.trials.outcome import trajectory
from towtank.trials.start import angle, fin_limit, setting
from towtank.trials.steady import SteadyTurns, steady_turns
from towtank.trials.trajectory import Trajectory

STEPS = (1.0, 0.7, 0.45, 0.3, 0.2, 0.1, 0.0)
"""Rudder steps as shares of the largest angle, closer towards amidships where a loop would be."""
FIRST, EACH = 10.0, 5.0
"""Lengths travelled on the first step and on each of the others before the rate is read."""


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
    limit = angle(largest, "largest", fin_limit(model), "the limit of the fins")
    s = setting(model, speed, pilot, piloted=hold_depth)
    base = replace(s.helm, depth=0.0) if hold_depth else replace(s.helm, pilot=None)
    rudders = limit * np.array([*STEPS, *(-x for x in reversed(STEPS[:-1]))])
    sweep = np.concatenate([rudders, rudders[::-1][1:]])
    # Turning slows the craft down, so a length takes longer than at the approach speed.
    turns = steady_turns(model, s.speed)
    reached = np.abs(turns.rudder) <= 1.05 * abs(limit)
    convective = s.convective * s.speed / max(float(turns.speed[reached].min()), 0.3 * s.speed)
    flight = free_run(model, s.state, _legs(base, sweep, convective), thrust=s.thrust, interval=s.convective / 8.0)
    rate, change = _readings(flight, len(sweep))
    count = min(len(rudders), len(rate))
    down, up = rate[:count], rate[len(rudders) - 1 :][::-1]
    complete = len(rate) == len(sweep)
    indices = {
        **(_loop(rudders, down, up) if complete else {}),
        "residual_change": (change, "%"),
        **_algebraic(turns),
    }
    curves = {
        "spiral": {
            "rudder": np.degrees(sweep[: len(rate)]),
            "rate": np.degrees(rate),
            "sweep": ["down"] * count + ["up"] * (len(rate) - count),
        },
        "steady turns": {
            "rudder": np.degrees(turns.rudder),
            "rate": np.degrees(turns.rate),
            "drift": np.degrees(turns.drift),
            "speed": turns.speed,
        },
    }
    return trajectory(
        model, s, flight, name=f"spiral-{np.degrees(limit):g}deg", kind="spiral", loop="open", indices=indices,
        curves=curves,
    )  # fmt: skip


def _legs(base: Helm, sweep: Array, convective: float) -> Iterator[Leg]:
    for i, rudder in enumerate(sweep):
        yield Leg(f"step {i}", replace(base, rudder=float(rudder)), (FIRST if i == 0 else EACH) * convective)


def _readings(flight: Flight, steps: int) -> tuple[Array, float]:
    """Turning rate [rad/s] at the end of each step, and its largest change over the last quarter [% of the largest]."""
    rate, change = [], []
    for i in range(steps):
        inside = np.flatnonzero(flight.leg == i)
        if len(inside) < 4:
            break
        heading, time = flight.state[inside, 5], flight.time[inside]
        turning = np.gradient(heading, time)
        rate.append(float(turning[-2]))
        change.append(abs(float(turning[-2] - turning[-1 - len(inside) // 4])))
    values = np.array(rate)
    largest = float(np.abs(values).max()) if len(values) else 0.0
    return values, 100.0 * max(change) / largest if largest > 0.0 else 0.0


def _loop(rudders: Array, down: Array, up: Array) -> dict[str, tuple[float, str]]:
    """Width, height and slope from the two sweeps over the same rudder angles."""
    middle = int(np.argmin(np.abs(rudders)))
    mean = 0.5 * (down + up)
    slope = float((mean[middle + 1] - mean[middle - 1]) / (rudders[middle + 1] - rudders[middle - 1]))
    width = abs(_turnover(rudders, down) - _turnover(rudders, up))
    return {
        "loop_width": (float(np.degrees(width)), "deg"),
        "loop_height": (float(np.degrees(abs(down[middle] - up[middle]))), "deg/s"),
        "slope": (slope, "1/s"),
    }


def _turnover(rudders: Array, rate: Array) -> float:
    """Rudder [rad] at which the yaw rate of one sweep changes sign, by straight lines between the steps."""
    i = np.flatnonzero(np.diff(np.sign(rate)) != 0)
    if not len(i):
        return float("nan")
    k = int(i[0])
    return float(rudders[k] - rate[k] * (rudders[k + 1] - rudders[k]) / (rate[k + 1] - rate[k]))


def _algebraic(turns: SteadyTurns) -> dict[str, tuple[float, str]]:
    return {
        "loop_width_algebraic": (float(np.degrees(turns.rudder_span())), "deg"),
        "loop_height_algebraic": (float(np.degrees(2.0 * turns.free_rate())), "deg/s"),
        "slope_algebraic": (turns.slope(), "1/s"),
    }
