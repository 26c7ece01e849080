"""The pilot as a continuous law: heading and depth cascade, roll damping, limits, anti-windup, schedule with speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import pi, sin

from towtank.pilot.allocation import Command

SLOWEST = 0.3
"""Smallest fraction of the design speed at which the schedule still raises the gains; 1/0.3^2 is a factor of 11."""


@dataclass(frozen=True)
class Pilot:
    """Gains designed for ``speed`` [m/s]. Commands are virtual angles [rad]; SNAME: +rudder turns to port.

    rudder   = -schedule yaw_rate (r - r_ref) + trim,     r_ref     = heading (psi_ref - psi), at most turn_limit
    elevator = -schedule (pitch_rate q + pitch theta - pitch_order theta_ref) + trim,
                                      theta_ref = depth_rate zdot - depth (z_ref - z), at most pitch_limit from trim
    aileron  = -schedule (roll phi + roll_rate p)
    The two trims integrate heading_integral (psi_ref - psi) and depth_integral (z_ref - z).
    schedule = (speed / u)^2, because the fins' effect grows with u^2.

    yaw_rate [s], heading [1/s], heading_integral [1/s], turn_limit [rad/s], pitch_rate [s], pitch [-], pitch_order [-],
    depth [rad/m], depth_rate [rad s/m], depth_integral [rad/(m s)], pitch_limit [rad], roll [-], roll_rate [s].
    unwind [s] : time in which a saturated fin takes back what its trim cannot use.
    heading_band [rad], depth_band [m] : largest errors the trims integrate, so that a large step does not fill them.
    reversal [m/s] : speed below which the elevator acts reversed on depth, 0 if none.
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
    unwind: float = 1.0
    heading_band: float = 0.0
    depth_band: float = 0.0
    reversal: float = 0.0
    eigenvalues: Mapping[str, tuple[complex, ...]] = field(default_factory=dict)
    margins: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def schedule(self, u: float) -> float:
        """(speed / u)^2 with u [m/s] not below ``SLOWEST`` times the design speed."""
        ratio = self.speed / max(u, SLOWEST * self.speed)
        return ratio * ratio

    def authority(self, u: float) -> float:
        """Share of the depth order that is followed at ``u`` [m/s].

        It is 0 at the elevator's inversion speed and 1 from 1.05 times it on. A craft slowed down by a turn would
        otherwise be steered the wrong way in depth.
        """
        if self.reversal <= 0.0 or self.reversal >= self.speed:
            return 1.0
        return max(0.0, min(1.0, 20.0 * (u / self.reversal - 1.0)))

    def rudder(self, state: Sequence[float], heading: float, trim: float) -> tuple[float, bool]:
        """Rudder asked for [rad], and whether the turn is at its limit."""
        turn = self.heading * wrapped(heading - state[5])
        limited = abs(turn) > self.turn_limit
        turn = max(-self.turn_limit, min(self.turn_limit, turn))
        return -self.schedule(state[6]) * self.yaw_rate * (state[11] - turn) + trim, limited

    def elevator(self, state: Sequence[float], rate: float, depth: float, trim: float) -> tuple[float, bool]:
        """Elevator asked for [rad], and whether the pitch is at its limit; ``rate`` is zdot [m/s]."""
        pitch = self.authority(state[6]) * (self.depth_rate * rate - self.depth * (depth - state[2]))
        limited = abs(pitch) > self.pitch_limit or self.authority(state[6]) < 1.0
        pitch = max(-self.pitch_limit, min(self.pitch_limit, pitch))
        asked = self.pitch_rate * state[10] + self.pitch * state[4] - self.pitch_order * pitch
        return -self.schedule(state[6]) * asked + trim, limited

    def aileron(self, state: Sequence[float]) -> float:
        """Aileron asked for [rad]."""
        return -self.schedule(state[6]) * (self.roll * sin(state[3]) + self.roll_rate * state[9])

    def trim_rates(
        self,
        errors: tuple[float, float],
        limited: tuple[bool, bool],
        trims: tuple[float, float],
        asked: Command,
        granted: Command,
    ) -> tuple[float, float]:
        """Rates [rad/s] of the rudder's and the elevator's trim.

        errors : of heading [rad] and depth [m]. While a reference is at its limit the trim is held. While a fin is at
        its limit the trim moves back only, and loses in ``unwind`` seconds what it adds beyond the limit.

        Source     fossen2021, ch. 15, integrator anti-windup by back-calculation.
        Departure  Back-calculation takes off no more than the trim itself has added, so that a large step does not
                   spoil the trim.
        """
        gains = (self.heading_integral, self.depth_integral)
        bands = (self.heading_band, self.depth_band)
        out = []
        for gain, band, error, held, trim, want, got in zip(
            gains, bands, errors, limited, trims, asked, granted, strict=False
        ):
            rate = 0.0 if held else gain * max(-band, min(band, error))
            excess = want - got
            if excess != 0.0:
                rate = rate if rate * excess < 0.0 else 0.0
                if not held and excess * trim > 0.0:
                    rate -= (excess if abs(excess) < abs(trim) else trim) / self.unwind
            out.append(rate)
        return out[0], out[1]


def wrapped(angle: float) -> float:
    """``angle`` [rad] brought to -pi..pi."""
    return (angle + pi) % (2.0 * pi) - pi
