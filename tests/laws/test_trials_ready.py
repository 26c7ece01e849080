"""Spiral, steps, lawnmower and the standard set as they are made ready: both paths of the engine, many craft, marks."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.run import Ensemble
from towtank.errors import InputError, TrialError
from towtank.trials.mission import lawnmower, lawnmower_ready
from towtank.trials.ready import fly_ready, readings
from towtank.trials.reverse import reverse_spiral_ready
from towtank.trials.speed import acceleration_ready, stopping, stopping_ready
from towtank.trials.spiral import spiral, spiral_ready
from towtank.trials.standard import standard_ready, standard_trials
from towtank.trials.steps import depth_step, depth_step_ready, heading_step, heading_step_ready
from towtank.trials.vertical import meander, meander_ready, steep_dive, steep_dive_ready
from towtank.trials.waypoints import waypoint_mission

CURRENT = (0.1, -0.2, 0.0)
SHORT = {
    "spiral": lambda m: spiral(m, "20 deg", "6 m/s", hold_depth=False),
    "heading step": lambda m: heading_step(m, "-40 deg", "3 m/s", current=CURRENT, lengths=15.0),
    "depth step": lambda m: depth_step(m, "2 m", "3 m/s", lengths=15.0),
    "lawnmower": lambda m: lawnmower(m, 2, "100 m", "60 m", "1 m", "3 m/s", current=CURRENT),
    "crash stop": lambda m: stopping(m, -3.0, "6 m/s"),
    "meander": lambda m: meander(m, "10 deg", "2 deg", "3 m/s"),
    "vertical overshoot": lambda m: steep_dive(m, "10 deg", None, "3 m/s", elevator="15 deg"),
    "mission": lambda m: waypoint_mission(m, [(100.0, 0.0), (150.0, 60.0, "1 m")], "3 m/s", current=CURRENT),
}


@pytest.fixture(scope="module")
def stable():
    return synthetic.model(synthetic.STABLE)


@pytest.mark.parametrize("kind", SHORT)
def test_the_compiled_loop_and_the_one_on_numpy_give_the_same_numbers(stable, kind, monkeypatch):
    monkeypatch.setattr("towtank.trials.spiral.FIRST", 2.0)  # lengths; a whole spiral takes numpy 6 s
    monkeypatch.setattr("towtank.trials.spiral.EACH", 1.0)
    usual = SHORT[kind](stable)
    monkeypatch.setenv("TOWTANK_ENGINE", "numpy")
    plain = SHORT[kind](stable)
    assert plain.provenance["engine"]["path"] == "numpy"
    assert plain.status == usual.status == "done"
    assert plain.indices.keys() == usual.indices.keys()
    for name, (value, unit) in usual.indices.items():
        assert plain.indices[name] == (pytest.approx(value, rel=1e-9, abs=1e-9, nan_ok=True), unit), name


READY = {
    "spiral": lambda m: spiral_ready(m, "20 deg"),
    "heading step": lambda m: heading_step_ready(m, "-40 deg", current=CURRENT),
    "depth step": lambda m: depth_step_ready(m, "-3 m"),
    "lawnmower": lambda m: lawnmower_ready(m, 2, depth="1 m", current=CURRENT),
    "reverse spiral": lambda m: reverse_spiral_ready(m, "20 deg"),
    "acceleration": lambda m: acceleration_ready(m),
    "crash stop": lambda m: stopping_ready(m),
    "meander": lambda m: meander_ready(m, "10 deg", "2 deg", "3 m/s"),
    "steep dive": lambda m: steep_dive_ready(m, "20 deg", "10 m", "3 m/s"),
    "vertical overshoot": lambda m: steep_dive_ready(m, "10 deg", None, "3 m/s", "15 deg"),
}


@pytest.mark.parametrize("kind", READY)
def test_many_craft_are_read_as_each_one_alone(stable, kind):
    trial = READY[kind](stable)
    # The last craft hardly answers its fins: where it does not get, its numbers are not there.
    drawn = {n: stable.derivatives[n] * np.array([1.0, 0.8, 0.01]) for n in ("Nuudr", "Muude", "Yuudr", "Zuude")}
    many = readings(stable, trial, fly_ready(stable, trial, Ensemble(3, drawn)))
    for i in range(3):
        one = stable.with_values(**{name: float(values[i]) for name, values in drawn.items()})
        for name, (values, _) in readings(one, trial, fly_ready(one, trial)).items():
            # Packs have sines and cosines of their own, which differ from the C library's in the last digits.
            assert many[name][0][i] == pytest.approx(values[0], rel=1e-6, abs=1e-9, nan_ok=True), (name, i)


def test_the_spiral_of_a_stable_craft_is_its_algebraic_curve(stable):
    trial = spiral(stable, "20 deg")
    measured, steady = trial.provenance["curves"]["spiral"], trial.provenance["curves"]["steady turns"]
    assert measured["sweep"] == ["down"] * 13 + ["up"] * 12
    assert len(measured["rudder"]) == len(measured["rate"]) == 25
    wanted = np.interp(-measured["rudder"], -steady["rudder"], steady["rate"])
    # The step is over before the rate is quite steady. Measured: 3.8 % of the largest rate.
    assert measured["rate"] == pytest.approx(wanted, abs=0.05 * np.abs(wanted).max())
    assert trial.indices["loop_width"][0] < 0.1 * 20.0


def test_a_spiral_cut_short_keeps_what_it_measured(stable):
    wild = stable.with_values(Xuu=+400.0)
    trial = spiral_ready(stable, "20 deg")
    flights = fly_ready(wild, trial)
    got = trial.curves(flights)["spiral"]
    assert not flights.finished[0]
    assert len(got["rudder"]) == len(got["rate"]) == len(got["sweep"]) < 25
    assert np.isnan(trial.read(flights)["loop_width"][0][0])


@pytest.mark.parametrize(("change", "side"), [("30 deg", 1.0), ("-30 deg", -1.0)])
def test_the_response_to_a_step_is_that_of_its_record(change, side):
    # The unstable craft overshoots by more than the band of 5 %, so that the outer edge decides when it has settled.
    craft = synthetic.model(synthetic.SUBOFF)
    trial = heading_step(craft, change, lengths=60.0)
    begin = trial.provenance["marks"][0]["time"]
    time, share = trial.time - begin, side * np.degrees(trial.attitude[:, 2]) / 30.0
    assert trial.indices["overshoot_share"][0] == pytest.approx(100.0 * (share.max() - 1.0), abs=0.05)
    assert trial.indices["overshoot_share"][0] > 5.0
    # Samples are 0.5 s apart.
    rise = time[share > 0.9][0] - time[share > 0.1][0]
    settled = time[np.abs(share - 1.0) > 0.05][-1]
    assert trial.indices["rise_time"][0] == pytest.approx(rise, abs=0.6)
    assert trial.indices["settling_time"][0] == pytest.approx(settled, abs=0.6)
    assert np.sign(trial.attitude[-1, 2]) == side


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("primes", [synthetic.STABLE, synthetic.SUBOFF])
def test_the_largest_change_of_heading_is_turned_to_the_side_that_was_ordered(primes, side):
    trial = heading_step(synthetic.model(primes), f"{175.0 * side} deg", current=(0.0, -0.2 * side, 0.0))
    assert trial.indices["rise_time"][0] > 0.0
    assert abs(trial.indices["last_error"][0]) < 5.0
    assert np.degrees(trial.attitude[-1, 2]) == pytest.approx(175.0 * side, abs=5.0)


def test_a_step_that_ends_outside_its_band_has_no_settling_time(stable):
    trial = heading_step(stable, lengths=4.0)
    assert np.isnan(trial.indices["settling_time"][0])
    assert trial.indices["last_error"][0] < -1.0


def test_the_numbers_of_a_lawnmower_are_those_of_its_record(stable):
    trial = lawnmower(stable, 3, depth="1 m", current=CURRENT)
    assert trial.status == "done"
    track = trial.provenance["curves"]["track"]
    marks = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    assert list(marks) == [
        "leg 1 coming on",
        "leg 1",
        "leg 2",
        "leg 3 coming on",
        "leg 3",
        "leg 4",
        "leg 5 coming on",
        "leg 5",
    ]
    squares, lasting, farthest, deep = 0.0, 0.0, 0.0, 0.0
    for i in (1, 3, 5):
        on = (trial.time >= marks[f"leg {i} coming on"]) & (trial.time <= marks[f"leg {i}"])
        away = trial.position[on, 1] - track["east"][i]
        squares, lasting = squares + (away**2).sum(), lasting + on.sum()
        farthest, deep = max(farthest, np.abs(away).max()), deep + ((trial.position[on, 2] - 1.0) ** 2).sum()
    assert trial.indices["off_track_rms"][0] == pytest.approx(np.sqrt(squares / lasting), rel=0.02)
    assert trial.indices["off_track_largest"][0] == pytest.approx(farthest, rel=0.02)
    assert trial.indices["depth_error_rms"][0] == pytest.approx(np.sqrt(deep / lasting), rel=0.02)
    # A long leg is split where the craft has made good half of it.
    half = np.interp(marks["leg 1 coming on"], trial.time, trial.position[:, 0])
    assert half == pytest.approx(0.5 * track["north"][1], abs=0.01)


def test_a_turn_onto_a_long_leg_may_use_the_time_of_the_whole_leg(stable):
    # Short legs close to each other: the craft takes 1.8 times the time of a whole leg to make good the first half.
    trial = lawnmower(stable, 2, "100 m", "60 m", "1 m", "3 m/s")
    marks = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    assert trial.status == "done"
    assert marks["leg 3 coming on"] - marks["leg 2"] > 0.5 * 3.0 * 100.0 / 3.0


def _least(model, **given):
    """The least value that a refusal names for what is ``given`` in craft lengths, in m."""
    with pytest.raises(InputError, match="turns take up the legs") as refused:
        lawnmower(model, **{name: f"{share * model.craft.length} m" for name, share in given.items()})
    words = {"spacing": r"a spacing of ([\d.]+) m", "leg_length": r"legs of ([\d.]+) m"}[next(iter(given))]
    return float(re.search(words, str(refused.value))[1])


@pytest.mark.parametrize("share", [4.0, 4.5, 5.0, 5.7])
def test_a_spacing_below_what_the_turns_take_is_refused_and_the_one_named_is_flown(stable, share):
    # The turns of this craft are planned 9.5 lengths wide: half of that before a corner, and a length left over.
    least = _least(stable, spacing=share)
    assert least == pytest.approx((0.5 * 9.497 + 1.0) * 8.15, abs=0.1)
    trial = lawnmower(stable, 3, spacing=f"{least} m")
    assert trial.status == "done"
    marks = [m for m in trial.provenance["marks"] if m["leg"] in ("leg 2", "leg 4")]
    assert [m["ended"] for m in marks] == ["event", "event"]
    # On a short leg the craft goes east all the time, and ends it a length beyond the long one.
    ends = {m["leg"]: m["time"] for m in trial.provenance["marks"]}
    on = (trial.time >= ends["leg 1"]) & (trial.time <= ends["leg 2"])
    assert np.all(np.diff(trial.position[on, 1]) > -0.01)
    assert np.interp(ends["leg 2"], trial.time, trial.position[:, 1]) == pytest.approx(8.15, abs=0.1)


@pytest.mark.parametrize("share", [8.0, 10.0, 11.4])
def test_a_long_leg_without_a_rest_after_its_half_is_refused_and_the_one_named_is_flown(stable, share):
    least = _least(stable, leg_length=share)
    assert least == pytest.approx(2.0 * (0.5 * 9.497 + 1.0) * 8.15, abs=0.1)
    trial = lawnmower(stable, 3, f"{least} m")
    assert trial.status == "done"
    assert all(np.isfinite(value) for value, _ in trial.indices.values())


def test_a_craft_that_turns_tightly_flies_the_shortest_pattern_and_one_leg_has_no_turn(stable):
    tight = synthetic.model(synthetic.SUBOFF)
    assert _least(tight, spacing=3.9) == pytest.approx(4.0 * 8.15, abs=0.01)
    assert _least(tight, leg_length=7.9) == pytest.approx(8.0 * 8.15, abs=0.01)
    assert len(lawnmower_ready(tight, 3, "65.2 m", "32.6 m").legs) == 8
    assert len(lawnmower_ready(stable, 1, spacing="5 m").legs) == 2


def test_a_lawnmower_that_loses_its_track_names_the_leg(stable):
    # The rudder of this craft does not work.
    trial = lawnmower_ready(stable, 2)
    wrong = stable.with_values(Nuudr=0.0, Yuudr=0.0)
    flights = fly_ready(wrong, trial)
    assert "leg 2 was not completed" in (trial.status(flights) or "")


def test_the_standard_set_made_ready_is_the_one_that_is_flown():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-5.0)
    made, ready = standard_trials(heavy), standard_ready(heavy)
    assert [trial.name for trial in made] == [trial.name for _, trial in ready]
    # The straight run is made as loaded, the others ballasted to neutral.
    assert [m.craft.mass.displaced_mass == m.craft.mass.mass for m, _ in ready] == [False] + [True] * (len(ready) - 1)
    for trajectory, (model, trial) in zip(made, ready, strict=True):
        for name, (values, unit) in readings(model, trial, fly_ready(model, trial)).items():
            assert trajectory.indices[name] == (pytest.approx(float(values[0]), nan_ok=True), unit)
        said = any(note.startswith("Ballasted to neutral") for note in trajectory.provenance["notes"])
        assert said == (trajectory.kind != "straight run")


def test_a_craft_without_a_pilot_makes_the_open_loop_trials_only(monkeypatch):
    craft = synthetic.model(synthetic.STABLE)

    def refused(model):
        raise TrialError("no gains")

    monkeypatch.setattr("towtank.trials.standard.design_pilot", refused)
    made = standard_trials(craft)
    assert {trial.loop for trial in made} == {"open"}
    assert len(made) == 9
    assert all("No pilot: no gains" in trial.provenance["notes"] for trial in made[1:])
    bare = replace(craft, craft=replace(craft.craft, fins=()))
    assert [trial.name for _, trial in standard_ready(bare)] == ["straight"]
