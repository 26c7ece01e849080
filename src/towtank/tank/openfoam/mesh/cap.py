"""Butterfly cap: a disc of quadrilaterals without a wedge, a square core in a ring whose rim follows the azimuth.

The square has a quarter of the rim's cells on each side. Its points, and those of the ring, lie at the mean of their
neighbours with the rim on the unit circle: such a drawing has no folds, whatever the spacing of the rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from towtank.frames import Array
from towtank.tank.openfoam.mesh.poly import Labels


def ring_cells(around: int) -> int:
    """Cells of the ring between core and rim: few, for a thick ring crowds the corners of the core."""
    return max(1, round(around / 16))


def cap_cells(around: int) -> int:
    """Cells from pole to rim for ``around`` cells over 180 deg."""
    return around // 4 + ring_cells(around)


@dataclass(frozen=True)
class Disc:
    """Inner points (n, 2) of the unit disc and quads (q, 4).

    Labels from 0 to n - 1 are inner points; n + k is the rim point of plane k. Quads turn counter-clockwise, from
    plane 0 towards plane 1. ``spoke``: radii of the points from pole to rim along plane 0 when the rim is even.
    """

    points: Array
    quads: Labels
    spoke: Array


def disc(rim: Array, half: bool) -> Disc:
    """Disc with rim points at the angles ``rim`` (n,) [rad], ascending, without the closing 2 pi.

    n is a multiple of 8. ``half``: only the quads between planes 0 and n/2, whose points must be symmetric.
    """
    count = len(rim)
    quads, inner, way = _butterfly(count)
    circle = np.stack([np.cos(rim), np.sin(rim)], axis=1)
    points = _mean_of_neighbours(quads, inner, circle)
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    even = _mean_of_neighbours(quads, inner, np.stack([np.cos(turn), np.sin(turn)], axis=1))
    spoke = np.r_[0.0, np.hypot(*even[way[1:]].T), 1.0]
    points[np.abs(points) < 1e-9] = 0.0
    if not half:
        return Disc(points, quads, spoke)
    upper = quads[np.concatenate([points, circle])[quads].mean(axis=1)[:, 1] > 0.0]
    kept = np.unique(upper[upper < inner])
    label = np.full(inner + count, -1)
    label[kept] = np.arange(len(kept))
    label[inner:] = len(kept) + np.arange(count)
    return Disc(points[kept], label[upper], spoke)


def _butterfly(count: int) -> tuple[Labels, int, Labels]:
    """Quads of core and ring, number of inner points, and the inner points from pole to rim along plane 0."""
    side, ring = count // 4, ring_cells(count // 2)
    core = (side + 1) ** 2
    grid = np.arange(core).reshape(side + 1, side + 1)
    shells = [_square_rim(grid)] + [core + layer * count + np.arange(count) for layer in range(ring)]
    square = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
    rings = [np.stack([a, b, np.roll(b, -1), np.roll(a, -1)], axis=1) for a, b in pairwise(shells)]
    way = np.r_[grid[side // 2 :, side // 2], [shell[0] for shell in shells[1:-1]]].astype(int)
    return np.concatenate([square, *rings]), core + (ring - 1) * count, way


def _square_rim(grid: Labels) -> Labels:
    """Labels around the square grid, from the middle of the side at angle 0, counter-clockwise."""
    turn = np.concatenate([grid[-1, :-1], grid[:0:-1, -1], grid[0, :0:-1], grid[:-1, 0]])
    return np.roll(turn, -(len(grid) // 2))


def _mean_of_neighbours(quads: Labels, inner: int, rim: Array) -> Array:
    """Points (inner, 2) that are the mean of those joined to them by an edge; the last points are ``rim``."""
    edges = np.sort(np.concatenate([quads[:, [a, (a + 1) % 4]] for a in range(4)]), axis=1)
    edges = np.unique(edges, axis=0)
    ends = np.concatenate([edges, edges[:, ::-1]])
    total = inner + len(rim)
    joined = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(total, total)).tocsr()
    degree = np.asarray(joined.sum(axis=1)).ravel()
    matrix = coo_array((degree[:inner], (np.arange(inner), np.arange(inner))), shape=(inner, inner)).tocsr()
    return np.asarray(spsolve((matrix - joined[:inner, :inner]).tocsc(), joined[:inner, inner:] @ rim))
