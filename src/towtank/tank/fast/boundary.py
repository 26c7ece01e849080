"""Turbulent boundary layer on a body of revolution: drag, momentum area at the stern, velocity seen by the fins.

All Reynolds numbers are marched together; arrays (x, Re).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from towtank.craft.craft import Fin
from towtank.frames import Array

STEPS = 800
"""Stations of the march at resolution 1."""
TRANSITION, END, WAKE_STATION, STERN = 0.03, 0.985, 0.97, 0.85
"""Stations over length: start of turbulence, end of the march, where the drag is read, where the stern begins."""
SHAPE_LIMIT = 2.6
"""Largest shape factor kept; beyond 2.2 the layer is close to separation and the result carries a flag."""


@dataclass(frozen=True)
class BoundaryLayer:
    """Result of the march; arrays (x, Re) but ``x``, ``radius``, ``speed`` (x,).

    momentum_area : r theta [m2 per radian].   shape : H.   drag_area : Re -> CD S [m2].
    """

    x: Array
    radius: Array
    speed: Array
    momentum_area: Array
    shape: Array
    drag_area: Array

    @property
    def stern_momentum_area(self) -> Array:
        """2 pi (r theta) at its largest behind ``STERN`` (Re,) [m2]."""
        length = self.x[-1] / END
        return np.asarray(2.0 * np.pi * self.momentum_area[self.x > STERN * length].max(axis=0))

    @property
    def stern_shape(self) -> Array:
        """Largest shape factor ahead of the drag station (Re,)."""
        return np.asarray(self.shape[self.x < WAKE_STATION * self.x[-1] / END].max(axis=0))


def _entrainment(shape_1: Array) -> Array:
    return np.asarray(0.0306 * np.maximum(shape_1 - 3.0, 1e-6) ** -0.6169)


def _shape_1(h: Array) -> Array:
    low = 0.8234 * np.maximum(h - 1.1, 1e-6) ** -1.287 + 3.3
    return np.where(h <= 1.6, low, 1.5501 * np.maximum(h - 0.6778, 1e-6) ** -3.064 + 3.3)


def _shape(h_1: Array) -> Array:
    excess = np.maximum(h_1, 3.32) - 3.3
    return np.where(excess >= 2.0, 1.1 + (0.8234 / excess) ** (1 / 1.287), 0.6778 + (1.5501 / excess) ** (1 / 3.064))


def march(
    radius: Callable[[Array], Array],
    length: float,
    reynolds: Array,
    station: Array,
    speed: Array,
    steps: int = STEPS,
) -> BoundaryLayer:
    """March the layer from transition to the tail.

    Parameters
    ----------
    radius : x from the nose (n,) -> r [m].   length : [m].   reynolds : (m,) on ``length``.
    station, speed : surface speed over speed ahead at distances from the nose (k,).
    steps : number of stations.

    Source     head1958 entrainment with Cebeci-Bradshaw fits; Ludwieg-Tillmann friction; drag from the momentum
               area in the far wake by Squire-Young for a body of revolution.
    Departure  Marched in the momentum area r theta, which stays finite where the tail gets thin.
    Valid      Attached turbulent flow, Re > 5e5; transition fixed at 3 % of the length. ``SHAPE_LIMIT`` caps H.
    """
    x = np.linspace(TRANSITION * length, END * length, steps)
    r = radius(x)
    ds = np.hypot(np.gradient(x), np.gradient(r))
    u = np.interp(x, station, speed)
    slope = np.gradient(u) / ds
    viscosity = length / np.asarray(reynolds, dtype=float)
    nose = np.linspace(0.0, x[0], 200)
    s0 = float(np.hypot(np.diff(nose), np.diff(radius(nose))).sum())
    area = r[0] * 0.036 * s0 / (u[0] * s0 / viscosity) ** 0.2
    h = np.full_like(viscosity, 1.4)
    flux = u[0] * area * _shape_1(h)
    areas, shapes = np.empty((steps, len(viscosity))), np.empty((steps, len(viscosity)))
    for i in range(steps):
        areas[i], shapes[i] = area, h
        thickness = area / max(r[i], 1e-6)
        friction = 0.246 * 10.0 ** (-0.678 * h) * np.maximum(u[i] * thickness / viscosity, 50.0) ** -0.268
        area = np.maximum(area + ds[i] * (0.5 * friction * r[i] - (2.0 + h) * area / u[i] * slope[i]), 1e-9)
        flux = flux + ds[i] * u[i] * r[i] * _entrainment(_shape_1(h))
        h = np.minimum(_shape(flux / (u[min(i + 1, steps - 1)] * area)), SHAPE_LIMIT)
    j = int(np.searchsorted(x, WAKE_STATION * length))
    drag = 4.0 * np.pi * areas[j] * u[j] ** ((shapes[j] + 5.0) / 2.0)
    return BoundaryLayer(x, r, u, areas, shapes, drag)


def velocity_profile(layer: BoundaryLayer, station: float, case: int) -> tuple[float, float, float, float]:
    """Thickness delta [m], exponent n, hull radius [m] and edge speed ratio of u/Ue = (y/delta)^(1/n) at ``station``.

    The profile has the momentum area and shape factor of the layer, with y measured outward from a thick hull.

    Source     Power law: n = 2 / (H - 1), exact for a flat layer; the momentum integral is taken on the cylinder.
    """
    area = float(np.interp(station, layer.x, layer.momentum_area[:, case]))
    h = float(np.interp(station, layer.x, layer.shape[:, case]))
    r = float(np.interp(station, layer.x, layer.radius))
    n = 2.0 / max(h - 1.0, 0.05)

    def excess(delta: float) -> float:
        def moment(p: float) -> float:
            return r * delta / (p + 1.0) + delta * delta / (p + 2.0)

        return moment(1.0 / n) - moment(2.0 / n) - area

    delta = float(brentq(excess, 1e-9, 50.0 * r + 1.0))
    return delta, n, r, float(np.interp(station, layer.x, layer.speed))


def wake_factor(layer: BoundaryLayer, fin: Fin, case: int) -> float:
    """Mean of (u/U)^2 over the span of a fin, weighted with chord and an elliptic loading."""
    station = float(fin.trailing_edge_at(fin.half_radius) - 0.5 * fin.chord(fin.half_radius))
    return mean_pressure(layer, station, lambda r: fin.tip_radius, case, fin.chord)


def mean_pressure(
    layer: BoundaryLayer,
    station: float,
    tip: Callable[[float], float],
    case: int,
    chord: Callable[[Array], Array] = np.ones_like,
) -> float:
    """Mean of (u/U)^2 from the hull to ``tip`` (of the hull's radius there) [m] at ``station`` [m aft of the nose].

    Weighted with ``chord`` (of the radius) and an elliptic loading.
    """
    inside = float(np.clip(station, layer.x[0], layer.x[-1]))
    delta, n, r, edge = velocity_profile(layer, inside, case)
    share = np.linspace(0.0, 1.0, 200)
    y = r + (tip(r) - r) * share
    u = np.clip((y - r) / delta, 0.0, 1.0) ** (1.0 / n) * edge
    weight = chord(y) * np.sqrt(np.clip(1.0 - share**2, 0.0, 1.0))
    return float((weight * u * u).sum() / weight.sum())
