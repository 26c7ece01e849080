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
    """Inner points (n, 2) of the unit disc, quads (q, 4), and the radii of the points on the way from pole to rim.

    Labels from 0 to n - 1 are inner points; n + k is the rim point of plane k. Quads turn counter-clockwise, from
    plane 0 towards plane 1.
    """

    points: Array
    quads: Labels
    spoke: Array


def disc(rim: Array, half: bool) -> Disc:
    """Disc with rim points at the angles ``rim`` (n,) [rad], ascending from 0, without the closing 2 pi.

    n is a multiple of 8. ``half``: only the quads between planes 0 and n/2, whose points must be symmetric.
    """
    count = len(rim)
    side, ring = count // 4, ring_cells(count // 2)
    grid = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    shell = [_square_rim(grid)]
    shell += [(side + 1) ** 2 + layer * count + np.arange(count) for layer in range(ring)]
    inner = (side + 1) ** 2 + (ring - 1) * count
    core = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
    rings = [np.stack([a, b, np.roll(b, -1), np.roll(a, -1)], axis=1) for a, b in pairwise(shell)]
    quads = np.concatenate([core, *rings])
    points = _mean_of_neighbours(quads, inner, np.stack([np.cos(rim), np.sin(rim)], axis=1))
    pole = grid[side // 2, side // 2]
    points[pole] = 0.0 if np.hypot(*points[pole]) < 1e-9 else points[pole]
    way = [grid[side // 2 + step, side // 2] for step in range(side // 2 + 1)] + [layer[0] for layer in shell[1:-1]]
    spoke = np.r_[np.hypot(*points[way].T), 1.0]
    if not half:
        return Disc(points, quads, spoke)
    points[np.abs(points[:, 1]) < 1e-9, 1] = 0.0
    whole = np.concatenate([points, np.stack([np.cos(rim), np.sin(rim)], axis=1)])
    upper = quads[whole[quads].mean(axis=1)[:, 1] > 0.0]
    kept = np.unique(upper[upper < inner])
    label = np.full(inner + count, -1)
    label[kept] = np.arange(len(kept))
    label[inner:] = len(kept) + np.arange(count)
    return Disc(points[kept], label[upper], spoke)


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
