"""Line of sight: the heading that brings a craft onto a straight leg and keeps it there in a current."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, sin


@dataclass(frozen=True)
class LineOfSight:
    """Follow the straight leg from ``start`` to ``end``, (north, east) [m] each.

    lookahead [m] : distance ahead at which the craft aims for the leg.   gain [1/m] : of the integral that takes out
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

    def along_and_across(self, north: float, east: float) -> tuple[float, float]:
        """Distance made good along the leg and distance off it to starboard [m]."""
        x, y, a = north - self.start[0], east - self.start[1], self.course
        return x * cos(a) + y * sin(a), y * cos(a) - x * sin(a)

    def heading(self, north: float, east: float, integral: float) -> tuple[float, float]:
        """Heading wanted [rad] and the rate of the integral [m/s per unit speed] at a position.

        psi = course - crab - atan((y + integral) / lookahead)
        rate = gain lookahead^2 y / (lookahead^2 + (y + integral)^2)

        Source     fossen2021, ch. 12, integral line-of-sight guidance.
        Departure  The crab angle stands beside the integral. The integral is kept in metres of offset, so that it can
                   be read as the drift it balances; the mission scales its gain with the speed.
        Valid      Currents below the speed of the craft.
        """
        _, y = self.along_and_across(north, east)
        aim = y + integral
        square = self.lookahead * self.lookahead
        return self.course - self.crab - atan(aim / self.lookahead), self.gain * square * y / (square + aim * aim)
