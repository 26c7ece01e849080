"""Reverse spiral: the pilot holds rates of turn one after the other, and the rudder that each takes is read."""

from __future__ import annotations

from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Gauge, Stat
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.orders import Orders
from towtank.quantity import Quantity
from towtank.trials.ready import FIN_USE, Readings, Ready, run_trial
from towtank.trials.spiral import algebraic, held_steps, residual, steady_curve, step_rates
from towtank.trials.start import Setting, angle, fin_limit, setting
from towtank.trials.steady import MeasuredTurns, SteadyTurns, steady_turns
from towtank.trials.trajectory import Trajectory

HELD = (1.0, 0.5, 1.0 / 6.0)
"""Rudder angles held open loop, as shares of the largest: where every craft has one steady turn."""
ORDERED = (0.9, 0.72, 0.54, 0.38, 0.24, 0.12, 0.04)
"""Rates of turn ordered, as shares of the rate at the last of ``HELD``; to one side, then to the other."""
FIRST, EACH = 10.0, 6.0
"""Lengths travelled on the first rudder held and the first rate ordered, and on each of the other steps."""
APART = 0.01
"""Points closer than this share of the range of curvature are one."""
LEAST = 8
"""Points that make a curve."""

LET_GO = 0.5
"""Share of the watched part of a step with a fin at its limit, from which on the rate is not held."""

_GAUGES = (Gauge("rudder"), Gauge("turn"), Gauge("ahead"), Gauge("drift"))


def reverse_spiral(
    model: Model,
    largest: Quantity = "15 deg",
    speed: Quantity | None = None,
    *,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Trajectory:
    """Rates of turn held by the pilot, and the rudder that each takes: the whole curve, its unstable branch included.

    At the largest rudder angles, where every craft has one steady turn, the rudder is held instead.

    Parameters
    ----------
    largest : rudder held first, and to the other side last; text with a unit or radians.   speed : approach speed.
    hold_depth : see ``turning_circle``.

    Indices, under the names of the direct ``spiral``: loop width [deg of rudder] between the folds of the curve, zero
    where the rudder falls or rises throughout; loop height [deg/s] between the turning rates that need no rudder; slope
    of yaw rate against rudder at zero [1/s]; ``residual_change``: the largest change of the rate over the last quarter
    of a step, in per cent of the largest rate; width, height and slope of the algebraic curve.
    ``provenance["curves"]`` holds "reverse spiral" and "steady turns": rudder, rate, drift [deg], speed [m/s].

    Source     bech1968; ittc75040201, reverse spiral test.
    Departure  The curve is one over the curvature of the path, as the algebraic one: a speed that still changes moves
               neither its folds nor its zeros.
    Valid      Folds between neighbouring points are those of a cubic; two folds within one gap are not seen.

    Raises
    ------
    InputError
        Rudder zero, beyond the fins, or without a unit.
    """
    return run_trial(model, reverse_spiral_ready(model, largest, speed, hold_depth, pilot))


def reverse_spiral_ready(
    model: Model,
    largest: Quantity = "15 deg",
    speed: Quantity | None = None,
    hold_depth: bool = True,
    pilot: Pilot | None = None,
) -> Ready:
    """The reverse spiral, ready to fly; arguments as in ``reverse_spiral``."""
    limit = angle(largest, "largest", fin_limit(model), "the limit of the fins")
    if limit == 0.0:
        raise InputError('largest: 0 deg makes no turn. Give an angle such as "15 deg".')
    s = setting(model, speed, pilot)
    turns = steady_turns(model, s.speed)
    orders = _orders(s, limit, _inner_rate(model, turns, limit), float(hold_depth))
    return Ready(
        name=f"reverse-spiral-{np.degrees(limit):g}deg", kind="reverse spiral", loop="closed", setting=s,
        legs=held_steps(orders, _lasting(len(orders), s.convective)), interval=s.convective / 8.0,
        gauges=_GAUGES, read=lambda flights: _indices(flights, len(orders)),
        status=lambda flights: _status(flights, len(orders)), alone=algebraic(turns),
        curves=lambda flights: _curves(flights, len(orders), turns),
    )  # fmt: skip


def _inner_rate(model: Model, turns: SteadyTurns, limit: float) -> float:
    """Rate of turn [rad/s], signed, at the smallest rudder held; ``limit`` [rad] is the largest."""
    within = np.abs(turns.rudder) <= HELD[-1] * abs(limit)
    side = np.sign((model.derivatives["Nuudr"] or -1.0) * limit)
    return float(side * np.abs(turns.rate[within]).max())


def _orders(s: Setting, limit: float, rate: float, dive: float) -> list[Orders]:
    """Rudders held, rates ordered from one side to the other, rudders held."""
    held = [s.orders(rudder=share * limit, dive=dive) for share in HELD]
    shares = [*ORDERED, *(-share for share in reversed(ORDERED))]
    rates = [s.orders(steer=1.0, turning=1.0, turn=share * rate, dive=dive) for share in shares]
    return [*held, *rates, *(s.orders(rudder=-share * limit, dive=dive) for share in reversed(HELD))]


def _lasting(steps: int, convective: float) -> list[float]:
    return [(FIRST if i in (0, len(HELD)) else EACH) * convective for i in range(steps)]


def _means(flights: Flights, steps: int) -> Array:
    """Rudder, rate, speed ahead, drift in every step, and the share of it at a limit of the fins: (5, N, steps)."""
    legs = [f"step {k}" for k in range(steps)]
    lasting = np.stack([flights.duration(leg) for leg in legs], axis=-1)
    watched = [*((gauge, Stat.INTEGRAL) for gauge in _GAUGES), (FIN_USE, Stat.ABOVE)]
    sums = [np.stack([flights.stat(leg, gauge, stat) for leg in legs], axis=-1) for gauge, stat in watched]
    return np.array(sums) / lasting


def _measured(means: Array) -> SteadyTurns | None:
    """The curve of one craft from its ``means`` (5, steps); None where it did not go through all, or held too few."""
    if not np.all(np.isfinite(means)):
        return None
    rudder, rate, ahead, drift, at_limit = means.copy()
    at_limit[: len(HELD)] = at_limit[len(at_limit) - len(HELD) :] = 0.0
    curvature = rate / ahead
    order = np.argsort(curvature)
    order = order[at_limit[order] < LET_GO]
    kept = order[np.diff(curvature[order], prepend=-np.inf) > APART * np.ptp(curvature)]
    columns = (curvature, rate, rudder, drift, ahead / np.cos(drift))
    return MeasuredTurns(*(values[kept] for values in columns)) if len(kept) >= LEAST else None


def _indices(flights: Flights, steps: int) -> Readings:
    curves = [_measured(means) for means in np.moveaxis(_means(flights, steps), 1, 0)]
    width, height, slope = (np.array([np.nan if c is None else read(c) for c in curves]) for read in _READ)
    return {
        "loop_width": (np.degrees(width), "deg"),
        "loop_height": (np.degrees(height), "deg/s"),
        "slope": (slope, "1/s"),
        "residual_change": (residual(*step_rates(flights, steps)), "%"),
    }


def _width(curve: SteadyTurns) -> float:
    """Rudder [rad] between the folds; 0 where the points rise or fall throughout."""
    steps = np.diff(curve.rudder)
    return 0.0 if np.all(steps > 0.0) or np.all(steps < 0.0) else curve.rudder_span()


_READ = (_width, SteadyTurns.rate_span, SteadyTurns.slope)


def _status(flights: Flights, steps: int) -> str | None:
    if _measured(_means(flights, steps)[:, 0]) is not None:
        return None
    return (
        f"ended early: fewer than {LEAST} of the {steps} turns were held, so there is no curve. The rudder has too "
        "little effect to hold a rate; give it more angle, or look at Nuudr"
    )


def _curves(flights: Flights, steps: int, turns: SteadyTurns) -> dict[str, Any]:
    """The measured curve of one craft, if there is one, and the algebraic one."""
    measured = _measured(_means(flights, steps)[:, 0])
    found = {"steady turns": steady_curve(turns)}
    return found if measured is None else {"reverse spiral": steady_curve(measured), **found}
