"""Hull profiles: meridians of bodies of revolution, in metres from the nose aft. Each implements ``Profile``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from towtank.frames import Array

FOOT = 0.3048
"""Metres in a foot; the SUBOFF report is in feet."""

SUBOFF_LENGTH = 14.291667 * FOOT
"""Overall length [m] of the SUBOFF models as built."""


def _inside(x: Array | float, length: float, radius: Callable[[Array], Array]) -> Array:
    """``radius`` of the stations within 0..length, zero elsewhere; keeps the shape of ``x``."""
    x = np.asarray(x, dtype=float)
    within = (x >= 0.0) & (x <= length)
    return np.where(within, radius(np.clip(x, 0.0, length)), 0.0)


@dataclass(frozen=True)
class Myring:
    """Nose of ``nose`` metres, cylinder of ``middle``, tail of ``tail``, cut at both ends by the offsets.

    ``tail_angle`` [rad]: half angle of the uncut tail at its point. ``nose_offset``, ``tail_offset`` [m]: what is cut
    off the analytic nose and tail; a cut end is a flat disc.
    """

    nose: float
    middle: float
    tail: float
    diameter: float
    tail_angle: float
    exponent: float = 2.0
    nose_offset: float = 0.0
    tail_offset: float = 0.0

    @property
    def kind(self) -> str:
        """Name of the family."""
        return "myring"

    @property
    def length(self) -> float:
        """Overall length [m] after the cuts."""
        return self.nose + self.middle + self.tail - self.nose_offset - self.tail_offset

    def radius(self, x: Array | float) -> Array:
        """Radius [m] at the distances ``x`` [m] aft of the nose; zero outside 0..length.

        Source     myring1976, nose and tail forms; prestero2001 for the offsets.
        Valid      tail_angle >= 0 and the uncut tail at least as long as the cut.
        """
        return _inside(x, self.length, self._radius)

    def _radius(self, x: Array) -> Array:
        a, b, c, d, n = self.nose, self.middle, self.tail, self.diameter, self.exponent
        x = x + self.nose_offset
        slope = np.tan(self.tail_angle)
        nose = 0.5 * d * np.clip(1.0 - ((np.minimum(x, a) - a) / a) ** 2, 0.0, None) ** (1.0 / n)
        t = np.maximum(x - a - b, 0.0)
        tail = 0.5 * d - (1.5 * d / c**2 - slope / c) * t**2 + (d / c**3 - slope / c**2) * t**3
        return np.where(x < a, nose, np.clip(tail, 0.0, None))


@dataclass(frozen=True)
class Suboff:
    """DARPA SUBOFF axisymmetric hull, scaled to ``length`` [m] overall (default: as built, 4.356 m)."""

    length: float = SUBOFF_LENGTH

    @property
    def kind(self) -> str:
        """Name of the family."""
        return "suboff"

    def radius(self, x: Array | float) -> Array:
        """Radius [m] at the distances ``x`` [m] aft of the nose; zero outside 0..length.

        Source     groves1989, hull equations and table 1.
        Departure  None. The first bow term has the factor (0.3 x - 1)^4; some public listings print a cube there.
        """
        return _inside(x, self.length, self._radius)

    def _radius(self, x: Array) -> Array:
        scale = self.length / SUBOFF_LENGTH
        x = x / (FOOT * scale)
        rmax, rh, k0, k1 = 5.0 / 6.0, 0.1175, 10.0, 44.6244
        b = np.minimum(x, 3.333333)
        a = 0.3 * b - 1.0
        bow = 1.126395101 * b * a**4 + 0.442874707 * b**2 * a**3 + 1.0 - a**4 * (1.2 * b + 1.0)
        s = np.clip((13.979167 - x) / 3.333333, 0.0, 1.0)
        aft = np.polynomial.polynomial.polyval(
            s,
            [
                rh**2,
                0.0,
                rh * k0,
                20.0 - 20.0 * rh**2 - 4.0 * rh * k0 - k1 / 3.0,
                -45.0 + 45.0 * rh**2 + 6.0 * rh * k0 + k1,
                36.0 - 36.0 * rh**2 - 4.0 * rh * k0 - k1,
                -10.0 + 10.0 * rh**2 + rh * k0 + k1 / 3.0,
            ],
        )
        cap = 1.0 - (3.2 * np.maximum(x, 13.979167) - 44.733333) ** 2
        r = np.where(
            x < 3.333333,
            np.clip(bow, 0.0, None) ** (1.0 / 2.1),
            np.where(x <= 13.979167, np.sqrt(np.clip(aft, 0.0, None)), rh * np.sqrt(np.clip(cap, 0.0, None))),
        )
        return np.asarray(rmax * r * FOOT * scale)


@dataclass(frozen=True)
class Ellipsoid:
    """Prolate spheroid of ``length`` and ``diameter`` [m]."""

    length: float
    diameter: float

    @property
    def kind(self) -> str:
        """Name of the family."""
        return "ellipsoid"

    def radius(self, x: Array | float) -> Array:
        """Radius [m] at the distances ``x`` [m] aft of the nose; zero outside 0..length.

        Source     lamb1932, art. 114: meridian of an ellipsoid of revolution.
        """
        return _inside(x, self.length, self._radius)

    def _radius(self, x: Array) -> Array:
        return np.asarray(0.5 * self.diameter * np.sqrt(np.clip(1.0 - (2.0 * x / self.length - 1.0) ** 2, 0.0, None)))


@dataclass(frozen=True)
class Offsets:
    """Hull through a table of offsets: ``stations`` [m] aft of the nose, ascending from 0, and ``radii`` [m]."""

    stations: tuple[float, ...]
    radii: tuple[float, ...]

    @property
    def kind(self) -> str:
        """Name of the family."""
        return "offsets"

    @property
    def length(self) -> float:
        """Overall length [m]: the last station."""
        return self.stations[-1]

    @cached_property
    def _area(self) -> Callable[[Array], Array]:
        from scipy.interpolate import PchipInterpolator

        interpolator: Callable[[Array], Array] = PchipInterpolator(self.stations, np.square(self.radii))
        return interpolator

    def radius(self, x: Array | float) -> Array:
        """Radius [m] at the distances ``x`` [m] aft of the nose; zero outside 0..length.

        The radius squared, so the sectional area, is interpolated: a round nose keeps its vertical tangent and no
        station overshoots its neighbours.

        Source     fritschcarlson1980, monotone piecewise cubic interpolation.
        """
        return _inside(x, self.length, lambda s: np.sqrt(np.clip(self._area(s), 0.0, None)))
