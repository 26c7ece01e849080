"""Measure how y+ and the Courant number are spread in a solved case, from its last fields, before they are removed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError, TankError
from towtank.frames import Array
from towtank.tank.openfoam.case import Case
from towtank.tank.openfoam.dictionary import times
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, Distribution, shares
from towtank.tank.openfoam.fields import Field, read_field, read_mesh
from towtank.tank.openfoam.mesh.poly import PolyMesh
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors

SCHEMA = "towtank/case-distribution/1"
FILE = "distribution.json"
"""In the folder of a case."""


def keep(case: Case) -> None:
    """Write the distributions of a solved case from its last fields, ``yPlus`` and ``phi``, into its folder.

    What cannot be read is left out with the reason: the run is solved, and its loads do not depend on it. Where the
    fields are gone already, what was kept before stays.
    """
    found = times(case.folder)
    if found and any((found[-1] / name).is_file() for name in ("yPlus", "phi")):
        write_json(case.folder / FILE, {"schema": SCHEMA, **measured(case, found[-1]).document()})


def kept(folder: Path) -> dict[str, Any]:
    """What ``keep`` wrote for the case in ``folder``; empty for a case that was solved before it was kept."""
    try:
        document = read_json(folder / FILE, SCHEMA)
    except ArtefactError:
        return {}
    return {name: value for name, value in document.items() if name != "schema"}


def measured(case: Case, time: Path) -> Distribution:
    """Distributions of the fields in the folder ``time`` of a case."""
    try:
        mesh = read_mesh(case.folder)
    except (TankError, ValueError, IndexError) as error:
        return Distribution(missing=(f"y+ and Courant number are not known: {error}",))
    found, missing = Distribution(), []
    for what, file, read in (("y+", "yPlus", _with_y_plus), ("Courant number", "phi", _with_courant)):
        try:
            if (time / file).is_file():
                found = read(found, case, mesh, read_field(time / file))
        except (TankError, ValueError, IndexError) as error:
            missing.append(f"{what} is not known: {error}")
    return replace(found, missing=tuple(missing))


def _with_y_plus(found: Distribution, case: Case, mesh: PolyMesh, y_plus: Field) -> Distribution:
    rows, area = of_walls(mesh, y_plus, case.walls)
    return replace(found, y_plus=rows, area=area)


def _with_courant(found: Distribution, case: Case, mesh: PolyMesh, flux: Field) -> Distribution:
    if case.line is None:
        return found
    numbers = courant_numbers(mesh, flux, case.line.step)
    return replace(found, courant=shares(numbers, np.ones(mesh.cells), COURANT))


def of_walls(
    mesh: PolyMesh, y_plus: Field, walls: Iterable[str]
) -> tuple[dict[str, tuple[float, ...]], dict[str, float]]:
    """Shares of y+ by area of each wall, and the areas [m2].

    Raises
    ------
    TankError
        The mesh, or the field, has no such wall.
    """
    size = np.linalg.norm(face_vectors(mesh)[1], axis=1)
    rows, area = {}, {}
    for patch in walls:
        if patch not in y_plus.patches:
            raise TankError(f"the field says nothing of the wall {patch}")
        weights = size[mesh.patch(patch).faces]
        rows[patch] = shares(y_plus.on(patch, len(weights)), weights, Y_PLUS)
        area[patch] = float(weights.sum())
    return rows, area


def courant_numbers(mesh: PolyMesh, flux: Field, step: float) -> Array:
    """Courant number (cells,): half the sum of |flux| [m3/s] over the faces, times ``step`` [s], over the volume.

    Source     OpenFOAM v1912, CourantNo.H. In a moving mesh ``phi`` is relative to it.
    """
    inner = len(mesh.neighbour)
    through = [flux.within(inner), *(flux.on(patch.name, patch.count) for patch in mesh.patches)]
    size = np.abs(np.concatenate(through))
    total = np.bincount(mesh.owner, size, mesh.cells) + np.bincount(mesh.neighbour, size[:inner], mesh.cells)
    _, volume = cell_volumes(mesh, *face_vectors(mesh))
    return np.asarray(0.5 * total * step / volume)
