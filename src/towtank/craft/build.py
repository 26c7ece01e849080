"""From sound sections to a Craft, with the checks that need more than one section."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from towtank.craft.craft import Craft, Fin, Mass, Profile, Propeller
from towtank.craft.hull import Ellipsoid, Myring, Offsets, Suboff
from towtank.craft.integrals import centre_of_buoyancy
from towtank.craft.mass import as_rows, displaced_by_force, displaced_by_percent, move_inertia, uniform_inertia
from towtank.craft.reading import Origins, Sections, read_sections
from towtank.craft.schema import Given, OffsetsSection, Section
from towtank.errors import CraftError, InputError
from towtank.quantity import si
from towtank.water import FRESH_25C, Water

LAYOUTS: dict[str, tuple[tuple[str, float], ...]] = {
    "x": (("top-port", 225.0), ("top-starboard", 315.0), ("bottom-port", 135.0), ("bottom-starboard", 45.0)),
    "plus": (("starboard", 0.0), ("lower", 90.0), ("port", 180.0), ("upper", 270.0)),
}
"""Names and azimuths [deg] of the fins of a layout; the X order is that of perron, section 2.4."""

_UNIFORM = "uniform body filling the hull, estimated by towtank"


def build(raw: Mapping[str, Any], where: str) -> Craft:
    """Build the craft of a parsed file.

    Parameters
    ----------
    raw : the file as nested tables.
    where : the file as the user knows it, for the error text.

    Raises
    ------
    CraftError
        Every fault of the file, one line each: dotted path, what is wrong, limit, remedy.
    """
    sections = read_sections(raw)
    faults, origins = sections.faults, Origins()
    for name, table in sections.tables.items():
        origins.add(name, table)
    for path, section in sections.fins:
        origins.add(path, section)
    profile = _profile(sections, faults)
    fins = _fins(sections, origins, faults)
    if profile:
        for path, fin in fins:
            faults.extend(f"{path}.{text}" for text in fin_faults(fin, profile))
    craft = None if profile is None or faults else _assemble(sections, profile, [f for _, f in fins], origins)
    if faults or craft is None:
        count = "one fault" if len(faults) == 1 else f"{len(faults)} faults"
        raise CraftError("\n  ".join([f"{where} has {count}:", *dict.fromkeys(faults)]))
    return craft


def value(section: Any, key: str, default: float = 0.0) -> float:
    """SI value of a number of ``section``, or ``default`` where the file leaves it out."""
    given = getattr(section, key)
    return given.value if isinstance(given, Given) else default


def _given(section: Section, keys: tuple[str, ...]) -> dict[str, float]:
    return {key: getattr(section, key).value for key in keys if isinstance(getattr(section, key), Given)}


def _profile(sections: Sections, faults: list[str]) -> Profile | None:
    hull: Any = sections.tables.get("hull")
    if hull is None:
        return None
    numbers = _given(hull, tuple(type(hull).model_fields))
    if hull.kind == "myring":
        return _myring(Myring(**numbers), faults)
    if isinstance(hull, OffsetsSection):
        return _offsets(hull, faults)
    return Suboff(**numbers) if hull.kind == "suboff" else Ellipsoid(**numbers)


def _myring(hull: Myring, faults: list[str]) -> Myring | None:
    for end in ("nose", "tail"):
        offset, whole = getattr(hull, f"{end}_offset"), getattr(hull, end)
        if offset >= whole:
            faults.append(
                f"hull.{end}_offset: {offset:g} m cuts away the whole {end} of {whole:g} m. Give a shorter cut."
            )
            return None
    steepest = 3.0 * hull.diameter / (2.0 * hull.tail)
    if np.tan(hull.tail_angle) > steepest:
        faults.append(
            f"hull.tail_angle: {np.degrees(hull.tail_angle):.3g} deg makes the tail bulge beyond the diameter: with a "
            f"tail of {hull.tail:g} m it must stay below {np.degrees(np.arctan(steepest)):.3g} deg."
        )
        return None
    return hull


def _offsets(hull: OffsetsSection, faults: list[str]) -> Offsets | None:
    table = np.array(hull.offsets, dtype=float).reshape(-1, 2)
    try:
        table = table * si(f"1 {hull.unit}", "m", "hull.unit")
    except InputError as error:
        faults.append(str(error))
        return None
    x, r = table.T
    if len(x) < 4 or x[0] != 0.0 or np.any(np.diff(x) <= 0.0) or not np.all(np.isfinite(table)):
        faults.append("hull.offsets: distances must be finite, start at 0 and rise, over at least 4 rows. Sort them.")
        return None
    if np.any(r[1:-1] <= 0.0) or min(r[0], r[-1]) < 0.0:
        faults.append("hull.offsets: a radius between the ends is not positive. Give the radius of the closed hull.")
        return None
    return Offsets(tuple(x.tolist()), tuple(r.tolist()))


def _fins(sections: Sections, origins: Origins, faults: list[str]) -> list[tuple[str, Fin]]:
    fins: list[tuple[str, Fin]] = []
    repeated: Any = sections.tables.get("fins")
    if repeated is not None:
        placed = _placed(repeated, faults)
        shape = _shape("fins", repeated, origins)
        fins += [("fins", _fin(shape, name, azimuth, sign, faults, "fins")) for name, azimuth, sign in placed]
    for path, section in sections.fins:
        single: Any = section
        shape = _shape(path, single, origins)
        fins.append((path, _fin(shape, single.name, single.azimuth.value, single.sign, faults, path)))
    names = [fin.name for _, fin in fins]
    for name in dict.fromkeys(n for n in names if names.count(n) > 1):
        faults.append(f"fins: {names.count(name)} fins are named {name!r}. Give each fin a name of its own.")
    return fins


def _placed(fins: Any, faults: list[str]) -> list[tuple[str, float, int]]:
    """(name, azimuth [rad], sign) of each fin of [fins]."""
    ways = [key for key in ("layout", "azimuths", "count") if getattr(fins, key) is not None]
    if len(ways) != 1:
        faults.append(
            f"fins: {' and '.join(ways) or 'nothing'} says where the fins are. "
            "Give exactly one of layout, azimuths and count."
        )
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
    return list(zip(called, azimuths, signs, strict=True))


_OPTIONAL = ("section", "trailing_edge_sweep", "hinge", "max_angle", "max_rate", "time_constant")
_SHAPE = ("root_radius", "root_chord", "tip_radius", "tip_chord", "trailing_edge", *_OPTIONAL)


def _shape(path: str, section: Any, origins: Origins) -> dict[str, Any]:
    """Arguments of Fin that ``section`` gives; what it leaves out is recorded as assumed."""
    default = {f.name: f.default for f in fields(Fin) if f.default is not MISSING}
    for key in _OPTIONAL:
        if getattr(section, key) is None:
            origins.default(f"{path}.{key}", f"not in the file; towtank takes {default[key]}")
    return _given(section, _SHAPE) | ({"section": section.section} if section.section else {})


def _fin(shape: dict[str, Any], name: str, azimuth: float, sign: int, faults: list[str], path: str) -> Fin:
    if shape["tip_radius"] <= shape["root_radius"]:
        faults.append(
            f"{path}.tip_radius: {shape['tip_radius']:g} m is not beyond root_radius {shape['root_radius']:g} m. "
            "Radii are measured from the hull axis; give the larger one for the tip."
        )
    return Fin(name=name, azimuth=azimuth % (2.0 * np.pi), sign=float(sign), **shape)


def fin_faults(fin: Fin, profile: Profile) -> list[str]:
    """What keeps ``fin`` from standing on the hull: ``key: what is wrong, limit, remedy``, or nothing.

    The root is taken where the middle of the fin's chord meets the hull.
    """
    if fin.tip_radius <= fin.root_radius:
        return []
    length, y = profile.length, fin.root_radius
    for _ in range(20):
        middle = float(fin.trailing_edge_at(y) - 0.5 * fin.chord(y))
        y = 0.5 * (y + float(profile.radius(np.array(middle))))
    trailing = float(fin.trailing_edge_at(y))
    leading = trailing - float(fin.chord(y))
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


def _assemble(sections: Sections, profile: Profile, fins: list[Fin], origins: Origins) -> Craft | None:
    tables: dict[str, Any] = dict(sections.tables)
    water = _water(tables["conditions"], origins)
    _, cb, *aside = centre_of_buoyancy(profile, tuple(fins))
    reference = tables.get("reference")
    origin = value(reference, "origin_from_nose", cb) if reference else cb
    mass = _mass(tables["mass"], profile, water, (origin - cb, *aside), origins, sections.faults)
    if mass is not None:
        sections.faults.extend(_cg_faults(mass, profile, origin))
    if not 0.0 <= origin <= profile.length:
        sections.faults.append(
            f"reference.origin_from_nose: {origin:g} m is off the hull, which is {profile.length:.4g} m long. "
            "Give a distance aft of the nose within the length."
        )
    propeller = _propeller(tables.get("propeller"), profile, sections.faults)
    if mass is None or sections.faults:
        return None
    return Craft(
        name=tables["craft"].name,
        title=tables["craft"].title,
        profile=profile,
        fins=tuple(fins),
        mass=mass,
        origin_from_nose=origin,
        speed=value(tables["conditions"], "speed"),
        water=water,
        propeller=propeller,
        assumed=tuple(origins.assumed),
        unsourced=tuple(origins.unsourced),
        sources=tuple(origins.sources.items()),
    )


def _water(conditions: Any, origins: Origins) -> Water:
    for key in ("density", "kinematic_viscosity"):
        if getattr(conditions, key) is None:
            origins.default(f"conditions.{key}", f"not in the file; fresh water at 25 C, {getattr(FRESH_25C, key)}")
    return Water(
        value(conditions, "density", FRESH_25C.density),
        value(conditions, "kinematic_viscosity", FRESH_25C.kinematic_viscosity),
    )


def _mass(
    section: Any,
    profile: Profile,
    water: Water,
    cb: tuple[float, ...],
    origins: Origins,
    faults: list[str],
) -> Mass | None:
    mass = value(section, "mass")
    displaced = _displaced(section, mass, water, faults)
    cg = np.array([value(section.cg, axis) for axis in "xyz"])
    cg[0] = cb[0] if np.isnan(cg[0]) else cg[0]
    inertia = _inertia(section, profile, mass, cg, origins, faults)
    if displaced is None or inertia is None:
        return None
    return Mass(mass, displaced, (float(cg[0]), float(cg[1]), float(cg[2])), as_rows(inertia), (cb[0], cb[1], cb[2]))


def _displaced(section: Any, mass: float, water: Water, faults: list[str]) -> float | None:
    ways = [key for key in ("net_buoyancy_percent", "buoyancy", "volume") if getattr(section, key) is not None]
    if len(ways) != 1:
        faults.append(
            f"mass: {' and '.join(ways) or 'nothing'} says what the craft displaces. Give exactly one of "
            'net_buoyancy_percent, buoyancy (a force, or "neutral") and volume.'
        )
        return None
    if ways == ["net_buoyancy_percent"]:
        percent = value(section, "net_buoyancy_percent")
        if abs(percent) >= 50.0:
            faults.append(
                f"mass.net_buoyancy_percent: {percent:g} is beyond 50: such a craft does not stay submerged. "
                "Give the net buoyancy in percent of the weight, negative when heavy."
            )
        return displaced_by_percent(mass, percent)
    if ways == ["volume"]:
        return value(section, "volume") * water.density
    return mass if section.buoyancy == "neutral" else displaced_by_force(section.buoyancy.value)


def _inertia(
    section: Any, profile: Profile, mass: float, cg: Any, origins: Origins, faults: list[str]
) -> np.ndarray | None:
    """Inertia (3, 3) [kg m2] about the origin."""
    given = _given(section, ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    left = [key for key in ("ixx", "iyy", "izz") if key not in given]
    if left and section.inertia is None:
        faults.append(f'mass: {", ".join(left)} missing. Give them, or write inertia = "uniform" to estimate them.')
        return None
    if given and section.inertia_about is None:
        faults.append('mass.inertia_about: this key is missing. Write "cg" or "origin" for the inertia that is given.')
        return None
    about_cg = np.diag(uniform_inertia(profile, mass))
    for key in left:
        origins.default(f"mass.{key}", _UNIFORM)
    shift = move_inertia(np.zeros((3, 3)), mass, cg)
    about_origin = about_cg + shift
    moved = shift if section.inertia_about == "cg" else np.zeros((3, 3))
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        key = f"i{'xyz'[i]}{'xyz'[j]}"
        if key in given:
            about_origin[i, j] = about_origin[j, i] = (given[key] if i == j else -given[key]) + moved[i, j]
    if np.linalg.eigvalsh(about_origin - shift)[0] <= 0.0 or _lopsided(np.diag(about_origin - shift)):
        faults.append(
            "mass: no body has these moments of inertia: about the centre of gravity each must be positive and none "
            "larger than the sum of the other two. Check ixx, iyy, izz, their units, and inertia_about."
        )
        return None
    return about_origin


def _lopsided(moments: Any) -> bool:
    return bool(2.0 * np.max(moments) > np.sum(moments) * (1.0 + 1e-9))


def _cg_faults(mass: Mass, profile: Profile, origin: float) -> list[str]:
    x, y, z = mass.cg
    station, aside = origin - x, float(np.hypot(y, z))
    if not 0.0 <= station <= profile.length:
        return [
            f"mass.cg: the centre of gravity lies {station:.4g} m aft of the nose, off the hull, which is "
            f"{profile.length:.4g} m long. cg is measured from the origin {origin:.4g} m aft of the nose, x forward."
        ]
    radius = float(profile.radius(np.array(station)))
    if aside > radius:
        return [
            f"mass.cg: the centre of gravity lies {aside:.4g} m off the axis, outside the hull, whose radius is "
            f"{radius:.4g} m there. cg is measured from the origin, y to starboard and z down."
        ]
    return []


def _propeller(section: Any, profile: Profile, faults: list[str]) -> Propeller:
    if section is None:
        return Propeller()
    table = tuple(tuple(row) for row in section.table or ())
    advance = np.array([row[0] for row in table])
    if table and (not np.all(np.isfinite(table)) or len(table) < 2 or np.any(np.diff(advance) <= 0.0)):
        faults.append("propeller.table: rows [J, KT, KQ] must be finite, at least two, with J rising. Sort them.")
    numbers = _given(section, ("diameter", "wake", "thrust_deduction"))
    position = value(section, "position", profile.length)
    return Propeller(**numbers, position=position, table=table, torque=float(section.torque))
