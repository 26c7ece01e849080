"""Volumes, centroids, areas and inertias of hull, fins and strakes, by quadrature on the analytic shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from towtank.craft.craft import Fin, Profile, Strake
from towtank.craft.section import half_thickness
from towtank.frames import Array

_STATIONS = 4001


@dataclass(frozen=True)
class HullIntegrals:
    """Bare hull. ``centroid`` [m] aft of the nose; the radii of gyration squared [m2] are about the centroid."""

    volume: float
    centroid: float
    wetted_area: float
    roll_gyration2: float
    pitch_gyration2: float
    diameter: float


@dataclass(frozen=True)
class FinIntegrals:
    """What one fin or strake adds outside the hull.

    ``centroid`` [m]: (aft of the nose, radius). ``wetted_area`` counts faces and tip, ``footprint`` the hull surface
    it covers, ``exposed_area`` the planform outside the hull [m2].
    """

    volume: float
    centroid: tuple[float, float]
    wetted_area: float
    footprint: float
    exposed_area: float


def stations(profile: Profile, count: int = _STATIONS) -> Array:
    """``count`` stations [m] from nose to tail, dense at both ends."""
    theta = np.linspace(0.0, np.pi, count)
    return np.clip(0.5 * profile.length * (1.0 - np.cos(theta)), 0.0, profile.length)


@lru_cache(maxsize=64)
def hull_integrals(profile: Profile) -> HullIntegrals:
    """Volume, centroid, wetted area and gyration of a body of revolution.

    Sections are integrated by Simpson's rule over x = L (1 - cos t) / 2; the area is the sum of cone frusta, plus the
    discs of blunt ends.
    """
    from scipy.integrate import simpson

    theta = np.linspace(0.0, np.pi, _STATIONS)
    x = stations(profile)
    r = profile.radius(x)
    weight = 0.5 * profile.length * np.sin(theta)

    def integral(f: Array) -> float:
        return float(simpson(f * weight, x=theta))

    volume = integral(np.pi * r**2)
    centroid = integral(np.pi * r**2 * x) / volume
    polar = integral(0.5 * np.pi * r**4) / volume
    along = integral(np.pi * r**2 * (x - centroid) ** 2) / volume
    sides = np.sum(np.pi * (r[1:] + r[:-1]) * np.hypot(np.diff(x), np.diff(r)))
    ends = np.pi * (r[0] ** 2 + r[-1] ** 2)
    return HullIntegrals(volume, centroid, float(sides + ends), polar, 0.5 * polar + along, 2.0 * float(r.max()))


def fin_integrals(fin: Fin, profile: Profile) -> FinIntegrals:
    """Volume, centroid, wetted area and hull footprint of the part of ``fin`` outside the hull.

    A point of the fin at span y and thickness offset z lies outside when y^2 + z^2 exceeds the local hull radius
    squared. Midpoint rule on 400 x 400 cells over chord and span.
    """
    return _fin_integrals(replace(fin, name="", azimuth=0.0, sign=1.0), profile)


@lru_cache(maxsize=64)
def _fin_integrals(fin: Fin, profile: Profile, count: int = 400) -> FinIntegrals:
    t = (np.arange(count) + 0.5) * np.pi / count
    xi, dxi = 0.5 * (1.0 - np.cos(t)), 0.5 * np.sin(t)
    cell = (np.pi / count) * (fin.tip_radius / count)
    y = ((np.arange(count) + 0.5) * fin.tip_radius / count)[:, None]
    chord = fin.chord(y)
    x = fin.trailing_edge_at(y) - chord * (1.0 - xi)
    form = half_thickness(fin.thickness, xi)
    half = chord * form
    radius = profile.radius(x)
    inside = np.sqrt(np.clip(radius**2 - y**2, 0.0, None))
    thick = 2.0 * np.clip(half - inside, 0.0, None) * chord * dxi
    volume = float(thick.sum() * cell)
    if volume <= 0.0:
        return FinIntegrals(0.0, (fin.trailing_edge, fin.tip_radius), 0.0, 0.0, 0.0)
    centroid = (float((thick * x).sum() * cell / volume), float((thick * y).sum() * cell / volume))
    out = half > inside
    faces = 2.0 * float((_face_element(fin, chord, xi, dxi, form) * out).sum() * cell)
    planform = float((chord * dxi * (y > radius)).sum() * cell)
    tip = float(np.sum(2.0 * fin.tip_chord**2 * form * dxi) * np.pi / count)
    return FinIntegrals(volume, centroid, faces + tip, _footprint(fin, profile), planform)


def _face_element(fin: Fin, chord: Array, xi: Array, dxi: Array, form: Array) -> Array:
    """Area of one face per unit of the chord parameter and of span, shape (span, chord)."""
    taper = (fin.tip_chord - fin.root_chord) / (fin.tip_radius - fin.root_radius)
    shear = np.tan(fin.trailing_edge_sweep) - taper * (1.0 - xi)
    slope = np.gradient(form, np.arccos(1.0 - 2.0 * xi))
    along, normal, lean = chord * dxi, chord * slope, taper * form
    return np.asarray(np.sqrt(normal**2 + (normal * shear - along * lean) ** 2 + along**2))


def _footprint(fin: Fin, profile: Profile, count: int = 4001) -> float:
    """Hull surface [m2] covered by the root of the fin."""
    x = np.linspace(0.0, profile.length, count)
    r = profile.radius(x)
    half = np.zeros_like(x)
    for _ in range(3):  # the root lies at y = sqrt(r^2 - half^2), and half depends on y
        y = np.sqrt(np.clip(r**2 - half**2, 0.0, None))
        chord = np.maximum(fin.chord(y), 1e-12)
        xi = 1.0 - (fin.trailing_edge_at(y) - x) / chord
        covered = (xi > 0.0) & (xi < 1.0) & (y < fin.tip_radius)
        half = np.where(covered, np.minimum(chord * half_thickness(fin.thickness, xi), r), 0.0)
    arc = 2.0 * r * np.arcsin(np.divide(half, r, out=np.zeros_like(r), where=r > 0.0))
    length = np.hypot(np.diff(x), np.diff(r))
    return float(np.sum(0.5 * (arc[1:] + arc[:-1]) * length))


def strake_integrals(strake: Strake, profile: Profile, count: int = 2001) -> FinIntegrals:
    """Volume, centroid, wetted area and hull footprint of ``strake``: a plate of constant thickness, ends square.

    The wetted area counts both faces, the outer edge and the two ends.
    """
    x = np.linspace(strake.start, strake.end, count)
    r, h, t = profile.radius(x), strake.height_at(x), strake.thickness
    area = float(np.trapezoid(h, x))
    centroid = (float(np.trapezoid(h * x, x)) / area, float(np.trapezoid(h * (r + 0.5 * h), x)) / area)
    edge = float(np.hypot(np.diff(x), np.diff(r + h)).sum())
    root = float(np.hypot(np.diff(x), np.diff(r)).sum())
    wetted = 2.0 * area + t * (edge + strake.height + strake.end_height)
    return FinIntegrals(t * area, centroid, wetted, t * root, area)


def centre_of_buoyancy(
    profile: Profile, fins: tuple[Fin, ...], strakes: tuple[Strake, ...] = ()
) -> tuple[float, float, float, float]:
    """Volume [m3] and centroid of the craft: (volume, x aft of the nose, y, z) [m], y and z in body axes."""
    hull = hull_integrals(profile)
    volume, moment = hull.volume, hull.volume * np.array([hull.centroid, 0.0, 0.0])
    parts = [(fin.span_direction, fin_integrals(fin, profile)) for fin in fins]
    parts += [(strake.span_direction, strake_integrals(strake, profile)) for strake in strakes]
    for outward, part in parts:
        volume += part.volume
        place = np.array([part.centroid[0], 0.0, 0.0]) + part.centroid[1] * outward
        moment = moment + part.volume * place
    x, y, z = np.round(moment / volume, 12) + 0.0
    return volume, float(x), float(y), float(z)
