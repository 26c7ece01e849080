"""A mesh about an imported surface: blockMesh, then snappyHexMesh, then the layers measured."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.openfoam.mesh.spacing import first_cell, geometric
from towtank.tank.openfoam.mesh.stl import BEND, Surface

LAST = 0.5
"""Height of the last layer over the width of the cells of the wall: the water above it is then twice as coarse."""

MOST_LAYERS, USUAL_LAYERS = 40, 5
"""Most layers; and their number where none is asked for and they do not grow."""

MOST_CELLS = 20_000_000
"""Cells beyond which snappyHexMesh ends its refinement: a slip of a setting shall not fill the memory."""

GROWTH = 1.25
"""Growth of the cells from the cubes about the surface out to the far field."""

LAYER_ANGLE = 130.0
"""Edges of the wall that turn by more [deg] have no layers across them."""

LEAST_THICKNESS = 0.15
"""Share of the thickness asked for below which snappyHexMesh leaves the layers of a face out."""

LAYER_ITERATIONS = 30
OFF_THE_GRID = (0.9137, 0.9071, 0.9213)
"""Share of the way to the far field of the point that is said to be in the water: on no face of a cell."""


@dataclass(frozen=True)
class SnappySettings:
    """How finely an imported surface is meshed. The defaults give a SUBOFF hull 0.2 million cells.

    cells_across : cells of the wall over the craft's diameter.   levels : halvings from the cubes of the base mesh to
    the cells of the wall.   fine : further halvings at sharp edges and where the wall bends strongly within a cell.
    buffer : cells between two levels.   y_plus : of the centre of the first layer.   expansion : from layer to layer.
    layers : flat cells on the wall; None for as many as bring the last one to ``LAST`` of the width of the cells of the
    wall, of those at its edges where it has sharp ones: a stack thicker than these does not fit into the corners.
    far : half the width of the outer box [lengths].
    """

    cells_across: int = 24
    levels: int = 4
    fine: int = 1
    buffer: int = 4
    layers: int | None = None
    y_plus: float = 60.0
    expansion: float = 1.3
    far: float = 2.5

    def __post_init__(self) -> None:
        limits: tuple[tuple[str, float, float, str], ...] = (
            ("cells_across", 6, 400, "fewer lose the shape of the hull, more are beyond a machine"),
            ("levels", 1, 8, "each is a halving of the cells"),
            ("fine", 0, 4, "each is a halving of the cells"),
            ("buffer", 1, 20, "cells of two levels have to be told apart"),
            ("layers", 0, MOST_LAYERS, "more are thinner than what the numbers of a mesh hold"),
            ("y_plus", 0.1, 300.0, "the range of resolved walls and wall functions"),
            ("expansion", 1.0, 2.0, "layers grow outwards, and the solver loses its order where they double"),
            ("far", 1.0, 50.0, "nearer the boundary holds the flow up, further off cells are spent on nothing"),
        )
        for name, least, most, why in limits:
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise InputError(f"SnappySettings: {name} {value:g} is not in {least:g} to {most:g}: {why}.")

    def refined(self, factor: float) -> SnappySettings:
        """The same with ``factor`` times the cells each way; layers stay as they are."""
        return self if factor == 1.0 else replace(self, cells_across=round(factor * self.cells_across))

    @property
    def label(self) -> str:
        """Name of a mesh of a family."""
        layers = "" if self.layers is None else f"-l{self.layers}"
        return f"snappy-{self.cells_across}{layers}-y{self.y_plus:g}"

    def wall_cell(self, craft: Craft) -> float:
        """Width [m] of the cells of the wall."""
        return craft.diameter / self.cells_across

    def heights(self, craft: Craft, speed: float, sharp: bool = False) -> Array:
        """Heights [m] of the layers asked for, from the wall on, at ``speed`` [m/s]; ``sharp`` : the wall has edges.

        Raises
        ------
        InputError
            The last layer is taller than the cells of the wall are wide.
        """
        first = first_cell(self.y_plus, speed, craft.length, craft.water.kinematic_viscosity)
        width = self.wall_cell(craft)
        if self.layers is None:
            return _stack(first, self.expansion, width / (2**self.fine if sharp else 1))
        heights = first * self.expansion ** np.arange(self.layers)
        if self.layers and heights[-1] > width:
            raise InputError(
                f"SnappySettings: layer {self.layers} would be {1e3 * heights[-1]:.3g} mm tall at {speed:g} m/s, and "
                f"the cells of the wall are {1e3 * width:.3g} mm wide. Cells must not shrink from the last layer to "
                "the water above it: ask for fewer layers, a lower y_plus or fewer cells_across."
            )
        return np.asarray(heights)

    def estimate(self, craft: Craft) -> int:
        """Cells, within a third or so, without making the mesh."""
        cell = self.wall_cell(craft)
        faces = math.pi * craft.diameter * craft.length * 0.85 / cell**2
        layers = len(self.heights(craft, craft.speed))
        # Cells between levels lie on ever wider shells of ever larger cells; the ends are one level finer.
        return int(faces * (1.0 * layers + 1.8 * self.buffer) + 30_000)


def _stack(first: float, expansion: float, width: float) -> Array:
    """Heights [m] from ``first`` on up to ``LAST`` of ``width``, or the first alone; none if it exceeds the width."""
    heights = first * expansion ** np.arange(MOST_LAYERS if expansion > 1.0 else USUAL_LAYERS)
    return np.asarray(heights[heights <= max(LAST * width, min(first, width))])


def dictionaries(surface: Surface, craft: Craft, settings: SnappySettings, heights: Array) -> dict[str, Any]:
    """Values of the templates of the mesh."""
    cell = settings.wall_cell(craft)
    cube = cell * 2**settings.levels
    half = settings.far * craft.length
    low, high = np.array(surface.low), np.array(surface.high)
    ends, counts, grading = zip(*(_side(low[i], high[i], cube, half) for i in range(3)), strict=True)
    middle = 0.5 * (low + high)
    return {
        "surface": surface.path.name,
        "cube": f"{cube:.6g}",
        "cell": f"{cell:.6g}",
        **{f"{axis}_ends": tuple(f"{v:.9g}" for v in ends[i]) for i, axis in enumerate("xyz")},
        "counts": counts,
        "grading": grading,
        "edges": surface.edges > 0,
        "included_angle": f"{180.0 - BEND:g}",
        "bend": f"{BEND:g}",
        "level": settings.levels,
        "fine_level": settings.levels + settings.fine,
        "buffer": settings.buffer,
        "most_cells": MOST_CELLS,
        "inside": tuple(f"{m + share * half:.9g}" for m, share in zip(middle, OFF_THE_GRID, strict=True)),
        "layers": len(heights),
        "first": f"{heights[0] if len(heights) else cell:.6g}",
        "expansion": f"{settings.expansion:g}",
        "least_thickness": f"{LEAST_THICKNESS * heights.sum():.6g}",
        "layer_angle": f"{LAYER_ANGLE:g}",
        "layer_iterations": LAYER_ITERATIONS,
    }


def _side(low: float, high: float, cube: float, half: float) -> tuple[tuple[float, float], int, tuple[Any, ...]]:
    """One direction of the base mesh: its ends [m], its cells, and its sections (share, cells, last over first)."""
    core = math.ceil((high - low) / cube) + 4
    middle, inner = 0.5 * (low + high), 0.5 * core * cube
    outer = max(half - inner, 4.0 * cube)
    count = max(2, round(math.log1p(outer * (GROWTH - 1.0) / cube) / math.log(GROWTH)))
    steps = np.diff(geometric(cube, count, outer))
    ratio = float(steps[-1] / steps[0])
    total = 2.0 * (inner + outer)
    share = f"{outer / total:.9g}"
    sections = (
        (share, count, f"{1.0 / ratio:.9g}"),
        (f"{2.0 * inner / total:.9g}", core, "1"),
        (share, count, f"{ratio:.9g}"),
    )
    return (middle - inner - outer, middle + inner + outer), core + 2 * count, sections


def told(log: Path) -> Mapping[str, float]:
    """What snappyHexMesh itself says of its layers: mean number, mean thickness [m], share of the thickness.

    Empty where its log holds no such table, as without layers.
    """
    found: dict[str, float] = {}
    for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
        cells = line.split()
        if len(cells) == 5 and cells[0] == "hull" and cells[1].isdigit():
            try:
                values = [float(cell) for cell in cells[1:]]
            except ValueError:
                continue
            found = {"faces": values[0], "layers": values[1], "thickness": values[2], "share": values[3] / 100.0}
    return found
