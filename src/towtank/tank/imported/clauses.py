"""Clauses of a mapping: columns, motion, moment point, body, scale, window, mesh, fins, axes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping
from typing import Any

from towtank.craft.craft import Craft
from towtank.craft.hydrostatics import hydrostatics
from towtank.errors import InputError
from towtank.plan.motion import KINDS
from towtank.quantity import si
from towtank.symbols import LOADS
from towtank.tank.imported.fields import closest, known, one_of, positive, table_of, three
from towtank.tank.imported.mapping import (
    COLUMN_UNITS,
    FIXED,
    MOTION_KINDS,
    PLACES,
    Body,
    Column,
    MomentPoint,
    Motion,
    Scale,
    Window,
)  # fmt: skip

_UNITS = {"amplitude": "m", "frequency": "rad/s", "angle": "rad", "drift": "rad", "rate": "rad/s"}


def columns_of(given: Any, form: str, where: str) -> dict[str, Column]:
    """Quantity -> column of the file; OpenFOAM has its own."""
    table = table_of(given, f"{where}, columns")
    if form == "openfoam":
        if table:
            raise InputError(f"{where}: OpenFOAM's forces have known columns. Remove columns.")
        return {name: Column(name) for name in ("time", *LOADS)}
    known(table, tuple(COLUMN_UNITS), f"{where}, columns")
    out = {}
    for key, value in table.items():
        if isinstance(value, str) and value:
            out[key] = Column(value)
            continue
        entry = table_of(value, f"{where}, columns.{key}")
        known(entry, ("name", "unit", "factor"), f"{where}, columns.{key}")
        name, unit = entry.get("name"), entry.get("unit", "")
        if not isinstance(name, str) or not name or not isinstance(unit, str):
            raise InputError(f'{where}, columns.{key}: write {{ name = "header", unit = "N" }}.')
        out[key] = Column(name, unit, si(entry.get("factor", 1.0), "", f"{where}, columns.{key}.factor"))
    if "time" not in out and form != "star":
        raise InputError(f'{where}: no column for time. Write time = "header" in [columns].')
    if not set(LOADS) & set(out):
        raise InputError(f"{where}: no load is mapped. Name columns for X, Y, Z, K, M, N along the file's axes.")
    return out


def motion_of(run: Mapping[str, Any], columns: Collection[str], where: str) -> Motion:
    """What the body did, from its definition or from columns."""
    place = f"{where}, motion"
    if "motion" not in run:
        raise InputError(f'{place}: missing. Write for example motion = {{ kind = "drift", angle = "4 deg" }}.')
    table = table_of(run["motion"], place)
    kind = table.get("kind")
    if kind not in MOTION_KINDS:
        raise InputError(f"{place}: kind {kind!r} is no captive test. {closest(str(kind), MOTION_KINDS)}")
    fields = dataclasses.fields(KINDS[kind]) if kind in KINDS else ()
    taken = [item.name for item in fields if item.name != "speed"]
    known(table, ("kind", "from", "phase", "start", "position_in", *taken), place)
    from_columns = one_of(table, "from", ("definition", "columns"), place, "definition") == "columns"
    if kind == "free" and not from_columns:
        raise InputError(f'{place}: a free motion has no definition. Write from = "columns" and map them.')
    if from_columns and not set(columns) - {"time", *LOADS}:
        raise InputError(
            f"{place}: no column of motion is mapped (u .. r, x y z, phi theta psi). Map some, or define it."
        )
    if from_columns and kind == "turn" and not set("pqr") & set(columns):
        raise InputError(f"{place}: a turn from columns needs its rate. Map r, or define the turn by rate and drift.")
    given = {"speed", "amplitude"} if from_columns else {"speed"}
    for key in [item.name for item in fields if item.default is dataclasses.MISSING and item.name not in given]:
        if key not in table:
            raise InputError(f"{place}: {kind} needs {key}. Add {key} with its unit.")
    units = _UNITS | ({"amplitude": "rad"} if kind == "roll" else {})
    numbers = {key: si(table[key], units[key], f"{place}.{key}") for key in taken if key in table}
    phase = si(table.get("phase", 0.0), "rad", f"{place}.phase")
    if "start" in table:
        if "phase" in table or "frequency" not in numbers:
            raise InputError(
                f"{place}: start is the time of a passage through mid-path; give it or phase, of a sinusoid."
            )
        phase = -numbers["frequency"] * si(table["start"], "s", f"{place}.start")
    return Motion(kind, numbers, phase, from_columns, one_of(table, "position_in", PLACES, place, "carriage"))


def moment_of(run: Mapping[str, Any], form: str, where: str) -> MomentPoint:
    """The point of the moments."""
    place = f"{where}, moment_point"
    given = run.get("moment_point")
    if given == "origin":
        return MomentPoint(about_origin=True)
    if given is None:
        raise InputError(
            f'{place}: missing. Moments about an unknown point are worth nothing. Write {{ from_nose = "2 m" }}, '
            '{ point = [...], nose = [...] } in the coordinates of the file, or "origin".'
            + (' For the CofR in the file write { nose = ["0 m", "0 m", "0 m"] }.' if form == "openfoam" else "")
        )
    table = table_of(given, place)
    known(table, ("from_nose", "y", "z", "point", "nose", "fixed"), place)
    if ("from_nose" in table) == ("nose" in table):
        raise InputError(
            f"{place}: give from_nose, or the place of the nose (and of the point) in the file's coordinates."
        )
    if run.get("frame", "body") == "inertial" and "fixed" not in table:
        raise InputError(
            f"{place}: loads are along inertial axes, and the point may move with the craft or stay. State "
            'fixed = "body", "carriage" or "water".'
        )
    return MomentPoint(
        from_nose=si(table["from_nose"], "m", f"{place}.from_nose") if "from_nose" in table else None,
        y=si(table.get("y", 0.0), "m", f"{place}.y"),
        z=si(table.get("z", 0.0), "m", f"{place}.z"),
        point=three(table["point"], "m", f"{place}.point") if "point" in table else None,
        nose=three(table["nose"], "m", f"{place}.nose") if "nose" in table else None,
        fixed=one_of(table, "fixed", FIXED, place, "body"),
    )


def body_of(run: Mapping[str, Any], craft: Craft, scale: Scale | None, where: str) -> Body:
    """The rigid body on the balance; the craft itself, or as stated."""
    place = f"{where}, body"
    given = run.get("body")
    if given == "craft":
        if scale is not None:
            raise InputError(f"{place}: the model on the balance is not the craft at full size. State its mass and cg.")
        mass = craft.mass
        return Body(mass.mass, mass.displaced_mass, mass.cg, tuple(hydrostatics(craft).cb), mass.inertia)
    if given is None:
        raise InputError(
            f'{place}: missing, and loads that include weight, buoyancy or inertia need it. Write body = "craft" or '
            "{ mass, displaced_mass, cg, cb, inertia }."
        )
    table = table_of(given, place)
    known(table, ("mass", "displaced_mass", "cg", "cb", "inertia"), place)
    mass_kg = positive(table, "mass", "kg", place)
    moments = three(table.get("inertia", [0.0] * 3), "kg*m^2", f"{place}.inertia")
    if "inertia" in (run.get("includes") or []) and "inertia" not in table:
        raise InputError(f'{place}: inertia missing: three moments about the body origin, as in ["1 kg*m^2", ...].')
    return Body(
        mass_kg,
        si(table.get("displaced_mass", mass_kg), "kg", f"{place}.displaced_mass"),
        three(table.get("cg", [0.0] * 3), "m", f"{place}.cg"),
        three(table.get("cb", [0.0] * 3), "m", f"{place}.cb"),
        tuple(tuple(moments[i] if i == j else 0.0 for j in range(3)) for i in range(3)),
    )


def scale_of(given: Any, speed: float, where: str) -> Scale | None:
    """Model scale, or None at full size."""
    if given is None:
        return None
    place = f"{where}, scale"
    table = table_of(given, place)
    known(table, ("lambda", "speed"), place)
    length = positive(table, "lambda", "", place)
    if table.get("speed") == "froude":
        return Scale(length, speed * math.sqrt(length))
    return Scale(length, si(table.get("speed", speed), "m/s", f"{place}.speed"))


def window_of(given: Any, where: str) -> Window:
    """The part of the record that is used."""
    place = f"{where}, window"
    table = table_of(given, place)
    known(table, ("start", "end", "last"), place)
    start = si(table["start"], "s", f"{place}.start") if "start" in table else -math.inf
    end = si(table["end"], "s", f"{place}.end") if "end" in table else math.inf
    if start >= end:
        raise InputError(f"{place}: start {start:g} is not before end {end:g}.")
    if "last" not in table:
        return Window(start, end)
    last = si(table["last"], "", f"{place}.last")
    if not 0.0 < last <= 1.0:
        raise InputError(f"{place}: last {last:g} is no share of the record. Give 0.5 for its second half.")
    return Window(start, end, last)


def mesh_of(given: Any, where: str) -> dict[str, str | int]:
    """Label and number of cells of the mesh; empty when not stated."""
    table = table_of(given, f"{where}, mesh")
    known(table, ("label", "cells"), f"{where}, mesh")
    cells = table.get("cells", 1)
    if table and (not isinstance(table.get("label"), str) or isinstance(cells, bool) or not isinstance(cells, int)):
        raise InputError(f'{where}, mesh: write {{ label = "medium", cells = 4200000 }}.')
    return dict(table)


def fins_of(given: Any, craft: Craft, where: str) -> tuple[float, ...]:
    """Fin angles (n_fins,) [rad] in the order of the craft."""
    table = table_of(given, f"{where}, fins")
    names = [fin.name for fin in craft.fins]
    known(table, names, f"{where}, fins of {craft.name}")
    return tuple(si(table.get(name, 0.0), "rad", f"{where}, fin {name}") for name in names)


def axes_of(given: Any, where: str) -> tuple[str, str, str]:
    """The file's axes that point forward, to starboard and down."""
    if not isinstance(given, list) or len(given) != 3 or not all(isinstance(axis, str) for axis in given):
        said = "axes missing" if given is None else f"axes {given!r}"
        raise InputError(
            f"{where}: {said}. Write the file's axes that point forward, to starboard and down: "
            'axes = ["-x", "y", "-z"] for x aft and z up, axes = ["x", "y", "z"] for axes as here.'
        )
    return given[0], given[1], given[2]
