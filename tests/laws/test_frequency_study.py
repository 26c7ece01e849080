"""The frequency and amplitude study: what it must say of loads whose dependence on both is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import SPEED, W0, campaign, fourfold_coefficients, loaded, make

from towtank.derive.derive import derive
from towtank.derive.fourier import FIRST
from towtank.derive.study import SLOWEST, STEPS, TOLERANCE, frequency_study, loop_area
from towtank.derive.study_files import read_frequencies, study_table, write_frequencies
from towtank.errors import DeriveError
from towtank.plan.motion import Sway

VALUES = fourfold_coefficients(seed=4)
SAMPLED = 1e-4
"""32 samples a period fold the harmonics of |v| v from the 31st on into the first: 8/(3 pi) (3/31^3) of it."""
MANY = [(v, w) for v in (0.1, 0.2, 0.3) for w in (0.6, 1.0, 1.4, 1.8)]


def sways():
    return [make(f"sway-{v}-{w}", Sway(SPEED, v * SPEED / (w * W0), w * W0)) for v, w in MANY]


def bent(run, share):
    """A sway run whose first harmonics of Y and N are larger by ``share`` w'2."""
    if run.kind != "sway":
        return run
    frequency = 2.0 * math.pi / run.period / W0
    scale = np.ones(6)
    scale[[1, 5]] += share * frequency**2
    return replace(run, loads=run.loads * scale)


def study(share=0.0, noise=0.0, seed=0):
    rest = [run for run in campaign() if run.kind != "sway"]
    runs = [bent(run, share) for run in loaded([*rest, *sways()], VALUES, noise=noise, seed=seed)]
    return runs, frequency_study(runs, derive(runs))


def test_without_memory_each_run_gives_the_linear_term_plus_its_share_of_the_cross_flow():
    _, found = study()
    points = [point for point in found.points if point.kind == "sway" and point.term == "Yuv"]
    assert len(points) == len(MANY)
    for point in points:
        assert point.value == pytest.approx(VALUES["Yuv"] + FIRST * VALUES["Yvv"] * point.amplitude, rel=SAMPLED)
        assert point.std == pytest.approx(0.0, abs=1e-9 * abs(point.value))
        assert point.verdict == "accepted"


def test_the_limit_is_the_linear_term_and_the_growth_that_of_the_cross_flow():
    _, found = study()
    by = {trend.term: trend for trend in found.trends if trend.kind == "sway"}
    for load in "YN":
        trend = by[f"{load}uv"]
        assert trend.limit == pytest.approx(VALUES[f"{load}uv"], rel=SAMPLED)
        assert trend.growth == pytest.approx(FIRST * VALUES[f"{load}vv"], rel=SAMPLED)
        assert trend.bend == pytest.approx(0.0, abs=SAMPLED * abs(trend.limit))
        assert by[f"{load}vdot"].limit == pytest.approx(VALUES[f"{load}vdot"], rel=1e-8)


def test_a_trend_in_frequency_is_found_and_decides_what_is_recommended():
    share = 0.05
    _, found = study(share)
    trend = next(trend for trend in found.trends if trend.term == "Yvdot")
    assert trend.limit == pytest.approx(VALUES["Yvdot"], rel=1e-6)
    assert trend.bend == pytest.approx(share * VALUES["Yvdot"], rel=1e-6)
    assert trend.at(1.0, 0.0) == pytest.approx((1.0 + share) * VALUES["Yvdot"], rel=1e-6)
    advice = next(item for item in found.advice if item.kind == "sway")
    # Both parts of the harmonic grow alike, so it moves by the tolerance where share w'2 does; the part of |v| v in the
    # damping grows too, and is no part of the limit, so the recommended frequency is a little lower.
    assert advice.frequencies[-1] == pytest.approx(math.sqrt(TOLERANCE / share), rel=0.05)
    assert advice.frequencies == pytest.approx([advice.frequencies[-1] * step for step in STEPS], abs=1e-3)
    assert min(advice.frequencies) >= SLOWEST
    assert advice.amplitudes[-1] == pytest.approx(0.3, rel=1e-3)


def test_the_interval_holds_the_limit_in_most_noisy_campaigns():
    inside = total = 0
    for seed in range(12):
        _, found = study(noise=0.02, seed=seed)
        terms = ("Yvdot", "Nvdot", "Yuv", "Nuv")
        own = [trend for trend in found.trends if trend.kind == "sway" and trend.term in terms]
        inside += sum(trend.low <= VALUES[trend.term] <= trend.high for trend in own)
        total += len(own)
    # 45.6 of 48 are expected; below 41 has a chance of 1 in 100 (binomial).
    assert total == 48
    assert inside >= 41


def test_rejected_runs_are_shown_and_take_no_part_in_the_trend():
    runs, _ = study()
    name = "sway-0.2-1.4"
    planted = [replace(run, loads=2.0 * run.loads) if run.name == name else run for run in runs]
    found = frequency_study(planted, derive(planted))
    assert {point.verdict for point in found.points if point.run == name} == {"rejected"}
    trend = next(trend for trend in found.trends if trend.kind == "sway" and trend.term == "Yuv")
    assert trend.points == len(MANY) - 1
    assert trend.limit == pytest.approx(VALUES["Yuv"], rel=SAMPLED)


def test_loops_of_the_model_and_of_the_run_have_the_same_area_when_the_model_is_right():
    _, found = study()
    for loop in found.loops:
        assert loop.modelled == pytest.approx(loop.measured, rel=1e-6, abs=1e-9)
        assert loop.misfit < 1e-9
    # Added mass alone opens a loop: Y = Yvdot vdot runs round v with the area pi Yvdot w v_a^2.
    loop = next(loop for loop in found.loops if loop.run == "sway-0.1-1.0" and loop.load == "Y")
    assert abs(loop.measured) == pytest.approx(math.pi * W0 * (0.1 * SPEED) ** 2 * abs(VALUES["Yvdot"]), rel=0.01)


def test_the_area_of_a_circle_and_its_sense():
    t = np.linspace(0.0, 2.0 * math.pi, 1001)[:-1]
    assert loop_area(np.cos(t), np.sin(t)) == pytest.approx(math.pi, rel=1e-4)
    assert loop_area(np.cos(t), -np.sin(t)) == pytest.approx(-math.pi, rel=1e-4)


def test_optional_terms_that_the_loads_hold_are_worth_their_name():
    values = VALUES | {"Yvvr": 0.3 * VALUES["Yvv"] * 8.0, "Nvrr": 0.3 * VALUES["Nvv"] * 64.0}
    runs = loaded(campaign(), values)
    found = frequency_study(runs, derive(runs))
    gain = next(gain for gain in found.gains if (gain.group, gain.kind) == ("third-order", "turn, mixed"))
    assert gain.within < 0.2 * gain.without


def test_files_keep_the_study(tmp_path):
    _, found = study(noise=0.01)
    again = read_frequencies(write_frequencies(found, tmp_path / "frequency.json"))
    assert again.points == found.points
    assert again.advice == found.advice
    assert study_table(again) == study_table(found)


def test_a_campaign_without_oscillations_is_told_so():
    runs = loaded([run for run in campaign() if run.steady], VALUES)
    with pytest.raises(DeriveError, match="no oscillation"):
        frequency_study(runs, derive(runs))
