"""Figures of a grid study draw its numbers, name quantity and unit, and state level and bound."""

from __future__ import annotations

import functools
import inspect
from dataclasses import replace

import numpy as np
import pytest
from grid_cases import made
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from towtank.figures import grid as figures
from towtank.grid.study import GridStudy, grid_study

approx = pytest.approx
ORDER = 1.5


@functools.cache
def study() -> GridStudy:
    """Three meshes of known order; the third run's Y closes in nowhere."""
    sets = made(ORDER, (1.0, 1.4, 2.0), 0.03)
    swing = sets[1][2]
    sets[1][2] = replace(swing, loads=swing.loads * 1.2)
    return grid_study(sets, target=0.05)


def words(ax: Axes) -> str:
    return " ".join(text.get_text().replace("\n", " ") for text in (*ax.texts, *ax.get_xticklabels()))


def item(name: str):
    return next(item for item in study().quantities if item.name == name)


@pytest.mark.parametrize("name", ["drift Y steady", "sway N peak", "yaw N in phase"])
def test_points_bars_and_labels_are_those_of_the_quantity(name: str):
    ax, it = figures.convergence(study(), name), item(name)
    points = next(line for line in ax.lines if line.get_marker() == "o" and len(line.get_xdata()) == 3)
    assert points.get_xdata() == approx([2.0, 2.0 / 1.4, 1.0], rel=1e-4)  # cells are whole numbers
    assert points.get_ydata() == approx(it.values)
    bars = ax.containers[0][2][0].get_segments()
    assert [bar[1, 1] - bar[0, 1] for bar in bars] == approx(2.0 * it.estimate.uncertainty)
    assert f"{it.load} {it.measure} [{'N' if it.load in 'XYZ' else 'N m'}]" == ax.get_ylabel()
    assert "mesh size" in ax.get_xlabel()
    assert "known coefficient set" in words(ax)
    assert "95 % bound" in words(ax)
    assert it.estimate.verdict in words(ax)


def test_the_curve_runs_from_the_extrapolated_value_through_the_points():
    ax, it = figures.convergence(study(), "drift Y steady"), item("drift Y steady")
    curve = next(line for line in ax.lines if line.get_linestyle() == "--")
    x, y = (np.asarray(values) for values in curve.get_data())
    assert y[0] == approx(it.estimate.extrapolated)
    # A power law of one term holds all three points; straight pieces between 60 points bend off by 1e-4 of the change.
    assert np.interp([1.0, 2.0], x, y) == approx([it.values[-1], it.values[0]], rel=1e-3)


def test_the_chosen_mesh_is_ringed():
    ax = figures.convergence(study(), "drift Y steady")
    at = study().number(study().chosen)
    ring = next(line for line in ax.lines if line.get_fillstyle() == "none")
    assert ring.get_ydata() == approx([item("drift Y steady").values[at]])


def test_a_divergent_or_swinging_quantity_has_no_limit_drawn_that_it_does_not_have():
    name = next(q.name for q in study().quantities if not np.isfinite(q.estimate.extrapolated))
    ax = figures.convergence(study(), name)
    assert not [line for line in ax.lines if line.get_linestyle() == "--"]
    assert "divergent" in words(ax)


def test_bars_are_the_bounds_on_the_chosen_mesh_in_per_cent():
    ax, at = figures.bounds(study()), study().number(study().chosen)
    widths = {round(bar.get_y() + bar.get_height() / 2): bar.get_width() for bar in ax.patches}
    assert [widths[i] for i in range(len(study().quantities))] == approx(
        [100.0 * q.share(at) for q in study().quantities]
    )
    assert [label.get_text() for label in ax.get_yticklabels()] == [q.name for q in study().quantities]
    assert "%" in ax.get_xlabel()
    assert "known coefficient set" in words(ax)
    only = figures.bounds(study(), "peak")
    assert all(label.get_text().endswith("peak") for label in only.get_yticklabels())


def test_the_notable_are_the_least_certain_of_steady_and_peak():
    found = figures.notable(study(), 2)
    at = study().number(study().chosen)
    assert [item(name).measure for name in found] == ["steady", "peak"]
    for name in found:
        alike = [q for q in study().quantities if q.measure == item(name).measure]
        assert item(name).share(at) == max(q.share(at) for q in alike)


def test_figures_take_axes_and_give_them_back():
    own = Figure().add_subplot()
    assert figures.convergence(study(), "drift Y steady", ax=own) is own
    assert inspect.signature(figures.bounds).parameters["ax"].default is None


def test_an_unknown_quantity_is_named():
    with pytest.raises(ValueError, match="drift Y steady"):
        figures.convergence(study(), "drift Q steady")
