"""Long low plates against lattices of vortex rings: lift slope, its centre, and apparent mass on a hull."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from towtank import read_craft
from towtank.craft.craft import Fin, Strake
from towtank.craft.hydrostatics import SLENDEREST
from towtank.tank.fast.build import build
from towtank.tank.fast.kernels import ring_velocity
from towtank.tank.fast.potential import added_mass_with_fins, hull_flow
from towtank.tank.fast.strakes import EDGE_SHIFT, MOST_SHIFT


def plate(aspect: float, spanwise: int = 12) -> tuple[float, float]:
    """Lift slope on the area, and the centre of the lift behind the leading edge over the chord, of a flat plate.

    Rings of span 1, fine at the leading edge; points between the spanwise nodes of a cosine grid; katzplotkin2001.
    """
    chord, x, step = 1.0 / aspect, [0.0], 0.03
    while x[-1] < chord:
        x.append(x[-1] + step)
        step = min(1.15 * step, 0.3)
    edge = np.array(x) * chord / x[-1]
    width, turn = np.diff(edge), np.linspace(0.0, np.pi, spanwise + 1)
    bound = np.append(edge[:-1] + 0.25 * width, edge[-1] + 0.25 * width[-1])
    y, between = -0.5 * np.cos(turn), -0.5 * np.cos(0.5 * (turn[1:] + turn[:-1]))

    def ring(x0: float, x1: float, j: int) -> list[list[float]]:
        return [[-x0, y[j], 0.0], [-x0, y[j + 1], 0.0], [-x1, y[j + 1], 0.0], [-x1, y[j], 0.0]]

    cells = [(i, j) for i in range(len(width)) for j in range(spanwise)]
    points = np.array([[-(edge[i] + 0.75 * width[i]), between[j], 0.0] for i, j in cells])
    down = ring_velocity(points, np.array([ring(bound[i], bound[i + 1], j) for i, j in cells]))[..., 2]
    wake = np.array([ring(bound[-1], bound[-1] + 3.0 * chord, j) for j in range(spanwise)])
    down[:, -spanwise:] += ring_velocity(points, wake)[..., 2]
    strength = np.linalg.solve(down, np.ones(len(points))).reshape(len(width), spanwise)
    lift = np.abs(np.diff(strength, axis=0, prepend=0.0) @ np.diff(y))
    return float(2.0 * lift.sum() / chord), float(lift @ bound[:-1] / lift.sum() / chord)


@pytest.mark.parametrize("aspect", [0.1, 0.2, 0.4])
def test_slender_plates_lift_as_jones_says_half_a_height_behind_their_edge(aspect: float) -> None:
    assert aspect <= SLENDEREST
    slope, centre = plate(aspect)
    assert slope == pytest.approx(0.5 * np.pi * aspect, rel=0.011)
    shift = min(EDGE_SHIFT * 0.5, MOST_SHIFT / aspect) * aspect  # the height is half the span of 1
    assert centre == pytest.approx(shift, abs=0.03)


def test_a_short_plate_lifts_less_and_its_centre_stays_within_a_sixth() -> None:
    slope, centre = plate(1.0)
    assert slope == pytest.approx(1.4614, rel=0.005)  # lamargloss1975, table III
    assert centre == pytest.approx(MOST_SHIFT, abs=0.01)


@pytest.mark.parametrize(
    ("length", "height", "band"),
    # Strips lose their ends by a rule of thumb; the lattice of 30 x 6 rings a plate is itself good to some per cent.
    [(2.0, 0.1, 0.04), (2.0, 0.2, 0.03), (1.0, 0.2, 0.08)],
)
def test_apparent_mass_by_strips_is_that_of_the_lattice_on_the_hull(length: float, height: float, band: float) -> None:
    hull = replace(read_craft("hokie"), fins=())
    turned = [np.radians(a) for a in (45.0, 135.0, 225.0, 315.0)]
    radius, start = 0.5 * hull.diameter, 3.0
    flow = hull_flow(hull, 144, 24)
    plates = tuple(Fin(f"{a}", a, radius, length, radius + height, length, start + length) for a in turned)
    lattice = added_mass_with_fins(replace(hull, fins=plates), flow, 30, 6) - flow.added_mass
    strakes = tuple(Strake(f"{a}", a, start, start + length, height, height, 0.01) for a in turned)
    found = build(replace(hull, strakes=strakes), hull.speed).strakes
    assert found is not None
    assert found.added[1, 1] == pytest.approx(lattice[1, 1], rel=band)
    assert found.added[2, 2] == pytest.approx(lattice[2, 2], rel=band)
    assert found.added[3, 3] == pytest.approx(lattice[3, 3], rel=band + 0.05)
