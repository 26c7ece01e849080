"""Spreading what the fins displace over the mesh, and the rings of cells that the fins need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from towtank.frames import Array
from towtank.tank.openfoam.mesh.fins import Layout, Planes, fade, fin_surface
from towtank.tank.openfoam.mesh.meridian import Outline
from towtank.tank.openfoam.mesh.spacing import geometric, two_sided

_TIP_CELL = 1.6
"""Cell at the tip radius over span / out (judgement: the tip vortex sees 4 % of the span on 40 cells out)."""
TIP_SHARE = 0.43
"""Share of the cells out that lie between root and tip."""
_OUTER_REACH = 2.0
"""Spans beyond the tip over which a displacement dies out."""
_NEAR = 0.5
"""Share of the azimuth to the next fin over which the true displacement gives way to a softened one."""
_SOFTENED = (0.035, 0.05)
"""Width of the softening over the cells along and out (judgement: noses and tips fade within three cells)."""
_FORWARD_REACH = 2.5
"""Chords ahead of the leading edge over which a displacement dies out."""


@dataclass(frozen=True)
class Window:
    """First and last station of the fins in the body block, shell of the tips, arcs [m] of the block's ends."""

    start: int
    end: int
    tip: int
    rims: tuple[float, float]


def tip_cell(found: Layout, shape: Outline, out: int) -> float:
    """Height [m] of the cells on either side of the tip."""
    root = float(np.interp(0.5 * sum(found.edges), shape.s, shape.r))
    return _TIP_CELL * (found.tip - root) / out


def radial_with_tip(
    found: Layout, shape: Outline, wall: float, out: int, tip: int
) -> Callable[[float, Array, Array], Array]:
    """Distances along a line from the hull, with shell ``tip`` at the tip radius over the fins.

    Away from the fins the rings go over into one geometric growth from the wall.
    """
    at = np.linspace(*found.edges, 15)
    reach = []
    for s in at:
        line = shape.draw(float(s))
        arc = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
        reach.append(np.interp(found.tip, line[:, 1], arc))
    last = tip_cell(found, shape, out)

    def radial(s: float, arc: Array, r: Array) -> Array:
        total = float(arc[-1])
        even = geometric(wall, out, total)
        share = float(fade(np.array((found.edges[0] - s) / (0.6 * found.edges[0]))))
        if share == 0.0:
            return even
        height = float(np.interp(s, at, reach))
        inner = two_sided(wall, last, tip, height)
        outer = height + geometric(float(inner[-1] - inner[-2]), out - tip, total - height)
        return np.asarray(share * np.r_[inner, outer[1:]] + (1.0 - share) * even)

    return radial


def _away(found: Layout, s: Array | float, fore: float, aft: float) -> Array:
    """Distance from the fins along the hull: 0 over them, 1 at the arcs ``fore`` and ``aft`` [m]."""
    lead, trail = found.edges
    return np.asarray(np.maximum(0.0, np.maximum((lead - s) / (lead - fore), (s - trail) / (aft - trail))))


def azimuths(found: Layout | None, sheets: Planes, s: Array, rims: tuple[float, float]) -> Array:
    """Azimuth (stations, planes) [rad]: fine beside the fins, even at the caps."""
    if found is None:
        return np.broadcast_to(sheets.even, (len(s), len(sheets.even)))
    share = fade(_away(found, s, *rims))[:, None]
    return np.asarray(
        np.where(s[:, None] < found.edges[0], sheets.even, sheets.tail) * (1.0 - share) + share * sheets.fine
    )


def warped(
    found: Layout, sheets: Planes, shape: Outline, s: Array, body: Array, window: Window, rounding: float
) -> tuple[Array, Array]:
    """Points (stations, shells, planes, 3) of (x aft, r, azimuth), and what the faces at smaller azimuth have instead.

    Parameters
    ----------
    s : arcs of the stations (stations,).   body : meridian points (stations, shells, 2).
    rounding : length over which the tips close [m].

    The second array is (fins, stations, shells, 3); only its points inside the slits count.
    """
    gone = np.cumsum(np.hypot(*np.moveaxis(np.diff(body, axis=1, prepend=body[:, :1]), 2, 0)), axis=1)
    height = np.clip(gone / gone[:, window.tip : window.tip + 1], 0.0, 1.0)
    flat = np.concatenate([body, np.zeros((*body.shape[:2], 1))], axis=2)
    moved = np.array(
        [
            [_spread(found, n, side, shape, s, body, height, window, rounding) for side in (1.0, -1.0)]
            for n in range(len(found.fins))
        ]
    )
    width = (_SOFTENED[0] * len(body), _SOFTENED[1] * body.shape[1], 0.0)
    soft = gaussian_filter(moved, (0.0, 0.0, *width), mode="nearest")
    theta = azimuths(found, sheets, s, window.rims)
    points = np.empty((*body.shape[:2], len(sheets.even), 3))
    order = np.argsort(sheets.at)
    count = len(sheets.even)
    for place, a in enumerate(order):
        b = order[(place + 1) % len(order)]
        gap = (sheets.at[b] - sheets.at[a] - 1) % count + 1
        k = (sheets.at[a] + np.arange(gap)) % count
        turn = np.mod(sheets.fine[k] - sheets.fine[k[0]], 2.0 * np.pi)
        whole = np.mod(sheets.fine[sheets.at[b]] - sheets.fine[k[0]] - 1e-12, 2.0 * np.pi)
        points[:, :, k] = flat[:, :, None]
        for face, smooth, t in ((moved[a, 0], soft[a, 0], turn / whole), (moved[b, 1], soft[b, 1], 1.0 - turn / whole)):
            near, share = fade(t / _NEAR)[:, None], (0.5 * (fade(t) + 1.0 - t))[:, None]
            points[:, :, k] += near * face[:, :, None] + (share - near) * smooth[:, :, None]
    points[..., 2] += theta[:, None]
    below = flat + moved[:, 1]
    below[..., 2] += np.moveaxis(theta[:, list(sheets.at)], 1, 0)[:, :, None]
    left = (1.0 - height) ** 2
    points[..., 1] += left[:, :, None] * (shape.radius(points[:, :1, :, 0]) - points[:, :1, :, 1])
    below[..., 1] += left * (shape.radius(below[:, :, :1, 0]) - below[:, :, :1, 1])
    return points, below


def _spread(
    found: Layout,
    number: int,
    side: float,
    shape: Outline,
    s: Array,
    body: Array,
    height: Array,
    window: Window,
    rounding: float,
) -> Array:
    """Displacement (stations, shells, 3) in x, r, azimuth of the plane of a fin, as one of its faces has it."""
    i, tip = slice(window.start, window.end + 1), window.tip
    x = body[i, 0, 0]
    fraction = (x - x[0]) / (x[-1] - x[0])
    face = fin_surface(found, number, side, shape, fraction, height[i, : tip + 1], rounding)
    moved = np.zeros((*body.shape[:2], 3))
    moved[i, : tip + 1] = face
    moved[i, : tip + 1, :2] -= body[i, : tip + 1]
    moved[i, tip:] = moved[i, tip : tip + 1] * _outer(body, window)[i, tip:, None]
    moved[i, tip:, 2] *= body[i, tip : tip + 1, 1] / body[i, tip:, 1]
    ahead = max(window.rims[0], found.edges[0] - _FORWARD_REACH * found.chord)
    share = fade(_away(found, s, ahead, window.rims[1]))[:, None, None]
    moved[: window.start] = moved[window.start] * share[: window.start]
    moved[window.end + 1 :] = moved[window.end] * share[window.end + 1 :]
    return moved


def _outer(body: Array, window: Window) -> Array:
    """Share (stations, shells) of a displacement that is left beyond the tips; 1 below them."""
    r, tip = body[:, :, 1], body[:, window.tip, 1]
    over = body[window.start : window.end + 1]
    span = float(np.mean(over[:, window.tip, 1] - over[:, 0, 1]))
    return fade((r - tip[:, None]) / (_OUTER_REACH * span))
