"""A circle with radial plates in plane flow, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from towtank.tank.fast.fins import interference
from towtank.tank.fast.plates import NODES, finned_circle, wash

RATIOS = (0.05, 0.3, 0.5, 0.9)


def ring(count: int, first: float = 0.0) -> np.ndarray:
    return first + 2.0 * np.pi * np.arange(count) / count


@pytest.mark.parametrize("t", RATIOS)
def test_a_pair_of_plates_gains_the_mass_of_newman(t: float) -> None:
    """newman1977, table 4.3: a circle with a pair of fins, pi (s^2 - a^2 + a^4 / s^2), less its own pi a^2."""
    added = finned_circle(t, np.array([0.0, np.pi]), np.ones(2)).added
    assert added[1, 1] == pytest.approx(np.pi * (1.0 - 2.0 * t**2 + t**4), rel=1e-9)
    assert abs(added[0, 0]) < 1e-12  # nothing is met in the plane of the plates


@pytest.mark.parametrize("t", RATIOS)
@pytest.mark.parametrize("count", [3, 4, 5, 8])
def test_n_even_plates_gain_the_mass_of_bryson_in_every_direction(t: float, count: int) -> None:
    """bryson1953: n fins, 2 pi s^2 ([(1 + t^n) / 2]^(4/n) - t^2 / 2), of which the circle had pi a^2."""
    added = finned_circle(t, ring(count, 0.3), np.ones(count)).added
    closed = np.pi * (2.0 * (0.5 * (1.0 + t**count)) ** (4.0 / count) - 2.0 * t**2)
    assert added[:2, :2] == pytest.approx(closed * np.eye(2), rel=1e-7, abs=1e-7 * closed)


def test_plates_without_a_body_have_the_roll_inertia_of_the_tables() -> None:
    """newman1977, table 4.3: a plate pi/8 s^4, a cross 2/pi s^4. The circle left in the middle is a hundredth of s."""
    pair, cross = (finned_circle(0.01, ring(n), np.ones(n)).added[2, 2] for n in (2, 4))
    assert pair == pytest.approx(np.pi / 8.0, rel=2e-3)
    assert cross == pytest.approx(2.0 / np.pi, rel=2e-3)


@pytest.mark.parametrize("t", RATIOS)
def test_the_momentum_is_that_of_wing_and_body_of_pitts(t: float) -> None:
    """A plate pair alone sheds pi (s - a)^2; on the body K_W + K_B times that."""
    added = finned_circle(t, np.array([0.0, np.pi]), np.ones(2)).added[1, 1]
    assert added / (np.pi * (1.0 - t) ** 2) == pytest.approx(sum(interference(t)[:2]), rel=1e-9)


def test_one_plate_is_lopsided_and_its_matrix_is_symmetric_and_positive() -> None:
    added = finned_circle(0.5, np.array([-0.5 * np.pi]), np.array([0.9])).added
    assert added[0, 2] > 0.0  # a plate on deck pushed to starboard rolls the craft to starboard
    assert np.linalg.eigvalsh(added)[0] > -1e-12
    assert abs(added[1, 1]) < 1e-12


def test_right_behind_a_plate_the_wake_makes_the_flow_follow_the_plate() -> None:
    """The condition that was solved, seen from the wake: -(1 + a^2 / y^2) of the body's velocity at the plate."""
    section = finned_circle(0.4, ring(4), np.ones(4))
    y = 0.4 * np.exp(np.log(1.0 / 0.4) * np.cos(np.pi * (np.arange(NODES) + 1) / (2 * NODES)))
    flow = wash(section, 0.4, y, 0.5 * np.pi, core=0.0)
    assert flow[:-1, 0] == pytest.approx(-(1.0 + 0.16 / y[:-1] ** 2), rel=1e-9)
    assert flow[:-1, 2] == pytest.approx(y[:-1], rel=1e-9)
    beyond = wash(section, 0.4, np.array([1.1, 1.5]), 0.5 * np.pi, core=0.0)[:, 0]
    assert beyond[0] > beyond[1] > 0.0  # upwash outside the wake


def test_far_from_the_wake_the_flow_is_that_of_a_doublet() -> None:
    section = finned_circle(0.4, ring(2), np.ones(2))
    far = wash(section, 0.4, np.array([200.0]), 0.0, core=0.0)[0, 1]
    assert far == pytest.approx(-section.added[1, 1] / (2.0 * np.pi * 200.0**2), rel=1e-3)  # it flows back there
