"""Acceleration and stopping against surge alone in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import synthetic_craft as synthetic
from towtank.craft.craft import Propeller
from towtank.errors import InputError
from towtank.trials.speed import Surge, acceleration, stopping, surge


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


@pytest.fixture(scope="module")
def alone(craft):
    return surge(craft, 1.0)


@pytest.mark.parametrize("throttle", [0.0, -0.5, -1.0, -2.0])
def test_the_closed_forms_solve_the_equation_of_surge(alone, throttle):
    end = 0.2 if throttle == 0.0 else 0.0

    def rates(_, state):
        u = state[0]
        return [(throttle - u * abs(u)) * alone.resistance / alone.inertia, u]

    def slow(_, state):
        return state[0] - end

    slow.terminal = True
    solved = solve_ivp(rates, (0.0, 1e5), [1.0, 0.0], events=slow, rtol=1e-10, atol=1e-12)
    assert alone.lost(end, throttle) == pytest.approx((solved.t_events[0][0], solved.y_events[0][0][1]), rel=1e-7)


def test_from_rest_the_closed_form_is_that_of_the_equation(alone):
    time, distance = alone.gained(0.9)
    solved = solve_ivp(
        lambda _, s: [(1.0 - s[0] * s[0]) * alone.resistance / alone.inertia, s[0]], (0.0, time), [0.0, 0.0], rtol=1e-10
    )
    assert solved.y[:, -1] == pytest.approx([0.9, distance], rel=1e-6)


def test_a_craft_that_coasts_has_the_speed_of_the_closed_form(craft, alone):
    trial = stopping(craft, 0.0)
    # u0 / (1 + u0 k t / m); the craft pitches by less than 0.1 deg, which takes 1e-5 of the speed.
    expected = 1.0 / (1.0 + alone.resistance * trial.time / alone.inertia)
    assert trial.nu[:, 0] == pytest.approx(expected, rel=1e-4)
    assert trial.indices["time_to_half_speed"][0] == pytest.approx(alone.time, rel=1e-4)
    assert trial.indices["track_reach"][0] == pytest.approx(alone.length * math.log(5.0), rel=1e-4)
    assert trial.indices["track_reach"][0] == pytest.approx(trial.indices["track_reach_closed_form"][0], rel=1e-4)


@pytest.mark.parametrize("throttle", [-1.0, -0.4])
def test_a_crash_stop_takes_the_time_and_the_way_of_surge_alone(craft, throttle):
    found = stopping(craft, throttle).indices
    # Measured: 1e-5, from the pitch of the craft.
    for name in ("time_to_half_speed", "time_to_stop", "track_reach"):
        assert found[name][0] == pytest.approx(found[f"{name}_closed_form"][0], rel=1e-4), name
    # The depth wanders by 0.06 m on the way.
    assert found["head_reach"][0] == pytest.approx(found["track_reach"][0], rel=1e-5)
    assert found["head_reach_lengths"][0] == pytest.approx(found["head_reach"][0] / 8.15)
    assert stopping(craft, throttle).nu[-1, 0] == pytest.approx(0.0, abs=0.02)  # the record is 0.5 s apart


def test_full_astern_at_the_thrust_of_the_approach_takes_half_of_the_length_scale_times_log_2(craft, alone):
    assert stopping(craft).indices["track_reach"][0] == pytest.approx(0.5 * alone.length * math.log(2.0), rel=1e-4)


def test_from_rest_the_craft_follows_the_hyperbolic_tangent(craft, alone):
    trial = acceleration(craft)
    assert trial.nu[0, 0] == 0.0
    assert trial.nu[:, 0] == pytest.approx(np.tanh(trial.time / alone.time), abs=1e-3)
    for share in (50, 90, 95):
        for what in ("time", "distance"):
            name = f"{what}_to_{share}_percent"
            # Slow as it starts, the craft pitches by up to 0.1 deg before its fins take hold. Measured: 2e-4.
            assert trial.indices[name][0] == pytest.approx(trial.indices[f"{name}_closed_form"][0], rel=1e-3), name


def test_a_pilot_that_holds_the_course_stops_an_unstable_craft_on_it():
    held = stopping(synthetic.model(synthetic.SUBOFF), 0.0, hold_course=True)
    assert held.loop == "closed"
    assert np.isfinite(held.setpoint["heading"]).all()
    assert np.all(held.setpoint["throttle"] == 0.0)
    assert abs(held.indices["lateral_deviation"][0]) < 1e-6


def test_a_propeller_with_a_table_has_no_closed_form_and_pulls_away_faster(craft):
    # Thrust falls with the advance ratio: at rest it is more than what balances the resistance at speed.
    table = ((0.0, 0.30, 0.04), (0.4, 0.20, 0.03), (0.8, 0.05, 0.012), (1.0, -0.03, 0.0))
    propeller = Propeller(diameter=0.4, table=table)
    screwed = replace(craft, craft=replace(craft.craft, propeller=propeller))
    assert surge(screwed, 1.0) is None
    quick, usual = acceleration(screwed), acceleration(craft)
    assert not any("closed_form" in name for name in quick.indices)
    assert quick.indices["time_to_50_percent"][0] < 0.8 * usual.indices["time_to_50_percent"][0]
    assert stopping(screwed).indices["track_reach"][0] < stopping(craft).indices["track_reach"][0]


@pytest.mark.parametrize("throttle", [0.1, -4.1, float("nan")])
def test_a_throttle_that_does_not_stop_is_refused(craft, throttle):
    with pytest.raises(InputError, match=r"astern.*-1|-1.*astern"):
        stopping(craft, throttle)


def test_a_time_scale_is_that_of_the_linear_decay_at_the_start():
    scale = Surge(inertia=200.0, resistance=4.0, speed=2.0)
    step = 1e-6
    time, _ = scale.lost(1.0 - step, 0.0)
    assert time == pytest.approx(step * 200.0 / (4.0 * 2.0), rel=1e-5)


def test_a_craft_whose_speed_is_taken_by_its_weight_says_so():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-3.0)
    trial = stopping(heavy)
    assert "did not get to half speed" in trial.status
    assert "weight residual" in trial.status
    assert np.isnan(trial.indices["track_reach"][0])
