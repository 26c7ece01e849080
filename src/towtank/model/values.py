"""Sets of derivatives by name: from stated numbers, with some replaced, from one variant to the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives, Reference
from towtank.derive.variant import SHARES
from towtank.errors import InputError
from towtank.frames import Array
from towtank.symbols import LOADS, RATES, TERMS

VARIANTS = ("lumped", "split")

_BLOCKS = ({"X", "Z", "M", "u", "w", "q"}, {"Y", "K", "N", "v", "p", "r"})


def shares(term: str) -> tuple[tuple[str, float], ...]:
    """Added masses and factors whose sum is the lumped ``term`` less the split one; empty for most terms."""
    return SHARES.get(term, ())


def values_of(derivatives: Derivatives) -> dict[str, float]:
    """Term -> value, after a check of names, numbers and variant.

    Raises
    ------
    InputError
        Unknown variant, unknown term, or a value that is not finite.
    """
    if derivatives.variant not in VARIANTS:
        raise InputError(
            f"derivatives of {derivatives.craft} are of variant {derivatives.variant!r}; the model knows 'lumped' "
            "(total loads in the damping terms) and 'split' (remainders beside the full C_A)."
        )
    values = derivatives.as_dict()
    for name, value in values.items():
        if name not in TERMS:
            raise InputError(f"derivatives of {derivatives.craft}: unknown term {name!r}. towtank.symbols lists them.")
        if not np.isfinite(value):
            raise InputError(f"derivatives of {derivatives.craft}: {name} is {value}. Give a finite number.")
    return values


def known(craft: Craft, values: Mapping[str, float], variant: str, level: str) -> Derivatives:
    """``values`` (SI, about the craft's origin) as a set of derivatives with zero uncertainty."""
    names = tuple(values)
    none = np.zeros((len(names), len(names)))
    reference = Reference(craft.length, craft.speed, craft.water.density, craft.origin_from_nose)
    numbers = np.array([float(values[name]) for name in names])
    return Derivatives(craft.name, level, variant, reference, names, numbers, none, none, none)


def replaced(derivatives: Derivatives, values: Mapping[str, float]) -> Derivatives:
    """``derivatives`` with some values replaced or added; covariances are kept, those of added terms are zero."""
    merged = {**derivatives.as_dict(), **{name: float(value) for name, value in values.items()}}
    extra = len(merged) - len(derivatives.names)

    def grown(covariance: Array) -> Array:
        return np.pad(covariance, ((0, extra), (0, extra))) if extra else covariance

    return replace(
        derivatives,
        names=tuple(merged),
        values=np.array(list(merged.values())),
        covariance_fit=grown(derivatives.covariance_fit),
        covariance_mesh=grown(derivatives.covariance_mesh),
        covariance_model=grown(derivatives.covariance_model),
    )


def lumped_to_split(values: Mapping[str, float]) -> dict[str, float]:
    """Coefficients of the variant "split" that give the same loads ahead as the lumped ``values``.

    Source     THEORY section 2: the difference between the full C_A nu and the printed bracket.
    Valid      u > 0 (lift-type terms take |u|, the potential ones u), and a craft with a port-starboard plane of
               symmetry: the bracket of eq. 2.15 has no room for entries such as Xvdot.

    Raises
    ------
    InputError
        ``values`` hold an entry of M_A that couples the two planes.
    """
    return _shifted(values, -1.0)


def split_to_lumped(values: Mapping[str, float]) -> dict[str, float]:
    """Inverse of ``lumped_to_split``."""
    return _shifted(values, 1.0)


def _shifted(values: Mapping[str, float], sign: float) -> dict[str, float]:
    for load in LOADS:
        for rate in RATES:
            name = f"{load}{rate}dot"
            apart = not any(load in block and rate in block for block in _BLOCKS)
            if apart and values.get(name, 0.0) != 0.0:
                raise InputError(
                    f"{name} = {values[name]:g} couples the vertical with the horizontal plane. The reduced bracket of "
                    "eq. 2.15 has no term for it, so the lumped and split variants differ; set it to zero or stay "
                    "with the variant the set was identified in."
                )
    out = dict(values)
    for term, shares in SHARES.items():
        shift = sum(factor * values.get(name, 0.0) for name, factor in shares)
        if shift != 0.0:
            out[term] = out.get(term, 0.0) + sign * shift
    return out


def to_variant(derivatives: Derivatives, variant: str) -> Derivatives:
    """``derivatives`` in the other variant, covariances carried through the linear change of terms."""
    if derivatives.variant == variant:
        return derivatives
    change = lumped_to_split if variant == "split" else split_to_lumped
    full = replaced(derivatives, {term: derivatives[term] for term in SHARES})
    names = full.names
    jacobian = np.eye(len(names))
    sign = -1.0 if variant == "split" else 1.0
    for term, shares in SHARES.items():
        for name, factor in shares:
            if name in names:
                jacobian[names.index(term), names.index(name)] += sign * factor
    changed = change(full.as_dict())
    slopes = {
        term: value + (changed[term] - full[term]) for term, value in derivatives.origin.items() if term in changed
    }
    return replace(
        full,
        variant=variant,
        values=np.array([changed[name] for name in names]),
        covariance_fit=jacobian @ full.covariance_fit @ jacobian.T,
        covariance_mesh=jacobian @ full.covariance_mesh @ jacobian.T,
        covariance_model=jacobian @ full.covariance_model @ jacobian.T,
        origin={**derivatives.origin, **slopes},
    )
