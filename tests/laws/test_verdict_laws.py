"""The verdict against the linear model, and what it says about stable and unstable craft."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import TowtankError
from towtank.model.linear import elevator_reversal_speed, horizontal, stability_indices, vertical
from towtank.trials.steps import heading_step
from towtank.trials.straight import straight_run
from towtank.trials.zigzag import zigzag
from towtank.verdict.assess import assess
from towtank.verdict.criteria import index, plane_criteria, samples
from towtank.verdict.files import read_verdict, write_verdict


@pytest.fixture(scope="module")
def unstable():
    return synthetic.model(synthetic.SUBOFF, std=0.1)


@pytest.fixture(scope="module")
def stable():
    return synthetic.model(synthetic.STABLE, std=0.02)


def test_eigenvalues_are_those_of_the_linear_model(unstable, stable):
    for model in (unstable, stable):
        found = plane_criteria(model, "horizontal", 1.3).eigenvalues
        assert np.array(found) == pytest.approx(horizontal(model, 1.3).eigenvalues, rel=1e-9)
        pitching = vertical(model, 1.3, states=("w", "q", "theta"))
        found = plane_criteria(model, "vertical", 1.3).eigenvalues
        assert np.array(sorted(found, key=lambda s: (s.real, s.imag))) == pytest.approx(
            np.array(sorted(pitching.eigenvalues, key=lambda s: (s.real, s.imag))), rel=1e-9
        )


def test_indices_are_those_of_the_linear_model(unstable):
    expected = stability_indices(unstable, "wide")
    assert plane_criteria(unstable, "horizontal", 1.0).index == pytest.approx(expected.horizontal)
    assert plane_criteria(unstable, "vertical", 1.0).index == pytest.approx(expected.vertical)


def test_suboff_with_fins_is_unstable_by_the_published_index(unstable):
    # Roddy configuration 5 gives G_h = -3.15 with SUBOFF's own mass (m' 0.018144, xG' -0.0061); this craft has
    # m' = 0.01799 and xG = 0, which moves the index by a few per cent.
    assert plane_criteria(unstable, "horizontal", 1.0).index == pytest.approx(-3.152, rel=0.05)


def test_sign_of_the_index_and_of_the_eigenvalue_agree(unstable):
    drawn = samples(unstable, 400, "wide")
    from towtank.verdict.criteria import horizontal_matrix

    growth = np.linalg.eigvals(horizontal_matrix(unstable, drawn, 1.0)).real.max(axis=1)
    assert np.all((index(unstable, drawn, "horizontal") > 0.0) == (growth < 0.0))


def test_samples_have_the_covariance_of_the_derivatives(unstable):
    drawn = samples(unstable, 4000, "wide")
    value = unstable.derivatives["Nuv"]
    assert drawn["Nuv"][0] == pytest.approx(value)
    assert np.std(drawn["Nuv"][1:]) == pytest.approx(
        0.1 * abs(value), rel=0.05
    )  # 2 sigma of a standard deviation of 4000


def test_probability_follows_the_uncertainty():
    # Same best estimate near the boundary: sure when known well, a coin toss when not.
    edge = {**synthetic.STABLE, "Nuv": -0.0098}
    sharp, vague = (assess(synthetic.model(edge, std=s)).horizontal for s in (1e-4, 0.2))
    assert sharp.probability in (0.0, 1.0)
    assert 0.2 < vague.probability < 0.8
    assert sharp.index == pytest.approx(vague.index)


def test_origin_slopes_decide_when_there_are_any(unstable):
    model = synthetic.model(synthetic.STABLE)
    terms = {name: model.derivatives[name] for name in ("Yuv", "Nuv", "Yur", "Nur", "Zuw", "Muw", "Zuq", "Muq")}
    bent = replace(
        model.derivatives,
        origin={**terms, "Nuv": 4.0 * terms["Nuv"]},
        origin_std={name: 0.01 * abs(value) for name, value in terms.items()},
    )
    verdict = assess(model.with_derivatives(bent))
    assert verdict.horizontal.slopes == "origin"
    assert not verdict.horizontal.stable
    assert verdict.horizontal.index_wide > 0.0 > verdict.horizontal.index


def test_the_verdict_of_an_unstable_craft(unstable, tmp_path):
    trials = [straight_run(unstable), zigzag(unstable), heading_step(unstable)]
    verdict = assess(unstable, trials)
    growth = horizontal(unstable, 1.0).eigenvalues.real.max()
    assert not verdict.horizontal.stable
    assert verdict.horizontal.probability < 0.05
    assert verdict.horizontal.doubling == pytest.approx(np.log(2.0) / growth)
    assert "directionally unstable" in verdict.words
    assert "published" in verdict.words
    rows = {row.quantity: row for row in verdict.comparison}
    assert abs(rows["course held"].closed) < abs(rows["course held"].open)
    assert rows["overshoot"].closed < rows["overshoot"].open
    assert verdict.elevator_reversal_speed == pytest.approx(elevator_reversal_speed(unstable, "wide"))
    met = {need.name: need.met for need in verdict.requirements}
    assert met["pilot stable"]
    assert not met["horizontal plane stable, fins fixed"]
    path = write_verdict(verdict, tmp_path / "verdict.json")
    document = json.loads(path.read_text())
    assert {"eigenvalues", "G", "stable", "P_stable"} <= set(document["horizontal"])
    assert read_verdict(path) == verdict


def test_the_speed_at_which_the_vertical_plane_is_lost_is_told(unstable):
    verdict = assess(unstable)
    limit = next(c for c in verdict.criteria if c.name == "critical_speed")
    assert verdict.vertical.stable == (limit.value > 1.0)
    assert (f"Above {limit.value:.2f} m/s it is unstable" in verdict.words) == verdict.vertical.stable
    slower = replace(unstable, craft=replace(unstable.craft, speed=0.5 * limit.value))
    faster = replace(unstable, craft=replace(unstable.craft, speed=2.0 * limit.value))
    assert assess(slower).vertical.stable
    assert not assess(faster).vertical.stable


def test_the_verdict_of_a_stable_craft(stable):
    verdict = assess(stable)
    assert verdict.horizontal.stable
    assert verdict.horizontal.probability > 0.95
    assert verdict.horizontal.doubling < 0.0
    assert "directionally stable" in verdict.words
    assert verdict.effectiveness["yaw_acceleration_per_rudder"][0] < 0.0


def test_a_heavy_craft_is_told_from_which_speed_it_keeps_depth():
    verdict = assess(synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.5))
    need = next(r for r in verdict.requirements if r.name == "level flight")
    assert not need.met
    assert need.limit > 1.0
    assert "cannot keep depth" in verdict.words


def test_a_craft_without_fins_is_judged_too(unstable):
    bare = replace(unstable, craft=replace(unstable.craft, fins=()))
    verdict = assess(bare)
    assert not verdict.horizontal.stable
    assert verdict.effectiveness == {}


def test_trials_of_another_craft_are_refused(unstable):
    foreign = replace(straight_run(unstable), craft="another")
    with pytest.raises(TowtankError, match="another craft"):
        assess(unstable, [foreign])
