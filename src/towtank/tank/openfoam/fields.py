"""Numbers in OpenFOAM's files, ascii or binary: the mesh of a case, and scalar fields of cells, faces and patches."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.errors import TankError
from towtank.frames import Array
from towtank.tank.openfoam.mesh.poly import Labels, Patch, PolyMesh

_REMARK = re.compile(rb"(?:\s|//[^\n]*\n|/\*.*?\*/)*", re.DOTALL)
_COUNT = re.compile(rb"\s*(\d+)\s*([({])")
_CLOSED = re.compile(rb"\)\s*\)")
_UNIFORM = re.compile(rb"\s*uniform\s+([^;\s]+)\s*;")
_LISTED = re.compile(rb"\s*nonuniform\s+List<(\w+)>")
_EMPTY = re.compile(rb"\s*0\s*(?:\(\s*\))?\s*;")
_ENTRY = re.compile(rb'([\w.:-]+|"[^"]*")\s*\{|\b(\w+)(?=\s+(?:non)?uniform\b)|([{}])')


@dataclass(frozen=True)
class Field:
    """A scalar field: of cells, or of inner faces, and of each patch. A number stands for a uniform one."""

    inside: Array | float
    patches: Mapping[str, Array | float]

    def on(self, patch: str, count: int) -> Array:
        """Values (count,) on a patch; zero where the field says none, as on one without faces.

        Raises
        ------
        TankError
            The field holds another number of them.
        """
        return _sized(self.patches.get(patch, 0.0), count, f"patch {patch}")

    def within(self, count: int) -> Array:
        """Values (count,) inside.

        Raises
        ------
        TankError
            The field holds another number of them.
        """
        return _sized(self.inside, count, "the inside")


def _sized(values: Array | float, count: int, where: str) -> Array:
    if np.ndim(values) and np.shape(values) != (count,):
        raise TankError(f"the field holds {np.size(values)} values on {where} of {count} faces or cells.")
    return np.broadcast_to(np.asarray(values, dtype=float), (count,))


@dataclass(frozen=True)
class _File:
    """A file in memory: its text, how numbers are written in it, and where its content begins."""

    path: Path
    content: bytes
    begin: int
    binary: bool
    kind: str
    label: np.dtype[Any]
    scalar: np.dtype[Any]

    def damaged(self, why: str) -> TankError:
        return TankError(f"{self.path} cannot be read: {why}. Run the case again in a fresh folder.")

    def listed(self, at: int, width: int = 1, whole: bool = False) -> tuple[NDArray[Any], int]:
        """The list ``N(...)`` or ``N{value}`` at ``at``: (N * width,) numbers, and where it ends."""
        found = _COUNT.match(self.content, at)
        if found is None:
            raise self.damaged("a list of numbers is missing")
        count, start = int(found[1]) * width, found.end()
        form = self.label if whole else self.scalar
        if found[2] == b"{":
            stop = self._find(b"}", start)
            return np.full(count, float(self.content[start:stop]), dtype=form), stop + 1
        if self.binary:
            stop = start + count * form.itemsize
            if len(self.content) <= stop or self.content[stop : stop + 1] != b")":
                raise self.damaged(f"its list of {count} numbers is cut off")
            return np.frombuffer(self.content, form, count, start), stop + 1
        stop = self._end(start, width)
        numbers = self._numbers(start, stop, form)
        if len(numbers) != count:
            raise self.damaged(f"a list of {count} numbers holds {len(numbers)}")
        return numbers, stop + 1

    def _end(self, start: int, width: int) -> int:
        """Where the outer bracket of a list closes: vectors have brackets of their own."""
        if width == 1:
            return self._find(b")", start)
        found = _CLOSED.search(self.content, start)
        if found is None:
            raise self.damaged("a list has no end")
        return found.end() - 1

    def _numbers(self, start: int, stop: int, form: np.dtype[Any]) -> NDArray[Any]:
        text = self.content[start:stop].replace(b"(", b" ").replace(b")", b" ")
        try:
            return np.array(text.split(), dtype=form)
        except ValueError:
            raise self.damaged("it holds text among its numbers") from None

    def _find(self, mark: bytes, start: int) -> int:
        stop = self.content.find(mark, start)
        if stop < 0:
            raise self.damaged("a list has no end")
        return stop


def _opened(path: Path) -> _File:
    """A file and its header."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise TankError(f"{path} cannot be read: {error.strerror or error}.") from None
    head = re.search(rb"FoamFile\s*\{([^}]*)\}", content[:4000])
    if head is None:
        raise TankError(f"{path} has no FoamFile header. Run the case again in a fresh folder.")
    entries = dict(re.findall(rb'(\w+)\s+("[^"]*"|[^;]*);', head[1]))
    arch = entries.get(b"arch", b"").decode("ascii", "replace")
    order = ">" if "MSB" in arch else "<"
    label, scalar = (re.search(rf"{name}=(\d+)", arch) for name in ("label", "scalar"))
    begin = _REMARK.match(content, head.end())
    return _File(
        path,
        content,
        begin.end() if begin else head.end(),
        entries.get(b"format", b"ascii").strip() == b"binary",
        entries.get(b"class", b"").decode("ascii", "replace").strip(),
        np.dtype(f"{order}i{int(label[1]) // 8 if label else 4}"),
        np.dtype(f"{order}f{int(scalar[1]) // 8 if scalar else 8}"),
    )


def read_mesh(case: Path) -> PolyMesh:
    """The mesh in ``constant/polyMesh`` of a case.

    Raises
    ------
    TankError
        A file is missing or damaged.

    Source     Format of OpenFOAM v1912: faces as a list of lists in ascii, as offsets and corners in binary.
    """
    folder = case / "constant" / "polyMesh"
    points = _opened(folder / "points")
    faces = _faces(_opened(folder / "faces"))
    owner, neighbour = (_labels(_opened(folder / name)) for name in ("owner", "neighbour"))
    patches = _patches(_opened(folder / "boundary"))
    mesh = PolyMesh(
        points.listed(points.begin, width=3)[0].reshape(-1, 3).astype(float),
        faces,
        owner,
        neighbour,
        patches,
        # The cell of the largest number may own no face: all its faces lie inside.
        int(max(owner.max(initial=-1), neighbour.max(initial=-1))) + 1,
    )
    begins = np.cumsum([len(neighbour), *(patch.count for patch in patches)])
    closed = np.array_equal(begins, [*(patch.start for patch in patches), len(owner)])
    if not closed or len(owner) != len(faces) or faces.max() >= len(mesh.points):
        raise TankError(f"the files of {folder} do not fit each other. Run the case again in a fresh folder.")
    return mesh


def _labels(file: _File) -> Labels:
    return file.listed(file.begin, whole=True)[0].astype(np.int64)


def _faces(file: _File) -> Labels:
    """Faces (F, W) of W corners at most, closed by -1."""
    count, corners = _compact(file) if file.binary else _listed(file)
    if not len(count) or count.min() < 3 or count.sum() != len(corners):
        raise file.damaged(f"{len(corners)} corners do not make its {len(count)} faces")
    faces = np.full((len(count), max(4, int(count.max()))), -1, dtype=np.int64)
    faces[np.arange(faces.shape[1]) < count[:, None]] = corners
    return faces


def _compact(file: _File) -> tuple[Labels, Labels]:
    """Number of corners of each face (F,), and the corners of all, from offsets and corners."""
    if file.kind != "faceCompactList":
        raise file.damaged(f"binary faces of class {file.kind} are not known")
    starts, after = file.listed(file.begin, whole=True)
    corners, _ = file.listed(after, whole=True)
    return (starts[1:] - starts[:-1]).astype(np.int64), corners.astype(np.int64)


def _listed(file: _File) -> tuple[Labels, Labels]:
    """The same from a list of lists."""
    found = _COUNT.match(file.content, file.begin)
    if found is None:
        raise file.damaged("its list of faces is missing")
    stop = _CLOSED.search(file.content, found.end())
    lists = re.findall(rb"\d+\s*\(([^)]*)\)", file.content[found.end() : stop.end() if stop else None])
    if stop is None or len(lists) != int(found[1]):
        raise file.damaged(f"its list of {int(found[1])} faces holds {len(lists)}")
    faces = [one.split() for one in lists]
    return np.array([len(one) for one in faces]), np.array([corner for one in faces for corner in one], dtype=np.int64)


def _patches(file: _File) -> tuple[Patch, ...]:
    text = file.content[file.begin :].decode("utf-8", "replace")
    out = []
    for name, body in re.findall(r"([\w.:-]+)\s*\{([^}]*)\}", text):
        entries = dict(re.findall(r"\b(type|startFace|nFaces)\s+([\w.:-]+)\s*;", body))
        if len(entries) < 3:
            raise file.damaged(f"patch {name} lacks its type, startFace or nFaces")
        out.append(Patch(name, entries["type"], int(entries["startFace"]), int(entries["nFaces"])))
    return tuple(out)


def read_field(path: Path) -> Field:
    """A scalar field of cells or faces.

    Raises
    ------
    TankError
        Missing, damaged, or not of scalars.
    """
    file = _opened(path)
    at = file.content.find(b"internalField", file.begin)
    if at < 0:
        raise file.damaged("it has no internalField")
    inside, at = _values(file, at + len(b"internalField"))
    at = file.content.find(b"boundaryField", at)
    if at < 0:
        raise file.damaged("it has no boundaryField")
    return Field(inside, _of_patches(file, at + len(b"boundaryField")))


def _values(file: _File, at: int) -> tuple[Array | float, int]:
    """``uniform x;`` or ``nonuniform List<scalar> N(...);`` at ``at``, and where it ends."""
    uniform = _UNIFORM.match(file.content, at)
    if uniform is not None:
        try:
            return float(uniform[1]), uniform.end()
        except ValueError:
            raise file.damaged(f"{uniform[1].decode('ascii', 'replace')!r} is not a number") from None
    listed = _LISTED.match(file.content, at)
    if listed is None or listed[1] != b"scalar":
        raise file.damaged("its values are not scalars")
    empty = _EMPTY.match(file.content, listed.end())
    if empty is not None:
        return np.zeros(0), empty.end()
    values, at = file.listed(listed.end())
    return values.astype(float), at


def _of_patches(file: _File, at: int) -> dict[str, Array | float]:
    """Values of each patch. Lists are stepped over, since binary numbers may look like anything."""
    out: dict[str, Array | float] = {}
    inside: list[str] = []
    while (found := _ENTRY.search(file.content, at)) is not None:
        at = found.end()
        if found[2] is not None:
            values, at = _values(file, at)
            if found[2] == b"value" and inside:
                out[inside[-1]] = values
        elif found[3] == b"}":
            inside = inside[:-1]
            if not inside:
                return out
        else:
            inside.append((found[1] or b"").decode("utf-8", "replace").strip('"'))
    raise file.damaged("its boundaryField has no end")
