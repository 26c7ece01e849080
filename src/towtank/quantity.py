"""Units at the gate: text or bare number in, SI float out.

Inside the package every number is SI (metres, kilograms, seconds, radians). Bare numbers are taken as SI,
except angles: a bare angle is refused, because degrees and radians cannot be told apart.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

from towtank.errors import InputError

if TYPE_CHECKING:
    import pint

Quantity = float | int | str
"""What a user may write: ``0.0508``, ``"2 in"``, ``"15 deg"``."""

ANGLE_UNITS = ("rad", "rad/s")


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry()


def si(value: Quantity, unit: str, where: str = "value") -> float:
    """Convert ``value`` to the SI ``unit``.

    Parameters
    ----------
    value : a bare number (SI) or text with a unit, such as ``"2 in"``.
    unit : the SI unit wanted, in pint's spelling: ``"m"``, ``"kg"``, ``"rad"``, ``"kg*m^2"``, ``""`` for none.
    where : how the user knows this number, for the error text.

    Returns
    -------
    The value in ``unit``.

    Raises
    ------
    InputError
        Not a number, NaN or infinite, wrong dimension, or a bare angle.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise InputError(f"{where}: {value!r} is not a number. Write a number in SI units or text with a unit.")
    number = _parse(value, unit, where) if isinstance(value, str) else _bare(float(value), unit, where)
    if not math.isfinite(number):
        raise InputError(f"{where}: {value!r} is not finite. Give a finite number.")
    return number


def _bare(value: float, unit: str, where: str) -> float:
    if unit in ANGLE_UNITS and value != 0.0:
        raise InputError(
            f"{where}: bare angle {value:g}. Degrees and radians cannot be told apart; "
            f'name the unit, for example "{value:g} deg{unit[3:]}".'
        )
    return value


def _parse(text: str, unit: str, where: str) -> float:
    import pint

    try:
        quantity: Any = _registry().Quantity(text)
    except Exception as error:  # pint raises many kinds, tokenizer errors among them
        raise InputError(
            f'{where}: {text!r} is not a quantity ({error}). Write for example "2 {unit or "-"}".'
        ) from None
    if not hasattr(quantity, "units"):
        raise InputError(f"{where}: {text!r} is not a quantity.")
    if quantity.unitless and unit:
        return _bare(float(quantity.magnitude), unit, where)
    try:
        if unit == "rad/s" and "hertz" in str(quantity.units):  # pint takes a hertz for one radian per second
            return float(2.0 * math.pi * quantity.to("Hz").magnitude)
        return float(quantity.to(unit or "dimensionless").magnitude)
    except (pint.DimensionalityError, TypeError, ValueError):
        raise InputError(
            f"{where}: {text!r} cannot be converted to {unit or 'a pure number'}. "
            f"Give a quantity with the dimension of {unit or '1'}."
        ) from None
