"""The equations on a unit quaternion: the same motion as on Euler angles, and one that goes on where those end."""

from __future__ import annotations

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_cases import AT_ORIGIN, FEW, FOURFOLD, ROLLING, angles, attitudes, craft, model, numbers, velocities
from scipy.integrate import solve_ivp

from towtank.craft.craft import Propeller
from towtank.engine.form import BEND, BY_FIN, INFLOW
from towtank.errors import InputError
from towtank.frames import rotation
from towtank.model.algebra import MATH, NUMPY, Table, interpolate, table_of
from towtank.model.dual import DUAL, Dual
from towtank.model.equations import Constants, Model, acceleration, right_hand_side_quaternion, total_load
from towtank.model.extra import ExtraLoad
from towtank.model.files import write_model
from towtank.model.fins import Bend, FinSet
from towtank.model.kinematics import attitude_of, quaternion_matrix, quaternion_of, quaternion_rates
from towtank.model.linear import INPUTS, linearise, linearise_at
from towtank.model.options import ModelOptions
from towtank.model.rigid_body import Body
from towtank.model.thrust import Screw
from towtank.symbols import TERMS

ROUND_OFF = 1e-14
"""A few tens of units in the last place of a number of order 1."""
CG = (0.1, 0.02, 0.05)
INERTIA = ((25.0, 2.0, -3.0), (2.0, 1200.0, 4.0), (-3.0, 4.0, 1210.0))
SCREW = Propeller(0.3, 4.9, 0.2, 0.1, ((0.0, 0.45, 0.07), (0.4, 0.3, 0.05), (0.8, 0.1, 0.02), (1.0, -0.05, 0.0)), 1.0)

any_attitude = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.57, 1.57), st.floats(-3.1, 3.1))


@FEW
@given(any_attitude)
def test_both_parameters_give_one_rotation_and_the_way_back(attitude):
    e = quaternion_of(attitude)
    assert sum(x * x for x in e) == pytest.approx(1.0, abs=ROUND_OFF)
    assert np.allclose(quaternion_matrix(e), rotation(np.array(attitude)), rtol=0, atol=ROUND_OFF)
    assert np.allclose(rotation(np.array(attitude_of(e))), rotation(np.array(attitude)), rtol=0, atol=1e-13)
    if abs(attitude[1]) < 1.5:
        # phi and psi have the round-off of the quaternion over cos(theta)
        assert np.allclose(attitude_of(e), attitude, rtol=0, atol=1e-13)
        assert np.allclose(attitude_of([-x for x in e]), attitude, rtol=0, atol=1e-13)


@pytest.mark.parametrize("theta", [0.5 * np.pi, -0.5 * np.pi])
def test_straight_up_and_straight_down_keep_their_rotation(theta):
    """Angles there are not unique; the rotation they stand for is."""
    for phi, psi in ((0.3, 0.0), (0.0, -2.0), (1.0, 1.0), (-2.5, 2.9)):
        back = attitude_of(quaternion_of([phi, theta, psi]))
        assert np.allclose(rotation(np.array(back)), rotation(np.array([phi, theta, psi])), rtol=0, atol=1e-14)
        assert np.isfinite(back).all()


def test_arrays_of_attitudes_are_a_loop_of_floats():
    attitudes_ = np.random.default_rng(1).uniform(-1.5, 1.5, (9, 3))
    e = quaternion_of(list(attitudes_.T), NUMPY)
    assert np.allclose(np.array(e).T, [quaternion_of(a) for a in attitudes_], rtol=0, atol=1e-15)
    assert np.allclose(np.array(attitude_of(e, NUMPY)).T, attitudes_, rtol=0, atol=1e-13)


@FEW
@given(any_attitude, numbers(3, 2.0), st.floats(0.8, 1.2))
def test_the_rates_of_the_quaternion_turn_the_body_and_mend_its_length(attitude, omega, length):
    """Jdot = J S(omega) on a unit quaternion; off it, the length goes back and nothing else changes."""
    e, h = np.array(quaternion_of(attitude)), 1e-6
    edot = np.array(quaternion_rates(e.tolist(), omega))
    assert abs(e @ edot) <= ROUND_OFF
    p, q, r = omega
    J, S = np.array(quaternion_matrix(e)), np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    Jdot = (np.array(quaternion_matrix(e + h * edot)) - np.array(quaternion_matrix(e - h * edot))) / (2 * h)
    # J is quadratic in e, so the central difference is exact but for round-off 1e-16 / h
    assert np.allclose(Jdot, J @ S, rtol=0, atol=1e-9)
    off = np.array(quaternion_rates((length * e).tolist(), omega)) - length * edot
    assert np.allclose(off, 0.5 * (1.0 - length**2) * length * e, rtol=0, atol=ROUND_OFF)


@FEW
@given(velocities, attitudes, angles, numbers(3, 0.5))
def test_both_right_hand_sides_give_the_same_rates(nu, attitude, delta, current):
    for split in ("lumped", "split"):
        tested = model(FOURFOLD | ROLLING, cg=CG, inertia=INERTIA, balance=0.98, propeller=SCREW, variant=split)
        euler = tested.rates([1.0, 2.0, 3.0, *attitude, *nu, *delta], [0.1] * 4, 30.0, current)
        state = [1.0, 2.0, 3.0, *quaternion_of(attitude), *nu, *delta]
        both = right_hand_side_quaternion(tested.constants, state, [0.1] * 4, 30.0, current, MATH)
        # round-off of the attitude, 1e-16, times accelerations of order 10 and the angles' way through J1
        assert np.allclose(both[:3] + both[7:], euler[:3] + euler[6:], rtol=1e-12, atol=1e-12)


def _flown(rates, start, duration, rtol=1e-12, **options):
    path = solve_ivp(rates, (0.0, duration), start, "DOP853", rtol=rtol, atol=1e-13, **options)
    assert path.success
    return path.y


def _on_quaternion(tested, start, duration, command, thrust=0.0, current=(0.0, 0.0, 0.0), **options):
    """Path (13 + n, N) from ``start`` (12,) in Euler angles; ``command`` gives the fin angles asked at a time."""
    k = tested.constants
    state = [*start[:3], *quaternion_of(start[3:6]), *start[6:12], *command(0.0)]
    return _flown(
        lambda t, s: right_hand_side_quaternion(k, s.tolist(), command(t), thrust, current, MATH),
        state, duration, **options,
    )  # fmt: skip


def _fixed(_):
    return [0.0] * 4


def test_both_follow_the_same_path_through_a_violent_motion():
    """All controls swung at once for 20 s in a current: rolls, dives, climbs and turns by tens of degrees."""
    tested = model(FOURFOLD | ROLLING, cg=(0.0, 0.0, 0.01), inertia=INERTIA, balance=0.99)
    swing, current, duration = tested.fin_angles(0.1, 0.4, 0.1), (0.3, -0.2, 0.1), 20.0

    def command(t):
        return [angle * np.cos(0.6 * t) for angle in swing]

    thrust, grid = tested.thrust(3.0), np.linspace(0.0, duration, 81)
    start = [0.0, 0.0, 5.0, 0.3, -0.2, 0.5, 3.0, 0.3, -0.2, 0.2, 0.1, -0.15]
    euler = _flown(
        lambda t, s: tested.rates(s, command(t), thrust, current), [*start, *command(0.0)], duration, t_eval=grid
    )
    path = _on_quaternion(tested, start, duration, command, thrust, current, t_eval=grid)
    assert np.degrees(np.abs(euler[4]).max()) < 80.0
    assert np.degrees(np.ptp(euler[3:6], axis=1)).min() > 30.0
    # integrators at 1e-12 a step over some 1e3 steps, on paths of tens of metres
    assert np.allclose(path[:3], euler[:3], rtol=0, atol=1e-8)
    assert np.allclose(path[7:], euler[6:], rtol=0, atol=1e-8)
    turns = np.array(attitude_of(path[3:7], NUMPY)) - euler[3:6]
    assert np.allclose(turns - 2 * np.pi * np.round(turns / (2 * np.pi)), 0.0, rtol=0, atol=1e-8)


ADDED = {name: value for name, value in (FOURFOLD | ROLLING).items() if name.endswith("dot")}


@pytest.mark.parametrize(
    ("lateral", "side", "turned_over"), [((0.0, 0.0, 0.0), 0.0, -0.999), ((0.1, 0.2, 0.1), 1.0, -0.5)]
)
def test_a_loop_all_round_stays_finite_and_conserves_energy(lateral, side, turned_over):
    """Pitch through 90, 180, 270 deg and on, in balance, without damping and thrust; kinetic plus restoring energy.

    Once in the vertical plane, once out of it, where the craft rolls too. The integrator keeps 1e-12 a step over some
    1e3 steps, so 1e-9 of the energy turned over.
    """
    cg, cb = (0.1, 0.02 * side, 0.05), (0.0, 0.0, -0.02)
    inertia = ((25.0, 2.0 * side, -3.0), (2.0 * side, 1200.0, 4.0 * side), (-3.0, 4.0 * side, 1210.0))
    tested = model(ADDED, ModelOptions(centre_of_buoyancy=cb), "split", cg=cg, inertia=inertia)
    phi, v, p = lateral
    start = [0.0] * 3 + [phi, 0.0, 0.2] + [1.0, v, -0.1] + [p, 1.5, v]
    path = _on_quaternion(tested, start, 10.0, _fixed, t_eval=np.linspace(0.0, 10.0, 401))
    e, nu, body = path[3:7], path[7:13], tested.body
    assert np.isfinite(path).all()
    assert np.abs((e * e).sum(axis=0) - 1.0).max() < 1e-9
    down = np.array([np.broadcast_to(row, e.shape[1]) for row in quaternion_matrix(e)[2]])
    nose_up = np.array(quaternion_matrix(e)[2][0])
    assert nose_up.min() < -0.95  # straight up
    assert nose_up.max() > 0.95  # and straight down on the way back
    assert down[2].min() < turned_over  # upside down between the two
    depth_g, depth_b = (path[2] + np.array(point) @ down for point in (cg, cb))
    potential = -body.g * (body.m * depth_g - body.b * depth_b)
    kinetic = 0.5 * np.einsum("in,ij,jn->n", nu, tested.mass_matrix, nu)
    assert np.ptp(potential) > 0.05 * kinetic[0]
    assert np.ptp(kinetic + potential) < 1e-9 * (kinetic.max() + np.ptp(potential))


def test_a_fall_through_the_vertical_has_its_mirror_image():
    """A heavy craft with its weight aft falls tail first through 90 deg of pitch; its twin on the other side."""
    heavy = model(FOURFOLD, cg=(-0.15, 0.0, 0.0), balance=0.9)
    lateral = np.array([0.05, 0.1, 0.02, 0.01])  # phi, v, p, r
    paths = []
    for side in (1.0, -1.0):
        phi, v, p, r = side * lateral
        start = [0.0] * 3 + [phi, np.radians(70.0), 0.0] + [0.3, v, 0.0, p, 0.15, r]
        paths.append(_on_quaternion(heavy, start, 25.0, _fixed, t_eval=np.linspace(0.0, 25.0, 101)))
    one, image = paths
    upright = np.array(quaternion_matrix(one[3:7])[2][2])
    assert upright[0] > 0.0 > upright.min()  # past the vertical
    mirror = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1.0])
    # the same arithmetic with signs changed; what sums in another order grows with the motion
    assert np.abs(one[1]).max() > 1e-2
    assert np.allclose(image[:13], mirror[:, None] * one[:13], rtol=0, atol=1e-8)


def _vortex(nu, down, delta, c, ops):
    u, v, w, p, _, r = nu
    flow = ops.sqrt(v * v + w * w + 1e-12)
    side = c.lift * flow * v * ops.cos(delta[0]) + c.weight * down[1]
    return [c.drag * ops.fabs(u) * u, side, c.weight * down[2], c.roll * p, 0.0, c.lift * r * ops.positive(v)]


VORTEX = ExtraLoad("vortex", _vortex, {"lift": -30.0, "drag": -2.0, "weight": 5.0, "roll": -1.0})
_SCREW_NAMES = ("density", "diameter", "wake", "deduction", "torque", "force_per_square")


def _constants(p, split, axisymmetric):
    """Constants of the numbers or symbols that ``p`` gives one by one, and thrust and current after them."""
    body = Body(*(p() for _ in Body.__dataclass_fields__))
    c = SimpleNamespace(**{name: p() for name in TERMS})
    matrices = [[[p() for _ in range(6)] for _ in range(6)] for _ in range(2)]
    rows = [[p() for _ in range(width)] for width in (3, 3, 3, 3, 4, 4, 4, 2, 2, 2, 2)]
    by_fin = {word: tuple(p() for _ in range(4)) for word in BY_FIN}
    bend, inflow = Bend(*(p() for _ in BEND)), {word: p() for word in INFLOW}
    fins = FinSet(rows[:4], rows[4:7], rows[7:], **by_fin, bend=bend, **inflow)
    knots = (-1.0, p(), 2.0)
    tables = {name: Table(knots, p(), (p(), p())) for name in ("kt", "kq")}
    screw = Screw(**{name: p() for name in _SCREW_NAMES}, **tables)
    options = ModelOptions(axisymmetric_crossflow=axisymmetric)
    extra = VORTEX.with_values({name: p() for name in VORTEX.values})
    return Constants(body, c, *matrices, fins, screw, split, options, extra), p(), [p(), p(), p()]


@pytest.mark.parametrize(("split", "axisymmetric"), [(False, False), (True, True)])
def test_the_text_traced_on_symbols_is_the_text_on_floats(split, axisymmetric):
    """Every constant a symbol: body, derivatives, matrices, fins, propeller, options, extra load."""
    parameters, state, command = [], ca.SX.sym("x", 17), ca.SX.sym("c", 4)

    def symbol():
        parameters.append(ca.SX.sym(f"p{len(parameters)}"))
        return parameters[-1]

    names = ("sin", "cos", "fabs", "sqrt", "fmin", "fmax", "atan2", "floor")
    ops = SimpleNamespace(**{name: getattr(ca, name) for name in names}, positive=lambda x: ca.SX(x) > 0)
    k, thrust, current = _constants(symbol, split, axisymmetric)
    rates = right_hand_side_quaternion(k, ca.vertsplit(state), ca.vertsplit(command), thrust, current, ops)
    traced = ca.Function("f", [ca.vertcat(*parameters), state, command], [ca.vertcat(*rates)])
    rng = np.random.default_rng(3)
    for _ in range(20):
        values, x, order = rng.uniform(0.1, 1.0, len(parameters)), rng.uniform(-1.0, 1.0, 17), rng.uniform(-1, 1, 4)
        queue = iter(values.tolist())
        k, thrust, current = _constants(lambda queue=queue: next(queue), split, axisymmetric)
        expected = np.array(right_hand_side_quaternion(k, x.tolist(), order.tolist(), thrust, current, MATH))
        # of the largest term: products of numbers of order 1, some hundred of them in a row
        assert np.allclose(
            traced(values, x, order).full().ravel(), expected, rtol=1e-13, atol=1e-13 * abs(expected).max()
        )


def test_a_padded_table_has_the_same_values():
    table = table_of((0.0, 0.4, 0.8), (0.45, 0.3, 0.1))
    padded = Table((*table.knots, 0.8, 0.8), table.first, (*table.slopes, 0.0, 0.0))
    for x in np.linspace(-0.5, 1.5, 41).tolist():
        assert interpolate(x, padded, MATH) == interpolate(x, table, MATH)
        assert interpolate(x, table, MATH) == pytest.approx(np.interp(x, (0.0, 0.4, 0.8), (0.45, 0.3, 0.1)), abs=1e-15)


def test_steps_are_the_same_for_floats_arrays_and_dual_numbers():
    for x in (-1.5, -1e-300, 0.0, 0.4, 2.0):
        dual = Dual(x, np.ones(2))
        for ops, value in ((NUMPY, np.array([x])), (DUAL, dual)):
            assert ops.floor(value) == MATH.floor(x)
            assert ops.positive(value) == MATH.positive(x)


def _repeat(nu, down, delta, c, ops):
    return [0.0, c.Yvv * ops.fabs(nu[1]) * nu[1], 0.0, 0.0, 0.0, 0.0]


def test_an_extra_load_that_repeats_a_term_doubles_it():
    plain = model()
    twice = plain.with_extra(ExtraLoad("again", _repeat, {"Yvv": FOURFOLD["Yvv"]}))
    doubled = plain.with_values(Yvv=2.0 * FOURFOLD["Yvv"])
    nu, delta, zero = [1.2, -0.7, 0.2, 0.1, 0.05, -0.1], [0.1] * 4, [0.1, 0.2, 0.3]
    assert np.allclose(
        twice.acceleration(nu, zero, delta, 30.0), doubled.acceleration(nu, zero, delta, 30.0), rtol=1e-14
    )
    state = [0.0] * 3 + zero + nu + delta
    assert list(twice.loads(state, 30.0)) == [*plain.loads(state, 30.0), "extra"]
    assert twice.loads(state, 30.0)["extra"][1] == FOURFOLD["Yvv"] * 0.7 * -0.7
    assert np.allclose(linearise(twice, 1.5).A, linearise(doubled, 1.5).A, rtol=1e-14)
    assert twice.with_extra(None) == plain


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (ExtraLoad("a load", _repeat, {"Yvv": 1.0}), "not a name"),
        (ExtraLoad("short", lambda *_: [0.0] * 3), "six finite numbers"),
        (ExtraLoad("lost", _repeat), "fails on floats"),
        (ExtraLoad("endless", _repeat, {"Yvv": float("inf")}), "finite number"),
    ],
)
def test_an_extra_load_that_cannot_be_used_is_refused(extra, message):
    with pytest.raises(InputError, match=message):
        model().with_extra(extra)


def test_a_model_with_an_extra_load_is_not_written(tmp_path):
    with pytest.raises(InputError, match="Keep the function in a script"):
        write_model(model().with_extra(VORTEX), tmp_path / "model.json")
    assert not (tmp_path / "model.json").exists()


TURNING = [1.0, -2.0, 3.0, 0.2, -0.35, 0.8, 1.4, 0.25, -0.15, 0.05, 0.04, 0.12, 0.1, -0.12, 0.05, 0.15]


@pytest.mark.parametrize("propeller", [None, SCREW])
def test_the_linear_model_about_any_state_is_the_slope_there(propeller):
    """A turning, pitched, rolled, drifting state in a current, with an extra load, against central differences."""
    tested = model(FOURFOLD | ROLLING, cg=(0.05, 0.0, 0.05), balance=0.995, propeller=propeller)
    tested = tested.with_options(kappa_v=0.1, kappa_r=0.2).with_extra(VORTEX)
    current, thrust, h = (0.3, -0.4, 0.1), 40.0, 1e-5
    linear = linearise_at(tested, TURNING, thrust, current)

    def rates(x):
        moved = np.array(tested.fin_angles(*x[12:15].tolist())) + TURNING[12:]
        return np.array(tested.rates([*x[:12].tolist(), *moved.tolist()], moved.tolist(), float(x[15]), current)[:12])

    x0 = np.array([*TURNING[:12], 0.0, 0.0, 0.0, thrust])
    slopes = np.array([(rates(x0 + h * a) - rates(x0 - h * a)) / (2 * h) for a in np.eye(16)]).T
    # smooth there: h squared times third derivatives of order 1 to 10, and round-off 1e-15 / h
    assert np.allclose(np.hstack([linear.A, linear.B]), slopes, rtol=1e-7, atol=1e-8)
    assert np.allclose(linear.remainder, rates(x0), rtol=1e-13, atol=1e-13)
    through = np.array(TURNING[6:9]) - rotation(np.array(TURNING[3:6])).T @ current
    assert linear.speed == pytest.approx(float(np.linalg.norm(through)))


def test_straight_flight_is_the_special_case():
    tested = model(FOURFOLD | ROLLING, cg=(0.05, 0.0, 0.05), balance=0.995)
    general = linearise_at(tested, [0.0] * 6 + [1.5] + [0.0] * 9, tested.thrust(1.5))
    special = linearise(tested, 1.5)
    assert np.array_equal(general.A, special.A)
    assert np.array_equal(general.B, special.B)
    assert np.array_equal(general.remainder[1:], special.remainder[1:])
    assert (general.remainder[0], special.remainder[0]) == (1.5, 0.0)
    assert (special.inputs, special.speed) == (INPUTS, 1.5)


@pytest.mark.parametrize(
    ("state", "message"),
    [(TURNING[:12], "shape"), ([*TURNING[:4], 0.5 * np.pi + 0.1, *TURNING[5:]], "limit is 90 deg")],
)
def test_a_state_that_has_no_linear_model_is_refused(state, message):
    with pytest.raises(InputError, match=message):
        linearise_at(model(), state, 30.0)


def test_the_bracket_of_eq_2_9_times_the_inverse_mass_is_the_acceleration():
    tested = Model.from_values(craft(cg=CG), FOURFOLD, options=AT_ORIGIN)
    nu, down, delta = [1.2, -0.7, 0.2, 0.1, 0.05, -0.1], [0.6, 0.0, 0.8], [0.1] * 4
    found = acceleration(tested.constants, nu, down, delta, 30.0, MATH)
    bracket = total_load(tested.constants, nu, down, delta, 30.0, MATH)
    assert np.allclose(tested.mass_matrix @ found, bracket, rtol=1e-12, atol=1e-10)
