"""What a pilot designed from any craft's linear model must do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import synthetic_craft as synthetic
from towtank.errors import InputError, TrialError
from towtank.model.algebra import MATH
from towtank.model.linear import horizontal
from towtank.pilot.allocation import RUDDER_FIRST, YAW_AND_PITCH_FIRST, allocation, share
from towtank.pilot.design import design_pilot
from towtank.pilot.effort import effort
from towtank.pilot.law import wrapped
from towtank.trials.integrate import Leg, free_run
from towtank.trials.mission import lawnmower
from towtank.trials.start import setting
from towtank.trials.steps import depth_step, heading_step

STEADY = np.radians(0.5)


@pytest.fixture(scope="module")
def unstable():
    return synthetic.model(synthetic.SUBOFF)


@given(
    Yuv=st.floats(0.4, 2.5), Nuv=st.floats(0.3, 1.6), Yur=st.floats(0.5, 1.5), Nur=st.floats(0.5, 2.0),
    fins=st.floats(0.6, 2.0), lag=st.floats(0.05, 0.6), speed=st.floats(1.1, 3.0),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_the_closed_loops_are_stable_for_any_plausible_craft(Yuv, Nuv, Yur, Nur, fins, lag, speed):
    factors = {"Yuv": Yuv, "Nuv": Nuv, "Yur": Yur, "Nur": Nur, "Yuudr": fins, "Nuudr": fins}
    primes = {name: value * factors.get(name, 1.0) for name, value in synthetic.SUBOFF.items()}
    pilot = design_pilot(synthetic.model(primes, lag=lag, speed=speed))
    for loop, eigenvalues in pilot.eigenvalues.items():
        assert max(s.real for s in eigenvalues) < 0.0, loop
    assert pilot.margins["heading"][2] > np.radians(20.0)


def test_a_craft_that_does_not_hold_its_course_holds_it_under_the_pilot(unstable):
    assert horizontal(unstable, 1.0).eigenvalues.real.max() > 0.0
    assert max(s.real for s in design_pilot(unstable).eigenvalues["heading"]) < 0.0


def test_eigenvalues_of_the_design_are_those_of_the_flying_law():
    # The loops are flown as code with limits and schedule; its slope at rest must be the designed closed loop. The CG
    # is put near the axis, because the loops are designed one by one and a low CG couples sway with roll.
    unstable = synthetic.model(synthetic.SUBOFF, zg=0.001)
    s = setting(unstable, 1.0)
    helm = replace(s.helm, heading=0.0, depth=0.0)

    def rates(y):
        command, own = helm.order(list(y[:16]), list(y[16:]))
        return np.array([*unstable.rates(list(y[:16]), helm.allocation.fins(command), s.thrust), *own])

    step = 1e-7
    slope = np.array([(rates(s.state + step * e) - rates(s.state - step * e)) / (2.0 * step) for e in np.eye(19)]).T
    found = np.linalg.eigvals(slope)
    for loop in ("heading", "depth", "roll"):
        for value in s.helm.pilot.eigenvalues[loop]:
            assert np.abs(found - value).min() < 0.005 * abs(value), (loop, value)


@given(rudder=st.floats(-1.0, 1.0), elevator=st.floats(-1.0, 1.0), aileron=st.floats(-1.0, 1.0), first=st.booleans())
def test_no_fin_is_asked_beyond_its_limit_and_yaw_and_pitch_keep_their_ratio(rudder, elevator, aileron, first):
    fins = allocation(synthetic.craft())
    order = RUDDER_FIRST if first else YAW_AND_PITCH_FIRST
    granted = share((rudder, elevator, aileron), fins.rows, fins.limits, order, MATH)
    assert max(abs(a) for a in fins.fins(granted)) <= np.radians(25.0) * (1.0 + 1e-12)
    if not first:
        assert granted[0] * elevator == pytest.approx(granted[1] * rudder, abs=1e-12)
    else:
        assert abs(granted[0]) == pytest.approx(min(abs(rudder), np.radians(25.0)))
    assert all(
        got * want >= 0.0 and abs(got) <= abs(want) + 1e-15
        for got, want in zip(granted, (rudder, elevator, aileron), strict=True)
    )


@given(st.floats(-50.0, 50.0))
def test_heading_errors_take_the_short_way(angle):
    assert -np.pi <= wrapped(angle, MATH) <= np.pi
    assert np.cos(wrapped(angle, MATH)) == pytest.approx(np.cos(angle), abs=1e-9)


def test_fins_never_exceed_limit_nor_rate(unstable):
    quick = synthetic.model(synthetic.SUBOFF, rate=5.0, limit=15.0)
    trial = heading_step(quick, "120 deg", lengths=15.0)
    # The integrator's interpolation between steps may pass a corner by its tolerance, 1e-4 of a radian per step.
    assert np.abs(trial.delta).max() <= np.radians(15.0) + 2e-3
    swing = np.abs(np.diff(trial.delta, axis=0)) / np.diff(trial.time)[:, None]
    assert swing.max() <= np.radians(5.0) * 1.02
    assert trial.indices["fin_saturation"][0] > 1.0  # the step was large enough to try the limit


def test_heading_step_settles_without_error_in_a_current(unstable):
    trial = heading_step(unstable, "30 deg", current=(0.2, 0.3, 0.0), lengths=80.0)
    # The slowest eigenvalue is 0.01 1/s: 80 lengths are 6 time constants.
    assert abs(trial.indices["last_error"][0]) < 0.05
    assert trial.status == "done"


def test_a_uniform_current_does_not_change_the_motion_through_the_water(unstable):
    still, moving = (heading_step(unstable, current=c, lengths=15.0) for c in ((0.0, 0.0, 0.0), (0.3, -0.2, 0.0)))
    # Same equations in a moving frame; the two integrations choose different steps.
    assert moving.attitude == pytest.approx(still.attitude, abs=1e-3)
    drift = moving.position - still.position
    assert drift[-1, :2] == pytest.approx(np.array([0.3, -0.2]) * moving.time[-1], abs=0.05)


def test_depth_step_with_net_weight_has_no_lasting_error():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.2, speed=2.0)
    trial = depth_step(heavy, "3 m", lengths=110.0)
    assert abs(trial.indices["last_error"][0]) < 0.02
    assert trial.setpoint["depth"][-1] == pytest.approx(3.0)


def test_the_integral_takes_out_a_weight_the_trim_does_not_know():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.2, speed=2.0)
    s = setting(heavy, None)
    start = s.state.copy()
    start[17] = 0.0  # the elevator's trim forgotten
    leg = Leg("hold", replace(s.helm, heading=0.0, depth=0.0), 110.0 * s.convective)
    flight = free_run(heavy, start, [leg], thrust=s.thrust, interval=s.convective)
    assert np.abs(flight.state[:, 2]).max() > 0.1
    assert abs(flight.state[-1, 2]) < 0.02


def test_saturation_does_not_wind_up(unstable):
    # Fins at their limit for a large part of the turn; the integrators must not turn that into overshoot.
    trial = heading_step(unstable, "150 deg")
    assert trial.indices["fin_largest"][0] > 24.9
    assert trial.indices["overshoot_share"][0] < 5.0


def test_a_heading_step_to_port_mirrors_one_to_starboard(unstable):
    port, starboard = heading_step(unstable, "-40 deg", lengths=15.0), heading_step(unstable, "40 deg", lengths=15.0)
    assert port.position[:, 1] == pytest.approx(-starboard.position[:, 1], abs=1e-6)
    assert port.attitude[:, 2] == pytest.approx(-starboard.attitude[:, 2], abs=1e-6)


def test_the_lawnmower_keeps_its_legs(unstable):
    trial = lawnmower(unstable, legs=2, current=(0.0, 0.1, 0.0))
    assert trial.status == "done"
    # The lookahead is 10 lengths for this slow heading loop, so a leg of 25 is long enough to come within one.
    assert trial.indices["off_track_rms"][0] < 1.0 * unstable.craft.length
    assert trial.indices["depth_error_rms"][0] < 0.1


def test_effort_of_a_known_fin_motion():
    time = np.linspace(0.0, 10.0, 2001)
    delta = np.radians(10.0) * np.sin(2.0 * np.pi * time)[:, None]
    out = effort(time, delta, np.tile([2.0, 0.0, 0.0], (len(time), 1)), [np.radians(25.0)])
    assert out["fin_rms"][0] == pytest.approx(10.0 / np.sqrt(2.0), rel=1e-3)
    assert out["fin_travel"][0] == pytest.approx(40.0 * 10.0 / 20.0, rel=1e-3)  # 40 deg a cycle, 10 cycles, 20 m
    assert out["fin_saturation"][0] == 0.0


def test_a_craft_that_cannot_be_steered_is_told_so(unstable):
    bare = replace(unstable, craft=replace(unstable.craft, fins=()))
    with pytest.raises(TrialError, match="no fins"):
        design_pilot(bare)
    with pytest.raises(TrialError, match="no gains stabilise heading"):
        design_pilot(unstable.with_values(Yuudr=0.0, Nuudr=0.0))
    with pytest.raises(InputError, match="forward speed"):
        design_pilot(unstable, 0.0)


def test_below_the_inversion_speed_the_pilot_says_so():
    slow = synthetic.model(synthetic.SUBOFF, speed=0.5)
    pilot = design_pilot(slow)
    assert any("inversion" in note for note in pilot.notes)
    assert max(s.real for s in pilot.eigenvalues["depth"]) < 0.0
