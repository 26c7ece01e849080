"""What moves the fins in a trial: fixed angles, the pilot, or a mixture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Protocol

from towtank.pilot.allocation import (
    ELEVATOR_FIRST,
    RUDDER_FIRST,
    YAW_AND_PITCH_FIRST,
    Allocation,
    Command,
    Order,
)
from towtank.pilot.law import Pilot, wrapped

EXTRA = 3
"""States of the helm beside the craft's: trim of the rudder, trim of the elevator, integral of the guidance."""


class Guidance(Protocol):
    """Where to head. Implemented by the line of sight in ``pilot.guidance``."""

    def heading(self, north: float, east: float, integral: float) -> tuple[float, float]:
        """Heading wanted [rad] and rate of the guidance integral, at a position [m] and an integral."""


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
    guidance: Guidance | None = None
    damp_roll: bool = True
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def wanted_heading(self, state: Sequence[float], integral: float) -> tuple[float | None, float]:
        """Heading wanted [rad] or None, and the rate of the guidance integral."""
        if self.guidance is None:
            return self.heading, 0.0
        return self.guidance.heading(state[0], state[1], integral)

    def water_speed(self, state: Sequence[float]) -> float:
        """Speed ahead through the water [m/s], for the pilot's schedule: what a log shows."""
        north, east, down = self.current
        theta, psi = state[4], state[5]
        return state[6] - cos(theta) * (cos(psi) * north + sin(psi) * east) + sin(theta) * down

    def order(self, state: Sequence[float], extra: Sequence[float]) -> tuple[Command, tuple[float, float, float]]:
        """Granted virtual command [rad] and rates of the helm's own states, for the craft's ``state`` (12 + n)."""
        pilot = self.pilot
        if pilot is None:
            return self.allocation((self.rudder, self.elevator, 0.0), RUDDER_FIRST), (0.0, 0.0, 0.0)
        heading, guiding = self.wanted_heading(state, extra[2])
        falling = sinking(state)
        state = [*state[:6], self.water_speed(state), *state[7:]]
        rudder, elevator, held = self.rudder, self.elevator, [True, True]
        errors = [0.0, 0.0]
        priority: Order = YAW_AND_PITCH_FIRST
        if heading is not None:
            rudder, held[0] = pilot.rudder(state, heading, extra[0])
            errors[0] = wrapped(heading - state[5])
        else:
            priority = RUDDER_FIRST
        if self.depth is not None:
            elevator, held[1] = pilot.elevator(state, falling, self.depth, extra[1])
            errors[1] = self.depth - state[2]
        elif heading is not None:
            priority = ELEVATOR_FIRST
        asked = (rudder, elevator, pilot.aileron(state) if self.damp_roll else 0.0)
        granted = self.allocation(asked, priority)
        rates = pilot.trim_rates((errors[0], errors[1]), (held[0], held[1]), (extra[0], extra[1]), asked, granted)
        return granted, (*rates, guiding)


def sinking(state: Sequence[float]) -> float:
    """Rate of depth zdot [m/s]: what a pressure sensor gives."""
    phi, theta, u, v, w = state[3], state[4], state[6], state[7], state[8]
    return -u * sin(theta) + cos(theta) * (v * sin(phi) + w * cos(phi))
