"""The control period and the steps that fit a craft."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from towtank.engine.plan import Clock
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model

TICK = 0.1
"""Longest control period [s]: what AUV autopilots run at (5 to 20 Hz)."""
TICKS_PER_LENGTH = 25.0
"""Fewest control periods in the time in which the craft travels its length."""
STEP_PER_LAG = 0.35
"""Longest RK4 step as a share of the shortest lag of the fins, the fastest mode: RK4 follows it to 1e-4 per lag."""
STABLE = 2.5
"""Longest RK4 step allowed, in lags. RK4 is unstable from 2.785 on (real axis)."""


def clock_of(model: Model, speed: float) -> Clock:
    """Control period and RK4 steps for a craft at ``speed`` [m/s], from its length and the lag of its fins."""
    tick = min(TICK, model.craft.length / (max(speed, 1e-3) * TICKS_PER_LENGTH))
    lag = min((float(fin.time_constant) for fin in model.craft.fins), default=math.inf)
    return Clock(tick, max(2, math.ceil(tick / (STEP_PER_LAG * lag) - 1e-9)))


def check_step(model: Model, clock: Clock, columns: Mapping[str, Array]) -> None:
    """Refuse a step that is too long for the fins' lag, the craft's own or one of an ensemble.

    Raises
    ------
    InputError
        The step is longer than ``STABLE`` lags.
    """
    lags = [float(fin.time_constant) for fin in model.craft.fins]
    lags += [float(np.min(values)) for name, values in columns.items() if name.startswith("time_constant")]
    step, lag = clock.tick / clock.steps, min(lags, default=math.inf)
    if 0.0 < STABLE * lag < step:
        raise InputError(
            f"clock: a step of {step:g} s is longer than {STABLE:g} times the fins' lag of {lag:g} s, where RK4 is "
            f"unstable. Take {math.ceil(clock.tick / (STEP_PER_LAG * lag))} steps in a control period of "
            f"{clock.tick:g} s, or leave the clock out."
        )
