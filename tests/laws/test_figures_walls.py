"""Histograms of y+ and Courant number draw the shares that runs carry, and the report shows them beside the runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from grid_cases import made
from matplotlib.axes import Axes
from report_synthetic import runs as known_runs

from towtank.figures import walls
from towtank.grid.files import read_grid, write_grid
from towtank.grid.study import grid_study
from towtank.report.build import report
from towtank.report.of_rans import resolution, resolution_of_meshes
from towtank.report.pictures import Sketchbook
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, Distribution
from towtank.tank.run import Run

approx = pytest.approx


def carrying(run: Run, shift: int = 0) -> Run:
    """``run`` as if it came from OpenFOAM: shares that move by ``shift`` bins, and Courant numbers if it moves."""
    hull = tuple(np.roll([0.0, 0.0, 0.1, 0.2, 0.7, 0.0, 0.0], shift))
    fin = (0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0)
    courant = () if run.steady else tuple(np.roll([0.5, 0.3, 0.2, 0.0, 0.0, 0.0, 0.0], shift))
    one = Distribution({"hull": hull, "fin1": fin, "fin2": fin}, {"hull": 8.0, "fin1": 1.0, "fin2": 1.0}, courant)
    return replace(run, level="rans", provenance={**run.provenance, "health": {"distribution": one.document()}})


@cache
def rans() -> tuple[Run, ...]:
    return tuple(carrying(run, number % 2) for number, run in enumerate(known_runs()))


def bars(ax: Axes) -> dict[str, list[float]]:
    handles, labels = ax.get_legend_handles_labels()
    return {
        label: [bar.get_height() for bar in handle.patches]
        for handle, label in zip(handles, labels, strict=True)
        if hasattr(handle, "patches")
    }


def test_bars_are_the_mean_shares_and_sum_to_a_hundred():
    ax = walls.y_plus(walls.by_wall(rans()))
    found = bars(ax)
    assert found["fins"] == approx([0, 50, 50, 0, 0, 0, 0])
    rows = np.array(walls.by_wall(rans())["hull"])
    assert found["hull"] == approx(100.0 * rows.mean(axis=0))
    assert [sum(heights) for heights in found.values()] == approx([100.0, 100.0])
    assert [text.get_text() for text in ax.get_xticklabels()] == walls.bins(Y_PLUS)
    assert "share of the wall area [%]" in ax.get_ylabel()
    words = " ".join(text.get_text().replace("\n", " ") for text in ax.texts)
    assert "RANS" in words
    assert "whiskers: their range" in words


def test_only_moving_runs_have_a_courant_number_and_each_kind_its_bars():
    found = bars(walls.courant(walls.by_kind(rans())))
    assert set(found) == {run.kind for run in rans() if not run.steady}
    assert [sum(heights) for heights in found.values()] == approx([100.0] * len(found))


def test_bins_are_named_from_below_the_first_edge_to_above_the_last():
    assert walls.bins(COURANT) == ["< 0.1", "0.1-0.3", "0.3-1", "1-3", "3-10", "10-30", "> 30"]


def test_the_report_shows_histograms_and_table_beside_runs_in_openfoam_only(tmp_path):
    page = report(tmp_path / "rans.html", *(run for run in rans() if run.kind in ("sway", "turn"))).read_text()
    for words in ("y+ on the walls", "Courant number at the end of a run", "Resolution of the runs in OpenFOAM"):
        assert words in page
    assert resolution(known_runs(), Sketchbook()) == []
    before = [replace(run, level="rans", provenance={"health": {"cpu": 1.0}}) for run in known_runs()]
    assert resolution(before, Sketchbook()) == []


def test_the_table_gives_shares_in_ranges_and_a_dash_where_there_is_none():
    table = next(block for block in resolution(rans(), Sketchbook()) if hasattr(block, "rows"))
    rows = {row[0]: row for row in table.rows}
    drifts = [run for run in rans() if run.kind == "drift"]
    assert rows["drift"][1] == str(len(drifts))
    # Hull and fins by area, 8 to 2: below 5 a tenth, between 5 and 30 a tenth and 0.3 or 0.1 of the hull.
    assert rows["drift"][2] == "10"
    assert rows["drift"][3] == "18 to 34"
    assert rows["drift"][-3:] == ("-", "-", "-")
    assert rows["sway"][-1] == "0"


def test_a_mesh_study_keeps_the_shares_of_its_meshes_in_its_file(tmp_path):
    sets = [[carrying(run, number) for run in runs] for number, runs in enumerate(made(2.0, (1.0, 1.4, 2.0)))]
    study = read_grid(write_grid(grid_study(sets), tmp_path / "grid.json"))
    assert list(walls.by_mesh(study)) == [mesh.label for mesh in study.meshes]
    found = bars(walls.y_plus_of_meshes(study))
    assert found[study.meshes[0].label] == approx([0, 10, 18, 16, 56, 0, 0])
    assert [sum(v) for v in bars(walls.courant_of_meshes(study)).values()] == approx([100.0] * 3)
    assert len(resolution_of_meshes(study, Sketchbook())) == 2
    bare = grid_study(made(2.0, (1.0, 1.4, 2.0)))
    assert "distribution" not in bare.provenance
    assert resolution_of_meshes(bare, Sketchbook()) == []
