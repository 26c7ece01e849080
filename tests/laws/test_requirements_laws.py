"""Requirements: monotone in their limit, sure without uncertainty, driven by what an independent difference finds."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.pilot.design import design_pilot
from towtank.report.blocks import Picture, Table, Text
from towtank.report.of_verdict import verdict as verdict_section
from towtank.report.pictures import Sketchbook
from towtank.report.study import Study
from towtank.trials.circle import circle_ready
from towtank.trials.ready import Ready, run_trial
from towtank.trials.zigzag import zigzag_ready
from towtank.verdict.assess import assess
from towtank.verdict.evidence import Evidence
from towtank.verdict.files import read_verdict, write_verdict
from towtank.verdict.flights import fly_many, sound_readings
from towtank.verdict.judge import judge
from towtank.verdict.many import Population, TrialValues, drawn
from towtank.verdict.needs import SCHEMA, Need, bound, requirements_of, standard_requirements
from towtank.verdict.table import Requirement

PILOT = design_pilot(synthetic.model(synthetic.SUBOFF))


def two(model: Model) -> tuple[tuple[Model, Ready], ...]:
    """Circle and zigzag under one pilot, so that a craft alone flies as it does among others."""
    return ((model, circle_ready(model, "15 deg", pilot=PILOT)), (model, zigzag_ready(model, pilot=PILOT)))


def flown(model: Model, count: int = 60) -> Population:
    """Craft drawn from the derivatives, with the numbers of both trials."""
    it = drawn(model, count)
    numbers = {
        trial.name: TrialValues(trial.kind, trial.loop, sound_readings(m, trial, fly_many(m, trial, it.craft)))
        for m, trial in two(model)
    }
    return replace(it, trials=numbers)


@pytest.fixture(scope="module")
def model() -> Model:
    return synthetic.model(synthetic.SUBOFF, std=0.05)


@pytest.fixture(scope="module")
def population(model: Model) -> Population:
    return flown(model)


@pytest.fixture(scope="module")
def evidence(model: Model, population: Population) -> Evidence:
    return Evidence(model, population, ready=two(model))


DIAMETER = Need("diameter", "at_most", "5 L", trial="turning circle", index="tactical_diameter")


def put(need: Need, evidence: Evidence) -> Requirement:
    ((requirement,), _) = judge([need], evidence)
    return requirement


@pytest.mark.parametrize("need", [DIAMETER, Need("index", "at_least", 0.0, criterion="G_h"),
                                  Need("P", "at_least", 0.1, criterion="P_stable_horizontal")])  # fmt: skip
def test_a_looser_limit_is_met_by_all_that_met_the_tighter_one(need: Need, evidence: Evidence):
    first = put(need, evidence)
    spread = max(first.std, 0.01)
    sign = -1.0 if need.sense == "at_least" else 1.0
    limits = first.value + sign * spread * np.linspace(-3.0, 3.0, 13)
    limits = np.clip(limits, 0.0, 1.0) if first.on_share else limits
    found = [put(replace(need, limit=f"{limit!r} {first.unit}".strip()), evidence) for limit in limits.tolist()]
    assert [r.met for r in found] == sorted(r.met for r in found)
    if not first.on_share:
        chances = [r.probability for r in found]
        assert chances == sorted(chances)
        assert chances[0] < chances[-1]
    for r, limit in zip(found, limits, strict=True):
        assert r.margin == pytest.approx(sign * (limit - first.value), abs=1e-9)
        assert r.met == (r.margin >= 0.0)


def test_without_uncertainty_what_is_met_is_sure_and_what_is_not_impossible():
    certain = synthetic.model(synthetic.SUBOFF)
    facts = Evidence(certain, flown(certain, 9), ready=two(certain))
    best = put(DIAMETER, facts)
    assert best.std == pytest.approx(0.0, abs=1e-9)
    for shift, chance in ((0.01, 1.0), (-0.01, 0.0)):
        r = put(replace(DIAMETER, limit=f"{best.value * (1.0 + shift)!r} m", share=0.9), facts)
        assert (r.probability, r.met) == (chance, chance == 1.0)
    share = put(Need("P", "at_least", 0.9, criterion="P_stable_horizontal"), facts)
    assert (share.value, share.met) == (0.0, False)
    # Without a standard uncertainty a coefficient is stepped by 5 %, and the slopes still have an effect.
    assert best.drivers
    assert all(driver.step == pytest.approx(5.0) for driver in best.drivers)


def test_the_driver_of_a_trial_is_what_flying_the_moved_craft_one_by_one_finds(model: Model, evidence: Evidence):
    found = put(DIAMETER, evidence)
    assert len(found.drivers) > 1
    for driver in found.drivers:
        value = model.derivatives[driver.coefficient]
        ends = []
        for way in (1.0, -1.0):
            moved = model.with_values(**{driver.coefficient: value + way * 0.05 * abs(value)})
            trial = circle_ready(model, "15 deg", pilot=PILOT)
            ends.append(run_trial(moved, trial).indices["tactical_diameter"][0])
        # 1e-6: packs take their own sines, and the difference of two numbers holds three digits less than they.
        assert driver.effect == pytest.approx(0.5 * (ends[0] - ends[1]), rel=1e-6)
        assert driver.step == pytest.approx(5.0)
        assert driver.per_percent == pytest.approx(driver.effect / 5.0 * np.sign(value))
    strongest = [abs(driver.effect) for driver in found.drivers]
    assert strongest == sorted(strongest, reverse=True)


def test_the_driver_of_a_probability_is_that_of_all_craft_moved():
    near = synthetic.model({**synthetic.STABLE, "Nuv": -0.0098}, std=0.1)
    facts = Evidence(near, drawn(near, 4000))
    need = Need("P", "at_least", 0.9, criterion="P_stable_horizontal")
    found = put(need, facts)
    assert 0.2 < found.value < 0.8
    assert found.std == pytest.approx(math.sqrt(found.value * (1.0 - found.value) / 4000))
    for driver in found.drivers:
        value = near.derivatives[driver.coefficient]
        shares = []
        for way in (1.0, -1.0):
            moved = near.with_values(**{driver.coefficient: value + way * 0.1 * abs(value)})
            # Same draws, same standard uncertainties, another mean.
            shares.append(put(need, Evidence(moved, drawn(moved, 4000))).value)
        assert driver.effect == pytest.approx(0.5 * (shares[0] - shares[1]), abs=1e-9)


def test_a_craft_without_the_number_does_not_meet_the_requirement(evidence: Evidence, population: Population):
    need = Need("overshoot", "at_most", "60 deg", trial="zigzag 10/10", index="second_overshoot")
    values = population.trials["zigzag-10-10"].indices["second_overshoot"][0].copy()
    values[1:11] = np.nan
    trial = population.trials["zigzag-10-10"]
    few = replace(population, trials={**population.trials, "zigzag-10-10": replace(
        trial, indices={**trial.indices, "second_overshoot": (values, "deg")})})  # fmt: skip
    r = put(need, Evidence(evidence.model, few, ready=()))
    assert r.probability == pytest.approx(np.mean(values[1:] <= 60.0))
    gone = int(np.isnan(values[1:]).sum())
    assert gone >= 10
    assert r.probability <= 1.0 - gone / 60.0
    assert f"{gone} of 60 drawn craft have no such number" in r.note
    assert r.drivers == ()


def test_all_together_is_no_more_probable_than_each(evidence: Evidence):
    needs = [DIAMETER, Need("index", "at_least", -2.5, criterion="G_h"),
             Need("overshoot", "at_most", "20 deg", trial="zigzag-10-10", index="first_overshoot")]  # fmt: skip
    rows, together = judge(needs, evidence)
    assert together <= min(r.probability for r in rows)
    assert together >= 1.0 - sum(1.0 - r.probability for r in rows)
    share = Need("P", "at_least", 0.9, criterion="P_stable_horizontal")
    assert judge([*needs, share], evidence)[1] == together


def test_the_sign_of_a_number_does_not_count_where_its_size_is_asked_for(evidence: Evidence):
    left = Need("turn", "at_most", "5 deg/s", trial="turning circle", index="yaw_rate")
    signed, size = put(left, evidence), put(replace(left, magnitude=True), evidence)
    assert signed.value < 0.0
    assert size.value == -signed.value


@pytest.mark.parametrize(
    ("limit", "unit", "value"),
    [("5 L", "m", 20.0), ("0.9 U", "m/s", 1.8), ("2.5 L/U", "s", 5.0), ("10 ft", "m", 3.048), ("15 deg", "deg", 15.0),
     ("0.1 rad", "deg", math.degrees(0.1)), ("5 %", "%", 5.0), (7.5, "m", 7.5), (0, "deg", 0.0), ("0.9", "", 0.9)],
)  # fmt: skip
def test_a_limit_is_read_in_its_own_unit_and_in_those_of_the_craft(limit, unit, value):
    assert bound(limit, unit, "at_most", length=4.0, speed=2.0) == pytest.approx(value)


def item(**keys) -> str:
    """A file with one requirement; ``keys`` change it, None takes one out."""
    whole = {"name": '"d"', "trial": '"turning circle"', "index": '"advance"', "at_most": '"5 L"'} | keys
    lines = [f"{key} = {value}" for key, value in whole.items() if value is not None]
    return "\n".join([f'schema = "{SCHEMA}"', "[[requirement]]", *lines])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("schema = 5 L", "is not a TOML file"),
        ("[[requirement]]\nname = 'x'", "The first line of the file is schema"),
        (f'schema = "{SCHEMA}"', "Head each one with [[requirement]]"),
        (f'schema = "{SCHEMA}"\n[requirement]\nname = "x"', "double brackets"),
        (f'schema = "{SCHEMA}"\nrequirements = 1', "Did you mean requirement?"),
        (item(name=None), "requirement[1].name: this key is missing"),
        (item(at_most=None), "neither at_most nor at_least is given"),
        (item(at_least='"4 L"'), "two limits are two requirements"),
        (item(index=None), "give a criterion, or a trial and its index"),
        (item(criterion='"G_h"'), "give a criterion, or a trial and its index"),
        (item(trail='"x"'), "Did you mean trial?"),
        (item(share="1.5"), "a number between 0 and 1"),
        (item(share='"90 m"'), "requirement[1].share"),
        (item(at_most="true"), "is no limit"),
        (item(at_most="nan"), "not finite"),
        (item(magnitude='"yes"'), "true or false"),
        (item(source="3"), "a text in quotes"),
        (item(trial=None, index=None, criterion='"G_hh"'), "Did you mean G_h?"),
        (item(trial=None, index=None, criterion='"loop_width"', at_most="4"), "bare angle 4"),
        (item(trial=None, index=None, criterion='"loop_width"'), "a multiple of the craft's length, but the number"),
        (item(trial=None, index=None, criterion='"critical_speed"', at_most='"3 m"'), "cannot be converted to m/s"),
        (item(trial=None, index=None, criterion='"P_stable_vertical"', at_most="2"), "is no probability"),
        (item(trial=None, index=None, criterion='"P_stable_vertical"', at_most="0.9", share="0.9"),
         "is a share of the drawn craft itself"),
        (item() + "\n[[requirement]]\nname = 'd'\ncriterion = 'G_h'\nat_least = 0", "is there twice"),
    ],
)  # fmt: skip
def test_a_bad_file_is_told_what_where_and_how(text: str, words: str):
    with pytest.raises(InputError, match=re.escape(words)):
        requirements_of(text, "mine.toml")


def test_all_faults_of_a_file_are_told_at_once():
    text = item(share="2") + "\n[[requirement]]\nname = 'other'\ncriterion = 'G_x'\nat_least = 0"
    with pytest.raises(InputError) as told:
        requirements_of(text, "mine.toml")
    assert "requirement[1].share" in str(told.value)
    assert "requirement[2].criterion" in str(told.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"trial": "turning circel"}, "Did you mean"),
        ({"index": "tactical_diametre"}, "Did you mean tactical_diameter?"),
        ({"limit": "5 kg"}, "cannot be converted to m"),
        ({"limit": "5 U"}, "a multiple of the craft's speed"),
        ({"index": "drift_angle", "limit": 10}, "bare angle"),
        ({"index": "speed_loss", "limit": 5}, "may be a share or per cent"),
    ],
)
def test_what_this_craft_cannot_be_asked_is_refused(evidence: Evidence, changes: dict, words: str):
    with pytest.raises(InputError, match=re.escape(words)):
        put(replace(DIAMETER, where="mine.toml: requirement[3]", **changes), evidence)


def test_a_kind_of_trial_flown_twice_is_the_one_of_the_drawn_craft_or_has_to_be_named(model: Model, evidence: Evidence):
    other = run_trial(model, circle_ready(model, "10 deg", pilot=PILOT))
    both = Evidence(model, evidence.population, [other], two(model))
    assert put(DIAMETER, both).value == put(DIAMETER, evidence).value
    named = put(replace(DIAMETER, trial="turning-10deg"), both)
    assert named.value == other.indices["tactical_diameter"][0]
    assert math.isnan(named.probability)
    assert "no drawn craft has made this trial" in named.note
    unflown = Evidence(model, drawn(model, 5), [other, run_trial(model, two(model)[0][1])])
    with pytest.raises(InputError, match="turning-10deg or turning-15deg"):
        put(DIAMETER, unflown)


def test_a_trial_of_the_same_name_at_another_speed_is_another_one(model: Model, evidence: Evidence):
    faster = run_trial(model, circle_ready(model, "15 deg", "1.5 m/s", pilot=PILOT))
    assert faster.name == "turning-15deg"
    r = put(
        replace(DIAMETER, index="time_to_90", limit="9 s"), Evidence(model, evidence.population, [faster], two(model))
    )
    assert r.value == faster.indices["time_to_90"][0]
    assert math.isnan(r.probability)
    assert r.drivers == ()


def test_without_a_compiled_engine_trials_get_no_driver(
    model: Model, population: Population, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("towtank.verdict.evidence.library", lambda form: None)
    r = put(DIAMETER, Evidence(model, population, ready=two(model)))
    assert r.drivers == ()
    assert r.probability == pytest.approx(put(DIAMETER, Evidence(model, population)).probability)
    assert put(Need("index", "at_least", 0.0, criterion="G_h"), Evidence(model, population)).drivers


def test_a_standard_trial_that_the_craft_has_not_made_is_not_met(evidence: Evidence):
    step = Need("step", "at_most", "3 deg", trial="heading step", index="overshoot", share=0.9)
    r = put(step, evidence)
    assert not r.met
    assert "has not made the trial" in r.note
    assert math.isnan(judge([DIAMETER, step], evidence)[1])


def test_craft_drawn_from_another_one_are_refused(model: Model):
    with pytest.raises(InputError, match="not those of this model"):
        assess(synthetic.model(synthetic.STABLE), population=drawn(model, 10))


def test_the_standard_set_is_sound_and_its_sources_are_in_the_bibliography():
    needs = standard_requirements()
    assert len({need.name for need in needs}) == len(needs) > 10
    assert all(need.source or need.assumed for need in needs)
    known = (resources.files("towtank") / "references.bib").read_text("utf-8")
    cited = {key for need in needs for key in re.findall(r"\b[a-z]+\d{4}\b", need.source)}
    assert cited == {"imo2002"}
    assert all(f"{{{key}," in known for key in cited)
    # What a ship's limit is taken from says so; the project's own are marked.
    assert all(need.assumed or "imo2002" in need.source or "straight-line" in need.source for need in needs)


def test_the_standard_set_leaves_out_what_a_craft_has_not_and_judges_the_rest(model: Model):
    bare = replace(model, craft=replace(model.craft, fins=()))
    names = {r.name for r in assess(bare).requirements}
    assert "horizontal plane stable, fins fixed" in names
    assert not names & {"instability loop", "tactical diameter", "elevator reversal below the speed"}


def test_a_verdict_comes_back_whole_and_an_older_one_without_what_it_had_not(model, population, tmp_path):
    trials = [run_trial(m, t) for m, t in two(model)]
    found = assess(model, trials, population=population, ready=two(model))
    path = write_verdict(found, tmp_path / "verdict.json")
    text = path.read_text()
    assert write_verdict(read_verdict(path), tmp_path / "again.json").read_text() == text
    document = json.loads(text)
    assert {"drivers", "margin", "probability", "std"} <= set(document["requirements"][0])
    for key in ("criteria", "against_speed", "fins", "together", "drawn"):
        del document[key]
    old = ("name", "value", "unit", "limit", "met", "note")
    document["requirements"] = [{key: r[key] for key in old} for r in document["requirements"]]
    path.write_text(json.dumps(document))
    back = read_verdict(path)
    assert back.criteria == back.fins == ()
    assert back.against_speed is None
    assert [r.name for r in back.requirements] == [r.name for r in found.requirements]
    assert not any(r.sense for r in back.requirements)


def test_an_unlimited_speed_stays_one_in_the_file(tmp_path):
    verdict = assess(synthetic.model(synthetic.STABLE, std=0.02))
    speed = next(c for c in verdict.criteria if c.name == "critical_speed")
    assert math.isinf(speed.value)
    back = read_verdict(write_verdict(verdict, tmp_path / "verdict.json"))
    assert next(c for c in back.criteria if c.name == "critical_speed").value == math.inf


def test_an_empty_set_of_requirements_leaves_out_what_takes_time(model: Model):
    verdict = assess(model, requirements=())
    assert [r.name for r in verdict.requirements] == ["level flight", "pilot stable"]
    assert verdict.criteria == verdict.fins == ()


def test_the_page_shows_each_requirement_with_margin_probability_and_driver(model: Model, population: Population):
    trials = [run_trial(m, t) for m, t in two(model)]
    found = assess(model, trials, population=population, ready=two(model))
    section = verdict_section(Study(verdict=found, model=model, derivatives=model.derivatives), Sketchbook("t"))
    tables = {block.title: block for block in section.blocks if isinstance(block, Table)}
    rows = {row[0]: row for row in tables["Requirements"].rows}
    asked = [r for r in found.requirements if r.sense]
    assert list(rows) == [r.name for r in asked]
    for r in asked:
        assert rows[r.name][7] == ("met" if r.met else "not met")
        if r.drivers:
            assert rows[r.name][8].startswith(r.drivers[0].coefficient)
    assert {"Closed-form criteria", "Checks", "Where the limits come from"} <= set(tables)
    assert len(tables["What the fins are asked for"].rows) == 3  # and the circle at the largest rudder
    assert sum(isinstance(block, Picture) for block in section.blocks) >= 3
    words = " ".join(block.words for block in section.blocks if isinstance(block, Text))
    assert f"Of {len(asked)} requirements" in words
    assert found.drawn in tables["Requirements"].note
