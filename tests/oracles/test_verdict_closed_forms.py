"""Criteria of many craft against the equations of motion: eigenvalues, flights at rest, loads, turns one by one."""

from __future__ import annotations

from dataclasses import replace
from statistics import NormalDist

import engine_cases
import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.plan import Leg, Log
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.model.equations import STATE, Model
from towtank.model.linear import elevator_reversal_speed, linearise
from towtank.pilot.orders import Orders
from towtank.symbols import FOURFOLD_TIES
from towtank.trials.circle import turning_circle
from towtank.trials.steady import steady_turns
from towtank.trials.straight import straight_run
from towtank.verdict.criteria import growth, plane_criteria
from towtank.verdict.fins import fin_use
from towtank.verdict.many import Many, Population, drawn
from towtank.verdict.measures import MEASURES, critical_speed, munk_speed, reversal_speed, swing_period
from towtank.verdict.speeds import speed_sweep
from towtank.verdict.steps import stepped
from towtank.verdict.turns import many_turns


def alone(model: Model) -> Many:
    return Many(model, {"m": np.array([model.constants.body.m])})


def one_of(model: Model, craft: Many, i: int) -> Model:
    """Craft i by itself."""
    return model.with_values(**{name: float(values[i]) for name, values in craft.columns.items()})


@pytest.fixture(scope="module")
def vague() -> Model:
    return synthetic.model(synthetic.SUBOFF, std=0.1)


@pytest.mark.parametrize(("axis", "name"), [(3, "phi"), (4, "theta")])
def test_a_craft_at_rest_swings_with_the_period(axis: int, name: str):
    # Without roll and pitch damping of second degree the swing of 0.5 deg is free of damping.
    model = synthetic.model({**synthetic.SUBOFF, "Nrr": 0.0, "Yrr": 0.0})
    period = float(swing_period(alone(model), axis)[0])
    state = np.zeros(12 + len(model.craft.fins))
    state[axis] = np.radians(0.5)
    leg = Leg("swing", Orders(), 3.0 * period)
    flown = fly(model, at(state), (leg,), thrust=0.0, log=Log((name,)))
    angle = flown.series(name)[0]
    turned = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    share = angle[turned] / (angle[turned] - angle[turned + 1])
    crossings = flown.time[turned] + share * (flown.time[turned + 1] - flown.time[turned])
    # 1e-3: the crossing is found by a straight line between samples 0.1 s apart.
    assert np.diff(crossings).mean() == pytest.approx(period, rel=1e-3)


def test_the_roll_period_is_the_metacentric_one_with_sway_free():
    model = synthetic.model({**synthetic.SUBOFF, "Yrdot": 0.0, "Nvdot": 0.0})
    b, d = model.constants.body, model.derivatives
    # Sway follows roll through m zG; nothing else couples with it.
    inertia = b.Ixx - d["Kpdot"] - (b.m * b.zG) ** 2 / (b.m - d["Yvdot"])
    expected = 2.0 * np.pi * np.sqrt(inertia / (b.m * b.g * (b.zG - b.zB)))
    assert swing_period(alone(model), 3)[0] == pytest.approx(expected, rel=1e-9)


def test_a_craft_that_is_not_upright_has_no_period_and_no_speed_limit():
    model = synthetic.model(synthetic.SUBOFF, zg=-0.02)
    craft = alone(model)
    assert np.isinf(swing_period(craft, 3)[0])
    assert munk_speed(craft)[0] == 0.0
    assert critical_speed(craft)[0] == 0.0
    assert MEASURES["metacentric_height"].of(craft)[0] == pytest.approx(-0.02)


def test_the_vertical_plane_turns_unstable_at_the_critical_speed(vague: Model):
    craft = drawn(vague, 60, seed=4).craft
    found = critical_speed(craft)
    limited = np.flatnonzero(np.isfinite(found) & (found > 0.0))
    assert len(limited) > 40
    for i in limited:
        one = Many(vague, {name: values[i : i + 1] for name, values in craft.columns.items()})
        assert growth(one, "vertical", 0.99 * found[i])[0] < 0.0 < growth(one, "vertical", 1.01 * found[i])[0]
    always = np.flatnonzero(np.isinf(found))
    for i in always:
        one = Many(vague, {name: values[i : i + 1] for name, values in craft.columns.items()})
        assert max(growth(one, "vertical", speed)[0] for speed in (0.2, 1.0, 5.0, 50.0)) < 0.0


def test_a_craft_stable_at_high_speed_has_no_critical_speed():
    craft = alone(synthetic.model(synthetic.STABLE))
    assert MEASURES["G_v"].of(craft)[0] > 0.0
    assert np.isinf(critical_speed(craft)[0])


def test_at_the_munk_speed_incidence_and_weight_balance():
    model = synthetic.model(synthetic.SUBOFF)
    speed, pitch = float(munk_speed(alone(model))[0]), 1e-5
    state = np.zeros(12 + len(model.craft.fins))
    # Carried along level with a small pitch angle: u = U cos, w = U sin.
    state[STATE.index("theta")], state[6], state[8] = pitch, speed * np.cos(pitch), speed * np.sin(pitch)
    loads = model.loads(state, 0.0)
    moment = loads["damping"][4] + loads["restoring"][4]
    assert abs(moment) < 1e-4 * abs(loads["restoring"][4])


def test_the_reversal_speed_is_that_of_the_linear_model(vague: Model):
    craft = drawn(vague, 30, seed=1).craft
    found = reversal_speed(craft)
    for i in range(31):
        known = elevator_reversal_speed(one_of(vague, craft, i), "wide")
        assert found[i] == pytest.approx(known or 0.0, rel=1e-9)


@pytest.mark.parametrize("case", engine_cases.CASES)
def test_turns_of_many_craft_are_those_found_one_by_one(case: str):
    model = engine_cases.model(case)
    d = model.derivatives
    # Thrust and propeller are those of the best estimate: the resistance is the same for all.
    std = np.where(np.array(d.names) == "Xuu", 0.0, 0.05 * d.values)
    model = replace(model, derivatives=replace(d, covariance_fit=np.diag(std**2)))
    craft = drawn(model, 4, seed=2).craft
    turns = many_turns(craft, 1.0)
    width, height = turns.loop()
    for i in range(5):
        each = steady_turns(one_of(model, craft, i), 1.0)
        got = np.isfinite(turns.rudder[i])
        assert len(each.rudder) == got.sum()
        # 1e-6 rad: both stop at a residual of 1e-9 in U2/L, and the fins have a weaker effect than the hull.
        np.testing.assert_allclose(turns.rudder[i, got], each.rudder, atol=1e-6)
        np.testing.assert_allclose(turns.rate[i, got], each.rate, rtol=1e-5, atol=1e-8)
        assert width[i] == pytest.approx(each.rudder_span(), abs=1e-6)
        assert height[i] == pytest.approx(each.rate_span(), abs=1e-6)


def test_a_stable_craft_has_no_loop():
    craft = drawn(synthetic.model(synthetic.STABLE, std=0.01), 50).craft
    assert (growth(craft, "horizontal", 1.0) < 0.0).all()
    for name in ("loop_width", "loop_height"):
        np.testing.assert_allclose(MEASURES[name].of(craft), 0.0, atol=1e-12)


def test_with_one_uncertain_slope_the_interval_of_the_index_is_that_of_a_normal():
    base = synthetic.model(synthetic.STABLE)
    d, body = base.derivatives, base.constants.body
    std = 0.1 * abs(d["Nuv"])
    only = np.zeros_like(d.covariance)
    only[d.names.index("Nuv"), d.names.index("Nuv")] = std**2
    model = replace(base, derivatives=replace(d, covariance_fit=only))
    slope = abs((d["Yur"] - body.m) / (d["Yuv"] * (d["Nur"] - body.m * body.xG)))
    low, high = plane_criteria(model, "horizontal", 1.0).index_range
    half = NormalDist().inv_cdf(0.95) * slope * std
    # Four standard errors of a 5 % quantile of 2000 samples: sqrt(0.05 0.95 / 2000) / 0.103 = 0.047 std each.
    index = 1.0 - d["Nuv"] * (d["Yur"] - body.m) / (d["Yuv"] * d["Nur"])
    assert low == pytest.approx(index - half, abs=0.19 * slope * std)
    assert high - low == pytest.approx(2.0 * half, abs=2.0 * 0.19 * slope * std)


def test_a_step_of_one_slope_changes_the_index_by_its_derivative(vague: Model):
    steps = stepped(vague)
    d, body = vague.derivatives, vague.constants.body
    effect = dict(zip(steps.names, steps.effect(MEASURES["G_h"].of(steps.craft)), strict=True))
    slope = -(d["Yur"] - body.m) / (d["Yuv"] * (d["Nur"] - body.m * body.xG))
    # G is linear in Nuv.
    assert effect["Nuv"] == pytest.approx(slope * 0.1 * abs(d["Nuv"]), rel=1e-9)
    assert effect["Xuu"] == 0.0


@pytest.mark.parametrize("std", [0.0, 0.1])
def test_what_a_symmetry_ties_moves_together(std: float):
    base = synthetic.model(synthetic.SUBOFF)
    d = base.derivatives
    # One standard uncertainty for both members of a tie, with the sign of the tie: a singular covariance.
    root = np.zeros((len(d.names), len(d.names)))
    for i, name in enumerate(d.names):
        twin = FOURFOLD_TIES.get(name, (name, 1.0))[0]
        root[i, d.names.index(twin)] = std * d.values[i]
    model = replace(base, derivatives=replace(d, covariance_fit=root @ root.T))
    steps = stepped(model)
    assert "Nuv/Muw" in steps.names
    assert len(steps.names) == len(set(d.names) - set(FOURFOLD_TIES) - {n for n in d.names if d[n] == 0.0})
    for name, (twin, sign) in FOURFOLD_TIES.items():
        if name in d.names:
            np.testing.assert_allclose(steps.craft.columns[name], sign * steps.craft.columns[twin], rtol=1e-12)
    expected = 0.05 if std == 0.0 else std
    np.testing.assert_allclose(np.abs(steps.share()), expected, rtol=1e-9)


def test_eigenvalues_against_speed_are_those_of_the_linear_model(vague: Model):
    sweep = speed_sweep(drawn(vague, 20).craft)
    for i in (0, 9, 17):
        whole = linearise(vague, sweep.speed[i])
        for plane, states in (("horizontal", ("v", "r")), ("vertical", ("w", "q", "theta"))):
            known = sorted(whole.part(states, ()).eigenvalues, key=lambda s: (s.real, s.imag))
            found = sorted(sweep.planes[plane].eigenvalues[i], key=lambda s: (s.real, s.imag))
            np.testing.assert_allclose(found, known, rtol=1e-9, atol=1e-12)
            assert sweep.planes[plane].low[i] <= sweep.planes[plane].high[i]
    assert (sweep.speed[0], sweep.speed[-1]) == pytest.approx((0.3, 2.0))


def test_the_drag_of_the_fins_is_the_term_of_the_model():
    model = synthetic.model(synthetic.STABLE)
    trial = turning_circle(model, "10 deg")
    use = fin_use(model, trial)
    u, squares = trial.nu[:, 0], (trial.delta**2).sum(axis=1)
    power = -model.derivatives["Xuudd"] * u**3 * squares
    mean = np.trapezoid(power, trial.time) / trial.time[-1]
    assert use.power == pytest.approx(mean, rel=1e-9)
    assert use.drag == pytest.approx(np.trapezoid(power, trial.time) / np.trapezoid(u, trial.time), rel=1e-9)
    # Rudder alone, four X fins: each at 10 deg; the lag of the start is 0.2 s of some minutes.
    assert use.settled == pytest.approx(100.0 * 10.0 / 25.0, rel=0.02)
    assert use.aileron == pytest.approx(15.0, abs=0.5)
    assert use.roll == pytest.approx(trial.indices["largest_roll"][0], abs=0.05)  # of samples a 20th of a length apart
    at_rest = fin_use(model, straight_run(model))
    assert at_rest.drag == 0.0
    assert at_rest.aileron == pytest.approx(25.0)


def test_a_current_along_the_course_costs_the_fins_nothing():
    from towtank.trials.steps import heading_step

    model = synthetic.model(synthetic.STABLE)
    still, carried = (fin_use(model, heading_step(model, current=flow)) for flow in ((0.0,) * 3, (0.3, 0.0, 0.0)))
    # The pilot steers by heading and speed ahead through the water: the same motion in a moving frame.
    assert carried.power == pytest.approx(still.power, rel=1e-3)


def test_a_population_of_the_best_estimate_alone_has_its_numbers(vague: Model):
    few = Population(Many(vague, {name: values[:1] for name, values in drawn(vague, 3).craft.columns.items()}))
    assert few.count == 0
    assert MEASURES["G_h"].of(few.craft)[0] == pytest.approx(plane_criteria(vague, "horizontal", 1.0).index)
