"""Longer checks of the fast tank, run by make validate."""

from __future__ import annotations

import numpy as np
import pytest

from suboff import slopes
from towtank import read_craft
from towtank.tank.fast import build as build_module
from towtank.tank.fast.build import build
from towtank.tank.fast.motion import MotionRecord
from towtank.tank.fast.potential import added_mass_with_fins, hull_flow
from towtank.tank.fast.tank import FastTank

pytestmark = pytest.mark.validate


def test_added_mass_of_the_spheroid_converges_to_lamb() -> None:
    craft = read_craft("spheroid-6-1")
    exact = 0.917123 * np.pi  # lamb1932 at 6:1, unit density, 6 m long
    errors = [hull_flow(craft, n, m).added_mass[1, 1] / exact - 1.0 for n, m in ((36, 12), (72, 24), (144, 48))]
    assert abs(errors[2]) < 0.002
    # Flat panels on a curved body with section area kept: at least first order.
    assert abs(errors[1]) < 0.6 * abs(errors[0])
    assert abs(errors[2]) < 0.6 * abs(errors[1])


def test_added_mass_with_fins_does_not_hang_on_the_panelling() -> None:
    craft = read_craft("suboff-fins")
    coarse = added_mass_with_fins(craft, hull_flow(craft, 72, 24))
    fine = added_mass_with_fins(craft, hull_flow(craft, 120, 36))
    for i in (0, 1, 5):
        assert coarse[i, i] == pytest.approx(fine[i, i], rel=0.01)


def test_derivatives_do_not_hang_on_the_number_of_strips(monkeypatch: pytest.MonkeyPatch) -> None:
    craft = read_craft("suboff-fins")
    build.cache_clear()
    usual = slopes(craft)
    monkeypatch.setattr(build_module, "STRIPS", 192)
    build.cache_clear()
    fine = slopes(craft)
    build.cache_clear()
    for name in usual:
        assert usual[name][0] == pytest.approx(fine[name][0], rel=0.005), name


def test_no_state_draws_energy_from_the_water() -> None:
    craft = read_craft("suboff-x")
    rng = np.random.default_rng(0)
    nu = rng.normal(size=(20000, 6)) * np.array([2.0, 1.0, 1.0, 0.5, 0.5, 0.5])
    record = MotionRecord(np.arange(20000.0), nu, 0 * nu, np.zeros((20000, 4)))
    assert not record.remembers
    parts = FastTank(members=0).part_loads(build(craft, craft.speed), record)
    power = sum((parts[name][0] * nu).sum(axis=1) for name in ("tail", "crossflow", "drag", "fins"))
    assert power.max() <= 0.0
    assert np.abs((parts["kirchhoff"][0] * nu).sum(axis=1)).max() < 1e-9 * np.abs(parts["kirchhoff"][0] * nu).max()
