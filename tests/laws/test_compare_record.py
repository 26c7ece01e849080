"""What was put into a record comes out of its comparison."""

from dataclasses import replace

import numpy as np
import pytest

import towtank as tt
from sea_records import CLOSED, CURRENT, FINS, OPEN, swum
from towtank.craft.library import read_craft
from towtank.errors import ArtefactError, InputError
from towtank.field.begin import given
from towtank.field.comparing import words
from towtank.field.comparing.compare import compare
from towtank.field.comparing.draws import drawn
from towtank.field.comparing.files import FILE, read_comparisons, write_comparison
from towtank.field.course import course_of
from towtank.field.log import Flag
from towtank.field.replay import flown
from towtank.model.equations import Model
from towtank.pilot.design import design_pilot
from towtank.plan.standard import standard_plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.start import ballasted

STD = {"psi": 0.005, "r": 0.001, "z": 0.01, "theta": 0.002, "ahead": 0.01, "x": 0.5, "y": 0.5}


@pytest.fixture(scope="module")
def model():
    craft = read_craft("hokie")
    return ballasted(Model(craft, tt.derive(tow(standard_plan(craft), FastTank()))))


@pytest.fixture(scope="module")
def twin(model):
    """A record of the model itself, without noise, where it began, and the comparison of both."""
    log, state = swum(model, OPEN)
    return log, state, compare(model, log, start=given(state, CURRENT), samples=40, speed=1.0)


def by(it, channel):
    return next(one for one in it.channels if one.channel == channel)


def test_a_record_of_the_model_itself_has_no_error(twin):
    _, _, it = twin
    for one in it.channels:
        # The fins reach their rate limit inside ticks of the record, which are replayed as exponentials.
        assert abs(one.bias.error) < 2e-3, one.channel
        assert one.rms < 5e-3, one.channel
        assert one.inside_with_noise == one.inside
    done, known = it.validated
    assert known > 15
    assert done >= known - 1
    assert abs(it.lag.seconds) < 0.02


def test_a_bias_put_in_comes_out(model, twin):
    log, state, _ = twin
    off = {"psi": 0.03, "z": -0.2, "r": 0.002}
    spoiled = replace(log, channels={n: v + off.get(n, 0.0) for n, v in log.channels.items()})
    it = compare(model, spoiled, start=given(state, CURRENT), samples=10, speed=1.0)
    for name, value in off.items():
        assert by(it, name).bias.error == pytest.approx(value, abs=2e-3)
        assert by(it, name).rms == pytest.approx(abs(value), abs=2e-3)


def test_a_shift_put_in_is_found_and_taken_out(model, twin):
    log, state, _ = twin
    late = {n: np.interp(log.time - 0.3, log.time, v) if n not in FINS else v for n, v in log.channels.items()}
    it = compare(model, replace(log, channels=late), start=given(state, CURRENT), samples=10, speed=1.0)
    assert it.lag.applied
    assert it.lag.seconds == pytest.approx(0.3, abs=0.02)
    left = compare(model, replace(log, channels=late), start=given(state, CURRENT), samples=10, speed=1.0, align=False)
    assert "left as it is" in left.lag.words
    assert by(left, "psi").rms > 3.0 * by(it, "psi").rms


def test_noise_put_in_is_the_rms_that_comes_out(model, twin):
    log, state, _ = twin
    random = np.random.default_rng(3)
    noisy = {n: v + random.normal(0.0, STD[n], len(v)) if n in STD else v for n, v in log.channels.items()}
    record = replace(log, channels=noisy, std=STD, assumed=("psi",))
    it = compare(model, record, start=given(state, CURRENT), samples=40, speed=1.0)
    for name, size in STD.items():
        # 300 samples: the rms is known to 4 %.
        assert by(it, name).rms == pytest.approx(size, rel=0.15), name
        assert by(it, name).noise == pytest.approx(size)
        assert by(it, name).inside_with_noise > 0.9
    # The power of noise stands on both sides.
    power = next(one for one in it.metrics if one.name == "r_power_0.5_2_hz") if it.spectra else None
    assert power is None or power.model == pytest.approx(power.record, rel=0.3)
    assert "assumed: psi" in " ".join(it.included)
    assert "u" in " ".join(it.missing)


def test_records_of_drawn_craft_lie_in_the_band_of_others(model, twin):
    """Craft by craft: 95 % of them are inside at any moment."""
    log, state, _ = twin
    course = course_of(model, log, start=given(state, CURRENT), speed=1.0)
    band = flown(course, drawn(model, 400, seed=1), names=("psi", "r", "z", "u", "y"))
    others = flown(course, drawn(model, 200, seed=2), names=("psi", "r", "z", "u", "y"))
    for name in ("psi", "r", "z", "u", "y"):
        low, high = np.nanquantile(band[name][:, 30:], (0.025, 0.975), axis=0)
        inside = (others[name][:, 30:] >= low) & (others[name][:, 30:] <= high)
        # 200 craft: 1.5 % of scatter, and 1.1 % for a band of 400; three of both together.
        assert inside.mean() == pytest.approx(0.95, abs=0.056), name


def test_another_craft_stands_out_of_its_numbers(model, twin):
    log, state, _ = twin
    sharp = replace(
        model.derivatives,
        covariance_fit=1e-6 * model.derivatives.covariance_fit, covariance_mesh=0.0 * model.derivatives.covariance_mesh,
        covariance_model=0.0 * model.derivatives.covariance_model,
    )  # fmt: skip
    wrong = model.with_derivatives(sharp).with_values(Nuv=0.9 * model.derivatives["Nuv"])
    it = compare(wrong, log, start=given(state, CURRENT), samples=30, speed=1.0)
    assert by(it, "psi").bias.validated is False
    assert by(it, "psi").inside < 0.5
    assert "|E| > U_val" in words.verdict(it)
    assert by(it, "psi").growth[2] > by(it, "psi").growth[0]


def test_a_turn_and_its_radius_are_those_of_the_record(model):
    log, state = swum(model, [({"rudder": 0.0}, 30), ({"rudder": 0.25}, 2400)])
    it = compare(model, log, start=given(state, CURRENT), samples=10, speed=1.0)
    found = {one.name: one for one in it.metrics}
    steady = np.abs(log["r"][-100:]).mean()
    # The turn still slows down for a while after its rate has come to stand within 3 % over ten seconds.
    assert found["turn_rate"].record == pytest.approx(steady, rel=0.1)
    assert found["turn_rate"].model == pytest.approx(found["turn_rate"].record, rel=1e-3)
    assert found["turn_radius"].record == pytest.approx(log["ahead"][-100:].mean() / steady, rel=0.1)


def test_in_closed_loop_steps_and_fins_are_told(model):
    pilot = design_pilot(model, 1.0)
    legs = [CLOSED[0], (CLOSED[1][0], 900)]
    log, state = swum(model, legs, pilot)
    begin = given(state, CURRENT)
    it = compare(model, log, pilot=pilot, start=begin, samples=10, speed=1.0, pilot_name="cascade")
    names = {one.name for one in it.metrics}
    assert {"heading_overshoot", "fin_rms", "fin_travel"} <= names
    assert not {"swing_overshoot"} & names
    assert by(it, "delta1").rms < 1e-6
    opened = compare(model, log, start=begin, samples=10, speed=1.0, horizon=20.0)
    assert not {one.name for one in opened.metrics} & {"fin_rms", "heading_overshoot"}
    assert opened.loop == "open"
    assert len(opened.parts) == 5


def test_a_comparison_is_the_same_after_the_disk(tmp_path, twin):
    log, _, it = twin
    it = replace(it, flags={"gap": 2}, provenance={"inputs": {"derivatives": "a"}})
    write_comparison(it, tmp_path)
    write_comparison(replace(it, loop="closed"), tmp_path)
    back = read_comparisons(tmp_path)
    assert [one.loop for one in back] == ["closed", "open"]
    one = back[1]
    assert one.validated == it.validated
    for name in ("name", "craft", "record_level", "horizon", "parts", "words", "included", "missing", "flags"):
        assert getattr(one, name) == getattr(it, name), name
    assert [score.record for score in one.metrics] == [score.record for score in it.metrics]
    assert [c.bias.uncertainty for c in one.channels] == [c.bias.uncertainty for c in it.channels]
    for side in ("record", "model", "low", "high"):
        np.testing.assert_array_equal(getattr(one.series, side)["psi"], getattr(it.series, side)["psi"])
    assert one.lag == it.lag
    assert log.level == "synthetic" == one.record_level
    # A comparison of another model drops those of this one.
    write_comparison(replace(it, name="other", provenance={"inputs": {"derivatives": "b"}}), tmp_path)
    assert [one.name for one in read_comparisons(tmp_path)] == ["other"]
    (tmp_path / FILE).write_text('{"schema": "towtank/compare/1", "records": [{}]}')
    with pytest.raises(ArtefactError, match="towtank compare"):
        read_comparisons(tmp_path)


def test_what_is_said_names_the_record_for_what_it_is(twin):
    _, _, it = twin
    assert "SYNTHETIC" in words.what(it)
    assert "SYNTHETIC" not in words.what(replace(it, record_level="sea record"))
    assert "Not in it" in words.limits(it)
    assert "validated at the level U_val" in words.verdict(it)


def test_a_record_that_measured_nothing_is_refused(model, twin):
    log, _, _ = twin
    bare = replace(log, channels={name: log[name] for name in FINS}, flags=(Flag("gap", "time", 0.0, 1.0, 1, ""),))
    with pytest.raises(InputError, match="nothing of the motion"):
        compare(model, bare, samples=5)


def test_one_craft_makes_no_band(model, twin):
    log, _, _ = twin
    with pytest.raises(InputError, match="make no band"):
        compare(model, log, samples=1)
