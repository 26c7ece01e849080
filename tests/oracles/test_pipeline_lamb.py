"""Lamb's added mass found again by the whole chain: plan, captive tests with the potential part only, regression."""

from __future__ import annotations

import pytest

import towtank as tt


def test_spheroid_added_mass_through_the_whole_pipeline_follows_lamb() -> None:
    craft = tt.read_craft("spheroid-6-1")
    runs = tt.tow(tt.standard_plan(craft), tank=tt.FastTank(parts="potential", members=0))
    found = tt.derive(runs)
    mass = craft.mass.displaced_mass
    inertia = mass * (3.0**2 + 0.5**2) / 5.0
    # lamb1932, sections 114-115 at 6:1; 1728 flat panels are within 0.5 %, 1 % is asked of the chain.
    assert found["Xudot"] == pytest.approx(-0.045183 * mass, rel=0.01)
    assert found["Yvdot"] == pytest.approx(-0.917123 * mass, rel=0.01)
    assert found["Zwdot"] == pytest.approx(-0.917123 * mass, rel=0.01)
    assert found["Nrdot"] == pytest.approx(-0.762315 * inertia, rel=0.01)
    assert found["Mqdot"] == pytest.approx(-0.762315 * inertia, rel=0.01)
    # Munk: N = (Yvdot - Xudot) u v, and nothing else in drift.
    assert found["Nuv"] == pytest.approx((0.045183 - 0.917123) * mass, rel=0.01)
    assert abs(found["Yuv"]) < 0.002 * mass
    # The turning potential flow: Y = Xudot u r, X = -Yvdot v r.
    assert found["Yur"] == pytest.approx(-0.045183 * mass, rel=0.01)
    assert found["Xvr"] == pytest.approx(0.917123 * mass, rel=0.01)
