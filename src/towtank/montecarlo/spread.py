"""How far a number is spread over the drawn craft, and what drives it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array
from towtank.montecarlo.fly import QUANTILES, quantiles

HEAVY = 1.2
"""The second moment beyond this multiple of half the 16-84 % range, or its inverse: tails are not those of a normal."""
LEAST_SHARE = 0.5
"""Share of the craft that must have an index for a standard uncertainty to be stated."""
LEAST_RANK = 0.1
"""Rank correlation below which a derivative is not named, however many craft were drawn."""
SIGNIFICANT = 3.0
"""A rank correlation is named beyond this many of its own standard errors 1/sqrt(N)."""
RANKED = 5000
"""Craft the rank correlations rest on; more change them by less than 0.015."""
TIED = 0.999
"""Rank correlation beyond which two parameters are one."""
ROUND_OFF = 1e-9
"""Range of an index below which its order is that of round-off."""
LEADING = 3
"""Derivatives named for each index."""


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


class Ranks:
    """Rank correlations of numbers with the drawn parameters; ranks of the parameters are taken once."""

    def __init__(self, columns: Mapping[str, Array]) -> None:
        """``columns`` : name -> (N,), without the best estimate.

        Parameters that do not vary are left out. Those tied by symmetry or definition are one, "Muq/Nur"; the sign of
        its correlation is that of the first.
        """
        names = [name for name, values in columns.items() if np.ptp(values[:RANKED]) > 0.0]
        table = np.array([columns[name][:RANKED] for name in names]).reshape(len(names), -1 if names else 0)
        each = _ranked(table) if names else table
        first = [int(np.argmax(np.abs(row) > TIED)) for row in each @ each.T]
        groups = [[name for name, f in zip(names, first, strict=True) if f == i] for i in range(len(names))]
        self.names = tuple("/".join(group) for group in groups if group)
        self._values = table[[i for i, group in enumerate(groups) if group]]
        self._known: dict[bytes, Array] = {}

    def drivers(self, values: Array) -> tuple[tuple[str, float], ...]:
        """The parameters that go most with ``values`` (N,): name and rank correlation, strongest first.

        Source     spearman1904, without a correction for ties.
        Valid      Relations that rise or fall throughout; correlated parameters share what one of them causes.
        """
        kept = values[: self._values.shape[1]]
        there = np.isfinite(kept)
        count = int(np.count_nonzero(there))
        if count < 10 or not self.names or float(np.ptp(kept[there])) <= ROUND_OFF:
            return ()
        mark = there.tobytes()
        if mark not in self._known:
            self._known[mark] = _ranked(self._values[:, there])
        with_each = self._known[mark] @ _ranked(kept[None, there])[0]
        least = max(LEAST_RANK, SIGNIFICANT / math.sqrt(count))
        order = np.argsort(-np.abs(with_each), kind="stable")[:LEADING]
        return tuple((self.names[i], float(with_each[i])) for i in order if abs(with_each[i]) >= least)


def _ranked(rows: Array) -> Array:
    """Ranks along each row, their mean taken off, of unit length."""
    ranks = np.argsort(np.argsort(rows, axis=1, kind="stable"), axis=1, kind="stable").astype(float)
    ranks -= ranks.mean(axis=1, keepdims=True)
    return np.asarray(ranks / np.linalg.norm(ranks, axis=1, keepdims=True))
