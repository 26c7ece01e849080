"""What a regulator of all states promises, and that the flown law keeps it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

import synthetic_craft as synthetic
from towtank.engine.form import System
from towtank.engine.loop import command, dynamics, observe
from towtank.engine.start import at
from towtank.errors import InputError, TrialError
from towtank.model.algebra import MATH
from towtank.model.dual import DUAL, gradients, variables
from towtank.model.linear import linearise
from towtank.pilot.allocation import allocation
from towtank.pilot.design import design_pilot
from towtank.pilot.law import Seen, steer
from towtank.pilot.loops import STATES, law_of, whole_loop
from towtank.pilot.lqi import LqiWeights, design_lqi
from towtank.pilot.orders import ORDERS, Orders
from towtank.trials.start import setting
from towtank.trials.steps import depth_step, heading_step

PLANES = {
    "heading": (("v", "r", "psi"), "rudder", "psi"),
    "depth": (("w", "q", "theta", "z"), "elevator", "z"),
    "roll": (("p", "phi"), "aileron", None),
}


@pytest.fixture(scope="module", params=["unstable", "stable"])
def craft(request):
    # 2 m/s: above the inversion speed, so that the depth order is followed.
    return synthetic.model(synthetic.SUBOFF if request.param == "unstable" else synthetic.STABLE, speed=2.0)


def slopes_of_the_law(model, pilot):
    """d(command, trim rates) / d(STATES, trims) of the text that is flown, at rest on course, by dual numbers."""
    names = (*STATES, "trim_rudder", "trim_elevator")
    x = dict(zip(names, variables(np.array([pilot.speed if n == "u" else 0.0 for n in names])), strict=True))
    sink = x["w"] - pilot.speed * x["theta"]
    seen = Seen(**{n: x.get(n, 0.0) for n in Seen._fields if n != "sink"}, sink=sink)
    fins = allocation(model.craft)
    out = steer(pilot, fins, Orders(piloted=1.0, steer=1.0, dive=1.0), seen,
                [x["trim_rudder"], x["trim_elevator"], 0.0], DUAL)  # fmt: skip
    slope = gradients([*out.granted, *out.memory_rates[:2]], len(names))
    return slope, names


def optimal(model, pilot, plane):
    """A, B, K of the design, with K from a Riccati equation set up here: Bryson on states and fins."""
    states, control, held = PLANES[plane]
    linear, length = linearise(model, pilot.speed), model.craft.length
    part = linear.part(states, (control,))
    A, B = part.A, part.B
    largest = {"psi": np.radians(20.0), "theta": np.radians(10.0), "phi": np.radians(5.0), "z": 0.5 * length}
    q = [largest.get(s, np.inf) ** -2.0 for s in states]
    if held:
        n = len(states)
        A = np.block([[A, np.zeros((n, 1))], [np.eye(n)[[-1]], np.zeros((1, 1))]])
        B = np.vstack([B, np.zeros((1, 1))])
        q.append((largest[held] * 12.0 * length / pilot.speed) ** -2.0)
    R = np.array([[(np.radians(25.0) / 3.0) ** -2.0]])
    K = np.linalg.solve(R, B.T @ solve_continuous_are(A, B, np.diag(q), R))
    return A, B, K


@pytest.mark.parametrize("plane", PLANES)
def test_the_flown_law_has_the_eigenvalues_of_the_regulator(craft, plane):
    pilot = design_lqi(craft)
    slope, names = slopes_of_the_law(craft, pilot)
    states, control, _ = PLANES[plane]
    row = ("rudder", "elevator", "aileron").index(control)
    part = linearise(craft, pilot.speed).part(states, (control,))
    here = [names.index(s) for s in states]
    A = part.A + part.B @ slope[[row]][:, here]
    if row < 2:
        trim = 10 + row
        A = np.block([[A, part.B], [slope[[3 + row]][:, here], slope[3 + row, trim : trim + 1][None]]])
    full, B, K = optimal(craft, pilot, plane)
    wanted = np.sort_complex(np.linalg.eigvals(full - B @ K))
    # Both are eigenvalues of a matrix of the same numbers in other coordinates.
    assert np.sort_complex(np.linalg.eigvals(A)) == pytest.approx(wanted, rel=1e-6)


@given(
    Yuv=st.floats(0.5, 2.0), Nuv=st.floats(0.4, 1.4), Nur=st.floats(0.6, 2.0), fins=st.floats(0.7, 2.0),
    speed=st.floats(1.2, 3.0),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_without_lag_the_regulator_keeps_the_nyquist_curve_out_of_the_unit_disc(Yuv, Nuv, Nur, fins, speed):
    # Kalman's inequality |1 + L(jw)| >= 1: any larger gain, half the gain, 60 deg. The fins' lag of 1 ms is as good as
    # none below 10 rad/s, where the loops cross over.
    factors = {"Yuv": Yuv, "Nuv": Nuv, "Nur": Nur, "Yuudr": fins, "Nuudr": fins}
    primes = {name: value * factors.get(name, 1.0) for name, value in synthetic.SUBOFF.items()}
    model = synthetic.model(primes, speed=speed, lag=1e-3, zg=0.02)
    pilot = design_lqi(model)
    frequency = np.logspace(-3, 1, 300)
    for plane in PLANES:
        A, B, K = optimal(model, pilot, plane)
        loop = [(K @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B))[0, 0] for w in frequency]
        assert np.abs(1.0 + np.array(loop)).min() > 1.0 - 1e-6, plane
        up, down, phase = pilot.margins[plane]
        assert up > 100.0
        assert down < 0.5 + 1e-3
        assert phase > np.radians(59.0)


def test_the_lag_of_the_fins_takes_away_phase():
    # The lag of 0.2 s delays the command by atan(0.2 w); the loop loses at least that at its old crossover.
    quick, slow = (design_lqi(synthetic.model(synthetic.SUBOFF, speed=2.0, lag=lag)) for lag in (1e-3, 0.2))
    assert quick.yaw_rate == slow.yaw_rate
    for plane in ("heading", "depth", "roll"):
        assert slow.margins[plane][2] < quick.margins[plane][2]


def test_cheap_fins_give_a_faster_loop_and_dear_ones_a_slower(craft):
    slow, fast = (design_lqi(craft, weights=LqiWeights(control=c)) for c in (0.1, 0.6))
    assert abs(fast.yaw_rate * fast.heading) > abs(slow.yaw_rate * slow.heading)
    assert abs(fast.pitch_order * fast.depth) > abs(slow.pitch_order * slow.depth)


def test_the_whole_loop_is_the_slope_of_the_text_that_is_flown():
    # All planes together, roll and sway coupled by a low CG, against central differences of the loop of the engine.
    model = synthetic.model(synthetic.SUBOFF, speed=2.0)
    for pilot in (design_pilot(model), design_lqi(model), replace(design_lqi(model), scheduled=0.0)):
        s = setting(model, 2.0, pilot)
        system = System(model.constants, s.pilot, s.thrust, (0.0, 0.0, 0.0), 0.25)
        ordered = [getattr(s.orders(steer=1.0, dive=1.0), name) for name in ORDERS]

        def rates(y, system=system, ordered=ordered):
            x, memory = list(y[:17]), list(y[17:])
            out = command(system, observe(system, x, ordered, MATH), memory, ordered, MATH)
            return np.array([*dynamics(system, x, [*out.fins, 1.0], MATH), *out.memory_rates])

        step, start = 1e-6, at(s.state, s.memory)
        slope = np.array([(rates(start + step * e) - rates(start - step * e)) / (2.0 * step) for e in np.eye(20)]).T
        found = np.linalg.eigvals(slope)
        # Central differences are good to 1e-9 of the largest slope; the slowest eigenvalue is 0.01 1/s.
        for value in whole_loop(model, pilot).eigenvalues:
            assert np.abs(found - value).min() < 1e-4 * max(abs(value), 0.05), value


def test_the_gains_of_the_law_are_the_slopes_of_its_text(craft):
    for pilot in (design_pilot(craft), design_lqi(craft), replace(design_pilot(craft), sway=0.3, heave=-0.2)):
        G, J = law_of(pilot, linearise(craft, pilot.speed))
        slope, _ = slopes_of_the_law(craft, pilot)
        # The schedule's slope in u multiplies a command of zero.
        assert slope[:3, :10] == pytest.approx(-G, rel=1e-9, abs=1e-12)
        assert slope[3:, :10] == pytest.approx(-J, rel=1e-9, abs=1e-12)
        assert slope[:3, 10:] == pytest.approx(np.eye(3)[:, :2])


def test_a_delay_is_all_phase():
    model = synthetic.model(synthetic.SUBOFF, speed=2.0)
    pilot, w = design_pilot(model), np.logspace(-2, 1, 20)
    now, late = (whole_loop(model, pilot, delay=d).response(w) for d in (0.0, 0.05))
    # |L| of each channel is kept; its phase turns by w T. The approximant is good to 1e-5 rad below 1 / T.
    assert late == pytest.approx(now * np.exp(-1j * w * 0.05)[:, None, None], rel=2e-5, abs=1e-12)


def test_the_regulator_spares_the_fins_in_a_heading_step():
    # It knows the sway, which the cascade has to guess from the rate of turn: less travel of the fins, less overshoot.
    model = synthetic.model(synthetic.SUBOFF, speed=2.0)
    cascade, full = (heading_step(model, pilot=design(model)).indices for design in (design_pilot, design_lqi))
    assert full["fin_travel"][0] < 0.7 * cascade["fin_travel"][0]
    assert full["overshoot_share"][0] < cascade["overshoot_share"][0]
    assert full["settling_time"][0] < 40.0 * model.craft.length / 2.0


def test_the_regulator_takes_a_depth_step_without_lasting_error():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.2, speed=2.0)
    trial = depth_step(heavy, "3 m", lengths=110.0, pilot=design_lqi(heavy))
    assert abs(trial.indices["last_error"][0]) < 0.03
    assert trial.status == "done"


def test_a_limited_regulator_turns_and_dives_at_its_limits():
    model = synthetic.model(synthetic.SUBOFF, speed=2.0)
    pilot = design_lqi(model)
    turn = heading_step(model, "150 deg", pilot=pilot)
    assert turn.indices["overshoot_share"][0] < 5.0
    dive = depth_step(model, "30 m", pilot=pilot, lengths=40.0)
    # The pitch asked for is limited to 15 deg and the pitch follows it; the transient may pass it by a fifth.
    assert np.radians(13.0) < np.abs(dive.attitude[:, 1]).max() < np.radians(18.0)


def test_what_no_regulator_can_do_is_told():
    model = synthetic.model(synthetic.SUBOFF)
    with pytest.raises(TrialError, match="no fins"):
        design_lqi(replace(model, craft=replace(model.craft, fins=())))
    with pytest.raises(TrialError, match="no gains stabilise heading"):
        design_lqi(model.with_values(Yuudr=0.0, Nuudr=0.0))
    with pytest.raises(TrialError, match="lag"):
        design_lqi(synthetic.model(synthetic.SUBOFF, speed=3.0, lag=60.0))
    with pytest.raises(InputError, match="forward speed"):
        design_lqi(model, -1.0)
    with pytest.raises(InputError, match="weight of depth"):
        LqiWeights(depth=0.0)
    with pytest.raises(InputError, match="delay"):
        whole_loop(model, design_pilot(model), delay=-1.0)


def test_the_pilot_says_what_it_must_measure():
    assert any("sway and heave" in note for note in design_lqi(synthetic.model(synthetic.SUBOFF, speed=2.0)).notes)
