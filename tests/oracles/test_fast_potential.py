"""Potential part of the fast tank against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from towtank import read_craft
from towtank.craft.craft import Craft, Mass
from towtank.craft.hull import Ellipsoid
from towtank.tank.fast.kernels import panel_geometry, ring_potential, ring_velocity, source_influence
from towtank.tank.fast.potential import added_mass_with_fins, hull_flow


def lamb(slenderness: float) -> tuple[float, float, float]:
    """k1, k2, k' of a prolate spheroid.

    Source     lamb1932, sections 114 and 115.
    """
    e = np.sqrt(1.0 - slenderness**-2)
    log = np.log((1 + e) / (1 - e))
    alpha = 2 * (1 - e**2) / e**3 * (0.5 * log - e)
    beta = 1 / e**2 - (1 - e**2) / (2 * e**3) * log
    k_rot = e**4 * (beta - alpha) / ((2 - e**2) * (2 * e**2 - (2 - e**2) * (beta - alpha)))
    return alpha / (2 - alpha), beta / (2 - beta), k_rot


def spheroid(slenderness: float) -> Craft:
    mass = Mass(1.0, 1.0, (0.0, 0.0, 0.0), ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))
    return Craft("spheroid", Ellipsoid(slenderness, 1.0), (), mass, 0.5 * slenderness, 1.0)


@pytest.mark.parametrize("slenderness", [6.0, 8.6, 12.0])
def test_prolate_spheroid_added_mass_follows_lamb(slenderness: float) -> None:
    matrix = hull_flow(spheroid(slenderness)).added_mass
    volume = np.pi / 6.0 * slenderness
    inertia = volume * (slenderness**2 + 1.0) / 20.0
    k1, k2, k_rot = lamb(slenderness)
    # 1728 flat panels: 0.5 % measured at 6:1.
    assert matrix[0, 0] / volume == pytest.approx(k1, rel=0.01)
    assert matrix[1, 1] / volume == pytest.approx(k2, rel=0.008)
    assert matrix[5, 5] / inertia == pytest.approx(k_rot, rel=0.008)
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] > -1e-9
    assert np.abs(matrix - matrix.T).max() < 1e-3 * matrix.max()


def test_panelling_converges() -> None:
    k2 = lamb(6.0)[1] * np.pi
    errors = [abs(hull_flow(spheroid(6.0), n, m).added_mass[1, 1] / k2 - 1.0) for n, m in ((24, 8), (48, 16), (72, 24))]
    assert errors[0] > errors[1] > errors[2]


def test_source_columns_send_their_own_flux_through_the_hull() -> None:
    flow = hull_flow(read_craft("suboff-bare"), 30, 16)
    through = np.einsum("i,ijk->j", flow.panels.area[:, 0], flow.normal_velocity)
    assert through == pytest.approx(flow.panels.area[:, 0], rel=1e-12)


def test_solution_gives_the_normal_velocity_it_was_asked_for() -> None:
    """The harmonics solve the same system as the dense matrix."""
    flow = hull_flow(read_craft("suboff-bare"), 12, 8)
    rings, sectors = flow.panels.shape
    asked = np.random.default_rng(0).normal(size=(rings, sectors, 2))
    density = flow.solve(asked)
    given = np.zeros_like(asked)
    for a in range(sectors):
        for b in range(sectors):
            given[:, a] += flow.normal_velocity[:, :, (b - a) % sectors] @ density[:, b]
    assert given == pytest.approx(asked, abs=1e-10)


def test_far_panel_is_a_point_source_and_near_panel_a_plane() -> None:
    quad = np.array([[[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0.0]]])
    _, normal, area = panel_geometry(quad)
    potential, velocity, angle = source_influence(np.array([[30.0, 40.0, 20.0], [0.0, 0.0, 1e-6]]), quad, normal)
    far = np.array([30.0, 40.0, 20.0])
    r = np.linalg.norm(far)
    # The quadrupole of a unit square is of relative order (1 / r)^2 / 24.
    assert potential[0, 0] == pytest.approx(-area[0] / (4 * np.pi * r), rel=1e-4)
    assert velocity[0, 0] == pytest.approx(far / (4 * np.pi * r**3), rel=1e-3)
    assert velocity[1, 0, 2] == pytest.approx(0.5, abs=1e-5)
    assert angle[1, 0] == pytest.approx(2 * np.pi, abs=1e-4)


def test_ring_velocity_is_the_gradient_of_its_potential() -> None:
    ring = np.array([[[0, 0, 0], [1.0, 0, 0], [1.0, 2.0, 0], [0, 2.0, 0]]])
    point, step = np.array([0.3, 0.7, 0.9]), 1e-5
    ends = point + step * np.concatenate([np.eye(3), -np.eye(3)])
    phi = ring_potential(ends, ring)[:, 0]
    assert ring_velocity(point[None], ring)[0, 0] == pytest.approx((phi[:3] - phi[3:]) / (2 * step), rel=1e-6)


def test_fins_add_what_slender_body_theory_says_in_order_of_magnitude() -> None:
    """Sections with a fin pair of tip radius s carry pi (s2 - R2 + R4 / s2); low aspect ratio keeps part of it."""
    bare, finned = read_craft("suboff-bare"), read_craft("suboff-fins")
    gain = added_mass_with_fins(finned, hull_flow(finned)) - hull_flow(bare).added_mass
    fin = finned.fins[0]
    x = np.linspace(fin.trailing_edge - 0.6 * fin.root_chord, fin.trailing_edge, 50)
    r, s = finned.profile.radius(x), fin.tip_radius
    strip = np.trapezoid(np.pi * (s**2 - 2 * r**2 + r**4 / s**2), x)
    assert 0.3 * strip < gain[1, 1] < 1.0 * strip
    assert gain[3, 3] > 0.0
