"""Influence of flat source panels and vortex rings on field points. Body axes, SI, unit strengths."""

from __future__ import annotations

import numpy as np

from towtank.frames import Array

CORE = 1e-4
"""Vortex core as a fraction of the segment length; keeps the ring velocity finite on its own edge."""


def panel_geometry(quads: Array) -> tuple[Array, Array, Array]:
    """Centre (m, 3) [m], right-handed unit normal (m, 3) and area (m,) [m2] of quadrilaterals (m, 4, 3)."""
    cross = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    twice = np.linalg.norm(cross, axis=1)
    return quads.mean(axis=1), cross / twice[:, None], 0.5 * twice


def source_influence(points: Array, quads: Array, normals: Array) -> tuple[Array, Array, Array]:
    """Potential, velocity and solid angle of flat panels at ``points``.

    Parameters
    ----------
    points : (n, 3) [m].   quads : (m, 4, 3) [m], planar or nearly so.   normals : (m, 3) unit vectors.

    Returns
    -------
    potential (n, m) [m] and velocity (n, m, 3) of unit source density, phi = -1/(4 pi) int dS/R; and the signed
    solid angle (n, m) [sr] under which the panel is seen, positive on the side of its normal.

    Source     hesssmith1967 for the method; wilton1984 for the edge form of the integrals.
    Valid      Anywhere but on a panel edge. On the panel itself the normal velocity is not defined here: the
               caller sets the diagonal.
    """
    to_point = points[:, None, :] - quads.mean(axis=1)[None, :, :]
    height = np.einsum("ijk,jk->ij", to_point, normals)
    depth = np.abs(height)
    side = np.where(height >= 0.0, 1.0, -1.0)
    integral, angle = np.zeros_like(height), np.zeros_like(height)
    gradient = np.zeros((*height.shape, 3))
    for first in range(4):
        start, end = quads[:, first], quads[:, (first + 1) % 4]
        edge = end - start
        length = np.linalg.norm(edge, axis=1)
        real = length > 1e-12
        edge = edge / np.where(real, length, 1.0)[:, None]
        outward = np.cross(edge, normals)
        a = start[None, :, :] - points[:, None, :]
        s1 = np.einsum("ijk,jk->ij", a, edge)
        s2 = s1 + length
        h = np.einsum("ijk,jk->ij", a, outward)
        squared = h * h + height * height
        r1, r2 = np.sqrt(squared + s1 * s1), np.sqrt(squared + s2 * s2)
        log = np.log(np.maximum(r1 + r2 + length, 1e-13) / np.maximum(r1 + r2 - length, 1e-13)) * real
        beta = (np.arctan2(h * s2, squared + depth * r2) - np.arctan2(h * s1, squared + depth * r1)) * real
        integral += h * log
        angle += beta
        gradient -= log[:, :, None] * outward[None, :, :]
    integral -= depth * angle
    signed = side * angle
    gradient -= signed[:, :, None] * normals[None, :, :]
    scale = -1.0 / (4.0 * np.pi)
    return scale * integral, scale * gradient, signed


def ring_velocity(points: Array, rings: Array) -> Array:
    """Velocity (n, m, 3) at ``points`` (n, 3) of unit vortex rings (m, 4, 3); phi jumps by +1 along the normal.

    Source     katzplotkin2001, section 2.12 and chapter 12 (Biot-Savart for straight segments).
    """
    velocity = np.zeros((len(points), len(rings), 3))
    for first in range(4):
        start, end = rings[:, first], rings[:, (first + 1) % 4]
        segment = end - start
        squared = (segment**2).sum(axis=1)
        r1 = points[:, None, :] - start[None, :, :]
        r2 = points[:, None, :] - end[None, :, :]
        cross = np.cross(r1, r2)
        d1 = np.maximum(np.linalg.norm(r1, axis=2), 1e-12)
        d2 = np.maximum(np.linalg.norm(r2, axis=2), 1e-12)
        along = np.einsum("ijk,jk->ij", r1 / d1[:, :, None] - r2 / d2[:, :, None], segment)
        denominator = (cross**2).sum(axis=2) + (CORE**2) * squared**2
        factor = np.where(squared > 0.0, along / (4.0 * np.pi * np.maximum(denominator, 1e-30)), 0.0)
        velocity += factor[:, :, None] * cross
    return velocity


def ring_potential(points: Array, rings: Array) -> Array:
    """Potential (n, m) at ``points`` of unit vortex rings (m, 4, 3), equal to a unit doublet sheet.

    Source     katzplotkin2001, section 10.4: solid angle over 4 pi.
    """
    _, normals, _ = panel_geometry(rings)
    return np.asarray(-source_influence(points, rings, normals)[2] / (4.0 * np.pi))
