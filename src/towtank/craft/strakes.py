"""Strakes of a craft file: where they are placed, and whether they stand on the hull and clear of the fins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from towtank.craft.craft import Fin, Profile, Strake
from towtank.craft.fins import LAYOUTS, fin_root
from towtank.craft.reading import Sections, given_values, one_of

_KEYS = ("start", "end", "height", "end_height", "thickness")


def read_strakes(sections: Sections) -> list[tuple[str, Strake]]:
    """Strakes of [[strake]] with the path of the section each comes from. Faults go to ``sections.faults``."""
    found: list[tuple[str, Strake]] = []
    for path, section in sections.strakes:
        given: Any = section
        numbers = given_values(section, _KEYS)
        numbers.setdefault("end_height", numbers["height"])
        placed = _placed(path, given, sections.faults)
        found += [(path, Strake(name=name, azimuth=azimuth, **numbers)) for name, azimuth in placed]
    names = [strake.name for _, strake in found]
    for name in dict.fromkeys(n for n in names if names.count(n) > 1):
        sections.faults.append(f"strake: {names.count(name)} strakes are named {name!r}. Give each [[strake]] a name.")
    return found


def _placed(path: str, section: Any, faults: list[str]) -> list[tuple[str, float]]:
    """(name, azimuth [rad]) of each strake of a section."""
    ways = one_of(path, section, ("layout", "azimuths"), faults)
    if len(ways) != 1:
        return []
    if section.layout:
        return [(f"{section.name}-{place}", float(np.radians(angle))) for place, angle in LAYOUTS[section.layout]]
    azimuths = [angle.value % (2.0 * np.pi) for angle in section.azimuths]
    if not azimuths:
        faults.append(f"{path}.azimuths: the list is empty. Give one azimuth for each strake, or remove the section.")
    numbered = [f"{section.name}-{i}" for i in range(1, len(azimuths) + 1)]
    return list(zip(numbered if len(azimuths) > 1 else [section.name], azimuths, strict=False))


def strake_faults(
    strake: Strake, profile: Profile, fins: Sequence[Fin] = (), others: Sequence[Strake] = ()
) -> list[str]:
    """What keeps ``strake`` from standing: ``key: what is wrong, limit, remedy``, or nothing.

    fins : must stay free to turn.   others : all strakes of the craft, this one among them.
    """
    if strake.end <= strake.start:
        return [f"end: {strake.end:g} m is not behind start {strake.start:g} m. Both are measured aft of the nose."]
    if strake.end > profile.length + 1e-9:
        return [
            f"end: the strake ends {strake.end:.4g} m aft of the nose, behind the tail at {profile.length:.4g} m. "
            "Let it end on the hull."
        ]
    thinnest = float(profile.radius(np.linspace(strake.start, strake.end, 201)).min())
    if thinnest < strake.thickness:
        return [
            f"thickness: {strake.thickness:g} m is more than the radius of the hull, {thinnest:.3g} m where it is "
            "least under the strake. Give a thinner plate, or end it where the hull is thicker."
        ]
    for fin in fins:
        if _meets(strake, fin, profile):
            return [
                f"end: the strake stands where fin {fin.name} turns, whose root reaches from "
                "{:.4g} m to {:.4g} m aft of the nose, {:.3g} m off the axis. ".format(*fin_root(fin, profile))
                + "End it ahead of the fin, or give it another azimuth."
            ]
    for other in others:
        if other is not strake and _apart(strake.azimuth, other.azimuth) < 1e-6 and _overlap(strake, other):
            return [f"azimuths: strakes {strake.name} and {other.name} stand in one place. Remove one, or move it."]
    return []


def _meets(strake: Strake, fin: Fin, profile: Profile) -> bool:
    """True when the fin, turned to its limit, touches the strake."""
    leading, trailing, radius = fin_root(fin, profile)
    if strake.end <= leading or strake.start >= trailing:
        return False
    swept = 0.5 * (trailing - leading) * np.sin(fin.max_angle) + 0.5 * strake.thickness
    return bool(_apart(strake.azimuth, fin.azimuth) < np.arcsin(min(swept / radius, 1.0)))


def _apart(one: float, other: float) -> float:
    """Angle between two azimuths [rad], 0 to pi."""
    return abs((one - other + np.pi) % (2.0 * np.pi) - np.pi)


def _overlap(one: Strake, other: Strake) -> bool:
    return one.start < other.end and other.start < one.end
