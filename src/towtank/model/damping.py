"""Damping: lift, cross-flow and resistance of the hull with fins at rest (perron eq. 2.16)."""

from __future__ import annotations

from typing import Any

from towtank.model.algebra import Matrix, Ops, Scalar, Vector

_SPEED2_FLOOR = 1e-12
"""Smallest speed squared [m2/s2] that divides a term; the one ``towtank.terms`` uses."""

_CROSS_FLOOR = 1e-24
"""Added to v2 + w2 [m2/s2] and to q2 + r2 [rad2/s2] so that the root has a derivative at zero."""


def damping_matrix(c: Any, nu: Vector, ops: Ops, axisymmetric: bool = False) -> Matrix:
    """D(nu) (6, 6) of natural derivatives; the load on the body is +D nu.

    Parameters
    ----------
    c : the coefficients by name.   nu : velocity through the water.
    axisymmetric : cross-flow terms grow with the total cross-flow, sqrt(v2 + w2) and sqrt(q2 + r2), as on a body of
        revolution, instead of |v|, |w|, |q|, |r| one by one.

    Source     perron, eq. 2.16, as amended in THEORY section 3.
    Departure  The printed +D nu on the left-hand side of eq. 2.8 would drive the motion with natural derivatives;
               here D nu stands on the right. Row 1 is even in v, w, q, r: Xvv v, Xww w, Xrr r, Xqq q instead of the
               odd Xuuvv, Xuv, Xuuww, Xuw, Xrr|r|, Xur; Xvr and Xwq carry what eq. 2.15 leaves out of row 1. Lift
               terms take |u|; Munk moments Muw, Nuv take u.
    Valid      Ahead (u > 0), drift and incidence within the range of the captive tests.
    """
    u, v, w, p, q, r = nu
    au, ap = ops.fabs(u), ops.fabs(p)
    av, aw, aq, ar, v2, w2 = _cross_flow(v, w, q, r, ops, axisymmetric)
    V2 = ops.fmax(u * u + v * v + w * w, _SPEED2_FLOOR)
    x2, x3 = (c.Xvv + c.Xvvvv * v2 / V2) * v, (c.Xww + c.Xwwww * w2 / V2) * w
    x5, x6 = c.Xwq * w + c.Xqq * q, c.Xvr * v + c.Xrr * r
    return [
        [c.Xuu * au, x2, x3, 0, x5, x6],
        [0, c.Yvv * av + c.Yuv * au, 0, 0, 0, c.Yrr * ar + c.Yur * au],
        [0, 0, c.Zww * aw + c.Zuw * au, 0, c.Zqq * aq + c.Zuq * au, 0],
        [0, c.Kvv * av + c.Kuv * u, 0, c.Kpp * ap + c.Kup * au, 0, c.Krr * ar + c.Kur * u],
        [0, 0, c.Mww * aw + c.Muw * u, 0, c.Mqq * aq + c.Muq * au, 0],
        [0, c.Nvv * av + c.Nuv * u, 0, 0, 0, c.Nrr * ar + c.Nur * au],
    ]


def optional_load(c: Any, nu: Vector, ops: Ops) -> list[Scalar]:
    """Load (6,) on the body [N, N m] of the terms of ``symbols.OPTIONAL``; ``c`` and ``nu`` as in ``damping_matrix``.

    Source     fossen2021 (third-order odd expansion); perron, eq. 2.16, for Xuuvv and Xuuww.
    Departure  Each is divided by the speed or its square; Xuuvv and Xuuww are even in v and w.
    Valid      Ahead; motion in one plane at a time: products of both planes are left out.
    """
    u, v, w, _, q, r = nu
    V2 = ops.fmax(u * u + v * v + w * w, _SPEED2_FLOOR)
    V = ops.sqrt(V2)
    vv, vr, rr, ww, wq, qq = v * v, v * r, r * r, w * w, w * q, q * q
    return [
        (c.Xuuvv * vv + c.Xuuww * ww) * u * u / V2,
        (c.Yvvv * vv * v + c.Yvvr * vv * r + c.Yvrr * vr * r + c.Yrrr * rr * r) / V,
        (c.Zwww * ww * w + c.Zwwq * ww * q + c.Zwqq * wq * q + c.Zqqq * qq * q) / V,
        0.0,
        (c.Mwww * ww * w + c.Mwwq * ww * q + c.Mwqq * wq * q + c.Mqqq * qq * q) / V,
        (c.Nvvv * vv * v + c.Nvvr * vv * r + c.Nvrr * vr * r + c.Nrrr * rr * r) / V,
    ]


def _cross_flow(v: Scalar, w: Scalar, q: Scalar, r: Scalar, ops: Ops, axisymmetric: bool) -> tuple[Scalar, ...]:
    """Magnitudes that multiply v, w, q, r in the cross-flow terms, and v2, w2 of the fourth-order axial force."""
    if not axisymmetric:
        return ops.fabs(v), ops.fabs(w), ops.fabs(q), ops.fabs(r), v * v, w * w
    flow2 = v * v + w * w
    flow, rate = ops.sqrt(flow2 + _CROSS_FLOOR), ops.sqrt(q * q + r * r + _CROSS_FLOOR)
    return flow, flow, rate, rate, flow2, flow2
