"""The craft file as pydantic models, one per section. ``docs/craft.md`` describes every key.

A number may be bare (SI), text with a unit, or an inline table ``{value, source, assumed}``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator

from towtank.errors import InputError
from towtank.quantity import si


@dataclass(frozen=True)
class Given:
    """A number as the file gives it: SI ``value``, its own ``source`` and ``assumed`` mark (None: the section's)."""

    value: float
    source: str = ""
    assumed: bool | None = None


_LIMITS: dict[str, tuple[Callable[[float], bool], str]] = {
    "": (lambda x: True, ""),
    "positive": (lambda x: x > 0.0, "is not positive"),
    "not negative": (lambda x: x >= 0.0, "is negative"),
    "fraction": (lambda x: 0.0 <= x <= 1.0, "is not between 0 and 1"),
    "acute": (lambda x: 0.0 < x < 1.5707, "is not between 0 and 90 deg"),
    "small": (lambda x: 0.0 <= x < 0.35, "is not between 0 and 20 deg"),
    "sharp": (lambda x: abs(x) < 1.5, "is not between -85 and 85 deg"),
}


def _number(unit: str, limit: str = "") -> PlainValidator:
    """Validator of one number in the SI ``unit``; ``limit`` is a key of ``_LIMITS``."""
    accept, fault = _LIMITS[limit]

    def read(given: Any) -> Given:
        table = given if isinstance(given, Mapping) else {"value": given}
        unknown = sorted(set(table) - {"value", "source", "assumed"})
        if unknown or "value" not in table:
            raise ValueError("an inline table holds value, source and assumed, nothing else, and value is needed")
        source, assumed = table.get("source", ""), table.get("assumed")
        if not isinstance(source, str) or not isinstance(assumed, bool | None):
            raise ValueError("source is a text and assumed is true or false")
        try:
            value = si(table["value"], unit, "@")
        except InputError as error:
            raise ValueError(str(error).removeprefix("@: ")) from None
        if unit == "m" and (abs(value) > 1e4 or (limit == "positive" and 0.0 < value < 1e-6)):
            raise ValueError(
                f"{table['value']} is no length of a craft: the limits are 1 micrometre and 10 km. Check the unit"
            )
        if not accept(value):
            raise ValueError(f"{table['value']} {fault}")
        return Given(value, source, assumed)

    return PlainValidator(read)


Length = Annotated[Given, _number("m")]
PositiveLength = Annotated[Given, _number("m", "positive")]
CutLength = Annotated[Given, _number("m", "not negative")]
Angle = Annotated[Given, _number("rad")]
TailAngle = Annotated[Given, _number("rad", "acute")]
SweepAngle = Annotated[Given, _number("rad", "sharp")]
FinAngle = Annotated[Given, _number("rad", "acute")]
FinRate = Annotated[Given, _number("rad/s", "positive")]
PlayAngle = Annotated[Given, _number("rad", "small")]
Time = Annotated[Given, _number("s", "not negative")]
PositiveNumber = Annotated[Given, _number("", "positive")]
PlainNumber = Annotated[Given, _number("")]
Fraction = Annotated[Given, _number("", "fraction")]
Speed = Annotated[Given, _number("m/s", "positive")]
Density = Annotated[Given, _number("kg/m^3", "positive")]
Viscosity = Annotated[Given, _number("m^2/s", "positive")]
MassKg = Annotated[Given, _number("kg", "positive")]
Volume = Annotated[Given, _number("m^3", "positive")]
Inertia = Annotated[Given, _number("kg*m^2", "positive")]
Product = Annotated[Given, _number("kg*m^2")]


def _read_assumed(value: Any) -> bool | tuple[str, ...]:
    if isinstance(value, bool):
        return value
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        return tuple(value)
    raise ValueError(f'{value!r} is neither true or false nor a list of keys such as ["hinge", "max_rate"]')


def _read_buoyancy(value: Any) -> Given | Literal["neutral"]:
    if value == "neutral":
        return "neutral"
    read: Callable[[Any], Given] = _number("N", "positive").func  # type: ignore[assignment]
    return read(value)


def _read_level(value: Any) -> Given:
    table = value if isinstance(value, Mapping) else {"value": value}
    if table.get("value") == "cb":
        return Given(float("nan"), str(table.get("source", "")), table.get("assumed"))
    read: Callable[[Any], Given] = _number("m").func  # type: ignore[assignment]
    return read(value)


def _read_section(value: Any) -> str:
    text = re.sub(r"(?i)^naca[ -]?", "", value) if isinstance(value, str) else ""
    if not re.fullmatch(r"00\d\d", text) or text == "0000":
        raise ValueError(f'{value!r} is not a symmetric NACA four-digit section. Write for example "0015"')
    return text


SectionName = Annotated[str, PlainValidator(_read_section)]


class Section(BaseModel):
    """A table of the file. ``source`` and ``assumed`` apply to its numbers that say nothing themselves."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    source: str = Field("", description="where the numbers of this section come from")
    assumed: Annotated[bool | tuple[str, ...], PlainValidator(_read_assumed)] = Field(
        False, description="true, or a list of keys: the numbers of this section that are assumptions"
    )


class CraftSection(Section):
    """[craft]."""

    name: str = Field(description="short name, used for folders", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")
    title: str = Field("", description="one line for the report")


class ConditionsSection(Section):
    """[conditions]."""

    speed: Speed = Field(description="reference speed of the captive tests")
    density: Density | None = Field(None, description="density of the water")
    kinematic_viscosity: Viscosity | None = Field(None, description="kinematic viscosity of the water")


class MyringSection(Section):
    """[hull] with kind = "myring"."""

    kind: Literal["myring"]
    nose: PositiveLength = Field(description="length of the uncut nose")
    middle: CutLength = Field(description="length of the cylinder")
    tail: PositiveLength = Field(description="length of the uncut tail")
    diameter: PositiveLength = Field(description="largest diameter")
    tail_angle: TailAngle = Field(description="half angle of the uncut tail at its point")
    exponent: PositiveNumber | None = Field(None, description="exponent n of the nose; 2 is an ellipse")
    nose_offset: CutLength | None = Field(None, description="length cut off the nose; the end is a flat disc")
    tail_offset: CutLength | None = Field(None, description="length cut off the tail; the end is a flat disc")


class SuboffSection(Section):
    """[hull] with kind = "suboff"."""

    kind: Literal["suboff"]
    length: PositiveLength | None = Field(None, description="overall length; as built if left out (14.291667 ft)")


class EllipsoidSection(Section):
    """[hull] with kind = "ellipsoid"."""

    kind: Literal["ellipsoid"]
    length: PositiveLength = Field(description="overall length")
    diameter: PositiveLength = Field(description="largest diameter")


class OffsetsSection(Section):
    """[hull] with kind = "offsets"."""

    kind: Literal["offsets"]
    offsets: list[tuple[float, float]] = Field(
        description="rows [distance aft of the nose, radius], from the nose to the tail"
    )
    unit: str = Field("m", description="unit of the offsets")


HULLS: dict[str, type[Section]] = {
    "myring": MyringSection,
    "suboff": SuboffSection,
    "ellipsoid": EllipsoidSection,
    "offsets": OffsetsSection,
}


class FinShape(Section):
    """What [fins] and [[fin]] share."""

    root_radius: CutLength = Field(description="radius from the hull axis at which root_chord holds")
    root_chord: PositiveLength = Field(description="chord at root_radius")
    tip_radius: PositiveLength = Field(description="radius of the tip from the hull axis")
    tip_chord: PositiveLength = Field(description="chord at the tip")
    trailing_edge: PositiveLength = Field(description="distance of the trailing edge at root_radius aft of the nose")
    trailing_edge_sweep: SweepAngle | None = Field(None, description="positive when the tip lies further aft")
    section: SectionName | None = Field(None, description='symmetric NACA four-digit section, such as "0015"')
    hinge: Fraction | None = Field(None, description="stock behind the leading edge, fraction of mean exposed chord")
    max_angle: FinAngle | None = Field(None, description="largest deflection either way")
    max_rate: FinRate | None = Field(None, description="fastest deflection rate")
    time_constant: Time | None = Field(None, description="first-order lag of the actuator")
    dead_band: PlayAngle | None = Field(None, description="smallest change of angle the actuator answers; none without")
    backlash: PlayAngle | None = Field(None, description="half the play between actuator and fin; none without")


class FinsSection(FinShape):
    """[fins]: one shape, repeated."""

    layout: Literal["x", "plus"] | None = Field(None, description='"x" (45 deg off) or "plus" (cruciform)')
    azimuths: list[Angle] | None = Field(
        None, description="span directions: 0 starboard, 90 deg keel, 180 deg port, 270 deg deck"
    )
    count: Annotated[int, Field(ge=1, le=12)] | None = Field(None, description="number of evenly spread fins")
    first_azimuth: Angle | None = Field(None, description="azimuth of the first of count fins; starboard if left out")
    names: list[str] | None = Field(None, description="names, in the order of the azimuths")
    signs: list[Literal[1, -1]] | None = Field(
        None, description="1 or -1 per fin: turns the vehicle's own fin angle into the right-handed sense"
    )


class FinSection(FinShape):
    """[[fin]]: one fin."""

    name: str = Field(description="name of the fin", min_length=1)
    azimuth: Angle = Field(description="span direction: 0 starboard, 90 deg keel, 180 deg port, 270 deg deck")
    sign: Literal[1, -1] = Field(1, description="turns the vehicle's own fin angle into the right-handed sense")


class StrakeSection(Section):
    """[[strake]]: equal strakes around the hull."""

    name: str = Field("strake", description="name; several strakes get numbers behind it", min_length=1)
    layout: Literal["x", "plus"] | None = Field(None, description='four strakes: "x" (45 deg off) or "plus"')
    azimuths: list[Angle] | None = Field(
        None, description="or span directions: 0 starboard, 90 deg keel, 180 deg port, 270 deg deck"
    )
    start: PositiveLength = Field(description="distance of the leading end aft of the nose")
    end: PositiveLength = Field(description="distance of the trailing end aft of the nose")
    height: PositiveLength = Field(description="what stands out of the hull, at the start and, if nothing else is "
                                               "said, at the end")  # fmt: skip
    end_height: PositiveLength | None = Field(None, description="what stands out of the hull at the end")
    thickness: PositiveLength = Field(description="thickness of the plate")


class PointSection(Section):
    """A point from the origin, body axes."""

    x: Annotated[Given, PlainValidator(_read_level)] = Field(
        description='forward; "cb": level with the centre of buoyancy, so that the craft floats level'
    )
    y: Length = Field(description="to starboard")
    z: Length = Field(description="down")


class MassSection(Section):
    """[mass]."""

    mass: MassKg = Field(description="mass of the craft with the water enclosed in it")
    net_buoyancy_percent: PlainNumber | None = Field(
        None, description="signed, percent of the weight: buoyancy = weight (1 + percent / 100)"
    )
    buoyancy: Annotated[Given | Literal["neutral"], PlainValidator(_read_buoyancy)] | None = Field(
        None, description='buoyancy as a force, or "neutral"'
    )
    volume: Volume | None = Field(None, description="displaced volume")
    cg: PointSection = Field(description="centre of gravity from the origin: { x, y, z }")
    inertia: Literal["uniform"] | None = Field(
        None, description='"uniform": moments that are left out are those of a uniform body filling the hull'
    )
    inertia_about: Literal["cg", "origin"] | None = Field(
        None, description="point about which the given moments hold; needed when one is given"
    )
    ixx: Inertia | None = Field(None, description="roll moment of inertia")
    iyy: Inertia | None = Field(None, description="pitch moment of inertia")
    izz: Inertia | None = Field(None, description="yaw moment of inertia")
    ixy: Product | None = Field(None, description="product of inertia, integral of x y dm")
    ixz: Product | None = Field(None, description="product of inertia, integral of x z dm")
    iyz: Product | None = Field(None, description="product of inertia, integral of y z dm")


class PropellerSection(Section):
    """[propeller]."""

    diameter: PositiveLength = Field(description="diameter")
    position: PositiveLength | None = Field(None, description="distance aft of the nose; the tail if left out")
    wake: Fraction | None = Field(None, description="wake fraction")
    thrust_deduction: Fraction | None = Field(None, description="thrust deduction fraction")
    table: list[tuple[float, float, float]] | None = Field(None, description="rows [J, KT, KQ], J ascending")
    torque: Literal[-1, 0, 1] = Field(0, description="sense of the propeller torque on the hull; 0 leaves it out")


class ReferenceSection(Section):
    """[reference]."""

    origin_from_nose: Length | None = Field(
        None, description="body origin aft of the nose; the centre of buoyancy of hull and fins if left out"
    )


SECTIONS: dict[str, type[Section]] = {
    "craft": CraftSection,
    "conditions": ConditionsSection,
    "fins": FinsSection,
    "fin": FinSection,
    "strake": StrakeSection,
    "mass": MassSection,
    "propeller": PropellerSection,
    "reference": ReferenceSection,
}
"""Section name -> model; [hull] is in HULLS, by its kind."""

REQUIRED = ("craft", "conditions", "hull", "mass")
