"""The mesh about an imported surface as a tank asks for it: made once, kept, measured, refused where it is unfit."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.artefact import read_json, write_json
from towtank.craft.craft import Craft
from towtank.errors import InputError, TankError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest
from towtank.provenance import digest
from towtank.tank.openfoam.fields import read_mesh
from towtank.tank.openfoam.find import require
from towtank.tank.openfoam.mesh.layers import columns, layers_of
from towtank.tank.openfoam.mesh.poly import Patch, PolyMesh
from towtank.tank.openfoam.mesh.quality import quality
from towtank.tank.openfoam.mesh.snappy import SnappySettings, dictionaries, told
from towtank.tank.openfoam.mesh.snappy_run import make, meshing_time, templates
from towtank.tank.openfoam.mesh.spacing import first_cell
from towtank.tank.openfoam.mesh.stl import Surface, check_fit, read_surface

SCHEMA = "towtank/surface-mesh/1"
FILE = "surface.json"
"""In the folder of a mesh and of every case on it: what was measured."""

WALL = "hull"
COVERED = 0.8
"""Judgement: share of the wall that has to have the layers asked for. What is left has its first centre in the outer
part of the boundary layer, where a wall function takes the friction from the wrong velocity."""

AREA = 0.03
"""Judgement: share by which the wall of the mesh may differ in area from the surface; friction goes with it."""

BEYOND = 0.02
"""Judgement: share of the diameter by which a face of the wall lies off the craft's hull when it is no part of it."""

DOUBT = 0.1
"""Judgement: share of the layers asked for by which the count may differ from that of snappyHexMesh's log, which is
rounded to two digits or so."""

FILES = ("points", "faces", "owner", "neighbour", "boundary")


@dataclass(frozen=True)
class SurfaceMesh:
    """A mesh about the surface in ``path``, whose content has the hash ``digest``, made by ``settings``.

    store : folder that keeps made meshes; without one each case makes its own.   stop : ends the making when set.
    """

    path: Path
    digest: str
    settings: SnappySettings
    store: Path | None = field(default=None, compare=False)
    stop: threading.Event | None = field(default=None, compare=False, repr=False)

    half = False
    """The whole water always: whether a surface is alike on both sides of a plane is not looked into."""

    @property
    def label(self) -> str:
        """Name of the mesh in a family."""
        return self.settings.label

    def identity(self) -> dict[str, Any]:
        """What decides the mesh beside craft and speed."""
        return {"surface": self.digest, **asdict(self.settings)}

    def check(self, craft: Craft, tests: Sequence[CaptiveTest]) -> Surface:
        """See that the surface is ``craft``, and that ``tests`` can be run on a surface that does not change.

        Raises
        ------
        InputError
            The surface cannot be read, is not closed, or is not the craft; a test turns fins.
        """
        turned = [test.name for test in tests if any(test.fins)]
        if turned:
            others = dict.fromkeys(test.kind for test in tests if not any(test.fins))
            left = f" (--only {','.join(kind for kind in others)})" if others else ""
            raise InputError(
                f"{len(turned)} tests turn fins, {', '.join(turned[:3])}{' ...' if len(turned) > 3 else ''}, and those "
                f"of {self.path.name} are part of a surface that is fixed. Leave these tests out{left}, or run them on "
                "the craft's own fins, without a surface."
            )
        surface = read_surface(self.path)
        check_fit(surface, craft)
        return surface

    def write(self, folder: Path, craft: Craft, test: CaptiveTest, speed: float) -> tuple[int, str]:
        """Put the mesh for ``speed`` [m/s] into the case ``folder``; its cells and the hash of its points.

        Raises
        ------
        InputError
            As in ``check``.
        TankError
            OpenFOAM fails, or no solver can run on the mesh.
        """
        place = self._made(self.check(craft, (test,)), self.store or folder / "mesh", craft, speed)
        target = folder / "constant" / "polyMesh"
        target.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            _linked(place / "constant" / "polyMesh" / name, target / name)
        shutil.copyfile(place / FILE, folder / FILE)
        points = hashlib.sha256((target / "points").read_bytes()).hexdigest()[:16]
        return int(read_json(folder / FILE, SCHEMA)["cells"]), points

    def _made(self, surface: Surface, store: Path, craft: Craft, speed: float) -> Path:
        """Folder of the mesh, made now where it is not there."""
        installation = require()
        heights = self.settings.heights(craft, speed, surface.edges > 0)
        values = dictionaries(surface, craft, self.settings, heights)
        key = digest([surface.digest, templates(), values, f"{installation.version} {installation.kind}"])
        place = store / f"{self.label}-{key}"
        store.mkdir(parents=True, exist_ok=True)
        with _alone(store / f".{place.name}.lock"):
            if not (place / FILE).is_file():
                shutil.rmtree(place, ignore_errors=True)
                part = store / f".{place.name}.part"
                shutil.rmtree(part, ignore_errors=True)
                try:
                    make(part, self.path, values, installation, self.stop)
                    write_json(part / FILE, measured(part, surface, craft, speed, heights))
                    part.replace(place)
                finally:
                    shutil.rmtree(part, ignore_errors=True)
        return place


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the lock ``path``: of cases side by side one makes the mesh, the others wait for it."""
    with path.open("a") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _linked(source: Path, target: Path) -> None:
    """The same file in two folders, or a copy where the file system has no links. No program writes into it again."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def measured(folder: Path, surface: Surface, craft: Craft, speed: float, heights: Array) -> dict[str, Any]:
    """What the mesh in ``folder`` is, from its points and faces.

    Raises
    ------
    TankError
        It cannot be read, or no solver can run on it: it has no wall, or cells that are no cells.
    """
    mesh = read_mesh(folder)
    patch = next((patch for patch in mesh.patches if patch.name == WALL and patch.count), None)
    if patch is None:
        raise TankError(
            f"the mesh about {surface.path.name} has no wall: its cells are too large to see the surface. Raise "
            "cells_across or levels."
        )
    found = quality(mesh)
    if found.negative or found.open_cells or found.wrong_faces:
        raise TankError(
            f"the mesh about {surface.path.name} cannot be solved on: {'; '.join(found.verdict())}. Ask for fewer "
            "layers or more cells_across, and see that no facets of the surface cross each other."
        )
    stacks = columns(mesh, WALL, heights)
    plate = 1.0 / first_cell(1.0, speed, craft.length, craft.water.kinematic_viscosity)
    log = folder / "log.snappyHexMesh"
    return {
        "schema": SCHEMA,
        "surface": {"name": surface.path.name, "digest": surface.digest, "area": surface.area,
                    "volume": surface.volume, "facets": surface.facets, "edges": surface.edges},
        "speed": speed,
        "cells": mesh.cells,
        "cpu": meshing_time(log),
        "area": float(stacks.area.sum()) / surface.area,
        "layers": layers_of(stacks, heights, plate).document(),
        "parts": {
            name: layers_of(stacks.only(rows), heights, plate).document()
            for name, rows in _parts(mesh, patch, craft).items()
        },
        "layers_by_face": float(np.mean(stacks.count)),
        "told": dict(told(log)),
        "quality": asdict(found),
        "verdict": list(found.verdict()),
    }  # fmt: skip


def _parts(mesh: PolyMesh, patch: Patch, craft: Craft) -> dict[str, NDArray[np.intp]]:
    """Faces of the wall on the hull of ``craft``, and those beyond it: fins have few, which count for much."""
    corners = mesh.faces[patch.faces]
    x, y, z = np.moveaxis(mesh.points[corners[:, :3]].mean(axis=1), -1, 0)
    beyond = np.hypot(y, z) > craft.profile.radius(craft.origin_from_nose - x) + BEYOND * craft.diameter
    rows = {"hull": np.flatnonzero(~beyond), "appendages": np.flatnonzero(beyond)}
    return {name: found for name, found in rows.items() if len(found)}


def measures_of(folder: Path) -> dict[str, Any]:
    """What was measured of the mesh of the case in ``folder``; empty for a mesh of the craft's own shape."""
    path = folder / FILE
    return {k: v for k, v in read_json(path, SCHEMA).items() if k != "schema"} if path.is_file() else {}


def mesh_remarks(measures: Mapping[str, Any]) -> tuple[str, ...]:
    """Short sentences, each with the limit that is passed and what may be done."""
    if not measures:
        return ()
    out = [f"mesh: {words}" for words in measures["verdict"]]
    for part, layers in measures["parts"].items():
        if layers["covered"] < COVERED:
            out.append(
                f"{100 * layers['covered']:.0f} % of the {part} has the {layers['asked']} layers asked for, limit "
                f"{100 * COVERED:.0f} %; y+ reaches {layers['y_plus'][2]:.0f} within 95 % of it: ask for fewer layers, "
                "or more cells_across, or mend the surface where they are missing"
            )
    claim, found, asked = measures["told"].get("layers"), measures["layers_by_face"], measures["layers"]["asked"]
    if claim is not None and abs(claim - found) > DOUBT * max(asked, 1):
        out.append(f"snappyHexMesh says {claim:.3g} layers, {found:.3g} are there: trust neither, look at the mesh")
    if abs(measures["area"] - 1.0) > AREA:
        out.append(
            f"wall of the mesh has {100 * measures['area']:.1f} % of the area of the surface, limit "
            f"{100 * AREA:.0f} % off: raise cells_across or fine"
        )
    return tuple(out)
