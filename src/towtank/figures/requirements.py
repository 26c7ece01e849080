"""Requirements: how probably each is met, and how far its number is from the limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAD, GREY, INK, OK, frame, head, note
from towtank.verdict.table import Requirement

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW, EDGES, NAMES = 0.21, 1.25, 2.9
"""Height of a row, of what lies above and below them, and width of the names [in]."""
WIDEST = 3.0
"""Standard uncertainties at which the axis of the margins ends."""


def chances(requirements: Sequence[Requirement], level: str, drawn: str, ax: Axes | None = None) -> Axes:
    """Share of the drawn craft that meets each requirement [%]; a tick where a share is asked for.

    A requirement that is on a share itself shows that one. Green is met, red is not met.
    """
    rows = [(r, r.value if r.on_share else r.probability) for r in requirements if r.sense]
    rows = [(r, share) for r, share in rows if np.isfinite(share)]
    ax = _axes(ax, len(rows))
    for i, (r, share) in enumerate(rows):
        ax.barh(i, 100.0 * share, height=0.62, color=OK if r.met else BAD, alpha=0.75)
        wanted = r.limit if r.on_share else r.wanted
        if wanted is not None:
            ax.plot([100.0 * wanted] * 2, [i - 0.42, i + 0.42], color=INK, linewidth=1.6)
        note(ax, f"{100.0 * share:.0f}", (100.0 * share, i), (2.0, 0.0), va="center", color=GREY)
    _named(ax, [r for r, _ in rows], "share of the drawn craft that meets it [%]")
    ax.set_xlim(0.0, 108.0)
    head(ax, "Probability of meeting each requirement", level, f"{drawn}; tick: the share asked for")
    return ax


def margins(requirements: Sequence[Requirement], level: str, drawn: str, ax: Axes | None = None) -> Axes:
    """Margin of the best estimate in standard uncertainties of the number; right of zero it is met."""
    rows = [r for r in requirements if r.sense and np.isfinite(r.margin_in_std) and not r.on_share]
    ax = _axes(ax, len(rows))
    for i, r in enumerate(rows):
        ax.barh(i, np.clip(r.margin_in_std, -WIDEST, WIDEST), height=0.62, color=OK if r.met else BAD, alpha=0.75)
        if r.drivers:
            side = -1.0 if r.margin_in_std > 0.0 else 1.0
            where = "right" if side < 0.0 else "left"
            note(ax, r.drivers[0].coefficient, (0.0, i), (3.0 * side, 0.0), va="center", ha=where, color=GREY)
    ax.axvline(0.0, color=INK, linewidth=0.8)
    _named(ax, rows, f"margin [std of the number], cut at {WIDEST:g}")
    ax.set_xlim(-1.05 * WIDEST, 1.05 * WIDEST)
    head(ax, "Margin, and the coefficient that drives it", level, f"std over {drawn}")
    return ax


def _axes(ax: Axes | None, rows: int) -> Axes:
    """Axes with room for the names at their left; the same size for every set of requirements of one length."""
    if ax is not None:
        return ax
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width, height = 7.2, ROW * max(rows, 1) + EDGES
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure.add_axes((NAMES / width, 0.5 / height, (width - NAMES - 0.2) / width, ROW * max(rows, 1) / height))


def _named(ax: Axes, rows: Sequence[Requirement], label: str) -> None:
    frame(ax, label, "", zero=False)
    ax.set_yticks(range(len(rows)), [r.name for r in rows], fontsize="x-small", parse_math=False)
    ax.set_ylim(len(rows) - 0.4, -0.6)
