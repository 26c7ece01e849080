"""Quality of a mesh as checkMesh measures it: volumes, closedness, non-orthogonality, skewness, aspect ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.frames import Array
from towtank.tank.openfoam.mesh.poly import PolyMesh

NON_ORTHOGONALITY_LIMIT = 70.0
"""Degrees beyond which checkMesh warns and the limited laplacian schemes lose their correction."""
SKEWNESS_LIMIT = 4.0
ASPECT_LIMIT = 1000.0
CLOSEDNESS_LIMIT = 1e-6
"""Limits of checkMesh (OpenFOAM v1912). Thin wall cells may pass the one on the aspect ratio without harm."""
_TINY = 1e-300


@dataclass(frozen=True)
class Quality:
    """Measures of a mesh: volumes in m3, angles in degrees. ``openness``: largest open share of a cell's faces."""

    cells: int
    volume: float
    least_volume: float
    negative: int
    openness: float
    open_cells: int
    max_non_orthogonality: float
    mean_non_orthogonality: float
    severe: int
    """Faces beyond ``NON_ORTHOGONALITY_LIMIT``."""
    wrong_faces: int
    """Faces that look against the line from owner to neighbour."""
    max_skewness: float
    max_aspect: float

    def verdict(self) -> tuple[str, ...]:
        """What is wrong with the mesh, a sentence each; empty when nothing is."""
        tests = (
            (self.negative > 0, f"{self.negative} cells have no positive volume"),
            (self.open_cells > 0, f"{self.open_cells} cells are not closed"),
            (self.wrong_faces > 0, f"{self.wrong_faces} faces look the wrong way"),
            (
                self.severe > 0,
                f"{self.severe} faces are more than {NON_ORTHOGONALITY_LIMIT:g} deg from orthogonal "
                f"(largest {self.max_non_orthogonality:.0f} deg)",
            ),
            (
                self.max_skewness > SKEWNESS_LIMIT,
                f"largest skewness {self.max_skewness:.1f}, limit {SKEWNESS_LIMIT:g}",
            ),
            (self.max_aspect > ASPECT_LIMIT, f"largest aspect ratio {self.max_aspect:.0f}, limit {ASPECT_LIMIT:g}"),
        )
        return tuple(words for fails, words in tests if fails)


def face_vectors(mesh: PolyMesh) -> tuple[Array, Array]:
    """Centres (F, 3) [m] and area vectors (F, 3) [m2] of the faces, from triangles about the mean of the corners."""
    count = (mesh.faces >= 0).sum(axis=1)
    centre, area = np.empty((len(count), 3)), np.empty((len(count), 3))
    for corners in np.unique(count):
        rows = np.flatnonzero(count == corners)
        nodes = mesh.points[mesh.faces[rows, :corners]]
        middle = nodes.mean(axis=1)
        following = np.roll(nodes, -1, axis=1)
        triangles = 0.5 * np.cross(following - nodes, middle[:, None] - nodes)
        size = np.linalg.norm(triangles, axis=2)
        thirds = (nodes + following + middle[:, None]) / 3.0
        mean = (size[..., None] * thirds).sum(axis=1) / np.maximum(size.sum(axis=1), _TINY)[:, None]
        area[rows] = triangles.sum(axis=1)
        centre[rows] = middle if corners == 3 else mean
    return centre, area


def cell_volumes(mesh: PolyMesh, centres: Array, area: Array) -> tuple[Array, Array]:
    """Centres (C, 3) [m] and volumes (C,) [m3] of the cells, from pyramids on the faces."""
    inner = len(mesh.neighbour)
    count = np.bincount(mesh.owner, minlength=mesh.cells) + np.bincount(mesh.neighbour, minlength=mesh.cells)
    guess = (_gather(mesh, centres, centres[:inner])) / count[:, None]
    height = np.einsum("fi,fi->f", area, centres - guess[mesh.owner])
    depth = np.einsum("fi,fi->f", area[:inner], guess[mesh.neighbour] - centres[:inner])
    own = 0.75 * centres + 0.25 * guess[mesh.owner]
    other = 0.75 * centres[:inner] + 0.25 * guess[mesh.neighbour]
    total = _gather(mesh, height[:, None], depth[:, None])[:, 0]
    moment = _gather(mesh, height[:, None] * own, depth[:, None] * other)
    safe = np.where(np.abs(total) > _TINY, total, 1.0)[:, None]
    return np.where(np.abs(total)[:, None] > _TINY, moment / safe, guess), total / 3.0


def _gather(mesh: PolyMesh, owned: Array, neighboured: Array) -> Array:
    """Sums (C, n) over the faces of each cell of ``owned`` (F, n) and ``neighboured`` (I, n)."""
    columns = [
        np.bincount(mesh.owner, owned[:, c], mesh.cells) + np.bincount(mesh.neighbour, neighboured[:, c], mesh.cells)
        for c in range(owned.shape[1])
    ]
    return np.stack(columns, axis=1)


def quality(mesh: PolyMesh) -> Quality:
    """Measure ``mesh`` by the definitions of checkMesh (OpenFOAM v1912, primitiveMeshTools)."""
    centres, area = face_vectors(mesh)
    middle, volume = cell_volumes(mesh, centres, area)
    inner = len(mesh.neighbour)
    line = middle[mesh.neighbour] - middle[mesh.owner[:inner]]
    along = np.einsum("fi,fi->f", line, area[:inner])
    size = np.linalg.norm(area, axis=1)
    cosine = np.clip(along / np.maximum(np.linalg.norm(line, axis=1) * size[:inner], _TINY), -1.0, 1.0)
    angle = np.degrees(np.arccos(cosine))
    openness, aspect = _closedness_and_aspect(mesh, area, volume)
    return Quality(
        cells=mesh.cells,
        volume=float(volume.sum()),
        least_volume=float(volume.min()),
        negative=int(np.count_nonzero(volume <= 0.0)),
        openness=float(openness.max()),
        open_cells=int(np.count_nonzero(openness > CLOSEDNESS_LIMIT)),
        max_non_orthogonality=float(angle.max(initial=0.0)),
        mean_non_orthogonality=float(np.degrees(np.arccos(cosine.mean())) if inner else 0.0),
        severe=int(np.count_nonzero((angle > NON_ORTHOGONALITY_LIMIT) & (cosine > 0.0))),
        wrong_faces=int(np.count_nonzero(cosine <= 0.0)),
        max_skewness=float(_skewness(mesh, centres, area, middle).max()),
        max_aspect=float(aspect.max()),
    )


def _closedness_and_aspect(mesh: PolyMesh, area: Array, volume: Array) -> tuple[Array, Array]:
    inner = len(mesh.neighbour)
    net = np.abs(_gather(mesh, area, -area[:inner]))
    gross = _gather(mesh, np.abs(area), np.abs(area[:inner]))
    slender = gross.max(axis=1) / np.maximum(gross.min(axis=1), _TINY)
    bulky = gross.sum(axis=1) / 6.0 / np.maximum(volume, _TINY) ** (2.0 / 3.0)
    return (net / np.maximum(gross, _TINY)).max(axis=1), np.maximum(slender, np.where(volume > 0.0, bulky, np.inf))


def _skewness(mesh: PolyMesh, centres: Array, area: Array, middle: Array) -> Array:
    """Distance from the face centre to where the line between cells pierces the face, over the face's half width."""
    inner = len(mesh.neighbour)
    arm = centres - middle[mesh.owner]
    line = np.empty_like(arm)
    line[:inner] = middle[mesh.neighbour] - middle[mesh.owner[:inner]]
    normal = area[inner:] / np.maximum(np.linalg.norm(area[inner:], axis=1), _TINY)[:, None]
    line[inner:] = normal * np.einsum("fi,fi->f", normal, arm[inner:])[:, None]
    down = np.einsum("fi,fi->f", area, line)
    down = np.where(np.abs(down) > _TINY, down, _TINY)
    off = arm - (np.einsum("fi,fi->f", area, arm) / down)[:, None] * line
    length = np.linalg.norm(off, axis=1)
    direction = off / np.maximum(length, _TINY)[:, None]
    width = np.where(np.arange(len(arm)) < inner, 0.2, 0.4) * np.linalg.norm(line, axis=1)
    corners = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    for corner in corners.T:
        width = np.maximum(width, np.abs(np.einsum("fi,fi->f", direction, mesh.points[corner] - centres)))
    return np.asarray(length / np.maximum(width, _TINY))
