"""The craft: side and stern view of hull, fins and strakes, and a shaded picture of its surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from towtank.craft.craft import Craft
from towtank.figures.paper import BAD, FIT, INK, OK, ORIGIN, frame, head, legend, new_axes
from towtank.frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GEOMETRY = "geometry as given, no uncertainty stated"


def side_view(craft: Craft, ax: Axes | None = None) -> Axes:
    """Hull outline, fins and strakes, metres aft of the nose, seen from starboard; CB and CG marked."""
    ax = new_axes(ax, width=6.4, height=2.2)
    x = np.linspace(0.0, craft.length, 301)
    r = craft.profile.radius(x)
    ax.fill_between(x, -r, r, color="#d9e2e8", linewidth=0.8, edgecolor=INK)
    for fin in craft.fins:
        span = np.array([fin.root_radius, fin.tip_radius])
        aft = fin.trailing_edge_at(span)
        fore = aft - fin.chord(span)
        height = span * fin.span_direction[2]
        ax.fill(
            np.r_[fore, aft[::-1]], np.r_[height, height[::-1]], color=FIT, alpha=0.35, linewidth=0.8, edgecolor=FIT
        )
    for strake in craft.strakes:
        along = np.linspace(strake.start, strake.end, 41)
        root = craft.profile.radius(along)
        tip, down = root + strake.height_at(along), strake.span_direction[2]
        outline = np.r_[root, tip[::-1]] * down
        ax.fill(np.r_[along, along[::-1]], outline, color=OK, alpha=0.35, linewidth=0.8, edgecolor=OK)
    ax.plot(craft.origin_from_nose, 0.0, "+", color=INK, markersize=7, label="origin")
    cg = craft.mass.cg
    ax.plot(craft.origin_from_nose - cg[0], cg[2], "x", color=BAD, markersize=5, label="CG")
    frame(ax, "distance aft of the nose [m]", "below axis [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    ax.invert_yaxis()
    head(ax, "Side view, starboard", "", GEOMETRY)
    legend(ax, ncol=2)
    return ax


def stern_view(craft: Craft, ax: Axes | None = None) -> Axes:
    """Fins and strakes seen from astern, the fins with their numbers, starboard to the right, keel downwards [m]."""
    ax = new_axes(ax, width=2.6, height=2.6)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    ax.fill(
        0.5 * craft.diameter * np.cos(turn),
        0.5 * craft.diameter * np.sin(turn),
        color="#d9e2e8",
        linewidth=0.8,
        edgecolor=INK,
    )
    for strake in craft.strakes:
        along = np.linspace(strake.start, strake.end, 41)
        root = craft.profile.radius(along)
        ends = np.array([root.min(), (root + strake.height_at(along)).max()])[:, None] * strake.span_direction
        ax.plot(ends[:, 1], ends[:, 2], color=OK, linewidth=1.2)
    for i, fin in enumerate(craft.fins):
        tip = fin.tip_radius * fin.span_direction
        root = fin.root_radius * fin.span_direction
        ax.plot([root[1], tip[1]], [root[2], tip[2]], color=FIT, linewidth=2.5)
        end = tip * 1.2 + fin.tip_radius * 0.2 * fin.lift_direction
        arrow = {"arrowstyle": "->", "color": ORIGIN, "linewidth": 0.8}
        ax.annotate("", (end[1], end[2]), xytext=(1.2 * tip[1], 1.2 * tip[2]), arrowprops=arrow)
        ax.text(1.38 * tip[1], 1.38 * tip[2], str(i + 1), fontsize=7, ha="center", va="center")
    frame(ax, "starboard [m]", "down [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    ax.invert_yaxis()
    head(ax, "From astern", "", GEOMETRY)
    return ax


def shaded(vertices: Array, faces: NDArray[np.integer], ax: Axes | None = None) -> Axes:
    """Surface (n, 3) vertices [m, body axes], (m, 3) faces, lit from above and seen from the starboard bow.

    The faces turned away are dropped, the others painted from far to near, as pixels.
    """
    from matplotlib.collections import PolyCollection

    ax = new_axes(ax, width=6.4, height=2.6)
    view = _unit(np.array([0.62, 0.62, -0.40]))
    right = _unit(np.cross(np.array([0.0, 0.0, -1.0]), view))
    up = np.cross(view, right)
    corner = np.asarray(vertices)[np.asarray(faces)]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal = normal / np.where(length > 0.0, length, 1.0)[:, None]
    seen = (normal @ view > 0.0) & (length > 0.0)
    corner, normal = corner[seen], normal[seen]
    order = np.argsort(corner.mean(axis=1) @ view)
    light = 0.35 + 0.65 * np.clip(normal @ _unit(np.array([0.45, 0.35, -0.82])), 0.0, 1.0)
    colour = np.clip(light[:, None] * np.array([0.80, 0.87, 0.92]), 0.0, 1.0)[order]
    flat = np.stack([corner @ right, corner @ up], axis=-1)[order]
    ax.add_collection(PolyCollection(list(flat), facecolors=colour, edgecolors=colour, linewidths=0.2, rasterized=True))
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_axis_off()
    head(ax, "Surface from the starboard bow", "", GEOMETRY)
    return ax


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
