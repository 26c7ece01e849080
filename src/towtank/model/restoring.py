"""Weight and buoyancy (perron eq. 2.17)."""

from __future__ import annotations

from towtank.model.algebra import Scalar, Vector
from towtank.model.rigid_body import Body


def restoring_vector(body: Body, down: Vector) -> list[Scalar]:
    """G (6,) [N, N m] for the left-hand side; the load on the body is -G.

    down (3,) is the unit vector of gravity in body axes, the last row of J1. In the Euler angles of eq. 2.17

        d1 = -sin theta,   d2 = cos theta sin phi,   d3 = cos theta cos phi

    so that row 1 reads W sin theta, row 4 reads -gy cos theta cos phi + gz cos theta sin phi, and so on.

    Source     perron, eq. 2.17; fossen2021, ch. 4.
    Departure  g is +9.80665 m/s2, not -9.8066: with G on the left a negative g floats a heavy craft up. The last row
               has the leading minus sign that the printed text has lost.
    """
    d1, d2, d3 = down
    W = body.g * (body.m - body.b)
    gx = body.g * (body.xG * body.m - body.xB * body.b)
    gy = body.g * (body.yG * body.m - body.yB * body.b)
    gz = body.g * (body.zG * body.m - body.zB * body.b)
    return [
        -W * d1,
        -W * d2,
        -W * d3,
        -gy * d3 + gz * d2,
        -gz * d1 + gx * d3,
        -gx * d2 + gy * d1,
    ]
