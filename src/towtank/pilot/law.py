"""The pilot as a law without branches: heading and depth cascade, roll damping, limits, anti-windup, schedule.

One text for floats, arrays and symbols. A choice is a factor 0 or 1. ``pilot``, ``orders`` and ``seen`` may be any
objects with the attributes named in ``GAINS``, ``ORDERS`` and ``Seen``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import pi
from typing import Any, NamedTuple

from towtank.model.algebra import Ops, Scalar, Vector
from towtank.pilot.allocation import ROUND_OFF, Allocation, allocate
from towtank.pilot.guidance import line_of_sight
from towtank.pilot.sensors import EXACT, Sensors

SLOWEST = 0.3
"""Smallest fraction of the design speed at which the schedule still raises the gains; 1/0.3^2 is a factor of 11."""
MEMORY = 3
"""States of the pilot: trim of the rudder [rad], trim of the elevator [rad], integral of the guidance [m]."""
_MET = 1e-3
"""Part of a command [rad] that damaged fins may leave without being full."""
_STANDSTILL = 1e-9
"""Speed [m/s] or gain [1/s] that stands for zero where one is a divisor."""


@dataclass(frozen=True)
class Pilot:
    """Gains designed for ``speed`` [m/s]. Commands are virtual angles [rad]; SNAME: +rudder turns to port.

    rudder   = -schedule (yaw_rate (r - r_ref) + sway v) + trim,   r_ref = heading (psi_ref - psi), at most turn_limit
    elevator = -schedule (pitch_rate q + pitch theta - pitch_order theta_ref + heave w) + trim,
                                      theta_ref = depth_rate zdot - depth (z_ref - z), at most pitch_limit from trim
    aileron  = -schedule (roll phi + roll_rate p)
    The two trims integrate heading_integral (psi_ref - psi) and depth_integral (z_ref - z).
    schedule = (speed / u)^2, because the fins' effect grows with u^2; 1 where ``scheduled`` is 0.
    Under an order for a rate of turn, r_ref is that rate; the trim integrates heading_integral / heading (r_ref - r);
    under one for a pitch, theta_ref is that pitch and the trim is held.

    yaw_rate [s], sway [rad s/m], heave [rad s/m], heading [1/s], heading_integral [1/s], turn_limit [rad/s],
    pitch_rate [s], pitch [-], pitch_order [-],
    depth [rad/m], depth_rate [rad s/m], depth_integral [rad/(m s)], pitch_limit [rad], roll [-], roll_rate [s].
    unwind [s] : time in which a saturated fin takes back what its trim cannot use.
    heading_band [rad], depth_band [m] : largest errors the trims integrate, so that a large step does not fill them.
    reversal [m/s] : speed below which the elevator acts reversed on depth; 0 if there is none below ``speed``.
    sensors : what the craft is seen through.
    eigenvalues : loop -> closed-loop eigenvalues [1/s].   margins : loop -> (largest gain factor, smallest gain factor,
    phase margin [rad]).   notes : what the pilot cannot do, in words.
    """

    craft: str
    speed: float
    yaw_rate: float = 0.0
    heading: float = 0.0
    heading_integral: float = 0.0
    turn_limit: float = 0.0
    pitch_rate: float = 0.0
    pitch: float = 0.0
    pitch_order: float = 0.0
    depth: float = 0.0
    depth_rate: float = 0.0
    depth_integral: float = 0.0
    pitch_limit: float = 0.0
    roll: float = 0.0
    roll_rate: float = 0.0
    sway: float = 0.0
    heave: float = 0.0
    scheduled: float = 1.0
    unwind: float = 1.0
    heading_band: float = 0.0
    depth_band: float = 0.0
    reversal: float = 0.0
    sensors: Sensors = EXACT
    eigenvalues: Mapping[str, tuple[complex, ...]] = field(default_factory=dict)
    margins: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


GAINS: tuple[str, ...] = tuple(
    f.name for f in fields(Pilot) if f.name not in {"craft", "sensors", "eigenvalues", "margins", "notes"}
)
"""Names of the numbers the law uses, ``speed`` to ``reversal``, in the order in which they are packed."""

NO_PILOT = Pilot(craft="", speed=1.0)
"""Stands for the pilot of a run that has none; its orders have ``piloted`` 0."""


class Seen(NamedTuple):
    """What a pilot measures.

    x, y, z [m]; phi, theta, psi [rad]; u, v, w : speeds through the water [m/s]; p, q, r [rad/s]; sink : zdot [m/s].
    """

    x: Scalar
    y: Scalar
    z: Scalar
    phi: Scalar
    theta: Scalar
    psi: Scalar
    u: Scalar
    v: Scalar
    w: Scalar
    p: Scalar
    q: Scalar
    r: Scalar
    sink: Scalar


class Steering(NamedTuple):
    """fins (n,) : angles asked [rad].   granted (3,) : the virtual rudder, elevator, aileron they amount to.

    memory_rates (3,) : of the trims [rad/s] and the guidance integral [m/s].   heading : wanted [rad], psi where none
    is ordered.
    """

    fins: list[Scalar]
    granted: list[Scalar]
    memory_rates: list[Scalar]
    heading: Scalar


def steer(pilot: Any, tail: Allocation, orders: Any, seen: Any, memory: Vector, ops: Ops) -> Steering:
    """Command of the pilot under ``orders``.

    Without a pilot (``orders.piloted`` 0) the command is the ordered rudder and elevator, rudder first, and the memory
    stands still. What is open loop is served before what the pilot adds.

    Parameters
    ----------
    pilot : gains, see ``GAINS``.   tail : mixing, limits and known damage of the fins.   orders : see ``Orders``.
    seen : see ``Seen``.   memory (3,) : trims of rudder and elevator [rad], integral of the guidance [m].

    Source     perron (heading and depth from rudder and elevator); cascade of the LAUV (THEORY section 7).
    """
    steering = orders.piloted * ops.fmax(orders.steer, orders.track)
    diving = orders.piloted * orders.dive
    sight, drifting = line_of_sight(orders, seen.x, seen.y, memory[2], ops)
    wanted = _choose(steering, _choose(orders.track, sight, orders.heading), seen.psi)
    off = wrapped(wanted - seen.psi, ops)
    deep = orders.depth - seen.z
    s = schedule(pilot, seen.u, ops)
    rudder, turning = _rudder(pilot, s, off, orders, seen, memory[0], ops)
    elevator, pitching = _elevator(pilot, s, deep, orders, seen, memory[1], ops)
    aileron = -s * (pilot.roll * ops.sin(seen.phi) + pilot.roll_rate * seen.p)
    asked = [
        _choose(steering, rudder, orders.rudder),
        _choose(diving, elevator, orders.elevator),
        orders.piloted * orders.damp_roll * aileron,
    ]
    fins, granted = allocate(asked, tail, (1.0 - steering * (1.0 - diving), steering), ops)
    over = [want - got for want, got in zip(asked, granted, strict=True)]
    if tail.damage is not None:
        # The shared command is met to the weight of the fin angles, which must not count as a limit.
        over = [x * ops.positive(ops.fabs(x) - _MET) for x in over]
    lag = (orders.turn - seen.r) / ops.fmax(pilot.heading, _STANDSTILL)
    to_heading = pilot.heading_integral * clamp(_choose(orders.turning, lag, off), pilot.heading_band, ops)
    to_depth = pilot.depth_integral * clamp(deep, pilot.depth_band, ops)
    rates = [
        _trim_rate(to_heading, steering * turning, memory[0], over[0], pilot.unwind, ops),
        _trim_rate(to_depth, diving * pitching, memory[1], over[1], pilot.unwind, ops),
        orders.piloted * orders.track * drifting,
    ]
    return Steering(fins, granted, rates, wanted)


def schedule(pilot: Any, u: Scalar, ops: Ops) -> Scalar:
    """(speed / u)^2 with u [m/s] not below ``SLOWEST`` times the design speed; 1 for a pilot that is not scheduled."""
    ratio = pilot.speed / ops.fmax(u, SLOWEST * pilot.speed)
    return _choose(pilot.scheduled, ratio * ratio, 1.0)


def authority(pilot: Any, u: Scalar, ops: Ops) -> Scalar:
    """Share of the depth order that is followed at ``u`` [m/s]; 1 where the elevator has no inversion speed.

    It is 0 at the elevator's inversion speed and 1 from 1.05 times it on. A craft slowed down by a turn would
    otherwise be steered the wrong way in depth.
    """
    above = 20.0 * (u / ops.fmax(pilot.reversal, _STANDSTILL) - 1.0)
    return ops.fmax(ops.fmin(ops.fmax(above, 0.0), 1.0), 1.0 - ops.positive(pilot.reversal))


def wrapped(angle: Scalar, ops: Ops) -> Scalar:
    """``angle`` [rad] brought to -pi..pi, up to round-off; an angle within is returned as it is."""
    return angle - 2.0 * pi * ops.floor((angle + pi) / (2.0 * pi))


def clamp(value: Scalar, largest: Scalar, ops: Ops) -> Scalar:
    """``value`` brought to -largest..largest."""
    return ops.fmax(ops.fmin(value, largest), -largest)


def _choose(switch: Scalar, on: Scalar, off: Scalar) -> Scalar:
    """``on`` where ``switch`` is 1, ``off`` where it is 0; both must be finite."""
    return switch * on + (1.0 - switch) * off


def _rudder(
    pilot: Any, s: Scalar, off: Scalar, orders: Any, seen: Any, trim: Scalar, ops: Ops
) -> tuple[Scalar, Scalar]:
    """Rudder asked for [rad] at a heading error ``off`` [rad]; 1 while the trim may integrate, else 0."""
    turn = pilot.heading * off
    free = 1.0 - ops.positive(ops.fabs(turn) - pilot.turn_limit) * (1.0 - orders.turning)
    turn = _choose(orders.turning, orders.turn, clamp(turn, pilot.turn_limit, ops))
    return -s * (pilot.yaw_rate * (seen.r - turn) + pilot.sway * seen.v) + trim, free


def _elevator(
    pilot: Any, s: Scalar, deep: Scalar, orders: Any, seen: Any, trim: Scalar, ops: Ops
) -> tuple[Scalar, Scalar]:
    """Elevator asked for [rad] at a depth error ``deep`` [m]; 1 while the trim may integrate, else 0."""
    followed = authority(pilot, seen.u, ops)
    pitch = followed * (pilot.depth_rate * seen.sink - pilot.depth * deep)
    free = (1.0 - ops.positive(ops.fabs(pitch) - pilot.pitch_limit)) * (1.0 - ops.positive(1.0 - followed))
    pitch = _choose(orders.pitching, orders.pitch, clamp(pitch, pilot.pitch_limit, ops))
    asked = pilot.pitch_rate * seen.q + pilot.pitch * seen.theta - pilot.pitch_order * pitch + pilot.heave * seen.w
    return -s * asked + trim, free * (1.0 - orders.pitching)


def _trim_rate(wanted: Scalar, free: Scalar, trim: Scalar, over: Scalar, unwind: Scalar, ops: Ops) -> Scalar:
    """Rate of a trim [rad/s] from the rate ``wanted`` by its error and the command ``over`` the fins' limits [rad].

    While a reference is at its limit (``free`` 0) the trim is held. While a fin is at its limit the trim moves back
    only, and loses in ``unwind`` seconds what it adds beyond the limit. Up to ``ROUND_OFF`` beyond the limit counts as
    within: the sharing of a command among fins is exact to some 1e-16 rad only.

    Source     fossen2021, ch. 15, integrator anti-windup by back-calculation.
    Departure  Back-calculation takes off no more than the trim itself has added, so that a large step does not spoil
               the trim.
    """
    full = ops.positive(ops.fabs(over) - ROUND_OFF)
    back = ops.positive(-wanted * over)
    # The part of ``over`` that has the sign of the trim and is no larger than it.
    added = ops.fmax(ops.fmin(over, trim), 0.0) + ops.fmin(ops.fmax(over, trim), 0.0)
    return free * ((1.0 - full * (1.0 - back)) * wanted - full * added / unwind)
