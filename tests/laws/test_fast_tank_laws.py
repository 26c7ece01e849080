"""What the fast tank must obey whatever its constants: energy, symmetry, limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank import read_craft
from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway, Turn, Yaw
from towtank.progress import Silent
from towtank.tank.fast.build import build
from towtank.tank.fast.fins import interference, lift_slope
from towtank.tank.fast.motion import MotionRecord, slip
from towtank.tank.fast.tank import FastTank

TANK = FastTank(members=0)
X_FINS, BARE = read_craft("suboff-x"), read_craft("suboff-bare")
SPEEDS = st.floats(-2.0, 3.0)
RATES = st.floats(-0.5, 0.5)
ROUNDING = 1e-6
"""Newtons: a millionth of the smallest load of interest; below it lie denormal speeds and the solve's rounding."""


def steady(craft: Craft, nu: np.ndarray, delta: np.ndarray | None = None, nudot: np.ndarray | None = None) -> dict:
    """Parts of the quasi-steady load, each (n, 6), for velocities (n, 6)."""
    nu = np.atleast_2d(np.asarray(nu, dtype=float))
    fins = np.zeros((len(nu), len(craft.fins))) if delta is None else np.broadcast_to(delta, (len(nu), len(craft.fins)))
    # Every second sample at rest: without headway all along there is no memory, so samples stand alone.
    still = np.zeros((2 * len(nu), 6))
    still[::2] = nu
    record = MotionRecord(np.arange(2.0 * len(nu)), still, 0.0 * still, np.repeat(fins, 2, axis=0))
    assert not record.remembers
    return {k: v[0, ::2] for k, v in TANK.part_loads(build(craft, craft.speed), record).items()}


def total(craft: Craft, nu: np.ndarray, delta: np.ndarray | None = None) -> np.ndarray:
    return sum(steady(craft, nu, delta).values())


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS, RATES, RATES, RATES))
@settings(max_examples=150, deadline=None)
def test_kirchhoff_loads_do_no_work_and_viscous_loads_take_energy(nu: tuple[float, ...]) -> None:
    velocity = np.array(nu)
    parts = steady(X_FINS, velocity)
    scale = 1e-9 * (1.0 + np.abs(parts["kirchhoff"][0] * velocity).sum())
    assert abs(parts["kirchhoff"][0] @ velocity) <= scale
    taken = sum(parts[name][0] @ velocity for name in ("tail", "crossflow", "drag", "fins"))
    assert taken <= 1e-9


def test_nothing_acts_on_a_craft_at_rest() -> None:
    assert np.abs(total(X_FINS, np.zeros(6))).max() == 0.0


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS, RATES, RATES, RATES))
@settings(max_examples=60, deadline=None)
def test_port_and_starboard_are_mirror_images(nu: tuple[float, ...]) -> None:
    mirror = np.array([1, -1, 1, -1, 1, -1])
    here, there = total(X_FINS, np.array(nu))[0], total(X_FINS, mirror * np.array(nu))[0]
    # The panel lattice is mirror-symmetric to the rounding of the linear solve.
    assert there == pytest.approx(mirror * here, rel=1e-7, abs=1e-6 * np.abs(here).max() + ROUNDING)


@given(st.tuples(SPEEDS, SPEEDS, SPEEDS, RATES, RATES, RATES))
@settings(max_examples=60, deadline=None)
def test_a_quarter_turn_of_a_fourfold_craft_turns_the_load(nu: tuple[float, ...]) -> None:
    turn = np.zeros((6, 6))
    for block in (0, 3):  # y -> z, z -> -y
        turn[block, block] = turn[block + 2, block + 1] = 1.0
        turn[block + 1, block + 2] = -1.0
    velocity = np.array(nu)
    assert total(X_FINS, turn @ velocity)[0] == pytest.approx(
        turn @ total(X_FINS, velocity)[0], rel=1e-7, abs=1e-6 * np.abs(total(X_FINS, velocity)).max() + ROUNDING
    )


def test_x_and_plus_fins_are_the_same_to_linear_order() -> None:
    plus = read_craft("suboff-fins")
    for column, step in ((1, 1e-3), (5, 1e-3)):
        nu = np.array([3.344, 0, 0, 0, 0, 0.0])
        nu[column] = step
        assert total(X_FINS, nu)[0, [1, 5]] == pytest.approx(total(plus, nu)[0, [1, 5]], rel=0.002)


def test_steady_drift_is_the_long_time_limit_of_the_memory_path() -> None:
    body = build(X_FINS, X_FINS.speed)
    time = np.linspace(0.0, 20.0, 600)
    nu = np.tile([3.0, 0.5, 0.0, 0.0, 0.0, 0.1], (600, 1))
    with_memory = TANK.part_loads(body, MotionRecord(time, nu, 0 * nu, np.zeros((600, 4))))
    without = TANK.part_loads(body, MotionRecord(time[:2], nu[:2], 0 * nu[:2], np.zeros((2, 4))))
    assert MotionRecord(time, nu, 0 * nu, np.zeros((600, 4))).remembers
    for name in ("tail", "fins"):
        assert with_memory[name][0, -1] == pytest.approx(without[name][0, -1], rel=1e-9)
    # The slip is summed by trapezoids over 600 samples.
    assert with_memory["crossflow"][0, -1] == pytest.approx(without["crossflow"][0, -1], rel=2e-3)


def test_slip_in_steady_drift_is_the_tangent_times_the_distance() -> None:
    time = np.linspace(0.0, 5.0, 200)
    nu = np.tile([2.0, 0.3, -0.2, 0.0, 0.0, 0.0], (200, 1))
    behind = np.array([0.1, 1.0, 4.0])
    dy, dz = slip(MotionRecord(time, nu, 0 * nu, np.zeros((200, 0))), -behind, behind)
    # Also at the first samples, before the record has run a hull length: the motion is taken as steady before it.
    assert dy == pytest.approx(np.tile(0.15 * behind, (200, 1)), rel=1e-9)
    assert dz == pytest.approx(np.tile(-0.10 * behind, (200, 1)), rel=1e-9)


def test_slip_in_a_steady_turn_is_the_same_from_any_start() -> None:
    behind = np.array([0.2, 2.0, 4.0])
    nu = np.tile([2.0, 0.0, 0.0, 0.0, 0.0, 0.1], (300, 1))
    time = np.linspace(0.0, 9.0, 300)
    dy, _ = slip(MotionRecord(time, nu, 0 * nu, np.zeros((300, 0))), 2.0 - behind, behind)
    # Trapezoids over 300 samples: 1e-4 of the length.
    assert dy[0] == pytest.approx(dy[-1], abs=1e-4)
    # A slice met at x = 2 and now at x = 2 - b has been passed for b / u at the mean arm 2 - b / 2.
    assert dy[-1] == pytest.approx(0.1 * behind / 2.0 * (2.0 - 0.5 * behind), abs=1e-4)


def test_interference_factors_reach_the_slender_body_limits() -> None:
    kw, kb, kd, kbd = interference(1e-3)
    assert (kw, kb, kd, kbd) == pytest.approx((1.0, 0.0, 1.0, 0.0), abs=5e-3)
    # pitts1957, chart 1 at r/s = 0.5: K_W + K_B = (1 + r/s)^2.
    assert sum(interference(0.5)[:2]) == pytest.approx(2.25, rel=1e-9)
    # SUBOFF's ratio, computed independently in the notes: 1.42, 0.75, 0.94, 0.49.
    assert interference(0.475) == pytest.approx((1.42, 0.75, 0.94, 0.49), abs=0.01)


def test_lift_slope_lies_between_slender_wing_and_thin_section() -> None:
    # Slender-wing limit pi A / 2 and two-dimensional limit 2 pi, each times the section efficiency.
    assert lift_slope(0.05) == pytest.approx(0.9 * 2 * np.pi * 0.05 / 3.8, rel=1e-3)
    assert lift_slope(200.0) == pytest.approx(0.9 * 2 * np.pi, rel=0.02)


def test_a_deflected_rudder_pushes_as_sname_says() -> None:
    fins = X_FINS.mixing @ np.radians([10.0, 0.0, 0.0])
    load = total(X_FINS, np.array([3.0, 0, 0, 0, 0, 0]), fins)[0]
    assert load[1] > 0.0 > load[5]
    fins = X_FINS.mixing @ np.radians([0.0, 10.0, 0.0])
    load = total(X_FINS, np.array([3.0, 0, 0, 0, 0, 0]), fins)[0]
    assert load[2] < 0.0
    assert load[4] < 0.0
    fins = X_FINS.mixing @ np.radians([0.0, 0.0, 10.0])
    assert total(X_FINS, np.array([3.0, 0, 0, 0, 0, 0]), fins)[0, 3] > 0.0


def test_fins_stall_between_twenty_and_forty_degrees() -> None:
    ahead = np.array([3.0, 0, 0, 0, 0, 0])
    force = [total(X_FINS, ahead, X_FINS.mixing @ np.radians([d, 0, 0]))[0, 1] for d in (5, 10, 20, 30, 36, 40)]
    assert force[1] == pytest.approx(2.0 * force[0], rel=0.1)
    assert force[:4] == sorted(force[:4])
    assert force[5] < 0.97 * max(force)


def test_loads_are_smooth_through_reversal() -> None:
    u = np.linspace(-0.05, 0.05, 21)
    y = total(X_FINS, np.stack([u, 0.3 + 0 * u, *(0 * u,) * 4], axis=1))[:, 1]
    assert np.abs(np.diff(y)).max() < 0.02 * np.abs(y).mean()


def test_cross_flow_memory_makes_the_quadratic_term_fall_with_frequency() -> None:
    """The effect the source's frequency study looks for: the cross-flow resets in a fast oscillation."""
    third = []
    for frequency in (0.64, 2.5, 5.1):
        omega = frequency * 3.344 / BARE.length
        test = CaptiveTest("sway", 3.344, Sway(3.344, 0.2 * 3.344 / omega, omega), periods=2, samples=64)
        run = TANK.run(BARE, test, Silent())
        phase = omega * run.history.time[run.settled]
        third.append(2.0 * np.mean(run.parts["crossflow"][run.settled, 1] * np.cos(phase)))
    assert abs(third[0]) > abs(third[1]) > abs(third[2])


def test_without_memory_an_oscillation_is_a_row_of_steady_states() -> None:
    omega = 2.5 * 3.344 / X_FINS.length
    test = CaptiveTest("yaw", 3.344, Yaw(3.344, 0.3, omega), periods=2, samples=32)
    run = FastTank(members=0, memory=False).run(X_FINS, test, Silent())
    alone = steady(X_FINS, run.history.nu)
    for part in ("tail", "crossflow", "drag", "fins"):
        # the cross-flow is summed in single precision: 1e-7 of the largest strip, of which there are 200
        assert run.parts[part] == pytest.approx(alone[part], abs=2e-5 * np.abs(alone[part]).max() + ROUNDING)
    assert any("quasi-steady" in flag for flag in run.flags)
    remembered = TANK.run(X_FINS, test, Silent())
    # the wash of the bow is small in yaw about the middle, and still a thousand times the round-off
    assert np.abs(run.parts["fins"] - remembered.parts["fins"]).max() > 1e-2 * np.abs(remembered.parts["fins"]).max()


@pytest.mark.parametrize("members", [0, 8])
def test_ensemble_surrounds_the_nominal_and_repeats(members: int) -> None:
    tank = FastTank(members=members)
    test = CaptiveTest("drift", 3.344, Drift(3.344, np.radians(8.0)))
    run, again = tank.run(BARE, test, Silent()), tank.run(BARE, test, Silent())
    if members == 0:
        assert run.ensemble is None
        return
    assert run.ensemble is not None
    assert run.ensemble.shape == (members, 2, 6)
    assert (run.ensemble == again.ensemble).all()
    assert run.ensemble[:, 0, 1].min() < run.loads[0, 1] < run.ensemble[:, 0, 1].max()


def test_parts_add_up_and_a_run_out_of_range_says_so() -> None:
    fine = TANK.run(X_FINS, CaptiveTest("turn", 3.344, Turn(3.344, 0.2)), Silent())
    assert np.sum(list(fine.parts.values()), axis=0) == pytest.approx(fine.loads)
    assert fine.flags == ()
    wild = TANK.run(X_FINS, CaptiveTest("drift", 3.344, Drift(3.344, np.radians(35.0))), Silent())
    assert any("above 20 deg" in flag for flag in wild.flags)
