"""A record that the model made is flown again by the model as it was."""

from dataclasses import replace

import numpy as np
import pytest

import towtank as tt
from sea_records import CLOSED, CURRENT, FINS, OPEN, TICK, swum
from towtank.craft.library import read_craft
from towtank.engine.plan import Leg, Log
from towtank.engine.run import Ensemble, fly
from towtank.errors import InputError
from towtank.field.begin import given
from towtank.field.course import course_of
from towtank.field.log import SeaLog
from towtank.field.replay import Scatter, flown, replay
from towtank.model.equations import Model
from towtank.pilot.design import design_pilot
from towtank.plan.standard import standard_plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank


@pytest.fixture(scope="module")
def model():
    craft = read_craft("hokie")
    return Model(craft, tt.derive(tow(standard_plan(craft), FastTank(members=1))))


def test_measured_fins_replay_the_motion_in_a_current(model):
    log, state = swum(model, OPEN)
    found = replay(model, log, start=given(state, CURRENT), speed=1.0)
    # The fins' own rate limit falls inside ticks: between them the replayed fin is an exponential, the record's a ramp.
    # The difference is a few hundredths of a degree for a tenth of a second.
    for name, off in (("psi", 2e-3), ("r", 2e-4), ("x", 5e-3), ("y", 5e-3), ("u", 1e-3), ("z", 1e-3)):
        assert np.abs(found[name][0] - log[name]).max() < off, name
    for name in FINS:
        np.testing.assert_allclose(found[name][0], log[name], atol=1e-12)


def test_orders_replay_through_the_pilot_to_round_off(model):
    pilot = design_pilot(model, 1.0)
    log, state = swum(model, CLOSED, pilot)
    found = replay(model, log, pilot=pilot, start=given(state, CURRENT), speed=1.0)
    assert found.loop == "closed"
    # Round-off only, grown by an unstable craft that is steered.
    for name in ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r", *FINS, "rudder", "elevator"):
        np.testing.assert_allclose(found[name][0], log[name], atol=1e-8, err_msg=name)


def test_a_record_longer_than_one_call_of_the_engine_goes_on_where_it_stopped(model, monkeypatch):
    pilot = design_pilot(model, 1.0)
    log, state = swum(model, [({"steer": 1.0, "heading": 0.02 * k, "dive": 1.0}, 5) for k in range(300)], pilot)
    begin = given(state, CURRENT)
    whole = replay(model, log, pilot=pilot, start=begin, speed=1.0)
    monkeypatch.setattr("towtank.field.replay.LEGS", 7)
    pieces = replay(model, log, pilot=pilot, start=begin, speed=1.0)
    # Heading runs beyond half a turn: it is unwrapped across the pieces.
    assert whole["psi"][0, -1] > 3.5
    for name in ("x", "y", "psi", "r", "rudder"):
        np.testing.assert_allclose(pieces[name], whole[name], atol=1e-9, err_msg=name)


def test_pieces_by_size_of_the_log_fly_the_same(model, monkeypatch):
    log, state = swum(model, OPEN)
    begin = given(state, CURRENT)
    whole = replay(model, log, start=begin, speed=1.0)
    monkeypatch.setattr("towtank.field.replay.NUMBERS", 23 * 31)
    pieces = replay(model, log, start=begin, speed=1.0)
    np.testing.assert_allclose(pieces["psi"], whole["psi"], atol=1e-9)


def test_state_and_current_are_told_from_a_record_without_noise(model):
    log, state = swum(model, [({"rudder": 0.0}, 60), ({"rudder": 0.1}, 240)])
    begin = course_of(model, log, speed=1.0).parts[0].begin
    # The window is straight and level: what is left is round-off of the fit, and for the current the trapezoid rule.
    np.testing.assert_allclose(begin.state, state, atol=2e-4)
    np.testing.assert_allclose(begin.current, CURRENT, atol=1e-3)
    assert any("m/s north" in word for word in begin_words(model, log))


def begin_words(model, log):
    return course_of(model, log, speed=1.0).words


def test_what_is_not_measured_is_told_by_the_model_or_said_to_be_zero(model):
    log, _ = swum(model, [({"rudder": 0.15}, 900)], current=np.zeros(3))
    few = {n: v for n, v in log.channels.items() if n in ("psi", "z", "ahead", "r", "theta", *FINS)}
    bare = replace(log, channels=few)
    course = course_of(model, bare, horizon=30.0, speed=1.0)
    last = course.parts[-1]
    assert "current: not told" in course.words[0]
    assert (course.current.flow == 0.0).all()
    assert any(word.startswith("v: not measured") for word in last.begin.words)
    assert any("x, y, phi: not measured" in word for word in last.begin.words)
    # A steady turn has no sway acceleration. The heel, not measured, turns the weight residual into sway:
    # a tenth of it.
    assert last.begin.state[7] == pytest.approx(log["slip"][last.first], rel=0.15)


def test_a_horizon_begins_again_from_the_record(model):
    log, _ = swum(model, OPEN)
    other = model.with_values(Nuv=0.8 * model.derivatives["Nuv"])
    whole = replay(other, log, speed=1.0)
    short = replay(other, log, horizon=5.0, speed=1.0)
    assert len(short.course.parts) == 6
    begins = [part.first for part in short.course.parts[1:]]
    # At its begin a part stands on the record, to what a parabola over two seconds misses of a turn.
    np.testing.assert_allclose(short["psi"][0, begins[-1] + 1], log["psi"][begins[-1] + 1], atol=0.02)
    off = [np.sqrt(np.mean((one["psi"][0] - log["psi"]) ** 2)) for one in (short, whole)]
    assert off[0] < 0.3 * off[1]


def test_a_hole_in_the_fins_is_not_flown(model):
    log, _ = swum(model, OPEN)
    hole = (log.time > 10.0) & (log.time < 13.0)
    broken = replace(log, channels={n: np.where(hole & (n in FINS), np.nan, v) for n, v in log.channels.items()})
    found = replay(model, broken, speed=1.0)
    assert len(found.course.parts) == 2
    assert np.isnan(found["r"][0][(log.time > 10.2) & (log.time < 12.8)]).all()
    assert any("are not flown" in word for word in found.words)


def test_many_craft_fly_as_each_would_alone(model):
    log, state = swum(model, OPEN)
    begin = given(state, CURRENT)
    factors = np.array([0.9, 1.0, 1.1])
    columns = {"Nuv": factors * model.derivatives["Nuv"]}
    many = flown(course_of(model, log, start=begin, speed=1.0), Scatter(columns, np.zeros((3, 3))))
    for i, factor in enumerate(factors):
        one = replay(model.with_values(Nuv=factor * model.derivatives["Nuv"]), log, start=begin, speed=1.0)
        # Kept in single precision.
        np.testing.assert_allclose(many["psi"][i], one["psi"][0], atol=1e-5)


def test_a_drawn_current_moves_the_craft_with_the_water(model):
    log, state = swum(model, OPEN)
    begin = replace(given(state, CURRENT), current_std=np.array([0.02, 0.0, 0.0]), through=(True, True, True))
    many = flown(course_of(model, log, start=begin, speed=1.0), Scatter({}, np.array([[0.0] * 3, [1.0, 0.0, 0.0]])))
    drift = many["x"][1] - many["x"][0]
    # The water is a Galilean frame: the second craft drifts by the current times the time, and does all else alike.
    np.testing.assert_allclose(drift, 0.02 * log.time, atol=2e-4)
    np.testing.assert_allclose(many["psi"][1], many["psi"][0], atol=1e-5)


def test_a_slow_record_is_steered_at_the_pace_of_the_pilot(model):
    pilot = design_pilot(model, 1.0)
    log, state = swum(model, CLOSED, pilot)
    slow = SeaLog("slow", "hokie", log.time[::10], {n: v[::10] for n, v in log.channels.items()})
    found = replay(model, slow, pilot=pilot, start=given(state, CURRENT), speed=1.0)
    assert found.course.every == 10
    np.testing.assert_allclose(found["psi"][0], slow["psi"], atol=1e-6)


def test_an_order_holds_until_the_next(model):
    pilot = design_pilot(model, 1.0)
    log, state = swum(model, CLOSED, pilot)
    changed = {}
    for name in ("heading_order", "depth_order"):
        kept = np.full(len(log.time), np.nan)
        kept[[0, 50]] = log[name][[0, 50]]
        changed[name] = kept
    rare = replace(log, channels={**log.channels, **changed})
    found = replay(model, rare, pilot=pilot, start=given(state, CURRENT), speed=1.0)
    np.testing.assert_allclose(found["psi"][0], log["psi"], atol=1e-8)


def test_a_rate_of_turn_that_is_ordered_is_followed(model):
    pilot = design_pilot(model, 1.0)
    legs = [
        ({"steer": 1.0, "heading": 0.0, "dive": 1.0, "depth": 0.0}, 50),
        ({"steer": 1.0, "turning": 1.0, "turn": 0.02, "dive": 1.0, "depth": 0.0}, 200),
    ]
    log, state = swum(model, legs, pilot)
    found = replay(model, log, pilot=pilot, start=given(state, CURRENT), speed=1.0)
    np.testing.assert_allclose(found["psi"][0], log["psi"], atol=1e-8)


def test_a_record_of_orders_alone_is_flown_in_closed_loop(model):
    pilot = design_pilot(model, 1.0)
    log, state = swum(model, CLOSED, pilot)
    bare = {n: v for n, v in log.channels.items() if n not in (*FINS, "rudder", "elevator", "aileron")}
    # Level flight before the first order asks for no fins but the trim, which the record would have told.
    found = replay(model, replace(log, channels=bare), pilot=pilot, start=given(state, CURRENT), speed=1.0)
    assert np.abs(found["psi"][0] - log["psi"]).max() < 0.02


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda log: replace(log, channels={"psi": log["psi"]}), "says nothing of the fins"),
        (lambda log: replace(log, craft="remus"), "record of remus"),
        (
            lambda log: SeaLog("s", "hokie", log.time[:15], {n: v[:15] for n, v in log.channels.items()}),
            "2 s are needed",
        ),
    ],
)
def test_a_record_that_cannot_be_replayed_is_refused(model, change, said):
    log, _ = swum(model, OPEN)
    with pytest.raises(InputError, match=said):
        replay(model, change(log))


def test_a_record_without_orders_is_no_closed_loop(model):
    log, _ = swum(model, OPEN)
    with pytest.raises(InputError, match="holds no order"):
        replay(model, log, pilot=design_pilot(model, 1.0))


def test_a_horizon_too_short_is_refused(model):
    log, _ = swum(model, OPEN)
    with pytest.raises(InputError, match="horizon"):
        replay(model, log, horizon=0.5)


def test_craft_of_an_ensemble_are_those_of_the_engine(model):
    # The ensemble of a replay is the engine's own: one more column flies like a run of the engine with it.
    log, state = swum(model, OPEN)
    course = course_of(model, log, start=given(state, CURRENT), speed=1.0)
    column = {"Nur": np.array([1.2 * model.derivatives["Nur"]] * 2)}
    many = flown(course, Scatter(column, np.zeros((2, 3))))
    legs = [Leg(f"{i}", tt.pilot.orders.Orders(*row), TICK) for i, row in enumerate(course.orders.tolist())]
    run = fly(
        course.model, course.drive.start(0, state), legs, thrust=course.drive.thrust, current=tuple(CURRENT),
        clock=course.clock, log=Log(("r",)), ensemble=Ensemble(2, column),
    )  # fmt: skip
    np.testing.assert_allclose(many["r"][0], run.series("r")[0], atol=1e-7)


def test_between_fixes_the_position_is_reckoned(model):
    log, _ = swum(model, [({"rudder": 0.1}, 600), ({"rudder": -0.15}, 600)])
    rare = np.isin(np.arange(len(log.time)), [0, 5, 10, 15, 20, 25, 30, 1170, 1175, 1180, 1185, 1190, 1195, 1200])
    few = {n: np.where(rare | (n not in ("x", "y")), v, np.nan) for n, v in log.channels.items()}
    course = course_of(model, replace(log, channels=few), horizon=20.0, speed=1.0)
    for part in course.parts:
        # Fixes two minutes apart; the trapezoid rule and the begin's parabola leave some centimetres.
        np.testing.assert_allclose(part.begin.state[:2], [log["x"][part.first], log["y"][part.first]], atol=0.1)
    assert any("reckoned from the nearest fixes" in word for word in course.words)


def test_errors_stated_of_begin_and_current_are_those_of_many_noisy_records(model):
    log, _ = swum(model, [({"rudder": 0.05}, 300), ({"rudder": -0.05}, 300)])
    std = {"psi": 0.005, "r": 0.001, "z": 0.01, "ahead": 0.01, "slip": 0.01, "x": 0.5, "y": 0.5}
    places = {5: "psi", 11: "r", 2: "z"}
    off, drift = [], []
    for seed in range(12):
        random = np.random.default_rng(seed)
        noisy = {n: v + random.normal(0.0, std[n], len(v)) for n, v in log.channels.items() if n in std}
        kept = {n: v for n, v in log.channels.items() if n in ("phi", "theta", "p", "q", "w", "plunge", *FINS)}
        course = course_of(model, replace(log, channels={**kept, **noisy}), horizon=10.0, speed=1.0)
        for part in course.parts[1:]:
            errors = [part.begin.state[i] - log[name][part.first] for i, name in places.items()]
            off.append(np.array(errors) / part.begin.state_std[list(places)])
        drift.append((course.current.flow - CURRENT)[:2] / course.current.std[:2])
    # 60 begins: the rms of a standard normal is 1 to 9 %. The fit of some twenty samples knows its error to 15 %.
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(off), axis=0)), 1.0, atol=0.3)
    # 24 numbers, from twelve groups each: 1 to 15 %, and some more for the groups.
    assert np.sqrt(np.mean(np.square(drift))) == pytest.approx(1.0, abs=0.35)
