"""From virtual rudder, elevator and aileron to fins that have limits, and may be jammed or lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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

ROLL_WEIGHT = 0.01
"""Weight of roll in the sharing among damaged fins; yaw and pitch have 1."""
FIRST_WEIGHT = 100.0
"""Weight of what is served first, against the other of yaw and pitch."""
LEAST = 1e-6
"""Weight of the fin angles themselves, which picks the smallest of those that serve a command equally well."""
ROUNDS_PER_FIN = 2
"""Rounds of the search for the fins at a limit, see ``reallocate``; in one a fin goes to its limit or leaves it."""

_TIE = 1e-9
"""Shares of a step that count as equal."""


@dataclass(frozen=True)
class Damage:
    """What a pilot knows of fins that do not follow. Numbers may be symbols.

    columns (3, n) : rudder, elevator, aileron that the fin angles amount to, 0 for a lost fin.
    stuck (n,) : 1 for a jammed fin, at angles (n,) [rad].
    """

    columns: Matrix
    stuck: Vector
    angles: Vector


@dataclass(frozen=True)
class Allocation:
    """Mixing and limits of the fins. Numbers may be symbols.

    rows (n, 3) : angle of each fin from rudder, elevator, aileron.   limits (n,) : largest angle of each fin [rad].
    damage : of fins that do not follow, if the pilot knows of any.
    """

    rows: Matrix
    limits: Vector
    damage: Damage | None = None

    def fins(self, command: Sequence[float]) -> list[Any]:
        """Fin angles (n,) [rad] of ``command`` (3,): rudder, elevator, aileron [rad]."""
        return product(self.rows, command)


def allocation(craft: Craft) -> Allocation:
    """Allocation of a craft's fins."""
    rows = tuple((float(a), float(b), float(c)) for a, b, c in craft.mixing)
    return Allocation(rows, tuple(float(fin.max_angle) for fin in craft.fins))


def allocate(command: Vector, tail: Allocation, first: First, ops: Ops) -> tuple[list[Scalar], list[Scalar]]:
    """Fin angles (n,) [rad] for ``command`` (3,) [rad], and the command (3,) they amount to.

    Sound fins share it by ``share``, damaged ones by ``reallocate``.
    """
    if tail.damage is None:
        granted = share(command, tail.rows, tail.limits, first, ops)
        return product(tail.rows, granted), granted
    weights = [1.0 + (FIRST_WEIGHT - 1.0) * early for early in first]
    # Where both are first neither is before the other.
    even = first[0] * first[1]
    weights = [(1.0 - even) * weight + even for weight in weights]
    fins = reallocate(command, tail, [*weights, ROLL_WEIGHT], ops)
    return fins, product(tail.damage.columns, fins)


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


def reallocate(command: Vector, tail: Allocation, weights: Vector, ops: Ops) -> list[Scalar]:
    """Fin angles (n,) [rad] of least cost within their limits; jammed fins stand at their angles.

    cost = sum of weights (command - B delta)^2 + LEAST |delta|^2 over -limit <= delta <= limit, B of ``tail.damage``.

    Source     harkegard2002: control allocation as bounded weighted least squares, by an active set of fins at a limit.
    Departure  A fixed number of rounds, so that the law has no branch; a round that meets no limit
               releases every fin that is to leave its own.
    Valid      ``weights`` from 0.01 to 100. Every round lowers the cost, so that an answer cut short is a sound one.
    """
    d, limits, n = tail.damage, tail.limits, range(len(tail.limits))
    assert d is not None
    served = [[weight * b for b in row] for weight, row in zip(weights, d.columns, strict=True)]
    matrix = [
        [sum([served[k][i] * d.columns[k][j] for k in range(3)]) + (LEAST if i == j else 0.0) for j in n] for i in n
    ]
    pull = [sum([served[k][i] * command[k] for k in range(3)]) for i in n]
    free: list[Scalar] = [1.0 - s for s in d.stuck]
    delta: list[Scalar] = [s * a for s, a in zip(d.stuck, d.angles, strict=True)]
    for _ in range(ROUNDS_PER_FIN * len(limits)):
        slope = [h - g for h, g in zip(product(matrix, delta), pull, strict=True)]
        step = _solved(matrix, free, slope)
        room = [
            ops.fmax(limit - (2.0 * ops.positive(p) - 1.0) * x, 0.0) / ops.fmax(ops.fabs(p), ROUND_OFF)
            for p, x, limit in zip(step, delta, limits, strict=True)
        ]
        part: Scalar = 1.0
        for r, p in zip(room, step, strict=True):
            part = ops.fmin(part, r + 2.0 - 2.0 * ops.positive(ops.fabs(p) - ROUND_OFF))
        whole = 1.0 - ops.positive(1.0 - part)
        delta = [x + part * p for x, p in zip(delta, step, strict=True)]
        # A fin that stops the step is held. After a whole step those are let go whose cost falls inwards.
        slope = [h - g for h, g in zip(product(matrix, delta), pull, strict=True)]
        free = [
            f * (1.0 - (1.0 - whole) * (1.0 - ops.positive(r - part - _TIE)))
            + (1.0 - f) * (1.0 - s) * whole * ops.positive((2.0 * ops.positive(x) - 1.0) * g)
            for f, r, s, x, g in zip(free, room, d.stuck, delta, slope, strict=True)
        ]
    return [ops.fmax(-limit, ops.fmin(limit, x)) for x, limit in zip(delta, limits, strict=True)]


def _solved(matrix: Matrix, free: Vector, slope: Vector) -> list[Scalar]:
    """Step (n,) to the least of a quadratic with ``matrix`` (n, n) and ``slope`` (n,) in the ``free`` (1) directions.

    Source     Gauss elimination; the rows of the other directions are those of the unit matrix.
    """
    n = len(free)
    m = [[free[i] * free[j] * matrix[i][j] + ((1.0 - free[i]) if i == j else 0.0) for j in range(n)] for i in range(n)]
    x = [-f * g for f, g in zip(free, slope, strict=True)]
    for k in range(n):
        for i in range(k + 1, n):
            factor = m[i][k] / m[k][k]
            m[i] = [a - factor * b for a, b in zip(m[i], m[k], strict=True)]
            x[i] = x[i] - factor * x[k]
    for k in reversed(range(n)):
        x[k] = (x[k] - sum([m[k][j] * x[j] for j in range(k + 1, n)])) / m[k][k]
    return x
