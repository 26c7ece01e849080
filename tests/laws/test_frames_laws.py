"""Frames: what a change of axes or of reference point cannot change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from towtank.frames import body_x, drift_angle, incidence_angle, move_load, move_velocity, rotation

ANGLES = arrays(float, 3, elements=st.floats(-math.pi, math.pi))
SIX = arrays(float, 6, elements=st.floats(-1e3, 1e3))
SHIFT = arrays(float, 3, elements=st.floats(-10.0, 10.0))


@given(ANGLES)
def test_a_rotation_is_orthogonal_and_right_handed(attitude: np.ndarray):
    R = rotation(attitude)
    # round-off of products of three sines
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-13)


@given(ANGLES)
def test_the_rotation_is_that_of_yaw_then_pitch_then_roll(attitude: np.ndarray):
    phi, theta, psi = attitude
    judge = Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix()
    np.testing.assert_allclose(rotation(attitude), judge, atol=1e-14)


@given(SIX, SIX, SHIFT)
def test_power_does_not_depend_on_the_reference_point(load: np.ndarray, nu: np.ndarray, shift: np.ndarray):
    here = load @ nu
    there = move_load(load, shift) @ move_velocity(nu, shift)
    # both sums have terms up to 1e3 * 1e3 * 10; a part in 1e13 of them is round-off
    assert there == pytest.approx(here, abs=1e-4, rel=1e-10)


@given(SIX, SHIFT)
def test_moving_a_load_there_and_back_returns_it(load: np.ndarray, shift: np.ndarray):
    np.testing.assert_allclose(move_load(move_load(load, shift), -shift), load, atol=1e-9)


def test_a_force_aft_of_the_point_turns_the_bow_the_other_way():
    """A force to starboard at the stern gives a negative yaw moment about a point ahead of it."""
    stern = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    about_cb = move_load(stern, np.array([3.0, 0.0, 0.0]))
    assert about_cb[5] == pytest.approx(-3.0)


def test_signs_of_drift_and_incidence():
    to_port, sinking = np.array([1.0, -0.1, 0, 0, 0, 0]), np.array([1.0, 0, 0.1, 0, 0, 0])
    assert drift_angle(to_port) > 0.0
    assert incidence_angle(sinking) > 0.0


def test_stations_aft_of_the_origin_have_negative_x():
    np.testing.assert_allclose(body_x(np.array([0.0, 2.0, 5.0]), 2.0), [2.0, 0.0, -3.0])
