"""The default study of a craft in the fast tank: a few runs on four meshes of panels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.grid.estimate import LEAST_MESHES
from towtank.grid.study import TARGET, GridStudy, grid_study
from towtank.plan.kinds import Plan
from towtank.plan.standard import standard_plan
from towtank.progress import Progress
from towtank.quantity import Quantity
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.tank.run import Run

RESOLUTIONS = (2.0 / 3.0, 1.0, 4.0 / 3.0, 5.0 / 3.0)
"""Of the default study: multiples of 1/3, at which the meshes are alike; 1 is the resolution of the tank."""

NEAR = 0.005
"""Resolutions this near to a multiple of 1/3 are taken for it: 0.667 and 2/3 are one mesh, and one set of runs."""

RUNS = ("drift-00", "drift-p10", "incidence-p10", "sway-v0.28-w1.25", "heave-v0.28-w1.25", "yaw-r0.45-w1.75",
        "pitch-r0.45-w1.75", "roll-a10-w2", "surge-u0.1-w1.5", "turn-p0.30", "rudder-p10", "elevator-p10",
        "aileron-p10")  # fmt: skip
"""Runs of the standard plan: one of each kind, of middling size; the mesh matters alike for the others."""


def grid_plan(craft: Craft, speed: Quantity | None = None) -> Plan:
    """The runs of the default study: those of ``RUNS`` that the standard plan of the craft has.

    A craft with 4-fold symmetry has no incidence; its heave and pitch runs are its sway and yaw runs turned, and are
    left out.
    """
    plan = standard_plan(craft, speed)
    twins = ("heave", "pitch") if craft.symmetry == "fourfold" else ()
    tests = tuple(test for test in plan.tests if test.name in RUNS and test.kind not in twins)
    return Plan(plan.craft, plan.speed, tests)


def tow_on_meshes(
    plan: Plan,
    resolutions: Sequence[float] = RESOLUTIONS,
    out: Path | str | None = None,
    progress: Progress | None = None,
    tank: FastTank | None = None,
) -> tuple[tuple[Run, ...], ...]:
    """Run ``plan`` at each resolution of the fast tank; the runs of each mesh.

    Parameters
    ----------
    out : study folder; the runs of a mesh go to ``grid/<label>/runs``. Whole ones are read and not repeated.
    tank : gives the settings beside the resolution; by default without ensemble, which has no bearing on the mesh.

    Raises
    ------
    InputError
        Fewer than three resolutions, two that make the same mesh, or one out of range.
    """
    tanks = tanks_of(resolutions, FastTank(members=0) if tank is None else tank)
    folders = [None if out is None else Path(out) / "grid" / item.mesh["label"] for item in tanks]
    return tuple(tow(plan, item, folder, progress) for item, folder in zip(tanks, folders, strict=True))


def tanks_of(resolutions: Sequence[float], base: FastTank) -> list[FastTank]:
    """``base`` at each resolution.

    Raises
    ------
    InputError
        As ``tow_on_meshes``.
    """
    tanks = [replace(base, resolution=_snapped(resolution)) for resolution in resolutions]
    labels = [item.mesh["label"] for item in tanks]
    if len(set(labels)) < max(len(labels), LEAST_MESHES):
        raise InputError(
            f"grid: resolutions {', '.join(f'{r:g}' for r in resolutions)} make the meshes {', '.join(labels)}. "
            f"An order needs {LEAST_MESHES} different ones; multiples of 1/3 give meshes that are alike."
        )
    return tanks


def _snapped(resolution: float) -> float:
    near = round(3.0 * resolution) / 3.0 if math.isfinite(resolution) else resolution
    return near if abs(near - resolution) <= NEAR else float(resolution)


def fast_grid_study(
    craft: Craft,
    speed: Quantity | None = None,
    *,
    resolutions: Sequence[float] = RESOLUTIONS,
    target: float = TARGET,
    out: Path | str | None = None,
    progress: Progress | None = None,
) -> GridStudy:
    """Grid study of a craft in the fast tank: a second or two, and nothing when the runs are on file.

    Parameters
    ----------
    speed : as in ``standard_plan``.   resolutions : of the tank, any order.   target : as in ``grid_study``.
    out, progress : as in ``tow_on_meshes``.

    Raises
    ------
    InputError
        As ``tow_on_meshes`` and ``grid_study``.
    """
    return grid_study(tow_on_meshes(grid_plan(craft, speed), resolutions, out, progress), target=target)
