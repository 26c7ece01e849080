"""Loads on strakes: lateral momentum shed along long thin plates, separated cross-flow, drag, and wash at the fins.

Linear loads are those of slender-body theory. All strakes of a craft are one system: at each station they and the hull
make one section, whose apparent mass follows from ``plates``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from towtank.craft.craft import Craft, Strake
from towtank.frames import Array, body_x
from towtank.tank.fast.boundary import BoundaryLayer, mean_pressure
from towtank.tank.fast.fins import SIDEWASH_LAG, FinData, lift_slope
from towtank.tank.fast.hull import finite_length_factor
from towtank.tank.fast.motion import MotionRecord
from towtank.tank.fast.plates import Section, finned_circle, wash

INTERVALS = 16
"""Strips between two ends of strakes at resolution 1."""
EDGE_SHIFT, MOST_SHIFT = 0.5, 1.0 / 6.0
"""The load of a leading edge acts this many heights behind it, at most this share of the length: the vortex lattice of
tests/oracles/test_strake_lattice.py gives 0.52 heights at aspect ratio 0.1, and a sixth of the length at 1."""
END_LOSS = 0.25
"""Heights at each end of a strake without apparent mass: the lattice of plates on a hull (tests/oracles) gives 95 % of
the strips at ten heights of length, 85 % at five."""
SIDEWASH_FROM, SIDEWASH_FULL = 0.25, 0.90
"""Distance aft of the nose over length where the hull's sidewash begins and where it is that of stern fins. The sail of
SUBOFF at 0.25 feels none (roddy1990), the stern planes at 0.93 all."""
TRIP = 0.05
"""Height over hull radius from which the edges fix the separation (judgement; the experiment had 0.2)."""
CORE = 0.15
"""Core of the trailing vortices over the height of the strakes (judgement: the wake is diffuse)."""
LEAST = 1e-6
"""Height over hull radius below which a strake has no section: rounding would decide it."""
NONE = Section(1.0, np.zeros((3, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class StrakeData:
    """Strakes on their hull. Matrices over density; lengths [m]; lateral velocities y, z, roll (3,).

    added (6, 6) : positive added mass gained.   shed (2, 6, 6) : load per speed ahead and unit velocity, in the wake of
    the hull and in free flow.   astern (6, 6) : the same astern.   wake : mean dynamic pressure over that ahead.
    x : where the upstream cross-flow is read.   sidewash : share of the hull's sidewash felt there.
    strips : see ``Strips``.   drag_area [m2] : straight ahead.   end : body station where the wash begins.
    at_fins (n_fins, 3) : velocity of the water along the lift of each fin, per unit velocity at the end.
    aspect : largest aspect ratio of a strake and its image.   lowest : least height over the radius of the hull.
    """

    added: Array
    shed: Array
    astern: Array
    wake: float
    x: float
    sidewash: float
    strips: Strips
    drag_area: float
    end: float
    at_fins: Array
    aspect: float
    lowest: float


@dataclass(frozen=True)
class Strips:
    """Strips of all strakes (k,): body station, radius of the middle, normal along y and z; areas [m2].

    plate : of the strip itself.   body : of the hull beside it whose separation it fixes.
    """

    x: Array
    radius: Array
    normal: Array
    plate: Array
    body: Array
    finite_length: float


def strake_data(
    craft: Craft, layer: BoundaryLayer, fins: tuple[FinData, ...], speed: float, resolution: float = 1.0
) -> StrakeData:
    """Sections, strips and coefficients of the strakes of ``craft`` at the ``speed`` [m/s] of the design.

    Source     Friction by ITTC 1957 with the form factor of a fin, and the drag of a square trailing edge, by
               hoerner1965, chapter 3.
    Departure  The leading end is taken as rounded, without drag of its own.
    """
    count = max(round(INTERVALS * resolution), 2)
    slender = _slenderness(craft.strakes)
    pressure = np.array([_pressure(craft, layer, x) for x in _edges(craft.strakes, count, shifted=False)])
    shed = slender * np.stack([_shed(craft, layer, count, wake=True), _shed(craft, layer, count, wake=False)])
    wake = float(np.mean(pressure))
    last = max(strake.end for strake in craft.strakes)
    origin = craft.origin_from_nose
    centre = float(
        np.average([0.5 * (s.start + s.end) for s in craft.strakes], weights=[s.area for s in craft.strakes])
    )
    share = np.interp(centre / craft.length, (SIDEWASH_FROM, SIDEWASH_FULL), (0.0, 1.0))
    return StrakeData(
        added=_added(craft, count),
        shed=shed,
        astern=slender * wake * _shed(craft, layer, count, wake=False, ahead=False),
        wake=wake,
        x=0.5 * (origin + float(body_x(centre, origin))),
        sidewash=float(share),
        strips=_strips(craft, count),
        drag_area=_drag_area(craft, speed, wake),
        end=float(body_x(last, origin)),
        at_fins=slender * _at_fins(craft, fins),
        aspect=max(_aspect(s) for s in craft.strakes),
        lowest=min(_lowest(craft, s) for s in craft.strakes),
    )


def _lowest(craft: Craft, strake: Strake) -> float:
    x = np.linspace(strake.start, strake.end, 21)
    return float(np.min(strake.height_at(x) / craft.profile.radius(x)))


def _added(craft: Craft, count: int) -> Array:
    """(6, 6) positive added mass over density gained by the strakes, strip by strip.

    Source     newman1977, section 7.6: slender-body theory.
    Departure  The ends lose END_LOSS heights each.
    """
    kept = tuple(
        replace(s, start=s.start + min(END_LOSS * s.height, 0.25 * s.length),
                end=s.end - min(END_LOSS * s.end_height, 0.25 * s.length))
        for s in craft.strakes
    )  # fmt: skip
    x, total = _edges(kept, count, shifted=False), np.zeros((6, 6))
    for station, width in zip(0.5 * (x[1:] + x[:-1]), np.diff(x), strict=True):
        to_section = _lateral(craft.origin_from_nose - station)
        total += width * to_section.T @ _section(craft, kept, station).added @ to_section
    return total


def _edges(strakes: tuple[Strake, ...], count: int, shifted: bool) -> Array:
    """Stations [m aft of the nose] that divide every stretch between two ends into ``count``."""
    ends = sorted({point for s in strakes for point in (_start(s) if shifted else s.start, s.end)})
    parts = [np.linspace(a, b, count + 1)[:-1] for a, b in pairwise(ends)]
    return np.append(np.concatenate(parts), ends[-1])


def _start(strake: Strake) -> float:
    """Where the load of the leading edge acts [m aft of the nose]."""
    return strake.start + min(EDGE_SHIFT * strake.height, MOST_SHIFT * strake.length)


def _section(craft: Craft, strakes: tuple[Strake, ...], station: float, shifted: bool = False) -> Section:
    radius = float(craft.profile.radius(np.array(station)))
    standing = [
        s for s in strakes
        if (_start(s) if shifted else s.start) <= station <= s.end and float(s.height_at(station)) > LEAST * radius
    ]  # fmt: skip
    if not standing:
        return NONE
    tips = np.array([radius + float(s.height_at(station)) for s in standing])
    return finned_circle(radius, np.array([s.azimuth for s in standing]), tips)


def _lateral(x: float) -> Array:
    """(3, 6): lateral velocity and roll rate of the section at body station ``x`` [m] from the six velocities."""
    return np.array([[0, 1.0, 0, 0, 0, x], [0, 0, 1.0, 0, -x, 0], [0, 0, 0, 1.0, 0, 0]])


def _shed(craft: Craft, layer: BoundaryLayer, count: int, wake: bool, ahead: bool = True) -> Array:
    """(6, 6) load over density, speed and velocity: the rate at which the sections' lateral momentum A V grows aft.

    dF = -rho u d(A V). Where A falls along the flow nothing is given back: the sheet shed before keeps it.

    Source     lighthill1960, small-amplitude slender-body theory; jones1946: no lift behind the largest span.
    """
    strakes = craft.strakes if ahead else tuple(_turned(craft, s) for s in craft.strakes)
    x = _edges(strakes, count, shifted=True)
    held, total = np.zeros((3, 3)), np.zeros((6, 6))
    for station, after in pairwise(x):
        middle = 0.5 * (station + after)
        place = middle if ahead else craft.length - middle
        found = (_section(craft, strakes, middle, True) if ahead else _section(craft, craft.strakes, place)).added
        gain = _gain(found - held)
        held = held + gain
        at, following, between = (
            _lateral(craft.origin_from_nose - (p if ahead else craft.length - p)) for p in (station, after, middle)
        )
        local = _pressure(craft, layer, place) if wake else 1.0
        total += local * (at.T @ gain @ at + between.T @ held @ (following - at))
    return total


def _turned(craft: Craft, strake: Strake) -> Strake:
    """The strake as the flow from astern meets it: distances from the tail."""
    return replace(
        strake, start=craft.length - strake.end, end=craft.length - strake.start, height=strake.end_height,
        end_height=strake.height,
    )  # fmt: skip


def _gain(change: Array) -> Array:
    """The part of a symmetric (3, 3) that is not negative."""
    values, vectors = np.linalg.eigh(change)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _pressure(craft: Craft, layer: BoundaryLayer, station: float) -> float:
    """Mean of (u/U)^2 over the strakes at ``station``; 1 where none stands."""
    heights = [float(s.height_at(station)) for s in craft.strakes if s.start <= station <= s.end]
    return mean_pressure(layer, station, lambda r: r + max(heights), -1) if heights else 1.0


def _slenderness(strakes: tuple[Strake, ...]) -> float:
    """Lift slope of the strakes over that of slender-body theory, mean by area.

    Source     whickerfehlner1958 over jones1946 (pi A / 2).
    """
    ratios = [lift_slope(aspect) / (0.5 * np.pi * aspect) for aspect in map(_aspect, strakes)]
    return float(np.average(ratios, weights=[s.area for s in strakes]))


def _aspect(strake: Strake) -> float:
    """Aspect ratio of a strake and its image in the hull."""
    return 2.0 * strake.area / strake.length**2


def _strips(craft: Craft, count: int) -> Strips:
    rows = []
    for strake in craft.strakes:
        edge = np.linspace(strake.start, strake.end, count + 1)
        x, width = 0.5 * (edge[1:] + edge[:-1]), np.diff(edge)
        radius, height = craft.profile.radius(x), strake.height_at(x)
        normal = np.broadcast_to(strake.lift_direction[1:], (count, 2))
        beside = [sum(s.start <= at <= s.end for s in craft.strakes) for at in x]
        share = -np.expm1(-height / (TRIP * radius)) * np.minimum(4.0 / np.array(beside), 1.0)
        rows.append((x, radius + 0.5 * height, normal, height * width, share * radius * width))
    x, radius, normal, plate, body = (np.concatenate(column) for column in zip(*rows, strict=True))
    finite = finite_length_factor(craft.length / craft.diameter)
    return Strips(body_x(x, craft.origin_from_nose), radius, normal, plate, body, finite)


def _drag_area(craft: Craft, speed: float, wake: float) -> float:
    total = 0.0
    for strake in craft.strakes:
        reynolds = max(craft.water.reynolds(speed, strake.length), 1e3)
        friction = 0.075 / (np.log10(reynolds) - 2.0) ** 2
        thick = strake.thickness / strake.length
        edge = 0.135 / (2.0 * friction / thick) ** (1.0 / 3.0)
        total += 2.0 * friction * (1.0 + 2.0 * thick + 60.0 * thick**4) * strake.area
        total += edge * strake.end_height * strake.thickness
    return wake * total


def _at_fins(craft: Craft, fins: tuple[FinData, ...]) -> Array:
    """Mean velocity (n_fins, 3) along the lift of each fin over its span, per unit velocity where the strakes end."""
    rows, known = [np.zeros(3) for _ in fins], dict[tuple[Strake, ...], Section]()
    for i, data in enumerate(fins):
        fin, station = data.fin, craft.origin_from_nose - data.x_hull
        ahead = tuple(s for s in craft.strakes if s.end <= station)
        if ahead:
            known[ahead] = known[ahead] if ahead in known else _widest(craft, ahead)
            radius = max(float(craft.profile.radius(np.array(station))), 1e-3 * fin.tip_radius)
            share: Array = np.linspace(0.0125, 0.9875, 40)
            y = radius + (fin.tip_radius - radius) * share
            weight = fin.chord(y) * np.sqrt(1.0 - share**2)
            flow = wash(known[ahead], radius, y, fin.azimuth, CORE * max(s.height for s in ahead))
            rows[i] = -np.asarray(weight @ flow / weight.sum())
    return np.array(rows).reshape(-1, 3)


def _widest(craft: Craft, strakes: tuple[Strake, ...]) -> Section:
    """The section that sheds most."""
    stations = np.linspace(min(s.start for s in strakes), max(s.end for s in strakes), 2 * INTERVALS)
    sections = [_section(craft, strakes, station) for station in stations]
    return max(sections, key=lambda item: float(item.added[0, 0] + item.added[1, 1]))


def strakes_load(data: StrakeData, record: MotionRecord, length: float, p: Mapping[str, Array]) -> tuple[Array, Array]:
    """Load (m, N, 6) of the strakes, and the velocity (m, N, n_fins) [m/s] of their wash along the lift of each fin.

    Linear: the shed momentum, less the sidewash of the hull, in the hull's wake; the wake fades with (u/V)^2. Beyond:
    -1/2 rho C |v_n| v_n on each strip, v_n normal to the plate, and on the hull beside it, whose separation the edge
    fixes: there the drag of the hull's own cross-flow is taken off. No suction acts on the edges.

    Source     lighthill1960; the cross-flow coefficient is that of a plate, hoerner1965, chapter 3.
    Departure  The hull beside a strake takes part: jorgensen1975 measured four times the load of the plates alone at
               30 deg. A strake shades no other.
    Valid      Aspect ratio (two heights over length) below 0.5; drift to 30 deg; height above TRIP hull radii.
    """
    u = record.nu[:, 0]
    speed2 = (record.nu[:, :3] ** 2).sum(axis=1) + 1e-12
    ahead = np.where(u > 0.0, u * u / speed2, 0.0)
    forward = (u >= 0.0)[:, None]
    lag = np.array([SIDEWASH_LAG * length])
    vy = record.delayed(record.nu[:, 1] + data.x * record.nu[:, 5], lag)
    vz = record.delayed(record.nu[:, 2] - data.x * record.nu[:, 4], lag)
    upstream = data.sidewash * p["sidewash"][:, None, None] * (ahead * np.stack([vy[0], vz[0]])).T
    lateral = np.broadcast_to(record.nu, (len(upstream), *record.nu.shape)).copy()
    lateral[..., 1:3] -= upstream
    met = np.minimum(data.wake * p["wake"], 1.0)[:, None] / data.wake * ahead
    shed, free = lateral @ data.shed[0].T, lateral @ data.shed[1].T
    flow = np.where(forward, (1.0 - ahead)[:, None] * free + met[..., None] * shed, lateral @ data.astern.T)
    factor = p["density"] * p["strake_lift"]
    linear = -factor[:, None, None] * np.abs(u)[:, None] * flow
    shed_at_end = np.stack([record.nu[:, 1] + data.end * record.nu[:, 5], record.nu[:, 2] - data.end * record.nu[:, 4],
                            record.nu[:, 3]], axis=-1)  # fmt: skip
    at_end = np.broadcast_to(shed_at_end, (len(upstream), *shed_at_end.shape)).copy()
    at_end[..., :2] -= upstream
    strength = (p["strake_wash"] * p["strake_lift"])[:, None] * met * data.wake
    return linear + _separated(data, record, p), strength[..., None] * (at_end @ data.at_fins.T)


def _separated(data: StrakeData, record: MotionRecord, p: Mapping[str, Array]) -> Array:
    """Load (m, N, 6) of the separated cross-flow and of friction."""
    s, nu = data.strips, record.nu
    vy, vz = nu[:, 1:2] + s.x * nu[:, 5:6], nu[:, 2:3] - s.x * nu[:, 4:5]
    beside = vy * s.normal[:, 0] + vz * s.normal[:, 1]
    own = beside - s.radius * nu[:, 3:4]
    half = 0.5 * p["density"]
    plate = -(own * np.abs(own) * s.plate)
    hull = -(beside * np.abs(beside) * s.body)
    gain = np.maximum(p["strake_crossflow"] - p["crossflow_cd"] * s.finite_length, 0.0)
    out = np.zeros((len(half), len(nu), 6))
    for force, coefficient, arm in ((plate, p["strake_crossflow"], s.radius), (hull, gain, 0.0 * s.radius)):
        fy, fz = force * s.normal[:, 0], force * s.normal[:, 1]
        shares = np.stack([fy, fz, -arm * force, -s.x * fz, s.x * fy], axis=-1).sum(axis=1)
        out[..., 1:] += (half * coefficient)[:, None, None] * shares
    total = np.sqrt((nu[:, :3] ** 2).sum(axis=1))
    out[..., 0] -= (half * p["drag"])[:, None] * data.drag_area * total * nu[:, 0]
    return out
