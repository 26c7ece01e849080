"""The linear system of the regression, compressed without loss.

Each load of each period of each run is reduced by QR to as many rows as it has active columns; what is orthogonal to
them is kept as a sum of squares. Every weighting of runs and loads can then be solved from a few thousand rows.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.derive.cycles import Samples
from towtank.derive.select import Choice
from towtank.frames import Array
from towtank.terms import columns


@dataclass(frozen=True)
class System:
    """matrix (rows, n) @ unknowns (n,) = rhs (rows, 1 + members); n unknowns, R runs.

    run, load, period (rows,) : where a row comes from.
    rest (R, 6) : sum of squares of the nominal load outside the span of the terms.
    power (R, 6) : sum of squares of the nominal load.   count (R,) : samples per run.
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
    """Stack the six loads of all samples.

    Source     perron, eq. 2.13, 2.16, 2.18 in the form of ``towtank.terms``.
    """
    runs = int(samples.run.max()) + 1
    ties = tie_matrix(choice)
    parts = columns(choice.order, samples.nu, samples.nudot, samples.control)
    tied = parts @ ties
    rest, power = np.zeros((runs, 6)), np.zeros((runs, 6))
    rows: list[tuple[Array, Array, tuple[int, int, int]]] = []
    for start, stop in _blocks(samples):
        number, period = int(samples.run[start]), int(samples.period[start])
        for load in range(6):
            a, b = tied[start:stop, load], samples.loads[:, start:stop, load].T
            reduced, right, outside = _compress(a, b)
            rest[number, load] += outside
            power[number, load] += float(b[:, 0] @ b[:, 0])
            if len(reduced):
                rows.append((reduced, right, (number, load, period)))
    where = np.concatenate([np.tile(np.array(label, dtype=np.intp), (len(a), 1)) for a, _, label in rows])
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
    )


def _blocks(samples: Samples) -> list[tuple[int, int]]:
    """First and last-plus-one sample of each run and period."""
    change = np.flatnonzero(np.diff(samples.run) | np.diff(samples.period)) + 1
    edges = np.concatenate([[0], change, [len(samples.run)]])
    return [(int(a), int(b)) for a, b in itertools.pairwise(edges)]


def _compress(a: Array, b: Array) -> tuple[Array, Array, float]:
    """Rows (k, n) and (k, 1 + members) with the same normal equations, and the nominal sum of squares left over."""
    active = np.flatnonzero(np.any(a != 0.0, axis=0))
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
