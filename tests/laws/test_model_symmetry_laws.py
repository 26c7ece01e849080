"""Frames, mirrors and turns: the equations do not know which way is north, port or up in the hull."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_cases import FEW, FOURFOLD, ROLLING, ahead, angles, array, attitudes, model, numbers, velocities
from scipy.integrate import solve_ivp

from towtank.errors import InputError
from towtank.frames import rotation
from towtank.model.equations import Model
from towtank.model.options import ModelOptions
from towtank.model.rigid_body import coriolis_matrix, mass_matrix
from towtank.model.values import lumped_to_split, split_to_lumped, to_variant

CG = (0.1, 0.0, 0.05)
ROUND_OFF = 1e-11  # relative to the largest acceleration; the mass matrix has a condition number of some 1e2

currents = numbers(3, 0.7)


def _close(a, b, tolerance=ROUND_OFF):
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    assert abs(a - b).max() <= tolerance * (1.0 + abs(b).max())


@FEW
@given(velocities, attitudes, angles, currents)
def test_a_uniform_current_is_only_a_change_of_frame(nu, attitude, delta, current):
    craft = model(FOURFOLD | ROLLING, cg=CG, balance=0.99)
    still = np.array(craft.rates([0.0] * 3 + attitude + nu + delta, delta, 100.0))
    carried = rotation(np.array(attitude)).T @ current
    over_ground = [*(np.array(nu[:3]) + carried), *nu[3:]]
    moving = np.array(craft.rates([0.0] * 3 + attitude + over_ground + delta, delta, 100.0, current))
    _close(moving[:3], still[:3] + current)
    _close(moving[6:9], still[6:9] - np.cross(nu[3:], carried))
    _close(np.delete(moving, [0, 1, 2, 6, 7, 8]), np.delete(still, [0, 1, 2, 6, 7, 8]))


@FEW
@given(velocities, attitudes, currents)
def test_the_rigid_body_may_be_written_with_absolute_or_relative_velocity(nu, attitude, current):
    body = model(cg=CG, inertia=((25.0, 2.0, -3.0), (2.0, 1200.0, 4.0), (-3.0, 4.0, 1210.0))).body
    M, carried = array(mass_matrix(body)), rotation(np.array(attitude)).T @ current
    relative = np.array(nu)
    absolute = relative + np.concatenate([carried, np.zeros(3)])
    turning = np.concatenate([-np.cross(nu[3:], carried), np.zeros(3)])
    _close(
        M @ turning + array(coriolis_matrix(body, absolute.tolist())) @ absolute,
        array(coriolis_matrix(body, nu)) @ relative,
    )


def test_a_flight_in_a_current_is_the_flight_in_still_water_carried_along():
    craft, current = model(cg=CG), np.array([0.3, -0.2, 0.05])
    delta = craft.fin_angles(0.15, 0.05, 0.0)
    start = np.array([0.0] * 3 + [0.1, 0.0, 0.4] + [1.5] + [0.0] * 5 + [0.0] * 4)
    carried = start.copy()
    carried[6:9] += rotation(start[3:6]).T @ current

    def fly(state, water):
        return solve_ivp(
            lambda _, s: craft.rates(s, delta, craft.thrust(1.5), water),
            (0, 20),
            state,
            "DOP853",
            rtol=1e-10,
            atol=1e-11,
        ).y[:6, -1]

    # integration tolerance over 30 m of path
    assert np.allclose(fly(carried, current) - fly(start, np.zeros(3)), [*(20 * current), 0, 0, 0], atol=1e-7)


def _mirrored(nu, attitude, delta):
    """The port-starboard image. A fin's image is the one at 180 deg minus its azimuth; its angle changes sign."""
    nu = np.array(nu) * [1, -1, 1, -1, 1, -1]
    attitude = np.array(attitude) * [-1, 1, -1]
    return nu.tolist(), attitude.tolist(), [-delta[1], -delta[0], -delta[3], -delta[2]]


@pytest.mark.parametrize("axisymmetric", [False, True])
@FEW
@given(velocities, attitudes, angles)
def test_port_and_starboard_are_alike(axisymmetric, nu, attitude, delta):
    craft = model(FOURFOLD | ROLLING, ModelOptions(axisymmetric_crossflow=axisymmetric), cg=CG)
    image = craft.acceleration(*_mirrored(nu, attitude, delta), 50.0)
    _close(np.array(image) * [1, -1, 1, -1, 1, -1], craft.acceleration(nu, attitude, delta, 50.0))


def _turned(nu, angle):
    """Components of ``nu`` in axes rolled by ``angle``."""
    R1 = rotation(np.array([angle, 0.0, 0.0])).T
    return np.concatenate([R1 @ nu[:3], R1 @ nu[3:]])


@pytest.mark.parametrize("axisymmetric", [False, True])
@pytest.mark.parametrize("layout", [(225.0, 315.0, 135.0, 45.0), (270.0, 0.0, 180.0, 90.0)])
@FEW
@given(velocities, angles, st.floats(-3.0, 3.0))
def test_a_fourfold_craft_may_be_turned_by_a_quarter(layout, axisymmetric, nu, delta, phi):
    craft = model(FOURFOLD, ModelOptions(axisymmetric_crossflow=axisymmetric), azimuths=layout)
    old = [round(a) % 360 for a in layout]
    moved = [delta[old.index((a + 90) % 360)] for a in old]
    turned = _turned(np.array(nu), 0.5 * np.pi)
    image = craft.acceleration(turned.tolist(), [phi + 0.5 * np.pi, 0.1, 0.0], moved, 50.0)
    _close(image, _turned(np.array(craft.acceleration(nu, [phi, 0.1, 0.0], delta, 50.0)), 0.5 * np.pi))


@FEW
@given(velocities, st.floats(-3.0, 3.0))
def test_a_body_of_revolution_may_be_turned_by_any_angle_with_axisymmetric_crossflow(nu, angle):
    hull = model(FOURFOLD, ModelOptions(axisymmetric_crossflow=True), azimuths=())
    image = hull.acceleration(_turned(np.array(nu), angle).tolist(), [0.0] * 3, [], 0.0)
    _close(image, _turned(np.array(hull.acceleration(nu, [0.0] * 3, [], 0.0)), angle), 1e-10)


def test_separate_crossflow_products_break_the_turn_by_45_deg_by_their_known_ratio():
    """At 45 deg |v|v and |w|w together give 1/sqrt(2) of what the same flow gives along one axis."""
    cross = {"Yvv": -900.0, "Zww": -900.0}
    straight, diagonal = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.5**0.5, 0.5**0.5, 0.0, 0.0, 0.0]
    for axisymmetric, ratio in ((False, 0.5**0.5), (True, 1.0)):
        hull = model(cross, ModelOptions(axisymmetric_crossflow=axisymmetric), azimuths=())
        force = np.linalg.norm(hull.captive_load(diagonal, [0.0] * 6, [])[1:3])
        assert force == pytest.approx(ratio * abs(hull.captive_load(straight, [0.0] * 6, [])[1]), rel=1e-12)


def _both(values):
    lumped = model(values, cg=CG)
    return lumped, model(lumped_to_split(values), variant="split", cg=CG)


@FEW
@given(velocities, attitudes, angles)
def test_lumped_and_split_give_the_same_acceleration_ahead(nu, attitude, delta):
    lumped, split = _both(FOURFOLD | ROLLING)
    nu = ahead(nu)
    _close(split.acceleration(nu, attitude, delta, 50.0), lumped.acceleration(nu, attitude, delta, 50.0))


def test_lumped_and_split_differ_astern_where_lift_type_terms_keep_their_sign():
    lumped, split = _both(FOURFOLD)
    nu = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.1]
    loads = [np.array(m.captive_load(nu, [0.0] * 6, [0.0] * 4)) for m in (lumped, split)]
    # Yur|u|r against (Yur - Xudot)|u|r + Xudot u r: twice Xudot u r; likewise Yrdot u r in N
    assert (loads[1] - loads[0])[[1, 5]] == pytest.approx([2 * -30.0 * -0.1, 2 * 50.0 * -0.1], abs=1e-9)


def test_changing_the_variant_twice_changes_nothing_and_carries_the_covariance():
    values = FOURFOLD | ROLLING
    back = split_to_lumped(lumped_to_split(values))
    assert all(back[name] == pytest.approx(value, rel=1e-12) for name, value in values.items())
    lumped = model().derivatives
    spread = np.diag(np.arange(1.0, len(lumped.names) + 1))
    known = Model.from_values(model().craft, FOURFOLD).derivatives
    uncertain = type(known)(**{**known.__dict__, "covariance_fit": spread, "origin": {"Nuv": -450.0}})
    split = to_variant(uncertain, "split")
    i, names = split.names.index("Nuv"), lumped.names
    expected = sum(spread[names.index(n), names.index(n)] for n in ("Nuv", "Yvdot", "Xudot"))
    assert split.covariance[i, i] == pytest.approx(expected)
    assert split.origin["Nuv"] == pytest.approx(-450.0 - (-900.0 + 30.0))
    assert np.allclose(to_variant(split, "lumped").covariance, spread)


def test_entries_that_couple_the_planes_have_no_other_variant():
    with pytest.raises(InputError, match="couples the vertical"):
        lumped_to_split({"Xvdot": -1.0})


@FEW
@given(st.integers(0, 2**31), st.booleans())
def test_a_batch_of_states_is_a_loop_of_floats(seed, split):
    rng = np.random.default_rng(seed)
    craft = _both(FOURFOLD | ROLLING)[split].with_options(kappa_v=0.3, kappa_r=0.5)
    states = rng.uniform(-0.5, 0.5, (7, 16))
    commands = rng.uniform(-0.5, 0.5, (7, 4))
    batch = craft.rates(list(states.T), list(commands.T), np.full(7, 40.0), (0.1, 0.2, 0.0))
    loop = [craft.rates(s, c, 40.0, (0.1, 0.2, 0.0)) for s, c in zip(states, commands, strict=True)]
    # the two paths add the same products; structural zeros aside, in the same order
    assert np.allclose(np.array(batch).T, loop, rtol=1e-13, atol=1e-13)


class Symbol:
    """A number that refuses to be asked whether it is true, large or equal."""

    def __init__(self, value):
        self.value = value

    def _refuse(self, *_):
        raise AssertionError("the right-hand side asked a state a question")

    __bool__ = __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __float__ = _refuse
    __hash__ = None

    @staticmethod
    def of(x):
        return x.value if isinstance(x, Symbol) else x

    def __add__(self, other):
        return Symbol(self.value + Symbol.of(other))

    def __sub__(self, other):
        return Symbol(self.value - Symbol.of(other))

    def __rsub__(self, other):
        return Symbol(other - self.value)

    def __mul__(self, other):
        return Symbol(self.value * Symbol.of(other))

    def __truediv__(self, other):
        return Symbol(self.value / Symbol.of(other))

    def __rtruediv__(self, other):
        return Symbol(other / self.value)

    def __neg__(self):
        return Symbol(-self.value)

    __radd__, __rmul__ = __add__, __mul__


class SymbolOps:
    def __getattr__(self, name):
        return lambda *x: Symbol(getattr(np, name)(*map(Symbol.of, x)))


@pytest.mark.parametrize("axisymmetric", [False, True])
def test_no_state_is_asked_a_question_so_symbols_run_through_the_same_text(axisymmetric):
    options = ModelOptions(kappa_v=0.2, kappa_r=0.4, axisymmetric_crossflow=axisymmetric)
    craft = model(FOURFOLD | ROLLING, options, cg=CG)
    state = np.linspace(-0.4, 0.6, 16)
    command, current = [0.1, -0.2, 0.3, 0.9], (0.1, 0.2, 0.3)
    symbols = craft.rates(
        [Symbol(x) for x in state],
        [Symbol(x) for x in command],
        Symbol(30.0),
        [Symbol(x) for x in current],
        SymbolOps(),
    )
    assert np.allclose([x.value for x in symbols], craft.rates(state, command, 30.0, current), rtol=1e-13, atol=1e-13)
