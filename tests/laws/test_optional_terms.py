"""Third-order terms and the even Xuuvv: out of a fit unless asked, and the same in every place that knows them."""

import numpy as np
import pytest
from derive_synthetic import DENSITY, LENGTH, SPEED

import synthetic_craft as synthetic
from towtank.craft.library import read_craft
from towtank.derive.convert import about_point
from towtank.derive.derive import derive
from towtank.errors import DeriveError
from towtank.frames import move_load, move_velocity
from towtank.model.equations import Model
from towtank.model.values import known
from towtank.plan.standard import standard_plan
from towtank.symbols import FOURFOLD_TIES, OPTIONAL, OPTIONAL_TIES, REPLACED, TERMS
from towtank.tank.campaign import tow
from towtank.tank.lpm import LpmTank
from towtank.terms import term_loads

HOKIE = read_craft("hokie")
NAMES = tuple(name for group in OPTIONAL.values() for name in group)


def values_of(names, seed=3):
    """Values of 0.3 to 1 % in primes, with the ties of 4-fold symmetry among ``names``."""
    rng = np.random.default_rng(seed)
    out = {
        name: TERMS[name].prime_factor(DENSITY, LENGTH, SPEED) * rng.uniform(0.003, 0.01) * rng.choice([-1.0, 1.0])
        for name in names
    }
    ties = FOURFOLD_TIES | OPTIONAL_TIES
    return out | {name: ties[name][1] * out[ties[name][0]] for name in names if name in ties}


BASE = values_of(
    ("Xudot", "Yvdot", "Zwdot", "Mqdot", "Nrdot", "Xuu", "Xvv", "Xww", "Yuv", "Yvv", "Yur", "Yrr", "Zuw", "Zww", "Zuq",
     "Zqq", "Nuv", "Nvv", "Nur", "Nrr", "Muw", "Mww", "Muq", "Mqq"), seed=5,
)  # fmt: skip


@pytest.mark.parametrize("group", OPTIONAL)
def test_a_fit_finds_optional_terms_when_asked_and_leaves_them_out_otherwise(group):
    gone = REPLACED.get(group, ())
    values = {name: value for name, value in BASE.items() if name not in gone} | values_of(OPTIONAL[group])
    plan = standard_plan(HOKIE, frequencies={"sway": (1.0, 2.0), "yaw": (1.0, 2.0)}, periods=2, samples=32)
    runs = tow(plan, LpmTank(values))
    found = derive(runs, optional=(group,), screening=False)
    assert found.values == pytest.approx([values.get(name, 0.0) for name in found.names], rel=1e-8, abs=1e-8)
    assert set(OPTIONAL[group]) <= set(found.names)
    assert not set(gone) & set(found.names)
    assert not set(NAMES) & set(derive(runs).names)


def test_xuuvv_is_xvv_less_xvvvv_in_one_plane():
    # u2 = V2 - v2: a file of the source's form is read into Xvv and Xvvvv without loss.
    nu = np.zeros((5, 6))
    nu[:, 0], nu[:, 1] = [1.0, 2.0, 0.5, 1.5, 1.0], [0.1, -0.4, 0.3, 0.0, -1.0]
    still, idle = np.zeros((5, 6)), np.zeros((5, 4))
    ours = term_loads({"Xvv": 7.0, "Xvvvv": -7.0}, nu, still, idle)
    np.testing.assert_allclose(term_loads({"Xuuvv": 7.0}, nu, still, idle), ours, rtol=1e-12)


def test_an_unknown_group_is_refused_by_name():
    runs = tow(standard_plan(HOKIE, periods=2, samples=16), LpmTank(BASE))
    with pytest.raises(DeriveError, match=r"fourth-order.*third-order, Xuuvv"):
        derive(runs, optional=("fourth-order",))


def test_third_order_terms_move_exactly_but_for_the_speed_that_divides_them():
    values = values_of(OPTIONAL["third-order"])
    moved = about_point(known(HOKIE, values, "lumped", "published"), HOKIE.origin_from_nose - 0.7)
    rng = np.random.default_rng(1)
    nu = np.zeros((40, 6))
    nu[:, 0] = rng.uniform(0.5, 2.0, 40)
    nu[:20, [1, 5]], nu[20:, [2, 4]] = rng.uniform(-1, 1, (20, 2)), rng.uniform(-1, 1, (20, 2))
    shift, still, idle = np.array([0.7, 0.0, 0.0]), np.zeros((40, 6)), np.zeros((40, 4))
    there = move_velocity(nu, shift)

    def times_speed(set_of, state):
        return term_loads(set_of, state, still, idle) * np.linalg.norm(state[:, :3], axis=1)[:, None]

    np.testing.assert_allclose(
        times_speed(moved.as_dict(), there), move_load(times_speed(values, nu), shift), rtol=1e-9, atol=1e-9
    )


def test_the_equations_of_motion_hold_the_same_loads_as_the_sums_of_terms():
    craft = synthetic.craft()
    values = BASE | values_of(NAMES)
    model = Model.from_values(craft, values)
    rng = np.random.default_rng(2)
    for nu in rng.uniform(-1.0, 1.0, (20, 6)) + np.array([2.0, 0, 0, 0, 0, 0]):
        load = term_loads(values, nu[None], np.zeros((1, 6)), np.zeros((1, 4)))[0]
        assert model.captive_load(nu, np.zeros(6), np.zeros(4)) == pytest.approx(load, rel=1e-12, abs=1e-10)
