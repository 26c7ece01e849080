"""Polyhedral mesh in OpenFOAM's form: faces with owner and neighbour, boundary patches, the files of polyMesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.errors import TankError
from towtank.frames import Array

Labels = NDArray[np.int64]

HEX_FACES = np.array([(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)])
"""Faces of a hexahedron that look outwards; nodes 0-3 go around below, 4-7 above them, counter-clockwise from above."""


@dataclass(frozen=True)
class Patch:
    """Boundary faces ``start`` to ``start + count`` of one ``kind``: wall, patch or symmetryPlane."""

    name: str
    kind: str
    start: int
    count: int

    @property
    def faces(self) -> slice:
        """Where its faces lie among those of the mesh."""
        return slice(self.start, self.start + self.count)


@dataclass(frozen=True)
class PolyMesh:
    """Points (P, 3) [m] and faces (F, 4) of point labels; -1 closes a triangle.

    A mesh read from elsewhere may have wider rows, for faces of more corners; such a one is measured, not written.

    ``owner`` (F,): the cell a face belongs to; ``neighbour`` (I,): the other cell of the first I faces.
    """

    points: Array
    faces: Labels
    owner: Labels
    neighbour: Labels
    patches: tuple[Patch, ...]
    cells: int

    def patch(self, name: str) -> Patch:
        """The patch called ``name``.

        Raises
        ------
        TankError
            No such patch.
        """
        for patch in self.patches:
            if patch.name == name:
                return patch
        raise TankError(f"the mesh has no patch {name!r}; it has {', '.join(p.name for p in self.patches)}.")


def assemble(points: Array, hexes: Labels, sides: Mapping[str, tuple[str, Labels]]) -> PolyMesh:
    """Mesh of the hexahedra ``hexes`` (C, 8), right-handed as in ``HEX_FACES``, joined where faces share their points.

    ``sides``: patch name -> (kind, quads (B, 4)); the order of a quad's points does not matter. Repeated points of a
    hexahedron collapse its edges: faces of three points stay as triangles, of fewer they vanish. Points that no cell
    uses are dropped. Internal faces are in upper-triangular order and look from owner to neighbour.

    Raises
    ------
    TankError
        A face is shared by more than two cells, a boundary face is on no side, or a side names a face inside.
    """
    used, hexes = _numbered(len(points), hexes)
    faces = hexes[:, HEX_FACES].reshape(-1, 4)
    cell = np.repeat(np.arange(len(hexes)), len(HEX_FACES))
    key = _keys(faces)
    kept = key[:, 1] >= 0
    faces, cell, key = faces[kept], cell[kept], key[kept]
    order = np.lexsort((cell, key[:, 1], key[:, 0]))
    faces, cell, key = faces[order], cell[order], key[order]
    same = np.r_[np.all(key[1:] == key[:-1], axis=1), False]
    if np.any(same[1:] & same[:-1]):
        raise TankError("the blocks of the mesh overlap: a face belongs to more than two cells.")
    first = np.flatnonzero(same)
    owner, neighbour, inner = cell[first], cell[first + 1], faces[first]
    upper = np.lexsort((neighbour, owner))
    lone = np.flatnonzero(~(same | np.r_[False, same[:-1]]))
    label = _labelled(key[lone], used, sides)
    by_side = np.argsort(label, kind="stable")
    outer = lone[by_side]
    counts = np.bincount(label, minlength=len(sides))
    starts = len(first) + np.r_[0, np.cumsum(counts)[:-1]]
    return PolyMesh(
        points[used >= 0],
        _compact(np.concatenate([inner[upper], faces[outer]])),
        np.concatenate([owner[upper], cell[outer]]),
        neighbour[upper],
        tuple(
            Patch(name, kind, int(start), int(count))
            for (name, (kind, _)), start, count in zip(sides.items(), starts, counts, strict=True)
        ),
        len(hexes),
    )


def _numbered(count: int, hexes: Labels) -> tuple[Labels, Labels]:
    """New label of each point (-1 when unused), and the hexahedra in new labels."""
    used = np.full(count, -1)
    members = np.zeros(count, dtype=bool)
    members[hexes.ravel()] = True
    used[members] = np.arange(members.sum())
    return used, used[hexes]


def _keys(faces: Labels) -> Labels:
    """Two integers (F, 2) that name a face by its distinct points; the second is -1 when there are fewer than three."""
    nodes = np.sort(faces, axis=1)
    nodes[:, 1:][nodes[:, 1:] == nodes[:, :-1]] = -1
    nodes = np.sort(nodes, axis=1)
    shift = np.int64(1) << 31
    low = np.where(nodes[:, 1] < 0, -1, nodes[:, 2] * shift + nodes[:, 3])
    return np.stack([(nodes[:, 0] + 1) * shift + nodes[:, 1], low], axis=1)


def _compact(faces: Labels) -> Labels:
    """Faces (F, 4) whose repeated neighbours are left out; triangles end in -1."""
    faces = faces.copy()
    for corner in range(4):
        repeated = faces[:, corner] == faces[:, (corner + 1) % 4]
        faces[repeated, corner:3] = faces[repeated, corner + 1 :]
        faces[repeated, 3] = -1
    return faces


def _labelled(key: Labels, used: Labels, sides: Mapping[str, tuple[str, Labels]]) -> Labels:
    """Number of the side of each boundary face with ``key``."""
    quads = [np.asarray(quads).reshape(-1, 4) for _, quads in sides.values()]
    number = np.repeat(np.arange(len(quads)), [len(q) for q in quads])
    wanted = _keys(used[np.concatenate(quads)]) if quads else np.empty((0, 2), dtype=int)
    number, wanted = number[wanted[:, 1] >= 0], wanted[wanted[:, 1] >= 0]
    both = np.concatenate([key, wanted])
    order = np.lexsort((both[:, 1], both[:, 0]))
    change = np.r_[False, np.any(both[order][1:] != both[order][:-1], axis=1)]
    group = np.empty(len(both), dtype=int)
    group[order] = np.cumsum(change)
    label = np.full(len(both) + 1, -1)
    label[group[len(key) :]] = number
    on_boundary = np.zeros(len(both) + 1, dtype=bool)
    on_boundary[group[: len(key)]] = True
    if not on_boundary[group[len(key) :]].all():
        raise TankError("a side of the mesh names a face that is not on its boundary.")
    found = label[group[: len(key)]]
    if np.any(found < 0):
        raise TankError(f"{np.count_nonzero(found < 0)} boundary faces of the mesh belong to no side: it has a hole.")
    return found


def write_mesh(mesh: PolyMesh, case: Path) -> None:
    """Write ``constant/polyMesh`` of ``case`` (binary, 32-bit labels, 64-bit numbers).

    Source     Format of OpenFOAM v1912, of ESI and Foundation versions alike: faces as compact lists.
    """
    folder = case / "constant" / "polyMesh"
    folder.mkdir(parents=True, exist_ok=True)
    note = f"nPoints:{len(mesh.points)}  nCells:{mesh.cells}  nFaces:{len(mesh.faces)}"
    note += f"  nInternalFaces:{len(mesh.neighbour)}"
    corners = np.where(mesh.faces[:, 3] < 0, 3, 4)
    offsets = np.r_[0, np.cumsum(corners)]
    _write(folder, "points", "vectorField", [np.ascontiguousarray(mesh.points, dtype="<f8")])
    _write(folder, "faces", "faceCompactList", [offsets.astype("<i4"), mesh.faces[mesh.faces >= 0].astype("<i4")])
    _write(folder, "owner", "labelList", [mesh.owner.astype("<i4")], note)
    _write(folder, "neighbour", "labelList", [mesh.neighbour.astype("<i4")], note)
    entries = "".join(
        f"{p.name}\n{{\n    type {p.kind};\n    nFaces {p.count};\n    startFace {p.start};\n}}\n" for p in mesh.patches
    )
    text = f"{_header('polyBoundaryMesh', 'boundary', 'ascii')}{len(mesh.patches)}\n(\n{entries})\n"
    (folder / "boundary").write_text(text, encoding="ascii")


def _header(kind: str, name: str, form: str, note: str = "") -> str:
    arch = '    arch "LSB;label=32;scalar=64";\n' if form == "binary" else ""
    note = f'    note "{note}";\n' if note else ""
    return (
        f"FoamFile\n{{\n    version 2.0;\n    format {form};\n{arch}    class {kind};\n{note}"
        f'    location "constant/polyMesh";\n    object {name};\n}}\n\n'
    )


def _write(folder: Path, name: str, kind: str, lists: list[NDArray[Any]], note: str = "") -> None:
    with (folder / name).open("wb") as stream:
        stream.write(_header(kind, name, "binary", note).encode("ascii"))
        for items in lists:
            stream.write(f"{len(items)}\n(".encode("ascii"))
            stream.write(items.tobytes())
            stream.write(b")\n")
