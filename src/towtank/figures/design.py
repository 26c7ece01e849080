"""A design study drawn: lines over one change, contours over two, stability against drag, energy against speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from towtank.design.cruise import Cruise, Flight
from towtank.design.study import DesignStudy, Point
from towtank.figures.paper import BAD, FIT, GREY, INK, OK, ORIGIN, frame, head, legend, new_axes, note

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0)
"""P(stable) between the fills."""
WORDS = "P(stable): share of the sampled derivatives"


def design_line(study: DesignStudy, name: str, ax: Axes | None = None) -> Axes:
    """P(stable) of both planes over one axis, the others as given; at each point the change of drag.

    Variants that could not be built carry a cross at the foot.
    """
    ax = new_axes(ax, width=4.2, height=3.0)
    line = study.line(name)
    axis = next(axis for axis in study.axes if axis.name == name)
    unit = np.degrees(1.0) if axis.unit == "rad" else 1.0
    held = [(unit * value, point) for value, point in line if not point.failed]
    x, points = np.array([value for value, _ in held]), [point for _, point in held]
    for column, colour, words in (("P_stable_v", OK, "vertical plane"), ("P_stable_h", FIT, "horizontal plane")):
        ax.plot(x, [p.values[column] for p in points], "o-", color=colour, markersize=3, linewidth=1.2, label=words)
    lost = unit * np.array([value for value, point in line if point.failed])
    ax.plot(lost, np.full(len(lost), 0.03), "x", color=BAD, markersize=4, transform=ax.get_xaxis_transform())
    ax.axhline(study.target, color=GREY, linewidth=0.8, linestyle="--")
    if np.isfinite(study.given[name]):
        ax.axvline(unit * study.given[name], color=GREY, linewidth=0.7, linestyle=":")
    apart = 0.09 * float(np.ptp(x)) if len(x) else 0.0
    told = -np.inf
    for value, point in held:
        if value - told >= apart:
            words = f"{100.0 * study.drag_rise(point):+.1f} %"
            note(ax, words, (value, point.values["P_stable_h"]), (0.0, -9.0), color=ORIGIN, ha="center")
            told = value
    ax.set_ylim(-0.08, 1.08)
    frame(ax, axis.label, "P(stable)", zero=False)
    beside = tuple(item for item in (points[-1].changes if points else ()) if item[0] != name)
    more = f"; with {Point(beside).words(study.axes)}" if beside else ""
    head(ax, f"{name} alone", study.level, f"{WORDS}; numbers: change of drag; dashed: {study.target:g}{more}")
    legend(ax)
    return ax


def design_contours(study: DesignStudy, column: str = "P_stable_h", ax: Axes | None = None) -> Axes:
    """``column`` over the first two axes as fills, drag as lines; the square is the craft as given.

    A star is the best point, where it changes these two axes only. Crosses: no result.
    """
    ax = new_axes(ax, width=4.4, height=3.4)
    first, second = study.axes[:2]
    x, y = (np.array(axis.shown[0]) for axis in (first, second))
    X, Y = np.meshgrid(x, y, indexing="ij")
    Z, drag = study.grid(column), study.grid("drag")
    there = np.isfinite(Z)
    base = study.base.values["drag"]
    if there.sum() > 3 and min(Z.shape) > 1:
        levels = LEVELS if column.startswith("P_") else 10
        filled = ax.contourf(X, Y, np.ma.masked_invalid(Z), levels=levels, cmap="Blues", alpha=0.25)
        edges = ax.contour(X, Y, np.ma.masked_invalid(Z), levels=filled.levels, colors=FIT, linewidths=0.5)
        ax.clabel(edges, fontsize=6.5, fmt="%.3g", colors=INK)
        if column.startswith("P_") and float(np.nanmin(Z)) < study.target < float(np.nanmax(Z)):
            ax.contour(X, Y, np.ma.masked_invalid(Z), levels=[study.target], colors=INK, linewidths=1.6)
        rise = np.ma.masked_invalid(100.0 * (drag / base - 1.0))
        lines = ax.contour(X, Y, rise, levels=6, colors=ORIGIN, linewidths=0.8, linestyles="--")
        ax.clabel(lines, fontsize=6.5, fmt="%+.3g %%")
    ax.plot(X[there], Y[there], ".", color=GREY, markersize=2.5)
    ax.plot(X[~there], Y[~there], "x", color=BAD, markersize=4)
    _mark(ax, study)
    frame(ax, first.label, second.label, zero=False)
    ax.use_sticky_edges = False
    ax.margins(0.03)
    title = {"P_stable_h": "P(stable), horizontal plane", "P_stable_v": "P(stable), vertical plane"}.get(column, column)
    head(ax, title, study.level, f"other axes as given; heavy line: {study.target:g}; dashed: drag over that as given")
    return ax


def _mark(ax: Axes, study: DesignStudy) -> None:
    """The craft as given, and the best point where it lies in this plane."""
    scale = [np.degrees(1.0) if axis.unit == "rad" else 1.0 for axis in study.axes[:2]]
    names = [axis.name for axis in study.axes[:2]]

    def place(point: Point) -> tuple[float, float]:
        changed = dict(point.changes)
        a, b = (s * changed.get(name, study.given[name]) for s, name in zip(scale, names, strict=True))
        return a, b

    home = place(study.base)
    if np.isfinite(home).all():
        ax.plot(*home, "s", markerfacecolor="none", markeredgecolor=INK, markersize=7)
    if study.best is not None and {name for name, _ in study.best.changes} <= set(names):
        ax.plot(*place(study.best), "*", color=BAD, markersize=9)


def design_pareto(study: DesignStudy, ax: Axes | None = None) -> Axes:
    """P(stable), the lesser of both planes, against drag: all points, the Pareto set, as given, and the best."""
    ax = new_axes(ax, width=4.4, height=3.2)

    def at(points: tuple[Point, ...]) -> tuple[list[float], list[float]]:
        return [100.0 * study.drag_rise(p) for p in points], [p.values["P_stable"] for p in points]

    ax.plot(*at(study.done), ".", color=GREY, markersize=3.5, label="variants")
    ax.plot(*at(study.pareto), "o-", color=FIT, markersize=3, linewidth=1.2, label="Pareto set")
    ax.plot(*at((study.base,)), "s", markerfacecolor="none", markeredgecolor=INK, markersize=7, label="as given")
    if study.best is not None:
        ax.plot(*at((study.best,)), "*", color=BAD, markersize=10, label="best")
    ax.axhline(study.target, color=GREY, linewidth=0.8, linestyle="--")
    frame(ax, "drag, change [%]", "P(stable), lesser of both planes", zero=False)
    head(ax, "Stability against drag", study.level, f"{WORDS}, {len(study.done)} variants; dashed: {study.target:g}")
    legend(ax)
    return ax


def cruise_energy(found: Cruise, ax: Axes | None = None) -> Axes:
    """Energy per metre over ground against speed through the water, as loaded and ballasted to neutral."""
    ax = new_axes(ax, width=4.4, height=3.2)
    for flights, best, colour, words in (
        (found.neutral, found.best_neutral, FIT, "ballasted to neutral"),
        (found.loaded, found.best, ORIGIN, "as loaded"),
    ):
        _curve(ax, flights, best, colour, words)
    ax.axvline(found.closed, color=GREY, linewidth=0.8, linestyle=":")
    top = 4.0 * found.best_neutral.energy
    ax.set_ylim(0.0, max(top, 1.3 * found.best.energy if found.best else 0.0))
    frame(ax, "speed through the water [m/s]", "energy per metre over ground [J/m]", zero=False)
    words = (
        f"hotel {found.hotel:g} W, current {found.current:+g} m/s; dotted: neutral craft in still water, closed form"
    )
    band = (
        f"+-{100.0 * found.energy_std:.1f} % at the minimum by the drag alone" if np.isfinite(found.energy_std) else ""
    )
    head(ax, "Energy per metre", found.level, f"{words}; {band or 'no uncertainty stated'}")
    legend(ax)
    return ax


def _curve(ax: Axes, flights: tuple[Flight, ...], best: Flight | None, colour: str, words: str) -> None:
    if best is not None:
        held = sorted((*flights, best), key=lambda f: f.speed)
        ax.plot([f.speed for f in held], [f.energy for f in held], "-", color=colour, linewidth=1.3, label=words)
        ax.plot(best.speed, best.energy, "o", color=colour, markersize=5)


def design_sheet(study: DesignStudy) -> Figure:
    """Stability against drag, contours over the first two axes, and a line for every axis."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    lines = [axis.name for axis in study.axes if len([p for _, p in study.line(axis.name) if not p.failed]) > 1]
    top = 2 if len(study.axes) > 1 else 1
    columns = max(top, min(len(lines), 3))
    rows = 1 + -(-len(lines) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.7 * rows))
    FigureCanvasAgg(figure)

    def cell(row: int, column: int) -> Axes:
        width, height = 1.0 / columns, 1.0 / rows
        return figure.add_axes(
            ((column + 0.16) * width, 1.0 - (row + 1) * height + 0.14 * height, 0.80 * width, 0.66 * height)
        )

    design_pareto(study, cell(0, 0))
    if top > 1:
        design_contours(study, "P_stable_h", cell(0, 1))
    for i, name in enumerate(lines):
        design_line(study, name, cell(1 + i // columns, i % columns))
    return figure
