"""A study of a craft in the OpenFOAM tank: a few runs on three or more meshes of one family."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.grid.estimate import LEAST_MESHES, check_sizes
from towtank.grid.study import TARGET, GridStudy, check_target, grid_study
from towtank.plan.kinds import Plan
from towtank.plan.standard import standard_plan
from towtank.progress import Progress
from towtank.quantity import Quantity
from towtank.tank.campaign import tow
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.schedule import cells_of
from towtank.tank.openfoam.tank import OpenFoamTank
from towtank.tank.run import Run

THIRDS, QUARTERS = (2.0 / 3.0, 1.0, 4.0 / 3.0), (0.75, 1.0, 1.5)

RESOLUTIONS: Mapping[str, tuple[float, ...]] = {"draft": QUARTERS, "standard": THIRDS, "fine": THIRDS}
"""Quality -> refinements of the default study: those at which the cells around, a multiple of 4, keep their share."""

NEAR = 0.005
"""Refinements this near to a multiple of 1/3 are taken for it: 0.667 and 2/3 are one mesh, and one set of runs."""

RUNS = ("drift-p04", "drift-p12", "incidence-p12", "sway-v0.12-w2", "rudder-p10")
"""Runs of the standard plan: loads that are linear and not in the angle, an oscillation, a deflected fin. All lie in a
plane of symmetry, so that they have one number of cells. Of the oscillations the gentle and short one: its Courant
number lets the same time step do on every mesh."""


def rans_plan(craft: Craft, speed: Quantity | None = None) -> Plan:
    """The runs of the default study: those of ``RUNS`` that the standard plan of the craft has.

    A bare hull has no rudder run, and a craft with 4-fold symmetry no incidence: drift tells the same.
    """
    plan = standard_plan(craft, speed)
    return Plan(plan.craft, plan.speed, tuple(test for test in plan.tests if test.name in RUNS))


def family(craft: Craft, plan: Plan, resolutions: Sequence[float], base: OpenFoamTank) -> list[OpenFoamTank]:
    """``base`` at each refinement, coarse to fine, after each mesh was found fit for the craft.

    Raises
    ------
    InputError
        Fewer than three refinements, two that make the same mesh or nearly so, one out of range, or one too coarse for
        the fins.
    """
    tanks = [replace(base, refinement=_snapped(resolution)) for resolution in sorted(resolutions)]
    meshes = [tank.mesh_settings for tank in tanks if isinstance(tank.mesh_settings, MeshSettings)]
    if len(meshes) < len(tanks):
        raise InputError("grid: an imported surface has no family of meshes. Leave out `surface`.")
    labels = [mesh.label for mesh in meshes]
    if len(set(labels)) < max(len(labels), LEAST_MESHES):
        raise InputError(
            f"grid: resolutions {', '.join(f'{r:g}' for r in resolutions)} make the meshes {', '.join(labels)}. "
            f"An order needs {LEAST_MESHES} different ones, such as "
            f"{', '.join(f'{r:.4g}' for r in RESOLUTIONS[base.quality])}."
        )
    cells = np.array([cells_of(craft, plan.tests[0], tank.mesh_settings) for tank in tanks], dtype=float)
    check_sizes(cells ** (-1.0 / 3.0))
    if craft.fins:
        # The coarsest has the fewest cells on a fin.
        _ = mesh_of(craft, meshes[0], half=False, fins=(0.0,) * len(craft.fins), speed=plan.speed)
    return tanks


def _snapped(resolution: float) -> float:
    near = round(3.0 * resolution) / 3.0 if math.isfinite(resolution) else resolution
    return near if abs(near - resolution) <= NEAR else float(resolution)


def rans_on_meshes(
    plan: Plan, tanks: Sequence[OpenFoamTank], out: Path | str, progress: Progress | None = None, jobs: int = 1
) -> tuple[tuple[Run, ...], ...]:
    """Run ``plan`` in each of ``tanks``, the first one first; the runs of each mesh.

    out : study folder; runs and cases of a mesh go to ``grid/<label>/runs``. Whole ones are read and not repeated.
    jobs : cases at a time.

    Raises
    ------
    TankError
        Runs failed, or the study was stopped; what is on file stays for the next call.
    """
    folders = [Path(out) / "grid" / tank.mesh_settings.label for tank in tanks]
    return tuple(tow(plan, tank, folder, progress, jobs=jobs) for tank, folder in zip(tanks, folders, strict=True))


def unlike(sets: Sequence[Sequence[Run]]) -> dict[str, tuple[int, ...]]:
    """Tests whose time step is not the same on every mesh, each with its steps a period, mesh by mesh.

    A run that failed was made again with smaller steps: between such meshes a load changes with the step too.
    """
    steps: dict[str, list[int]] = {}
    for runs in sets:
        for run in runs:
            steps.setdefault(run.name, []).append(int(run.provenance.get("case", {}).get("steps_per_period", 0)))
    return {name: tuple(found) for name, found in steps.items() if len(set(found)) > 1}


def rans_grid_study(
    craft: Craft,
    out: Path | str,
    speed: Quantity | None = None,
    *,
    tank: OpenFoamTank | None = None,
    resolutions: Sequence[float] | None = None,
    target: float = TARGET,
    progress: Progress | None = None,
    jobs: int = 1,
) -> GridStudy:
    """Grid study of a craft in the OpenFOAM tank.

    Parameters
    ----------
    out, progress, jobs : as in ``rans_on_meshes``.   speed : as in ``standard_plan``.
    tank : quality and numerics; its refinement is left aside.   resolutions : refinements, any order; by default
        those of ``RESOLUTIONS``.   target : as in ``grid_study``.

    Raises
    ------
    InputError
        As ``family`` and ``grid_study``.
    TankError
        As ``rans_on_meshes``.
    """
    check_target(target)
    base = OpenFoamTank() if tank is None else tank
    plan = rans_plan(craft, speed)
    tanks = family(craft, plan, RESOLUTIONS[base.quality] if resolutions is None else resolutions, base)
    return grid_study(rans_on_meshes(plan, tanks, out, progress, jobs), target=target)
