"""The closed loop: what is seen, what the pilot asks for, how the state moves. One text for numbers and symbols.

The state is x y z [m, NED], e0 e1 e2 e3 (unit quaternion, body to NED), u v w p q r (over ground, body axes), then the
fin angles [rad]. A channel is a quantity that can be logged, gauged or wait for; ``channels`` lists them.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from towtank.engine.form import System
from towtank.model.algebra import Ops, Scalar, Vector, product_transposed
from towtank.model.equations import right_hand_side_quaternion, total_load
from towtank.model.kinematics import quaternion_matrix
from towtank.pilot.guidance import across, along
from towtank.pilot.law import Seen, Steering, steer
from towtank.pilot.orders import FIN_ORDERS, ORDERS, Orders

KINEMATIC = 13
"""States before the fins."""
MEMORY = ("trim_rudder", "trim_elevator", "guidance")
"""What the steering remembers: its two trims [rad] and the integral of the guidance [m]."""

_POSE = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
_DERIVED = (
    "speed", "drift", "turn", "sink", "level_speed", "ahead", "slip", "plunge", "along", "across", "fin_square",
    "fin_largest", "fin_use",
)  # fmt: skip
_HELD = ("rudder", "elevator", "aileron", "heading", *MEMORY, "fin_travel")
SEEN = {"u": "ahead", "v": "slip", "w": "plunge"}
"""Channels that the pilot sees under another name."""
_FLOOR = 1e-30
"""Added below a root or to a divisor that may be zero; far below the square of any number that matters."""


def states(fins: int) -> tuple[str, ...]:
    """Names of the state."""
    return (
        "x",
        "y",
        "z",
        "e0",
        "e1",
        "e2",
        "e3",
        "u",
        "v",
        "w",
        "p",
        "q",
        "r",
        *(f"delta{i + 1}" for i in range(fins)),
    )


def channels(fins: int) -> tuple[str, ...]:
    """Names of the channels, SI.

    x y z phi theta psi (unwrapped) u v w p q r, delta1...: the state.   speed over ground; drift angle atan2(-v, u);
    turn, the rate of heading; sink, the rate of depth; level_speed, the speed along the horizontal; ahead, slip,
    plunge, the speeds through the water along x, y, z; along and across, the distances from the start
    of the leg's line and off it; fin_square, the mean square of the fin angles; fin_largest; fin_use, the largest share
    of its limit that a fin uses.
    Then what the loop keeps: the command granted, the heading wanted, the memory, and fin_travel, the mean angle swept.
    """
    return (*_POSE, *(f"delta{i + 1}" for i in range(fins)), *_DERIVED, *_HELD)


def observed(fins: int) -> int:
    """Number of channels that follow from the state and the orders alone; the others are kept by the loop."""
    return len(_POSE) + fins + len(_DERIVED)


def observe(s: System, x: Vector, orders: Vector, ops: Ops) -> list[Scalar]:
    """The first ``observed`` channels of the state ``x`` (13 + n) under ``orders`` (as in ``ORDERS``).

    Source     fossen2021, ch. 2, for the Euler angles of a rotation matrix. At 90 deg of pitch phi and psi are those of
               the limit; the motion itself does not use them.
    """
    J1 = quaternion_matrix(x[3:7])
    (u, v, w, p, q, r), delta = x[7:13], x[13:]
    north, east = J1[0][0], J1[1][0]
    level2 = J1[2][1] * J1[2][1] + J1[2][2] * J1[2][2]
    phi, psi = ops.atan2(J1[2][1], J1[2][2]), ops.atan2(east, north)
    theta = ops.atan2(-J1[2][0], ops.sqrt(level2 + _FLOOR))
    speed2 = u * u + v * v + w * w
    drift = product_transposed(J1, s.current)
    sink = J1[2][0] * u + J1[2][1] * v + J1[2][2] * w
    o = _orders(orders)
    squares = [d * d for d in delta]
    sizes = [ops.fabs(d) for d in delta]
    largest, use = sizes[0], sizes[0] / s.constants.fins.max_angle[0]
    for size, limit in zip(sizes[1:], s.constants.fins.max_angle[1:], strict=True):
        largest, use = ops.fmax(largest, size), ops.fmax(use, size / limit)
    derived = {
        "speed": ops.sqrt(speed2 + _FLOOR),
        "drift": ops.atan2(-v, u),
        "turn": (J1[2][1] * q + J1[2][2] * r) / (level2 + _FLOOR),
        "sink": sink,
        "level_speed": ops.sqrt(ops.fmax(speed2 - sink * sink, 0.0) + _FLOOR),
        "ahead": u - drift[0],
        "slip": v - drift[1],
        "plunge": w - drift[2],
        "along": along(o, x[0], x[1], ops),
        "across": across(o, x[0], x[1], ops),
        "fin_square": s.fin_share * sum(squares[1:], squares[0]),
        "fin_largest": largest,
        "fin_use": use,
    }
    return [x[0], x[1], x[2], phi, theta, psi, u, v, w, p, q, r, *delta, *(derived[name] for name in _DERIVED)]


def command(s: System, seen: Vector, memory: Vector, orders: Vector, ops: Ops) -> Steering:
    """What the pilot grants, from the channels ``seen`` (``observed`` or more), its ``memory`` (3) and ``orders``.

    Orders of single fins are added to the angles it asks for; they are no part of what it grants.
    """
    named = dict(zip(channels(len(s.constants.fins.max_angle)), seen, strict=False))
    eyes = Seen(**{name: named[SEEN.get(name, name)] for name in Seen._fields})
    o = _orders(orders)
    steering = steer(s.pilot, s.tail, o, eyes, memory, ops)
    own = [getattr(o, name) for name in FIN_ORDERS]
    own += [0.0] * (len(steering.fins) - len(own))
    return steering._replace(fins=[fin + more for fin, more in zip(steering.fins, own, strict=False)])


def dynamics(s: System, x: Vector, asked: Vector, ops: Ops) -> list[Scalar]:
    """Rates of the state ``x`` (13 + n) with ``asked`` (n + 1) held: fin angles and throttle."""
    return right_hand_side_quaternion(s.constants, x, asked[:-1], s.thrust * asked[-1], s.current, ops)


def load_through_water(s: System, x: Vector, throttle: Scalar, ops: Ops) -> list[Scalar]:
    """The bracket of eq. 2.9 (6,) [N, N m] in the state ``x`` (13 + n): what accelerates the craft in the water."""
    J1 = quaternion_matrix(x[3:7])
    drift = product_transposed(J1, s.current)
    nu = [*(a - b for a, b in zip(x[7:10], drift, strict=True)), *x[10:13]]
    return total_load(s.constants, nu, J1[2], x[13:], s.thrust * throttle, ops)


def _orders(values: Sequence[Any]) -> Any:
    return values if isinstance(values, Orders) else SimpleNamespace(**dict(zip(ORDERS, values, strict=True)))
