"""Loads on the bare hull: inertia, Kirchhoff, tail-shed lift, developing cross-flow, axial drag.

Arrays over members m of the parameter ensemble and samples N: loads are (m, N, 6), about the body origin, SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array
from towtank.tank.fast.motion import MotionRecord, slip

ASTERN_DRAG = 1.6
"""Drag going astern over drag going ahead: blunt end trailing (hoerner1965; judgement, factor 1.3-2)."""
NOSE_SHARE = 0.25
"""Least tail-shed area going astern, over the largest section: a blunt nose trails (judgement)."""
ROLL_FRICTION = 0.004
"""Skin-friction coefficient of the rolling hull (hoerner1965, turbulent plate near Re 1e6)."""


@dataclass(frozen=True)
class HullData:
    """What the hull loads need. Lengths [m], areas [m2], matrices over density.

    added, added_hull : positive added mass (6, 6) of hull with fins, and of the bare hull.
    log_reynolds, drag_area : CD S over log Re.   momentum_tail, momentum_nose : stern momentum area ahead and astern.
    x, diameter, width : strips (k,): body station, diameter, length along the hull.
    """

    density: float
    viscosity: float
    length: float
    largest: float
    bow: float
    wetted: float
    added: Array
    added_hull: Array
    log_reynolds: Array
    drag_area: Array
    momentum_tail: float
    momentum_nose: float
    x_tail: float
    x_nose: float
    x: Array
    diameter: Array
    width: Array
    finite_length: float


def finite_length_factor(slenderness: float) -> float:
    """Cross-flow drag of a finite cylinder over the two-dimensional one, against length over diameter.

    Source     hoerner1965, section 3 (read from the curve).
    Valid      Length over diameter 1 to 100.
    """
    return float(
        np.interp(slenderness, [1, 2, 3, 5, 10, 20, 40, 100], [0.53, 0.57, 0.61, 0.64, 0.68, 0.74, 0.82, 0.91])
    )


def inertia(hull: HullData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load -M_A nudot (m, N, 6) of hull and fins in potential flow.

    Source     lamb1932, chapter 6.
    """
    return -hull.density * p["added_mass"][:, None, None] * (record.nudot @ hull.added)


def kirchhoff(hull: HullData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load (m, N, 6) of the bare hull's added momentum carried along: [-w x P; -w x H - v x P]. It does no work.

    Source     lamb1932, section 124 (Kirchhoff). The fins' circulation is in the fin loads, so their added mass
               stays out.
    """
    v, w = record.nu[:, :3], record.nu[:, 3:]
    momentum = hull.density * (record.nu @ hull.added_hull)
    linear, angular = momentum[:, :3], momentum[:, 3:]
    load = -np.concatenate([np.cross(w, linear), np.cross(w, angular) + np.cross(v, linear)], axis=1)
    return np.asarray(p["added_mass"][:, None, None] * load)


def tail_lift(hull: HullData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load (m, N, 6) of the lateral momentum shed into the boundary layer at the stern.

    F = -rho A_e |u| v_t at the downstream end, v_t the cross-flow there a short travel ago. The shed area is
    A_e = tail_area (2 pi r theta)_max (1 + tail_growth |sin|): the layer gathers on the lee side as the tail is
    inclined.

    Source     Slender-body reasoning of Hopkins (NACA RM A51C14); the area left at the tail is that of the layer.
    Departure  The area follows the momentum area of the layer, so it depends on Reynolds number, and works astern.
    Valid      Set on SUBOFF, Re 1.4e7, drift to 18 deg.
    """
    u, v, w, _, q, r = record.nu.T
    ahead = u >= 0.0
    x = np.where(ahead, hull.x_tail, hull.x_nose)
    momentum = np.where(ahead, hull.momentum_tail, hull.momentum_nose)
    least = np.where(ahead, 0.0, NOSE_SHARE * 0.25 * np.pi * hull.largest**2)
    lag = p["tail_lag"] * hull.length
    vy, vz = record.delayed(v + x * r, lag), record.delayed(w - x * q, lag)
    sine = np.hypot(vy, vz) / (np.sqrt(u * u + vy * vy + vz * vz) + 1e-12)
    area = np.maximum(p["tail_area"][:, None] * momentum, least) * (1.0 + p["tail_growth"][:, None] * sine)
    fy, fz = -hull.density * area * np.abs(u) * vy, -hull.density * area * np.abs(u) * vz
    zero = np.zeros_like(fy)
    return np.stack([zero, fy, fz, zero, -x * fz, x * fy], axis=-1)


def crossflow(hull: HullData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load (m, N, 6) of the separated cross-flow, strip by strip, growing as each water slice is displaced.

    dF = -1/2 rho Cd eta d |v_c| v_c (1 - exp(-(xi/xi_0)^2)) dx, xi the slip in diameters since the slice met the bow:
    nothing before the lee side separates, the full drag soon after. Separation so begins at the tail and moves forward
    with drift. A share crossflow_axial sin^2 cos of the strip's force acts along x.

    Source     allenperkins1951 for the impulsive-start analogy; hoerner1965 for eta.
    Departure  The growth is quadratic in the exponent, and the axial share is empirical: both set on roddy1990,
               bare hull, 4-18 deg.
    Valid      Drift to 20 deg ahead, judgement beyond; no critical-Reynolds dip of the cylinder.
    """
    u, v, w, _, q, r = record.nu.T
    behind = np.where((u >= 0.0)[:, None], hull.bow - hull.x, hull.x - (hull.bow - hull.length))
    cy, cz = v[:, None] + hull.x * r[:, None], w[:, None] - hull.x * q[:, None]
    speed = np.hypot(cy, cz)
    dy, dz = slip(record, hull.x, behind if not record.remembers else hull.bow - hull.x)
    xi = np.maximum(0.0, (dy * cy + dz * cz) / np.maximum(speed, 1e-12)) / hull.largest
    base = 0.5 * hull.density * hull.finite_length * hull.diameter * hull.width * speed
    total = np.sqrt(u[:, None] ** 2 + speed**2) + 1e-12
    axial = base * speed * (speed / total) ** 2 * (u[:, None] / total)
    shares = np.stack([axial, -base * cy, -base * cz, base * cz * hull.x, -base * cy * hull.x], axis=-1)
    scaled = (xi * xi).astype(np.float32)[:, None, :] * (-1.0 / p["crossflow_length"] ** 2).astype(np.float32)[:, None]
    growth = -np.expm1(scaled)
    summed = (growth @ shares.astype(np.float32)).transpose(1, 0, 2).astype(np.float64)
    summed = summed * p["crossflow_cd"][:, None, None]
    fx = p["crossflow_axial"][:, None] * summed[..., 0]
    zero = np.zeros_like(fx)
    return np.stack([fx, summed[..., 1], summed[..., 2], zero, summed[..., 3], summed[..., 4]], axis=-1)


def axial_drag(hull: HullData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load (m, N, 6) of skin friction and form drag along x, and of the hull's friction in roll.

    X = -1/2 rho (CD S)(Re) V u: friction acts along the flow, V being the speed of the body through the water.

    Source     Drag area from the boundary-layer march; roll friction by hoerner1965.
    Valid      Ahead, Re within 1/20 to 3 times the build speed; astern by the factor ASTERN_DRAG.
    """
    u, v, w, roll = record.nu[:, 0], record.nu[:, 1], record.nu[:, 2], record.nu[:, 3]
    speed = np.sqrt(u * u + v * v + w * w)
    reynolds = np.log(np.maximum(speed * hull.length / hull.viscosity, 1e3))
    area = np.interp(reynolds, hull.log_reynolds, hull.drag_area) * np.where(u >= 0.0, 1.0, ASTERN_DRAG)
    radius = 0.5 * hull.largest
    tangential = np.hypot(u, radius * roll)
    fx = -0.5 * hull.density * area * speed * u
    k = -0.5 * hull.density * hull.wetted * ROLL_FRICTION * radius**2 * tangential * roll
    load = np.zeros((len(u), 6))
    load[:, 0], load[:, 3] = fx, k
    return np.asarray(p["drag"][:, None, None] * load)
