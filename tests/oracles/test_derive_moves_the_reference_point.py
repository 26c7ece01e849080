"""Another origin is another description of the same hydrodynamics: the loads must be those of rigid-body kinematics."""

import numpy as np
import pytest

from towtank.derive.convert import about_point, rigid_shift, transformation
from towtank.derive.show import origin_primes, primes
from towtank.derive.table import Derivatives, Reference
from towtank.frames import move_load, move_velocity
from towtank.symbols import STANDING, TERMS
from towtank.terms import term_loads

QUADRATIC = ("Yvv", "Yrr", "Zww", "Zqq", "Mww", "Mqq", "Nvv", "Nrr", "Kvv", "Krr", "Xvvvv", "Xwwww")
SHIFT = 0.37


def build(values, **extra) -> Derivatives:
    names = tuple(n for n in TERMS if n in values)
    rng = np.random.default_rng(0)
    root = rng.standard_normal((len(names), len(names)))
    flat = np.zeros_like(root)
    array = np.array([values[n] for n in names])
    return Derivatives("hull", "published", "lumped", Reference(4.0, 2.0, 1000.0, 2.0), names, array,
                       root @ root.T, flat, flat, **extra)  # fmt: skip


def random_set(skip=()):
    rng = np.random.default_rng(1)
    values = {n: rng.uniform(-10, 10) for n in STANDING if n not in skip}
    for i, load in enumerate("XYZKMN"):
        for j in range(i):
            values[f"{load}{'uvwpqr'[j]}dot"] = values[f"{'XYZKMN'[j]}{'uvwpqr'[i]}dot"]
    return values


def planar(count=200):
    """Motions ahead without roll in either plane; accelerations in all six."""
    rng = np.random.default_rng(2)
    nu = np.zeros((2 * count, 6))
    nu[:, 0] = rng.uniform(0.5, 3.0, 2 * count)
    nu[:count, [1, 5]] = rng.uniform(-1, 1, (count, 2))
    nu[count:, [2, 4]] = rng.uniform(-1, 1, (count, 2))
    return nu, rng.uniform(-1, 1, (2 * count, 6)), rng.uniform(-0.3, 0.3, (2 * count, 4))


def test_linear_axial_fin_and_added_mass_terms_move_exactly():
    d = build({n: v for n, v in random_set(QUADRATIC).items() if n not in ("Zudot", "Xwdot")})
    moved = about_point(d, d.reference.origin_from_nose - SHIFT)
    nu, nudot, control = planar()
    shift = np.array([SHIFT, 0.0, 0.0])
    there = term_loads(moved.as_dict(), move_velocity(nu, shift), move_velocity(nudot, shift), control)
    here = term_loads(d.as_dict(), nu, nudot, control)
    np.testing.assert_allclose(there, move_load(here, shift), rtol=1e-10, atol=1e-9)
    assert moved.reference.origin_from_nose == pytest.approx(2.0 - SHIFT)


def test_added_mass_moves_as_a_matrix():
    values = random_set()
    d = build(values)
    moved = about_point(d, 2.0 - SHIFT)
    old, new = (np.array([[s[f"{a}{b}dot"] for b in "uvwpqr"] for a in "XYZKMN"]) for s in (d, moved))
    h = rigid_shift(SHIFT)
    np.testing.assert_allclose(new, h.T @ old @ h, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("shift", [0.37, -0.8])
def test_pure_sway_and_pure_yaw_about_the_new_point_are_exact_for_quadratic_terms(shift):
    d = build({n: v for n, v in random_set().items() if n[1:] in ("vv", "rr", "ww", "qq") and n[0] in "YZMN"})
    moved = about_point(d, 2.0 - shift)
    new = np.zeros((8, 6))
    new[np.arange(8), [1, 1, 5, 5, 2, 2, 4, 4]] = [0.4, -0.4, 0.7, -0.7, 0.4, -0.4, 0.7, -0.7]
    arm = np.array([shift, 0.0, 0.0])
    still, none = np.zeros_like(new), np.zeros((8, 4))
    here = term_loads(d.as_dict(), move_velocity(new, -arm), still, none)
    there = term_loads(moved.as_dict(), new, still, none)
    # X of a pure yaw about the new point is none of these terms' business, and is zero in both.
    np.testing.assert_allclose(there, move_load(here, arm), rtol=1e-12, atol=1e-12)
    assert moved.quality["moved"]["residual"]["Y"] > 0.0


def test_there_and_back_is_the_same_set():
    d = build(random_set(QUADRATIC))
    back = about_point(about_point(d, 1.1), 2.0)
    for name in d.names:
        assert back[name] == pytest.approx(d[name], rel=1e-10, abs=1e-10)
    order = [back.names.index(n) for n in d.names]
    np.testing.assert_allclose(back.covariance[np.ix_(order, order)], d.covariance, rtol=1e-8, atol=1e-8)


def test_covariance_moves_with_the_values():
    """Samples of the old set, each moved, scatter as the moved covariance says."""
    d = build(random_set())
    names, matrix = transformation(d.names, SHIFT)
    moved = about_point(d, 2.0 - SHIFT)
    assert moved.names == names
    rng = np.random.default_rng(3)
    draws = rng.multivariate_normal(d.values, d.covariance, 4000) @ matrix.T
    std = np.sqrt(np.diag(moved.covariance))
    # 4000 draws give a standard deviation to 1.1 %; five of these are allowed.
    np.testing.assert_allclose(draws.std(axis=0), std, rtol=0.06)


def test_slopes_at_the_origin_move_with_their_covariance():
    origin = {"Yuv": -3.0, "Nuv": -5.0}
    quality = {"origin": {"order": ["Yuv", "Nuv"], "covariance": [[0.04, 0.03], [0.03, 0.09]]}}
    d = build({"Yuv": -3.0, "Nuv": -5.0}, origin=origin, origin_std={"Yuv": 0.2, "Nuv": 0.3}, quality=quality)
    moved = about_point(d, 2.0 - SHIFT)
    assert moved.origin["Nuv"] == pytest.approx(-5.0 + SHIFT * 3.0)
    assert moved.origin_std["Nuv"] ** 2 == pytest.approx(0.09 - 2 * SHIFT * 0.03 + SHIFT**2 * 0.04)
    assert "Yur" not in moved.origin


def test_reference_length_changes_the_primes_only():
    d = build({"Yuv": -3.0, "Nur": -5.0, "Yrdot": 2.0})
    roddy = primes(d, length=2.0)
    ours = primes(d)
    # Powers of L: 2 for Yuv, 4 for Nur and Yrdot.
    assert roddy["Yuv"] == pytest.approx(4 * ours["Yuv"])
    assert roddy["Nur"] == pytest.approx(16 * ours["Nur"])
    assert roddy["Yrdot"] == pytest.approx(16 * ours["Yrdot"])
    assert ours["Yuv"] == pytest.approx(-3.0 / (0.5 * 1000.0 * 4.0**2))
    assert primes(d, speed=7.0) == ours
    assert about_point(d, length=2.0).as_dict() == d.as_dict()
    assert origin_primes(d) == {}
