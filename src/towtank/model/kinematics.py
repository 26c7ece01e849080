"""From body velocities to the motion in the world (perron eq. 2.3-2.7, 2.10, 2.11)."""

from __future__ import annotations

from towtank.model.algebra import Matrix, Ops, Scalar, Vector

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
