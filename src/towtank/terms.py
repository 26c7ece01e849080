"""The coefficient model as sums of terms: regressors for identification, and loads of a known set.

The equations of motion in ``towtank.model`` state the same physics as the matrices of the source; a test holds one
against the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from towtank.frames import Array
from towtank.symbols import CONTROLS, LOADS, PER_SPEED, RATES, TERMS, Term


def reduced_coriolis_load(added: Array, nu: Array) -> Array:
    """Load C_p(nu) nu (N, 6) [N, N m] of the reduced added-mass bracket.

    Parameters
    ----------
    added : natural added-mass derivatives M_A (6, 6), rows LOADS, columns RATES.
    nu : velocities (N, 6).

    Source     perron, eq. 2.15: the bracket of C(M_A) with the products u v, u w, u q, u r taken out, because the
               damping terms Yur, Zuq, Muw, Muq, Nuv, Nur already hold them (variant "lumped").
    Departure  The sign in front of the printed matrix is dropped: with (C_RB - C_A) on the left-hand side the
               bracket itself is C(M_A), and the load on the body is + bracket * nu.
    """
    u, v, w, p, q, r = np.moveaxis(nu, -1, 0)
    (_, _, xw, _, xq, _), (_, yv, _, yp, _, yr), (zu, _, zw, _, zq, _) = added[0], added[1], added[2]
    (_, kv, _, kp, _, kr), (mu, _, mw, _, mq, _), (_, nv, _, np_, _, nr) = added[3], added[4], added[5]
    a = xw * w + xq * q
    b = yv * v + yr * r + yp * p
    c = zu * u + zw * w + zq * q
    roll, pitch, yaw = kv * v + kp * p + kr * r, mu * u + mw * w + mq * q, nv * v + np_ * p + nr * r
    return np.stack(
        [
            zu * u * q - yp * p * r,
            -c * p + a * r,
            b * p - a * q,
            c * v - b * w + yaw * q - pitch * r,
            -zu * u * u + a * w - yaw * p + roll * r,
            yp * p * u - a * v + pitch * p - roll * q,
        ],
        axis=-1,
    )


def _factor(token: str, nu: Array, nudot: Array, control: Array) -> Array:
    if token in PER_SPEED:
        return np.asarray(np.maximum((nu[:, :3] ** 2).sum(axis=1), 1e-12) ** (-0.5 * PER_SPEED[token]))
    if token in CONTROLS:
        return np.asarray(control[:, CONTROLS.index(token)])
    if token.endswith("dot"):
        return np.asarray(nudot[:, RATES.index(token[0])])
    column = nu[:, RATES.index(token.strip("|"))]
    return np.abs(column) if token.startswith("|") else column


def regressor(term: Term, nu: Array, nudot: Array, control: Array) -> Array:
    """Loads (N, 6) of a unit value of ``term``.

    Parameters
    ----------
    nu, nudot : velocities and accelerations (N, 6).
    control : virtual rudder, elevator, aileron [rad] and sum of squared fin angles [rad2] (N, 4).
    """
    load = np.zeros((len(nu), 6))
    product = np.ones(len(nu))
    for token in term.factors:
        product = product * _factor(token, nu, nudot, control)
    load[:, LOADS.index(term.load)] = product
    if term.is_added_mass:
        unit = np.zeros((6, 6))
        unit[LOADS.index(term.load), RATES.index(term.factors[0][0])] = 1.0
        load += reduced_coriolis_load(unit, nu)
    return load


def columns(names: Sequence[str], nu: Array, nudot: Array, control: Array) -> Array:
    """Regressors of the terms ``names`` stacked, shape (N, 6, len(names))."""
    return np.stack([regressor(TERMS[name], nu, nudot, control) for name in names], axis=-1)


def term_loads(values: Mapping[str, float], nu: Array, nudot: Array, control: Array) -> Array:
    """Hydrodynamic load (N, 6) [N, N m] of a coefficient set in the "lumped" variant, without the body's inertia."""
    names = [name for name, value in values.items() if value != 0.0]
    if not names:
        return np.zeros((len(nu), 6))
    return np.asarray(columns(names, nu, nudot, control) @ np.array([values[name] for name in names]))
