"""The water that is accelerated with the body: M_A and the two forms of C_A (perron eq. 2.13 and 2.15)."""

from __future__ import annotations

from collections.abc import Mapping

from towtank.model.algebra import Matrix, Vector, frozen, product
from towtank.symbols import LOADS, RATES


def added_mass_matrix(values: Mapping[str, float]) -> list[list[float]]:
    """M_A (6, 6) of natural derivatives, rows X..N, columns udot..rdot; absent entries are structural zeros.

    Source     perron, eq. 2.13.
    Departure  All 36 entries are allowed. The zeros printed there are not symmetric, and potential flow makes M_A
               symmetric; which entries a craft has follows from its symmetry and is settled in ``derive``.
    """
    return frozen([[values.get(f"{load}{rate}dot", 0.0) for rate in RATES] for load in LOADS])


def coriolis_full(added: Matrix, nu: Vector) -> Matrix:
    """C_A(nu) (6, 6) of M_A by Kirchhoff's equations; the load on the body is +C_A nu (variant "split").

    Source     fossen2021, ch. 6; lamb1932, ch. VI: with the impulse (a, b) = M_A nu the load is
               (omega x a, v x a + omega x b).
    Departure  perron's eq. 2.15 leaves out the products u v, u w, u q, u r and v r, w q, r r, q q.
    """
    a1, a2, a3, b1, b2, b3 = product(added, nu)
    return [
        [0, 0, 0, 0, a3, -a2],
        [0, 0, 0, -a3, 0, a1],
        [0, 0, 0, a2, -a1, 0],
        [0, a3, -a2, 0, b3, -b2],
        [-a3, 0, a1, -b3, 0, b1],
        [a2, -a1, 0, b2, -b1, 0],
    ]


def coriolis_reduced(added: Matrix, nu: Vector) -> Matrix:
    """The printed bracket of C_A(nu) (6, 6); the load on the body is +C_A nu (variant "lumped").

    Source     perron, eq. 2.15.
    Departure  The minus sign in front of the printed bracket is dropped: eq. 2.8 has (C_RB - C_A) on the left-hand
               side and the bracket itself is C(M_A). docs/decisions/0002.
    Valid      With damping terms that hold the total load: Yur, Zuq, Muw, Muq, Nuv, Nur, Xvr, Xwq, Xrr, Xqq.
    """
    (_, _, Xw, _, Xq, _), (_, Yv, _, Yp, _, Yr), (Zu, _, Zw, _, Zq, _) = added[0], added[1], added[2]
    (_, Kv, _, Kp, _, Kr), (Mu, _, Mw, _, Mq, _), (_, Nv, _, Np, _, Nr) = added[3], added[4], added[5]
    u, v, w, p, q, r = nu
    a1 = Xw * w + Xq * q
    a2 = Yv * v + Yr * r + Yp * p
    a3 = Zw * w + Zq * q + Zu * u
    b1 = Kv * v + Kp * p + Kr * r
    b2 = Mq * q + Mw * w + Mu * u
    b3 = Nv * v + Np * p + Nr * r
    return [
        [0, 0, 0, 0, Zu * u, -Yp * p],
        [0, 0, 0, -a3, 0, a1],
        [0, 0, 0, a2, -a1, 0],
        [0, a3, -a2, 0, b3, -b2],
        [-Zu * u, 0, a1, -b3, 0, b1],
        [Yp * p, -a1, 0, b2, -b1, 0],
    ]
