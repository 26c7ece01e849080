"""Layers of flat cells on a wall, measured from the mesh: how many, how thick, where the first centre lies."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array
from towtank.tank.openfoam.mesh.poly import Labels, PolyMesh
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors

TALLER, FLAT = 1.5, 0.4
"""Judgement: a cell counts as a layer while it is at most ``TALLER`` times as tall as the layer asked for there, or at
most ``FLAT`` of the width of its face. snappyHexMesh spreads a stack of fewer layers over the thickness of all, so its
cells are taller than asked and still layers; cells above the layers are about as tall as they are wide."""

BEYOND = 1.2
"""Judgement: share of the thickness asked for that layers may reach; a flat cell further off is one of the water."""

THIN = 0.5
"""Judgement: a stack of layers counts as whole from this share of the thickness asked for on; below it its cells are
flatter, and the first centre nearer to the wall, than was asked."""


@dataclass(frozen=True)
class Columns:
    """What stands on each face of a wall (N,).

    area [m2].   first [m] : distance of the first cell's centre from the wall, twice.   count : layers.
    thickness [m] : of these layers together.
    """

    area: Array
    first: Array
    count: Labels
    thickness: Array

    def only(self, rows: NDArray[np.intp]) -> Columns:
        """Those on the faces ``rows``."""
        return Columns(self.area[rows], self.first[rows], self.count[rows], self.thickness[rows])


@dataclass(frozen=True)
class Layers:
    """Layers of a wall against those asked for; means and shares are by area.

    asked, asked_thickness [m], asked_first [m] : what was asked for.   faces, area [m2] : of the wall.
    obtained : mean number of layers.   thickness : mean share of the thickness asked for.
    covered : share of the wall with all the layers asked for, at ``THIN`` of their thickness or more.
    bare : share of the wall without a layer.
    first : height of the first cell [m] that 5, 50 and 95 % of the wall do not exceed.
    y_plus : the same of the y+ of its centre that a flat plate of the craft's length would have.
    """

    asked: int
    asked_thickness: float
    asked_first: float
    faces: int
    area: float
    obtained: float
    thickness: float
    covered: float
    bare: float
    first: tuple[float, float, float]
    y_plus: tuple[float, float, float]

    def document(self) -> dict[str, Any]:
        """Plain content."""
        return asdict(self)


def layers_of(columns: Columns, heights: Array, y_plus: float) -> Layers:
    """``columns`` against the ``heights`` (L,) [m] asked for, from the wall on; ``y_plus`` : of a cell 1 m tall."""
    share = columns.area / columns.area.sum()
    total = float(heights.sum())
    whole = (columns.count >= len(heights)) & (columns.thickness >= THIN * total)
    order = np.argsort(columns.first)
    at = np.searchsorted(np.cumsum(share[order]), (0.05, 0.5, 0.95)).clip(max=len(order) - 1)
    five, half, most = (float(v) for v in columns.first[order][at])
    return Layers(
        asked=len(heights),
        asked_thickness=total,
        asked_first=float(heights[0]) if len(heights) else 0.0,
        faces=len(share),
        area=float(columns.area.sum()),
        obtained=float(share @ columns.count),
        thickness=float(share @ columns.thickness) / total if total else 1.0,
        covered=float(share @ whole),
        bare=float(share @ (columns.count == 0)),
        first=(five, half, most),
        y_plus=(five * y_plus, half * y_plus, most * y_plus),
    )


def columns(mesh: PolyMesh, wall: str, heights: Array) -> Columns:
    """Walk from each face of ``wall`` through the cells above it as long as they are layers, of ``heights`` (L,) [m].

    A layer is a prism on the face below it: one face shares no point with that face and has as many corners. Its height
    along the normal of the wall is as ``TALLER``, ``FLAT`` and ``BEYOND`` say.
    """
    patch = mesh.patch(wall)
    faces = np.arange(patch.start, patch.start + patch.count)
    centres, vectors = face_vectors(mesh)
    middle, _ = cell_volumes(mesh, centres, vectors)
    area = np.linalg.norm(vectors[faces], axis=1)
    normal = -vectors[faces] / area[:, None]
    foot = centres[faces]
    cell = mesh.owner[faces]
    first = 2.0 * np.einsum("fi,fi->f", middle[cell] - foot, normal)
    count, thickness = np.zeros(len(faces), dtype=np.int64), np.zeros(len(faces))
    at = np.arange(len(faces))
    of_cell = _faces_of_cells(mesh)
    width, most = np.sqrt(area), BEYOND * float(heights.sum())
    for height in heights:
        top = _opposite(mesh, of_cell, cell, faces)
        reach = np.einsum("fi,fi->f", centres[top] - foot[at], normal[at])
        step = reach - thickness[at]
        good = (top >= 0) & (step > 0.0) & (step <= np.maximum(TALLER * height, FLAT * width[at])) & (reach <= most)
        at, faces, below = at[good], top[good], cell[good]
        count[at] += 1
        thickness[at] = reach[good]
        inner = faces < len(mesh.neighbour)
        at, faces, below = at[inner], faces[inner], below[inner]
        cell = np.where(mesh.owner[faces] == below, mesh.neighbour[faces], mesh.owner[faces])
    return Columns(area, first, count, thickness)


def _faces_of_cells(mesh: PolyMesh) -> tuple[Labels, NDArray[np.intp]]:
    """Faces ordered by their cell, and where each cell begins among them."""
    inner = len(mesh.neighbour)
    cell = np.concatenate([mesh.owner, mesh.neighbour])
    face = np.concatenate([np.arange(len(mesh.owner)), np.arange(inner)])
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=mesh.cells))])
    return face[np.argsort(cell, kind="stable")], starts


def _opposite(mesh: PolyMesh, of_cell: tuple[Labels, NDArray[np.intp]], cell: Labels, faces: Labels) -> Labels:
    """Face of each ``cell`` (N,) that lies opposite its face ``faces`` (N,); -1 where the cell is no prism on it."""
    ordered, starts = of_cell
    size = starts[cell + 1] - starts[cell]
    row = np.repeat(np.arange(len(cell)), size)
    inside = np.arange(len(row)) - np.repeat(np.cumsum(size) - size, size)
    candidate = ordered[starts[cell][row] + inside]
    ours, theirs = mesh.faces[faces][row], mesh.faces[candidate]
    apart = np.ones(len(row), dtype=bool)
    for corner in ours.T:
        apart &= ~np.any((theirs == corner[:, None]) & (corner[:, None] >= 0), axis=1)
    alike = (ours >= 0).sum(axis=1) == (theirs >= 0).sum(axis=1)
    out = np.full(len(cell), -1, dtype=np.int64)
    out[row[apart & alike]] = candidate[apart & alike]
    out[np.bincount(row[apart], minlength=len(cell)) != 1] = -1
    return out
