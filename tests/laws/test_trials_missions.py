"""Waypoint missions: currents, mirrors, speeds, energy, and why a mission is not completed."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.run import Ensemble
from towtank.errors import InputError
from towtank.trials.mission import lawnmower
from towtank.trials.ready import fly_ready, readings
from towtank.trials.waypoints import Waypoint, waypoint_mission, waypoint_mission_ready

ROUND = (Waypoint("40 L", 0.0, "3 m"), Waypoint("40 L", "25 L", "3 m", "3.5 m/s"), ("70 L", "40 L", "6 m"))


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


def _marks(trial):
    return {m["leg"]: m["time"] for m in trial.provenance["marks"]}


def test_a_mission_passes_its_waypoints_at_their_depths(craft):
    trial = waypoint_mission(craft, ROUND, "3 m/s")
    assert trial.status == "done"
    assert trial.loop == "closed"
    # The last waypoint is passed abeam, where the mission ends: between two samples of 0.3 s.
    assert trial.position[-1, :2] == pytest.approx([70.0 * 8.15, 40.0 * 8.15], abs=0.5 * 8.15)
    assert trial.position[-1, 2] == pytest.approx(6.0, abs=0.5)
    assert trial.indices["off_track_rms"][0] < 8.15
    track = trial.provenance["curves"]["track"]
    assert track["depth"] == [0.0, 3.0, 3.0, 6.0]
    assert np.array(track["north"]) == pytest.approx(np.array([0.0, 40.0, 40.0, 70.0]) * 8.15)
    # A depth is asked for from the start of its leg.
    asked = trial.setpoint["depth"]
    assert asked[0] == 3.0
    assert asked[-1] == 6.0


def test_to_the_west_is_the_mirror_of_to_the_east_in_a_mirrored_current(craft):
    east = waypoint_mission(craft, [(300.0, 100.0), (500.0, -50.0)], "3 m/s", current=(0.3, 0.5, 0.0))
    west = waypoint_mission(craft, [(300.0, -100.0), (500.0, 50.0)], "3 m/s", current=(0.3, -0.5, 0.0))
    assert west.position[:, 1] == pytest.approx(-east.position[:, 1], abs=1e-6)
    for name, (value, unit) in east.indices.items():
        assert west.indices[name] == (pytest.approx(value, rel=1e-6, abs=1e-9), unit), name


@pytest.mark.parametrize("current", [(0.0, 0.8, 0.0), (0.5, 0.8, 0.0), (-0.7, 0.0, 0.0)])
def test_on_a_line_the_craft_heads_into_the_current_and_makes_good_what_is_left(craft, current):
    trial = waypoint_mission(craft, [("150 L", 0.0)], "3 m/s", current=current)
    marks, length = _marks(trial), 150.0 * 8.15
    made_good = 0.5 * length / (marks["leg 1"] - marks["leg 1 coming on"])
    # The triangle of velocities; the rudder angle that is left and the way onto the line cost 0.2 % of the speed.
    assert made_good == pytest.approx(math.sqrt(9.0 - current[1] ** 2) + current[0], rel=0.005)
    heading = math.degrees(trial.attitude[-1, 2])
    assert heading == pytest.approx(-math.degrees(math.asin(current[1] / 3.0)), abs=0.3)
    assert trial.indices["off_track_rms"][0] < 0.5


def test_far_along_a_line_a_mission_in_a_current_is_one_in_still_water_seen_from_the_water(craft):
    moving = waypoint_mission(craft, [("150 L", 0.0)], "3 m/s", current=(0.4, 0.6, 0.0))
    still = waypoint_mission(craft, [("150 L", 0.0)], "3 m/s")
    water = np.array([0.4, 0.6, 0.0])

    def through_water(trial, current):
        rows = trial.time > _marks(trial)["leg 1 coming on"] + 20.0
        speed = np.linalg.norm(np.gradient(trial.position[rows], trial.time[rows], axis=0) - current, axis=1)
        return speed[3:-3]

    # No force knows of the current: straight flight through the water is the same to 1e-4.
    assert through_water(moving, water).mean() == pytest.approx(through_water(still, 0.0).mean(), rel=1e-3)
    assert abs(moving.nu[-1, 5]) < 1e-4
    assert np.abs(moving.delta[-1]).max() < np.radians(0.2)


def test_the_throttle_makes_the_speed_of_each_leg(craft):
    trial = waypoint_mission(craft, [("80 L", 0.0), ("200 L", 0.0, 0.0, "2.5 m/s")], "3 m/s")
    throttle = trial.setpoint["throttle"]
    assert throttle[0] == 1.0
    assert throttle[-1] == pytest.approx((2.5 / 3.0) ** 2)
    # After 120 lengths the speed has come within 1 % of its new value: 13 lengths are the scale of surge.
    assert trial.nu[-1, 0] == pytest.approx(2.5, rel=0.01)
    # Straight on there is no turn to begin early.
    assert np.interp(_marks(trial)["leg 1"], trial.time, trial.position[:, 0]) == pytest.approx(80.0 * 8.15, abs=0.01)


def test_the_work_of_the_thrust_is_thrust_times_way_through_the_water(craft):
    still = waypoint_mission(craft, [("100 L", 0.0)], "3 m/s")
    thrust = craft.thrust(3.0)
    assert still.indices["thrust_energy"][0] == pytest.approx(thrust * still.indices["distance"][0], rel=1e-4)
    assert still.indices["thrust_energy_per_distance"][0] == pytest.approx(thrust, rel=1e-4)
    # With the current the same place takes less work: the way through the water is shorter by 3 / 3.6.
    helped = waypoint_mission(craft, [("100 L", 0.0)], "3 m/s", current=(0.6, 0.0, 0.0))
    assert helped.indices["thrust_energy"][0] == pytest.approx(still.indices["thrust_energy"][0] * 3.0 / 3.6, rel=1e-3)
    assert helped.indices["mean_speed"][0] == pytest.approx(3.6, rel=1e-3)


def test_a_lawnmower_is_a_mission_along_its_track(craft):
    mown = lawnmower(craft, 2, "40 L", "20 L", speed="3 m/s")
    track = mown.provenance["curves"]["track"]
    corners = list(zip(track["north"], track["east"], strict=True))[1:]
    flown = waypoint_mission(craft, corners, "3 m/s")
    first, second = _marks(mown), _marks(flown)
    # The same lines, turns and orders. Half of a short line is a mark of the mission and cuts a tick there: 1e-5 s.
    # Only the last line of a mission goes to its end.
    for name in list(first)[:-1]:
        assert second[name] == pytest.approx(first[name], abs=1e-3), name


def test_the_numbers_of_a_mission_are_those_of_its_record(craft):
    trial = waypoint_mission(craft, ROUND, "3 m/s", current=(0.1, -0.2, 0.0))
    marks, track = _marks(trial), trial.provenance["curves"]["track"]
    corners = np.array([track["north"], track["east"]]).T
    squares, lasting, farthest = 0.0, 0, 0.0
    for i, (a, b) in enumerate(pairwise(corners), start=1):
        on = (trial.time >= marks[f"leg {i} coming on"]) & (trial.time <= marks[f"leg {i}"])
        along = (b - a) / np.linalg.norm(b - a)
        off = (trial.position[on, :2] - a) @ np.array([-along[1], along[0]])
        squares, lasting, farthest = squares + (off**2).sum(), lasting + on.sum(), max(farthest, np.abs(off).max())
    assert trial.indices["off_track_rms"][0] == pytest.approx(math.sqrt(squares / lasting), rel=0.03)
    assert trial.indices["off_track_largest"][0] == pytest.approx(farthest, rel=0.03)
    ends = [np.interp(marks[f"leg {i}"], trial.time, trial.position[:, 2]) for i in (1, 2, 3)]
    missed = np.abs(np.array(ends) - np.array(track["depth"][1:])).max()
    assert trial.indices["depth_error_at_waypoints"][0] == pytest.approx(missed, abs=0.01)
    assert trial.indices["mean_speed"][0] == pytest.approx(
        trial.indices["distance"][0] / trial.indices["duration"][0], rel=1e-9
    )


def test_many_craft_are_read_as_each_one_alone(craft):
    trial = waypoint_mission_ready(craft, ROUND, "3 m/s", current=(0.1, -0.2, 0.0))
    # The last craft hardly answers its fins: it does not complete its mission.
    drawn = {n: craft.derivatives[n] * np.array([1.0, 0.8, 0.01]) for n in ("Nuudr", "Muude", "Yuudr", "Zuude")}
    many = readings(craft, trial, fly_ready(craft, trial, Ensemble(3, drawn)))
    for i in range(3):
        one = craft.with_values(**{name: float(values[i]) for name, values in drawn.items()})
        for name, (values, _) in readings(one, trial, fly_ready(one, trial)).items():
            assert many[name][0][i] == pytest.approx(values[0], rel=1e-6, abs=1e-9, nan_ok=True), (name, i)


def test_a_mission_that_loses_its_track_names_the_leg_and_where_it_stood(craft):
    trial = waypoint_mission_ready(craft, [("60 L", 0.0), ("60 L", "60 L")], "3 m/s")
    wrong = craft.with_values(Nuudr=0.0, Yuudr=0.0)
    words = trial.status(fly_ready(wrong, trial)) or ""
    assert "leg 2 was not completed" in words
    assert "m short and" in words
    assert "of the line" in words


def test_a_waypoint_passed_off_its_depth_is_not_completed_and_the_reason_is_given():
    # Below the inversion speed of the elevator the pilot follows no order of depth.
    craft = synthetic.model(synthetic.SUBOFF)
    slow = waypoint_mission(craft, [("40 L", 0.0), ("80 L", 0.0, "10 m", "0.66 m/s")], "1.3 m/s")
    assert slow.status.startswith("not completed: waypoint 2 was passed")
    assert "above its depth of 10 m" in slow.status
    assert "acts reversed on depth below" in slow.status
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.5)
    sunk = waypoint_mission(heavy, [("60 L", 0.0)])
    assert "below its depth of 0 m" in sunk.status
    assert "weight residual" in sunk.status or "level flight" in sunk.status


@pytest.mark.parametrize(
    ("waypoints", "more", "words"),
    [
        ([], {}, "no waypoint"),
        ([(1.0,)], {}, "waypoint 1.*is no point"),
        (["north"], {}, "waypoint 1.*is no point"),
        ([("5 kg", 0.0)], {}, "waypoint 1, north"),
        ([(100.0, 0.0), (100.0, 0.0)], {}, "leg 2 is 0 m long"),
        ([(200.0, 0.0), (200.0, 30.0), (0.0, 30.0)], {}, "leg 2 is 30 m long; the turn at its end begins"),
        (
            [(100.0, 0.0, "60 m")],
            {},
            "slope of 31.0 deg; the pilot pitches 15 deg at most. Give the leg at least 223.9",
        ),
        ([(300.0, 0.0, 0.0, "0.4 m/s")], {}, "good for 0.5 to 2 m/s"),
        ([(300.0, 0.0, 0.0, "0.6 m/s")], {"current": (0.0, 0.7, 0.0)}, "makes no way against a current of 0.7"),
        ([(300.0, 0.0)], {"current": (1.5, 0.0, 0.0)}, "not below the craft"),
    ],
)
def test_a_mission_that_cannot_be_flown_is_refused_with_the_reason(craft, waypoints, more, words):
    with pytest.raises(InputError, match=words):
        waypoint_mission(craft, waypoints, **more)
