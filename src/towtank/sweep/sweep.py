"""What a sweep is: a craft, axes with values, the level of the tank, the trials."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.quantity import Quantity
from towtank.sweep.vary import kind, number, vary
from towtank.tank.fast.tank import LEVEL, FastTank

TRIALS = ("turning_circle", "zigzag", "heading_step")
"""Trials of every point unless others are named."""
MOST = 100_000
"""Points of one sweep: about two days of one core."""


@dataclass(frozen=True)
class Axis:
    """One number of a craft and the values it takes [SI]."""

    name: str
    values: tuple[float, ...]

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return kind(self.name).unit

    @property
    def shown(self) -> tuple[tuple[float, ...], str]:
        """Values and unit as they are printed: angles in degrees."""
        degrees = self.unit == "rad"
        return (tuple(map(math.degrees, self.values)), "deg") if degrees else (self.values, self.unit)

    @property
    def label(self) -> str:
        """Name with the unit as printed."""
        unit = self.shown[1]
        return f"{self.name} [{unit}]" if unit else self.name

    def words(self, value: float) -> str:
        """Name and one value [SI] as printed."""
        return f"{self.name} {math.degrees(value) if self.unit == 'rad' else value:.6g} {self.shown[1]}".rstrip()


@dataclass(frozen=True)
class Sweep:
    """All combinations of the values of ``axes``, the last axis running fastest.

    level : of evidence; the fast tank's.   members : size of its ensemble, 0 for none; it makes P_stable.
    trials : names of ``TRIALS``, carried out at every point.
    """

    craft: Craft
    axes: tuple[Axis, ...]
    level: str = LEVEL
    members: int = 48
    trials: tuple[str, ...] = TRIALS

    def __post_init__(self) -> None:
        """Refuse what cannot be swept.

        Raises
        ------
        InputError
            No axis, an axis twice or without values, values twice, too many points, unknown level or trial.
        """
        names = [axis.name for axis in self.axes]
        if not names or len(set(names)) < len(names):
            raise InputError(f"axes {', '.join(names) or 'none'}: give at least one axis, and each only once.")
        for axis in self.axes:
            kind(axis.name)
            if not axis.values or len(set(axis.values)) < len(axis.values) or not all(map(math.isfinite, axis.values)):
                raise InputError(f"axis {axis.name}: its values must be finite, at least one, none of them twice.")
        if len(self) > MOST:
            raise InputError(f"{len(self)} points; {MOST} is the limit of one sweep. Take fewer values or axes.")
        if self.level != LEVEL:
            raise InputError(f"level {self.level!r}: a sweep runs in the fast tank, whose level is {LEVEL!r}.")
        if self.members != 0 and not 2 <= self.members <= 1000:
            raise InputError(f"members {self.members}: an ensemble has 2 to 1000 members, or 0 for none.")
        for name in self.trials:
            if name not in TRIALS:
                raise InputError(f"trial {name!r} is not one of a sweep. Those are: {', '.join(TRIALS)}.")

    def __len__(self) -> int:
        """Number of points."""
        return math.prod(len(axis.values) for axis in self.axes)

    @property
    def tank(self) -> FastTank:
        """The tank of every point."""
        return FastTank(members=self.members)

    def points(self) -> list[tuple[float, ...]]:
        """Values [SI] of every point, in the order of ``axes``."""
        return list(itertools.product(*(axis.values for axis in self.axes)))

    def changes(self, point: tuple[float, ...]) -> dict[str, Quantity]:
        """What ``vary`` is called with at ``point``."""
        return {
            axis.name: f"{value!r} rad" if axis.unit == "rad" else value
            for axis, value in zip(self.axes, point, strict=True)
        }

    def craft_at(self, point: tuple[float, ...]) -> Craft:
        """The variant of ``point``.

        Raises
        ------
        InputError
            It cannot be built.
        """
        return vary(self.craft, **self.changes(point))


def axis_of(craft: Craft, text: str) -> Axis:
    """The axis that ``text`` describes: ``"cg_x=-0.05,0,0.05"`` or ``"fin_size=0.8:1.4:4"``, first, last and number.

    Raises
    ------
    InputError
        No name, no values, or values that cannot be read.
    """
    name, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not values:
        raise InputError(
            f'{text!r}: write NAME=VALUES, the values as a list "cg_x=-0.05,0,0.05" or as first:last:number, '
            '"fin_size=0.8:1.4:4".'
        )
    what = kind(name)
    if ":" not in values:
        return Axis(name, tuple(number(craft, name, value.strip()) for value in values.split(",")))
    parts = [part.strip() for part in values.split(":")]
    if len(parts) != 3 or not parts[2].isdecimal() or int(parts[2]) < 2:
        raise InputError(
            f"{name}={values}: a range is first:last:number with at least 2 values, such as 0.8:1.4:4. {what.meaning}."
        )
    first, last, count = number(craft, name, parts[0]), number(craft, name, parts[1]), int(parts[2])
    # Both ends exactly, and the values between as a person would write them: angles in degrees.
    one = math.pi / 180.0 if what.unit == "rad" else 1.0
    between = [one * float(f"{(first + (last - first) * i / (count - 1)) / one:.12g}") for i in range(1, count - 1)]
    return Axis(name, (first, *between, last))
