"""What predictive control promises: the regulator where no limit acts, the limits where they do, no standing error."""

from __future__ import annotations

import builtins

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import synthetic_craft as synthetic
from towtank.errors import InputError, TowtankError
from towtank.pilot.design import design_pilot
from towtank.pilot.loops import STATES
from towtank.tuning.cases import STEPS, cases
from towtank.tuning.cost import price
from towtank.tuning.predictive import _decide, _solver, fly_predictive, programme


@pytest.fixture(scope="module")
def flights():
    # Fast enough that no turn slows the craft to the elevator's inversion speed of 0.8 m/s.
    craft = synthetic.model(synthetic.SUBOFF, speed=2.0, net_buoyancy=-0.2)
    return {case.name: case for case in cases(craft, design_pilot(craft), (2.0,), ("both", "hard"), 0, 1)}


@pytest.fixture(scope="module")
def flown(flights):
    return {name: fly_predictive(case) for name, case in flights.items()}


def test_without_limits_in_reach_a_decision_is_that_of_the_regulator(flights):
    # The cost behind the horizon is the regulator's, so the horizon does not matter; weights written out again.
    case, period = flights["both"], 0.3
    for horizon in (3, 40):
        plan = programme(case, 2.0, period, horizon)
        Q = np.zeros((14, 14))
        length = case.model.craft.length
        for name, size in {"psi": np.radians(20.0), "z": 0.5 * length, "phi": np.radians(5.0)}.items():
            Q[STATES.index(name), STATES.index(name)] = size**-2.0
        third, mixing = np.radians(25.0) / 3.0, np.asarray(case.model.craft.mixing)[:, :2]
        Q[10:12, 10:12] = mixing.T @ mixing / 4.0 / third**2
        R = mixing.T @ mixing / 4.0 / (period * third / (0.25 * length / 2.0)) ** 2
        P = solve_discrete_are(plan.A, plan.B, Q, R)
        K = np.linalg.solve(R + plan.B.T @ P @ plan.B, plan.B.T @ P @ plan.A)
        X = np.zeros(14)
        X[[STATES.index("psi"), STATES.index("z"), STATES.index("r")]] = 0.02, -0.05, 0.001
        change, solved = _decide(_solver(plan), plan, X, np.zeros(14))
        assert solved
        assert change == pytest.approx(-K @ X, rel=1e-5)


def test_fins_are_never_asked_beyond_their_limits_and_reach_them(flights, flown):
    case, made = flights["hard"], flown["hard"]
    asked = made.command @ np.asarray(case.model.craft.mixing)[:, :2].T
    limit, rate = np.radians(25.0), np.radians(30.0) * made.period
    assert np.abs(asked).max() == pytest.approx(limit, rel=1e-6)
    assert np.abs(np.diff(asked, axis=0)).max() <= rate * (1.0 + 1e-9)
    assert made.failed == 0


def test_fins_that_stand_askew_leave_no_error(flights, flown):
    for name in ("both", "hard"):
        step, length = STEPS[name], flights[name].model.craft.length
        last = flown[name].seen[-1]
        # 45 lengths are 15 times the three lengths looked ahead.
        assert np.degrees(abs(last[0] - step.heading)) < 0.1
        assert abs(last[1] - step.depth * length) < 0.01 * length


def test_it_costs_less_than_the_cascade(flights, flown):
    # Both are chosen for the same cost, but the prediction knows sway and heave, and the order of both planes at once.
    case = flights["both"]
    cascade = price(case, case.fly(case.setting.pilot)).total
    assert price(case, flown["both"].seen).total < 0.9 * cascade


def test_the_target_holds_the_orders_against_a_lasting_error(flights):
    plan = programme(flights["both"], 2.0, 0.3, 2)
    error = plan.B @ np.array([0.01, -0.02])  # fins askew: the craft moves, the command does not
    error[12:] = 0.0
    X = plan.target @ error
    assert plan.A @ X + error == pytest.approx(X, abs=1e-9)
    assert X[[STATES.index("psi"), STATES.index("z")]] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert X[12:] == pytest.approx([-0.01, 0.02], rel=1e-6)


def test_what_it_needs_is_told(flights, monkeypatch):
    with pytest.raises(InputError, match="two or more"):
        fly_predictive(flights["both"], 1)
    real = builtins.__import__

    def absent(name, *args, **kwargs):
        if name == "casadi":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(TowtankError, match=r"towtank\[optimal\]"):
        fly_predictive(flights["both"])
