"""Read a polyMesh that OpenFOAM has written in binary; its faces may have any number of corners."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.errors import ArtefactError
from towtank.tank.openfoam.mesh.poly import Labels, Patch, PolyMesh

_ARCH = re.compile(rb'arch\s+"LSB;label=(32|64);scalar=(32|64)"')
_PATCH = re.compile(r"(\w+)\s*\{([^}]*)\}")


def read_mesh(case: Path) -> PolyMesh:
    """The mesh in ``constant/polyMesh`` of ``case``; rows of ``faces`` are closed by -1.

    Raises
    ------
    ArtefactError
        A file is missing, damaged, or not of the little-endian binary form.
    """
    folder = case / "constant" / "polyMesh"
    (points,) = _lists(folder / "points", 1, "scalar", 3)
    offsets, corners = _lists(folder / "faces", 2, "label")
    (owner,), (neighbour,) = (_lists(folder / name, 1, "label") for name in ("owner", "neighbour"))
    return PolyMesh(
        points.reshape(-1, 3).astype(float),
        _padded(offsets, corners),
        owner.astype(np.int64),
        neighbour.astype(np.int64),
        _patches(folder / "boundary"),
        int(owner.max()) + 1,
    )


def _lists(path: Path, count: int, kind: str, width: int = 1) -> list[NDArray[Any]]:
    """``count`` lists of labels or scalars that stand one after the other; ``width`` numbers to an entry."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ArtefactError(f"{path}: {error.strerror or error}. Have the mesh made again.") from None
    arch = _ARCH.search(content[:2000])
    if arch is None or not re.search(rb"format\s+binary", content[:2000]):
        raise ArtefactError(f"{path} is not binary with its lowest byte first. Write the mesh with writeFormat binary.")
    bits = int(arch[1 if kind == "label" else 2]) // 8
    form = np.dtype(f"<{'i' if kind == 'label' else 'f'}{bits}")
    at, out = content.find(b"}") + 1, []
    for _ in range(count):
        head = re.compile(rb"(\d+)\s*\(").search(content, at)
        size = 0 if head is None else width * int(head[1])
        if head is None or head.end() + size * bits > len(content):
            raise ArtefactError(f"{path} is shorter than it says. Have the mesh made again.")
        out.append(np.frombuffer(content, form, size, head.end()))
        at = head.end() + size * bits
    return out


def _padded(offsets: Labels, corners: Labels) -> Labels:
    """Faces (F, W) of point labels from compact lists, W corners at most, closed by -1."""
    count = np.diff(offsets)
    faces = np.full((len(count), max(4, int(count.max()))), -1, dtype=np.int64)
    faces[np.arange(faces.shape[1]) < count[:, None]] = corners
    return faces


def _patches(path: Path) -> tuple[Patch, ...]:
    text = path.read_text(encoding="ascii")
    found = []
    for name, body in _PATCH.findall(text[text.find("}") + 1 :]):
        values = dict(re.findall(r"(\w+)\s+([^;]+);", body))
        found.append(Patch(name, values["type"], int(values["startFace"]), int(values["nFaces"])))
    return tuple(found)
