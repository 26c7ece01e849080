"""Histograms of runs in OpenFOAM: y+ by share of the wall, Courant number by share of the cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAND, INK, PALETTE, frame, head, legend, new_axes
from towtank.grid.study import GridStudy
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, Distribution, distribution, distribution_of
from towtank.tank.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = Mapping[str, Sequence[tuple[float, ...]]]
"""Name of a group -> shares in the bins, a row for each run."""

HULL = "hull"
WIDTH = 0.84
"""Of all the bars of a bin, over the distance of two bins."""


def y_plus(rows: Rows, level: str = "rans", ax: Axes | None = None) -> Axes:
    """Share of the wall area [%] in each bin of y+, a bar for each group: the mean of its runs.

    Whiskers run from the least to the largest share of a run. Shaded: where wall functions hold.
    """
    ax = new_axes(ax, width=4.6, height=2.9)
    ax.axvspan(Y_PLUS.index(30.0) + 0.5, Y_PLUS.index(300.0) + 0.5, color=BAND, alpha=0.3, linewidth=0,
               label="wall functions: 30 to 300")  # fmt: skip
    _bars(ax, rows, Y_PLUS)
    return _framed(ax, rows, level, "y+ on the walls", "y+ of the first cell [-]", "share of the wall area [%]")


def courant(rows: Rows, level: str = "rans", ax: Axes | None = None) -> Axes:
    """Share of the cells [%] in each bin of the Courant number at the end of a moving run, as ``y_plus``."""
    ax = new_axes(ax, width=4.6, height=2.9)
    _bars(ax, rows, COURANT)
    title = "Courant number at the end of a run"
    return _framed(ax, rows, level, title, "Courant number of the cell [-]", "share of the cells [%]")


def _framed(ax: Axes, rows: Rows, level: str, title: str, across: str, up: str) -> Axes:
    frame(ax, across, up, zero=False)
    ax.grid(False, axis="x")
    head(ax, title, level, _words(rows))
    legend(ax)
    return ax


def _bars(ax: Axes, rows: Rows, edges: Sequence[float]) -> None:
    """Bars and whiskers of every group, and the bins in words."""
    at, width = np.arange(len(edges) + 1), WIDTH / max(len(rows), 1)
    for number, (name, shares) in enumerate(rows.items()):
        percent = 100.0 * np.array(shares)
        mean = percent.mean(axis=0)
        x = at + (number + 0.5) * width - 0.5 * WIDTH
        ax.bar(x, mean, 0.94 * width, color=PALETTE[number % len(PALETTE)], label=name)
        if len(percent) > 1:
            reach = np.abs(np.stack([percent.min(axis=0), percent.max(axis=0)]) - mean)
            held = percent.max(axis=0) > 0.0
            ax.errorbar(x[held], mean[held], yerr=reach[:, held], fmt="none", ecolor=INK, elinewidth=0.7, capsize=1.5)
    ax.set_xlim(-0.5, len(edges) + 0.5)
    ax.set_ylim(0.0, 105.0)
    ax.set_xticks(at, bins(edges))


def bins(edges: Sequence[float]) -> list[str]:
    """Names of the bins: below the first edge, between two, above the last."""
    between = [f"{low:g}-{high:g}" for low, high in pairwise(edges)]
    return [f"< {edges[0]:g}", *between, f"> {edges[-1]:g}"]


def _words(rows: Rows) -> str:
    most = max((len(shares) for shares in rows.values()), default=0)
    if most < 2:
        return "one run; no uncertainty stated"
    return f"bars: mean of up to {most} runs; whiskers: their range"


def by_wall(runs: Sequence[Run]) -> dict[str, list[tuple[float, ...]]]:
    """Shares of y+ of the hull and of all fins together, of the runs that carry them."""
    found = [item for run in runs if (item := distribution_of(run)) is not None]
    rows = {
        HULL: [item.walls([HULL]) for item in found],
        "fins": [item.walls([patch for patch in item.y_plus if patch != HULL]) for item in found],
    }
    return {name: kept for name, shares in rows.items() if (kept := [row for row in shares if row])}


def by_kind(runs: Sequence[Run]) -> dict[str, list[tuple[float, ...]]]:
    """Shares of the Courant number of the runs of each kind, of those that carry them."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    for run in runs:
        found = distribution_of(run)
        if found is not None and found.courant:
            rows.setdefault(run.kind, []).append(found.courant)
    return rows


def by_mesh(study: GridStudy) -> dict[str, list[Distribution]]:
    """Distributions of the runs on each mesh of a study, coarse to fine; empty where its runs carry none."""
    told = study.provenance.get("distribution", {})
    found = {
        mesh.label: [item for document in told.get(mesh.label, {}).values() if (item := distribution(document))]
        for mesh in study.meshes
    }
    return {label: items for label, items in found.items() if items}


def y_plus_of_meshes(study: GridStudy, ax: Axes | None = None) -> Axes:
    """``y_plus`` over all walls together, a bar for each mesh of the study."""
    rows = {label: [row for item in items if (row := item.walls())] for label, items in by_mesh(study).items()}
    return y_plus({label: kept for label, kept in rows.items() if kept}, study.level, ax)


def courant_of_meshes(study: GridStudy, ax: Axes | None = None) -> Axes:
    """``courant`` of the moving runs, a bar for each mesh of the study."""
    rows = {label: [item.courant for item in items if item.courant] for label, items in by_mesh(study).items()}
    return courant({label: kept for label, kept in rows.items() if kept}, study.level, ax)
