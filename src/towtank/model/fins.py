"""Fins: loads of deflected fins (perron eq. 2.18), stall, straightening, faults, mixing, actuators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.craft.craft import Craft, Fin
from towtank.derive.fin_curve import FinCurve
from towtank.errors import CraftError
from towtank.frames import body_x
from towtank.model.algebra import Matrix, Ops, Scalar, Vector, frozen, product
from towtank.model.faults import Fault, Jammed, Limited, Lost, check_faults

_SPEED2_FLOOR = 1e-12
"""Added to the square of the speed [m2/s2] that divides the angles of inflow; the load itself goes with u|u|."""


@dataclass(frozen=True)
class Bend:
    """Curve of a fin's load, as ``FinCurve``: stall, width [rad], curvature [1/rad], drop [-]."""

    stall: Scalar
    curvature: Scalar
    drop: Scalar
    width: Scalar


STRAIGHT = Bend(np.pi, 0.0, 0.0, 1.0)
"""A load that grows with the angle as far as a fin can be turned."""


@dataclass(frozen=True)
class FinSet:
    """Constants of the fins. n fins, in the order of the craft.

    mixing (n, 3) : fin angles from rudder, elevator, aileron.   unmixing (3, n) : its pseudo-inverse.
    lift (n, 2) : y and z of the unit vector of the lift of a positive deflection.
    station (n,) : x of the stock from the origin [m].   max_angle, max_rate, time_constant (n,) [rad, rad/s, s].
    dead_band, backlash (n,) : half widths [rad]; they act on the command, once a control period.
    effect (n,) : 1, or 0 for a lost fin.   stuck (n,) : 1 for a jammed fin, at stuck_angle (n,) [rad].
    bend : curve of a fin's load.   kappa_v, kappa_r, apart : see ``inflow_angles`` and ``fin_load``.
    """

    mixing: Matrix
    unmixing: Matrix
    lift: Matrix
    station: tuple[float, ...]
    max_angle: tuple[float, ...]
    max_rate: tuple[float, ...]
    time_constant: tuple[float, ...]
    dead_band: tuple[float, ...]
    backlash: tuple[float, ...]
    effect: tuple[float, ...]
    stuck: tuple[float, ...]
    stuck_angle: tuple[float, ...]
    bend: Bend = STRAIGHT
    kappa_v: Scalar = 0.0
    kappa_r: Scalar = 0.0
    apart: Scalar = 0.0


def fin_set(craft: Craft, curve: FinCurve | None = None, faults: Sequence[Fault] = (), apart: float = 0.0) -> FinSet:
    """The fin constants of ``craft`` with a ``curve`` of their load and ``faults``.

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
    check_faults(craft, faults)
    at_fault = {fault.fin: fault for fault in faults}
    stations = []
    for fin in craft.fins:
        y = 0.5 * (fin.root_radius + fin.tip_radius)
        stock = float(fin.trailing_edge_at(y)) - (1.0 - fin.hinge) * float(fin.chord(y))
        stations.append(float(body_x(stock, craft.origin_from_nose)))
    if curve and curve.kappa_r:
        stations = [float(body_x(curve.station_from_nose, craft.origin_from_nose))] * len(stations)
    jams = [fault if isinstance(fault, Jammed) else None for fault in (at_fault.get(f.name) for f in craft.fins)]
    unmixing = np.linalg.pinv(craft.mixing) if craft.fins else np.zeros((3, 0))
    return FinSet(
        mixing=frozen(_rounded(craft.mixing)),
        unmixing=frozen(_rounded(unmixing)),
        lift=[fin.lift_direction[1:].tolist() for fin in craft.fins],
        station=tuple(stations),
        max_angle=tuple(_reach(fin, at_fault.get(fin.name)) for fin in craft.fins),
        max_rate=tuple(float(fin.max_rate) for fin in craft.fins),
        time_constant=tuple(float(fin.time_constant) for fin in craft.fins),
        dead_band=tuple(float(fin.dead_band) for fin in craft.fins),
        backlash=tuple(float(fin.backlash) for fin in craft.fins),
        effect=tuple(0.0 if isinstance(at_fault.get(fin.name), Lost) else 1.0 for fin in craft.fins),
        stuck=tuple(float(jam is not None) for jam in jams),
        stuck_angle=tuple(float(jam.angle) if jam else 0.0 for jam in jams),
        bend=Bend(curve.stall, curve.curvature, curve.drop, curve.width) if curve else STRAIGHT,
        kappa_v=curve.kappa_v if curve else 0.0,
        kappa_r=curve.kappa_r if curve else 0.0,
        apart=apart,
    )


def _reach(fin: Fin, fault: Fault | None) -> float:
    """Largest angle [rad] of a fin; not zero, since shares of it are taken."""
    return max(float(fault.angle), 1e-9) if isinstance(fault, Limited) else float(fin.max_angle)


def _rounded(matrix: Any) -> Any:
    """``matrix`` with the round-off of the pseudo-inverse (below 1e-15) set to zero."""
    return np.where(np.abs(matrix) < 1e-15, 0.0, matrix)


def fin_angles(fins: FinSet, rudder: Scalar, elevator: Scalar, aileron: Scalar) -> list[Scalar]:
    """Fin angles (n,) [rad] of virtual rudder, elevator, aileron [rad]."""
    return product(fins.mixing, [rudder, elevator, aileron])


def virtual_angles(fins: FinSet, delta: Vector) -> list[Scalar]:
    """Virtual rudder, elevator, aileron [rad] of fin angles ``delta`` (n,) [rad]: the least-squares inverse."""
    return product(fins.unmixing, delta)


def inflow_angles(fins: FinSet, nu: Vector, ops: Ops) -> list[Scalar]:
    """Angle (n,) [rad] that drift and turning add to the angle of each fin.

    a = -(kappa_v v_n + kappa_r (x_f omega)_n) / U, n the direction of the lift, U the speed through the water.

    Source     perron, section 3.7.1 (straightening); THEORY section 5.
    Departure  Two factors instead of one: SUBOFF's fins are half as effective in drift as in turning. The sine of the
               angle stands for the angle, 2 % less at 20 deg, so that all fins share one root.
    Valid      Ahead, to some 30 deg. Astern the angle keeps the sign that opposes the cross-flow.
    """
    u, v, w, _, q, r = nu
    scale = (1.0 - 2.0 * ops.positive(u)) / ops.sqrt(u * u + v * v + w * w + _SPEED2_FLOOR)
    return [
        scale * (fins.kappa_v * (ly * v + lz * w) + fins.kappa_r * x * (ly * r - lz * q))
        for (ly, lz), x in zip(fins.lift, fins.station, strict=True)
    ]


def bent(curve: Bend, angle: Scalar, ops: Ops) -> Scalar:
    """The angle [rad] at which an unstalled, linear fin has the load that this one has at ``angle`` [rad].

    Source     ``towtank.derive.fin_curve.FinCurve``; THEORY section 5.
    """
    size = ops.fabs(angle)
    core = ops.fmax(-curve.stall, ops.fmin(curve.stall, angle))
    lost = curve.drop * ops.fmin(ops.fmax((size - curve.stall) * (1.0 / curve.width), 0.0), 1.0)
    return core * (1.0 + curve.curvature * ops.fabs(core)) * (1.0 - lost)


def fin_load(c: Any, fins: FinSet, nu: Vector, delta: Vector, ops: Ops) -> list[Scalar]:
    """Load (6,) [N, N m] of fins deflected by ``delta`` (n,) [rad] in the motion ``nu`` (6,) through the water.

    A fin stands at delta + a, a from ``inflow_angles``. The derivatives of a hull with fins hold the linear load of a;
    what is added here is the rest: bent(delta + a) - a, which is delta for a fin that does not stall. Of a lost fin the
    linear load of a is taken off. ``fins.apart`` is 1 where the derivatives are those of the hull without its fins.

    Source     perron, eq. 2.18; THEORY section 5.
    Departure  Each fin by itself, with a curve of its load instead of a straight line.
    Valid      To the angle to which the curve is known; without a curve 15 to 20 deg. Drag grows with delta^2 beyond.
    """
    if not delta:
        return [0.0] * 6
    u = nu[0]
    inflow = inflow_angles(fins, nu, ops)
    angles = [
        share * bent(fins.bend, d + a, ops) - (1.0 - fins.apart) * a
        for d, a, share in zip(delta, inflow, fins.effect, strict=True)
    ]
    dr, de, da = product(fins.unmixing, angles)
    uu = u * ops.fabs(u)
    faced = [d + fins.apart * a for d, a in zip(delta, inflow, strict=True)]
    dd = sum([share * d * d for d, share in zip(faced, fins.effect, strict=True)])
    return [
        c.Xuudd * uu * dd,
        c.Yuudr * uu * dr,
        c.Zuude * uu * de,
        c.Kuudroll * uu * da,
        c.Muude * uu * de,
        c.Nuudr * uu * dr,
    ]


def actuator_rates(fins: FinSet, delta: Vector, command: Vector, ops: Ops) -> list[Scalar]:
    """Rates (n,) [rad/s] of the fin angles: first-order lag towards the limited command, with a rate limit.

    A jammed fin goes to the angle at which it is stuck and stays there.
    """
    fmin, fmax = ops.fmin, ops.fmax
    out = []
    for i, (angle, order) in enumerate(zip(delta, command, strict=True)):
        limit, rate, lag, stuck = fins.max_angle[i], fins.max_rate[i], fins.time_constant[i], fins.stuck[i]
        wanted = stuck * fins.stuck_angle[i] + (1.0 - stuck) * order
        out.append(fmax(-rate, fmin(rate, (fmax(-limit, fmin(limit, wanted)) - angle) / lag)))
    return out
