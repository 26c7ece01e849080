"""Eigenvalues of both planes against speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.verdict.criteria import eigenvalues
from towtank.verdict.many import Many
from towtank.verdict.spread import quantiles

LOW, HIGH, SPEEDS = 0.3, 2.0, 18
"""Range as shares of the craft's speed, and number of speeds: steps of a tenth."""
CRAFT = 500
"""Craft the band rests on at most; its ends then lie within 1 % of the drawn craft of where all would put them."""


@dataclass(frozen=True)
class PlaneSpeeds:
    """One plane against speed. eigenvalues (S, k) [1/s] of the best estimate, least damped first.

    low, high (S,) : 5 and 95 % quantiles of the growth rate over the drawn craft [1/s].
    """

    eigenvalues: tuple[tuple[complex, ...], ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True)
class SpeedSweep:
    """Speeds (S,) [m/s], and plane -> its eigenvalues in straight flight with fixed controls."""

    speed: tuple[float, ...]
    planes: Mapping[str, PlaneSpeeds]


def speed_sweep(craft: Many, low: float = LOW, high: float = HIGH, count: int = SPEEDS) -> SpeedSweep:
    """Eigenvalues of the first craft from ``low`` to ``high`` times its speed, with the band of the others.

    Source     ``towtank.verdict.criteria``: (v, r) without roll, and (w, q, theta) with the righting moment.
    """
    few = Many(craft.model, {name: column[: CRAFT + 1] for name, column in craft.columns.items()})
    speeds = (craft.model.craft.speed * np.linspace(low, high, count)).tolist()
    return SpeedSweep(tuple(speeds), {plane: _plane(few, plane, speeds) for plane in ("horizontal", "vertical")})


def _plane(craft: Many, plane: str, speeds: Sequence[float]) -> PlaneSpeeds:
    found = [eigenvalues(craft, plane, speed) for speed in speeds]
    best = tuple(tuple(row[0][np.lexsort((row[0].imag, -row[0].real))].tolist()) for row in found)
    growth = np.array([row.real.max(axis=1) for row in found])[:, 1:]
    low, high = quantiles(growth.T, (0.05, 0.95)).tolist()
    return PlaneSpeeds(best, tuple(low), tuple(high))
