"""Fins in the O-grid: planes of constant azimuth are slit and the slits opened to the true shape of each fin.

A fin is a grid of chord fractions and span fractions between its root on the hull and its tip. Its points are those of
the trapezoid with its section, turned rigidly about the stock. The root follows the hull, so there is no gap; where a
turned root would leave the hull or meet the next fin, the root is twisted back (``_eased``) and the twist dies out
along the span. The tip is rounded within the planform. What the fins displace is spread smoothly over the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft, Fin
from towtank.craft.section import half_thickness
from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.openfoam.mesh.meridian import Outline
from towtank.tank.openfoam.mesh.spacing import two_sided

MAX_DEFLECTION = np.radians(40.0)
_FEWEST_BETWEEN = 4
"""Fewest cells between two fins."""
_LARGEST_TURN = np.radians(55.0)
"""Largest azimuth by which a root point leaves the fin's plane: beyond it the root is tangent to the hull."""
_TAIL_FINE = 0.5
"""Share of the crowding of planes that is left at the tail cap (judgement: skewness behind the fins against width)."""
_SHARE = 0.6
"""Share of the azimuth between two fins that their roots may take together (judgement: a third is left for cells)."""


@dataclass(frozen=True)
class Layout:
    """Fins as placed on the hull, in the craft's order.

    ``turned`` [rad].   ``edges``: arcs [m] where leading and trailing edge meet the hull, in the mean.   ``tip`` [m]:
    mean tip radius.
    """

    fins: tuple[Fin, ...]
    turned: tuple[float, ...]
    edges: tuple[float, float]
    tip: float

    @property
    def chord(self) -> float:
        """Length of the root along the hull [m]."""
        return self.edges[1] - self.edges[0]


def refuse_strakes(craft: Craft) -> None:
    """See that ``craft`` has no strakes: the meshes know none, neither the structured one nor that of a surface.

    Raises
    ------
    InputError
        It has.
    """
    if craft.strakes:
        thick = min(strake.thickness for strake in craft.strakes)
        raise InputError(
            f"craft {craft.name!r} has {len(craft.strakes)} strakes, and OpenFOAM cannot be given them: the structured "
            "mesh holds hull and fins, and the cells about a surface are far larger than a plate "
            f"{1e3 * thick:.3g} mm thick, which would be lost without a word. Run it in the fast tank (--tank fast), "
            "bring results from elsewhere (towtank import), or tow the craft without its [[strake]] tables."
        )


def layout(craft: Craft, shape: Outline, turned: Sequence[float]) -> Layout | None:
    """Fins of ``craft`` turned by ``turned`` [rad]; None when ``turned`` is empty.

    Raises
    ------
    InputError
        Not one angle a fin, an angle beyond 40 deg, fins inside the hull, behind the tail, or not at one station.
    """
    if len(turned) == 0:
        return None
    if len(turned) != len(craft.fins):
        raise InputError(f"{len(turned)} fin angles for the {len(craft.fins)} fins of {craft.name!r}. Give one a fin.")
    for fin, angle in zip(craft.fins, turned, strict=True):
        if abs(angle) > MAX_DEFLECTION + 1e-9:
            raise InputError(
                f"fin {fin.name!r}: deflection {np.degrees(angle):.1f} deg. The mesh follows a fin to "
                f"{np.degrees(MAX_DEFLECTION):g} deg; beyond, its cells are too skewed. Ask for less."
            )
    edges = np.array([[_root(fin, shape, lead) for lead in (True, False)] for fin in craft.fins])
    mean, tips = edges.mean(axis=0), np.array([fin.tip_radius for fin in craft.fins])
    if np.abs(edges - mean).max() > 0.3 * (mean[1] - mean[0]) or np.ptp(tips) > 0.3 * tips.mean():
        raise InputError(
            "the fins do not stand at one station: their roots or tips differ by more than 0.3 of the mean. The mesh "
            "holds one ring of fins; leave the others out."
        )
    return Layout(craft.fins, tuple(float(a) for a in turned), (float(mean[0]), float(mean[1])), float(tips.mean()))


def _root(fin: Fin, shape: Outline, leading: bool) -> float:
    """Arc [m] where an edge of the fin, not turned, meets the hull."""
    edge = fin.trailing_edge_at(shape.r) - (fin.chord(shape.r) if leading else 0.0)
    past = np.flatnonzero(shape.x >= edge)
    if len(past) == 0 or past[0] == 0 or shape.s[past[0]] > shape.total - shape.blunt[1] - 1e-9:
        raise InputError(
            f"fin {fin.name!r}: its {'leading' if leading else 'trailing'} edge does not meet the hull, which is "
            f"{shape.x[-1]:.4g} m long. Move the fin forward or shorten root_chord."
        )
    i = past[0]
    if fin.tip_radius <= 1.02 * shape.r[i]:
        raise InputError(
            f"fin {fin.name!r}: tip_radius {fin.tip_radius:.4g} m lies inside the hull (radius {shape.r[i]:.4g} m). "
            "Radii are from the hull axis; raise tip_radius."
        )
    gap = shape.x - edge
    return float(np.interp(0.0, gap[i - 1 : i + 1], shape.s[i - 1 : i + 1]))


@dataclass(frozen=True)
class Planes:
    """Azimuth of the planes of the mesh (n,) [rad]: ``even``, and ``fine`` beside fins; ``at``: plane of each fin."""

    even: Array
    fine: Array
    at: tuple[int, ...]

    @property
    def tail(self) -> Array:
        """Azimuth at the tail cap: on the way from ``fine`` to ``even``, for the fins are close."""
        return self.even + _TAIL_FINE * (self.fine - self.even)


def even_planes(around: int) -> Planes:
    """Planes of a bare hull."""
    theta = np.linspace(0.0, 2.0 * np.pi, 2 * around, endpoint=False)
    return Planes(theta, theta, ())


def planes(found: Layout, around: int, first: float) -> Planes:
    """Planes through every fin, ``first`` [rad] apart beside them; mirrored about z = 0 when the fins are.

    Raises
    ------
    InputError
        Too few cells between two fins.
    """
    azimuth = np.mod(np.array([fin.azimuth for fin in found.fins]) + 1e-9, 2.0 * np.pi) - 1e-9
    mirrored = bool(np.allclose(np.sort(_circle(-azimuth)), np.sort(_circle(azimuth)), atol=1e-6))
    order = np.argsort(azimuth)
    if mirrored:
        upper = np.unique(np.round(azimuth[azimuth <= np.pi + 1e-6], 9))
        knots = np.unique(np.r_[0.0, upper, np.pi].round(9))
        is_fin = [bool(np.any(np.abs(upper - knot) < 1e-6)) for knot in knots]
        half = _sectors(knots, is_fin, around, first)
        half[-1] = np.pi
        fine = np.r_[half, 2.0 * np.pi - half[-2:0:-1]]
    else:
        start = azimuth[order][0]
        knots = np.r_[azimuth[order], start + 2.0 * np.pi]
        fine = _sectors(knots, [True] * len(knots), 2 * around, first)[:-1]
        fine = np.sort(np.mod(fine, 2.0 * np.pi))
    even = np.linspace(0.0, 2.0 * np.pi, 2 * around, endpoint=False)
    even = even + (0.0 if mirrored else float(np.mean(fine - even)))
    at = tuple(int(np.argmin(np.abs(np.exp(1j * fine) - np.exp(1j * angle)))) for angle in azimuth)
    if len(set(at)) < len(at):
        raise InputError("two fins stand at the same azimuth. Give each fin an azimuth of its own.")
    return Planes(even, fine, at)


def _circle(angle: Array) -> Array:
    return np.asarray(np.mod(np.round(angle, 7), np.round(2.0 * np.pi, 7)))


def _sectors(knots: Array, is_fin: Sequence[bool], count: int, first: float) -> Array:
    """Azimuths from the first knot to the last: ``count`` cells shared in proportion, fine at the knots with a fin."""
    gaps = np.diff(knots)
    share = count * gaps / gaps.sum()
    cells = np.floor(share).astype(int)
    cells[np.argsort(cells - share, kind="stable")[: count - cells.sum()]] += 1
    result = [np.array([knots[0]])]
    for k, gap in enumerate(gaps):
        ends = is_fin[k] + is_fin[k + 1]
        if cells[k] * 2 < ends * _FEWEST_BETWEEN:
            raise InputError(
                f"two fins are {np.degrees(gap) * 2 / max(ends, 1):.0f} deg apart, which leaves {cells[k] * 2 // ends} "
                f"cells between them; {_FEWEST_BETWEEN} are needed. Raise `around`."
            )
        mean = gap / cells[k]
        left, right = (min(first, mean) if is_fin[k + side] else 2.0 * mean for side in (0, 1))
        result.append(knots[k] + two_sided(left, right, int(cells[k]), float(gap))[1:])
    return np.concatenate(result)


def fade(t: Array) -> Array:
    """From 1 at t <= 0 to 0 at t >= 1 with two vanishing derivatives at either end."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(1.0 - t**3 * (10.0 - 15.0 * t + 6.0 * t * t))


def turned_point(
    fin: Fin, angle: float, middle: float, y: Array, fraction: Array, offset: Array
) -> tuple[Array, Array]:
    """Distance aft of the nose and offset along increasing azimuth [m] of a point of a turned fin.

    ``middle`` [m]: radius of the middle of the exposed span, where the stock is given.   ``y`` [m]: span.
    ``fraction``: of the chord from the leading edge.   ``offset`` [m] from the middle plane before turning.
    """
    stock = float(fin.trailing_edge_at(middle) - (1.0 - fin.hinge) * fin.chord(middle))
    ahead = stock - (fin.trailing_edge_at(y) - (1.0 - fraction) * fin.chord(y))
    return (
        np.asarray(stock - ahead * np.cos(angle) - offset * np.sin(angle)),
        np.asarray(offset * np.cos(angle) - ahead * np.sin(angle)),
    )


def limits(found: Layout) -> Array:
    """Azimuth (fins, 2) [rad] that a turned root may reach towards smaller and larger azimuth.

    Two fins that turn towards each other share the room between them by their angles.
    """
    azimuth, turned = np.array([fin.azimuth for fin in found.fins]), np.array(found.turned)
    order = np.argsort(np.mod(azimuth, 2.0 * np.pi))
    room = np.full((len(azimuth), 2), _LARGEST_TURN)
    for place, a in enumerate(order):
        b = order[(place + 1) % len(order)]
        gap = np.mod(azimuth[b] - azimuth[a] - 1e-12, 2.0 * np.pi)
        closing = turned[a] * turned[b] < 0.0
        for one, other, side in ((a, b, 1), (b, a, 0)):
            part = abs(turned[one]) / (abs(turned[one]) + abs(turned[other])) if closing else 1.0
            room[one, side] = min(_LARGEST_TURN, _SHARE * gap * part)
    return room


def _eased(angle: Array, room: Array) -> Array:
    """``angle`` bent to stay below ``room`` (smaller, larger azimuth); unchanged up to 0.7 of it."""
    bound = np.maximum(np.where(angle < 0.0, room[0], room[1]), 1e-6)
    free, over = 0.7 * bound, 0.3 * bound
    eased = free + over * np.tanh((np.abs(angle) - free) / over)
    return np.where(np.abs(angle) <= free, angle, np.sign(angle) * eased)


def fin_surface(
    found: Layout, number: int, side: float, shape: Outline, fraction: Array, span: Array, rounding: float
) -> Array:
    """Points (chord, span, 3) of one face: distance aft of the nose, radius, azimuth from the fin's plane.

    Parameters
    ----------
    number : of the fin.   side : +1 the face at larger azimuth, -1 the other.
    fraction : of the chord (chord,).   span : fractions from root to tip (chord, span).
    rounding : length over which the tip closes [m].
    """
    fin, angle = found.fins[number], found.turned[number]
    room = limits(found)[number]
    root_x = np.interp(np.array(found.edges), shape.s, shape.x)
    middle = 0.5 * (float(shape.radius(root_x.mean())) + fin.tip_radius)
    # The section is a smooth odd function of t, the root of the chord fraction with the sign of the face. The faces
    # part where the turned nose is furthest forward, so that neither overhangs the other.
    nose = 0.5 * float(half_thickness(fin.thickness, 1e-8)) * 1e4 * np.tan(angle)

    def point(y: Array, f: Array) -> tuple[Array, Array]:
        round_tip = 1.0 - np.clip((y - fin.tip_radius + rounding) / rounding, 0.0, 1.0) ** 2
        part = nose * round_tip
        t = part + (side - part) * np.sqrt(f)
        offset = np.sign(t) * half_thickness(fin.thickness, t**2) * fin.chord(y) * round_tip
        return turned_point(fin, angle, middle, y, t**2, offset)

    y = shape.radius(np.interp(fraction, [0.0, 1.0], root_x))
    for _ in range(60):
        x, off = point(y, fraction)
        hull = shape.radius(x)
        over = np.abs(off) / hull
        turn = _eased(np.sign(off) * (np.arcsin(np.minimum(over, 1.0)) + np.maximum(over - 1.0, 0.0)), room)
        y = 0.5 * y + 0.5 * np.minimum(hull * np.cos(turn), fin.tip_radius)
    along = y[:, None] + span * (fin.tip_radius - y)[:, None]
    xs, offs = point(along, fraction[:, None])
    r, azimuth = np.hypot(along, offs), np.arctan2(offs, along)
    fading = (1.0 - span) ** 2
    r = r + fading * (shape.radius(xs[:, 0]) - r[:, 0])[:, None]
    azimuth = azimuth + fading * (turn - azimuth[:, 0])[:, None]
    return np.stack([xs, r, azimuth], axis=-1)
