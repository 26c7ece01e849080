"""Fins: loads of deflected fins (perron eq. 2.18), straightening, mixing, actuators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import CraftError
from towtank.frames import body_x
from towtank.model.algebra import Matrix, Ops, Scalar, Vector, frozen, product

_SPEED2_FLOOR = 1e-12
"""Smallest u2 [m2/s2] that divides the rate part of the straightening; the load itself goes with u|u|."""


@dataclass(frozen=True)
class FinSet:
    """Constants of the fins. n fins, in the order of the craft.

    mixing (n, 3) : fin angles from rudder, elevator, aileron.   unmixing (3, n) : its pseudo-inverse.
    lift (n, 2) : y and z of the unit vector of the lift of a positive deflection.
    station (n,) : x of the stock from the origin [m].   max_angle, max_rate, time_constant (n,) [rad, rad/s, s].
    """

    mixing: Matrix
    unmixing: Matrix
    lift: Matrix
    station: tuple[float, ...]
    max_angle: tuple[float, ...]
    max_rate: tuple[float, ...]
    time_constant: tuple[float, ...]


def fin_set(craft: Craft) -> FinSet:
    """The fin constants of ``craft``.

    Raises
    ------
    CraftError
        A time constant, rate or angle limit that is not positive.
    """
    for fin in craft.fins:
        for word in ("time_constant", "max_rate", "max_angle"):
            if not getattr(fin, word) > 0.0:
                raise CraftError(
                    f"craft {craft.name}: fin {fin.name} has {word} = {getattr(fin, word):g}. The fin angle is a state "
                    "of the model and needs a positive one; give the actuator's value, or a small time constant."
                )
    stations = []
    for fin in craft.fins:
        y = 0.5 * (fin.root_radius + fin.tip_radius)
        stock = float(fin.trailing_edge_at(y)) - (1.0 - fin.hinge) * float(fin.chord(y))
        stations.append(float(body_x(stock, craft.origin_from_nose)))
    unmixing = np.linalg.pinv(craft.mixing) if craft.fins else np.zeros((3, 0))
    return FinSet(
        mixing=frozen(_rounded(craft.mixing)),
        unmixing=frozen(_rounded(unmixing)),
        lift=[fin.lift_direction[1:].tolist() for fin in craft.fins],
        station=tuple(stations),
        max_angle=tuple(float(fin.max_angle) for fin in craft.fins),
        max_rate=tuple(float(fin.max_rate) for fin in craft.fins),
        time_constant=tuple(float(fin.time_constant) for fin in craft.fins),
    )


def _rounded(matrix: Any) -> Any:
    """``matrix`` with the round-off of the pseudo-inverse (below 1e-15) set to zero."""
    return np.where(np.abs(matrix) < 1e-15, 0.0, matrix)


def fin_angles(fins: FinSet, rudder: Scalar, elevator: Scalar, aileron: Scalar) -> list[Scalar]:
    """Fin angles (n,) [rad] of virtual rudder, elevator, aileron [rad]."""
    return product(fins.mixing, [rudder, elevator, aileron])


def virtual_angles(fins: FinSet, delta: Vector) -> list[Scalar]:
    """Virtual rudder, elevator, aileron [rad] of fin angles ``delta`` (n,) [rad]: the least-squares inverse."""
    return product(fins.unmixing, delta)


def effective_angles(fins: FinSet, nu: Vector, delta: Vector, kappa_v: float, kappa_r: float, ops: Ops) -> list[Scalar]:
    """Fin angles less the share of the local flow angle that the hull derivatives do not hold (n,) [rad].

    delta_eff = delta - kappa_v atan(v_n / u) - kappa_r (x_f omega)_n / u, where v_n is the velocity along the lift
    direction. The derivatives of a finned hull already hold the fins at rest; both factors are therefore zero unless
    a component model leaves part of the fins out.

    Source     perron, section 3.7.1 (straightening); THEORY section 5.
    Departure  Two factors instead of one: SUBOFF's fins are half as effective in drift as in turning.
    Valid      Ahead. Astern the angle keeps the sign that opposes the cross-flow; at u = 0 the load vanishes.
    """
    u, v, w, _, q, r = nu
    out = []
    inverse = u / ops.fmax(u * u, _SPEED2_FLOOR)
    for angle, (ly, lz), x in zip(delta, fins.lift, fins.station, strict=True):
        normal, turning = ly * v + lz * w, (ly * r - lz * q) * x
        out.append(angle - kappa_v * ops.atan2(normal * u, u * u) - kappa_r * turning * inverse)
    return out


def fin_load(c: Any, fins: FinSet, u: Scalar, delta: Vector, ops: Ops) -> list[Scalar]:
    """Load (6,) [N, N m] of fins deflected by ``delta`` (n,) [rad].

    Source     perron, eq. 2.18.
    Valid      The linear range of the fins, about 15 to 20 deg.
    """
    if not delta:
        return [0.0] * 6
    dr, de, da = product(fins.unmixing, delta)
    uu = u * ops.fabs(u)
    dd = sum([d * d for d in delta])
    return [
        c.Xuudd * uu * dd,
        c.Yuudr * uu * dr,
        c.Zuude * uu * de,
        c.Kuudroll * uu * da,
        c.Muude * uu * de,
        c.Nuudr * uu * dr,
    ]


def actuator_rates(fins: FinSet, delta: Vector, command: Vector, ops: Ops) -> list[Scalar]:
    """Rates (n,) [rad/s] of the fin angles: first-order lag towards the limited command, with a rate limit."""
    fmin, fmax = ops.fmin, ops.fmax
    return [
        fmax(-rate, fmin(rate, (fmax(-limit, fmin(limit, order)) - angle) / lag))
        for angle, order, limit, rate, lag in zip(
            delta, command, fins.max_angle, fins.max_rate, fins.time_constant, strict=True
        )
    ]
