"""The mesh of a case, written into its folder: of the craft's shape, of a surface, or of two parts that overlap."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest
from towtank.tank.openfoam.formulation import Domain, Formulation, Overset, StillWater, fastest
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.mesh.imported import WALL, SurfaceMesh
from towtank.tank.openfoam.mesh.overset import overset_mesh, write_zones
from towtank.tank.openfoam.mesh.poly import PolyMesh, write_mesh
from towtank.tank.openfoam.motion import Timeline, pose


@dataclass(frozen=True)
class Written:
    """A mesh on file. walls : names of the wall patches.   label : of its family.   mesh : a hash of it."""

    walls: tuple[str, ...]
    cells: int
    label: str
    mesh: str


def write_case_mesh(
    folder: Path,
    craft: Craft,
    test: CaptiveTest,
    settings: MeshSettings | SurfaceMesh,
    domain: Domain,
    formulation: Formulation,
    line: Timeline | None,
) -> Written:
    """Make the mesh of ``test`` and write it into the case ``folder``.

    One mesh serves all tests at a speed; only where there is hardly a tow does the motion set the first cell.

    Raises
    ------
    TankError, InputError
        The mesh cannot be made, or does not fit the motion.
    """
    speed = fastest(test, craft.length) if isinstance(formulation, StillWater) else test.speed
    if isinstance(settings, SurfaceMesh):
        cells, name = settings.write(folder, craft, test, speed)
        return Written((WALL,), cells, settings.label, name)
    seen, angles = domain.craft_in_mesh(craft), test.fins or (0.0,) * len(craft.fins)
    label = settings.label
    if isinstance(formulation, Overset):
        assert line is not None  # only oscillations are overset
        poses = pose(test, domain, formulation, line)[1:]
        pair = overset_mesh(seen, settings, poses, half=domain.half, fins=angles, speed=speed)
        write_zones(folder, pair)
        mesh, label = pair.mesh, f"{label}-overset"
    else:
        mesh = mesh_of(seen, settings, half=domain.half, fins=angles, speed=speed)
    write_mesh(mesh, folder)
    walls = tuple(patch.name for patch in mesh.patches if patch.kind == "wall")
    return Written(walls, mesh.cells, label, _hash(mesh))


def _hash(mesh: PolyMesh) -> str:
    return hashlib.sha256(np.round(mesh.points, 9).tobytes()).hexdigest()[:16]
