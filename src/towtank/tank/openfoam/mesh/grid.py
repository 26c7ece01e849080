"""Mesh of a craft: an O-grid of hexahedra around hull and fins with a butterfly cap at either pole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.craft.craft import Craft
from towtank.errors import InputError, TankError
from towtank.frames import Array
from towtank.tank.openfoam.mesh.cap import Disc, cap_cells, disc
from towtank.tank.openfoam.mesh.fins import Layout, Planes, even_planes, layout, planes, refuse_strakes
from towtank.tank.openfoam.mesh.meridian import Outline, cap_limit, mesh_lines, outline, smooth_map
from towtank.tank.openfoam.mesh.poly import Labels, PolyMesh, assemble
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors
from towtank.tank.openfoam.mesh.spacing import first_cell, geometric, scaled
from towtank.tank.openfoam.mesh.warp import TIP_SHARE, Window, radial_with_tip, warped

Radial = Callable[[float, Array, Array], Array]

WALL_FUNCTION_Y_PLUS = 11.0
"""Above it the first cell belongs to a wall function and is kept while a family is refined; below it is refined too."""
_CAP_REACH = 0.2
"""Length of a cap along the hull over the diameter, if the end opens that far (judgement: a tenth of an ellipsoid)."""
_LONGEST = 2.0
"""Longest cell along the hull over the mean one."""
_EDGE_CELLS = (2.5, 3.0)
"""Cells at the leading and trailing edge of a fin over chord / along (judgement: 3 % of the chord on 80 along)."""
_CLEAR = 0.2
"""Chords between a fin's edge and a cap, over which the mesh turns back (judgement: less folds it at 20 deg)."""
_FEWEST_ON_CHORD = 6
_FEWEST = (8, 6)
"""Fewest cells around and out."""


@dataclass(frozen=True)
class MeshSettings:
    """Cells ``along`` the hull from pole to pole, ``around`` over 180 deg, and ``out`` to the far ellipse.

    ``y_plus``: of the centre of the first cell. ``far``: radius of the outer ellipse [lengths]. ``refinement`` scales
    the three counts together. ``chord``: least cells of ``along`` on the chord of the fins, refined with it.
    ``half``: half domain or not; None leaves it to the test.
    """

    along: int = 80
    around: int = 24
    out: int = 40
    y_plus: float = 60.0
    far: float = 2.5
    refinement: float = 1.0
    chord: int = 0
    half: bool | None = None

    @property
    def label(self) -> str:
        """Name of the mesh in its family: counts, y+, cells on the chord and refinement."""
        return (
            f"{self.along}x{self.out}x{self.around}-y{self.y_plus:g}"
            + (f"-c{self.chord}" if self.chord else "")
            + (f"-r{self.refinement:.4g}" if self.refinement != 1.0 else "")
        )

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
    rims: tuple[Labels, ...] = ()
    """Labels (shells, planes) of the rims that the caps join."""


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
        Strakes, too few cells, fins that do not fit, a half domain of a craft without that symmetry.
    TankError
        The mesh folds.
    """
    refuse_strakes(craft)
    along, around, out = settings.counts()
    shape = outline(craft.profile, settings.far * craft.length)
    speed, viscosity = speed or craft.speed, craft.water.kinematic_viscosity
    wall = wall_cell(settings, speed, craft.length, viscosity)
    found = layout(craft, shape, fins)
    if half and found is not None:
        _mirrored(craft, found)
    stations, edges = _stations(shape, along, around, found, round(settings.chord * settings.refinement))
    ends = cap_cells(around)
    sheets, radial, tip = even_planes(around), _geometric(wall, out), 0
    if found is not None:
        tip = round(TIP_SHARE * out)
        radial = radial_with_tip(found, shape, wall, out, tip)
        middle = 0.5 * (found.tip + float(np.interp(sum(found.edges) / 2.0, shape.s, shape.r)))
        sheets = planes(found, around, wall_cell(settings, speed, found.chord, viscosity) / middle)
    arcs = stations[ends : along - ends + 1]
    window = Window(edges[0] - ends, edges[1] - ends, tip, (float(arcs[0]), float(arcs[-1])))
    cloud, blocks = _body(shape, found, sheets, arcs, mesh_lines(shape, arcs, radial), window, half)
    rims = blocks[0].rims
    for end in (0, 1):
        reach = stations[: ends + 1] if end == 0 else shape.total - stations[::-1][: ends + 1]
        face = disc((sheets.even, sheets.tail)[end], half)
        extra, block = _cap_block(shape, face, reach, end, radial, rims[end], sum(map(len, cloud)))
        cloud.append(extra)
        blocks.append(block)
    points = np.concatenate(cloud)
    points[:, 0] = craft.origin_from_nose - points[:, 0]
    mesh = _joined(points, blocks, half)
    _, volume = cell_volumes(mesh, *face_vectors(mesh))
    if np.any(volume <= 0.0):
        raise TankError(
            f"the mesh of {craft.name!r} folds: {np.count_nonzero(volume <= 0.0)} of its cells have no volume. "
            "Turn the fins less, move them off the tail, or change along, around and out."
        )
    return mesh


def _geometric(wall: float, out: int) -> Radial:
    return lambda s, arc, r: geometric(wall, out, float(arc[-1]))


def _mirrored(craft: Craft, found: Layout) -> None:
    """Refuse fins that are not, or are not turned, in pairs about z = 0."""
    faces = [(np.exp(1j * fin.azimuth), replace(fin, name="", azimuth=0.0, sign=1.0), angle)
             for fin, angle in zip(found.fins, found.turned, strict=True)]  # fmt: skip
    for fin, (place, shape, angle) in zip(found.fins, faces, strict=True):
        if not any(abs(p.conjugate() - place) < 1e-6 and s == shape and abs(a + angle) < 1e-9 for p, s, a in faces):
            raise InputError(
                f"fin {fin.name!r} of {craft.name!r}, turned {np.degrees(angle):.1f} deg, has no mirror image about "
                "z = 0, so half a domain does not represent the craft. Use the full one (half = false)."
            )


def _stations(
    shape: Outline, along: int, around: int, found: Layout | None, chord: int = 0
) -> tuple[Array, tuple[int, int]]:
    """Arcs (along + 1,) of the stations, and the stations of the fins' edges: caps of even cells, growth elsewhere.

    ``chord`` : least cells on the chord of the fins.

    Raises
    ------
    InputError
        The fins reach into a cap, or have too few cells.
    """
    ends, s, total = cap_cells(around), shape.s, shape.total
    edges = found.edges if found else (total, 0.0)
    reach = [_CAP_REACH * 2.0 * float(shape.r.max())] * 2
    free = (edges[0], total - edges[1])
    for end in (0, 1):
        reach[end] = min(reach[end], cap_limit(shape, end))
        if found and not shape.blunt[end]:
            reach[end] = min(reach[end], 0.5 * free[end])
        if found and free[end] - reach[end] < _CLEAR * found.chord:
            raise InputError(
                f"the fins end {free[end]:.3g} m from the {('nose', 'tail')[end]} along the hull, less than "
                f"{_CLEAR:g} chords from the cells of that end. Move them or shorten root_chord."
            )
    fixed = [reach[0], total - reach[1]]
    cells_at = [ends, along - ends]
    longest = _LONGEST * total / along

    def size(growth: float) -> Array:
        sources = [(0.0, reach[0], reach[0] / ends), (total, reach[1], reach[1] / ends)]
        if found:
            sources += [(edge, 0.0, fine * found.chord / along)
                        for edge, fine in zip(edges, _EDGE_CELLS, strict=True)]  # fmt: skip
        near = [fine + growth * np.maximum(np.abs(s - at) - flat, 0.0) for at, flat, fine in sources]
        if found and chord:
            beside = np.maximum(np.maximum(edges[0] - s, s - edges[1]), 0.0)
            near.append((edges[1] - edges[0]) / chord + growth * beside)
        return np.asarray(np.minimum(np.min(near, axis=0), longest))

    cells = scaled(s, size, along)
    if found:
        fixed[1:1], natural = edges, np.interp(edges, s, cells)
        cells_at[1:1] = [int(np.clip(round(n), ends + 2, along - ends - 2)) for n in natural]
        if cells_at[2] - cells_at[1] < _FEWEST_ON_CHORD or cells_at[2] > along - ends - 2:
            raise InputError(
                f"{cells_at[2] - cells_at[1]} cells on the chord of the fins; {_FEWEST_ON_CHORD} are needed. "
                "Raise `along`, or lower `around`, whose caps take cells along."
            )
    cells = np.interp(cells, np.r_[0.0, np.interp(fixed, s, cells), along], np.r_[0, cells_at, along])
    result = np.interp(np.arange(along + 1), cells, s)
    result[0], result[-1], result[cells_at] = 0.0, total, fixed
    return result, (cells_at[1], cells_at[-2])


def _body(
    shape: Outline, found: Layout | None, sheets: Planes, s: Array, body: Array, window: Window, half: bool
) -> tuple[list[Array], list[Block]]:
    """Points and the block between the caps, with the slits of the fins.

    ``s`` : arcs (stations,).   ``body`` : meridian points (stations, shells, 2).
    """
    count = len(sheets.even)
    kept = count // 2 + 1 if half else count
    labels = np.arange(body.shape[0] * body.shape[1] * kept).reshape(*body.shape[:2], kept)
    if found is None:
        return [_turned(body[:, :, None], sheets.even[:kept]).reshape(-1, 3)], [
            _body_block(labels, labels, {}, window, half)
        ]
    rounding = max(
        _rounding(found), 2.0 * float(body[window.start, window.tip, 1] - body[window.start, window.tip - 1, 1])
    )
    points, below = warped(found, sheets, shape, s, body, window, rounding)
    slit = (slice(window.start + 1, window.end), slice(0, window.tip))
    at = {f"fin{n + 1}": plane for n, plane in enumerate(sheets.at) if plane < kept}
    under, cloud = labels.copy(), [_turned(points[:, :, :kept, :2], points[:, :, :kept, 2]).reshape(-1, 3)]
    for number, plane in enumerate(sheets.at):
        if plane < kept:
            face = below[number][slit]
            under[(*slit, plane)] = sum(map(len, cloud)) + np.arange(face[..., 0].size).reshape(face.shape[:2])
            cloud.append(_turned(face[..., :2], face[..., 2]).reshape(-1, 3))
    return cloud, [_body_block(labels, under, at, window, half)]


def _rounding(found: Layout) -> float:
    """Thickness of the thickest tip [m]: a parabola over it closes the edge at no more than 45 deg."""
    return max(fin.thickness * fin.tip_chord for fin in found.fins)


def _turned(meridian: Array, theta: Array) -> Array:
    """Points (..., 3), x aft of the nose, of the meridian points (..., 2) at the azimuths ``theta`` (...)."""
    x, r = np.broadcast_arrays(meridian[..., 0], theta)[0], meridian[..., 1]
    return np.stack([x, r * _cos(theta), r * _cos(theta - 0.5 * np.pi)], axis=-1)


def _cos(angle: Array) -> Array:
    """Cosine that vanishes exactly at right angles, so that the symmetry plane is a plane."""
    value = np.cos(angle)
    return np.where(np.abs(value) < 1e-12, 0.0, value)


def _body_block(labels: Labels, under: Labels, at: dict[str, int], window: Window, half: bool) -> Block:
    """Cells between the caps.

    ``labels`` (stations, shells, planes): as seen from larger azimuth.   ``under``: from smaller, other in the slits.
    ``at``: planes of the fins.
    """
    above, under_next = (labels[:, :, :-1], under[:, :, 1:]) if half else (labels, np.roll(under, -1, axis=2))
    foot = np.stack([above[:-1], above[1:], under_next[1:], under_next[:-1]], axis=-1)
    hexes = np.concatenate([foot[:, :-1], foot[:, 1:]], axis=-1).reshape(-1, 8)
    sides = {"hull": foot[:, 0].reshape(-1, 4), "farField": foot[:, -1].reshape(-1, 4)}
    open_cells = np.zeros((labels.shape[0] - 1, labels.shape[1] - 1), dtype=bool)
    open_cells[window.start : window.end, : window.tip] = True
    last = labels.shape[2] - 1
    for name, plane in at.items():
        faces = ([labels] if not half or plane < last else []) + ([under] if not half or plane > 0 else [])
        sides[name] = np.concatenate([_plane(face[:, :, plane], open_cells) for face in faces])
    if half:
        sides["symmetry"] = np.concatenate(
            [_plane(labels[:, :, k], ~open_cells if k in at.values() else open_cells | True) for k in (0, last)]
        )
    return Block(hexes, sides, (labels[0], labels[-1]))


def _plane(labels: Labels, kept: NDArray[np.bool_]) -> Labels:
    """Quads of the plane with ``labels`` (stations, shells) at the cells ``kept``."""
    corners = (labels[:-1, :-1], labels[1:, :-1], labels[1:, 1:], labels[:-1, 1:])
    return np.stack(corners, axis=-1)[kept]


def _cap_block(
    shape: Outline, face: Disc, reach: Array, end: int, radial: Radial, rim: Labels, first: int
) -> tuple[Array, Block]:
    """Points (n, 3) and cells of the cap at the nose (end 0) or tail (end 1).

    ``reach`` : arcs from the pole of the stations up to the rim.   ``rim`` : labels (shells, planes) of its points.
    ``first`` : label of the first new point.
    """
    y, z = face.points.T
    rho, theta = np.hypot(y, z), np.arctan2(z, y)
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
    flat[: len(rho)] = z == 0.0
    flat[[len(rho), -1]] = True
    edges = np.concatenate([quads[:, [a, (a + 1) % 4]] for a in range(4)])
    cut = labels[edges[flat[edges].all(axis=1)]]
    corners = (cut[:, 0, :-1], cut[:, 1, :-1], cut[:, 1, 1:], cut[:, 0, 1:])
    sides["symmetry"] = np.stack(corners, axis=-1).reshape(-1, 4)
    return points.reshape(-1, 3), Block(hexes, sides)


def _joined(points: Array, blocks: Sequence[Block], half: bool) -> PolyMesh:
    """One mesh of all blocks."""
    fins = {name: "wall" for name in blocks[0].sides if name.startswith("fin")}
    kinds = {"hull": "wall"} | fins | {"farField": "patch"} | ({"symmetry": "symmetryPlane"} if half else {})
    sides = {
        name: (kind, np.concatenate([block.sides[name] for block in blocks if name in block.sides]))
        for name, kind in kinds.items()
    }
    return assemble(points, np.concatenate([block.hexes for block in blocks]), sides)
