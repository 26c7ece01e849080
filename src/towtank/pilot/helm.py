"""What moves the fins in a trial: fixed angles, the pilot, or a mixture. An adaptor from a trial's words to orders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, cos, hypot, sin

from towtank.model.algebra import MATH
from towtank.pilot.allocation import Allocation
from towtank.pilot.guidance import across, along, line, line_of_sight
from towtank.pilot.law import MEMORY, NO_PILOT, Pilot, Seen, steer
from towtank.pilot.orders import Orders

EXTRA = MEMORY
"""States of the helm beside the craft's: trim of the rudder, trim of the elevator, integral of the guidance."""

Command = tuple[float, float, float]
"""Virtual rudder, elevator, aileron [rad]."""


@dataclass(frozen=True)
class LineOfSight:
    """Follow the straight leg from ``start`` to ``end``, (north, east) [m] each.

    lookahead [m] : distance ahead at which the craft aims for the leg.   gain [1/s] : of the integral that takes out
    the drift that is left.   crab [rad] : angle between course and heading that a known cross current asks for.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    lookahead: float
    gain: float
    crab: float = 0.0

    @property
    def course(self) -> float:
        """Course of the leg [rad]."""
        return atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def length(self) -> float:
        """Length of the leg [m]."""
        return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def entries(self) -> dict[str, float]:
        """The entries of ``Orders`` for this leg."""
        return line(self.start, self.end, self.lookahead, self.gain, self.crab)

    @cached_property
    def orders(self) -> Orders:
        """Orders that hold this leg and nothing else."""
        return Orders(**self.entries)

    def along_and_across(self, north: float, east: float) -> tuple[float, float]:
        """Distance made good along the leg and distance off it to starboard [m]."""
        return along(self.orders, north, east, MATH), across(self.orders, north, east, MATH)


@dataclass(frozen=True)
class Helm:
    """Commands of one leg of a trial.

    rudder, elevator [rad] : used where the pilot has no order.   heading [rad], depth [m] : orders to the pilot, or
    None.   guidance : gives the heading instead.   damp_roll : the pilot damps roll with what the fins have left.
    current (3,) : velocity of the water [m/s, NED].
    """

    allocation: Allocation
    pilot: Pilot | None = None
    rudder: float = 0.0
    elevator: float = 0.0
    heading: float | None = None
    depth: float | None = None
    guidance: LineOfSight | None = None
    damp_roll: bool = True
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def orders(self) -> Orders:
        """The same commands as numbers."""
        track = self.guidance.entries if self.guidance else {}
        steered = {} if self.heading is None or self.guidance else {"steer": 1.0, "heading": self.heading}
        dived = {} if self.depth is None else {"dive": 1.0, "depth": self.depth}
        return Orders(
            piloted=0.0 if self.pilot is None else 1.0, rudder=self.rudder, elevator=self.elevator,
            damp_roll=float(self.damp_roll), **track, **steered, **dived,
        )  # fmt: skip

    def wanted_heading(self, state: Sequence[float], integral: float) -> float | None:
        """Heading wanted [rad], or None where none is ordered."""
        if self.guidance is None:
            return self.heading
        return float(line_of_sight(self.orders, state[0], state[1], integral, MATH)[0])

    def water_speed(self, state: Sequence[float]) -> float:
        """Speed ahead through the water [m/s], for the pilot's schedule: what a log shows."""
        north, east, down = self.current
        theta, psi = state[4], state[5]
        return state[6] - cos(theta) * (cos(psi) * north + sin(psi) * east) + sin(theta) * down

    def order(self, state: Sequence[float], extra: Sequence[float]) -> tuple[Command, tuple[float, float, float]]:
        """Granted virtual command [rad] and rates of the helm's own states, for the craft's ``state`` (12 + n)."""
        x, y, z, phi, theta, psi = state[:6]
        p, q, r = state[9:12]
        seen = Seen(x, y, z, phi, theta, psi, self.water_speed(state), p, q, r, sinking(state))
        a = self.allocation
        out = steer(self.pilot or NO_PILOT, a.rows, a.limits, self.orders, seen, extra, MATH)
        (rudder, elevator, aileron), (r1, r2, r3) = out.granted, out.memory_rates
        return (rudder, elevator, aileron), (r1, r2, r3)


def sinking(state: Sequence[float]) -> float:
    """Rate of depth zdot [m/s]: what a pressure sensor gives."""
    phi, theta, u, v, w = state[3], state[4], state[6], state[7], state[8]
    return -u * sin(theta) + cos(theta) * (v * sin(phi) + w * cos(phi))
