"""Limits of captive tests: what is measured, what is warned of, what is refused and how the refusal teaches."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.craft.library import read_craft
from towtank.errors import PlanError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.limits import assess, enforce, enforce_plan
from towtank.plan.motion import Drift, Heave, Incidence, Pitch, Roll, Surge, Sway, Turn, Yaw

CRAFT = read_craft("hokie")
U, L = 1.0, CRAFT.length


def captive(motion, **changes):
    return CaptiveTest("run-1", motion.speed, motion, **changes)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 4.0), st.floats(0.2, 3.0), st.floats(0.02, 0.3))
def test_measures_are_those_of_the_closed_forms(speed, primed_frequency, primed):
    w = primed_frequency * speed / L
    sway = assess(captive(Sway(speed, primed * speed / w, w)), CRAFT)
    assert sway.v == pytest.approx(primed, rel=1e-12)
    assert sway.frequency == pytest.approx(primed_frequency, rel=1e-12)
    assert sway.cycle == pytest.approx(2.0 * math.pi / primed_frequency, rel=1e-12)
    yaw = assess(captive(Yaw(speed, primed * speed**2 / (L * w * w), w)), CRAFT)
    assert yaw.r == pytest.approx(primed, rel=1e-12)
    assert yaw.v == 0.0
    roll = assess(captive(Roll(speed, primed, w)), CRAFT)
    assert roll.p == pytest.approx(primed * primed_frequency, rel=1e-12)


def test_the_drift_and_rates_of_the_source_pass_without_a_word():
    for motion in (Drift(U, math.radians(20.0)), Incidence(U, math.radians(-20.0)), Turn(U, 0.6 * U / L)):
        violence = assess(captive(motion), CRAFT)
        assert violence.warnings == violence.refusals == ()


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (Drift(U, math.radians(24.0)), "20 deg"),
        (Sway(U, 0.45 * L, 1.0 / L), "20 deg"),
        (Yaw(U, 0.8 * L, 1.0 / L), "stern"),
        (Sway(U, 0.02 * L, 3.0 / L), "unsteady"),
        (Pitch(U, 0.01 * L, 5.0 / L), "unsteady"),
        (Surge(U, 0.6 * L, 1.0 / L), "resistance"),
    ],
)
def test_what_leaves_the_fitted_range_is_warned_of_and_still_run(motion, words):
    violence = enforce(captive(motion), CRAFT)
    assert len(violence.warnings) == 1
    assert words in violence.warnings[0]


@pytest.mark.parametrize(
    "motion",
    [
        Sway(U, 2.4, 0.7),
        Heave(U, L, 1.5 / L),
        Yaw(U, 2.0 * L, 1.0 / L),
        Pitch(U, L, 1.5 / L),
        Roll(U, math.radians(170.0), 5.0 / L),
        Surge(U, 1.2 * L, 1.0 / L),
        Sway(U, 0.01, 9.0 / L),
        Drift(U, math.radians(50.0)),
        Incidence(U, math.radians(-100.0)),
        Turn(U, 1.5 / L),
    ],
    ids=lambda motion: motion.kind,
)
def test_the_remedy_named_in_a_refusal_is_accepted(motion):
    """A refusal names the run, its size, the limit and a value that passes: try that value."""
    with pytest.raises(PlanError) as caught:
        enforce(captive(motion), CRAFT)
    text = str(caught.value)
    assert "run-1" in text
    assert "Above" in text
    assert "exploratory = true" in text
    assert enforce(captive(motion, exploratory=True), CRAFT).refusals
    # Three digits are printed; half a per cent below them is inside the limit.
    for key, number in re.findall(r"the (amplitude|frequency|angle|rate) (?:below|within) ([\d.e+-]+)", text):
        value = float(number) * 0.995
        value = math.radians(value) if key == "angle" or (motion.kind == "roll" and key == "amplitude") else value
        sign = math.copysign(1.0, getattr(motion, key))
        assert not assess(captive(replace(motion, **{key: sign * value})), CRAFT).refusals
        if key != "angle":
            assert assess(captive(replace(motion, **{key: sign * value * 1.02})), CRAFT).refusals
    assert re.search("amplitude|frequency|angle|rate", text.split("Keep")[1])


def test_a_refusal_reads_as_words_with_the_numbers_of_the_run():
    with pytest.raises(PlanError) as caught:
        enforce(captive(Sway(1.0, 0.6, 5.0)), replace(CRAFT, name="hokie"))
    text = str(caught.value)
    assert "amplitude 0.6 m, frequency 5 rad/s, speed 1 m/s" in text
    assert "v/U = 3" in text
    assert "0.7" in text


def test_stalled_fins_are_warned_of_and_plates_refused():
    ahead = Drift(U, 0.0)
    assert enforce(captive(ahead, fins=(math.radians(30.0), 0.0, 0.0, 0.0)), CRAFT).warnings
    with pytest.raises(PlanError, match="fins within 45 deg"):
        enforce(captive(ahead, fins=(math.radians(60.0), 0.0, 0.0, 0.0)), CRAFT)


@pytest.mark.parametrize(
    ("test", "words"),
    [
        (captive(Drift(U, 0.0), fins=(0.1,)), "4 fins"),
        (captive(Drift(U, 0.0), fins=(0.1, np.nan, 0.0, 0.0)), "not finite"),
        (captive(Sway(U, 0.1, 0.2), samples=8), "third harmonic"),
        (captive(Sway(U, 0.1, 0.2), periods=0), "periods"),
        (CaptiveTest("run-1", -1.0, Drift(U, 0.0)), "speed"),
        (CaptiveTest("run-1", 2.0, Drift(1.0, 0.0)), "one speed"),
    ],
)
def test_what_cannot_be_recorded_is_refused_even_when_exploratory(test, words):
    with pytest.raises(PlanError, match=words):
        enforce(replace(test, exploratory=True), CRAFT)


def test_two_runs_of_one_name_are_refused():
    tests = (captive(Drift(U, 0.0)), captive(Drift(U, 0.1)))
    with pytest.raises(PlanError, match=r"two runs are called run-1"):
        enforce_plan(Plan(CRAFT, U, tests))
