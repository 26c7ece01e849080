"""Plan files: what is written is read back to the last bit, and a slip of the pen is answered with the right word."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.craft.library import read_craft
from towtank.errors import ArtefactError, PlanError
from towtank.plan.files import plan_table, plan_text, read_plan, write_plan
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import KINDS, Drift, Roll, Turn
from towtank.plan.standard import standard_plan

HOKIE = read_craft("hokie")
HEAD = 'schema = "towtank/plan/1"\ncraft = "hokie"\nspeed = 1.0\n'


def read(tmp_path, text):
    path = tmp_path / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return read_plan(path, HOKIE)


@pytest.mark.parametrize("name", ["hokie", "spheroid-6-1", "suboff-fins"])
def test_a_standard_plan_comes_back_as_it_was(tmp_path, name):
    craft = read_craft(name)
    plan = standard_plan(craft, "2 kn")
    toml, table = write_plan(plan, tmp_path)
    back = read_plan(tmp_path, craft)
    assert back == read_plan(toml, craft)
    assert (back.speed, back.tests, back.notes) == (plan.speed, plan.tests, plan.notes)
    assert len(table.read_text().splitlines()) == len(plan.tests) + 1


sizes = st.floats(-1.5, 1.5)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(KINDS)), st.floats(0.1, 9.0), sizes, sizes, st.floats(1e-3, 9.0),
    st.lists(st.floats(-0.7, 0.7), min_size=4, max_size=4) | st.just([]), st.booleans(), st.integers(1, 9),
)  # fmt: skip
def test_any_test_comes_back_to_the_last_bit(
    tmp_path_factory, kind, speed, first, second, frequency, fins, exploratory, periods
):
    arguments = {"turn": (first, second), "drift": (first,), "incidence": (first,)}.get(kind, (first, frequency))
    test = CaptiveTest(
        'a "b" é', speed, KINDS[kind](speed, *arguments), tuple(fins), periods=periods, exploratory=exploratory
    )
    plan = Plan(HOKIE, 1.0, (test,), ("a note\nof two lines",))
    folder = tmp_path_factory.mktemp("plan")
    assert read(folder, plan_text(plan)) == plan


def test_degrees_and_hertz_written_by_hand_are_understood(tmp_path):
    plan = read(
        tmp_path,
        HEAD
        + '[[test]]\nname = "a"\nkind = "sway"\namplitude = "20 cm"\nfrequency = "0.1 Hz"\nexploratory = true\n'
        + '[[test]]\nname = "b"\nkind = "roll"\namplitude = "12 deg"\nfrequency = "6 rpm"\nspeed = "2 kn"\n'
        + f'[[test]]\nname = "c"\nkind = "turn"\nrate = "3 deg/s"\nfins = {{ "{HOKIE.fins[1].name}" = "-5 deg" }}\n',
    )
    sway, roll, turn = plan.tests
    # A cycle per second is 2 pi rad/s, not one.
    assert sway.motion.frequency == pytest.approx(2.0 * math.pi * 0.1)
    assert sway.motion.amplitude == pytest.approx(0.2)
    assert sway.exploratory
    assert isinstance(roll.motion, Roll)
    assert roll.motion.frequency == pytest.approx(2.0 * math.pi * 0.1)
    assert roll.motion.speed == roll.speed == pytest.approx(1.0289, rel=1e-4)
    assert isinstance(turn.motion, Turn)
    assert turn.motion.rate == pytest.approx(math.radians(3.0))
    np.testing.assert_allclose(turn.fins, [0.0, math.radians(-5.0), 0.0, 0.0])


TEST = '[[test]]\nname = "a"\nkind = "sway"\namplitude = 0.1\nfrequency = "1 rad/s"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD + TEST.replace("sway", "swaying"), "Did you mean 'sway'"),
        (HEAD + TEST.replace("amplitude", "amplitud"), "Did you mean 'amplitude'"),
        (HEAD + TEST + "exploratry = true\n", "Did you mean 'exploratory'"),
        (HEAD + "sped = 2\n" + TEST, "Did you mean 'speed'"),
        (HEAD + TEST.replace('"1 rad/s"', "1.0"), "name the unit"),
        (HEAD + TEST.replace('frequency = "1 rad/s"', ""), "sway needs frequency"),
        (HEAD + TEST.replace("0.1", "nan"), "finite"),
        (HEAD + TEST.replace("0.1", '"0.1 kg"'), "cannot be converted"),
        (HEAD + TEST.replace('"1 rad/s"', '"-1 rad/s"'), "not positive"),
        (HEAD + TEST.replace('name = "a"\n', ""), "has no name"),
        (HEAD + TEST + "periods = 2.5\n", "whole number"),
        (HEAD + TEST + "exploratory = 1\n", "neither true nor false"),
        (HEAD + TEST + "fins = [1, 2, 3, 4]\n", "not a table"),
        (HEAD + TEST + 'fins = { "fin-99" = "1 deg" }\n', "has no fin"),
        (HEAD.replace("hokie", "remus100") + TEST, "is a plan of 'remus100'"),
        (HEAD.replace("plan/1", "plan/9"), "schema"),
        (HEAD + "test = 3\n", "not a list"),
        (HEAD + 'notes = "one"\n', "notes"),
        ("this is no toml", "not a readable TOML file"),
        ("", "schema"),
    ],
)
def test_slips_are_answered_with_where_and_what_to_write(tmp_path, text, words):
    with pytest.raises(PlanError, match=words) as caught:
        read(tmp_path, text)
    assert "plan.toml" in str(caught.value)


def test_missing_plans_and_unwritable_folders_are_told(tmp_path):
    with pytest.raises(PlanError, match="towtank plan"):
        read_plan(tmp_path / "plan.toml", HOKIE)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ArtefactError, match="cannot write"):
        write_plan(standard_plan(HOKIE), tmp_path / "file")


def test_the_table_shows_size_and_warnings_of_each_run():
    tests = (
        CaptiveTest("mild", 1.0, KINDS["sway"](1.0, 0.6, 0.2)),
        CaptiveTest("wild", 1.0, Drift(1.0, math.radians(50.0)), exploratory=True),
        CaptiveTest("steep", 1.0, Drift(1.0, math.radians(25.0))),
    )
    rows = list(csv.DictReader(plan_table(replace(standard_plan(HOKIE), tests=tests)).splitlines()))
    assert [row["name"] for row in rows] == ["mild", "wild", "steep"]
    assert float(rows[0]["v_prime"]) == pytest.approx(0.12)
    assert float(rows[0]["frequency_prime"]) == pytest.approx(0.2 * HOKIE.length, rel=1e-3)
    assert rows[0]["warnings"] == ""
    assert "35 deg" in rows[1]["warnings"] or "v/U" in rows[1]["warnings"]
    assert "20 deg" in rows[2]["warnings"]
