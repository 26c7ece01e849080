"""The motion of a captive test sampled in time."""

from __future__ import annotations

from dataclasses import dataclass

from towtank.frames import Array


@dataclass(frozen=True)
class History:
    """Samples of a prescribed motion; N samples.

    time (N,) [s]; position (N, 3) [m, NED] of the body origin; attitude (N, 3) phi, theta, psi [rad];
    nu (N, 6) body velocities [m/s, rad/s] through water at rest; nudot (N, 6) their time derivatives in body axes.
    """

    time: Array
    position: Array
    attitude: Array
    nu: Array
    nudot: Array

    @property
    def steady(self) -> bool:
        """True when nothing changes along the record, so that one sample says all."""
        return bool(abs(self.nudot).max() == 0.0)
