"""Small matrices of scalars, for one text that runs on floats, arrays and symbols.

A matrix is a nested list. A structural zero is the literal ``0``: products skip it, so what the source prints as zero
costs nothing and leaves no trace in generated code. A scalar is a float, an array (one entry per member of a batch) or
a symbol; no function asks for the truth of a scalar, so there is no branch on a state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import mul
from types import SimpleNamespace
from typing import Any, Protocol, cast

import numpy as np

Scalar = Any
"""A float, an array of any shape, or a symbol."""

Vector = Sequence[Scalar]
Matrix = Sequence[Sequence[Scalar]]

ZERO = 0
"""The structural zero. Python keeps one object for it, so identity tells it from a number that happens to be 0.0."""


class Ops(Protocol):
    """The elementary functions the equations need, for one kind of number."""

    @property
    def sin(self) -> Callable[[Scalar], Scalar]:
        """Sine."""

    @property
    def cos(self) -> Callable[[Scalar], Scalar]:
        """Cosine."""

    @property
    def fabs(self) -> Callable[[Scalar], Scalar]:
        """Absolute value."""

    @property
    def sqrt(self) -> Callable[[Scalar], Scalar]:
        """Square root."""

    @property
    def fmin(self) -> Callable[[Scalar, Scalar], Scalar]:
        """Smaller of two."""

    @property
    def fmax(self) -> Callable[[Scalar, Scalar], Scalar]:
        """Larger of two."""

    @property
    def atan2(self) -> Callable[[Scalar, Scalar], Scalar]:
        """Angle of the point (second, first)."""

    @property
    def floor(self) -> Callable[[Scalar], Scalar]:
        """Largest whole number that is not larger."""

    @property
    def positive(self) -> Callable[[Scalar], Scalar]:
        """1.0 where the argument is larger than zero, else 0.0."""


MATH: Ops = cast(
    Ops,
    SimpleNamespace(
        sin=math.sin,
        cos=math.cos,
        fabs=math.fabs,
        sqrt=math.sqrt,
        fmin=min,
        fmax=max,
        atan2=math.atan2,
        floor=lambda x: float(math.floor(x)),
        positive=lambda x: 1.0 if x > 0.0 else 0.0,
    ),
)
"""Functions of floats."""

NUMPY: Ops = cast(
    Ops,
    SimpleNamespace(
        sin=np.sin,
        cos=np.cos,
        fabs=np.fabs,
        sqrt=np.sqrt,
        fmin=np.fmin,
        fmax=np.fmax,
        atan2=np.arctan2,
        floor=np.floor,
        positive=lambda x: np.asarray(np.greater(x, 0.0), dtype=float),
    ),
)
"""Functions of arrays."""


_PLAIN = {float, int}


def ops_for(*scalars: Scalar) -> Ops:
    """``NUMPY`` when any of ``scalars`` is an array with at least one axis, else ``MATH``."""
    if {*map(type, scalars)} <= _PLAIN:
        return MATH
    return NUMPY if any(isinstance(x, np.ndarray) and x.ndim for x in scalars) else MATH


def product(matrix: Matrix, vector: Vector) -> list[Scalar]:
    """Matrix times vector; structural zeros are skipped.

    Floats take a shorter way to the same sums: multiplying by the structural zero is cheaper than asking for it.
    """
    if type(vector[0]) is not float:
        return [sum([a * b for a, b in zip(row, vector, strict=True) if a is not ZERO]) for row in matrix]
    if len(vector) == 3:
        x1, x2, x3 = vector
        return [a1 * x1 + a2 * x2 + a3 * x3 for a1, a2, a3 in matrix]
    if len(vector) != 6:
        return [sum(map(mul, row, vector)) for row in matrix]
    x1, x2, x3, x4, x5, x6 = vector
    return [a1 * x1 + a2 * x2 + a3 * x3 + a4 * x4 + a5 * x5 + a6 * x6 for a1, a2, a3, a4, a5, a6 in matrix]


def product_transposed(matrix: Matrix, vector: Vector) -> list[Scalar]:
    """Transposed matrix times vector."""
    return product([*zip(*matrix, strict=True)], vector)


@dataclass(frozen=True)
class Table:
    """A piecewise-linear table: ``knots`` (n,), the value at the first of them, and the ``slopes`` (n - 1,) between.

    With the slopes stored, nothing is divided where the table is used. A table may be carried on with its last knot
    repeated and slopes of zero; its values stay the same.
    """

    knots: Sequence[Scalar]
    first: Scalar
    slopes: Sequence[Scalar]


def table_of(knots: Sequence[float], values: Sequence[float]) -> Table:
    """The table through ``values`` (n,) at ``knots`` (n,), which must rise."""
    slopes = ((values[i + 1] - values[i]) / (knots[i + 1] - knots[i]) for i in range(len(knots) - 1))
    return Table(tuple(knots), values[0], tuple(slopes))


def interpolate(x: Scalar, table: Table, ops: Ops) -> Scalar:
    """Value of ``table`` at ``x``, held constant beyond its ends; a sum of ramps, so it works on symbols too."""
    total = table.first
    for low, high, slope in zip(table.knots, table.knots[1:], table.slopes, strict=False):
        total = total + slope * (ops.fmin(ops.fmax(x, low), high) - low)
    return total


def frozen(matrix: Any) -> list[list[Scalar]]:
    """A constant array (n, m) as nested lists with the literal ``0`` wherever the entry is exactly zero."""
    return [[float(a) if a != 0.0 else ZERO for a in row] for row in np.asarray(matrix, dtype=float)]
