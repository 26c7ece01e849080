"""A sweep drawn: one column of its table as lines over one axis, or as contours over two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAD, BAND, FIT, GREY, INK, PALETTE, frame, head, legend, new_axes
from towtank.frames import Array
from towtank.sweep.table import SweepTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORDS = {
    "G_h": "Stability index, horizontal",
    "G_v": "Stability index, vertical",
    "P_stable_h": "Probability of course stability",
    "turning_circle.tactical_diameter_lengths": "Tactical diameter [lengths]",
    "zigzag.first_overshoot": "First overshoot, zigzag",
}
"""Titles of columns that are often drawn; the others carry their own name."""
ZERO_MATTERS = ("G_h", "G_v", "growth_h", "growth_v")
FEW = 3
"""Values an axis needs to be drawn as contours; with fewer there is one line for each."""


def sweep_column(table: SweepTable, column: str = "G_h", ax: Axes | None = None) -> Axes:
    """``column`` over the axes of ``table``: lines over one axis, contours over two.

    Axes beyond the second are held at the value nearest to that of the craft as given, and the subtitle says so. Points
    that failed, have no number, or whose trial was not trimmed, carry a cross.
    """
    ax = new_axes(ax, width=4.8, height=3.4)
    values, held = _drawn(table, column)
    order = sorted(range(values.ndim), key=lambda i: -values.shape[i]) if values.ndim == 2 else [0]
    words = [_words(table, column), *held]
    if not np.isfinite(values).all():
        words.append("crosses: no result, or a trial out of trim")
    if values.ndim == 2 and min(values.shape) >= FEW:
        _contours(ax, table, column, values)
    else:
        _lines(ax, table, column, values, order)
    head(ax, WORDS.get(column, column), table.level, "; ".join(words))
    return ax


def sweep_sheet(table: SweepTable, columns: Sequence[str] = ()) -> Figure:
    """A figure with ``columns`` side by side: G_h and the tactical diameter unless others are named."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    wanted = list(columns) or ["G_h", "turning_circle.tactical_diameter_lengths"]
    drawn = [name for name in wanted if name in table.columns] or list(table.columns)[:1]
    figure = Figure(figsize=(4.9 * len(drawn), 3.7))
    FigureCanvasAgg(figure)
    for i, name in enumerate(drawn):
        share = 1.0 / len(drawn)
        sweep_column(table, name, figure.add_axes(((i + 0.16) * share, 0.14, 0.80 * share, 0.70)))
    return figure


def _drawn(table: SweepTable, column: str) -> tuple[Array, list[str]]:
    """Values over the first two axes, NaN where a trial was not trimmed, and what the other axes are held at."""
    values = table.column(column)
    trial = column.partition(".")[0]
    if f"{trial}.trimmed" in table.columns:
        values = np.where(table.column(f"{trial}.trimmed") == 1.0, values, np.nan)
    held: list[str] = []
    for i, axis in reversed(list(enumerate(table.axes))[2:]):
        base = table.base[i] if np.isfinite(table.base[i]) else axis.values[0]
        nearest = int(np.argmin(np.abs(np.array(axis.values) - base)))
        values = np.take(values, nearest, axis=i)
        held.insert(0, f"at {axis.words(axis.values[nearest])}")
    return values, held


def _words(table: SweepTable, column: str) -> str:
    return "band: 5-95 % of the derivatives" if _banded(table, column) else "best estimate, no band"


def _banded(table: SweepTable, column: str) -> bool:
    return len(table.axes) == 1 and f"{column}_low" in table.columns


def _column_label(table: SweepTable, column: str) -> str:
    unit = table.columns[column]
    name = column.rpartition(".")[2].replace("_", " ") if "." in column else column
    return f"{name} [{unit}]" if unit else name


def _lines(ax: Axes, table: SweepTable, column: str, values: Array, order: Sequence[int]) -> None:
    along = order[0]
    x = np.array(table.axes[along].shown[0])
    rising = np.argsort(x)
    if _banded(table, column):
        low, high = table.column(f"{column}_low"), table.column(f"{column}_high")
        ax.fill_between(x[rising], low[rising], high[rising], color=BAND, alpha=0.5, linewidth=0)
    lines = values[None, :] if values.ndim == 1 else np.moveaxis(values, along, -1)
    for i, line in enumerate(lines):
        label = None
        if values.ndim == 2:
            other = order[1]
            label = table.axes[other].words(table.axes[other].values[i])
        colour, missing = PALETTE[i % len(PALETTE)], ~np.isfinite(line)
        ax.plot(x[rising], line[rising], "o-", color=colour, markersize=3, linewidth=1.2, label=label)
        height = np.full(missing.sum(), 0.02 + 0.03 * i)
        ax.plot(x[missing], height, "x", color=colour, markersize=4, transform=ax.get_xaxis_transform())
    if np.isfinite(table.base[along]):
        base = np.degrees(table.base[along]) if table.axes[along].unit == "rad" else table.base[along]
        if x.min() <= base <= x.max():
            ax.axvline(base, color=GREY, linewidth=0.7, linestyle=":")
    frame(ax, table.axes[along].label, _column_label(table, column), zero=column in ZERO_MATTERS)
    legend(ax)


def _contours(ax: Axes, table: SweepTable, column: str, values: Array) -> None:
    x, y = (np.array(axis.shown[0]) for axis in table.axes[:2])
    i, j = np.argsort(x), np.argsort(y)
    X, Y = np.meshgrid(x[i], y[j], indexing="ij")
    Z = np.ma.masked_invalid(values[np.ix_(i, j)])
    if Z.count() and float(np.ptp(Z.compressed())) > 0.0:
        filled = ax.contourf(X, Y, Z, levels=12, cmap="Blues", alpha=0.5)
        lines = ax.contour(X, Y, Z, levels=filled.levels, colors=FIT, linewidths=0.5, linestyles="solid")
        ax.clabel(lines, fontsize=6, fmt="%.3g")
        if column in ZERO_MATTERS and Z.min() < 0.0 < Z.max():
            ax.contour(X, Y, Z, levels=[0.0], colors=INK, linewidths=1.6)
    there = np.isfinite(values[np.ix_(i, j)])
    ax.plot(X[there], Y[there], ".", color=GREY, markersize=3)
    ax.plot(X[~there], Y[~there], "x", color=BAD, markersize=4)
    if np.isfinite(table.base[:2]).all():
        base = [np.degrees(b) if a.unit == "rad" else b for a, b in zip(table.axes, table.base[:2], strict=False)]
        if x.min() <= base[0] <= x.max() and y.min() <= base[1] <= y.max():
            ax.plot(*base, "s", markerfacecolor="none", markeredgecolor=INK, markersize=7)
    frame(ax, table.axes[0].label, table.axes[1].label, zero=False)
    ax.use_sticky_edges = False  # the points on the rim are to be seen whole
    ax.margins(0.03)
