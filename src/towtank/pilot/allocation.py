"""From virtual rudder, elevator and aileron to fins that have limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from towtank.craft.craft import Craft
from towtank.model.algebra import Matrix, Ops, Scalar, Vector, product

First = tuple[Scalar, Scalar]
"""1 for each of rudder and elevator that is served in the first stage, 0 if it is served in the second."""

YAW_AND_PITCH_FIRST: First = (1.0, 1.0)
RUDDER_FIRST: First = (1.0, 0.0)
ELEVATOR_FIRST: First = (0.0, 1.0)

ROUND_OFF = 1e-12
"""Angle [rad] below which a fin is not moved. The mixing of a fin at 90 deg holds entries such as 6e-17, and sums of
columns are off by some 1e-16 rad; neither may count as a demand. Each of the two later stages may
pass a limit by as much."""


@dataclass(frozen=True)
class Allocation:
    """Mixing and limits of the fins.

    rows (n, 3) : angle of each fin from rudder, elevator, aileron.   limits (n,) : largest angle of each fin [rad].
    """

    rows: tuple[tuple[float, ...], ...]
    limits: tuple[float, ...]

    def fins(self, command: Sequence[float]) -> list[float]:
        """Fin angles (n,) [rad] of ``command`` (3,): rudder, elevator, aileron [rad]."""
        return product(self.rows, command)


def allocation(craft: Craft) -> Allocation:
    """Allocation of a craft's fins."""
    rows = tuple((float(a), float(b), float(c)) for a, b, c in craft.mixing)
    return Allocation(rows, tuple(float(fin.max_angle) for fin in craft.fins))


def share(command: Vector, rows: Matrix, limits: Vector, first: First, ops: Ops) -> list[Scalar]:
    """The part (3,) of ``command`` [rad] that keeps every fin within its limit.

    Three stages: the columns of yaw and pitch named by ``first``, the rest of yaw and pitch, roll. A stage that asks
    for more than the earlier ones left is scaled down as a whole, so that its direction is kept. With both first,
    roll gets what yaw and pitch leave over.

    Parameters
    ----------
    command (3,) : rudder, elevator, aileron [rad].   rows (n, 3).   limits (n,) [rad].   first : 0 or 1 each.

    Source     Allocator of the LAUV: yaw and pitch first, roll from the rest (THEORY section 5).
    Departure  A stage is measured without those after it. A command whose later columns would bring a fin back within
               its limit is reduced all the same.
    """
    rudder, elevator, aileron = command
    early = [first[0] * rudder, first[1] * elevator]
    late = [rudder - early[0], elevator - early[1]]
    used: list[Scalar] = [0.0] * len(limits)
    k1, used = _stage([row[0] * early[0] + row[1] * early[1] for row in rows], used, limits, ops)
    k2, used = _stage([row[0] * late[0] + row[1] * late[1] for row in rows], used, limits, ops)
    k3, used = _stage([row[2] * aileron for row in rows], used, limits, ops)
    return [k1 * early[0] + k2 * late[0], k1 * early[1] + k2 * late[1], k3 * aileron]


def _stage(asked: Vector, used: Vector, limits: Vector, ops: Ops) -> tuple[Scalar, list[Scalar]]:
    """Share 0..1 of ``asked`` (n,) that fits beside ``used`` (n,), and what is used then (n,) [rad]."""
    part: Scalar = 1.0
    for want, have, limit in zip(asked, used, limits, strict=True):
        size = ops.fabs(want)
        room = ops.fmax(limit - (2.0 * ops.positive(want) - 1.0) * have, 0.0)
        # Twice the whole where nothing is asked, so that neither a full fin nor a tie with 1 decides the stage.
        idle = 2.0 - 2.0 * ops.positive(size - ROUND_OFF)
        part = ops.fmin(part, room / ops.fmax(size, ROUND_OFF) + idle)
    return part, [have + part * want for want, have in zip(asked, used, strict=True)]
