"""Open-loop trials against the linear model; ``test_trials_exact`` has the crafts that are exactly linear."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.signal import StateSpace, lsim

import synthetic_craft as synthetic
from towtank.model.linear import horizontal, linearise
from towtank.pilot.plant import block
from towtank.trials.circle import turning_circle
from towtank.trials.pullout import pull_out
from towtank.trials.spiral import spiral
from towtank.trials.start import ballasted, level_trim, setting, slowest_level_speed
from towtank.trials.steady import steady_turns
from towtank.trials.straight import straight_run

LINEAR = {**synthetic.STABLE, "Yvv": 0.0, "Nvv": 0.0, "Nrr": 0.0, "Xvr": 0.0, "Xrr": 0.0, "Xuudd": 0.0}


@pytest.fixture(scope="module")
def stable():
    return synthetic.model(synthetic.STABLE, zg=0.01)


@pytest.fixture(scope="module")
def unstable():
    return synthetic.model(synthetic.SUBOFF)


@pytest.fixture(scope="module")
def linear():
    return synthetic.model(LINEAR, zg=0.01)


@pytest.fixture(scope="module")
def gentle(linear):
    return turning_circle(linear, "2 deg")


def test_small_rudder_gives_the_linear_steady_turn(linear, gentle):
    indices = gentle.indices
    # Linear turning is similar at every speed: compare at the speed that is left in the turn.
    speed = 1.0 - indices["speed_loss"][0] / 100.0
    plane = horizontal(linear, speed)
    steady = -np.linalg.solve(plane.A, plane.B[:, 0]) * np.radians(2.0)
    # What is left: the means are taken over the last quarter turn, and v is taken for the sine of the drift.
    assert np.radians(indices["yaw_rate"][0]) == pytest.approx(steady[1], rel=0.005)
    assert np.radians(indices["drift_angle"][0]) == pytest.approx(-steady[0] / speed, rel=0.005)
    assert indices["steady_diameter"][0] == pytest.approx(2.0 * speed / abs(steady[1]), rel=0.005)


def test_distances_of_the_circle_are_those_of_the_linear_response(linear, gentle):
    plane, lag = horizontal(linear, 1.0), linear.craft.fins[0].time_constant
    A = np.zeros((4, 4))
    A[:2, :2], A[:2, 2], A[2, 2], A[3, 1] = plane.A, plane.B[:, 0], -1.0 / lag, 1.0
    time = np.linspace(0.0, 600.0, 24001)
    delta = np.full_like(time, np.radians(2.0))
    response = lsim(
        StateSpace(A, np.array([[0.0], [0.0], [1.0 / lag], [0.0]]), np.eye(4), np.zeros((4, 1))), delta, time
    )[1]
    v, psi = response[:, 0], response[:, 3]
    north = cumulative_trapezoid(np.cos(psi) - v * np.sin(psi), time, initial=0.0)
    east = cumulative_trapezoid(np.sin(psi) + v * np.cos(psi), time, initial=0.0)
    quarter, half = (int(np.argmax(np.abs(psi) >= a)) for a in (np.pi / 2.0, np.pi))
    # The linear response keeps the approach speed; the craft loses 2 to 3 %, but the path hardly depends on speed.
    assert gentle.indices["advance"][0] == pytest.approx(north[quarter], rel=0.01)
    assert gentle.indices["transfer"][0] == pytest.approx(-east[quarter], rel=0.01)
    assert gentle.indices["tactical_diameter"][0] == pytest.approx(-east[half], rel=0.01)
    assert gentle.indices["time_to_90"][0] == pytest.approx(time[quarter], rel=0.03)


def test_spiral_of_a_stable_craft_has_no_loop_and_the_slope_of_the_linear_model(stable):
    flown = spiral(stable, "10 deg")
    trial, curve = flown.indices, flown.provenance["curves"]["steady turns"]
    plane = horizontal(stable, 1.0)
    gain = float(-np.linalg.solve(plane.A, plane.B[:, 0])[1])
    assert trial["loop_width"][0] < 0.6  # deg: the last step of 1 deg decays to a quarter on each side
    assert trial["loop_width_algebraic"][0] == 0.0
    assert trial["loop_height_algebraic"][0] == pytest.approx(0.0, abs=1e-9)
    # v|v| has no second derivative at zero, so a cubic through the points is off by the spacing of the points.
    assert trial["slope_algebraic"][0] == pytest.approx(gain, rel=0.03)
    # The flown slope is the secant between the steps at +1 and -1 deg; transients of both sweeps nearly cancel.
    port, starboard = np.interp([1.0, -1.0], curve["rudder"][::-1], curve["rate"][::-1])
    assert trial["slope"][0] == pytest.approx((port - starboard) / 2.0, rel=0.1)


def test_spiral_of_an_unstable_craft_has_the_loop_of_the_algebraic_curve(unstable):
    trial = spiral(unstable, "15 deg")
    width, folds = trial.indices["loop_width"][0], trial.indices["loop_width_algebraic"][0]
    # Each side of the loop is known to one rudder step, and the craft jumps at the first step beyond the fold.
    sides = 15.0 * np.array([0.1, 0.2, 0.3, 0.45, 0.7, 1.0])
    nearest = sides[sides > folds / 2.0]
    assert folds > 1.0
    assert folds - 0.2 <= width <= 2.0 * nearest[1]
    assert trial.indices["loop_height"][0] == pytest.approx(trial.indices["loop_height_algebraic"][0], rel=0.05)
    assert trial.indices["slope_algebraic"][0] > 0.0  # reversed: +rudder turns to port on a stable craft


def test_steady_turns_need_no_rudder_for_straight_flight_and_mirror(unstable):
    turns = steady_turns(unstable, 1.0)
    middle = len(turns.rate) // 2
    assert turns.rudder[middle] == pytest.approx(0.0, abs=1e-12)
    assert turns.rudder == pytest.approx(-turns.rudder[::-1], abs=1e-8)
    assert turns.speed == pytest.approx(turns.speed[::-1], abs=1e-8)


def test_turning_circle_ends_on_the_algebraic_curve(stable):
    trial = turning_circle(stable, "10 deg").indices
    rate = np.radians(trial["yaw_rate"][0])
    turns = steady_turns(stable, 1.0)
    curvature = 2.0 / trial["steady_diameter"][0] * np.sign(rate) / np.cos(np.radians(trial["drift_angle"][0]))
    # The curve leaves out the roll and pitch of the free turn, a small fraction of a degree here.
    assert CubicSpline(turns.curvature, turns.rudder)(curvature) == pytest.approx(np.radians(10.0), rel=0.02)
    assert CubicSpline(turns.curvature, turns.speed)(curvature) == pytest.approx(
        1.0 - trial["speed_loss"][0] / 100.0, rel=0.01
    )


def test_pull_out_leaves_no_rate_on_a_stable_craft_and_the_free_turn_on_an_unstable_one(stable, unstable):
    calm, turning = pull_out(stable).indices, pull_out(unstable).indices
    for side in ("plus", "minus"):
        # 20 lengths are five times the slow time constant: 1 to 2 % is left.
        assert abs(calm[f"residual_rate_{side}"][0]) < 0.03 * abs(calm[f"turning_rate_{side}"][0])
    assert turning["residual_rate_plus"][0] < -0.5
    assert turning["residual_rate_minus"][0] > 0.5


def test_growth_of_the_straight_run_is_the_unstable_eigenvalue(unstable, stable):
    for model in (unstable, stable):
        eigenvalues = horizontal(model, 1.0).eigenvalues.real
        # Cross-flow and the second mode bend the curve: 10 %.
        assert straight_run(model).indices["growth"][0] == pytest.approx(eigenvalues.max(), rel=0.1)


def test_trim_carries_the_weight(unstable):
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.05)
    trim = level_trim(heavy, 1.0)
    assert trim.holds
    assert trim.pitch > 0.0  # a heavy craft flies nose up
    s = setting(heavy, 1.0)
    rates = heavy.rates(s.state[:16], s.state[12:16], s.thrust)
    assert np.abs(np.array(rates)[[2, 6, 8, 10]]).max() < 1e-8
    assert level_trim(unstable, 1.0).pitch == pytest.approx(0.0, abs=1e-12)


def test_a_craft_too_heavy_for_its_speed_is_told_so_and_when_it_could():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.5)
    trim = level_trim(heavy, 1.0)
    assert not trim.holds
    assert trim.why
    speed = slowest_level_speed(heavy)
    assert speed is not None
    assert level_trim(heavy, 1.02 * speed).holds
    assert not level_trim(heavy, 0.97 * speed).holds
    assert level_trim(ballasted(heavy), 1.0).holds


def test_the_plant_of_the_pilot_is_the_model_moved_a_little(unstable):
    # Central differences of the equations of motion; v|v| leaves an error of the size of the step.
    step, state = 1e-6, np.zeros(16)
    state[6] = 1.0
    plant = block(linearise(unstable, 1.0), ("v", "r"), "rudder")
    for column, i in enumerate((7, 11)):
        ahead, back = state.copy(), state.copy()
        ahead[i] += step
        back[i] -= step
        thrust = unstable.thrust(1.0)
        slope = (
            np.array(unstable.rates(ahead, ahead[12:], thrust)) - np.array(unstable.rates(back, back[12:], thrust))
        ) / (2.0 * step)
        assert slope[[7, 11]] == pytest.approx(plant.A[:, column], rel=1e-4, abs=1e-8)
