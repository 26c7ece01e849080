"""A craft with its fins made larger, turned or moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from towtank.craft.craft import Craft, Fin
from towtank.craft.fins import fin_faults, fin_root
from towtank.errors import CraftError

SIZE_RANGE = (0.1, 5.0)
"""Factors on span or chord; beyond, the variant is another craft and not a change of this one."""
ANGLE_RANGE = (10.0, 80.0)
"""Angles of X fins from the horizontal [deg]; nearer to a plane two neighbours stand in each other's way."""
_PLANAR = 1e-6
"""Sine or cosine of an azimuth below which the fin lies in a plane of the craft."""


def scaled(craft: Craft, span: float, chord: float) -> Craft:
    """``craft`` with the exposed span and the chords of every fin multiplied.

    The fin grows about the point where its stock meets the hull, so that the stock stays where it is.

    Raises
    ------
    CraftError
        No fins, a factor outside ``SIZE_RANGE``, or a fin that no longer stands on the hull.
    """
    _finned(craft, "fin size")
    for name, factor in (("span", span), ("chord", chord)):
        if not SIZE_RANGE[0] <= factor <= SIZE_RANGE[1]:
            raise CraftError(
                f"fin size: a factor of {factor:g} on the {name} is outside {SIZE_RANGE[0]:g} to {SIZE_RANGE[1]:g}. "
                "Beyond that the fins are other fins; write a craft file for them."
            )
    if span == chord == 1.0:
        return craft
    return checked(replace(craft, fins=tuple(_scaled(craft, fin, span, chord) for fin in craft.fins)))


def _scaled(craft: Craft, fin: Fin, span: float, chord: float) -> Fin:
    y = fin_root(fin, craft.profile)[2]
    middle = 0.5 * (y + fin.tip_radius)
    stock = float(fin.trailing_edge_at(middle) - (1.0 - fin.hinge) * fin.chord(middle))
    return replace(
        fin,
        root_radius=y + span * (fin.root_radius - y),
        tip_radius=y + span * (fin.tip_radius - y),
        root_chord=chord * fin.root_chord,
        tip_chord=chord * fin.tip_chord,
        trailing_edge=stock + chord * (fin.trailing_edge - stock),
        trailing_edge_sweep=float(np.arctan(np.tan(fin.trailing_edge_sweep) * chord / span)),
    )


def fin_angle(craft: Craft) -> float:
    """Angle of X fins from the horizontal [rad], the mean of all.

    Raises
    ------
    CraftError
        A fin lies in the horizontal or the vertical plane, or there is none.
    """
    _finned(craft, "fin_angle")
    for fin in craft.fins:
        if min(abs(np.sin(fin.azimuth)), abs(np.cos(fin.azimuth))) < _PLANAR:
            raise CraftError(
                f"fin_angle: fin {fin.name} lies in a plane of the craft, so the fins form no X. Only the fins of an X "
                'have an angle to vary; give the craft layout = "x" first.'
            )
    return float(np.mean([_from_horizontal(fin) for fin in craft.fins]))


def _from_horizontal(fin: Fin) -> float:
    return float(np.arctan2(abs(np.sin(fin.azimuth)), abs(np.cos(fin.azimuth))))


def turned(craft: Craft, angle: float) -> Craft:
    """``craft`` with every X fin at ``angle`` [rad] from the horizontal, each in its own quarter.

    Raises
    ------
    CraftError
        The fins form no X, or the angle is outside ``ANGLE_RANGE``.
    """
    fin_angle(craft)
    degrees = float(np.degrees(angle))
    if not ANGLE_RANGE[0] <= degrees <= ANGLE_RANGE[1]:
        raise CraftError(
            f"fin_angle: {degrees:g} deg is outside {ANGLE_RANGE[0]:g} to {ANGLE_RANGE[1]:g} deg from the horizontal, "
            'where neighbouring fins stand in each other\'s way. Give an angle between, such as "40 deg".'
        )
    return replace(craft, fins=tuple(_turned(fin, angle) for fin in craft.fins))


def _turned(fin: Fin, angle: float) -> Fin:
    if abs(_from_horizontal(fin) - angle) < 1e-12:
        return fin
    down, starboard = np.sign(np.sin(fin.azimuth)), np.sign(np.cos(fin.azimuth))
    azimuth = np.arctan2(down * np.sin(angle), starboard * np.cos(angle)) % (2.0 * np.pi)
    return replace(fin, azimuth=float(azimuth))


def fin_position(craft: Craft) -> float:
    """Root trailing edge of the aftmost fin, distance aft of the nose [m].

    Raises
    ------
    CraftError
        The craft has no fins.
    """
    _finned(craft, "fin_position")
    return max(fin.trailing_edge for fin in craft.fins)


def moved(craft: Craft, position: float) -> Craft:
    """``craft`` with all fins moved by one distance; the aftmost one then stands at ``position`` [m aft of the nose].

    Radii from the axis stay: on a tapering tail the exposed span changes.

    Raises
    ------
    CraftError
        No fins, or a fin that no longer stands on the hull.
    """
    shift = position - fin_position(craft)
    if shift == 0.0:
        return craft
    fins = tuple(replace(fin, trailing_edge=fin.trailing_edge + shift) for fin in craft.fins)
    return checked(replace(craft, fins=fins))


def checked(craft: Craft) -> Craft:
    """``craft`` itself when all its fins stand on the hull.

    Raises
    ------
    CraftError
        They do not.
    """
    faults = dict.fromkeys(fault for fin in craft.fins for fault in fin_faults(fin, craft.profile))
    if faults:
        raise CraftError(f"the fins of this variant of {craft.name} do not stand on the hull. " + " ".join(faults))
    return craft


def _finned(craft: Craft, what: str) -> None:
    if not craft.fins:
        raise CraftError(f"{what}: {craft.name} has no fins to vary. Give it fins in its craft file first.")
