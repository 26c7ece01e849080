"""Mesh of a craft: an O-grid of hexahedra around hull and fins with a butterfly cap at either pole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.openfoam.mesh.cap import Disc, cap_cells, disc
from towtank.tank.openfoam.mesh.meridian import Outline, cap_limit, mesh_lines, outline, smooth_map
from towtank.tank.openfoam.mesh.poly import Labels, PolyMesh, assemble
from towtank.tank.openfoam.mesh.spacing import first_cell, geometric, scaled

Radial = Callable[[float, Array, Array], Array]

WALL_FUNCTION_Y_PLUS = 11.0
"""Above it the first cell belongs to a wall function and is kept while a family is refined; below it is refined too."""
_CAP_REACH = 0.2
"""Length of a cap along the hull over the diameter, if the end opens that far (judgement: a tenth of an ellipsoid)."""
_LONGEST = 2.0
"""Longest cell along the hull over the mean one."""
_FEWEST = (8, 6)
"""Fewest cells around and out."""


@dataclass(frozen=True)
class MeshSettings:
    """Cells ``along`` the hull from pole to pole, ``around`` over 180 deg, and ``out`` to the far ellipse.

    ``y_plus``: of the centre of the first cell. ``far``: radius of the outer ellipse [lengths]. ``refinement`` scales
    the three counts together. ``half``: half domain or not; None leaves it to the test.
    """

    along: int = 80
    around: int = 24
    out: int = 40
    y_plus: float = 60.0
    far: float = 2.5
    refinement: float = 1.0
    half: bool | None = None

    def counts(self) -> tuple[int, int, int]:
        """Cells (along, around, out) after refinement; ``around`` is the nearest multiple of 4, which the caps need.

        Raises
        ------
        InputError
            Too few cells, or a refinement, y_plus or far that is not positive.
        """
        for name, least in (("refinement", 0.0), ("y_plus", 0.0), ("far", 0.5)):
            if not getattr(self, name) > least:
                raise InputError(f"mesh {name} = {getattr(self, name):g}: it must be larger than {least:g}.")
        along, out = round(self.along * self.refinement), round(self.out * self.refinement)
        around = 4 * round(self.around * self.refinement / 4)
        fewest = (2 * cap_cells(max(around, _FEWEST[0])) + 8, *_FEWEST)
        for name, count, least in zip(("along", "around", "out"), (along, around, out), fewest, strict=True):
            if count < least:
                raise InputError(
                    f"mesh {name}: {count} cells after refinement {self.refinement:g}; at least {least} are needed "
                    f"(the caps at the poles take {2 * cap_cells(max(around, _FEWEST[0]))} along). Raise {name}."
                )
        return along, around, out


def wall_cell(settings: MeshSettings, speed: float, length: float, viscosity: float) -> float:
    """Height [m] of the first cell: the target y+, refined with the family only when the wall is resolved."""
    height = first_cell(settings.y_plus, speed, length, viscosity)
    return height if settings.y_plus > WALL_FUNCTION_Y_PLUS else height / settings.refinement


@dataclass(frozen=True)
class Block:
    """Hexahedra (C, 8) and the quads of named sides."""

    hexes: Labels
    sides: dict[str, Labels]


def mesh_of(
    craft: Craft, settings: MeshSettings, *, half: bool, fins: Sequence[float] = (), speed: float | None = None
) -> PolyMesh:
    """Mesh of hull and fins in body axes [m].

    Parameters
    ----------
    craft, settings : what is meshed and how finely.
    half : only z >= 0, with a patch ``symmetry`` on z = 0.
    fins : deflection of each fin [rad], in the craft's order; empty for none.
    speed : [m/s] for the first cell; the craft's own when None.

    Patches: hull, fin1..finN, farField and, in a half domain, symmetry.

    Raises
    ------
    InputError
        Too few cells, fins that do not fit, a half domain of a craft without that symmetry.
    """
    along, around, out = settings.counts()
    shape = outline(craft.profile, settings.far * craft.length)
    wall = wall_cell(settings, speed or craft.speed, craft.length, craft.water.kinematic_viscosity)
    stations = _stations(shape, along, around)
    ends = cap_cells(around)

    def radial(s: float, arc: Array, r: Array) -> Array:
        return geometric(wall, out, float(arc[-1]))

    theta = np.linspace(0.0, 2.0 * np.pi, 2 * around, endpoint=False)
    body = mesh_lines(shape, stations[ends : along - ends + 1], radial)
    planes = theta[: around + 1] if half else theta
    points = _turned(body[:, :, None], planes[None, None, :])
    count = len(body) * (out + 1) * len(planes)
    labels = np.arange(count).reshape(points.shape[:3])
    blocks = [_body_block(labels, half)]
    cloud = [points.reshape(-1, 3)]
    for end in (0, 1):
        reach = stations[: ends + 1] if end == 0 else shape.total - stations[::-1][: ends + 1]
        face = disc(theta, half)
        extra, block = _cap_block(shape, face, reach, end, radial, labels[0 if end == 0 else -1], count)
        cloud.append(extra)
        blocks.append(block)
        count += len(extra)
    cloud_points = np.concatenate(cloud)
    cloud_points[:, 0] = craft.origin_from_nose - cloud_points[:, 0]
    return _joined(cloud_points, blocks, half)


def _stations(shape: Outline, along: int, around: int) -> Array:
    """Arcs (along + 1,) of the stations: caps of even cells, growth away from them."""
    ends = cap_cells(around)
    reach = [min(cap_limit(shape, end), _CAP_REACH * 2.0 * float(shape.r.max())) for end in (0, 1)]
    s, total = shape.s, shape.total
    fine = [length / ends for length in reach]
    longest = _LONGEST * total / along

    def size(growth: float) -> Array:
        nose = fine[0] + growth * np.maximum(s - reach[0], 0.0)
        tail = fine[1] + growth * np.maximum(total - reach[1] - s, 0.0)
        return np.minimum(np.minimum(nose, tail), longest)

    cells = scaled(s, size, along)
    nose, tail = np.interp([reach[0], total - reach[1]], s, cells)
    cells = np.interp(cells, [0.0, nose, tail, along], [0, ends, along - ends, along])
    result = np.interp(np.arange(along + 1), cells, s)
    result[[0, ends, along - ends, along]] = [0.0, reach[0], total - reach[1], total]
    return result


def _turned(meridian: Array, theta: Array) -> Array:
    """Points (..., 3), x aft of the nose, of the meridian points (..., 2) at the azimuths ``theta`` (...)."""
    x, r = np.broadcast_arrays(meridian[..., 0], theta)[0], meridian[..., 1]
    return np.stack([x, r * _cos(theta), r * _cos(theta - 0.5 * np.pi)], axis=-1)


def _cos(angle: Array) -> Array:
    """Cosine that vanishes exactly at right angles, so that the symmetry plane is a plane."""
    value = np.cos(angle)
    return np.where(np.abs(value) < 1e-12, 0.0, value)


def _body_block(labels: Labels, half: bool) -> Block:
    """Cells between the caps. ``labels`` (stations, shells, planes)."""
    upper = labels if half else np.concatenate([labels, labels[:, :, :1]], axis=2)
    a, b = upper[:, :, :-1], upper[:, :, 1:]
    foot = np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=-1)
    hexes = np.concatenate([foot[:, :-1], foot[:, 1:]], axis=-1).reshape(-1, 8)
    sides = {"hull": foot[:, 0].reshape(-1, 4), "farField": foot[:, -1].reshape(-1, 4)}
    if half:
        sides["symmetry"] = np.concatenate([_plane(labels[:, :, k]) for k in (0, -1)])
    return Block(hexes, sides)


def _plane(labels: Labels) -> Labels:
    """Quads of the plane with ``labels`` (stations, shells)."""
    corners = (labels[:-1, :-1], labels[1:, :-1], labels[1:, 1:], labels[:-1, 1:])
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _cap_block(
    shape: Outline, face: Disc, reach: Array, end: int, radial: Radial, rim: Labels, first: int
) -> tuple[Array, Block]:
    """Points (n, 3) and cells of the cap at the nose (end 0) or tail (end 1).

    ``reach`` : arcs from the pole of the stations up to the rim.   ``rim`` : labels (shells, planes) of its points.
    ``first`` : label of the first new point.
    """
    rho, theta = np.hypot(*face.points.T), np.arctan2(face.points[:, 1], face.points[:, 0])
    distinct, index = np.unique(np.round(rho, 9), return_inverse=True)
    s = smooth_map(face.spoke, reach)(distinct)
    lines = mesh_lines(shape, s if end == 0 else shape.total - s, radial)
    points = _turned(lines[index], theta[:, None])
    shells = lines.shape[1]
    labels = np.concatenate([first + np.arange(len(rho) * shells).reshape(len(rho), shells), rim.T])
    # Seen from outside, the nose turns as the azimuth does and the tail against it.
    quads = face.quads if end == 0 else face.quads[:, ::-1]
    foot = np.moveaxis(labels[quads], 2, 1)
    hexes = np.concatenate([foot[:, :-1], foot[:, 1:]], axis=2).reshape(-1, 8)
    sides = {"hull": foot[:, 0], "farField": foot[:, -1]}
    flat = np.zeros(len(labels), dtype=bool)
    flat[: len(rho)] = face.points[:, 1] == 0.0
    flat[[len(rho), -1]] = True
    edges = np.concatenate([quads[:, [a, (a + 1) % 4]] for a in range(4)])
    cut = labels[edges[flat[edges].all(axis=1)]]
    corners = (cut[:, 0, :-1], cut[:, 1, :-1], cut[:, 1, 1:], cut[:, 0, 1:])
    sides["symmetry"] = np.stack(corners, axis=-1).reshape(-1, 4)
    return points.reshape(-1, 3), Block(hexes, sides)


def _joined(points: Array, blocks: Sequence[Block], half: bool) -> PolyMesh:
    """One mesh of all blocks."""
    kinds = {"hull": "wall", "farField": "patch"} | ({"symmetry": "symmetryPlane"} if half else {})
    sides = {
        name: (kind, np.concatenate([block.sides[name] for block in blocks if name in block.sides]))
        for name, kind in kinds.items()
    }
    return assemble(points, np.concatenate([block.hexes for block in blocks]), sides)
