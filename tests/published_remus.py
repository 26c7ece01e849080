"""The published equations of REMUS 100, written anew from their printed form: an oracle, nothing of the package.

Source     prestero2001, eq. 6.7 and 6.9, tables B.1, B.2, C.9: data/remus100_published.yaml, coefficients_remus100.toml
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import yaml

from published_motion import Motion

DATA = Path(__file__).parent / "data"
PRINTED = yaml.safe_load((DATA / "remus100_published.yaml").read_text(encoding="utf-8"))
TERMS = tomllib.loads((DATA / "coefficients_remus100.toml").read_text(encoding="utf-8"))["terms"]
BODY = PRINTED["body"]
MASS, ZG = BODY["W"] / BODY["g"], BODY["zG"]
FROM_ADDED_MASS = {"Mrp": "Kpdot - Nrdot", "Npq": "Mqdot - Kpdot"}
"""Printed cross terms that do not follow from the printed added masses (4.86 against 4.81)."""


def motion(*, lift=0.0, torque=0.0, lag=1e-3, g=BODY["g"], **changes):
    """The equations, fins with a ``lag`` [s] and without a limit.

    lift : buoyancy less weight [N].   torque : of the propeller [N m].   g : gravity [m/s2] of the righting moment.
    changes : coefficients by name; Mrp and Npq may be changed too.
    """
    c = {**TERMS, **changes}
    Ix, Iy, Iz = BODY["Ixx"], BODY["Iyy"], BODY["Izz"]
    m, mz, weight = MASS, MASS * ZG, MASS * g * ZG
    thrust = -c["Xuu"] * PRINTED["start"]["u"] ** 2
    inertia = np.zeros((6, 6))
    np.fill_diagonal(inertia, [m, m, m, Ix, Iy, Iz])
    inertia[0, 4] = inertia[4, 0] = mz
    inertia[1, 3] = inertia[3, 1] = -mz
    for i, load in enumerate("XYZKMN"):
        for j, rate in enumerate("uvwpqr"):
            inertia[i, j] -= c.get(f"{load}{rate}dot", 0.0)
    inverse = np.linalg.inv(inertia)

    def acceleration(nu, phi, theta, dr, ds):
        u, v, w, p, q, r = nu
        X = (
            lift * math.sin(theta) + c["Xuu"] * u * abs(u) + (c["Xwq"] - m) * w * q + c["Xqq"] * q * q
            + (c["Xvr"] + m) * v * r + c["Xrr"] * r * r - mz * p * r + thrust
        )  # fmt: skip
        Y = (
            -lift * math.cos(theta) * math.sin(phi) + c["Yvv"] * v * abs(v) + c["Yrr"] * r * abs(r) + c["Yuv"] * u * v
            + (c["Ywp"] + m) * w * p + (c["Yur"] - m) * u * r - mz * q * r + c["Ypq"] * p * q + c["Yuudr"] * u * u * dr
        )  # fmt: skip
        Z = (
            -lift * math.cos(theta) * math.cos(phi) + c["Zww"] * w * abs(w) + c["Zqq"] * q * abs(q) + c["Zuw"] * u * w
            + (c["Zuq"] + m) * u * q + (c["Zvp"] - m) * v * p + mz * (p * p + q * q) + c["Zrp"] * r * p
            + c["Zuuds"] * u * u * ds
        )  # fmt: skip
        K = (
            -weight * math.cos(theta) * math.sin(phi) + c["Kpp"] * p * abs(p) - (Iz - Iy) * q * r
            + mz * (u * r - w * p) + torque
        )  # fmt: skip
        M = (
            -weight * math.sin(theta) + c["Mww"] * w * abs(w) + c["Mqq"] * q * abs(q) + (c["Mrp"] - (Ix - Iz)) * r * p
            + mz * (v * r - w * q) + c["Muq"] * u * q + c["Muw"] * u * w + c["Mvp"] * v * p + c["Muuds"] * u * u * ds
        )  # fmt: skip
        N = (
            c["Nvv"] * v * abs(v) + c["Nrr"] * r * abs(r) + c["Nuv"] * u * v + (c["Npq"] - (Iy - Ix)) * p * q
            + c["Nwp"] * w * p + c["Nur"] * u * r + c["Nuudr"] * u * u * dr
        )  # fmt: skip
        return inverse @ np.array([X, Y, Z, K, M, N])

    return Motion(acceleration, lag, math.pi)


def start():
    """Table 8.1: 1.54 m/s, rolled by the propeller."""
    s = np.zeros(14)
    s[0], s[9] = PRINTED["start"]["u"], math.radians(PRINTED["start"]["roll_deg"])
    return s
