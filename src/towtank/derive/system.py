"""The linear system of the regression, compressed without loss.

Each load of each period of each run is reduced by QR to as many rows as it has active columns; what is orthogonal to
them is kept as a sum of squares. Every weighting of runs and loads can then be solved from a few thousand rows.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.derive.cycles import Samples, scatter
from towtank.derive.select import Choice
from towtank.frames import Array
from towtank.symbols import LOADS, TERMS
from towtank.terms import columns, regressor

CHUNK = 8192
"""Samples whose regressors are held at a time: enough for numpy to work in long loops, few enough for the cache."""


@dataclass(frozen=True)
class System:
    """matrix (rows, n) @ unknowns (n,) = rhs (rows, 1 + members); n unknowns, R runs.

    run, load, period (rows,) : where a row comes from.
    rest (R, 6) : sum of squares of the nominal load outside the span of the terms.
    power (R, 6) : sum of squares of the nominal load.   count (R,) : samples per run.
    fresh (R, 6) : half the mean square difference of a load from one period to the next, NaN with one period.
    """

    names: tuple[str, ...]
    matrix: Array
    rhs: Array
    run: NDArray[np.intp]
    load: NDArray[np.intp]
    period: NDArray[np.intp]
    rest: Array
    power: Array
    count: Array
    fresh: Array

    def keep(self, indices: list[int]) -> System:
        """The system with only the unknowns ``indices``."""
        return replace(self, names=tuple(self.names[i] for i in indices), matrix=self.matrix[:, indices])

    def squares(self, unknowns: Array) -> Array:
        """Sum of squared residuals (R, 6) of the nominal loads for ``unknowns`` (n,)."""
        error = (self.rhs[:, 0] - self.matrix @ unknowns) ** 2
        out = self.rest.copy()
        np.add.at(out, (self.run, self.load), error)
        return np.asarray(out)


def tie_matrix(choice: Choice) -> Array:
    """Matrix (terms, unknowns) that turns unknowns into the terms ``choice.order``."""
    ties = np.zeros((len(choice.order), len(choice.unknowns)))
    for i, name in enumerate(choice.order):
        base, sign = choice.members[name]
        ties[i, choice.unknowns.index(base)] = sign
    return ties


def build(samples: Samples, choice: Choice) -> System:
    """Stack the six loads of all samples, some runs at a time, so that memory does not grow with the campaign.

    Source     perron, eq. 2.13, 2.16, 2.18 in the form of ``towtank.terms``.
    """
    runs = int(samples.run.max()) + 1
    acting = _acting(choice)
    rest, power = np.zeros((runs, 6)), np.zeros((runs, 6))
    rows: list[tuple[Array, Array, tuple[int, int, int]]] = []
    blocks = _blocks(samples)
    for first, last in _chunks(blocks):
        parts = _columns(samples, slice(first, last), choice, acting)
        for start, stop in (edges for edges in blocks if first <= edges[0] < last):
            number, period = int(samples.run[start]), int(samples.period[start])
            for load, (part, index) in enumerate(zip(parts, acting, strict=True)):
                a, b = part[:, start - first : stop - first], samples.loads[:, start:stop, load].T
                reduced, right, outside = _compress(a.T, b)
                rest[number, load] += outside
                power[number, load] += float(b[:, 0] @ b[:, 0])
                if len(reduced):
                    full = np.zeros((len(reduced), len(choice.unknowns)))
                    full[:, index] = reduced
                    rows.append((full, right, (number, load, period)))
    where = np.repeat(np.array([label for *_, label in rows], dtype=np.intp), [len(a) for a, *_ in rows], axis=0)
    return System(
        choice.unknowns,
        np.concatenate([a for a, _, _ in rows]),
        np.concatenate([b for _, b, _ in rows]),
        where[:, 0],
        where[:, 1],
        where[:, 2],
        rest,
        power,
        np.bincount(samples.run, minlength=runs).astype(float),
        scatter(samples, runs),
    )


def _acting(choice: Choice) -> list[list[int]]:
    """For each of the six loads the unknowns that may act on it."""
    rng = np.random.default_rng(0)
    nu, nudot, control = rng.standard_normal((1, 6)), rng.standard_normal((1, 6)), np.ones((1, 4))
    tied = columns(choice.order, nu, nudot, control)[0] != 0.0
    return [list(np.flatnonzero(tied[load] @ (tie_matrix(choice) != 0.0))) for load in range(6)]


def _columns(samples: Samples, at: slice, choice: Choice, acting: list[list[int]]) -> list[Array]:
    """For each load the columns of the unknowns that may act on it, (k, N) over the samples ``at``."""
    nu, nudot, control = samples.nu[at], samples.nudot[at], samples.control[at]
    out = [np.zeros((len(index), len(nu))) for index in acting]
    for name in choice.order:
        base, sign = choice.members[name]
        unknown = choice.unknowns.index(base)
        load = regressor(TERMS[name], nu, nudot, control)
        for k, index in enumerate(acting):
            if unknown in index and (k == LOADS.index(TERMS[name].load) or TERMS[name].is_added_mass):
                out[k][index.index(unknown)] += sign * load[:, k]
    return out


def _chunks(blocks: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """First and last-plus-one sample of groups of whole blocks, CHUNK samples or the one block that is longer."""
    first = blocks[0][0]
    for start, stop in blocks:
        if stop - first > CHUNK and start > first:
            yield first, start
            first = start
    yield first, blocks[-1][1]


def _blocks(samples: Samples) -> list[tuple[int, int]]:
    """First and last-plus-one sample of each run and period."""
    change = np.flatnonzero(np.diff(samples.run) | np.diff(samples.period)) + 1
    edges = np.concatenate([[0], change, [len(samples.run)]])
    return [(int(a), int(b)) for a, b in itertools.pairwise(edges)]


def _compress(a: Array, b: Array) -> tuple[Array, Array, float]:
    """Rows (k, n) and (k, 1 + members) with the same normal equations, and the nominal sum of squares left over."""
    active = np.flatnonzero(a.any(axis=0))
    if not len(active):
        return np.zeros((0, a.shape[1])), np.zeros((0, b.shape[1])), float(b[:, 0] @ b[:, 0])
    if len(a) <= len(active):
        return a, b, 0.0
    q, r = np.linalg.qr(a[:, active])
    reduced = np.zeros((len(r), a.shape[1]))
    reduced[:, active] = r
    right = q.T @ b
    left = b[:, 0] - q @ right[:, 0]
    return reduced, right, float(left @ left)
