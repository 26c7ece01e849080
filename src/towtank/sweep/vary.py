"""A craft with some of its numbers changed: the axes of a sweep."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from towtank.craft.craft import Craft, Mass
from towtank.craft.integrals import centre_of_buoyancy
from towtank.craft.mass import as_rows, move_inertia
from towtank.errors import CraftError, InputError
from towtank.quantity import Quantity, si
from towtank.sweep import fins, strakes

HEAVIEST = 0.5
"""Net weight over mass beyond which a craft does not stay submerged or does not stay up; that of the craft file."""
_LENGTHS = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(?:L|lengths?)\s*")


@dataclass(frozen=True)
class Kind:
    """One number of a craft that can be varied: unit, meaning, how to read and how to change it."""

    name: str
    unit: str
    meaning: str
    base: Callable[[Craft], float]
    change: Callable[[Craft, float], Craft]
    in_lengths: bool = False


def _moved_cg(mass: Mass, x: float, y: float, z: float) -> Mass:
    """``mass`` with its CG at another point, the inertia about the CG kept."""
    if (x, y, z) == mass.cg:
        return mass
    inertia = np.array(mass.inertia) - move_inertia(np.zeros((3, 3)), mass.mass, np.array(mass.cg))
    return replace(mass, cg=(x, y, z), inertia=as_rows(move_inertia(inertia, mass.mass, np.array([x, y, z]))))


def _in_trim(craft: Craft, before: Craft) -> Craft:
    """``craft`` with the CG moved along and across as the centre of buoyancy moved since ``before``.

    Ballast shifted in the hull keeps the craft floating as it did; otherwise the volume of a fin or strake would change
    its trim.
    """
    if (craft.fins, craft.strakes) == (before.fins, before.strakes):
        return craft
    was, now = (centre_of_buoyancy(c.profile, c.fins, c.strakes) for c in (before, craft))
    x, y, z = craft.mass.cg
    return replace(craft, mass=_moved_cg(craft.mass, x - (now[1] - was[1]), y + (now[2] - was[2]), z))


def _with_cg(craft: Craft, axis: int, value: float) -> Craft:
    """The CG moved along one axis."""
    point = [*craft.mass.cg]
    point[axis] = value
    mass = _moved_cg(craft.mass, point[0], point[1], point[2])
    station, aside = craft.origin_from_nose - point[0], math.hypot(point[1], point[2])
    radius = float(craft.profile.radius(np.array(station))) if 0.0 <= station <= craft.length else 0.0
    if aside > radius or radius == 0.0:
        raise CraftError(
            f"cg_{'xyz'[axis]}: the centre of gravity of this variant of {craft.name} lies {station:.4g} m aft of the "
            f"nose and {aside:.4g} m off the axis, where the hull has a radius of {radius:.4g} m. It must lie inside "
            "the hull; cg is measured from the body origin, x forward, z down."
        )
    return replace(craft, mass=mass)


def _weighed(craft: Craft, mass: Mass, what: str) -> Craft:
    residual = (mass.mass - mass.displaced_mass) / mass.mass if mass.mass > 0.0 else math.inf
    if not abs(residual) < HEAVIEST:
        raise CraftError(
            f"{what}: this variant of {craft.name} has {mass.mass:.6g} kg and displaces {mass.displaced_mass:.6g} kg. "
            f"A net weight beyond {100 * HEAVIEST:g} % of the mass is no submerged craft; give a smaller change."
        )
    return replace(craft, mass=mass)


def _with_mass(craft: Craft, value: float) -> Craft:
    """All masses scaled in place: the CG stays, the inertia grows in proportion, the buoyancy stays."""
    old = craft.mass
    if value == old.mass:
        return craft
    inertia = as_rows(np.array(old.inertia) * (value / old.mass))
    return _weighed(craft, replace(old, mass=value, inertia=inertia), "mass")


def _with_ballast(craft: Craft, value: float) -> Craft:
    """A point mass added at the CG, or taken out: the inertia about the CG stays, the buoyancy stays."""
    old = craft.mass
    if value == 0.0:
        return craft
    extra = move_inertia(np.zeros((3, 3)), value, np.array(old.cg))
    mass = replace(old, mass=old.mass + value, inertia=as_rows(np.array(old.inertia) + extra))
    return _weighed(craft, mass, "ballast")


def _with_speed(craft: Craft, value: float) -> Craft:
    if not value > 0.0:
        raise InputError(f"speed: {value:g} m/s. The craft must move ahead; give a speed above zero.")
    return replace(craft, speed=value)


def _one(craft: Craft) -> float:
    return 1.0


def _area(craft: Craft, value: float) -> Craft:
    if not value > 0.0:
        raise CraftError(f"fin_area: a factor of {value:g} leaves no fin. Give a factor above zero.")
    return fins.scaled(craft, math.sqrt(value), math.sqrt(value))


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("fin_size", "", "factor on span and chords of all fins", _one, lambda c, s: fins.scaled(c, s, s)),
        Kind("fin_area", "", "factor on the area of all fins, their shape kept", _one, _area),
        Kind("fin_span", "", "factor on the exposed span of all fins", _one, lambda c, s: fins.scaled(c, s, 1.0)),
        Kind("fin_chord", "", "factor on the chords of all fins", _one, lambda c, s: fins.scaled(c, 1.0, s)),
        Kind("fin_angle", "rad", "angle of X fins from the horizontal", fins.fin_angle, fins.turned),
        Kind(
            "fin_position", "m", "root trailing edge of the aftmost fin aft of the nose; all fins move alike",
            fins.fin_position, fins.moved, in_lengths=True,
        ),
        Kind("strake_height", "m", "height of the strakes at their end; 0 is none", strakes.height, strakes.raised),
        Kind(
            "strake_length", "m", "length of the strakes, their ends kept",
            strakes.length, strakes.lengthened, in_lengths=True,
        ),
        Kind(
            "strake_end", "m", "end of the aftmost strake aft of the nose; all strakes move alike",
            strakes.end, strakes.shifted, in_lengths=True,
        ),
        Kind("strake_taper", "", "height of the strakes at their start over that at their end",
             strakes.taper, strakes.tapered),
        Kind(
            "cg_x", "m", "centre of gravity forward of the body origin",
            lambda c: c.mass.cg[0], lambda c, x: _with_cg(c, 0, x), in_lengths=True,
        ),
        Kind(
            "cg_z", "m", "centre of gravity below the body origin",
            lambda c: c.mass.cg[2], lambda c, z: _with_cg(c, 2, z), in_lengths=True,
        ),
        Kind("mass", "kg", "mass; inertia in proportion, buoyancy kept", lambda c: c.mass.mass, _with_mass),
        Kind("ballast", "kg", "mass added at the CG; buoyancy kept", lambda c: 0.0, _with_ballast),
        Kind("speed", "m/s", "reference speed of tests and trials", lambda c: c.speed, _with_speed),
    )
}  # fmt: skip
"""What can be varied, in the order in which the changes of one variant are made: fins, strakes, then the mass."""

SHAPES = ("fin_", "strake_")
"""How the names of changes of the shape begin."""


def kind(name: str) -> Kind:
    """What the axis ``name`` varies.

    Raises
    ------
    InputError
        There is no such axis.
    """
    if name in KINDS:
        return KINDS[name]
    near = difflib.get_close_matches(name, KINDS, n=1, cutoff=0.5)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"{name!r} is nothing that can be varied.{hint} Axes: {', '.join(KINDS)}.")


def number(craft: Craft, name: str, value: Quantity) -> float:
    """``value`` of the axis ``name`` in SI. A text such as ``"0.95 L"`` counts in lengths of the craft.

    Raises
    ------
    InputError
        There is no such axis, or the value is no quantity of its kind.
    """
    what = kind(name)
    if what.in_lengths and isinstance(value, str) and (lengths := _LENGTHS.fullmatch(value)):
        return si(lengths[1], "", name) * craft.length
    return si(value, what.unit, name)


def vary(craft: Craft, **changes: Quantity) -> Craft:
    """``craft`` with the numbers in ``changes`` replaced; whatever they do not name stays.

    Parameters
    ----------
    changes : name of an axis (``KINDS``) -> SI number or text with a unit; angles need one. Lengths may be given in
        lengths of the craft, ``"0.95 L"``. The order of the arguments has no effect.

    The body origin, the hull and the displaced mass stay, so that all variants are compared about one point and at
    one buoyancy. Where other fins or strakes move the centre of buoyancy, the CG is moved along with it, as shifted
    ballast would do, so that the craft floats as before; ``cg_x`` and ``cg_z`` are positions and come after. A craft
    without strakes gets a set of them by ``strake_height`` (``towtank.sweep.strakes``). The craft given is unchanged.

    Raises
    ------
    InputError
        Unknown name, wrong unit, a speed that is not positive.
    CraftError
        A variant that cannot be built: fins or strakes off the hull or in each other's way, a CG outside it, nothing
        of the kind to vary, too heavy.
    """
    given = {name: number(craft, name, value) for name, value in changes.items()}
    before = craft
    if given.get("strake_height") == 0.0:  # without strakes the rest of their changes has no object
        given = {name: value for name, value in given.items() if name == "strake_height" or "strake_" not in name}
    for name in (name for name in KINDS if name in given and name.startswith(SHAPES)):
        craft = KINDS[name].change(craft, given[name])
    craft = _in_trim(craft if craft is before else strakes.standing(craft), before)
    for name in (name for name in KINDS if name in given and not name.startswith(SHAPES)):
        craft = KINDS[name].change(craft, given[name])
    return craft
