"""The table of one run, whatever the format of its files, and what decides its identity."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.imported.arrays import read_mat_columns, read_netcdf_columns
from towtank.tank.imported.delimited import read_delimited
from towtank.tank.imported.joining import joined
from towtank.tank.imported.mapping import COLUMN_UNITS, Column, Spec
from towtank.tank.imported.openfoam import added, forces_files, read_forces
from towtank.tank.imported.table import Table, read_bytes

STAR_TIMES = ("Physical Time", "Iteration")
"""Columns that a STAR-CCM+ monitor export may count its rows by; the first that is there is taken."""


def read_source(spec: Spec) -> tuple[Table, str]:
    """Rows of one run in the order of time, and the name of their time column.

    Raises
    ------
    InputError
        A file is missing, empty, damaged, of another format, or of another run than the rest.
    """
    wanted = [column.name for column in spec.columns.values()]
    match spec.format:
        case "openfoam":
            return _forces(spec), "time"
        case "netcdf":
            tables = [read_netcdf_columns(path, wanted) for path in spec.files]
        case "mat":
            tables = [read_mat_columns(path, wanted) for path in spec.files]
        case _:
            tables = [read_delimited(path) for path in spec.files]
    time = _time(spec, tables[0])
    return joined(tables, time), time


def _time(spec: Spec, first: Table) -> str:
    if "time" in spec.columns:
        return spec.columns["time"].name
    found = next((name for name in STAR_TIMES if first.holds(name)), None)
    if found is None:
        shown = ", ".join(repr(name) for name in first.names[:12])
        raise InputError(
            f'{first.title}: neither {" nor ".join(STAR_TIMES)} is a column. Write time = "header" in [columns]. '
            f"The file has {shown}."
        )
    return found


def _forces(spec: Spec) -> Table:
    tables = [read_forces(place) for place in spec.files]
    if spec.sum:
        return added(tables)
    centres = {table.moment_point for table in tables}
    if len(centres) > 1:
        raise InputError(
            f"{spec.name}: its folders name different CofR {sorted(map(str, centres))}. Import them as runs of their "
            "own."
        )
    return joined(tables, "time")


def columns_in_si(spec: Spec, table: Table, time: str) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Quantity -> values (N,) in SI along the file's axes, ``time`` among them, and a sentence on units.

    Raises
    ------
    InputError
        A column is missing, has a wrong unit, or counts iterations where time is needed.
    """
    mapped: Mapping[str, Column] = {"time": Column(time), **spec.columns}
    out = {
        key: table.column(column.name, COLUMN_UNITS[key], column.unit) * column.factor for key, column in mapped.items()
    }
    bare = [key for key, column in mapped.items() if not column.unit and not table.units[table.find(column.name)]]
    counted = "time" in bare and table.names[table.find(time)].casefold().startswith("iteration")
    if counted and not spec.steady:
        raise InputError(
            f"{table.title}: rows are counted by {time!r}, and a {spec.motion.kind} needs the time. Export the "
            "monitors "
            'against "Physical Time".'
        )
    units = sorted({table.units[table.find(column.name)] or column.unit for column in mapped.values()} - {""})
    said = [f"units of the file: {', '.join(units)}"] if units else []
    bare = [key for key in bare if not (counted and key == "time")]
    said += [f"no unit is stated for {', '.join(bare)}: taken as SI"] if bare else []
    said += [f"{key} multiplied by {column.factor:g}" for key, column in mapped.items() if column.factor != 1.0]
    return out, tuple(said)


def input_hashes(spec: Spec) -> dict[str, str]:
    """File, as the mapping or the command names it -> first 16 hex digits of the SHA-256 of its content."""
    paths = [path for place in spec.files for path in (forces_files(place) if spec.format == "openfoam" else [place])]
    return {path.as_posix(): hashlib.sha256(read_bytes(path)).hexdigest()[:16] for path in paths}
