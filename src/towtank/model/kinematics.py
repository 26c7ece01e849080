"""From body velocities to the motion in the world (perron eq. 2.3-2.7, 2.10, 2.11).

The attitude is held as Euler angles, which people read, or as a unit quaternion, which has no attitude where it fails.
"""

from __future__ import annotations

import math

from towtank.model.algebra import MATH, Matrix, Ops, Scalar, Vector

NORM_RATE = 1.0
"""gamma [1/s]: how fast a quaternion goes back to unit length. The fixed-step method loses some 1e-9 of the length per
second at 1 rad/s and steps of 0.1 s, so 1 s is fast enough; steps up to 2.7 s stay stable, far above those in use. At
unit length the term is zero, whatever gamma is."""

_FLOOR = 1e-30
"""Added to cos2(theta) so that its root has a derivative at 90 deg of pitch; 1e-15 rad."""

Trig = tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]
"""sin and cos of phi, theta, psi, in this order: s_phi, c_phi, s_theta, c_theta, s_psi, c_psi."""


def trig_of(attitude: Vector, ops: Ops) -> Trig:
    """Sines and cosines of the attitude phi, theta, psi [rad], each once."""
    phi, theta, psi = attitude
    return ops.sin(phi), ops.cos(phi), ops.sin(theta), ops.cos(theta), ops.sin(psi), ops.cos(psi)


def rotation_matrix(trig: Trig) -> Matrix:
    """J1 (3, 3): body to NED.

    Source     perron, eq. 2.3-2.7 and 2.11.
    """
    sf, cf, st, ct, sp, cp = trig
    return [
        [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
        [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
        [-st, ct * sf, ct * cf],
    ]


def euler_matrix(trig: Trig) -> Matrix:
    """J2 (3, 3): body rates to rates of the Euler angles.

    Source     perron, eq. 2.10 (row 3, unreadable there, from fossen2021, ch. 2).
    Valid      |theta| below 90 deg, where cos(theta) divides.
    """
    sf, cf, st, ct, _, _ = trig
    tt = st / ct
    return [[1.0, sf * tt, cf * tt], [0, cf, -sf], [0, sf / ct, cf / ct]]


def quaternion_matrix(e: Vector) -> Matrix:
    """J1 (3, 3): body to NED, of the unit quaternion ``e`` (4,), scalar part first. Valid at every attitude.

    Source     fossen2021, ch. 2. The same matrix as ``rotation_matrix``, in other parameters.
    """
    e0, e1, e2, e3 = e
    return [
        [1.0 - 2.0 * (e2 * e2 + e3 * e3), 2.0 * (e1 * e2 - e3 * e0), 2.0 * (e1 * e3 + e2 * e0)],
        [2.0 * (e1 * e2 + e3 * e0), 1.0 - 2.0 * (e1 * e1 + e3 * e3), 2.0 * (e2 * e3 - e1 * e0)],
        [2.0 * (e1 * e3 - e2 * e0), 2.0 * (e2 * e3 + e1 * e0), 1.0 - 2.0 * (e1 * e1 + e2 * e2)],
    ]


def quaternion_rates(e: Vector, omega: Vector) -> list[Scalar]:
    """Rates (4,) [1/s] of the unit quaternion ``e`` (4,) under the body rates ``omega`` (3,) = p, q, r [rad/s].

    edot = T(e) omega + 0.5 gamma (1 - e.e) e. The second term takes the length back to 1 and turns nothing.

    Source     fossen2021, ch. 2; gamma is ``NORM_RATE``.
    """
    e0, e1, e2, e3 = e
    p, q, r = omega
    back = 0.5 * NORM_RATE * (1.0 - (e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3))
    return [
        -0.5 * (e1 * p + e2 * q + e3 * r) + back * e0,
        0.5 * (e0 * p - e3 * q + e2 * r) + back * e1,
        0.5 * (e3 * p + e0 * q - e1 * r) + back * e2,
        0.5 * (e1 * q - e2 * p + e0 * r) + back * e3,
    ]


def quaternion_of(attitude: Vector, ops: Ops = MATH) -> list[Scalar]:
    """Unit quaternion (4,) of phi, theta, psi [rad]; floats, or arrays with ``NUMPY``.

    Source     fossen2021, ch. 2: the product of the three turns psi, theta, phi.
    """
    s_phi, c_phi, s_theta, c_theta, s_psi, c_psi = trig_of([0.5 * angle for angle in attitude], ops)
    return [
        c_phi * c_theta * c_psi + s_phi * s_theta * s_psi,
        s_phi * c_theta * c_psi - c_phi * s_theta * s_psi,
        c_phi * s_theta * c_psi + s_phi * c_theta * s_psi,
        c_phi * c_theta * s_psi - s_phi * s_theta * c_psi,
    ]


def attitude_of(e: Vector, ops: Ops = MATH) -> list[Scalar]:
    """phi, theta, psi (3,) [rad] of the unit quaternion ``e`` (4,); phi and psi within pi, theta within pi / 2.

    Source     fossen2021, ch. 2, for theta.
    Departure  phi and psi come from (psi + phi) / 2 and (psi - phi) / 2, the two angles that the quaternion holds. From
               the elements of J1 they would both be lost at 90 deg of pitch.
    Valid      Everywhere. At theta = +-90 deg only psi -+ phi has a meaning: it is kept, shared equally by the two.
    """
    e0, e1, e2, e3 = e
    J31, J32, J33 = quaternion_matrix(e)[2]
    theta = ops.atan2(-J31, ops.sqrt(J32 * J32 + J33 * J33 + _FLOOR))
    half_sum, half_difference = ops.atan2(e3 + e1, e0 - e2), ops.atan2(e3 - e1, e0 + e2)
    return [_wrapped(half_sum - half_difference, ops), theta, _wrapped(half_sum + half_difference, ops)]


def _wrapped(angle: Scalar, ops: Ops) -> Scalar:
    """``angle`` [rad] less the whole turns in it."""
    return angle - 2.0 * math.pi * ops.floor(angle / (2.0 * math.pi) + 0.5)
