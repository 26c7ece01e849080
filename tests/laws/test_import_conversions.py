"""What a conversion may not change: the sense of a moment, the work of a load, the units of a header."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from towtank.errors import InputError
from towtank.frames import rotation
from towtank.tank.imported.convert import (
    about_origin,
    axis_matrix,
    euler,
    inertia_load,
    load_scale,
    motion_scale,
    static_load,
    turned,
    turned_attitude,
)
from towtank.tank.imported.table import Table

EVERY = [
    tuple(sign + name for sign, name in zip(signs, names, strict=True))
    for names in itertools.permutations("xyz")
    for signs in itertools.product(("", "-"), repeat=3)
]
number = st.floats(-10.0, 10.0).map(lambda value: round(value, 6))
vector = st.tuples(number, number, number).map(np.array)


def handedness(axes) -> float:
    forward, starboard, down = (np.eye(3)["xyz".index(a[-1])] * (-1.0 if a[0] == "-" else 1.0) for a in axes)
    return float(np.dot(np.cross(forward, starboard), down))


def test_half_of_the_48_choices_of_axes_are_right_handed_and_the_others_are_refused():
    for axes in EVERY:
        if handedness(axes) > 0.0:
            assert np.linalg.det(axis_matrix(axes)) == pytest.approx(1.0)
        else:
            with pytest.raises(InputError, match="left-handed"):
                axis_matrix(axes)


@given(force=vector, arm=vector, axes=st.sampled_from([axes for axes in EVERY if handedness(axes) > 0.0]))
def test_the_moment_of_a_force_is_its_moment_along_every_axes(force, arm, axes):
    load = np.concatenate([force, np.cross(arm, force)])[None, :]
    matrix = axis_matrix(axes)
    moved = turned(load, matrix)[0]
    # Components of at most 10 m and 10 N: round-off of a few products of 100.
    np.testing.assert_allclose(moved[3:], np.cross(matrix @ arm, moved[:3]), atol=1e-12)


@given(force=vector, moment=vector, point=vector, velocity=vector, spin=vector)
def test_moving_the_point_leaves_the_power_of_a_load(force, moment, point, velocity, spin):
    """Power F . V + M . w is that of the body, wherever the point is: V_P = V_O + w x P."""
    about_point = np.concatenate([force, moment])[None, :]
    about = about_origin(about_point, point)[0]
    power = force @ (velocity + np.cross(spin, point)) + moment @ spin
    # Products of three numbers of at most 10, some ten of them.
    assert about[:3] @ velocity + about[3:] @ spin == pytest.approx(power, abs=1e-10)


@given(angles=st.tuples(*[st.floats(-1.2, 1.2)] * 3), axes=st.sampled_from([a for a in EVERY if handedness(a) > 0.0]))
def test_an_attitude_about_other_axes_is_the_same_turn(angles, axes):
    """A vector fixed in the body points the same way in space, seen along either axes."""
    attitude, matrix = np.array([angles]), axis_matrix(axes)
    fixed = np.array([0.3, -0.5, 0.8])
    in_file = rotation(attitude)[0] @ fixed
    found = rotation(turned_attitude(attitude, matrix))[0] @ (matrix @ fixed)
    # Near a pitch of 90 deg in the other axes an arcsine loses half of the digits.
    np.testing.assert_allclose(found, matrix @ in_file, atol=1e-7)


@given(angles=st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)))
def test_euler_angles_come_back_from_their_cosines(angles):
    # An arcsine within 0.07 rad of its end keeps 1e-16 / 0.07.
    np.testing.assert_allclose(euler(rotation(np.array([angles])))[0], angles, atol=1e-12)


@given(angles=st.tuples(*[st.floats(-1.2, 1.2)] * 3))
def test_a_neutral_body_hung_at_its_centre_of_buoyancy_has_no_static_load(angles):
    place = np.array([0.4, 0.0, 0.1])
    np.testing.assert_allclose(static_load(np.array([angles]), 900.0, place, 900.0, place), 0.0, atol=1e-12)


def test_weight_pulls_down_and_a_low_centre_of_gravity_rights():
    heeled = static_load(np.array([[0.2, 0.0, 0.0]]), 900.0, np.array([0.0, 0.0, 0.1]), 900.0, np.zeros(3))[0]
    assert heeled[3] == pytest.approx(-900.0 * 0.1 * math.sin(0.2))
    level = static_load(np.zeros((1, 3)), 900.0, np.zeros(3), 800.0, np.zeros(3))[0]
    np.testing.assert_allclose(level, [0.0, 0.0, 100.0, 0.0, 0.0, 0.0])


def test_a_mass_on_a_circle_needs_the_centripetal_force():
    """u and r held: the load that moves the body is m u r to starboard."""
    nu = np.array([[2.0, 0.0, 0.0, 0.0, 0.0, 0.5]])
    load = inertia_load(nu, np.zeros((1, 6)), 10.0, np.zeros(3), np.eye(3))[0]
    np.testing.assert_allclose(load, [0.0, 10.0 * 2.0 * 0.5, 0.0, 0.0, 0.0, 0.0])


@given(st.floats(0.2, 30.0), st.floats(0.2, 30.0), st.floats(0.5, 2.0))
def test_scale_keeps_coefficients_and_reduced_frequencies(length, speed, density):
    loads, (time, velocity, acceleration) = load_scale(length, speed, density), motion_scale(length, speed)
    assert loads[0] == pytest.approx(density * speed**2 * length**2)
    assert loads[3] / loads[0] == pytest.approx(length)
    # r L / U and udot L / U^2 of model and craft agree; so does f L / U.
    assert velocity[5] * length / speed == pytest.approx(1.0)
    assert acceleration[0] * length / speed**2 == pytest.approx(1.0)
    assert acceleration[5] * length**2 / speed**2 == pytest.approx(1.0)
    assert (1.0 / time) * length / speed == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("header", "unit", "factor"),
    [
        ("Mz (Nm)", "N*m", 1.0), ("Mz [kNm]", "N*m", 1e3), ("Mz (N-m)", "N*m", 1.0), ("Mz (N·m)", "N*m", 1.0),
        ("Mz (lbf-ft)", "N*m", 1.3558179483314006), ("Fx (lbf)", "N", 4.4482216152605), ("a (m/s2)", "m/s^2", 1.0),
        ("a (m/s^2)", "m/s^2", 1.0), ("v (knot)", "m/s", 1852.0 / 3600.0), ("psi (°)", "rad", math.pi / 180.0),
        ("r (deg/s)", "rad/s", math.pi / 180.0), ("rdot (deg/s2)", "rad/s^2", math.pi / 180.0), ("t (ms)", "s", 1e-3),
        ("r (radian/s)", "rad/s", 1.0), ("t (min)", "s", 60.0),
    ],
)  # fmt: skip
def test_units_of_headers_are_understood_as_they_are_written(header, unit, factor):
    from towtank.tank.imported.table import unit_of

    one = Table((header,), (unit_of(header),), np.ones((1, 1)), np.array([2]), np.array(["f.csv"]))
    assert one.column(header.split()[0], unit)[0] == pytest.approx(factor, rel=1e-12)
