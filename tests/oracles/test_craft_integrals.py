"""Volumes, areas and inertias against closed forms."""

import numpy as np
import pytest

from towtank.craft.craft import Fin
from towtank.craft.hull import Ellipsoid, Myring, Offsets, Suboff
from towtank.craft.hydrostatics import hydrostatics
from towtank.craft.integrals import fin_integrals, hull_integrals
from towtank.craft.library import read_craft
from towtank.craft.mass import move_inertia, uniform_inertia
from towtank.craft.section import half_thickness


def test_spheroid_volume_area_and_inertia_are_the_closed_forms():
    length, diameter = 6.0, 1.0
    hull = Ellipsoid(length, diameter)
    h = hull_integrals(hull)
    a, b = length / 2, diameter / 2
    e = np.sqrt(1 - (b / a) ** 2)
    assert h.volume == pytest.approx(4 / 3 * np.pi * a * b * b, rel=1e-12)
    assert h.centroid == pytest.approx(a, rel=1e-12)
    assert h.wetted_area == pytest.approx(2 * np.pi * b * (b + a * np.arcsin(e) / e), rel=1e-6)
    ixx, iyy, izz = uniform_inertia(hull, 5.0)
    assert ixx == pytest.approx(5.0 * 2 * b * b / 5, rel=1e-9)
    assert iyy == izz == pytest.approx(5.0 * (a * a + b * b) / 5, rel=1e-9)


def test_library_spheroid_is_neutral_with_the_inertia_of_lamb():
    craft = read_craft("spheroid-6-1")
    h = hydrostatics(craft)
    assert h.volume == pytest.approx(np.pi, rel=1e-9)
    assert h.net_buoyancy_percent == pytest.approx(0.0, abs=1e-9)
    m, zg = craft.mass.mass, craft.mass.cg[2]
    assert craft.mass.inertia[2][2] == pytest.approx(m * (3.0**2 + 0.5**2) / 5, rel=1e-9)
    assert craft.mass.inertia[0][0] == pytest.approx(m * (2 * 0.5**2 / 5 + zg**2), rel=1e-9)


def test_myring_hull_without_taper_is_a_cylinder_between_an_ellipsoid_and_a_cubic():
    hull = Myring(nose=0.5, middle=2.0, tail=1.0, diameter=0.4, tail_angle=np.radians(25.0))
    nose, middle = 2 / 3 * np.pi * 0.2**2 * 0.5, np.pi * 0.2**2 * 2.0
    t = np.polynomial.Polynomial([0, 1])
    k = np.tan(np.radians(25.0))
    tail = np.pi * ((0.2 - (0.6 - k) * t**2 + (0.4 - k) * t**3) ** 2).integ()(1.0)
    assert hull_integrals(hull).volume == pytest.approx(nose + middle + tail, rel=1e-8)


def test_myring_tail_ends_at_a_point_with_the_stated_half_angle():
    hull = Myring(nose=0.5, middle=2.0, tail=1.0, diameter=0.4, tail_angle=np.radians(25.0))
    assert float(hull.radius(3.5)) == pytest.approx(0.0, abs=1e-12)
    assert float(hull.radius(3.5 - 1e-6)) / 1e-6 == pytest.approx(np.tan(np.radians(25.0)), rel=1e-4)


def test_offsets_taken_from_a_hull_give_that_hull_back():
    hull = Suboff()
    x = 0.5 * hull.length * (1 - np.cos(np.linspace(0, np.pi, 81)))
    x[-1] = hull.length
    table = Offsets(tuple(x.tolist()), tuple(hull.radius(x).tolist()))
    # 81 stations dense at the ends: monotone cubics between them leave 1e-4 of the volume.
    assert hull_integrals(table).volume == pytest.approx(hull_integrals(hull).volume, rel=2e-4)
    assert np.max(np.abs(table.radius(x) - hull.radius(x))) < 1e-9


def test_naca_section_has_its_thickness_at_30_percent_and_closes_aft():
    assert 2 * half_thickness(0.2, 0.3) == pytest.approx(0.2, rel=1e-3)  # the classical form peaks at 0.3 chord
    assert half_thickness(0.2, np.array([0.0, 1.0])) == pytest.approx(np.zeros(2), abs=1e-12)


def test_fin_on_a_thin_straight_body_has_the_volume_of_its_section():
    # The closed four-digit form encloses 0.681 t c^2 (its polynomial integrated).
    # The body is a cylinder of 0.1 m radius.
    body = Offsets((0.0, 0.01, 1.0, 2.0, 2.99, 3.0), (0.0, 0.1, 0.1, 0.1, 0.1, 0.0))
    fin = Fin("a", 0.0, 0.1, 0.3, 0.5, 0.3, 2.0, section="0012")
    f = fin_integrals(fin, body)
    assert f.volume == pytest.approx(0.681 * 0.12 * 0.3**2 * 0.4, rel=5e-3)  # the curved root adds 0.1 percent
    assert f.exposed_area == pytest.approx(0.3 * 0.4, rel=2e-3)
    # Both faces of a 12 percent section measure 2.04 chords; the tip adds the section area.
    assert f.wetted_area == pytest.approx(2.04 * 0.3 * 0.4 + 0.681 * 0.12 * 0.3**2, rel=5e-3)
    assert f.footprint == pytest.approx(0.681 * 0.12 * 0.3**2, rel=5e-3)


def test_parallel_axes_agree_with_point_masses():
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(20, 3)), rng.uniform(0.5, 2.0, 20)

    def tensor(p):
        return sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, p, strict=True))

    cg = masses @ points / masses.sum()
    assert move_inertia(tensor(points - cg), masses.sum(), cg) == pytest.approx(tensor(points), rel=1e-10)
