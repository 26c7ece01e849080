"""Fins of a craft file: where they are placed, their shape, and whether they stand on the hull."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from towtank.craft.craft import Fin, Profile
from towtank.craft.reading import Sections, given_values, one_of, value

LAYOUTS: dict[str, tuple[tuple[str, float], ...]] = {
    "x": (("top-port", 225.0), ("top-starboard", 315.0), ("bottom-port", 135.0), ("bottom-starboard", 45.0)),
    "plus": (("starboard", 0.0), ("lower", 90.0), ("port", 180.0), ("upper", 270.0)),
}
"""Names and azimuths [deg] of the fins of a layout; the X order is that of perron, section 2.4."""


def read_fins(sections: Sections) -> list[tuple[str, Fin]]:
    """Fins of [fins] and [[fin]] with the path of the section each comes from. Faults go to ``sections.faults``."""
    faults = sections.faults
    fins: list[tuple[str, Fin]] = []
    repeated: Any = sections.tables.get("fins")
    if repeated is not None:
        placed = _placed(repeated, faults)
        shape = _shape("fins", repeated, sections)
        fins += [("fins", Fin(name=name, azimuth=azimuth, sign=sign, **shape)) for name, azimuth, sign in placed]
    for path, section in sections.fins:
        single: Any = section
        shape = _shape(path, single, sections)
        azimuth = single.azimuth.value % (2.0 * np.pi)
        fins.append((path, Fin(name=single.name, azimuth=azimuth, sign=float(single.sign), **shape)))
    names = [fin.name for _, fin in fins]
    for name in dict.fromkeys(n for n in names if names.count(n) > 1):
        faults.append(f"fins: {names.count(name)} fins are named {name!r}. Give each fin a name of its own.")
    return fins


def _placed(fins: Any, faults: list[str]) -> list[tuple[str, float, float]]:
    """(name, azimuth [rad], sign) of each fin of [fins]."""
    ways = one_of("fins", fins, ("layout", "azimuths", "count"), faults)
    if len(ways) != 1:
        return []
    if fins.layout:
        names, degrees = zip(*LAYOUTS[fins.layout], strict=True)
        azimuths = [float(np.radians(angle)) for angle in degrees]
    else:
        step = 2.0 * np.pi / (fins.count or 1)
        start = value(fins, "first_azimuth")
        azimuths = [a.value for a in fins.azimuths or []] or [start + i * step for i in range(fins.count or 0)]
        names = tuple(f"fin-{number}" for number in range(1, len(azimuths) + 1))
    called, signs = fins.names or list(names), fins.signs or [1] * len(azimuths)
    for key, items in (("names", called), ("signs", signs)):
        if len(items) != len(azimuths):
            faults.append(f"fins.{key}: {len(items)} given for {len(azimuths)} fins. Give one per fin.")
            return []
    return [
        (name, azimuth % (2.0 * np.pi), float(sign))
        for name, azimuth, sign in zip(called, azimuths, signs, strict=True)
    ]


_OPTIONAL = ("section", "trailing_edge_sweep", "hinge", "max_angle", "max_rate", "time_constant")
_SHAPE = ("root_radius", "root_chord", "tip_radius", "tip_chord", "trailing_edge", *_OPTIONAL, "dead_band", "backlash")


def _shape(path: str, section: Any, sections: Sections) -> dict[str, Any]:
    """Arguments of Fin that ``section`` gives; what it leaves out is recorded as assumed."""
    default = {f.name: f.default for f in fields(Fin) if f.default is not MISSING}
    for key in _OPTIONAL:
        if getattr(section, key) is None:
            sections.origins.default(f"{path}.{key}", f"not in the file; towtank takes {default[key]}")
    return given_values(section, _SHAPE) | ({"section": section.section} if section.section else {})


def fin_root(fin: Fin, profile: Profile) -> tuple[float, float, float]:
    """Where ``fin`` stands on the hull: leading and trailing edge aft of the nose, and radius [m].

    The root is taken where the middle of the chord meets the hull.
    """
    y = fin.root_radius
    for _ in range(20):
        middle = float(fin.trailing_edge_at(y) - 0.5 * fin.chord(y))
        y = 0.5 * (y + float(profile.radius(np.array(middle))))
    trailing = float(fin.trailing_edge_at(y))
    return trailing - float(fin.chord(y)), trailing, y


def fin_faults(fin: Fin, profile: Profile) -> list[str]:
    """What keeps ``fin`` from standing on the hull: ``key: what is wrong, limit, remedy``, or nothing."""
    if fin.tip_radius <= fin.root_radius:
        return [
            f"tip_radius: {fin.tip_radius:g} m is not beyond root_radius {fin.root_radius:g} m. "
            "Radii are measured from the hull axis; give the larger one for the tip."
        ]
    length = profile.length
    leading, trailing, y = fin_root(fin, profile)
    if trailing > length + 1e-9:
        return [
            f"trailing_edge: the root trailing edge lies {trailing:.4g} m aft of the nose, behind the tail at "
            f"{length:.4g} m. Move the fin forward by {trailing - length:.3g} m or more."
        ]
    if leading < -1e-9:
        return [
            f"trailing_edge: the root leading edge lies {-leading:.3g} m ahead of the nose. Move the fin aft or "
            "shorten root_chord."
        ]
    if fin.tip_radius <= y:
        return [
            f"tip_radius: {fin.tip_radius:.4g} m lies inside the hull, whose radius is {y:.4g} m there. The tip radius "
            "is measured from the hull axis; make it larger, or move the fin to a thinner part of the hull."
        ]
    return []
