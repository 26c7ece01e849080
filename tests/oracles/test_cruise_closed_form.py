"""Least energy per metre against closed forms, and the power that level flight must balance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import synthetic_craft
from towtank.craft.craft import Propeller
from towtank.design.cruise import cruise, flight, read_cruise, write_cruise
from towtank.design.power import DRIVE, OVERALL, drive_of, electrical_power
from towtank.errors import InputError
from towtank.model.equations import Model


def model(**options: float) -> Model:
    return synthetic_craft.model(synthetic_craft.STABLE, **options)


@pytest.mark.parametrize("hotel", [5.0, 40.0, 300.0])
@pytest.mark.parametrize("efficiency", [0.3, 0.6])
def test_a_neutral_craft_in_still_water_flies_at_the_closed_form(hotel: float, efficiency: float) -> None:
    boat = model()
    X = -boat.derivatives["Xuu"]
    found = cruise(boat, hotel, efficiency=efficiency)
    u = (hotel * efficiency / (2.0 * X)) ** (1.0 / 3.0)
    assert found.closed == pytest.approx(u, rel=1e-12)
    # The minimum is flat: the search ends within a thousandth of the speed, a millionth of the energy.
    assert found.best_neutral.speed == pytest.approx(u, rel=2e-3)
    assert found.best_neutral.energy == pytest.approx(1.5 * hotel / u, rel=1e-5)
    assert found.best is not None
    assert found.best.energy == pytest.approx(found.best_neutral.energy, rel=1e-6)
    assert (found.best.pitch, found.best.elevator) == (pytest.approx(0.0, abs=1e-8), pytest.approx(0.0, abs=1e-8))


@pytest.mark.parametrize("current", [-0.3, -0.1, 0.2, 0.5])
def test_in_a_current_the_best_speed_is_the_root_of_the_cubic(current: float) -> None:
    """d/du [(X u^3 / eta + hotel) / (u + c)] = 0: 2 X u^3 + 3 X c u^2 = hotel eta."""
    boat, hotel, eta = model(), 60.0, 0.5
    X = -boat.derivatives["Xuu"]
    roots = np.roots([2.0 * X, 3.0 * X * current, 0.0, -hotel * eta])
    u = float(roots[(abs(roots.imag) < 1e-9) & (roots.real > max(0.0, -current))].real[0])
    found = cruise(boat, hotel, current, eta).best_neutral
    assert found.speed == pytest.approx(u, rel=3e-3)
    assert found.ground == pytest.approx(found.speed + current, rel=1e-12)
    assert found.energy == pytest.approx((X * u**3 / eta + hotel) / (u + current), rel=1e-5)


def test_a_known_propeller_gives_the_power_of_its_torque() -> None:
    table = ((0.0, 0.45, 0.060), (0.5, 0.30, 0.045), (1.0, 0.10, 0.020), (1.2, 0.0, 0.008))
    screw = Propeller(diameter=0.4, wake=0.15, thrust_deduction=0.08, table=table)
    boat = model()
    boat = replace(boat, craft=replace(boat.craft, propeller=screw))
    drive = drive_of(boat)
    assert drive.assumed
    assert drive.shaft == DRIVE
    # In balance both ways to the power agree at every speed, for the advance ratio is the same.
    for u in (0.4, 1.0, 2.0):
        thrust = -boat.derivatives["Xuu"] * u * u
        assert electrical_power(boat, drive, thrust, thrust, u) == pytest.approx(thrust * u / drive.overall, rel=1e-9)
    assert drive_of(model()).overall == OVERALL
    assert drive_of(boat, 0.4).origin == "given"


@pytest.mark.parametrize("percent", [-0.2, -0.05, 0.1])
def test_level_flight_spends_on_drag_and_lift_what_the_thrust_gives(percent: float) -> None:
    boat = model(net_buoyancy=percent)
    found = flight(boat, 1.6, 40.0, 0.0, drive_of(boat))
    assert found is not None
    state = np.zeros(12 + len(boat.craft.fins))
    state[4], state[6], state[8] = found.pitch, found.u, found.w
    state[12:] = boat.craft.mixing[:, 1] * found.elevator
    loads = boat.loads(state.tolist(), boat.thrust(1.6))
    spent = -sum(float(loads[part][0]) * found.u + float(loads[part][2]) * found.w for part in ("damping", "fins"))
    # Constant depth: weight and buoyancy do no work, nor does the added mass carried along.
    assert found.thrust * found.u == pytest.approx(spent, rel=1e-6)
    assert found.induced > 0.0
    assert np.sign(found.pitch) == -np.sign(percent)  # a heavy craft flies nose up


def test_carrying_weight_costs_energy_and_more_of_it_more() -> None:
    energies = []
    for percent in (0.0, -0.1, -0.2, -0.3):
        found = cruise(model(net_buoyancy=percent), 40.0)
        assert found.best is not None
        energies.append(found.best.energy)
        assert found.best_neutral.energy == pytest.approx(energies[0], rel=1e-3)
    assert energies == sorted(energies)


@pytest.mark.parametrize(
    ("hotel", "current", "efficiency", "words"),
    [
        (0.0, 0.0, None, "slower is always cheaper"),
        (1e6, 0.0, None, "3 times that of the captive tests"),
        (40.0, -9.0, None, "against the craft it is negative"),
        (40.0, 0.0, 1.2, "between 0 and 1"),
    ],
)
def test_what_has_no_answer_is_refused(hotel: float, current: float, efficiency: float | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        cruise(model(), hotel, current, efficiency)


def test_a_cruise_study_reads_back_as_written(tmp_path: Path) -> None:
    found = cruise(model(net_buoyancy=-0.2, std=0.05), 40.0, 0.1)
    assert found.energy_std == pytest.approx(
        0.05 * found.best_neutral.propulsion / (found.best_neutral.propulsion + 40.0)
    )
    again = read_cruise(write_cruise(found, tmp_path))
    assert again == found
