"""Line of sight: the heading that brings a craft onto a straight leg and keeps it there in a current.

``orders`` is ``Orders`` or any object with its attributes, of floats, arrays or symbols.
"""

from __future__ import annotations

from math import atan2
from typing import Any

from towtank.model.algebra import Ops, Scalar

Point = tuple[float, float]
"""North and east [m]."""


def line(start: Point, end: Point, lookahead: float, drift: float = 0.0, crab: float = 0.0) -> dict[str, float]:
    """The entries of ``Orders`` that make a craft follow the leg from ``start`` to ``end``.

    lookahead [m]; drift [1/s], gain of the guidance integral; crab [rad].
    """
    course = atan2(end[1] - start[1], end[0] - start[0])
    return {
        "steer": 1.0, "track": 1.0, "north": start[0], "east": start[1], "course": course,
        "lookahead": lookahead, "drift": drift, "crab": crab,
    }  # fmt: skip


def along(orders: Any, x: Scalar, y: Scalar, ops: Ops) -> Scalar:
    """Distance made good along the leg [m] at north ``x`` and east ``y`` [m]."""
    return (x - orders.north) * ops.cos(orders.course) + (y - orders.east) * ops.sin(orders.course)


def across(orders: Any, x: Scalar, y: Scalar, ops: Ops) -> Scalar:
    """Distance off the leg to starboard [m] at north ``x`` and east ``y`` [m]."""
    return (y - orders.east) * ops.cos(orders.course) - (x - orders.north) * ops.sin(orders.course)


def line_of_sight(orders: Any, x: Scalar, y: Scalar, integral: Scalar, ops: Ops) -> tuple[Scalar, Scalar]:
    """Heading wanted [rad] and rate of the guidance integral [m/s], at north ``x``, east ``y`` and ``integral`` [m].

    psi = course - crab - atan((e + integral) / lookahead),   e : distance off the leg to starboard
    rate = drift lookahead^2 e / (lookahead^2 + (e + integral)^2)

    Source     fossen2021, ch. 12, integral line-of-sight guidance.
    Departure  The crab angle stands beside the integral. The integral is kept in metres of offset, so that it can be
               read as the drift it balances; the one who orders the leg scales its gain with the speed.
    Valid      Currents below the speed of the craft; lookahead > 0.
    """
    e = across(orders, x, y, ops)
    aim = e + integral
    square = orders.lookahead * orders.lookahead
    wanted = orders.course - orders.crab - ops.atan2(aim, orders.lookahead)
    return wanted, orders.drift * square * e / (square + aim * aim)
