"""A user's own load: a Python function in the style of the model's terms, one more entry in the sum of eq. 2.9."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

from towtank.errors import InputError
from towtank.model.algebra import MATH, Ops, Scalar, Vector

Load = Callable[[Vector, Vector, Vector, Any, Ops], Sequence[Scalar]]
"""load(nu, down, delta, c, ops) -> (6,); see ``ExtraLoad``."""


@dataclass(frozen=True)
class ExtraLoad:
    """A load that the derivatives do not hold, such as a tether, a towed array or a second rudder.

    name : a word, for tables and files.   values : the numbers of the load by name, SI.
    load(nu, down, delta, c, ops) -> (6,) : the load on the body [N, N m] about the origin, in body axes, from nu (6,)
        through the water [m/s, rad/s], down (3,), the unit vector of gravity in body axes, delta (n_fins,) [rad] and
        c, the ``values`` as attributes. It must run on floats, arrays and symbols alike: elementary functions from
        ``ops``, and no ``if`` on its arguments.

    Two extra loads are equal when name, function and values are; a function made twice counts as two.
    """

    name: str
    load: Load
    values: Mapping[str, Scalar] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash((self.name, self.load, frozenset(self.values)))

    def with_values(self, values: Mapping[str, Scalar]) -> ExtraLoad:
        """The same load with some of its ``values`` replaced: numbers, arrays or symbols."""
        return replace(self, values={**self.values, **values})


def extra_load(extra: ExtraLoad, nu: Vector, down: Vector, delta: Vector, ops: Ops) -> list[Scalar]:
    """The load (6,) [N, N m] of ``extra``; arguments as in ``ExtraLoad``."""
    return list(extra.load(nu, down, delta, SimpleNamespace(**extra.values), ops))


def check_extra(extra: ExtraLoad, fins: int) -> None:
    """Call the load once on floats, as a craft with ``fins`` fins would, and refuse what cannot be used.

    Raises
    ------
    InputError
        The name or a value's name is not a Python name, a value is not a finite number, the function fails, or it
        does not give six finite numbers.
    """
    where = f"extra load {extra.name!r}"
    for word in (extra.name, *extra.values):
        if not word.isidentifier():
            raise InputError(f"{where}: {word!r} is not a name. Use letters, digits and _, and no digit in front.")
    for name, value in extra.values.items():
        if isinstance(value, int | float) and not math.isfinite(value):
            raise InputError(f"{where}: {name} is {value}. Give a finite number.")
    nu, down, delta = [1.0, 0.1, -0.1, 0.05, -0.05, 0.1], [0.0, 0.0, 1.0], [0.05] * fins
    try:
        load = [float(x) for x in extra_load(extra, nu, down, delta, MATH)]
    except Exception as error:
        raise InputError(
            f"{where}: the function fails on floats ({type(error).__name__}: {error}). It is called as "
            f"load(nu, down, delta, c, ops) with sequences of 6, 3 and {fins} numbers, its values as attributes of c, "
            "and sin, cos, sqrt and the like in ops."
        ) from error
    if len(load) != 6 or not all(map(math.isfinite, load)):
        raise InputError(
            f"{where}: the function gave {load}. It must give six finite numbers: X, Y, Z, K, M, N [N, N m]."
        )
