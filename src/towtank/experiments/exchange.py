"""Exact optimal designs by exchange: which of many runs leave the least variance. Arrays only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array

PRIOR = 1e-9
"""Information held on every unknown before any run, as a share of what all candidates together hold on it.

It keeps the matrix regular from the first run on, and is too weak to be felt once the runs speak.
"""

BETTER = 1e-7
"""Least fall of the criterion for which a design is changed; below it lies the round-off."""

PASSES = 30
"""Most passes over the design; a pass without a change ends the search before."""


@dataclass(frozen=True)
class Grid:
    """R candidates that inform n unknowns.

    rows (R, k, n) : rows with rows^T rows the information of a run; zero rows pad the shorter ones.
    cost (R,).   wanted (s, n) : the combinations of unknowns whose variance matters.
    prior (n, n) : information held before any run.
    criterion : "D", the mean over the wanted of the log variance (log of the determinant over s), or "A", the mean
        variance. With one wanted combination both are c-optimality.
    """

    rows: Array
    cost: Array
    wanted: Array
    prior: Array
    criterion: str = "D"

    def information(self, chosen: Sequence[int]) -> Array:
        """Information (n, n) of the runs ``chosen``."""
        picked = self.rows[list(chosen)]
        return np.asarray(self.prior + np.einsum("rki,rkj->ij", picked, picked, optimize=True))

    def value(self, chosen: Sequence[int]) -> float:
        """The criterion of a design; smaller is better."""
        return self._of(_inverse(self.information(chosen)))

    def _of(self, covariance: Array) -> float:
        spread = self.wanted @ covariance @ self.wanted.T
        if self.criterion == "A":
            return float(np.trace(spread)) / len(spread)
        return float(np.linalg.slogdet(spread)[1]) / len(spread)

    def with_each(self, information: Array) -> Array:
        """The criterion (R,) after adding each candidate to a design of ``information``: low-rank updates.

        Source     fedorov1972; atkinson2007, chapter 12 (determinant and inverse after an added run).
        """
        covariance = _inverse(information)
        spread = self.wanted @ covariance @ self.wanted.T
        moved = self.rows @ covariance
        inner = np.eye(self.rows.shape[1]) + moved @ np.swapaxes(self.rows, 1, 2)
        across = moved @ self.wanted.T
        s = len(spread)
        if self.criterion == "A":
            fall = np.einsum("rks,rks->r", across, np.linalg.solve(inner, across))
            return np.asarray((np.trace(spread) - fall) / s)
        size = np.sqrt(np.diag(spread))
        root = np.linalg.cholesky(spread / np.outer(size, size))
        white = (across / size) @ np.linalg.inv(root).T
        left = np.linalg.slogdet(inner - white @ np.swapaxes(white, 1, 2))[1]
        return np.asarray((np.linalg.slogdet(spread)[1] + left - np.linalg.slogdet(inner)[1]) / s)


@dataclass(frozen=True)
class Design:
    """chosen : numbers of the candidates, rising.   value : of the criterion.   cost : of all.

    values : the criterion after each change of the search that led here, never rising.
    """

    chosen: tuple[int, ...]
    value: float
    cost: float
    values: tuple[float, ...] = ()


def optimise(grid: Grid, most: int, budget: float = np.inf, starts: int = 2, seed: int = 0) -> Design:
    """The best design found of at most ``most`` runs whose cost is at most ``budget``. No candidate is taken twice.

    starts : 1 begins from the runs added one by one, each the best; 2 also from those that give most for their cost;
        more begin from random designs drawn with ``seed``.

    Source     fedorov1972 (exchange); cooknachtsheim1980 (compares such searches).
    Departure  A run that is taken out may be replaced by several, because runs differ in cost.
    Valid      A local optimum: no exchange of one run makes it better.
    """
    rng = np.random.default_rng(seed)
    found: list[Design] = []
    for start in range(max(starts, 1)):
        first = _fill(grid, [], most, budget, per_cost=start == 1) if start < 2 else _random(grid, most, budget, rng)
        found.append(exchange(grid, first, most, budget))
    return min(found, key=lambda design: design.value)


def exchange(grid: Grid, start: Sequence[int], most: int, budget: float = np.inf) -> Design:
    """Improve the design ``start`` by exchanges until none helps. The criterion never rises."""
    chosen = _fill(grid, list(start), most, budget)
    value = grid.value(chosen)
    values = [value]
    for _ in range(PASSES):
        before = value
        for out in list(chosen):
            rest = [i for i in chosen if i != out]
            tried = _fill(grid, rest, most, budget)
            new = grid.value(tried)
            if new < value - BETTER * max(abs(value), 1.0):
                chosen, value = tried, new
                values.append(value)
        if value == before:
            break
    return Design(tuple(sorted(chosen)), value, float(grid.cost[chosen].sum()), tuple(values))


def _fill(grid: Grid, chosen: list[int], most: int, budget: float, per_cost: bool = False) -> list[int]:
    """``chosen`` with the best candidates added one by one while there is room and they help."""
    chosen = list(chosen)
    information = grid.information(chosen)
    value = grid.value(chosen)
    free = np.ones(len(grid.cost), dtype=bool)
    free[chosen] = False
    while len(chosen) < most:
        able = free & (grid.cost <= (budget - grid.cost[chosen].sum()) * (1.0 + 1e-12))
        if not able.any():
            break
        after = grid.with_each(information)
        score = (after - value) / grid.cost if per_cost else after
        best = int(np.argmin(np.where(able, score, np.inf)))
        if after[best] > value - BETTER:
            break
        chosen.append(best)
        free[best] = False
        information = information + grid.rows[best].T @ grid.rows[best]
        value = float(after[best])
    return chosen


def _random(grid: Grid, most: int, budget: float, rng: np.random.Generator) -> list[int]:
    chosen: list[int] = []
    spent = 0.0
    for i in rng.permutation(len(grid.cost)):
        if len(chosen) < most and spent + grid.cost[i] <= budget:
            chosen.append(int(i))
            spent += float(grid.cost[i])
    return chosen


def _inverse(information: Array) -> Array:
    inverse = np.linalg.inv(information)
    return np.asarray(0.5 * (inverse + inverse.T))
