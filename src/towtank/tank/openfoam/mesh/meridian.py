"""The meridian plane: outline of the hull, and lines that leave it at right angles and end far away.

Lines are drawn in confocal coordinates x + i r = x0 + c cosh(mu + i nu), a conformal map, so a line that starts along
d nu = -(d mu / d nu) d mu is normal to the hull, and lines of nu = const meet the far ellipse at right angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from towtank.craft.craft import Profile
from towtank.craft.integrals import stations
from towtank.frames import Array

_FINE = 6001
_DISC = 400
_DRAWN = 1200
"""Points that draw a line; the first lie 1e-7 of its length apart."""
_RELAX = 1.3
"""Lines turn into nu = const over this times D/L in mu, so over about a radius. Judgement: shorter turns skew cells."""
_STEEPEST = 3.0
"""Largest |d mu / d nu| followed: a line leaves a steeper wall obliquely."""


@dataclass(frozen=True)
class Outline:
    """Fine curve of the hull. ``s`` (n,) arc from the nose [m], ``x`` aft of the nose, ``r`` radius [m].

    ``mu``, ``nu``: confocal coordinates; ``slope``: d mu / d nu, smoothed. ``centre``, ``focal`` [m]: of the foci.
    ``blunt``: radius [m] of the flat disc at nose and tail, zero for a round or pointed end.
    """

    s: Array
    x: Array
    r: Array
    mu: Array
    nu: Array
    slope: Array
    centre: float
    focal: float
    relax: float
    far: float
    blunt: tuple[float, float]

    @property
    def total(self) -> float:
        """Arc from nose to tail [m]."""
        return float(self.s[-1])

    def radius(self, x: Array) -> Array:
        """Radius [m] at the distances ``x`` aft of the nose; at a flat end that of its edge."""
        round_part = slice(_DISC if self.blunt[0] else 0, len(self.x) - (_DISC if self.blunt[1] else 0))
        return np.asarray(np.interp(x, self.x[round_part], self.r[round_part]))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Distance aft of the nose and radius [m] of the points at arc ``s``."""
        return np.interp(s, self.s, self.x), np.interp(s, self.s, self.r)

    def draw(self, s: float) -> Array:
        """Line (n, 2) of (x aft, r) [m] from the hull at arc ``s`` to the far ellipse."""
        mu, nu, slope = (float(np.interp(s, self.s, v)) for v in (self.mu, self.nu, self.slope))
        d = (self.far - mu) * np.linspace(0.0, 1.0, _DRAWN) ** 2.2
        z = self.focal * np.cosh(mu + d + 1j * (nu + slope * self.relax * np.expm1(-d / self.relax))) + self.centre
        line = np.stack([z.real, np.abs(z.imag)], axis=1)
        line[0] = self.at(np.array(s))
        if s <= 0.0 or s >= self.total:
            line[:, 1] = 0.0
        return line


def outline(profile: Profile, far: float) -> Outline:
    """Outline of ``profile`` for an outer boundary ``far`` [m] from the axis.

    The foci lie where the osculating parabola through the ends and a fiftieth of the length has them, so that the
    hull is close to a line of mu = const. Flat ends are part of the curve.
    """
    length = profile.length
    x = stations(profile, _FINE)
    r = profile.radius(x)
    blunt = (float(r[0]), float(r[-1]))
    blunt = (blunt[0] if blunt[0] > 1e-3 * r.max() else 0.0, blunt[1] if blunt[1] > 1e-3 * r.max() else 0.0)
    r[0], r[-1] = blunt
    nose, tail = (np.linspace(0.0, 1.0, _DISC, endpoint=False) * end for end in blunt)
    if blunt[0]:
        x, r = np.r_[np.zeros(_DISC), x], np.r_[nose, r]
    if blunt[1]:
        x, r = np.r_[x, np.full(_DISC, length)], np.r_[r, tail[::-1]]
    s = np.r_[0.0, np.cumsum(np.hypot(np.diff(x), np.diff(r)))]
    near = 0.02 * length
    f = [float(np.clip(profile.radius(np.array(at)) ** 2 / (4.0 * near), 1e-3 * length, 0.03 * length))
         for at in (near, length - near)]  # fmt: skip
    focal, centre = 0.5 * (length - f[0] - f[1]), 0.5 * (length + f[0] - f[1])
    w = np.arccosh((x - centre + 1j * r) / focal + 0j)
    mu, nu = np.abs(w.real), np.abs(w.imag)
    nu[0], nu[-1] = np.pi, 0.0
    far_mu = float(np.arcsinh(far / focal))
    relax = _RELAX * 2.0 * float(r.max()) / length
    slope = _smooth_slope(mu, nu, relax)
    return Outline(s, x, r, mu, nu, slope, centre, focal, relax, far_mu, blunt)


def _smooth_slope(mu: Array, nu: Array, relax: float) -> Array:
    """Slope d mu / d nu along the curve, smoothed just enough that neighbouring lines do not meet."""
    even = np.linspace(nu[0], nu[-1], 8001)
    decreasing = np.minimum.accumulate(nu)
    raw = np.gradient(np.interp(-even, -decreasing, mu), even)
    raw = np.clip(raw, -_STEEPEST, _STEEPEST)
    raw[[0, -1]] = 0.0
    width = 0.01 / (np.pi / 8000)
    while True:
        # Odd reflection: the outline is symmetric about the axis, so the slope changes sign across the poles.
        wide = np.r_[-raw[:0:-1], raw, -raw[-2::-1]]
        slope = gaussian_filter1d(wide, width)[len(raw) - 1 : 2 * len(raw) - 1]
        # Lines keep their order when 1 - relax d slope / d nu stays positive; half of it is left.
        if relax * np.gradient(slope, even).max() < 0.5 or width > 2000:
            return np.asarray(np.interp(-nu, -even, slope))
        width *= 1.3


def mesh_lines(outline: Outline, s: Array, radial: Callable[[float, Array, Array], Array]) -> Array:
    """Points (n, out + 1, 2) of (x aft, r) on the lines from the arcs ``s`` (n,).

    ``radial(s, arc, r)`` gives the distances (out + 1,) from the hull along the line whose drawn points lie at ``arc``
    with radius ``r``.
    """
    points = []
    for start in s:
        line = outline.draw(float(start))
        arc = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
        at = radial(float(start), arc, line[:, 1])
        points.append(np.stack([np.interp(at, arc, line[:, 0]), np.interp(at, arc, line[:, 1])], axis=1))
    return np.array(points)


def cap_limit(outline: Outline, end: int) -> float:
    """Longest arc [m] from the nose (end 0) or tail (end 1) over which the hull still opens like a disc.

    The edge of a flat end; else where r/s has fallen to 0.35 of its value at the pole (judgement: further back a disc
    wraps around the shoulder and its cells are drawn out along the hull).
    """
    if outline.blunt[end]:
        return outline.blunt[end]
    s, r = (outline.s, outline.r) if end == 0 else (outline.total - outline.s[::-1], outline.r[::-1])
    inner = s > 1e-4 * outline.total
    ratio = r[inner] / s[inner]
    fallen = np.flatnonzero(ratio < 0.35 * np.maximum.accumulate(ratio))
    return float(s[inner][fallen[0]]) if len(fallen) else 0.5 * outline.total


def smooth_map(at: Array, value: Array) -> Callable[[Array], Array]:
    """Monotone map through the points (at, value), both from zero."""
    interpolator: Callable[[Array], Array] = PchipInterpolator(at, value)
    return interpolator
