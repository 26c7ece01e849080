"""Loads on the stern fins, one by one: interference with the hull, wake, upstream sidewash, stall, all-round angles.

Any layout follows: X, plus, odd numbers, jammed or differential deflection.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft, Fin
from towtank.frames import Array, body_x
from towtank.tank.fast.motion import MotionRecord

SIDEWASH_LAG = 0.45
"""Travel in lengths from where the upstream cross-flow is read to the fins (half the hull, by geometry)."""
REVERSED = 0.7
"""Lift slope and stall angle of a fin in reversed flow over those ahead (judgement: sharp nose, blunt tail)."""
LARGEST_LIFT = 1.375
"""Largest lift coefficient of a fin: the largest entry of the rudder table aveva2023 (aspect ratio 2, 30 deg)."""
STALL_WIDTH = 0.5
"""Angle over which the stalled lift is lost, over the stall angle (judgement: the rudder table loses 5 % in the first
5 deg, the ramp of kjellberg2023, 0.25, loses 40 % there)."""
STALL_LIMIT = np.radians(60.0)
"""Largest stall angle that a draw of the ensemble may reach."""


@dataclass(frozen=True)
class FinData:
    """One fin on its hull. area [m2] exposed; aspect of fin and mirror image; slope [1/rad]; x, y, x_hull [m, body].

    kw, kb, kd : factors on the fin's own force in incidence, of the carry-over in incidence, and of the fin's own
    force in deflection (the carry-over in deflection takes the same share).
    edge : drag coefficient of the side edge.   wake : mean dynamic pressure over that ahead.   drag : profile drag
    coefficient.
    """

    fin: Fin
    area: float
    aspect: float
    slope: float
    edge: float
    x: float
    y: float
    x_hull: float
    kw: float
    kb: float
    kd: float
    wake: float
    drag: float


def lift_slope(aspect: float, sweep: float = 0.0) -> float:
    """Lift slope [1/rad] of a low-aspect-ratio control surface, quarter-chord ``sweep`` [rad].

    Source     whickerfehlner1958, eq. 20 (0.9 is the section efficiency).
    Valid      Aspect ratio 0.5 to 4.
    """
    c = np.cos(sweep)
    return float(0.9 * 2.0 * np.pi * aspect / (1.8 + c * np.sqrt(aspect**2 / c**4 + 4.0)))


def interference(t: float) -> tuple[float, float, float, float]:
    """Slender-body factors (K_W, K_B, k_W, k_B) for hull radius over fin tip radius ``t``.

    K: hull and fin together at incidence; k: fin deflected. W on the fin, B carried over to the body.

    Source     pitts1957, eq. 14, 18 and 19.
    Valid      0 < t < 1; limits 1, 0, 1, 0 as t -> 0.
    """
    t = min(max(t, 1e-3), 0.995)
    s = 1.0 / t
    kw = (
        2.0 / np.pi / (1 - t) ** 2
        * ((1 + t**4) * (0.5 * np.arctan(0.5 * (s - t)) + np.pi / 4) - t * t * ((s - t) + 2 * np.arctan(t)))
    )  # fmt: skip
    arc = np.arcsin((s**2 - 1) / (s**2 + 1))
    kd = (
        np.pi**2 / 4 * (s + 1) ** 2 / s**2
        + np.pi * (s**2 + 1) ** 2 / (s**2 * (s - 1) ** 2) * arc
        - 2 * np.pi * (s + 1) / (s * (s - 1))
        + (s**2 + 1) ** 2 / (s**2 * (s - 1) ** 2) * arc**2
        - 4 * (s + 1) / (s * (s - 1)) * arc
        + 8 / (s - 1) ** 2 * np.log((s**2 + 1) / (2 * s))
    ) / np.pi**2
    return float(kw), float((1 + t) ** 2 - kw), float(kd), float(kw - kd)


def fin_data(craft: Craft, fin: Fin, wake: float, friction: float) -> FinData:
    """Exposed planform of ``fin`` on the tapered hull and its coefficients.

    Source     Exposed area by counting 400 x 40 points of the planform outside the hull; profile drag hoerner1965.
    """
    y = np.linspace(1e-3 * fin.tip_radius, fin.tip_radius, 400)
    chord = fin.chord(y)
    share = (np.arange(40) + 0.5) / 40
    x = fin.trailing_edge_at(y)[:, None] - chord[:, None] * share[::-1]
    outside = (y[:, None] > craft.profile.radius(x)).mean(axis=1)
    area = float(np.trapezoid(chord * outside, y))
    span = float(np.trapezoid(outside, y))
    centre = float(np.trapezoid(chord * outside * y, y) / area)
    aspect = 2.0 * span**2 / area
    mean_chord = float(fin.chord(centre))
    trailing = float(fin.trailing_edge_at(centre))
    quarter_root = fin.trailing_edge - 0.75 * fin.root_chord
    quarter_tip = float(fin.trailing_edge_at(fin.tip_radius)) - 0.75 * fin.tip_chord
    sweep = float(np.arctan2(quarter_tip - quarter_root, fin.tip_radius - fin.root_radius))
    kw, kb, kd, _ = interference(1.0 - span / fin.tip_radius)
    thick = fin.thickness
    return FinData(
        fin=fin, area=area, aspect=aspect, slope=lift_slope(aspect, sweep),
        edge=side_edge_drag(fin.tip_chord / max(float(fin.chord(fin.tip_radius - span)), 1e-9)),
        x=float(body_x(trailing - 0.75 * mean_chord, craft.origin_from_nose)), y=centre,
        x_hull=float(body_x(trailing - 0.5 * mean_chord, craft.origin_from_nose)),
        kw=kw, kb=kb, kd=kd, wake=wake, drag=2.0 * friction * (1 + 2 * thick + 60 * thick**4),
    )  # fmt: skip


def side_edge_drag(taper: float) -> float:
    """Drag coefficient C_Dc of the cross-flow at the side edge, ``taper`` the tip chord over the root chord.

    Source     whickerfehlner1958: 0.1 + 1.6 taper for square tips, as in kjellberg2023, eq. 51; 0.1 + 0.7 taper for
               faired ones, as in prestero2001, table 2.2.
    Departure  The mean of the two: the craft file states no tip.
    """
    return 0.1 + 1.15 * taper


def attached_lift(aspect: float, edge: float, slope: Array | float, angle: Array | float) -> Array:
    """Lift coefficient of an attached fin at ``angle`` >= 0 [rad]; ``slope`` [1/rad], ``edge`` as ``side_edge_drag``.

    Source     whickerfehlner1958: C_L = slope alpha + (C_Dc / A) alpha^2; kjellberg2023, eq. 48.
    Valid      Up to the stall, aspect ratio 0.5 to 4.
    """
    return np.asarray(slope * angle + edge / aspect * np.square(angle))


def stall_angle(aspect: float, edge: float, slope: float) -> float:
    """Angle [rad] of the largest lift of a fin: where ``attached_lift`` reaches ``LARGEST_LIFT``.

    Source     One largest lift for all aspect ratios: this project. With a square tip of taper 0.45 it gives 40 deg at
               aspect ratio 1, where the table aveva2023 still rises at its end, 35 deg, and 30 deg at 2, where it
               turns.
    Departure  Below aspect ratio 1 the angle is that of 1 (judgement): the lift of slender fins grows to larger angles,
               not smaller ones. No effect of Reynolds number, thickness or roughness.
    Valid      Aspect ratio 1 to 4, within 12 % (the ensemble's ``fin_stall``).
    """
    if aspect < 1.0:
        return stall_angle(1.0, edge, lift_slope(1.0))
    curve = edge / aspect
    return float(2.0 * LARGEST_LIFT / (slope + np.sqrt(slope**2 + 4.0 * curve * LARGEST_LIFT)))


def section_forces(angle: Array, data: FinData, p: Mapping[str, Array]) -> tuple[Array, Array]:
    """Normal and chordwise force coefficients (m, N) at ``angle`` (m, N) in -pi..pi [rad].

    Up to the stall: ``attached_lift`` and the drag C_L^2 / (0.9 pi A). Beyond it both pass to those of a flat plate
    along a cubic, over ``STALL_WIDTH`` of the stall angle. Reversed flow: REVERSED of slope and stall angle.

    Source     whickerfehlner1958 attached; hoerner1965 plate, 1.14 at 90 deg; kjellberg2023 for the cubic and the lift
               held beyond the stall.
    Departure  No hysteresis, no Reynolds-number effect. The plate is 12 % below the post-stall lift of spera2008.
    Valid      Stall angle within 12 %; beyond the stall 30 % (judgement).
    """
    size = np.abs(angle)
    reversed_ = size > 0.5 * np.pi
    x = np.where(reversed_, np.pi - size, size)
    share = np.where(reversed_, REVERSED, 1.0)
    stall = np.minimum(stall_angle(data.aspect, data.edge, data.slope) * p["fin_stall"][:, None] * share, STALL_LIMIT)
    slope = share * data.slope * p["fin_slope"][:, None]
    lift = attached_lift(data.aspect, data.edge, slope, np.minimum(x, stall))
    beyond = np.clip((x - stall) / (STALL_WIDTH * stall), 0.0, 1.0)
    lost = beyond * beyond * (3.0 - 2.0 * beyond)
    sine, cosine = np.sin(x), np.cos(x)
    plate = 1.14 * sine / (0.56 + 0.44 * sine)
    drag = (1.0 - lost) * lift**2 / (0.9 * np.pi * data.aspect) + lost * plate * sine
    lift = (1.0 - lost) * lift + lost * plate * cosine
    chordwise = lift * sine - drag * cosine
    return np.sign(angle) * (lift * cosine + drag * sine), np.where(reversed_, -chordwise, chordwise)


def fin_load(
    data: FinData, record: MotionRecord, index: int, upstream: Array, p: Mapping[str, Array], wash: Array | float = 0.0
) -> Array:
    """Load (m, N, 6) of one fin and of what it carries over to the hull.

    Parameters
    ----------
    index : column of ``record.delta``.   upstream : cross-flow (m, N, 2) ahead of the fins, delayed [m/s].
    wash : velocity (m, N) of the water along the lift, left by strakes [m/s].

    Source     whickerfehlner1958 and pitts1957, times the wake's dynamic pressure, less the sidewash of the hull
               (TANK notes, section 3.4). The interference fades with (u/V)^2.
    Valid      Attached fins at |delta| <= 15 deg within 30 % (SUBOFF control derivatives); beyond the stall see
               ``section_forces``.
    """
    fin = data.fin
    along, lift = fin.span_direction, fin.lift_direction
    arm = np.array([data.x, data.y * along[1], data.y * along[2]])
    local = record.nu[:, :3] + np.cross(record.nu[:, 3:], arm)
    ul = local[:, 0]
    u, speed2 = record.nu[:, 0], (record.nu[:, :3] ** 2).sum(axis=1) + 1e-12
    ahead = np.where(u > 0.0, u * u / speed2, 0.0)
    wake = 1.0 - (1.0 - np.minimum(data.wake * p["wake"], 1.0)[:, None]) * ahead
    sidewash = upstream[..., 0] * lift[1] + upstream[..., 1] * lift[2]
    cross = local @ lift - p["sidewash"][:, None] * ahead * sidewash - wash
    delta = record.delta[:, index]
    turned = np.where(ul >= 0.0, delta, -delta)
    angle = (1.0 + (data.kd - 1.0) * ahead) * turned - np.arctan2(
        (1.0 + (data.kw - 1.0) * ahead) * cross, np.abs(ul) + 1e-12
    )
    angle = np.where(ul < 0.0, np.sign(angle) * (np.pi - np.abs(angle)), angle)
    pressure = 0.5 * record_density(p) * wake * (ul**2 + cross**2) * data.area
    normal, chordwise = section_forces(angle, data, p)
    normal, chordwise = pressure * normal, pressure * chordwise
    sine, cosine = np.sin(delta), np.cos(delta)
    friction = pressure * data.drag * ul / np.sqrt(ul**2 + cross**2 + 1e-12)
    fx = -normal * sine + chordwise * cosine - friction
    fl = normal * cosine + chordwise * sine
    carried = normal * (data.kb / data.kw) * p["carry_over"][:, None] * ahead
    carried = carried * np.cos(np.clip(angle, -0.5 * np.pi, 0.5 * np.pi)) ** 2
    return _at(fx, fl, arm, lift) + _at(np.zeros_like(carried), carried, np.array([data.x_hull, 0.0, 0.0]), lift)


def record_density(p: Mapping[str, Array]) -> Array:
    """Water density (m, 1) carried with the constants."""
    return p["density"][:, None]


def _at(fx: Array, fl: Array, arm: Array, lift: Array) -> Array:
    """Load (m, N, 6) of a force fx along x and fl along ``lift`` acting at ``arm``."""
    fy, fz = fl * lift[1], fl * lift[2]
    ax, ay, az = arm
    return np.stack([fx, fy, fz, ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx], axis=-1)


def fins_load(
    fins: tuple[FinData, ...],
    record: MotionRecord,
    length: float,
    bow: float,
    p: Mapping[str, Array],
    wash: Array | None = None,
) -> Array:
    """Load (m, N, 6) of all fins. The upstream cross-flow is read half-way between bow and fins.

    wash : velocity (m, N, n_fins) along the lift of each fin, left by strakes [m/s]; None without.
    """
    members = len(p["sidewash"])
    total = np.zeros((members, len(record.time), 6))
    lag = np.array([SIDEWASH_LAG * length])
    for index, data in enumerate(fins):
        x = 0.5 * (bow + data.x)
        vy = record.delayed(record.nu[:, 1] + x * record.nu[:, 5], lag)
        vz = record.delayed(record.nu[:, 2] - x * record.nu[:, 4], lag)
        upstream, left = np.stack([vy, vz], axis=-1), 0.0 if wash is None else wash[..., index]
        total = total + fin_load(data, record, index, upstream, p, left)
    return total
