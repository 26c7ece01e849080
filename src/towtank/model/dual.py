"""Numbers that carry their own gradient, so that the equations of motion give exact first derivatives."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from towtank.frames import Array
from towtank.model.algebra import Ops


class Dual:
    """A float ``value`` with its ``gradient`` (n,) with respect to n chosen variables.

    The rules are the chain rule. ``abs`` has slope 0 at 0, which is exact for the products v|v| of the model. ``floor``
    and ``positive`` are steps: their results are plain numbers, without a gradient.
    """

    __array_ufunc__ = None
    __slots__ = ("gradient", "value")

    def __init__(self, value: float, gradient: Array) -> None:
        self.value = value
        self.gradient = gradient

    def __add__(self, other: Any) -> Dual:
        b = _dual(other, self)
        return Dual(self.value + b.value, self.gradient + b.gradient)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.gradient)

    def __sub__(self, other: Any) -> Dual:
        return self + -_dual(other, self)

    def __rsub__(self, other: Any) -> Dual:
        return _dual(other, self) + -self

    def __mul__(self, other: Any) -> Dual:
        b = _dual(other, self)
        return Dual(self.value * b.value, self.gradient * b.value + self.value * b.gradient)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        b = _dual(other, self)
        ratio = self.value / b.value
        return Dual(ratio, (self.gradient - ratio * b.gradient) / b.value)

    def __rtruediv__(self, other: Any) -> Dual:
        return _dual(other, self) / self


def variables(values: Array) -> list[Dual]:
    """One Dual for each of ``values`` (n,), each a variable of its own."""
    return [Dual(float(value), row) for value, row in zip(values, np.eye(len(values)), strict=True)]


def gradients(results: list[Any], size: int) -> Array:
    """Gradients (len(results), size); plain numbers have none."""
    return np.array([x.gradient if isinstance(x, Dual) else np.zeros(size) for x in results])


def _dual(x: Any, like: Dual) -> Dual:
    return x if isinstance(x, Dual) else Dual(float(x), np.zeros_like(like.gradient))


def _fabs(x: Any) -> Any:
    return Dual(abs(x.value), float(np.sign(x.value)) * x.gradient) if isinstance(x, Dual) else abs(x)


def _sin(x: Any) -> Any:
    return Dual(math.sin(x.value), math.cos(x.value) * x.gradient) if isinstance(x, Dual) else math.sin(x)


def _cos(x: Any) -> Any:
    return Dual(math.cos(x.value), -math.sin(x.value) * x.gradient) if isinstance(x, Dual) else math.cos(x)


def _sqrt(x: Any) -> Any:
    if not isinstance(x, Dual):
        return math.sqrt(x)
    root = math.sqrt(x.value)
    return Dual(root, x.gradient / (2.0 * root))


def _number(x: Any) -> float:
    return x.value if isinstance(x, Dual) else float(x)


def _fmin(a: Any, b: Any) -> Any:
    return a if _number(a) <= _number(b) else b


def _fmax(a: Any, b: Any) -> Any:
    return a if _number(a) >= _number(b) else b


def _atan2(y: Any, x: Any) -> Any:
    angle, square = math.atan2(_number(y), _number(x)), _number(x) ** 2 + _number(y) ** 2
    like = y if isinstance(y, Dual) else x
    if not isinstance(like, Dual) or square == 0.0:
        return angle
    y, x = _dual(y, like), _dual(x, like)
    return Dual(angle, (x.value * y.gradient - y.value * x.gradient) / square)


def _floor(x: Any) -> float:
    return float(math.floor(_number(x)))


def _positive(x: Any) -> float:
    return 1.0 if _number(x) > 0.0 else 0.0


DUAL: Ops = cast(
    Ops,
    SimpleNamespace(
        sin=_sin,
        cos=_cos,
        fabs=_fabs,
        sqrt=_sqrt,
        fmin=_fmin,
        fmax=_fmax,
        atan2=_atan2,
        floor=_floor,
        positive=_positive,
    ),
)
"""Functions of dual numbers."""
