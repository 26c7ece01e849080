"""Added mass of the 6:1 spheroid through plan, tank (potential part only) and regression, against Lamb."""

import math

import pytest

import towtank as tt
from towtank.derive.show import primes


@pytest.fixture(scope="module")
def found():
    craft = tt.read_craft("spheroid-6-1")
    return tt.derive(tt.tow(tt.standard_plan(craft), tt.FastTank(parts="potential")))


def lamb(slenderness: float) -> dict[str, float]:
    """Primed added mass about the centre of a prolate spheroid (lamb1932, articles 114 and 373)."""
    e = math.sqrt(1.0 - slenderness**-2)
    log = math.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e * e) / e**3 * (0.5 * log - e)
    beta = 1.0 / e**2 - (1.0 - e * e) / (2.0 * e**3) * log
    k1, k2 = alpha / (2.0 - alpha), beta / (2.0 - beta)
    k3 = e**4 * (beta - alpha) / ((2.0 - e * e) * (2.0 * e * e - (2.0 - e * e) * (beta - alpha)))
    mass = math.pi / 6.0 / slenderness**2 / 0.5
    inertia = mass * 0.25 * (1.0 + slenderness**-2) / 5.0
    return {"Xudot": -k1 * mass, "Yvdot": -k2 * mass, "Nrdot": -k3 * inertia, "Nuv": (k1 - k2) * mass}


def test_added_mass_and_munk_moment_are_lambs_within_one_percent(found):
    got = primes(found)
    for name, value in lamb(6.0).items():
        assert got[name] == pytest.approx(value, rel=0.01), name
    assert (got["Zwdot"], got["Mqdot"]) == (got["Yvdot"], got["Nrdot"])


def test_potential_flow_has_no_drag_and_obeys_the_lumped_identities(found):
    """Xvr = -Yvdot, Yur = Xudot, Nuv = Yvdot - Xudot (THEORY section 2); what has no potential part is round-off."""
    assert found["Xvr"] == pytest.approx(-found["Yvdot"], rel=1e-9)
    assert found["Yur"] == pytest.approx(found["Xudot"], rel=1e-9)
    assert found["Nuv"] == pytest.approx(found["Yvdot"] - found["Xudot"], rel=1e-9)
    got = primes(found)
    for name in ("Xuu", "Xvv", "Xrr", "Yuv", "Yvv", "Yrr", "Nur", "Nvv", "Nrr", "Yrdot"):
        assert abs(got[name]) < 1e-12, name


def test_munk_slope_at_the_origin_is_the_wide_one(found):
    assert found.origin["Nuv"] == pytest.approx(found["Nuv"], rel=1e-9)
