"""Symmetry, limits and bad input of the free-running trials, and their files."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import ArtefactError, InputError, TrialError
from towtank.trials.circle import turning_circle
from towtank.trials.files import read_trajectory, write_index, write_trajectory
from towtank.trials.integrate import Leg, free_run
from towtank.trials.mission import lawnmower
from towtank.trials.pullout import pull_out
from towtank.trials.standard import standard_trials
from towtank.trials.start import setting
from towtank.trials.steps import depth_step, heading_step
from towtank.trials.straight import straight_run
from towtank.trials.zigzag import zigzag


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.SUBOFF)


@pytest.fixture(scope="module")
def circle(craft):
    return turning_circle(craft, "20 deg")


def test_a_turn_to_port_mirrors_one_to_starboard(craft, circle):
    other = turning_circle(craft, "-20 deg")
    assert other.position[:, 1] == pytest.approx(-circle.position[:, 1], abs=1e-6)
    assert other.attitude[:, [0, 2]] == pytest.approx(-circle.attitude[:, [0, 2]], abs=1e-6)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter", "speed_loss"):
        assert other.indices[name][0] == pytest.approx(circle.indices[name][0], rel=1e-6)


def test_positive_rudder_turns_to_port_and_the_craft_drifts_outwards(circle):
    assert circle.attitude[-1, 2] < -3.0 * np.pi + 0.1
    assert circle.position[:, 1].min() < 0.0
    assert circle.indices["drift_angle"][0] < 0.0
    assert circle.indices["speed_loss"][0] > 0.0


def test_samples_are_uniform_and_the_marks_exact(circle):
    assert np.ptp(np.diff(circle.time)) < 1e-9
    marks = {m["leg"]: m["time"] for m in circle.provenance["marks"]}
    assert np.interp(marks["to 90 deg"], circle.time, np.abs(circle.attitude[:, 2])) == pytest.approx(
        np.pi / 2.0, abs=1e-4
    )


def test_a_rudder_without_effect_gives_a_status_not_an_endless_trial(craft):
    weak = craft.with_values(Yuudr=0.0, Nuudr=0.0, Nuv=-200.0, Nur=-30000.0)
    trial = zigzag(weak, hold_depth=False)
    assert "did not respond" in trial.status
    assert np.isnan(trial.indices["first_overshoot"][0])


def test_a_nose_that_goes_over_ends_the_trial_early(craft):
    topheavy = synthetic.model(synthetic.SUBOFF, zg=-0.3)
    trial = straight_run(topheavy, disturbance=0.0)
    s = setting(topheavy, None, piloted=False)
    start = s.state.copy()
    start[4] = 0.05
    helm = replace(s.helm, pilot=None)
    flight = free_run(topheavy, start, [Leg("fall", helm, 300.0)], thrust=s.thrust, interval=0.5)
    assert flight.status.startswith("ended early: pitch reached")
    assert np.all(np.isfinite(flight.state))
    assert np.all(np.isfinite(trial.position))


def test_a_motion_that_grows_without_bound_ends_the_trial_early(craft):
    # Resistance of the wrong sign: the speed runs away in finite time.
    wild = craft.with_values(Xuu=+400.0)
    s = setting(craft, None, piloted=False)
    flight = free_run(wild, s.state, [Leg("run", replace(s.helm, pilot=None), 1000.0)], thrust=50.0, interval=0.5)
    assert flight.status.startswith("ended early")
    assert np.all(np.isfinite(flight.state))


def test_a_heavy_craft_sinks_in_open_loop_and_says_how_far():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.5)
    trial = straight_run(heavy, disturbance=0.0)
    assert trial.indices["depth_change"][0] > 1.0
    assert any("Not trimmed" in note for note in trial.provenance["notes"])


def test_vertical_zigzag_swings_about_the_trim():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.02)
    trial = zigzag(heavy, "10 deg", "2 deg", plane="vertical")
    assert trial.status == "done"
    trimmed = trial.provenance["trim"]["pitch"]
    swing = np.degrees(trial.attitude[:, 1] - trimmed)
    assert swing.max() > 2.0
    assert swing.min() < -2.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: turning_circle(m, "60 deg"), "the limit of the fins"),
        (lambda m: turning_circle(m, 15), "Numbers without a unit are radians"),
        (lambda m: turning_circle(m, "0 deg"), "makes no turning circle"),
        (lambda m: turning_circle(m, "15 m"), "rudder"),
        (lambda m: zigzag(m, plane="sideways"), "horizontal"),
        (lambda m: zigzag(m, heading="-10 deg"), "positive"),
        (lambda m: pull_out(m, "0 deg"), "no turn"),
        (lambda m: heading_step(m, "0 deg"), "tells nothing"),
        (lambda m: heading_step(m, current=(2.0, 0.0, 0.0)), "not below the craft"),
        (lambda m: heading_step(m, current=(0.1, 0.0)), "three finite numbers"),
        (lambda m: depth_step(m, "0 m"), "tells nothing"),
        (lambda m: lawnmower(m, legs=0), "at least one leg"),
        (lambda m: lawnmower(m, spacing="1 m"), "turns take up"),
        (lambda m: straight_run(m, speed="-1 m/s"), "forward speed"),
    ],
)
def test_bad_input_is_refused_with_the_reason(craft, call, words):
    with pytest.raises(InputError, match=words):
        call(craft)


def test_a_start_that_is_not_finite_is_refused(craft):
    s = setting(craft, None, piloted=False)
    with pytest.raises(TrialError, match="finite"):
        free_run(craft, s.state * np.nan, [Leg("run", s.helm, 1.0)], thrust=1.0, interval=0.1)


def test_trajectories_and_their_index_come_back_from_disk(craft, circle, tmp_path):
    trial = heading_step(craft, lengths=5.0)
    index = json.loads(write_index([circle, trial], tmp_path).read_text())
    assert index["schema"] == "towtank/trials/1"
    assert [t["loop"] for t in index["trials"]] == ["open", "closed"]
    assert index["trials"][0]["indices"]["advance"]["unit"] == "m"
    back = read_trajectory(tmp_path / index["trials"][0]["file"])
    assert back.position == pytest.approx(circle.position)
    assert back.delta == pytest.approx(circle.delta)
    assert back.status == circle.status
    assert back.indices["advance"] == (pytest.approx(circle.indices["advance"][0]), "m")
    assert back.provenance["marks"] == circle.provenance["marks"]


def test_a_truncated_trajectory_is_refused(circle, tmp_path):
    path = write_trajectory(circle, tmp_path / "circle.nc")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(ArtefactError, match="not a whole"):
        read_trajectory(path)


def test_a_craft_without_fins_gets_the_straight_run_only(craft):
    bare = replace(craft, craft=replace(craft.craft, fins=()))
    trials = standard_trials(bare)
    assert [t.kind for t in trials] == ["straight run"]
    assert trials[0].delta.shape[1] == 0
