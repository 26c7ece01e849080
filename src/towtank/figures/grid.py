"""Grid study: a quantity against mesh size with its extrapolated value and bounds, and the bounds of all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAD, BAND, FIT, GREY, INK, OK, ORIGIN, UNITS, frame, head, legend, new_axes, note
from towtank.grid.estimate import Estimate
from towtank.grid.quantities import PEAK, STEADY
from towtank.grid.study import GridStudy, Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"monotone": FIT, "oscillatory": ORIGIN, "divergent": BAD, "exact": OK}
"""Colour of each verdict."""
SMOOTH = 60
"""Points of the curve between zero mesh size and the coarsest mesh."""


def convergence(study: GridStudy, name: str, ax: Axes | None = None) -> Axes:
    """Value [N, N m] of the quantity ``name`` against mesh size over that of the finest mesh.

    Bars are 95 % bounds; the dashed line runs to the extrapolated value at size 0, whose band is the bound of the
    finest mesh. The chosen mesh is ringed.

    Raises
    ------
    ValueError
        The study has no quantity of that name.
    """
    item = next((item for item in study.quantities if item.name == name), None)
    if item is None:
        raise ValueError(f"no quantity {name!r}; the study has {', '.join(q.name for q in study.quantities)}")
    size = np.array([mesh.size for mesh in study.meshes]) / study.meshes[-1].size
    it, values = item.estimate, np.array(item.values)
    colour = COLOURS[it.verdict]
    ax = new_axes(ax, width=4.2, height=3.0)
    if math.isfinite(it.extrapolated):
        bound = float(it.uncertainty[-1])
        ax.axhspan(values[-1] - bound, values[-1] + bound, color=BAND, alpha=0.4, linewidth=0, label="bound, finest")
        h, curve = _curve(item, size)
        ax.plot(h, curve, "--", color=colour, linewidth=1.0)
        ax.plot(0.0, it.extrapolated, "D", color=colour, markersize=4, label="extrapolated")
    ax.errorbar(size, values, yerr=it.uncertainty, fmt="o", color=INK, markersize=3.6, elinewidth=0.8, capsize=2.5)
    at = study.number(study.chosen)
    ax.plot(size[at], values[at], "o", color=ORIGIN, markersize=9, fillstyle="none", label=f"chosen: {study.chosen}")
    for h, top, mesh in zip(size, values + it.uncertainty, study.meshes, strict=True):
        note(ax, f"{mesh.cells:,}".replace(",", " "), (h, top), (0, 3), color=GREY, ha="center")
    frame(ax, "mesh size over the finest", f"{item.load} {item.measure} [{UNITS[item.load]}]", zero=False)
    ax.set_xlim(-0.08 * size[0], 1.08 * size[0])
    ax.margins(y=0.2)
    head(
        ax,
        f"{item.load} {item.measure}, {item.run}",
        study.level,
        f"{it.verdict}, {order_words(it)}; bars: 95 % bound; numbers: cells",
    )
    legend(ax)
    return ax


def order_words(it: Estimate) -> str:
    """Observed order, and whether the meshes are in the asymptotic range."""
    order = f"observed order {it.order:.2g}" if math.isfinite(it.order) else "no order"
    return order + (", asymptotic range" if it.in_range else ", outside the asymptotic range")


def _curve(item: Quantity, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The power law that was kept, from the extrapolated value through the finest mesh; straight where it has two."""
    it = item.estimate
    order = it.used[0] if len(it.used) == 1 else 1.0
    h = np.linspace(0.0, float(size[0]), SMOOTH)
    return h, it.extrapolated + (item.values[-1] - it.extrapolated) * h**order


def bounds(study: GridStudy, measure: str = "", ax: Axes | None = None) -> Axes:
    """95 % bound of every quantity [% of the size of its load] on the chosen mesh, coloured by verdict.

    ``measure``: only those of one measure, such as "peak"; all by default.
    """
    items = [item for item in study.quantities if measure in ("", item.measure)]
    at = study.number(study.chosen)
    ax = new_axes(ax, width=6.6, height=1.3 + 0.16 * max(len(items), 4))
    y = np.arange(len(items))
    percent = [100.0 * item.share(at) for item in items]
    for found, colour in COLOURS.items():
        rows = [i for i, item in enumerate(items) if item.estimate.verdict == found]
        if rows:
            ax.barh(y[rows], [percent[i] for i in rows], color=colour, height=0.66, label=found)
    outside = [i for i, item in enumerate(items) if not item.estimate.in_range]
    if outside:
        ax.plot([percent[i] for i in outside], y[outside], "|", color=INK, markersize=6, label="not asymptotic")
    ax.axvline(
        100.0 * study.target, color=GREY, linestyle="--", linewidth=0.9, label=f"target {100 * study.target:g} %"
    )
    ax.set_yticks(y)
    frame(ax, "95 % bound [% of the load]", "", zero=False)
    ax.set_yticklabels([item.name for item in items], fontsize=5.6, parse_math=False)
    ax.margins(y=0.01)
    ax.invert_yaxis()
    box = ax.get_position()
    ax.set_position((0.33, box.y0, 0.64, box.height))
    head(ax, f"What the mesh leaves uncertain, {study.chosen}", study.level, f"chosen of {len(study.meshes)} meshes")
    legend(ax, loc="lower right")
    return ax


def notable(study: GridStudy, count: int = 4) -> tuple[str, ...]:
    """Names of the steady and peak quantities with the largest bounds on the chosen mesh, two of each where there are.

    count : how many in all.
    """
    at = study.number(study.chosen)
    found: list[str] = []
    for measure, most in ((STEADY, (count + 1) // 2), (PEAK, count // 2)):
        items = [item for item in study.quantities if item.measure == measure]
        found += [item.name for item in sorted(items, key=lambda item: -item.share(at))[:most]]
    return tuple(found)
