"""design.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json
from towtank.design.goal import Goal
from towtank.design.study import DesignStudy, Point
from towtank.errors import ArtefactError
from towtank.sweep.sweep import Axis
from towtank.sweep.vary import KINDS

SCHEMA = "towtank/design/1"


def write_design(study: DesignStudy, folder: Path | str) -> Path:
    """Write ``design.json``: SI units, null where there is no number; points are named by their key.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    document = {
        "schema": SCHEMA,
        "craft": study.craft,
        "level": study.level,
        "speed": study.speed,
        "target": study.target,
        "hotel": study.hotel,
        "drive": dict(study.drive),
        "goals": [asdict(goal) for goal in study.goals],
        "axes": [
            {"name": a.name, "unit": a.unit, "meaning": KINDS[a.name].meaning, "given": study.given[a.name],
             "values": list(a.values)}
            for a in study.axes
        ],
        "columns": dict(study.columns),
        "points": [
            {"key": p.key, "changes": dict(p.changes), "values": dict(p.values), "notes": list(p.notes),
             "failed": p.failed}
            for p in study.points
        ],
        "base": study.base.key,
        "alone": {name: None if point is None else point.key for name, point in study.alone.items()},
        "best": None if study.best is None else study.best.key,
        "pareto": [point.key for point in study.pareto],
        "provenance": dict(study.provenance),
    }  # fmt: skip
    return write_json(Path(folder) / "design.json", document)


def read_design(path: Path | str) -> DesignStudy:
    """Read ``design.json``.

    Raises
    ------
    ArtefactError
        Missing, not a design study, or a key is missing.
    """
    d = read_json(Path(path), SCHEMA)
    try:
        points = {p["key"]: _point(p) for p in d["points"]}
        return DesignStudy(
            craft=d["craft"], level=d["level"], speed=float(d["speed"]), target=float(d["target"]),
            hotel=float(d["hotel"]), drive=d["drive"], goals=tuple(Goal(**goal) for goal in d["goals"]),
            axes=tuple(Axis(a["name"], tuple(map(float, a["values"]))) for a in d["axes"]),
            given={a["name"]: _number(a["given"]) for a in d["axes"]}, base=points[d["base"]],
            points=tuple(points.values()),
            alone={name: None if key is None else points[key] for name, key in d["alone"].items()},
            best=None if d["best"] is None else points[d["best"]], columns=d["columns"], provenance=d["provenance"],
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is not a whole design study ({error}). Run `towtank design` again.") from None


def _point(p: Mapping[str, Any]) -> Point:
    changes = tuple(sorted((name, float(value)) for name, value in p["changes"].items()))
    values = {name: _number(value) for name, value in p["values"].items()}
    return Point(changes, values, tuple(p["notes"]), p["failed"], p["key"])


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
