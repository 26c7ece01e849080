"""A craft with strakes added, made higher, longer, tapered or moved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from towtank.craft.craft import Craft, Strake
from towtank.craft.fins import fin_root
from towtank.craft.strakes import strake_faults
from towtank.errors import CraftError

LENGTH, GAP, THICKNESS, BARE_END = 0.15, 0.01, 0.01, 0.95
"""Strakes of a craft that has none: length and gap to the fins over the length of the craft, thickness over its
diameter, end over its length where there are no fins (assumed)."""
HIGHEST = 0.5
"""Height over the largest diameter; beyond, a strake is a wing."""


def new_strakes(craft: Craft, height: float) -> tuple[Strake, ...]:
    """Strakes for a craft without: one half-way between every two fins, ending just ahead of them (assumed)."""
    around = np.sort([fin.azimuth % (2.0 * np.pi) for fin in craft.fins])
    following = np.append(around[1:], around[:1] + 2.0 * np.pi)
    azimuths = 0.5 * (around + following) if len(around) > 1 else 0.5 * np.pi * np.arange(4)
    fronts = [fin_root(fin, craft.profile)[0] - GAP * craft.length for fin in craft.fins]
    end = min(fronts) if fronts else BARE_END * craft.length
    shape = {"end": end, "start": max(end - LENGTH * craft.length, 0.0), "height": height, "end_height": height}
    return tuple(
        Strake(
            name=f"strake-{i}", azimuth=float(azimuth % (2.0 * np.pi)), thickness=THICKNESS * craft.diameter, **shape
        )
        for i, azimuth in enumerate(azimuths, start=1)
    )


def height(craft: Craft) -> float:
    """Height of the strakes at their end, the largest [m]; 0 without."""
    return max((strake.end_height for strake in craft.strakes), default=0.0)


def raised(craft: Craft, value: float) -> Craft:
    """``craft`` with strakes ``value`` [m] high at their end; 0 takes them away, and a craft without gets new ones.

    Raises
    ------
    CraftError
        Negative, or above ``HIGHEST`` diameters.
    """
    if not 0.0 <= value <= HIGHEST * craft.diameter:
        raise CraftError(
            f"strake_height: {value:g} m is outside 0 to {HIGHEST * craft.diameter:.3g} m, half the diameter. Higher "
            "plates are wings; describe them as fins."
        )
    base = height(craft)
    if value == base:
        return craft
    if value == 0.0:
        return replace(craft, strakes=())
    if base == 0.0:
        marked = tuple(f"strake.{key}" for key in ("azimuths", "start", "end", "height", "thickness"))
        return replace(craft, strakes=new_strakes(craft, value), assumed=(*craft.assumed, *marked))
    share = value / base
    return _each(craft, lambda s: replace(s, height=share * s.height, end_height=share * s.end_height))


def taper(craft: Craft) -> float:
    """Height at the start over that at the end, the mean of all strakes.

    Raises
    ------
    CraftError
        The craft has no strakes.
    """
    _straked(craft, "strake_taper")
    return float(np.mean([strake.height / strake.end_height for strake in craft.strakes]))


def tapered(craft: Craft, value: float) -> Craft:
    """``craft`` with strakes that begin at ``value`` times the height of their end.

    Raises
    ------
    CraftError
        No strakes, or not between 0.02 and 5.
    """
    if not 0.02 <= value <= 5.0:
        raise CraftError(f"strake_taper: {value:g} is outside 0.02 to 5, the height at the start over that at the end.")
    if value == taper(craft):
        return craft
    return _each(craft, lambda s: replace(s, height=value * s.end_height))


def length(craft: Craft) -> float:
    """Length of the longest strake [m].

    Raises
    ------
    CraftError
        The craft has no strakes.
    """
    _straked(craft, "strake_length")
    return max(strake.length for strake in craft.strakes)


def lengthened(craft: Craft, value: float) -> Craft:
    """``craft`` with strakes ``value`` [m] long, their ends kept.

    Raises
    ------
    CraftError
        No strakes, or a length that is not positive.
    """
    base = length(craft)
    if not value > 0.0:
        raise CraftError(f"strake_length: {value:g} m leaves no strake. Give a length above zero, or strake_height=0.")
    if value == base:
        return craft
    return _each(craft, lambda s: replace(s, start=s.end - s.length * value / base))


def end(craft: Craft) -> float:
    """End of the aftmost strake, distance aft of the nose [m].

    Raises
    ------
    CraftError
        The craft has no strakes.
    """
    _straked(craft, "strake_end")
    return max(strake.end for strake in craft.strakes)


def shifted(craft: Craft, value: float) -> Craft:
    """``craft`` with all strakes moved by one distance; the aftmost then ends ``value`` [m] aft of the nose.

    Raises
    ------
    CraftError
        The craft has no strakes.
    """
    shift = value - end(craft)
    if shift == 0.0:
        return craft
    return _each(craft, lambda s: replace(s, start=s.start + shift, end=s.end + shift))


def standing(craft: Craft) -> Craft:
    """``craft`` itself when all its strakes stand on the hull and clear of the fins.

    Raises
    ------
    CraftError
        They do not.
    """
    found = [strake_faults(s, craft.profile, craft.fins, craft.strakes) for s in craft.strakes]
    found += [["start: the strake begins ahead of the nose. Make it shorter."] for s in craft.strakes if s.start < 0.0]
    faults = dict.fromkeys(fault for faults in found for fault in faults)
    if faults:
        raise CraftError(f"the strakes of this variant of {craft.name} cannot stand. " + " ".join(faults))
    return craft


def _each(craft: Craft, change: Callable[[Strake], Strake]) -> Craft:
    return replace(craft, strakes=tuple(change(strake) for strake in craft.strakes))


def _straked(craft: Craft, what: str) -> None:
    if not craft.strakes:
        raise CraftError(f"{what}: {craft.name} has no strakes to vary. Give strake_height too, or [[strake]] tables.")
