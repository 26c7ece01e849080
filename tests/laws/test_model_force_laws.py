"""Restoring, fins, thrust, control signs; the matrices against the independent list of terms; the linear model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_cases import AT_ORIGIN, FEW, FOURFOLD, ROLLING, angles, attitudes, craft, model, numbers, velocities
from scipy.integrate import solve_ivp

from towtank.craft.craft import Propeller
from towtank.errors import ArtefactError, CraftError, InputError
from towtank.model.algebra import MATH, interpolate
from towtank.model.equations import Model
from towtank.model.files import read_model, write_model
from towtank.model.linear import elevator_reversal_speed, horizontal, linearise, stability_indices, vertical
from towtank.model.options import ModelOptions
from towtank.model.thrust import shaft_speed
from towtank.model.values import to_variant
from towtank.symbols import TERMS
from towtank.terms import term_loads

LEVEL = [0.0, 0.0, 0.0]
REST = [0.0] * 6


@FEW
@given(velocities, velocities, angles, st.integers(0, 2**31))
def test_captive_loads_agree_with_the_list_of_terms(nu, nudot, delta, seed):
    """Two statements of the same physics: 6x6 matrices here, a sum of named terms in ``towtank.terms``."""
    rng = np.random.default_rng(seed)
    values = {name: float(rng.uniform(-9.0, 9.0)) for name in TERMS if not name.endswith("dot")}
    values |= {name: value for name, value in (FOURFOLD | ROLLING).items() if name.endswith("dot")}
    tested = model(values)
    control = tested.craft.virtual(np.array(delta))
    expected = term_loads(values, np.array([nu]), np.array([nudot]), control)[0]
    # 1e-12 of the largest term, added mass 1e3 times velocities up to 2 squared
    assert np.allclose(tested.captive_load(nu, nudot, delta), expected, rtol=0, atol=1e-12 * 2e4)


@FEW
@given(velocities, attitudes, angles)
def test_the_loads_by_cause_add_up_to_the_bodys_inertia(nu, attitude, delta):
    tested = model(FOURFOLD | ROLLING, cg=(0.1, 0.0, 0.05), balance=0.99)
    state = [0.0] * 3 + attitude + nu + delta
    loads = tested.loads(state, 30.0)
    nudot = tested.acceleration(nu, attitude, delta, 30.0)
    inertia = (tested.mass_matrix + np.array(tested.constants.added, dtype=float)) @ nudot
    assert np.allclose(np.sum(list(loads.values()), axis=0), inertia, rtol=0, atol=1e-9 * (1 + abs(inertia).max()))


@pytest.mark.parametrize(("axis", "period"), [(0, 1.5), (1, 14.2)])
def test_a_pendulum_is_stable_with_the_cg_below_the_cb_and_unstable_above(axis, period):
    """Periods are 2 pi sqrt(I / (m g zG)) with the added inertia; sway and heave at the CG change them a little."""
    added = {name: value for name, value in FOURFOLD.items() if name.endswith("dot")}
    start = np.zeros(16)
    start[3 + axis] = 0.05
    for zg in (0.05, -0.05):
        hanging = model(added, cg=(0.0, 0.0, zg))
        path = solve_ivp(
            lambda _, s, m=hanging: m.rates(s, [0.0] * 4, 0.0),
            (0.0, 1.2 * period), start, rtol=1e-7, max_step=period / 60,
        )  # fmt: skip
        angle = path.y[3 + axis]
        if zg > 0.0:
            assert np.max(np.abs(angle)) < 0.0501
            assert np.min(angle) < -0.049
        else:
            assert np.max(angle) > 0.5


def test_a_heavy_craft_sinks_and_a_light_one_rises():
    for balance, sign in ((0.99, 1.0), (1.01, -1.0)):
        nudot = model(balance=balance).acceleration(REST, LEVEL, [0.0] * 4, 0.0)
        assert np.sign(nudot[2]) == sign


def test_a_nose_heavy_craft_pitches_down_and_one_heavy_to_starboard_rolls_to_starboard():
    assert model(cg=(0.1, 0.0, 0.0)).acceleration(REST, LEVEL, [0.0] * 4, 0.0)[4] < 0.0
    assert model(cg=(0.0, 0.1, 0.0)).acceleration(REST, LEVEL, [0.0] * 4, 0.0)[3] > 0.0


def test_a_heavy_nose_swings_the_bow_down_when_the_craft_lies_on_its_side():
    """Row 6 of eq. 2.17 with its minus sign: rolled to starboard, the weight of the nose turns the bow to port."""
    lying = model(cg=(0.1, 0.0, 0.0)).acceleration(REST, [0.5 * np.pi, 0.0, 0.0], [0.0] * 4, 0.0)
    assert lying[5] > 0.0  # body z points to port; yaw about it is positive when the bow goes down


def test_the_centre_of_buoyancy_comes_from_the_shape_unless_stated():
    shaped = Model.from_values(craft(), FOURFOLD)
    # ellipsoid about its middle, fins aft: the fins' volume pulls the centre aft by less than 2 % of the length
    assert -0.1 < shaped.body.xB < 0.0
    assert model().body.xB == 0.0


def test_sname_control_signs():
    tested, ahead_at = model(), [1.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    still = np.array(tested.captive_load(ahead_at, REST, [0.0] * 4))
    for virtual, signs in (((0.1, 0, 0), {1: 1, 5: -1}), ((0, 0.1, 0), {2: -1, 4: -1}), ((0, 0, 0.1), {3: 1})):
        load = np.array(tested.captive_load(ahead_at, REST, tested.fin_angles(*virtual))) - still
        assert {i: np.sign(x) for i, x in enumerate(load) if abs(x) > 1e-9 and i > 0} == signs
        assert load[0] < 0.0


@FEW
@given(
    st.lists(st.floats(0.0, 359.0), min_size=3, max_size=7, unique_by=lambda a: round(a / 25.0)),
    numbers(3, 0.3),
)
def test_mixing_works_both_ways_for_any_number_of_fins(azimuths, virtual):
    tested = model(azimuths=tuple(azimuths))
    if np.linalg.matrix_rank(tested.craft.mixing, tol=1e-6) < 3:
        return
    condition = np.linalg.cond(tested.craft.mixing)
    assert np.allclose(tested.virtual(tested.fin_angles(*virtual)), virtual, rtol=0, atol=1e-14 * condition**2 + 1e-12)


def test_four_x_fins_mix_as_printed_and_the_null_mode_only_brakes():
    tested = model()
    assert np.allclose(tested.constants.fins.mixing, [[-1, -1, -1], [-1, 1, -1], [1, -1, -1], [1, 1, -1]], atol=1e-14)
    load = np.array(tested.captive_load([1.5, 0, 0, 0, 0, 0], REST, [0.1, -0.1, -0.1, 0.1]))
    straight = np.array(tested.captive_load([1.5, 0, 0, 0, 0, 0], REST, [0.0] * 4))
    assert np.allclose((load - straight)[1:], 0.0, atol=1e-10)
    assert load[0] - straight[0] == pytest.approx(-20.0 * 1.5**2 * 4 * 0.01)


def test_fins_follow_their_order_with_lag_rate_limit_and_angle_limit():
    tested = model()
    fin = tested.craft.fins[0]
    order = [np.radians(60.0)] + [0.01] * 3
    rates = tested.rates([0.0] * 16, order, 0.0)[12:]
    assert rates[0] == pytest.approx(fin.max_rate)
    assert rates[1] == pytest.approx(0.01 / fin.time_constant)
    path = solve_ivp(lambda _, s: tested.rates(s, order, 0.0), (0.0, 6.0), [0.0] * 16, max_step=0.05)
    assert path.y[12].max() <= fin.max_angle * (1 + 1e-9)
    assert path.y[12, -1] == pytest.approx(fin.max_angle, rel=1e-3)
    assert path.y[13, -1] == pytest.approx(0.01, rel=1e-3)


def test_straightening_takes_the_local_flow_angle_off_the_fin():
    plain, turning = model(), [1.5, 0.0, 0.0, 0.0, 0.0, 0.1]
    station = plain.constants.fins.station[0]
    options = ModelOptions(kappa_v=0.4, kappa_r=0.8, fins_apart=1.0, centre_of_buoyancy=(0.0, 0.0, 0.0))
    both = model(options=options)
    for nu, angle in (([1.5, 0.1, 0, 0, 0, 0], 0.4 * np.arctan(0.1 / 1.5)), (turning, 0.8 * station * 0.1 / 1.5)):
        change = np.array(both.captive_load(nu, REST, [0.0] * 4)) - plain.captive_load(nu, REST, [0.0] * 4)
        # the X fins see the flow at 45 deg; the virtual rudder collects it again. atan is not linear: 0.1 %
        assert change[1] == pytest.approx(-FOURFOLD["Yuudr"] * 1.5**2 * angle * np.sqrt(0.5), rel=2e-3)


def test_constant_thrust_balances_the_resistance():
    tested = model()
    assert tested.thrust(1.5) == pytest.approx(15.0 * 1.5**2)
    assert tested.acceleration([1.5, 0, 0, 0, 0, 0], LEVEL, [0.0] * 4, tested.thrust(1.5))[0] == pytest.approx(
        0, abs=1e-15
    )


SCREW = Propeller(
    0.3, 4.9, 0.2, 0.1, ((0.0, 0.45, 0.07), (0.4, 0.3, 0.05), (0.8, 0.1, 0.02), (1.0, -0.05, 0.0)), torque=-1.0
)


def test_a_propeller_balances_the_resistance_at_its_speed_and_pulls_more_below():
    tested = model(propeller=SCREW)
    screw, command = tested.constants.screw, tested.thrust(1.5)
    n = shaft_speed(screw, command)
    J = 0.8 * 1.5 / (n * 0.3)
    table = np.array(SCREW.table).T
    kt, kq = np.interp(J, table[0], table[1]), np.interp(J, table[0], table[2])
    density = tested.craft.water.density
    assert pytest.approx(screw.balance) == J
    assert 0.9 * density * n**2 * 0.3**4 * kt == pytest.approx(15.0 * 1.5**2)
    loads = tested.loads([0.0] * 6 + [1.5] + [0.0] * 9, command)["thrust"]
    assert loads[0] == pytest.approx(15.0 * 1.5**2)
    assert loads[3] == pytest.approx(-density * n**2 * 0.3**5 * kq)
    slow = tested.loads([0.0] * 6 + [1.0] + [0.0] * 9, command)["thrust"][0]
    assert loads[0] < slow < 0.9 * density * n**2 * 0.3**4 * 0.45


def test_a_propeller_table_that_ends_early_is_carried_on_straight_to_zero_thrust():
    short = Propeller(0.3, 4.9, table=((0.0, 0.4, 0.06), (0.1, 0.36, 0.055)))
    screw = model(propeller=short).constants.screw
    end = screw.kt.knots[-1]
    values = (end, *(interpolate(end, table, MATH) for table in (screw.kt, screw.kq)))
    assert values == pytest.approx((1.0, 0.0, 0.01), abs=1e-15)
    assert 0.1 < screw.balance < 1.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (((0.0, -0.1, 0.07), (0.3, -0.2, 0.06)), "balances the resistance"),
        (((0.3, 0.4, 0.07), (0.0, 0.5, 0.06)), "rising J"),
    ],
)
def test_a_propeller_that_cannot_balance_the_resistance_is_refused(table, message):
    with pytest.raises(CraftError, match=message):
        model(propeller=Propeller(0.3, 4.9, table=table))


@FEW
@given(st.floats(0.5, 3.0))
def test_the_linear_model_is_the_slope_of_the_equations(speed):
    tested = model(FOURFOLD | ROLLING, cg=(0.05, 0.0, 0.05), balance=0.995).with_options(kappa_v=0.1, kappa_r=0.2)
    linear = linearise(tested, speed)
    x0, thrust, h = np.array([0.0] * 6 + [speed] + [0.0] * 5), tested.thrust(speed), 1e-6

    def rates(x, inputs):
        delta = tested.fin_angles(*inputs[:3])
        return np.array(tested.rates([*x, *delta], delta, inputs[3])[:12])

    inputs = np.array([0.0, 0.0, 0.0, thrust])
    A = [(rates(x0 + h * e, inputs) - rates(x0 - h * e, inputs)) / (2 * h) for e in np.eye(12)]
    B = [(rates(x0, inputs + h * e) - rates(x0, inputs - h * e)) / (2 * h) for e in np.eye(4)]
    # central differences of |v|v err by the step times the cross-flow terms; round-off 1e-16 / h
    assert np.allclose(linear.A, np.array(A).T, rtol=1e-5, atol=1e-5)
    assert np.allclose(linear.B, np.array(B).T, rtol=1e-5, atol=1e-5)


def test_the_sign_of_the_index_is_the_stability_of_the_plane():
    """Fixed-control eigenvalues without restoring moments against the index, over a sweep of the yaw stiffness."""
    seen = set()
    for nuv in np.linspace(-700.0, 100.0, 9):
        tested = model(FOURFOLD | {"Nuv": nuv, "Muw": -nuv})
        index = stability_indices(tested, "wide")
        for value, plane, states in (
            (index.horizontal, horizontal, ("v", "r")),
            (index.vertical, vertical, ("w", "q")),
        ):
            assert (value > 0.0) == (plane(tested, 1.5, states=states).eigenvalues[0].real < 0.0)
        seen.add(index.horizontal > 0.0)
    assert seen == {True, False}


def test_indices_and_reversal_speed_are_the_same_in_both_variants():
    lumped = model(cg=(0.0, 0.0, 0.05))
    split = lumped.with_derivatives(to_variant(lumped.derivatives, "split"))
    one, other = stability_indices(lumped, "wide"), stability_indices(split, "wide")
    assert (one.horizontal, one.vertical) == pytest.approx((other.horizontal, other.vertical), rel=1e-12)
    assert elevator_reversal_speed(split, "wide") == pytest.approx(elevator_reversal_speed(lumped, "wide"))


def test_the_elevator_reverses_depth_at_the_reversal_speed():
    """Steady climb per elevator angle, from the linear model alone, changes sign there."""
    tested = model(cg=(0.0, 0.0, 0.05))
    reversal = elevator_reversal_speed(tested, "wide")

    def sink_rate(speed):
        linear = vertical(tested, speed, states=("w", "q", "theta"))
        w, _, theta = np.linalg.solve(linear.A, -linear.B[:, 0])
        return w - speed * theta

    assert reversal is not None
    assert sink_rate(reversal) == pytest.approx(0.0, abs=1e-9)
    assert sink_rate(0.8 * reversal) < 0.0 < sink_rate(1.2 * reversal)
    assert elevator_reversal_speed(model(cg=(0.0, 0.0, -0.05)), "wide") is None


def test_origin_slopes_replace_the_wide_ones_when_asked():
    derivatives = model().derivatives
    sloped = Model(craft(), type(derivatives)(**{**derivatives.__dict__, "origin": {"Nuv": 100.0}}), AT_ORIGIN)
    assert stability_indices(sloped).horizontal > 0.0 > stability_indices(sloped, "wide").horizontal
    assert horizontal(sloped, 1.5, "origin").A[1, 0] > horizontal(sloped, 1.5).A[1, 0]
    with pytest.raises(InputError, match="no slopes at the origin"):
        stability_indices(model())


def test_a_model_file_needs_nothing_else(tmp_path):
    tested = model(propeller=SCREW, cg=(0.05, 0.0, 0.05), balance=0.99).with_options(kappa_v=0.1)
    back = read_model(write_model(tested, tmp_path / "model.json"))
    state = np.linspace(-0.4, 0.6, 16)
    assert back.rates(state, [0.1] * 4, 30.0) == tested.rates(state, [0.1] * 4, 30.0)
    assert back.craft == tested.craft
    assert np.array_equal(back.derivatives.covariance, tested.derivatives.covariance)
    (tmp_path / "model.json").write_text('{"schema": "towtank/model/1", "options": {}}', encoding="utf-8")
    with pytest.raises(ArtefactError, match="an entry is missing"):
        read_model(tmp_path / "model.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"Yvdot": 5000.0}, "not positive definite"),
        ({"Yuw": 1.0}, "unknown term"),
        ({"Yuv": float("nan")}, "finite"),
    ],
)
def test_a_set_of_derivatives_that_makes_no_model_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        model(FOURFOLD | change)


def test_derivatives_about_another_point_or_in_other_water_are_refused():
    d = model().derivatives
    for change, message in (({"origin_from_nose": 2.0}, "about a point"), ({"density": 1026.0}, "water of")):
        reference = type(d.reference)(**{**vars(d.reference), **change})
        with pytest.raises(InputError, match=message):
            Model(craft(), type(d)(**{**d.__dict__, "reference": reference}))
