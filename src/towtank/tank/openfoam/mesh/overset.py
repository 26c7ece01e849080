"""Two meshes that overlap: one of the body, which moves, in a fixed background whose middle is left out.

The background has a cavity around the craft from the start, wide enough for its whole motion. Cells at the rim of the
cavity and at the rim of the body's mesh take their values from the other mesh. Nothing is cut while the solver runs,
and no such cell comes near the wall.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from towtank.artefact import write_text
from towtank.craft.craft import Craft
from towtank.errors import TankError
from towtank.frames import Array, rotation
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of, wall_cell
from towtank.tank.openfoam.mesh.meridian import Outline, outline
from towtank.tank.openfoam.mesh.poly import Labels, Patch, PolyMesh, assemble
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors

CAVITY = 1.25
"""Radius of the cavity over that of the least confocal ellipsoid which the hull does not leave (judgement)."""
LEAST_FRINGE = 0.51
"""Least radius of the body's mesh in lengths: about what the runs without trouble had."""
RIM = 0.65
"""Share of the radius of the body's mesh that holds cavity and travel; the rest is for its outermost, widest cells."""
WIDEST = 0.8
"""Most of the radius of the background that the body's mesh may take."""
CELL = 1.0
"""Cell of the background over the mean size of the body's outermost cells. Unlike sizes spoil what is passed on."""
OVERLAP = 1.3
"""Least overlap between the outermost cells of the body's mesh and the cavity, in cells of the background. At 1.06 a
sixth of those cells took their values from cells that take theirs from them, and the solver diverged; at 1.56 one in a
thousand did, and it ran."""
GROWTH = 1.35
"""Largest growth of the background's cells towards the far field."""
POSES = 64
"""Most poses of a motion that are looked at."""
PATCH = "overset"
"""Patch of both rims."""


@dataclass(frozen=True)
class Layout:
    """Radii [m] of the confocal ellipsoids that bound the ``cavity`` and the mesh of the body (``fringe``)."""

    cavity: float
    fringe: float
    travel: float
    """Largest way [m] that a point of the hull moves in the background."""


@dataclass(frozen=True)
class Pair:
    """The mesh of both parts. Its first ``moving`` cells are the body's."""

    mesh: PolyMesh
    moving: int
    layout: Layout


def overset_mesh(
    craft: Craft,
    settings: MeshSettings,
    poses: tuple[Array, Array],
    *,
    half: bool,
    fins: Sequence[float] = (),
    speed: float | None = None,
) -> Pair:
    """Mesh of hull and fins in body axes at their first pose, with the background around [m].

    poses : positions (N, 3) [m] and turns (N, 3) [rad] of the body in the background.   Others: as in ``mesh_of``.

    Raises
    ------
    TankError
        The motion is too large for the far field, or fins come too near the cavity.
    """
    shape = outline(craft.profile, settings.far * craft.length)
    found = layout(craft, shape, settings, poses)
    body = mesh_of(craft, body_settings(craft, settings, found, speed), half=half, fins=fins, speed=speed)
    body = replace(body, patches=tuple(_renamed(patch) for patch in body.patches))
    cell = CELL * _rim_size(body)
    fixed = background(craft, shape, found, cell, settings.far * craft.length, half=half)
    _check_clearance(craft, shape, found, body, poses, cell)
    return Pair(united([body, fixed]), body.cells, found)


def layout(craft: Craft, shape: Outline, settings: MeshSettings, poses: tuple[Array, Array]) -> Layout:
    """Where the two meshes end, for a hull that takes the ``poses``.

    Raises
    ------
    TankError
        The body's mesh would reach the far field.
    """
    x = craft.origin_from_nose - shape.x
    zero = np.zeros_like(x)
    hull = np.concatenate([np.stack(p, axis=1) for side in (1.0, -1.0) for p in
                           ((x, side * shape.r, zero), (x, zero, side * shape.r))])[::16]  # fmt: skip
    moved = _moved(hull, poses)
    travel = float(np.linalg.norm(moved - hull, axis=-1).max())
    cavity = CAVITY * float(radius_of(craft, shape, moved).max())
    fringe = max((cavity + travel) / RIM, LEAST_FRINGE * craft.length)
    if fringe > WIDEST * settings.far * craft.length:
        raise TankError(
            f"the hull moves by {travel / craft.length:.2f} lengths, so its overset mesh needs a radius of "
            f"{fringe / craft.length:.2f} lengths; the background has {settings.far:g}. Take a smaller amplitude or a "
            "larger far, or leave the formulation to the tank: there the whole mesh moves, by any amount."
        )
    return Layout(cavity, fringe, travel)


def body_settings(craft: Craft, settings: MeshSettings, found: Layout, speed: float | None) -> MeshSettings:
    """Settings of the body's part: the cells of the whole mesh, as far as it goes."""
    wall = wall_cell(settings, speed or craft.speed, craft.length, craft.water.kinematic_viscosity)
    ends = [reach - 0.5 * craft.diameter for reach in (settings.far * craft.length, found.fringe)]
    out = round(settings.out * settings.refinement)
    if wall * out < ends[0]:
        q = brentq(lambda q: wall * (q**out - 1.0) - ends[0] * (q - 1.0), 1.0 + 1e-6, 1e3)
        out = round(float(np.log1p(ends[1] * (q - 1.0) / wall) / np.log(q)))
    return replace(settings, far=found.fringe / craft.length, out=max(8, round(out / settings.refinement)))


def radius_of(craft: Craft, shape: Outline, points: Array) -> Array:
    """Least semi-axis [m] of the ellipsoid through the points (..., 3) that is confocal with the hull's mesh."""
    z = craft.origin_from_nose - points[..., 0] - shape.centre + 1j * np.hypot(points[..., 1], points[..., 2])
    return np.asarray(shape.focal * np.sinh(np.abs(np.arccosh(z / shape.focal + 0j).real)))


def background(craft: Craft, shape: Outline, found: Layout, cell: float, far: float, *, half: bool) -> PolyMesh:
    """Box of hexahedra to ``far`` [m] from the hull's middle, less the cavity; of ``cell`` [m] at the body's mesh.

    Patches: overset (the rim of the cavity), farField and, in a half domain, symmetry.
    """
    middle = craft.origin_from_nose - shape.centre
    room = found.travel + cell
    long, wide = float(np.hypot(shape.focal, found.fringe)) + room, found.fringe + room
    far = max(far, 1.2 * long)
    x = middle + _axis(cell, long, far)
    y = _axis(cell, wide, far)
    z = _axis(cell, wide - (found.travel if half else 0.0), far, half=half)  # motions keep to the plane of symmetry
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
    labels = np.arange(points[..., 0].size).reshape(points.shape[:3])
    hexes = _hexes(labels)
    points = points.reshape(-1, 3)
    kept = radius_of(craft, shape, points[hexes].mean(axis=-2)) > found.cavity
    ends = [(0, 0), (0, -1), (1, 0), (1, -1), (2, -1)] + ([] if half else [(2, 0)])
    sides = {
        PATCH: (PATCH, _rim(labels, kept)),
        "farField": ("patch", np.concatenate([_quads(np.take(labels, at, axis)).reshape(-1, 4) for axis, at in ends])),
    }
    if half:
        sides["symmetry"] = ("symmetryPlane", _quads(labels[:, :, 0])[kept[:, :, 0]])
    return assemble(points, hexes[kept], sides)


def _axis(cell: float, fine: float, far: float, *, half: bool = False) -> Array:
    """Points from ``-far`` (0 in half) to ``far``: even steps of about ``cell`` up to ``fine``, growing ones beyond."""
    inner = np.linspace(0.0, fine, round(fine / cell) + 1)
    step, rest = float(inner[1]), far - fine
    count = max(1, int(np.ceil(np.log1p(rest * (GROWTH - 1.0) / (step * GROWTH)) / np.log(GROWTH))))
    powers = np.arange(1, count + 1)
    q = brentq(lambda q: step * float((q**powers).sum()) - rest, 0.1, GROWTH + 1e-9)
    side = np.r_[inner, fine + step * np.cumsum(q**powers)]
    return np.asarray(side if half else np.r_[-side[:0:-1], side])


def _hexes(labels: Labels) -> Labels:
    low, high = labels[:, :, :-1], labels[:, :, 1:]
    return np.stack([face[cut] for face in (low, high) for cut in _CORNERS], axis=-1)


_CORNERS = tuple((a, b) for a, b in (
    (slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)),
    (slice(1, None), slice(1, None)), (slice(None, -1), slice(1, None)),
))  # fmt: skip


def _quads(labels: Labels) -> Labels:
    """Quads (n, m, 4) of a sheet of labels."""
    return np.stack([labels[cut] for cut in _CORNERS], axis=-1)


def _rim(labels: Labels, kept: NDArray[np.bool_]) -> Labels:
    """Quads (B, 4) between a cell that is kept and one that is not."""
    found = []
    for axis in range(3):
        sheets, cells = np.moveaxis(labels, axis, 0)[1:-1], np.moveaxis(kept, axis, 0)
        for sheet, edge in zip(sheets, cells[1:] != cells[:-1], strict=True):
            found.append(_quads(sheet)[edge])
    return np.concatenate(found)


def united(meshes: Sequence[PolyMesh]) -> PolyMesh:
    """The meshes side by side in one, in their order; patches of one name become one, the overset patch first.

    The solver takes the first overset patch for the one that passes values on, and other patches may build on them.
    """
    points = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = np.cumsum([0, *(mesh.cells for mesh in meshes)])
    faces = [np.where(mesh.faces < 0, -1, mesh.faces + n) for mesh, n in zip(meshes, points, strict=False)]
    owner = [mesh.owner + n for mesh, n in zip(meshes, cells, strict=False)]
    neighbour = [mesh.neighbour + n for mesh, n in zip(meshes, cells, strict=False)]
    kinds = {patch.name: patch.kind for mesh in meshes for patch in mesh.patches}
    parts = [slice(0, len(n)) for n in neighbour]
    chosen = [(k, part) for k, part in enumerate(parts)]
    patches, start = [], sum(map(len, neighbour))
    for name in sorted(kinds, key=lambda name: name != PATCH):
        found = [(k, p.faces) for k, mesh in enumerate(meshes) for p in mesh.patches if p.name == name]
        count = sum(part.stop - part.start for _, part in found)
        patches.append(Patch(name, kinds[name], start, count))
        chosen, start = chosen + found, start + count
    return PolyMesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([faces[k][part] for k, part in chosen]),
        np.concatenate([owner[k][part] for k, part in chosen]),
        np.concatenate(neighbour),
        tuple(patches),
        int(cells[-1]),
    )


def write_zones(folder: Path, pair: Pair) -> None:
    """Write what tells the parts from each other: the cell zone that moves, and the field ``zoneID``."""
    head = "FoamFile {{ version 2.0; format ascii; class {}; object {}; }}\n"
    moving, fixed = pair.moving, pair.mesh.cells - pair.moving
    cells = " ".join(map(str, range(moving)))
    zone = f"1\n(\nbody {{ type cellZone; cellLabels List<label> {moving} ({cells}); }}\n)\n"
    write_text(folder / "constant" / "polyMesh" / "cellZones", head.format("regIOobject", "cellZones") + zone)
    values = f"nonuniform List<scalar> {moving + fixed} ({'1 ' * moving}{'0 ' * fixed})"
    kinds: Mapping[str, str] = {PATCH: "overset; value uniform 0", "symmetryPlane": "symmetryPlane"}
    entries = " ".join(f"{p.name} {{ type {kinds.get(p.kind, 'zeroGradient')}; }}" for p in pair.mesh.patches)
    text = f"dimensions [0 0 0 0 0 0 0];\ninternalField {values};\nboundaryField {{ {entries} }}\n"
    write_text(folder / "0" / "zoneID", head.format("volScalarField", "zoneID") + text)


def _renamed(patch: Patch) -> Patch:
    return replace(patch, name=PATCH, kind=PATCH) if patch.name == "farField" else patch


def _rim_cells(body: PolyMesh) -> Labels:
    rim = body.patch(PATCH)
    return np.unique(body.owner[rim.faces])


def _rim_size(body: PolyMesh) -> float:
    """Mean size [m] of the outermost cells."""
    _, volume = cell_volumes(body, *face_vectors(body))
    return float(np.cbrt(volume[_rim_cells(body)]).mean())


def _moved(points: Array, poses: tuple[Array, Array]) -> Array:
    """The points (P, 3) at no more than ``POSES`` of the poses: (n, P, 3)."""
    every = max(1, -(-len(poses[0]) // POSES))
    position, turn = (np.asarray(part)[::every] for part in poses)
    return np.asarray(np.einsum("nij,pj->npi", rotation(turn), points) + position[:, None])


def _check_clearance(
    craft: Craft, shape: Outline, found: Layout, body: PolyMesh, poses: tuple[Array, Array], cell: float
) -> None:
    """Refuse walls that leave the cavity, and an overlap without cells that are solved on both sides.

    cell : of the background [m].
    """
    walls = [body.faces[p.faces].ravel() for p in body.patches if p.kind == "wall"]
    wall = np.unique(np.concatenate(walls))
    out = float(radius_of(craft, shape, _moved(body.points[wall[wall >= 0]], poses)).max())
    if out > found.cavity:
        raise TankError(
            f"a fin comes to {out / craft.length:.2f} lengths from the axis, and the cavity of the background ends at "
            f"{found.cavity / craft.length:.2f}. Leave the formulation to the tank: there the whole mesh moves."
        )
    centres, _ = cell_volumes(body, *face_vectors(body))
    near = float(radius_of(craft, shape, _moved(centres[_rim_cells(body)], poses)).min())
    least = found.cavity + OVERLAP * cell
    if near < least:
        raise TankError(
            f"the outermost cells of the body's mesh come to {near / craft.length:.2f} lengths from the axis; overset "
            f"meshes overlap enough from {least / craft.length:.2f} on. Raise `out` and `around`, or take a smaller "
            "amplitude: with a thinner overlap the solver diverges."
        )
