"""Put runs of several meshes side by side, coarse to fine, and refuse what does not belong together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.grid.estimate import LEAST_MESHES
from towtank.symbols import RATES
from towtank.tank.run import Run

SAME = 1e-6
"""Largest difference of speeds, periods, lengths and densities between meshes, as a share of their size; of fin angles
[rad]."""
SAME_MOTION = 0.01
"""Largest difference of the extremes of a velocity over U (of a rate, times L): samples at other instants miss a peak
by (pi/n)^2 / 2, 0.5 % of it at 32 a period."""


@dataclass(frozen=True)
class Mesh:
    """A mesh by its label, number of cells, and dimensions: 3 for a volume, 2 for panels on a surface."""

    label: str
    cells: int
    dimensions: int = 3

    @property
    def size(self) -> float:
        """Representative size h = cells^(-1/dimensions), over the root of the volume.

        Source     celik2008, step 1.
        """
        return float(self.cells ** (-1.0 / self.dimensions))


def mesh_of(run: Run) -> Mesh:
    """The mesh of a run, from ``provenance["mesh"]``.

    Raises
    ------
    InputError
        The run does not tell its mesh, or tells a number of cells that cannot be.
    """
    told = run.provenance.get("mesh")
    remedy = 'Its provenance needs "mesh": {"label": "fine", "cells": 1250000}; give it when the run is made or read.'
    if not isinstance(told, dict) or "cells" not in told:
        raise InputError(f"grid: run {run.name} ({run.id}) does not say which mesh it was made on. {remedy}")
    cells, dimensions = told["cells"], told.get("dimensions", 3)
    if not isinstance(cells, int | float) or not np.isfinite(cells) or cells < 1 or dimensions not in (1, 2, 3):
        raise InputError(f"grid: run {run.name}: mesh of {cells!r} cells in {dimensions!r} dimensions. {remedy}")
    return Mesh(str(told.get("label") or f"{int(cells)}-cells"), int(cells), int(dimensions))


def matched(sets: Sequence[Sequence[Run]]) -> tuple[tuple[Mesh, ...], list[tuple[Run, ...]]]:
    """Meshes coarse to fine, and for each run name its runs in that order.

    Raises
    ------
    InputError
        See ``grid_study``.
    """
    if len(sets) < LEAST_MESHES:
        raise InputError(
            f"grid: {len(sets)} sets of runs. An observed order needs the same runs on {LEAST_MESHES} meshes or more."
        )
    found = sorted(
        ((_one_mesh(runs), {run.name: run for run in runs}) for runs in sets), key=lambda item: item[0].cells
    )
    meshes = tuple(mesh for mesh, _ in found)
    for what, values in (("label", [m.label for m in meshes]), ("number of cells", [m.cells for m in meshes])):
        if twice := [value for value, number in Counter(values).items() if number > 1]:
            raise InputError(f"grid: {what} {twice[0]} stands for two meshes. Give each mesh its own.")
    if len({mesh.dimensions for mesh in meshes}) > 1:
        raise InputError("grid: meshes of different dimensions cannot be compared. Study each kind by itself.")
    names = list(found[-1][1])
    for mesh, runs in found:
        _same_names(mesh, set(runs), meshes[-1], set(names))
    rows = [tuple(runs[name] for _, runs in found) for name in names]
    for row in rows:
        _same_test(row, meshes)
    return meshes, rows


def _one_mesh(runs: Sequence[Run]) -> Mesh:
    if not runs:
        raise InputError("grid: a set holds no runs. Each set is the runs made on one mesh.")
    meshes = {mesh_of(run) for run in runs}
    if len(meshes) > 1:
        labels = ", ".join(sorted(f"{mesh.label} ({mesh.cells} cells)" for mesh in meshes))
        raise InputError(f"grid: one set holds runs of several meshes: {labels}. Give one folder for each mesh.")
    if twice := [name for name, number in Counter(run.name for run in runs).items() if number > 1]:
        ids = ", ".join(run.id for run in runs if run.name == twice[0])
        raise InputError(
            f"grid: run {twice[0]} is there twice on one mesh ({ids}), made with different settings. "
            "Leave one of each; the settings stand in the provenance of the runs."
        )
    return meshes.pop()


def _same_names(mesh: Mesh, names: set[str], other: Mesh, wanted: set[str]) -> None:
    if names != wanted:
        lacking, extra = sorted(wanted - names), sorted(names - wanted)
        words = (f"lacks {', '.join(lacking)}" if lacking else "") + (" and " if lacking and extra else "")
        words += f"has {', '.join(extra)} besides" if extra else ""
        raise InputError(f"grid: mesh {mesh.label} {words}, against {other.label}. Run the same tests on every mesh.")


def _same_test(row: Sequence[Run], meshes: Sequence[Mesh]) -> None:
    """Craft, water, speed and motion of one run agree on all meshes."""
    base = row[-1]
    for mesh, run in zip(meshes, row, strict=True):
        for what in ("craft", "kind", "level", "symmetry"):
            if getattr(run, what) != getattr(base, what):
                _differ(run, mesh, meshes[-1], what, getattr(run, what), getattr(base, what))
        for what, unit in (("speed", "m/s"), ("period", "s"), ("density", "kg/m3"), ("length", "m"),
                           ("origin_from_nose", "m")):  # fmt: skip
            a, b = float(getattr(run, what)), float(getattr(base, what))
            if abs(a - b) > SAME * max(abs(a), abs(b)):
                _differ(run, mesh, meshes[-1], what, f"{a:g} {unit}", f"{b:g} {unit}")
        for rate, a, b in zip(RATES, _swing(run), _swing(base), strict=True):
            if np.abs(a - b).max() > SAME_MOTION * base.speed / (1.0 if rate in "uvw" else base.length):
                _differ(
                    run, mesh, meshes[-1], f"motion in {rate}", f"{a[0]:.4g} to {a[1]:.4g}", f"{b[0]:.4g} to {b[1]:.4g}"
                )
        if run.delta.shape[1] != base.delta.shape[1] or np.abs(run.delta[0] - base.delta[0]).max(initial=0.0) > SAME:
            _differ(run, mesh, meshes[-1], "fin angles", run.delta[0], base.delta[0])


def _swing(run: Run) -> np.ndarray:
    """Least and largest of each velocity over the run (6, 2); sampling moves them a little."""
    nu = run.history.nu
    return np.stack([nu.min(axis=0), nu.max(axis=0)], axis=1)


def _differ(run: Run, mesh: Mesh, other: Mesh, what: str, a: object, b: object) -> None:
    raise InputError(
        f"grid: run {run.name} has {what} {a} on mesh {mesh.label} and {b} on {other.label}. Only the mesh may differ, "
        "or the change would be taken for discretisation; run the same test on both."
    )
