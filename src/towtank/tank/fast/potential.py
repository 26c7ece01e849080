"""Potential flow about hull and fins: added mass, and the surface speed the boundary layer needs.

The hull is a body of revolution cut into rings of equal sectors, so the influence matrix is block-circulant: one
sector of control points gives all of it, and it is solved one azimuthal harmonic at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg

from towtank.craft.craft import Craft, Fin
from towtank.frames import Array, body_x
from towtank.tank.fast.kernels import panel_geometry, ring_potential, ring_velocity, source_influence

RINGS, SECTORS = 72, 24
CHORDWISE, SPANWISE = 5, 6


@dataclass(frozen=True)
class HullPanels:
    """Panels of a body of revolution: arrays (rings, sectors, ...), body axes; ``station`` (rings,) from the nose."""

    quads: Array
    centre: Array
    normal: Array
    area: Array
    station: Array

    @property
    def shape(self) -> tuple[int, int]:
        """(rings, sectors)."""
        return self.area.shape[0], self.area.shape[1]


def panel_stations(craft: Craft, rings: int) -> Array:
    """Panel edges (rings + 1,) [m] from the nose: dense at both ends and across the fin roots."""
    length = craft.length
    edges = np.linspace(0.0, length, 6001)
    x = 0.5 * (edges[1:] + edges[:-1])
    density = 1.0 / np.sqrt(np.clip((x / length) * (1.0 - x / length), 1e-4, None))
    for fin in craft.fins[:1]:
        chord = float(fin.chord(fin.half_radius))
        middle = float(fin.trailing_edge_at(fin.half_radius)) - 0.5 * chord
        density = density + 0.75 * (length / chord) * np.exp(-(((x - middle) / (0.9 * chord)) ** 2))
    share = np.concatenate([[0.0], np.cumsum(density)])
    return np.interp(np.linspace(0.0, 1.0, rings + 1), share / share[-1], edges)


def hull_panels(craft: Craft, rings: int = RINGS, sectors: int = SECTORS) -> HullPanels:
    """Panel the hull; polygon sections are scaled to the area of the true circular section.

    Source     TANK notes, section 4: the scaling takes the error of the transverse added mass of a 6:1 spheroid
               from 0.8 % to 0.3 % at 960 panels.
    """
    edge = panel_stations(craft, rings)
    step = 2.0 * np.pi / sectors
    radius = craft.profile.radius(edge) * np.sqrt(step / np.sin(step))
    radius[0] = radius[-1] = 0.0
    angle = step * np.arange(sectors + 1)
    x = body_x(edge, craft.origin_from_nose)
    grid = np.stack(
        [
            np.broadcast_to(x[:, None], (rings + 1, sectors + 1)),
            radius[:, None] * np.cos(angle),
            radius[:, None] * np.sin(angle),
        ],
        axis=-1,
    )
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    centre, normal, area = panel_geometry(quads.reshape(-1, 4, 3))
    shape = (rings, sectors)
    centre = centre.reshape(*shape, 3)
    station = craft.origin_from_nose - centre[:, 0, 0]
    return HullPanels(quads, centre, normal.reshape(*shape, 3), area.reshape(shape), station)


def unit_normal_velocity(centre: Array, normal: Array) -> Array:
    """Normal velocity (n, 6) of surface points for unit surge, sway, heave, roll, pitch, yaw rates."""
    return np.concatenate([normal, np.cross(centre, normal)], axis=-1)


@dataclass(frozen=True)
class HullFlow:
    """The solved hull; ``potential`` and ``velocity`` at one sector of control points, each panel a unit source."""

    panels: HullPanels
    potential: Array
    velocity: Array
    normal_velocity: Array

    @cached_property
    def _modes(self) -> list[tuple[Array, Array]]:
        blocks = np.fft.fft(self.normal_velocity, axis=2)
        return [scipy.linalg.lu_factor(blocks[:, :, k].conj()) for k in range(blocks.shape[2] // 2 + 1)]

    def solve(self, normal: Array) -> Array:
        """Source densities (rings, sectors, c) that give the normal velocities ``normal`` (rings, sectors, c)."""
        rings, sectors = self.panels.shape
        harmonics = np.fft.rfft(normal.reshape(rings, sectors, -1), axis=1)
        solved = np.stack([scipy.linalg.lu_solve(lu, harmonics[:, k]) for k, lu in enumerate(self._modes)], axis=1)
        return np.asarray(np.fft.irfft(solved, n=sectors, axis=1))

    def surface_potential(self, density: Array) -> Array:
        """Potential (rings, sectors, c) on the panels of source densities (rings, sectors, c)."""
        sectors = self.panels.shape[1]
        kernel = np.fft.rfft(self.potential, axis=2).conj()
        harmonics = np.fft.rfft(density, axis=1)
        return np.asarray(np.fft.irfft(np.einsum("ijk,jkc->ikc", kernel, harmonics), n=sectors, axis=1))

    @cached_property
    def unit_densities(self) -> Array:
        """Source densities (rings, sectors, 6) of the six unit motions of the bare hull."""
        return self.solve(unit_normal_velocity(self.panels.centre, self.panels.normal))

    @cached_property
    def added_mass(self) -> Array:
        """Positive added-mass matrix over density (6, 6) of the bare hull about the origin."""
        return self._integrate(self.unit_densities)

    def _integrate(self, density: Array) -> Array:
        rate = unit_normal_velocity(self.panels.centre, self.panels.normal)
        return np.asarray(-np.einsum("ijr,ij,ijc->rc", rate, self.panels.area, self.surface_potential(density)))

    @cached_property
    def surface_speed(self) -> Array:
        """Speed (rings,) over the surface in straight flight, over the speed ahead."""
        normal = self.panels.normal[:, 0]
        flow = np.einsum("ijkc,jk->ic", self.velocity, self.unit_densities[:, :, 0])
        relative = flow - np.array([1.0, 0.0, 0.0])
        relative = relative - (relative * normal).sum(axis=1)[:, None] * normal
        return np.asarray(np.linalg.norm(relative, axis=1))


def hull_flow(craft: Craft, rings: int = RINGS, sectors: int = SECTORS) -> HullFlow:
    """Solve the bare hull.

    Source     hesssmith1967. The diagonal of the normal-velocity matrix is set so that each source column sends
               exactly its own flux through the closed surface (Gauss), instead of the bare 1/2 (TANK notes,
               section 4).
    """
    panels = hull_panels(craft, rings, sectors)
    flat = panels.quads.reshape(-1, 4, 3)
    potential, velocity, _ = source_influence(panels.centre[:, 0], flat, panels.normal.reshape(-1, 3))
    potential = potential.reshape(rings, rings, sectors)
    velocity = velocity.reshape(rings, rings, sectors, 3)
    normal_velocity = np.einsum("ijkc,ic->ijk", velocity, panels.normal[:, 0])
    own = np.arange(rings)
    normal_velocity[own, own, 0] = 0.0
    area = panels.area[:, 0]
    through_others = np.einsum("i,ijk->j", area, normal_velocity) / area
    normal_velocity[own, own, 0] = 1.0 - through_others
    return HullFlow(panels, potential, velocity, normal_velocity)


@dataclass(frozen=True)
class FinLattice:
    """Vortex rings on one fin, with rings carried through the hull to its axis. Arrays over panels; body axes [m]."""

    rings: Array
    through: Array
    point: Array
    normal: Array
    area: Array


def fin_lattice(craft: Craft, fin: Fin, chordwise: int = CHORDWISE, spanwise: int = SPANWISE) -> FinLattice:
    """Lattice of a thin fin at zero deflection; bound vortices at 1/4, control points at 3/4 of each panel.

    Source     katzplotkin2001, chapter 12.
    """
    along = fin.span_direction
    root_x = float(fin.trailing_edge_at(fin.half_radius) - 0.5 * fin.chord(fin.half_radius))
    root = float(max(craft.profile.radius(np.array([root_x]))[0], 1e-6))
    radii = np.linspace(root, fin.tip_radius, spanwise + 1)

    def point(y: float, share: float, radius: float) -> Array:
        """At the radius ``y``, ``share`` of the chord behind the leading edge of the section at ``radius``."""
        x = fin.trailing_edge_at(radius) - fin.chord(radius) * (1.0 - share)
        return np.array([craft.origin_from_nose - float(x), 0.0, 0.0]) + y * along

    def patch(y0: float, y1: float, s0: float, s1: float) -> Array:
        inner = max(y0, root)
        return np.array([point(y0, s0, inner), point(y1, s0, y1), point(y1, s1, y1), point(y0, s1, inner)])

    share = np.arange(chordwise)
    cells = [(k, i) for k in range(spanwise) for i in share]
    rings = np.array([patch(radii[k], radii[k + 1], (i + 0.25) / chordwise, (i + 1.25) / chordwise) for k, i in cells])
    plates = np.array([patch(radii[k], radii[k + 1], i / chordwise, (i + 1) / chordwise) for k, i in cells])
    control = np.array(
        [patch(radii[k], radii[k + 1], (i + 0.75) / chordwise, (i + 0.75) / chordwise) for k, i in cells]
    )
    through = np.array([patch(0.0, root, (i + 0.25) / chordwise, (i + 1.25) / chordwise) for i in share])
    return FinLattice(rings, through, control.mean(axis=1), panel_geometry(rings)[1], panel_geometry(plates)[2])


def added_mass_with_fins(craft: Craft, flow: HullFlow, chordwise: int = CHORDWISE, spanwise: int = SPANWISE) -> Array:
    """Positive added-mass matrix over density (6, 6) of hull and fins, the fins as impermeable plates without lift.

    chordwise, spanwise : vortex rings on a fin each way.

    The hull unknowns are eliminated harmonic by harmonic; a dense system is left for the fins.
    """
    if not craft.fins:
        return flow.added_mass
    lattices = [fin_lattice(craft, fin, chordwise, spanwise) for fin in craft.fins]
    panels = flow.panels
    rings, sectors = panels.shape
    meetings = _meetings(craft.fins, lattices, panels)
    to_fin = np.concatenate([item.to_fin for item in meetings], axis=2).reshape(rings * sectors, -1).T
    on_hull = np.concatenate([item.on_hull for item in meetings], axis=2)
    points = np.concatenate([item.point for item in lattices])
    normals = np.concatenate([item.normal for item in lattices])
    on_fin = np.concatenate([_ring_normal(points, normals, item) for item in lattices], axis=1)
    fin_rate = unit_normal_velocity(points, normals)
    response = flow.solve(on_hull).reshape(rings * sectors, -1)
    free = flow.unit_densities.reshape(rings * sectors, 6)
    circulation = np.linalg.solve(on_fin - to_fin @ response, fin_rate - to_fin @ free)
    density = (free - response @ circulation).reshape(rings, sectors, 6)
    potential = flow.surface_potential(density)
    potential += np.concatenate([item.potential for item in meetings], axis=2) @ circulation
    hull_rate = unit_normal_velocity(panels.centre, panels.normal)
    added = -np.einsum("ijr,ij,ijc->rc", hull_rate, panels.area, potential)
    area = np.concatenate([item.area for item in lattices])
    return np.asarray(added + (fin_rate * area[:, None]).T @ circulation)


@dataclass(frozen=True)
class _Meeting:
    """Influence between the hull panels and one fin, arrays (rings, sectors, fin panels).

    to_fin : normal velocity on the fin by unit sources.   on_hull, potential : on the hull by unit vortex rings.
    """

    to_fin: Array
    on_hull: Array
    potential: Array

    def turned(self, sectors: int) -> _Meeting:
        """The same for the fin turned about the axis by a whole number of sectors."""
        return _Meeting(*(np.roll(item, sectors, axis=1) for item in (self.to_fin, self.on_hull, self.potential)))


def _meetings(fins: tuple[Fin, ...], lattices: list[FinLattice], panels: HullPanels) -> list[_Meeting]:
    """Influence for every fin; equal fins a whole number of sectors apart are computed once and turned."""
    step = 2.0 * np.pi / panels.shape[1]
    known: dict[Fin, tuple[float, _Meeting]] = {}
    found = []
    for fin, lattice in zip(fins, lattices, strict=True):
        shape = replace(fin, name="", azimuth=0.0)
        if shape not in known:
            known[shape] = fin.azimuth, _meet(lattice, panels)
        azimuth, meeting = known[shape]
        turn = (fin.azimuth - azimuth) / step
        whole = round(turn)
        found.append(meeting.turned(whole) if abs(turn - whole) < 1e-9 else _meet(lattice, panels))
    return found


def _meet(lattice: FinLattice, panels: HullPanels) -> _Meeting:
    hull_points, hull_normals = panels.centre.reshape(-1, 3), panels.normal.reshape(-1, 3)
    sources = source_influence(lattice.point, panels.quads.reshape(-1, 4, 3), hull_normals)[1]
    to_fin = np.einsum("ijc,ic->ji", sources, lattice.normal)
    shape = (*panels.shape, -1)
    on_hull = _ring_normal(hull_points, hull_normals, lattice)
    return _Meeting(to_fin.reshape(shape), on_hull.reshape(shape), _ring_potential(hull_points, lattice).reshape(shape))


def _ring_normal(points: Array, normals: Array, lattice: FinLattice) -> Array:
    chordwise = len(lattice.through)
    velocity = ring_velocity(points, lattice.rings)
    velocity[:, :chordwise] += ring_velocity(points, lattice.through)
    return np.asarray(np.einsum("ijc,ic->ij", velocity, normals))


def _ring_potential(points: Array, lattice: FinLattice) -> Array:
    potential = ring_potential(points, lattice.rings)
    potential[:, : len(lattice.through)] += ring_potential(points, lattice.through)
    return potential
