"""Symmetry, limits and bad input of the free-running trials, and their files."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.plan import Clock, Ended, Gauge, Leg, Stat
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.errors import ArtefactError, InputError
from towtank.report.build import report
from towtank.trials.circle import circle_ready, turning_circle
from towtank.trials.files import read_trajectory, write_index, write_trajectory
from towtank.trials.mission import lawnmower
from towtank.trials.pullout import pull_out, pull_out_ready
from towtank.trials.ready import fly_ready, readings, run_trial
from towtank.trials.standard import standard_trials
from towtank.trials.start import setting
from towtank.trials.steps import depth_step, heading_step
from towtank.trials.straight import straight_ready, straight_run
from towtank.trials.zigzag import zigzag, zigzag_ready


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


def test_a_nose_that_goes_over_is_flown_on():
    topheavy = synthetic.model(synthetic.SUBOFF, zg=-0.3)
    trial = straight_run(topheavy, disturbance=0.0)
    s = setting(topheavy, None, piloted=False)
    start = s.state.copy()
    start[4] = 0.05
    pitch = Gauge("theta", absolute=True)
    flights = fly(topheavy, at(start), [Leg("fall", s.orders(), 300.0)], thrust=s.thrust, gauges=[pitch])
    assert flights.over(pitch, Stat.HIGH)[0] > np.radians(85.0)
    assert flights.finished[0]
    assert np.all(np.isfinite(flights.state))
    assert np.linalg.norm(flights.state[0, 3:7]) == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.isfinite(trial.position))


def test_a_motion_that_grows_without_bound_ends_the_trial_early(craft):
    # Resistance of the wrong sign: the speed runs away in finite time.
    wild = craft.with_values(Xuu=+400.0)
    s = setting(craft, None, piloted=False)
    flights = fly(wild, at(s.state), [Leg("run", s.orders(), 1000.0)], thrust=50.0)
    assert flights.ended[0] in (Ended.TOO_FAST, Ended.NOT_FINITE)
    assert flights.end_time[0] < 1000.0
    assert np.all(np.isfinite(flights.state))
    trial = turning_circle(wild, "5 deg", hold_depth=False)
    assert trial.status.startswith("ended early: the ")
    assert np.isnan(trial.indices["yaw_rate"][0])
    assert np.all(np.isfinite(trial.position))


@pytest.fixture(scope="module")
def away():
    """A straight run whose thrust carries the craft away in its only leg."""
    model = synthetic.model(synthetic.STABLE)
    trial = straight_ready(model)
    return run_trial(model, replace(trial, setting=replace(trial.setting, thrust=3e4)))


def test_a_trial_without_a_finished_leg_has_no_index_but_how_long_it_lasted(away):
    assert "ran away" in away.status
    numbers = {name for name, (value, _) in away.indices.items() if not np.isnan(value)}
    assert numbers == {"duration"}
    assert {"fin_rms", "fin_saturation", "fin_travel", "depth_change"} < away.indices.keys()


def test_an_index_that_is_not_there_is_written_read_and_shown_as_none(away, tmp_path):
    index = json.loads(write_index([away], tmp_path).read_text())
    assert index["trials"][0]["indices"]["fin_rms"]["value"] is None
    assert np.isnan(read_trajectory(tmp_path / "straight.nc").indices["fin_rms"][0])
    page = report(tmp_path / "page.html", away).read_text()
    assert "ran away" in page
    assert not re.search(r">\s*nan\s*<", page)


def test_effort_before_a_craft_ran_away_is_that_of_the_legs_it_finished():
    model = synthetic.model(synthetic.STABLE)
    wild, trial = model.with_values(Xuu=+400.0), circle_ready(model, "15 deg")
    first = replace(trial.legs[0], name="first", within=4.0, until=None, required=False)
    trial = replace(trial, legs=(first, *trial.legs), read=lambda flights: {})
    flights = fly_ready(wild, trial)
    done = int(np.count_nonzero(~np.isnan(flights.mark_time[0])))
    assert flights.ended[0] in (Ended.TOO_FAST, Ended.NOT_FINITE)
    assert 0 < done < len(trial.legs)
    whole = fly_ready(wild, replace(trial, legs=trial.legs[:done]))
    assert whole.finished[0]
    got, wanted = readings(wild, trial, flights), readings(wild, trial, whole)
    for name in ("fin_rms", "fin_saturation", "fin_travel", "fin_largest", "depth_change", "largest_pitch"):
        assert got[name][0][0] == pytest.approx(wanted[name][0][0], rel=1e-9, abs=1e-12), name
    assert got["fin_rms"][0][0] > 1.0


def test_a_circle_that_does_not_go_round_says_how_far_it_got(craft):
    weak = synthetic.model({**synthetic.STABLE, "Nuudr": -2e-5, "Yuudr": 5e-5})
    trial = turning_circle(weak, "5 deg", hold_depth=False)
    assert "540 deg wanted" in trial.status
    assert np.isnan(trial.indices["time_to_360"][0])
    assert trial.indices["duration"][0] == pytest.approx(240.0 * 8.15, rel=1e-9)
    assert abs(trial.indices["yaw_rate"][0]) > 0.0


SHORT = {
    "circle": lambda m: turning_circle(m, "25 deg", "3 m/s"),
    "zigzag": lambda m: zigzag(m, "20 deg", "5 deg", "3 m/s"),
    "vertical zigzag": lambda m: zigzag(m, "10 deg", "2 deg", "3 m/s", plane="vertical"),
    "pull-out": lambda m: pull_out(m, "20 deg", "3 m/s"),
    "straight run": lambda m: straight_run(m, "3 m/s", lengths=5.0),
}


@pytest.mark.parametrize("kind", SHORT)
def test_the_compiled_loop_and_the_one_on_numpy_give_the_same_numbers(kind, monkeypatch):
    model = synthetic.model(synthetic.STABLE)
    usual = SHORT[kind](model)
    monkeypatch.setenv("TOWTANK_ENGINE", "numpy")
    plain = SHORT[kind](model)
    assert plain.provenance["engine"]["path"] == "numpy"
    assert plain.status == usual.status == "done"
    assert plain.indices.keys() == usual.indices.keys()
    for name, (value, unit) in usual.indices.items():
        # The path off a growing motion adds to round-off; 1e-9 leaves room for libraries of other machines.
        assert plain.indices[name] == (pytest.approx(value, rel=1e-9, abs=1e-9, nan_ok=True), unit), name


@pytest.mark.parametrize(
    "ready",
    [
        lambda m: circle_ready(m, "20 deg"),
        lambda m: zigzag_ready(m, "20 deg", "5 deg"),
        lambda m: zigzag_ready(m, "10 deg", "2 deg", plane="vertical"),
        lambda m: pull_out_ready(m, "20 deg"),
    ],
)
def test_many_craft_are_read_as_each_one_alone(ready):
    model = synthetic.model(synthetic.STABLE)
    trial = ready(model)
    # The last craft hardly answers its rudder: where it does not get, its numbers are not there.
    drawn = {n: model.derivatives[n] * np.array([1.0, 0.8, 0.01]) for n in ("Nuudr", "Muude", "Yuudr", "Zuude")}
    many = readings(model, trial, fly_ready(model, trial, Ensemble(3, drawn)))
    for i in range(3):
        one = model.with_values(**{name: float(values[i]) for name, values in drawn.items()})
        alone = readings(one, trial, fly_ready(one, trial))
        for name, (values, _) in alone.items():
            assert values.shape == (1,)
            # Packs have sines and cosines of their own, which differ from the C library's in the last digits.
            assert many[name][0][i] == pytest.approx(values[0], rel=1e-6, abs=1e-9, nan_ok=True), (name, i)


def test_the_marks_of_a_zigzag_are_its_indices(craft):
    trial = zigzag(craft, "20 deg", "20 deg")
    marks = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    heading = np.degrees(np.interp([marks[f"swing {i}"] for i in (1, 2, 3, 4)], trial.time, trial.attitude[:, 2]))
    # The record is a straight line between samples 0.4 s apart; the end of the last leg lies beyond its last sample.
    assert heading == pytest.approx([-20.0, 20.0, -20.0, 20.0], abs=0.01)
    assert trial.indices["initial_turning_time"][0] == marks["swing 1"]
    assert trial.indices["reach"][0] == marks["back 2"]
    assert trial.indices["period"][0] == marks["swing 4"] - marks["swing 2"]
    swung = (trial.time > marks["swing 1"]) & (trial.time < marks["back 2"])
    far = int(np.argmin(np.where(swung, trial.attitude[:, 2], np.inf)))
    assert trial.indices["first_overshoot"][0] == pytest.approx(-np.degrees(trial.attitude[far, 2]) - 20.0, abs=0.01)
    assert trial.indices["time_to_check_first"][0] == pytest.approx(trial.time[far] - marks["swing 1"], abs=0.4)


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
        (lambda m: heading_step(m, "180 deg"), "beyond 175 deg, .* shorter way round"),
        (lambda m: heading_step(m, "-180 deg"), "beyond 175 deg, .* shorter way round"),
        (lambda m: heading_step(m, "-175.1 deg"), "beyond 175 deg"),
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
    with pytest.raises(InputError, match="finite"):
        fly(craft, at(s.state * np.nan), [Leg("run", s.orders(), 1.0)], thrust=1.0, clock=Clock(0.1))


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
