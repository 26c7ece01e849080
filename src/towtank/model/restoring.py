"""Weight and buoyancy (perron eq. 2.17)."""

from __future__ import annotations

from towtank.model.algebra import Scalar
from towtank.model.kinematics import Trig
from towtank.model.rigid_body import Body


def restoring_vector(body: Body, trig: Trig) -> list[Scalar]:
    """G (6,) [N, N m] for the left-hand side; the load on the body is -G.

    Source     perron, eq. 2.17; fossen2021, ch. 4.
    Departure  g is +9.80665 m/s2, not -9.8066: with G on the left a negative g floats a heavy craft up. The last row
               has the leading minus sign that the printed text has lost.
    """
    s_phi, c_phi, s_theta, c_theta, _, _ = trig
    W = body.g * (body.m - body.b)
    gx = body.g * (body.xG * body.m - body.xB * body.b)
    gy = body.g * (body.yG * body.m - body.yB * body.b)
    gz = body.g * (body.zG * body.m - body.zB * body.b)
    return [
        W * s_theta,
        -W * c_theta * s_phi,
        -W * c_theta * c_phi,
        -gy * c_theta * c_phi + gz * c_theta * s_phi,
        gz * s_theta + gx * c_theta * c_phi,
        -gx * c_theta * s_phi - gy * s_theta,
    ]
