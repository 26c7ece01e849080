"""Requirements put to the points of a design study are those that the verdict judges."""

import math

import pytest

from towtank.craft.library import read_craft
from towtank.design.goal import all_met
from towtank.design.needs import goals_of, needed
from towtank.errors import InputError
from towtank.sweep.point import model_of
from towtank.tank.fast.tank import FastTank
from towtank.trials.standard import standard_trials
from towtank.verdict.measures import MEASURES
from towtank.verdict.needs import requirements_of, standard_requirements

FILE = """
schema = "towtank/requirements/1"
[[requirement]]
name = "tactical diameter"
trial = "turning circle"
index = "tactical_diameter"
at_most = "5 L"
source = "imo2002"
[[requirement]]
name = "loop"
criterion = "loop_width"
at_most = "4 deg"
source = "own"
[[requirement]]
name = "stable"
criterion = "P_stable_horizontal"
at_least = 0.95
source = "own"
"""


@pytest.fixture(scope="module")
def model():
    return model_of(read_craft("hokie"), FastTank(members=2))


def test_numbers_of_a_point_are_those_of_the_trial_and_of_the_criterion(model):
    values = needed(model, requirements_of(FILE, "a.toml"))
    flown = {t.kind: t for t in standard_trials(model)}["turning circle"]
    assert values["asked.tactical_diameter of turning circle"] == flown.indices["tactical_diameter"]
    assert values["asked.loop_width"][1] == MEASURES["loop_width"].unit
    assert set(values) == {"asked.tactical_diameter of turning circle", "asked.loop_width"}


def test_a_goal_is_met_exactly_at_the_limit_of_its_requirement(model):
    craft, needs = model.craft, requirements_of(FILE, "a.toml")
    goals = goals_of(needs, needed(model, needs), craft, 0.95)
    assert [goal.limit for goal in goals] == pytest.approx([5.0 * craft.length, 4.0, 0.95])
    at = {goal.column: goal.limit for goal in goals}
    assert all_met(goals, at)
    for goal in goals:
        worse = -1e-9 if goal.at_least else 1e-9
        assert not all_met(goals, at | {goal.column: goal.limit + worse})
        assert not all_met(goals, at | {goal.column: math.nan})
    # The probability has a smooth companion only at the target of the search.
    assert goals[2].smooth == "growth_h_quantile"
    assert goals_of(needs, needed(model, needs), craft, 0.9)[2].smooth == ""


def test_all_standard_requirements_can_be_asked_of_a_design(model):
    needs = standard_requirements()
    goals = goals_of(needs, needed(model, needs), model.craft, 0.95)
    assert {goal.name for goal in goals} == {need.name for need in needs}


def test_a_requirement_on_a_trial_that_is_not_there_is_refused(model):
    text = FILE.replace('"turning circle"', '"figure of eight"')
    with pytest.raises(InputError, match="no trial 'figure of eight'"):
        needed(model, requirements_of(text, "a.toml"))
