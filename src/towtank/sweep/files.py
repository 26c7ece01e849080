"""sweep.json and sweep.csv."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json, write_text
from towtank.errors import ArtefactError
from towtank.sweep.sweep import Axis
from towtank.sweep.table import Row, SweepTable
from towtank.sweep.vary import KINDS

SCHEMA = "towtank/sweep/1"


def write_sweep(table: SweepTable, folder: Path | str) -> tuple[Path, Path]:
    """Write ``sweep.json`` and ``sweep.csv``: axes in SI, units in the header, empty where there is no number.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    folder = Path(folder)
    document = {
        "schema": SCHEMA,
        "craft": table.craft,
        "level": table.level,
        "axes": [
            {"name": a.name, "unit": a.unit, "meaning": KINDS[a.name].meaning, "base": base, "values": list(a.values)}
            for a, base in zip(table.axes, table.base, strict=True)
        ],
        "columns": dict(table.columns),
        "points": [
            {"at": list(row.at), "key": row.key, "values": dict(row.values), "notes": list(row.notes)}
            for row in table.rows
            if not row.failed
        ],
        "failed": [{"at": list(row.at), "key": row.key, "reason": row.failed} for row in table.failed],
        "provenance": dict(table.provenance),
    }
    return write_json(folder / "sweep.json", document), write_text(folder / "sweep.csv", csv_text(table))


def csv_text(table: SweepTable) -> str:
    """The table as text: one line per point, the reason in the last column where it failed."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(_header(a.name, a.unit) for a in table.axes), *map(_header, *_pairs(table.columns)), "failed"])
    for row in table.rows:
        values = [row.values.get(name, math.nan) for name in table.columns]
        writer.writerow([*row.at, *("" if math.isnan(value) else value for value in values), row.failed])
    return text.getvalue()


def _pairs(columns: Mapping[str, str]) -> tuple[list[str], list[str]]:
    return list(columns), list(columns.values())


def _header(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def read_sweep(path: Path | str) -> SweepTable:
    """Read ``sweep.json``.

    Raises
    ------
    ArtefactError
        Missing, not a sweep, or a key is missing.
    """
    d = read_json(Path(path), SCHEMA)
    try:
        axes = tuple(Axis(a["name"], tuple(map(float, a["values"]))) for a in d["axes"])
        rows = [_done(p) for p in d["points"]]
        rows += [Row(tuple(map(float, p["at"])), failed=p["reason"], key=p["key"]) for p in d["failed"]]
        places = [{value: i for i, value in enumerate(axis.values)} for axis in axes]
        rows.sort(key=lambda row: [place[value] for place, value in zip(places, row.at, strict=True)])
        return SweepTable(
            craft=d["craft"],
            level=d["level"],
            axes=axes,
            columns=d["columns"],
            rows=tuple(rows),
            base=tuple(_number(a["base"]) for a in d["axes"]),
            provenance=d["provenance"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is not a whole sweep ({error}). Run `towtank sweep` again.") from None


def _done(point: Mapping[str, Any]) -> Row:
    values = {name: _number(value) for name, value in point["values"].items()}
    return Row(tuple(map(float, point["at"])), values, tuple(point["notes"]), key=point["key"])


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
