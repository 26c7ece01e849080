"""What lies between two windows: accelerations that no term holds, and water that changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.windows import STATES, Windows
from towtank.frames import Array, rotation

MOTION = 12
LINEAR, ANGULAR = [0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]
"""Places of position and velocity, of attitude and rates."""
WATER = slice(MOTION, len(STATES))
HURRY = 1.5
"""Power of the factor of a step: the repeated rule comes near its end by constant shares."""
KNOWN = 5.0
"""Most standard deviations that a factor e of a variance counts: a share of 4 % of it changes no interval."""
LEAST, MOST = 1e-3, 1e4
"""Factors by which a density may leave its starting value in all."""


@dataclass(frozen=True)
class Noise:
    """Densities ``push`` [m2/s3] and ``twist`` [rad2/s3], and variances of the turbulence, level and down [m2/s2]."""

    push: float
    twist: float
    level: float
    down: float

    @property
    def scales(self) -> Array:
        """The four, (4,)."""
        return np.array([self.push, self.twist, self.level, self.down])

    @property
    def water(self) -> Array:
        """Variances (3,) of the turbulence to the north, to the east, down."""
        return np.array([self.level, self.level, self.down])


def noise_of(settings: Settings) -> Noise:
    """The noise that a search starts from."""
    return Noise(settings.push, settings.twist, settings.turbulence**2, settings.turbulence**2)


@dataclass(frozen=True)
class Links:
    """Inverse covariances between the windows of a record, for noise of the scale one.

    linear, angular (W, 6, 6) : of position and velocity, of attitude and rates.   keep (W,) : share of the turbulence
    that is left after each window.
    """

    linear: Array
    angular: Array
    keep: Array

    def motion(self, noise: Noise) -> Array:
        """Inverse covariance (W, 12, 12) of the motion."""
        out = np.zeros((len(self.keep), MOTION, MOTION))
        out[:, np.array(LINEAR)[:, None], LINEAR] = self.linear / noise.push
        out[:, np.array(ANGULAR)[:, None], ANGULAR] = self.angular / noise.twist
        return out

    def water(self, noise: Noise) -> Array:
        """Inverse variances (W, 3) of the change of the water over each window."""
        return np.asarray(1.0 / np.outer(1.0 - self.keep**2, noise.water))


def links_of(windows: Windows, settings: Settings) -> Links:
    """The links about the attitude in which the search starts.

    Source     barshalom2001, ch. 6: white acceleration of density S over T gives the velocity S T, the position
               S T3 / 3, both together S T2 / 2. Velocities are in body axes, positions in the world's: the pair is
               turned by J1, that of attitude and rates by J2 (perron, eq. 2.11).
    """
    T = windows.ticks * windows.drive.clock.tick
    angles = windows.guess[:, 3:6]
    J1, J2 = rotation(angles), _euler(angles)

    def inverse(J: Array) -> Array:
        out = np.zeros((len(T), 6, 6))
        out[:, :3, :3] = (T**3 / 3.0)[:, None, None] * (J @ np.swapaxes(J, 1, 2))
        out[:, :3, 3:] = (T**2 / 2.0)[:, None, None] * J
        out[:, 3:, :3] = np.swapaxes(out[:, :3, 3:], 1, 2)
        out[:, 3:, 3:] = T[:, None, None] * np.eye(3)
        return np.asarray(np.linalg.inv(out))

    return Links(inverse(J1), inverse(J2), np.exp(-T / settings.memory))


def _euler(angles: Array) -> Array:
    """J2 (N, 3, 3) of phi, theta, psi (N, 3); the pitch is held below 80 deg, where the matrix only scales noise."""
    sf, cf = np.sin(angles[:, 0]), np.cos(angles[:, 0])
    theta = np.clip(angles[:, 1], -1.4, 1.4)
    tt, ct, zero = np.tan(theta), np.cos(theta), np.zeros(len(angles))
    rows = [[zero + 1.0, sf * tt, cf * tt], [zero, cf, -sf], [zero, sf / ct, cf / ct]]
    return np.moveaxis(np.array(rows), -1, 0)


def learned(now: Noise, first: Noise, squares: Array, free: Array) -> tuple[Noise, float]:
    """The noise of largest evidence, one step on; and the step over what the record tells of the noise.

    squares (4,) : of what each kind of link misses, over its present variance.   free (4,) : how many of its links are
    free of the unknowns: their number less what the unknowns fit of them. A variance of ``free`` numbers is known to a
    share of root 2 / free.

    Source     mackay1992, sec. 4: variance = squares / free, repeated.
    Valid      Within ``LEAST`` and ``MOST`` of the values at the start.
    """
    count = np.maximum(free, 1e-9)
    factor = np.where(free > 0.0, np.clip((squares / count) ** HURRY, 0.02, 50.0), 1.0)
    scales = np.clip(now.scales * factor, LEAST * first.scales, MOST * first.scales)
    moved = np.abs(np.log(scales / now.scales)) * np.minimum(np.sqrt(0.5 * count), KNOWN)
    return Noise(*scales.tolist()), float(moved.max())
