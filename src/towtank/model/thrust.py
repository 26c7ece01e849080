"""Thrust: constant in the manoeuvre, or a propeller with its open-water table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import CraftError
from towtank.frames import Array
from towtank.model.algebra import MATH, Ops, Scalar, Table, interpolate, table_of

_FORCE_FLOOR = 1e-30
"""Smallest square of the shaft speed [1/s2] that divides the advance ratio."""


@dataclass(frozen=True)
class Screw:
    """A propeller in its working point.

    density [kg/m3], diameter [m], wake, deduction [-], torque : sense of the torque on the hull (+1, -1 or 0).
    force_per_square : force on the hull per n|n| [N s2] where the thrust balances the resistance.
    kt, kq : the open-water tables over the advance ratio.
    balance : the advance ratio where the thrust balances the resistance. It is the same at every speed, because both
        grow with the square of speed. It is for readers; the equations use ``force_per_square``.
    """

    density: Scalar
    diameter: Scalar
    wake: Scalar
    deduction: Scalar
    torque: Scalar
    force_per_square: Scalar
    kt: Table
    kq: Table
    balance: float | None = None


def screw_of(craft: Craft, resistance: float) -> Screw | None:
    """The propeller of ``craft``, or None when it has no table (thrust is then constant in the manoeuvre).

    resistance : -Xuu [kg/m].

    Source     KT(J) rho n^2 D^4 (1 - t) = resistance u^2 with u = n D J / (1 - w): KT = demand J^2.

    Raises
    ------
    CraftError
        The table does not rise, the diameter is not positive, or no advance ratio balances the resistance.
    """
    propeller = craft.propeller
    if not propeller.table:
        return None
    table = np.asarray(propeller.table, dtype=float)
    where = f"craft {craft.name}: propeller"
    if propeller.diameter <= 0.0 or len(table) < 2 or np.any(np.diff(table[:, 0]) <= 0.0):
        raise CraftError(
            f"{where}: the table needs a positive diameter and at least two rows (J, KT, KQ) with rising J."
        )
    advance, *curves = _to_zero_thrust(table).T.tolist()
    kt, kq = (table_of(advance, curve) for curve in curves)
    demand = (
        resistance
        / (craft.water.density * propeller.diameter**2)
        / ((1.0 - propeller.thrust_deduction) * (1.0 - propeller.wake) ** 2)
    )

    low, high = max(advance[0], 0.0), advance[-1]
    if resistance <= 0.0 or high <= low or _excess(low, kt, demand) <= 0.0 or _excess(high, kt, demand) >= 0.0:
        raise CraftError(
            f"{where}: no advance ratio between {low:g} and {high:g} gives a thrust that balances the resistance "
            f"{resistance:.4g} u2 N. Correct the table or the diameter, or leave the table out."
        )
    balance = _balance(kt, demand)
    per_square = craft.water.density * propeller.diameter**4 * float(interpolate(balance, kt, MATH))
    return Screw(
        craft.water.density,
        propeller.diameter,
        propeller.wake,
        propeller.thrust_deduction,
        propeller.torque,
        (1.0 - propeller.thrust_deduction) * per_square,
        kt,
        kq,
        balance,
    )


def _excess(j: float, kt: Table, demand: float) -> float:
    """Thrust coefficient at the advance ratio ``j`` beyond the one the resistance asks for, demand j^2."""
    return float(interpolate(j, kt, MATH)) - demand * j * j


def _balance(kt: Table, demand: float) -> float:
    """Advance ratio J > 0 where KT(J) = demand J^2, on the first segment that crosses: the root of a parabola."""
    crossed = (i for i, knot in enumerate(kt.knots) if i and knot > 0.0 and _excess(knot, kt, demand) <= 0.0)
    i = next(crossed)
    slope = float(kt.slopes[i - 1])
    at_zero = float(interpolate(kt.knots[i], kt, MATH)) - slope * kt.knots[i]
    root = math.sqrt(slope * slope + 4.0 * demand * at_zero)
    # of the two ways to write the larger root, the one that adds two numbers of equal sign
    return 2.0 * at_zero / (root - slope) if slope < 0.0 else (slope + root) / (2.0 * demand)


def _to_zero_thrust(table: Array) -> Array:
    """``table`` (rows J, KT, KQ) carried on along its last segment to KT = 0, when it ends earlier.

    Valid      Open-water curves are nearly straight down to zero thrust; KQ is not let below zero.
    """
    before, last = table[-2], table[-1]
    slope = (last - before) / (last[0] - before[0])
    if last[1] <= 0.0 or slope[1] >= 0.0:
        return table
    end = last + slope * (-last[1] / slope[1])
    return np.vstack([table, [end[0], 0.0, max(float(end[2]), 0.0)]])


def steady_thrust(resistance: float, speed: Scalar, ops: Ops) -> Scalar:
    """Thrust [N] that balances the resistance at ``speed`` [m/s].

    Source     THEORY section 6: F_T = -Xuu u_c|u_c|.
    """
    return resistance * speed * ops.fabs(speed)


def thrust_load(screw: Screw | None, command: Scalar, u: Scalar, ops: Ops) -> tuple[Scalar, Scalar]:
    """Force X [N] and torque K [N m] of the thruster.

    Parameters
    ----------
    command : the thrust [N] that balances the resistance at the commanded speed. Without a table it is the force.
        With a table it fixes the shaft speed n, and the force follows the table as the craft slows down or speeds up.
    u : speed of the craft through the water along x [m/s].

    Source     T = (1 - t) rho n|n| D^4 KT(J), J = (1 - w) u / (n D), K = -+ rho n|n| D^5 KQ(J) (THEORY section 6).
    Valid      Ahead. A table that ends before zero thrust is carried on straight to it; beyond, it is held.
    """
    if screw is None:
        return command, 0.0
    square = command / screw.force_per_square
    n = ops.sqrt(ops.fabs(square) + _FORCE_FLOOR)
    sense = square / (n * n)
    D = screw.diameter
    J = (1.0 - screw.wake) * u * sense / (n * D)
    head = screw.density * square * (D * D * D * D)
    force = (1.0 - screw.deduction) * head * interpolate(J, screw.kt, ops)
    torque = screw.torque * head * D * interpolate(J, screw.kq, ops)
    return force, torque


def shaft_speed(screw: Screw, command: float) -> float:
    """Shaft speed n [rev/s] that goes with the thrust ``command`` [N]; negative astern."""
    return float(np.sign(command) * np.sqrt(abs(command) / screw.force_per_square))
