"""``grid.json``: written whole, read back equal."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.grid.estimate import Estimate
from towtank.grid.gather import Mesh
from towtank.grid.gci import Triplet
from towtank.grid.study import GridStudy, Quantity

SCHEMA = "towtank/grid/1"
FILE = "grid.json"


def write_grid(study: GridStudy, path: Path | str) -> Path:
    """Write ``study`` as JSON.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(Path(path), document(study))


def document(study: GridStudy) -> dict[str, Any]:
    """The content of ``grid.json``: meshes coarse to fine, quantities by name, the choice."""
    return {
        "schema": SCHEMA,
        "craft": study.craft,
        "level": study.level,
        "symmetry": study.symmetry,
        "meshes": [asdict(mesh) for mesh in study.meshes],
        "quantities": {item.name: _quantity(item, study) for item in study.quantities},
        "target": study.target,
        "chosen": study.chosen,
        "met": study.met,
        "words": study.words,
        "provenance": study.provenance,
    }


def _quantity(item: Quantity, study: GridStudy) -> dict[str, Any]:
    it = item.estimate
    return {
        "meshes": [mesh.label for mesh in study.meshes],
        "values": list(item.values),
        "order": it.order,
        "extrapolated": it.extrapolated,
        "gci": it.gci,
        "verdict": it.verdict,
        "uncertainty": it.uncertainty,
        "in_range": it.in_range,
        "used": list(it.used),
        "run": item.run,
        "kind": item.kind,
        "load": item.load,
        "measure": item.measure,
        "scale": item.scale,
        "triplet": asdict(it.triplet),
    }


def read_grid(path: Path | str) -> GridStudy:
    """Read a study written by ``write_grid``.

    Raises
    ------
    ArtefactError
        Missing, not JSON, of another schema, or without something that a study needs.
    """
    path = Path(path)
    content = read_json(path, SCHEMA)
    try:
        return GridStudy(
            craft=str(content["craft"]), level=str(content["level"]), symmetry=str(content["symmetry"]),
            meshes=tuple(Mesh(**mesh) for mesh in content["meshes"]),
            quantities=tuple(_read_quantity(item) for item in content["quantities"].values()),
            target=float(content["target"]), chosen=str(content["chosen"]), met=bool(content["met"]),
            words=str(content["words"]), provenance=content["provenance"],
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ArtefactError(
            f"{path} is not a whole grid study ({type(error).__name__}: {error}). Delete it; `towtank grid` writes it "
            "again."
        ) from None


def _read_quantity(item: dict[str, Any]) -> Quantity:
    told = dict(item["triplet"])
    triplet = Triplet(told.pop("verdict"), **{key: _number(value) for key, value in told.items()})
    found = Estimate(
        item["verdict"], _number(item["order"]), _number(item["extrapolated"]), _number(item["gci"]),
        np.array([_number(value) for value in item["uncertainty"]]), bool(item["in_range"]),
        tuple(float(order) for order in item["used"]), triplet,
    )  # fmt: skip
    values = tuple(float(value) for value in item["values"])
    return Quantity(item["run"], item["kind"], item["load"], item["measure"], values, float(item["scale"]), found)


def _number(value: float | None) -> float:
    """A number of the file, where null stands for none."""
    return math.nan if value is None else float(value)
