"""The page says what was done to the runs: who was left out and why, both fits, the budget, the checks, the study."""

from dataclasses import replace

import numpy as np
import pytest
import report_synthetic as case
from derive_synthetic import SPEED, W0, campaign, fourfold_coefficients, loaded, make

from towtank.derive.derive import derive
from towtank.derive.study import frequency_study
from towtank.derive.verdicts import LIMITS
from towtank.plan.motion import Sway
from towtank.report import of_fit, of_frequency
from towtank.report.blocks import Picture, Table, Text
from towtank.report.pictures import Sketchbook
from towtank.report.study import Study, gather, read_study

PLANTED = "sway-more-2"


@pytest.fixture(scope="module")
def planted() -> Study:
    """A campaign of exact loads in which one sway run reads 60 % high."""
    more = [
        make(f"sway-more-{i}", Sway(SPEED, 0.2 * SPEED / (w * W0), w * W0))
        for i, w in enumerate(np.linspace(0.8, 1.8, 6))
    ]
    runs = loaded([*campaign(), *more], fourfold_coefficients(seed=2), noise=0.01)
    runs = [replace(run, loads=1.6 * run.loads) if run.name == PLANTED else run for run in runs]
    found = derive(runs)
    return gather([runs, found, frequency_study(runs, found)])


@pytest.fixture(scope="module")
def blocks(planted):
    return of_fit.fit(planted, Sketchbook("f")).blocks


def tables(blocks) -> dict[str, Table]:
    return {block.title: block for block in blocks if isinstance(block, Table)}


def words(blocks) -> str:
    return " ".join(block.words for block in blocks if isinstance(block, Text))


def test_the_planted_run_is_named_with_the_test_it_failed_and_the_limit(planted, blocks):
    row = tables(blocks)["Runs rejected or down-weighted"].rows[0]
    assert row[:2] == (PLANTED, "rejected")
    assert row[3].startswith("lack of fit")
    assert "lack of fit" in row[4]
    assert "% (10)" in row[4]
    worst = {row[0]: row[4] for row in tables(blocks)["Tests of the runs"].rows}
    assert worst["lack of fit"] == PLANTED
    accepted = sum(e["verdict"] == "accepted" for e in planted.derivatives.quality["screening"].values())
    assert f"1 rejected, {accepted} accepted" in words(blocks)


def test_its_loops_are_drawn_measured_and_modelled(blocks):
    drawn = [block for block in blocks if isinstance(block, Picture) and "trusted least" in block.caption]
    assert len(drawn) == 1
    assert f"Y against vdot, {PLANTED} (rejected)" in drawn[0].svg


def test_every_test_is_listed_with_its_limits(blocks):
    rows = tables(blocks)["Tests of the runs"].rows
    assert [row[0] for row in rows] == list(LIMITS)
    for row, limit in zip(rows, LIMITS.values(), strict=True):
        size = 100.0 if limit.unit == "%" else 1.0
        assert (float(row[5]), float(row[6])) == pytest.approx((size * limit.weigh, size * limit.reject))


def test_wide_fit_and_slope_stand_side_by_side_with_their_ranges(planted, blocks):
    rows = {row[0].split()[0]: row for row in tables(blocks)["Wide fit against slope at the origin"].rows}
    assert set(rows) == set(planted.derivatives.origin)
    assert rows["Nuv"][3] == "drift and incidence to 20 deg"
    assert "within 8.0 deg" in rows["Nuv"][6]
    # The widest turn of the campaign is r L / U = 0.5.
    assert rows["Nur"][3] == "r L/U and q L/U to 0.50"


def test_parts_of_the_budget_add_up_in_square(blocks):
    for row in tables(blocks)["Uncertainty budget"].rows:
        parts = [float(cell) for cell in row[1:4] if cell != "-"]
        # Cells are rounded to 0.1.
        assert np.hypot.reduce([0.0, *parts]) == pytest.approx(float(row[4]), abs=0.1)


def test_the_frequency_study_is_on_the_page(planted, blocks):
    rows = {row[1].split()[0]: row for row in tables(blocks)["Trends with frequency and amplitude"].rows}
    trend = next(t for t in planted.frequency.trends if t.term == "Yuv")
    assert float(rows["Yuv"][3]) == pytest.approx(trend.limit, rel=1e-3)
    assert PLANTED in [row[4] for row in tables(blocks)["Loops that the model misses most"].rows]
    assert "sway" in [row[0] for row in tables(blocks)["Recommended oscillations"].rows]
    drawn = [block for block in blocks if isinstance(block, Picture) and "single oscillations" in block.caption]
    assert "Yuv against frequency, sway" in drawn[0].svg


def test_a_gain_below_the_floor_is_not_sold():
    found = of_frequency.frequencies(Study(frequency=case.frequency()), Sketchbook("g"))
    assert tables(found)["What optional terms would buy"].rows == (("third-order", "turn, mixed", "19.0", "2.0"),)


def test_a_study_of_other_runs_is_told():
    other = replace(case.frequency(), provenance={"inputs": {"sway-1": "sway-1-ffffffff"}})
    found = of_frequency.frequencies(Study(runs=case.runs(), frequency=other), Sketchbook("h"))
    assert "made from other runs than these" in words(found)


def test_what_is_missing_is_told_with_its_remedy():
    assert "towtank derive" in words(of_fit.fit(Study(), Sketchbook("i")).blocks)
    found = of_fit.fit(Study(derivatives=case.derivatives()), Sketchbook("j")).blocks
    assert "were not screened" in words(found)
    assert "Frequency and amplitude were not studied" in words(found)
    assert words(found).count("towtank derive") == 2
    assert tables(found)["Runs that were not fitted"].rows[0][1:] == ("sway-2", "too violent for the test of this page")


def test_the_study_is_read_from_its_folder(tmp_path):
    from towtank.derive.study_files import write_frequencies

    write_frequencies(case.frequency(), tmp_path / "frequency.json")
    assert read_study(tmp_path).frequency.points[:6] == case.frequency().points[:6]
    (tmp_path / "frequency.json").write_text("{}")
    found = read_study(tmp_path)
    assert found.frequency is None
    assert found.problems[0][0] == "frequency"
