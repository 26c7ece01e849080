"""Trials of crafts for which the equations of motion have a closed form: what is left is the integration.

The crafts are made so that the package's own equations become the textbook ones: the CG in the origin (no roll, no
pitch), Xvr = -m (no loss of speed), quick fins. Without Nuv and with Yur = m nothing drives sway: yaw is Nomoto's
first-order model.
"""

from __future__ import annotations

import numpy as np
import pytest

import synthetic_craft as synthetic
from closed_forms import Cubic, Linear, Nomoto, Surge
from towtank.engine.plan import Leg
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.model.linear import horizontal
from towtank.pilot.orders import Orders
from towtank.trials.circle import turning_circle
from towtank.trials.pullout import pull_out
from towtank.trials.spiral import spiral
from towtank.trials.steady import steady_turns
from towtank.trials.straight import straight_run
from towtank.trials.zigzag import zigzag

BOAT = synthetic.craft()
M = BOAT.mass.mass / (0.5 * BOAT.water.density * BOAT.length**3)
LAG = 1e-3
"""Lag of the fins of the first-order craft [s]; its time constant is 3.3 s."""
PURE = {
    "Xudot": -0.0004, "Yvdot": -0.014711, "Nrdot": -0.000744, "Kpdot": -2e-6, "Xuu": -0.0013, "Yuv": -0.020, "Yur": M,
    "Nur": -0.0045, "Kup": -1.2e-5, "Nuudr": -0.002217, "Kuudroll": 0.0005,
}  # fmt: skip
TEN = np.radians(10.0)


def model(primes, lag=LAG, **vertical):
    craft = synthetic.model(primes, zg=0.0, rate=1e5, lag=lag)
    return craft.with_values(**vertical) if vertical else craft


def linear_craft(primes):
    """Sway and yaw of ``primes`` without cross-flow and at constant speed; lag of the fins 0.2 s."""
    even = {"Yvv": 0.0, "Nvv": 0.0, "Nrr": 0.0, "Xvr": -M, "Xrr": 0.0, "Xuudd": 0.0}
    return model({**primes, **even}, lag=0.2)


def si(indices):
    """Values of ``indices`` in radians and seconds."""
    return {name: np.radians(value) if "deg" in unit else value for name, (value, unit) in indices.items()}


@pytest.fixture(scope="module")
def first_order():
    craft = model(PURE)
    damping = craft.derivatives["Nur"]
    return craft, Nomoto(craft.derivatives["Nuudr"] / damping, -craft.mass_matrix[5, 5] / damping)


@pytest.fixture(scope="module")
def stable():
    return linear_craft(synthetic.STABLE)


def test_the_turning_circle_is_that_of_the_first_order_model(first_order):
    craft, nomoto = first_order
    trial = turning_circle(craft, "-10 deg", hold_depth=False).indices
    found, exact = si(trial), nomoto.turn(TEN, 1.0)
    # A lag of the rudder, short beside T, is a delay: the craft goes straight on for as long.
    late = {"advance": LAG, "time_to_90": LAG, "time_to_180": LAG}
    for name, value in exact.items():
        # Integration and the search for the event: 1e-9 measured.
        assert found[name] - late.get(name, 0.0) == pytest.approx(value, rel=1e-8)
    assert trial["speed_loss"][0] == pytest.approx(0.0, abs=1e-9)
    assert trial["drift_angle"][0] == pytest.approx(0.0, abs=1e-9)


def test_the_zigzag_is_that_of_the_first_order_model(first_order):
    craft, nomoto = first_order
    found = si(zigzag(craft, "-10 deg", "10 deg", hold_depth=False).indices)
    for name, value in nomoto.zigzag(TEN, TEN).items():
        # The lag adds 2 K delta LAG to an overshoot of 0.6 deg and LAG to the times: 7e-4 of the smallest.
        assert found[name] == pytest.approx(value, rel=1e-3)


def test_the_linear_zigzag_is_that_of_its_matrix_exponentials(stable):
    found = si(zigzag(stable, "-10 deg", "10 deg", hold_depth=False).indices)
    exact = swinging(stable).zigzag(-TEN, TEN, stride=1.0)
    for name in ("initial_turning_time", "reach", "period"):
        assert found[name] == pytest.approx(exact[name], rel=1e-9)
    for name in ("first_overshoot", "second_overshoot", "time_to_check_first", "time_to_check_second"):
        # Extremes are read between RK4 steps of 0.065 s: 7e-6 measured.
        assert found[name] == pytest.approx(exact[name], rel=3e-5)


def swinging(craft):
    """The linear model of ``craft`` at 1 m/s with the lag of its fins and the heading: v, r, rudder, psi."""
    plane, lag = horizontal(craft, 1.0), craft.craft.fins[0].time_constant
    A = np.zeros((4, 4))
    A[:2, :2], A[:2, 2], A[2, 2], A[3, 1] = plane.A, plane.B[:, 0], -1.0 / lag, 1.0
    return Linear(A, np.array([0.0, 0.0, 1.0 / lag, 0.0]), heading=3, rate=1)


def test_a_vertical_zigzag_is_the_horizontal_one_of_a_fourfold_craft_without_restoring_moment(stable):
    flat = zigzag(stable, "10 deg", "10 deg", hold_depth=False).indices
    steep = zigzag(stable, "10 deg", "10 deg", plane="vertical", hold_depth=False).indices
    for name in ("initial_turning_time", "first_overshoot", "second_overshoot", "reach", "period"):
        assert steep[name][0] == pytest.approx(flat[name][0], rel=1e-9)


def test_the_spiral_of_the_first_order_model_is_a_line_without_a_loop(first_order):
    craft, nomoto = first_order
    found = spiral(craft, "15 deg", hold_depth=False)
    trial, curve = found.indices, found.provenance["curves"]["spiral"]
    # A step lasts 40 s, twelve time constants: e^-12 of a step of 4.5 deg is left.
    assert trial["loop_width"][0] < 1e-4
    assert trial["loop_height"][0] < 1e-5
    assert trial["loop_width_algebraic"][0] == 0.0
    assert trial["slope"][0] == pytest.approx(-nomoto.K, rel=1e-5)
    assert trial["slope_algebraic"][0] == pytest.approx(-nomoto.K, rel=1e-9)
    assert np.abs(curve["rate"] + nomoto.K * np.asarray(curve["rudder"])).max() < 1e-4


def test_the_spiral_of_a_cubic_craft_has_its_folds_and_its_height():
    # Yaw damping of the wrong sign near zero; the vertical plane keeps the sound one.
    sound = model(PURE).derivatives["Nur"]
    craft = model({**PURE, "Nur": 0.0015, "Nrrr": -0.05}, Muq=sound)
    d = craft.derivatives
    cubic = Cubic(-d["Nur"], -d["Nrrr"], -d["Nuudr"])
    found = spiral(craft, "15 deg", hold_depth=False)
    trial, curve = found.indices, found.provenance["curves"]["spiral"]
    assert np.radians(trial["loop_width_algebraic"][0]) == pytest.approx(cubic.loop_width, rel=1e-6)
    assert np.radians(trial["loop_height_algebraic"][0]) == pytest.approx(cubic.loop_height, rel=1e-6)
    # Flown: the rate at rudder amidships has settled to e^-4 of a small step; the width is known to one rudder step.
    assert np.radians(trial["loop_height"][0]) == pytest.approx(cubic.loop_height, rel=1e-3)
    assert np.degrees(cubic.loop_width) - 0.2 <= trial["loop_width"][0] <= 2.0 * 4.5
    for rudder, rate, sweep in zip(curve["rudder"], curve["rate"], curve["sweep"], strict=True):
        side = -1.0 if sweep == "down" else 1.0  # +rudder turns to port
        beyond = -side * np.sign(rudder) < 0.0 and abs(rudder) > np.degrees(cubic.loop_width) / 2.0
        if beyond and abs(rudder) < 7.0:
            continue  # past the fold and on its way to the other branch
        wanted = cubic.turning(-np.radians(rudder), -side if beyond else side)
        # A step of 1.5 deg near the fold, where turns settle slowest, leaves 3e-5.
        assert np.radians(rate) == pytest.approx(wanted, rel=1e-3)


def test_pull_out_and_straight_run_decay_and_grow_with_the_eigenvalue(stable):
    slow = horizontal(stable, 1.0).eigenvalues.real.max()
    flown = pull_out(stable, "15 deg", hold_depth=False)
    out, end = (mark["time"] for mark in flown.provenance["marks"] if mark["leg"] in ("turn plus", "left plus"))
    late = (flown.time > out + 40.0) & (flown.time <= end)  # the fast mode is down to e^-15
    slope = np.polyfit(flown.time[late], np.log(np.abs(flown.nu[late, 5])), 1)[0]
    assert slope == pytest.approx(slow, rel=1e-6)
    for primes in (synthetic.STABLE, synthetic.SUBOFF):
        craft = linear_craft(primes)
        # The fast mode is still seen at the start of the record: 4e-4 measured.
        growth = horizontal(craft, 1.0).eigenvalues.real.max()
        assert straight_run(craft).indices["growth"][0] == pytest.approx(growth, rel=1e-3)


def test_the_decay_of_a_pull_out_is_the_time_constant_of_the_first_order_model(first_order):
    craft, nomoto = first_order
    trial = pull_out(craft, "15 deg", hold_depth=False).indices
    for side in ("plus", "minus"):
        # Straight lines between samples 0.5 s apart, and the lag: 0.2 % measured.
        assert trial[f"decay_{side}"][0] == pytest.approx(nomoto.T, rel=0.005)
        assert trial[f"residual_rate_{side}"][0] == pytest.approx(0.0, abs=1e-9)


def test_steady_turns_are_the_line_of_the_first_order_model(first_order):
    craft, nomoto = first_order
    turns = steady_turns(craft, 1.0)
    assert turns.rate == pytest.approx(-nomoto.K * turns.rudder, rel=1e-8, abs=1e-10)
    assert turns.speed == pytest.approx(1.0, abs=1e-9)


def test_coasting_and_acceleration_follow_the_square_law(stable):
    surge = Surge(-stable.derivatives["Xuu"] / stable.mass_matrix[0, 0])

    def flown(start, thrust, seconds):
        state = [0.0] * 6 + [start] + [0.0] * 9
        done = fly(stable, at(state), [Leg("run", Orders(), seconds)], thrust=thrust)
        return done.at("run", "u", event=False)[0], done.at("run", "x", event=False)[0]

    push = float(stable.thrust(1.0))
    assert flown(1.0, 0.0, 300.0) == pytest.approx(surge.coasting(300.0, 1.0), rel=1e-9)
    assert flown(0.0, push, 300.0) == pytest.approx(surge.from_rest(300.0, 1.0), rel=1e-9)
    time, distance = surge.slowed(1.0, 0.25)
    assert flown(1.0, 0.0, time) == pytest.approx((0.25, distance), rel=1e-9)
    time, distance = surge.sped_up(0.95, 1.0)
    assert flown(0.0, push, time) == pytest.approx((0.95, distance), rel=1e-9)
    time, distance = surge.turned_astern(1.0, 1.0)
    assert flown(1.0, -push, time) == pytest.approx((0.0, distance), rel=1e-9, abs=1e-9)
