"""The published equations of the NPS AUV II, written anew from their printed form: an oracle, nothing of the package.

The terms come in groups that can be left out one by one, which says what a model without them gets wrong. Units SI,
body axes, angles in rad.

Source     Healey and Lienard 1993 as transcribed in the MSS toolbox; data/npsauv2_published.yaml names both.
"""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import yaml

from published_motion import Motion

SET = yaml.safe_load((Path(__file__).parent / "data" / "npsauv2_published.yaml").read_text(encoding="utf-8"))
BODY, SCREW, C = SET["body"], SET["propeller"], SimpleNamespace(**SET["primes"])
L, RHO, MASS = BODY["L"], BODY["rho"], BODY["W"] / BODY["g"]
R2, R3, R4, R5 = (0.5 * RHO * L**power for power in (2, 3, 4, 5))
IX, IY, IZ, IXY, IYZ, IXZ = (BODY[name] for name in ("Ix", "Iy", "Iz", "Ixy", "Iyz", "Ixz"))
ZG = BODY["zG"]
STRIPS = [L * (i / BODY["sections"] - 0.5) for i in range(BODY["sections"] + 1)]
FLOATS = SimpleNamespace(sqrt=math.sqrt, fabs=abs)


def rigid(nu, coded=False):
    """Centripetal load; ``coded`` takes the two signs of npsauv.m that differ from the equations of a rigid body."""
    u, v, w, p, q, r = nu
    heave = MASS * (u * q - v * p + ZG * (p * p + q * q))
    return [
        MASS * (v * r - w * q - ZG * p * r),
        MASS * (w * p - u * r - ZG * q * r),
        -heave if coded else heave,
        (IY - IZ) * q * r - IXY * p * r - (r * r - q * q) * IYZ + IXZ * p * q + MASS * ZG * (u * r - w * p),
        (IX - IZ if coded else IZ - IX) * p * r + IXY * q * r - IYZ * p * q - (p * p - r * r) * IXZ
        + MASS * ZG * (v * r - w * q),
        (IX - IY) * p * q + (p * p - q * q) * IXY + IYZ * p * r - IXZ * q * r,
    ]  # fmt: skip


def planar(nu, dr, ds, n):
    """What the model family has: resistance, linear terms, axial products, rudder, stern plane, thrust."""
    u, v, w, p, q, r = nu
    push = SCREW["advance"] * n
    return [
        R2 * (C.Xvv * v * v + C.Xww * w * w + (C.Xdrdr * dr * dr + C.Xdsds * ds * ds) * u * u)
        + R3 * (C.Xvr * v * r + C.Xwq * w * q) + R4 * (C.Xqq * q * q + C.Xrr * r * r)
        + R2 * SCREW["Cd0"] * (push * push - u * u),
        R2 * (C.Yv * u * v + C.Ydr * u * u * dr) + R3 * C.Yr * u * r,
        R2 * (C.Zw * u * w + C.Zds * u * u * ds) + R3 * C.Zq * u * q,
        R3 * C.Kv * u * v + R4 * (C.Kp * u * p + C.Kr * u * r),
        R3 * (C.Mw * u * w + C.Mds * u * u * ds) + R4 * C.Mq * u * q,
        R3 * (C.Nv * u * v + C.Ndr * u * u * dr) + R4 * C.Nr * u * r,
    ]  # fmt: skip


def bracket(nu, dr, ds, n, ops=FLOATS):
    """The family's load in the place of ``products``: Kirchhoff's of M_A less the products of u with v, w, q, r."""
    u, v, w, p, q, r = nu
    a1, a2, a3, b1, b2, b3 = (sum(m * x for m, x in zip(row, nu, strict=True)) for row in ADDED.tolist())
    full = [
        q * a3 - r * a2, r * a1 - p * a3, p * a2 - q * a1,
        v * a3 - w * a2 + q * b3 - r * b2, w * a1 - u * a3 + r * b1 - p * b3, u * a2 - v * a1 + p * b2 - q * b1,
    ]  # fmt: skip
    left_out = [
        R3 * (-C.Yvdot * v * r + C.Zwdot * w * q) + R4 * (-C.Yrdot * r * r + C.Zqdot * q * q),
        R3 * C.Xudot * u * r,
        -R3 * C.Xudot * u * q,
        0.0,
        R3 * (C.Xudot - C.Zwdot) * u * w - R4 * C.Zqdot * u * q,
        R3 * (C.Yvdot - C.Xudot) * u * v + R4 * C.Yrdot * u * r,
    ]
    return [a - b for a, b in zip(full, left_out, strict=True)]


def products(nu, dr, ds, n, ops=FLOATS):
    """Products of v, w, p, q, r with one another."""
    _, v, w, p, q, r = nu
    return [
        R3 * C.Xvp * v * p + R4 * (C.Xpr * p * r + C.Xpp * p * p),
        R2 * C.Yvw * v * w
        + R3 * (C.Yvq * v * q + C.Ywp * w * p + C.Ywr * w * r)
        + R4 * (C.Ypq * p * q + C.Yqr * q * r),
        R2 * C.Zvv * v * v
        + R3 * (C.Zvp * v * p + C.Zvr * v * r)
        + R4 * (C.Zpp * p * p + C.Zpr * p * r + C.Zrr * r * r),
        R3 * C.Kvw * v * w
        + R4 * (C.Kvq * v * q + C.Kwp * w * p + C.Kwr * w * r)
        + R5 * (C.Kpq * p * q + C.Kqr * q * r),
        R3 * C.Mvv * v * v
        + R4 * (C.Mvp * v * p + C.Mvr * v * r)
        + R5 * (C.Mpp * p * p + C.Mpr * p * r + C.Mrr * r * r),
        R3 * C.Nvw * v * w
        + R4 * (C.Nvq * v * q + C.Nwp * w * p + C.Nwr * w * r)
        + R5 * (C.Npq * p * q + C.Nqr * q * r),
    ]


def strips(nu, dr, ds, n, ops=FLOATS, coded=False):
    """Cross-flow drag of a box, summed over eleven strips; ``coded`` takes the sign of q in the moment as npsauv.m."""
    _, v, w, _, q, r = nu
    Y = Z = M = N = 0.0
    for x in STRIPS:
        side, down = v + x * r, w - x * q
        drag = BODY["Cdy"] * BODY["height"] * side * side + BODY["Cdz"] * BODY["width"] * down * down
        force = 0.5 * RHO * L / BODY["sections"] * drag / (ops.sqrt(side * side + down * down) + 1e-6)
        Y, N = Y - force * side, N - force * side * x
        Z, M = Z - force * down, M + (-force * (w + x * q) if coded else force * down) * x
    return [0.0, Y, Z, 0.0, M, N]


def roll(nu, dr, ds, n, ops=FLOATS):
    """Sway force and yaw moment of the roll rate."""
    u, _, _, p, _, _ = nu
    return [0.0, R3 * C.Yp * u * p, 0.0, 0.0, 0.0, R4 * C.Np * u * p]


def planes(nu, dr, ds, n, ops=FLOATS):
    """Axial force of rudder and stern plane in drift and turning."""
    u, v, w, _, q, r = nu
    return [
        R3 * u * (C.Xrdr * r * dr + C.Xqds * q * ds) + R2 * u * (C.Xvdr * v * dr + C.Xwds * w * ds),
        *[0.0] * 5,
    ]


def wash(nu, dr, ds, n, ops=FLOATS):
    """What the jet of a propeller off its balance adds, ahead with a shaft that turns ahead."""
    u, _, w, p, q, _ = nu
    eta, k = SCREW["advance"] * n / u, 0.5 * SCREW["wash"] * L * L
    epsilon = (ops.sqrt(k * eta * eta + 1.0) - 1.0) / (math.sqrt(k + 1.0) - 1.0) - 1.0
    return [
        epsilon * (R3 * C.Xqdsn * u * q * ds + R2 * (C.Xwdsn * u * w * ds + C.Xdsdsn * u * u * ds * ds)),
        0.0,
        epsilon * (R3 * C.Zqn * u * q + R2 * (C.Zwn * u * w + C.Zdsn * u * u * ds)),
        epsilon * R4 * C.Kpn * u * p,
        epsilon * (R4 * C.Mqn * u * q + R3 * (C.Mwn * u * w + C.Mdsn * u * u * ds)),
        0.0,
    ]


MISSING = {"strips": strips, "products": products, "roll": roll, "planes": planes, "wash": wash}
"""Groups of terms of the published set that the model family lacks."""
FAMILY = {"bracket": bracket}


def _added():
    """M_A (6, 6) of natural derivatives, SI."""
    out = np.zeros((6, 6))
    for i, load in enumerate("XYZKMN"):
        for j, rate in enumerate("uvwpqr"):
            out[i, j] = R3 * L ** ((i > 2) + (j > 2)) * SET["primes"].get(f"{load}{rate}dot", 0.0)
    return out


ADDED = _added()


def mass_matrix():
    """M_RB - M_A (6, 6)."""
    S = np.array([[0.0, -ZG, 0.0], [ZG, 0.0, 0.0], [0.0, 0.0, 0.0]])
    inertia = np.array([[IX, -IXY, -IXZ], [-IXY, IY, -IYZ], [-IXZ, -IYZ, IZ]])
    return np.block([[MASS * np.eye(3), -MASS * S], [MASS * S, inertia]]) - ADDED


def motion(groups, shaft, coded=False, g=BODY["g"]):
    """The equations with some ``groups`` of terms (name -> load).

    shaft : [rev/min], held.   coded : with the signs of npsauv.m.   g : gravity [m/s2] of the righting moment.
    """
    n, weight, inverse = shaft * math.pi / 30.0, MASS * g * ZG, np.linalg.inv(mass_matrix())

    def acceleration(nu, phi, theta, dr, ds):
        loads = [rigid(nu, coded), planar(nu, dr, ds, n)]
        for name, group in groups.items():
            loads.append(group(nu, dr, ds, n, coded=coded) if name == "strips" else group(nu, dr, ds, n))
        total = np.sum(loads, axis=0)
        total[3] -= weight * math.cos(theta) * math.sin(phi)
        total[4] -= weight * math.sin(theta)
        return inverse @ total

    return Motion(acceleration, BODY["lag"], math.radians(BODY["fin_limit_deg"]))
