"""How far a number is spread over many craft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
HEAVY = 1.2
"""The second moment beyond this multiple of half the 16-84 % range, or its inverse: tails are not those of a normal."""
LEAST_SHARE = 0.5
"""Share of the craft that must have an index for a standard uncertainty to be stated."""


@dataclass(frozen=True)
class Spread:
    """One number over the drawn craft.

    best : of the best estimate, NaN where it has none.   mean, std, quantiles (5, 25, 50, 75, 95 %) : of the drawn
    craft that have the number.   std : the second moment, or half the 16-84 % range where the tails are heavy.
    share : of the drawn craft that have the number.   drivers : (parameter, rank correlation), strongest first.
    """

    unit: str
    best: float
    mean: float
    std: float
    heavy: bool
    quantiles: tuple[float, ...]
    share: float
    drivers: tuple[tuple[str, float], ...] = ()

    @property
    def band(self) -> tuple[float, float]:
        """5 and 95 % quantiles."""
        return self.quantiles[0], self.quantiles[-1]

    @property
    def uncertainty(self) -> float | None:
        """``std`` where the best estimate has the number and at least half of the craft; else None."""
        stated = self.share >= LEAST_SHARE and math.isfinite(self.best) and math.isfinite(self.std)
        return self.std if stated else None


def spread_of(values: Array, unit: str, drivers: Sequence[tuple[str, float]] = ()) -> Spread:
    """Spread of ``values`` (1 + N,): the best estimate, then the drawn craft."""
    best, drawn = float(values[0]), values[1:]
    there = drawn[np.isfinite(drawn)]
    if not len(there):
        none = (math.nan,) * len(QUANTILES)
        return Spread(unit, best, math.nan, math.nan, False, none, 0.0)
    low, high = quantiles(there, (0.1587, 0.8413))
    middle, moment = 0.5 * float(high - low), float(np.std(there, ddof=1)) if len(there) > 1 else 0.0
    heavy = moment > HEAVY * middle or middle > HEAVY * moment
    return Spread(
        unit, best, float(np.mean(there)), middle if heavy else moment, heavy,
        tuple(float(q) for q in quantiles(there)), len(there) / len(drawn), tuple(drivers),
    )  # fmt: skip


def wilson(count: int, of: int, z: float = 1.96) -> tuple[float, float]:
    """95 % interval of a probability after ``count`` of ``of`` samples.

    Source     wilson1927: the score interval; unlike the normal one it stays within 0 and 1.
    """
    share, square = count / of, z * z / of
    middle = (share + 0.5 * square) / (1.0 + square)
    half = z * math.sqrt(share * (1.0 - share) / of + 0.25 * square / of) / (1.0 + square)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def quantiles(values: Array, at_: Sequence[float] = QUANTILES) -> Array:
    """Quantiles (len(at_), ...) over the first axis, of what is not NaN; NaN where nothing is.

    Source     Linear between the order statistics, as numpy's default.
    """
    ordered = np.sort(values, axis=0)
    count = np.count_nonzero(~np.isnan(values), axis=0)
    out = []
    for q in at_:
        place = q * np.maximum(count - 1, 0)
        low = np.floor(place).astype(np.int64)
        high = np.minimum(low + 1, np.maximum(count - 1, 0))
        a, b = (np.take_along_axis(ordered, i[None], axis=0)[0] for i in (low, high))
        out.append(np.where(count > 0, a + (place - low) * (b - a), np.nan))
    return np.array(out)


def nearest_quantiles(values: Array, at_: Sequence[float] = (QUANTILES[0], QUANTILES[-1])) -> tuple[float, ...]:
    """Quantiles of ``values`` (N,) that may be infinite, each one of the values; NaN where nothing is a number.

    Source     The order statistic nearest to each share.
    """
    there = np.sort(values[~np.isnan(values)])
    if not len(there):
        return (math.nan,) * len(at_)
    return tuple(float(there[round(q * (len(there) - 1))]) for q in at_)
