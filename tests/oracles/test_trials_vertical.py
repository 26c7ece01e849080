"""Meander and steep dive against the linear vertical plane, and against their own records."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import StateSpace, argrelextrema, lsim

import synthetic_craft as synthetic
from towtank.errors import InputError
from towtank.model.linear import linearise
from towtank.trials.vertical import meander, steep_dive

LINEAR = {**synthetic.STABLE, "Yvv": 0.0, "Nvv": 0.0, "Nrr": 0.0, "Xvr": 0.0, "Xrr": 0.0, "Xuudd": 0.0}
SPEED = "3 m/s"


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


def test_a_small_meander_is_the_free_response_of_the_linear_plane():
    model = synthetic.model(LINEAR, zg=0.3)
    trial = meander(model, "1 deg", "0.3 deg", SPEED)
    plane = linearise(model, 3.0).part(("w", "q", "theta"), ("elevator",))
    lag = model.craft.fins[0].time_constant
    A = np.zeros((4, 4))
    A[:3, :3], A[:3, 3], A[3, 3] = plane.A, plane.B[:, 0], -1.0 / lag
    time = np.linspace(0.0, trial.time[-1], 20001)
    asked = np.where(time < trial.indices["time_to_execute"][0], np.radians(1.0), 0.0)
    system = StateSpace(A, np.array([[0.0], [0.0], [0.0], [1.0 / lag]]), np.eye(4), np.zeros((4, 1)))
    theta = np.degrees(lsim(system, asked, time)[1][:, 2])
    turns = np.sort(np.concatenate([argrelextrema(theta, way)[0] for way in (np.less, np.greater)]))[:3]
    # The command is held over a tick of 0.1 s, and the speed falls by 0.1 %: 2 % of the largest excursion.
    for name, turn in zip(("first", "second", "third"), turns, strict=True):
        got = trial.indices[f"{name}_excursion"][0]
        assert got == pytest.approx(-theta[turn], abs=0.02 * np.abs(theta).max()), name
    assert trial.indices["period"][0] == pytest.approx(time[turns[2]] - time[turns[0]], rel=0.02)
    # The period of the eigenvalue is that between excursions once the faster motion is over.
    assert trial.indices["period"][0] == pytest.approx(trial.indices["period_linear"][0], rel=0.05)
    assert trial.indices["damping_ratio"][0] == pytest.approx(trial.indices["damping_ratio_linear"][0], abs=0.1)


def test_the_numbers_of_a_meander_are_those_of_its_record(craft):
    trial = meander(craft, "10 deg", "5 deg", SPEED)
    begin = trial.indices["time_to_execute"][0]
    pitch = -np.degrees(trial.attitude[:, 1])
    assert np.interp(begin, trial.time, pitch) == pytest.approx(5.0, abs=0.02)
    assert trial.indices["pitch_overshoot"][0] == pytest.approx(pitch.max() - 5.0, abs=0.02)
    after = trial.time > begin
    # Samples are 0.14 s apart.
    half = trial.time[after & (pitch < 2.5)][0] - begin
    assert trial.indices["time_to_half_pitch"][0] == pytest.approx(half, abs=0.2)
    assert trial.indices["depth_excursion"][0] == pytest.approx(np.abs(trial.position[:, 2]).max(), rel=0.01)
    # The elevator is over until the execute angle and amidships from then on.
    assert np.degrees(trial.command[trial.time < begin, 1]) == pytest.approx(10.0)
    assert trial.command[trial.time > begin, 1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("given", [("10 deg", "5 deg"), ("10 deg", "2 deg")])
def test_nose_up_is_the_mirror_of_nose_down(craft, given):
    down, up = meander(craft, *given, SPEED), meander(craft, f"-{given[0]}", given[1], SPEED)
    # The CG lies low, so that pitching one way speeds the craft up and the other way slows it down: 0.3 %.
    for name in ("time_to_execute", "first_excursion", "time_to_half_pitch", "period", "depth_excursion"):
        assert up.indices[name][0] == pytest.approx(down.indices[name][0], rel=0.01), name


def test_a_craft_that_is_not_stable_in_pitch_does_not_come_back():
    loose = synthetic.model(synthetic.SUBOFF, zg=0.001)
    assert linearise(loose, 3.0).part(("w", "q", "theta"), ("elevator",)).eigenvalues.real.max() > 0.0
    trial = meander(loose, "5 deg", "2 deg", SPEED)
    assert "not stable in pitch at 3 m/s" in trial.status
    assert np.isnan(trial.indices["period"][0])


def test_a_pitch_that_goes_over_has_no_excursions():
    loose = synthetic.model({**synthetic.SUBOFF, "Nuv": -0.016}, zg=0.001)
    trial = meander(loose, "10 deg", "5 deg", SPEED)
    assert trial.indices["largest_pitch"][0] > 60.0
    assert "went beyond 60 deg; the craft is not stable in pitch" in trial.status
    assert np.isnan(trial.indices["first_excursion"][0])


def test_a_craft_that_flies_nose_up_dives_from_its_trim_and_levels_to_it():
    heavy = synthetic.model(synthetic.STABLE, net_buoyancy=-0.2)
    trial = steep_dive(heavy, "15 deg", "10 m", "2 m/s")
    trimmed = np.degrees(trial.provenance["trim"]["pitch"])
    assert trimmed > 1.0
    assert trial.status == "done"
    # The cross-flow takes a tenth of the pitch ordered; level, nothing is left but the decay of 10 lengths.
    assert trial.indices["pitch_reached"][0] == pytest.approx(15.0, rel=0.15)
    assert np.degrees(trial.attitude[-1, 1]) == pytest.approx(trimmed, abs=0.1)
    assert np.degrees(trial.setpoint["pitch"][0]) == pytest.approx(trimmed - 15.0)


def test_an_elevator_too_weak_for_the_angle_says_how_far_it_got(craft):
    trial = meander(craft, "10 deg", "5 deg")
    assert "did not respond" in trial.status
    assert "of the 5 deg" in trial.status


@pytest.mark.parametrize("angle", ["30 deg", "-30 deg"])
def test_a_dive_under_the_pilot_is_that_of_its_record(craft, angle):
    trial, side = steep_dive(craft, angle, "20 m", SPEED), 1.0 if angle[0] != "-" else -1.0
    assert trial.status == "done"
    assert trial.loop == "closed"
    marks = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    depth = side * trial.position[:, 2]
    assert np.interp(marks["dive"], trial.time, depth) == pytest.approx(20.0, abs=0.02)
    assert trial.indices["depth_of_dive"][0] == pytest.approx(20.0, abs=1e-6)
    assert trial.indices["depth_overshoot"][0] == pytest.approx(depth.max() - 20.0, abs=0.01)
    assert trial.indices["time_to_check_depth"][0] == marks["recover"] - marks["dive"]
    steep = -side * np.degrees(trial.attitude[:, 1])
    assert trial.indices["pitch_reached"][0] == pytest.approx(steep.max(), abs=0.02)
    assert trial.indices["recovery_pitch_overshoot"][0] == pytest.approx(-steep.min(), abs=0.02)
    speed = np.linalg.norm(trial.nu[:, :3], axis=1)
    assert trial.indices["lowest_speed"][0] == pytest.approx(speed.min(), rel=1e-3)
    # No depth is asked for while a pitch is.
    assert np.isnan(trial.setpoint["depth"]).all()
    assert np.degrees(trial.setpoint["pitch"][0]) == pytest.approx(-30.0 * side)


def test_without_a_low_centre_of_gravity_a_climb_is_the_mirror_of_a_dive_in_both_loops():
    craft = synthetic.model(synthetic.STABLE, zg=0.0)
    for more in ({}, {"elevator": "20 deg"}):
        down, up = (steep_dive(craft, angle, None, SPEED, **more) for angle in ("15 deg", "-15 deg"))
        assert up.position[:, 2] == pytest.approx(-down.position[:, 2], abs=1e-6)
        assert up.loop == ("open" if more else "closed")
        for name, (value, unit) in down.indices.items():
            sign = -1.0 if name == "depth_change" else 1.0
            assert up.indices[name] == (pytest.approx(sign * value, rel=1e-6, abs=1e-9), unit), name


def test_the_vertical_overshoot_reverses_the_elevator_at_the_execute_angle(craft):
    trial = steep_dive(craft, "10 deg", None, SPEED, elevator="20 deg")
    marks = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    assert -np.degrees(np.interp(marks["dive"], trial.time, trial.attitude[:, 1])) == pytest.approx(10.0, abs=0.05)
    over = np.degrees(trial.command[:, 1])
    assert over[trial.time < marks["dive"]] == pytest.approx(20.0)
    assert over[trial.time > marks["dive"]] == pytest.approx(-20.0)
    assert trial.indices["pitch_overshoot"][0] > 0.2
    assert trial.indices["depth_overshoot_lengths"][0] == pytest.approx(trial.indices["depth_overshoot"][0] / 8.15)


def test_below_the_inversion_speed_the_depth_goes_the_other_way_and_the_status_says_why(craft):
    # At 1 m/s the righting moment outweighs the fins of this craft.
    trial = steep_dive(craft, "20 deg", "5 m")
    assert "inversion speed of the elevator" in trial.status
    assert trial.indices["depth_change"][0] < 0.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: meander(m, "0 deg"), "moves nothing"),
        (lambda m: meander(m, "40 deg"), "limit of the fins"),
        (lambda m: meander(m, "10 deg", "-5 deg"), "positive one"),
        (lambda m: meander(m, "10 deg", "70 deg"), "is a loop"),
        (lambda m: steep_dive(m, "0 deg"), "is no dive"),
        (lambda m: steep_dive(m, "70 deg"), "beyond 60 deg"),
        (lambda m: steep_dive(m, "30 deg", "-5 m"), "Give a positive one"),
        (lambda m: steep_dive(m, elevator="0 deg"), "moves nothing"),
    ],
)
def test_bad_input_is_refused_with_the_reason(craft, call, words):
    with pytest.raises(InputError, match=words):
        call(craft)
