"""From sound sections to a Craft, with the checks that need more than one section."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from towtank.craft.craft import Craft, Fin, Mass, Profile, Propeller, Strake
from towtank.craft.fins import fin_faults, read_fins
from towtank.craft.hull import Ellipsoid, Myring, Offsets, Suboff
from towtank.craft.integrals import centre_of_buoyancy
from towtank.craft.mass import as_rows, displaced_by_force, displaced_by_percent, move_inertia, uniform_inertia
from towtank.craft.origins import Origins
from towtank.craft.reading import Sections, given_values, one_of, read_sections, value
from towtank.craft.schema import REQUIRED, OffsetsSection
from towtank.craft.strakes import read_strakes, strake_faults
from towtank.errors import CraftError, InputError
from towtank.frames import Array
from towtank.quantity import si
from towtank.water import FRESH_25C, Water

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
    faults = sections.faults
    profile = _profile(sections, faults)
    fins, strakes = read_fins(sections), read_strakes(sections)
    craft = None
    if profile:
        wrong = [(fin, [f"{path}.{text}" for text in fin_faults(fin, profile)]) for path, fin in fins]
        faults.extend(text for _, texts in wrong for text in texts)
        standing = tuple(fin for fin, texts in wrong if not texts)
        plates = [item for _, item in strakes]
        faulty = [
            (s, [f"{path}.{text}" for text in strake_faults(s, profile, standing, plates)]) for path, s in strakes
        ]
        faults.extend(text for _, texts in faulty for text in texts)
        if all(name in sections.tables for name in REQUIRED):
            craft = _assemble(sections, profile, standing, tuple(s for s, texts in faulty if not texts))
    if faults or craft is None:
        told = list(dict.fromkeys(faults))
        count = "one fault" if len(told) == 1 else f"{len(told)} faults"
        raise CraftError("\n  ".join([f"{where} has {count}:", *told]))
    return craft


def _profile(sections: Sections, faults: list[str]) -> Profile | None:
    hull: Any = sections.tables.get("hull")
    if hull is None:
        return None
    numbers = given_values(hull, tuple(type(hull).model_fields))
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


def _assemble(sections: Sections, profile: Profile, fins: tuple[Fin, ...], strakes: tuple[Strake, ...]) -> Craft | None:
    tables: dict[str, Any] = dict(sections.tables)
    origins = sections.origins
    water = _water(tables["conditions"], origins)
    cb = centre_of_buoyancy(profile, fins, strakes)[1]
    reference = tables.get("reference")
    origin = value(reference, "origin_from_nose", cb) if reference else cb
    mass = _mass(sections, profile, water, origin - cb)
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
        fins=fins,
        mass=mass,
        origin_from_nose=origin,
        speed=value(tables["conditions"], "speed"),
        water=water,
        propeller=propeller,
        assumed=tuple(origins.assumed),
        unsourced=tuple(origins.unsourced),
        sources=tuple(origins.sources.items()),
        strakes=strakes,
    )


def _water(conditions: Any, origins: Origins) -> Water:
    for key in ("density", "kinematic_viscosity"):
        if getattr(conditions, key) is None:
            origins.default(f"conditions.{key}", f"not in the file; fresh water at 25 C, {getattr(FRESH_25C, key)}")
    return Water(
        value(conditions, "density", FRESH_25C.density),
        value(conditions, "kinematic_viscosity", FRESH_25C.kinematic_viscosity),
    )


def _mass(sections: Sections, profile: Profile, water: Water, level: float) -> Mass | None:
    section: Any = sections.tables["mass"]
    mass = value(section, "mass")
    displaced = _displaced(section, mass, water, sections.faults)
    cg = np.array([value(section.cg, axis) for axis in "xyz"])
    cg[0] = level if np.isnan(cg[0]) else cg[0]
    inertia = _inertia(sections, uniform_inertia(profile, mass), mass, cg)
    if displaced is None or inertia is None:
        return None
    return Mass(mass, displaced, (float(cg[0]), float(cg[1]), float(cg[2])), as_rows(inertia))


def _displaced(section: Any, mass: float, water: Water, faults: list[str]) -> float | None:
    ways = one_of("mass", section, ("net_buoyancy_percent", "buoyancy", "volume"), faults)
    if len(ways) != 1:
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


def _inertia(sections: Sections, uniform: Array, mass: float, cg: Array) -> Array | None:
    """Inertia (3, 3) [kg m2] about the origin; ``uniform`` (3,) [kg m2] about the CG stands in for what is left out."""
    section: Any = sections.tables["mass"]
    faults, origins = sections.faults, sections.origins
    given = given_values(section, ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    left = [key for key in ("ixx", "iyy", "izz") if key not in given]
    if left and section.inertia is None:
        faults.append(f'mass: {", ".join(left)} missing. Give them, or write inertia = "uniform" to estimate them.')
        return None
    if given and section.inertia_about is None:
        faults.append('mass.inertia_about: this key is missing. Write "cg" or "origin" for the inertia that is given.')
        return None
    for key in left:
        origins.default(f"mass.{key}", _UNIFORM)
    shift = move_inertia(np.zeros((3, 3)), mass, cg)
    about_origin = np.diag(uniform) + shift
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
    numbers = given_values(section, ("diameter", "wake", "thrust_deduction"))
    position = value(section, "position", profile.length)
    return Propeller(**numbers, position=position, table=table, torque=float(section.torque))
