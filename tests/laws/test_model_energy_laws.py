"""Coriolis loads do no work; energy and impulse are conserved, or fall when they should."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from model_cases import AT_ORIGIN, FEW, array, model, numbers, symmetric_added_mass, velocities
from scipy.integrate import solve_ivp

from towtank.frames import rotation
from towtank.model.added_mass import added_mass_matrix, coriolis_full, coriolis_reduced
from towtank.model.options import ModelOptions
from towtank.model.rigid_body import Body, coriolis_matrix, mass_matrix

ROUND_OFF = 1e-12  # relative to the largest product in the sum

bodies = st.builds(
    Body,
    *[st.floats(1.0, 1e3)] * 2,
    *[st.floats(-2.0, 2.0)] * 6,
    *[st.floats(1.0, 1e3)] * 3,
    *[st.floats(-50.0, 50.0)] * 3,
)


def _skew_and_idle(matrix, nu):
    C, nu = array(matrix), np.array(nu)
    scale = abs(C).max() * max(abs(nu).max(), 1e-9) ** 2 + 1e-30
    assert abs(C + C.T).max() <= ROUND_OFF * max(abs(C).max(), 1e-30)
    assert abs(nu @ C @ nu) <= 40 * ROUND_OFF * scale


@FEW
@given(bodies, velocities)
def test_the_rigid_body_coriolis_load_does_no_work(body, nu):
    _skew_and_idle(coriolis_matrix(body, nu), nu)


@FEW
@given(symmetric_added_mass(), velocities)
def test_the_added_mass_coriolis_load_does_no_work_in_full_and_reduced_form(values, nu):
    added = added_mass_matrix(values)
    _skew_and_idle(coriolis_full(added, nu), nu)
    _skew_and_idle(coriolis_reduced(added, nu), nu)


@FEW
@given(symmetric_added_mass(), velocities)
def test_the_full_coriolis_load_is_kirchhoffs(values, nu):
    M, nu = array(added_mass_matrix(values)), np.array(nu)
    impulse = M @ nu
    v, omega, a, b = nu[:3], nu[3:], impulse[:3], impulse[3:]
    expected = np.concatenate([np.cross(omega, a), np.cross(v, a) + np.cross(omega, b)])
    computed = array(coriolis_full(added_mass_matrix(values), nu.tolist())) @ nu
    assert np.allclose(computed, expected, rtol=0, atol=ROUND_OFF * (1 + abs(M).max() * 24))


@FEW
@given(bodies, velocities)
def test_the_rigid_body_coriolis_load_is_newtons(body, nu):
    M, nu = array(mass_matrix(body)), np.array(nu)
    momentum = M @ nu
    v, omega, a, b = nu[:3], nu[3:], momentum[:3], momentum[3:]
    expected = np.concatenate([np.cross(omega, a), np.cross(v, a) + np.cross(omega, b)])
    load = array(coriolis_matrix(body, nu.tolist())) @ nu
    assert np.allclose(load, expected, rtol=0, atol=ROUND_OFF * (1 + abs(M).max() * 50))


@FEW
@given(bodies, velocities)
def test_the_zeros_printed_in_eq_2_14_give_the_same_load_but_no_skew_matrix(body, nu):
    C = array(coriolis_matrix(body, nu))
    u, v, w = nu[:3]
    printed = C.copy()
    for row, column, dropped in ((3, 1, w), (3, 2, -v), (4, 0, -w), (4, 2, u), (5, 0, v), (5, 1, -u)):
        printed[row, column] -= body.m * dropped
    atol = ROUND_OFF * (1 + abs(C).max() * 12)
    assert np.allclose(printed @ np.array(nu), C @ np.array(nu), rtol=0, atol=atol)
    assert np.allclose(abs(printed + printed.T).max(), body.m * max(map(abs, (u, v, w))), rtol=1e-9, atol=atol)


@FEW
@given(velocities)
def test_the_bracket_of_eq_2_15_lacks_the_products_with_u_and_row_one(nu):
    values = {"Xudot": -3.0, "Yvdot": -90.0, "Zwdot": -80.0, "Kpdot": -2.0, "Mqdot": -70.0, "Nrdot": -60.0,
              "Yrdot": 5.0, "Nvdot": 5.0, "Zqdot": -4.0, "Mwdot": -4.0}  # fmt: skip
    added = added_mass_matrix(values)
    u, v, w, _, q, r = nu
    left_out = np.array([
        90.0 * v * r - 5.0 * r * r - 80.0 * w * q - 4.0 * q * q, -3.0 * u * r, 3.0 * u * q,
        0.0, 77.0 * u * w + 4.0 * u * q, -87.0 * u * v + 5.0 * u * r,
    ])  # fmt: skip
    difference = (array(coriolis_full(added, nu)) - array(coriolis_reduced(added, nu))) @ np.array(nu)
    assert np.allclose(difference, left_out, rtol=0, atol=1e-10)


CG = (0.1, 0.02, 0.05)
INERTIA = ((25.0, 2.0, -3.0), (2.0, 1200.0, 4.0), (-3.0, 4.0, 1210.0))


def _flight(craft_model, start, duration=6.0):
    fixed = np.array([0.0] * 4)
    solution = solve_ivp(
        lambda _, s: craft_model.rates(s, fixed, 0.0), (0.0, duration), [*start, *fixed], "DOP853",
        rtol=1e-11, atol=1e-12, max_step=0.5,
    )  # fmt: skip
    return solution.y[:12].T


def _kinetic(M, states):
    return 0.5 * np.einsum("ni,ij,nj->n", states[:, 6:], M, states[:, 6:])


starts = st.tuples(numbers(3, 0.5), numbers(3, 1.0), numbers(3, 0.3))


@settings(max_examples=5, deadline=None)
@given(symmetric_added_mass(), starts)
def test_energy_and_world_impulse_are_conserved_without_damping(values, start):
    attitude, v, omega = start
    free = model(values, ModelOptions(centre_of_buoyancy=CG), variant="split", cg=CG, inertia=INERTIA)
    states = _flight(free, [1.0, 2.0, 3.0, *attitude, 1.0 + v[0], *v[1:], *omega])
    energy = _kinetic(free.mass_matrix, states)
    momentum = states[:, 6:] @ free.mass_matrix.T
    R = rotation(states[:, 3:6])
    linear = np.einsum("nij,nj->ni", R, momentum[:, :3])
    angular = np.einsum("nij,nj->ni", R, momentum[:, 3:]) + np.cross(states[:, :3], linear)
    # 100 times the integrator's tolerance, on quantities of order 1e3 to 1e5
    assert np.ptp(energy) <= 1e-9 * energy[0]
    assert np.ptp(linear, axis=0).max() <= 1e-9 * (1 + abs(linear).max())
    assert np.ptp(angular, axis=0).max() <= 1e-9 * (1 + abs(angular).max() + abs(linear).max() * 10)


DISSIPATIVE = ("Xuu", "Yuv", "Yvv", "Zuw", "Zww", "Kup", "Kpp", "Muq", "Mqq", "Nur", "Nrr")


@settings(max_examples=5, deadline=None)
@given(symmetric_added_mass(), starts)
def test_energy_falls_with_damping(values, start):
    attitude, v, omega = start
    damped = model(
        {**values, **dict.fromkeys(DISSIPATIVE, -40.0)}, ModelOptions(centre_of_buoyancy=CG), variant="split",
        cg=CG, inertia=INERTIA,
    )  # fmt: skip
    energy = _kinetic(damped.mass_matrix, _flight(damped, [0.0] * 3 + [*attitude, 1.0 + v[0], *v[1:], *omega]))
    assert np.all(np.diff(energy) < 0.0)


@settings(max_examples=5, deadline=None)
@given(symmetric_added_mass(), starts, st.floats(0.98, 1.02))
def test_total_energy_is_conserved_under_weight_and_buoyancy(values, start, balance):
    attitude, v, omega = start
    cg, cb = (0.05, 0.01, 0.08), (0.02, 0.0, -0.03)
    heavy = model(values, ModelOptions(centre_of_buoyancy=cb), variant="split", cg=cg, inertia=INERTIA, balance=balance)
    states = _flight(heavy, [0.0] * 3 + [*attitude, 1.0 + v[0], *v[1:], *omega], 3.0)
    down = rotation(states[:, 3:6])[:, 2, :]
    body = heavy.body
    depth_g, depth_b = states[:, 2] + down @ np.array(cg), states[:, 2] + down @ np.array(cb)
    potential = -body.g * (body.m * depth_g - body.b * depth_b)
    total = _kinetic(heavy.mass_matrix, states) + potential
    assert np.ptp(potential) > 0.0
    assert np.ptp(total) <= 1e-9 * (abs(total).max() + _kinetic(heavy.mass_matrix, states).max() + np.ptp(potential))


def test_damping_of_the_reference_set_stops_the_craft():
    slowing = model(options=AT_ORIGIN)
    states = _flight(slowing, [0.0] * 6 + [1.5, 0.0, 0.0, 0.0, 0.0, 0.0], 60.0)
    assert 0.0 < states[-1, 6] < 0.75
