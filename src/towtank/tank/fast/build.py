"""From a craft to what the load functions need: panels solved, boundary layer marched, fins measured."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.integrals import hull_integrals
from towtank.frames import Array, body_x
from towtank.tank.fast.boundary import STEPS, WAKE_STATION, BoundaryLayer, march, wake_factor
from towtank.tank.fast.fins import FinData, fin_data
from towtank.tank.fast.hull import HullData, finite_length_factor
from towtank.tank.fast.potential import (
    CHORDWISE,
    RINGS,
    SECTORS,
    SPANWISE,
    HullFlow,
    added_mass_with_fins,
    hull_flow,
)
from towtank.tank.fast.strakes import StrakeData, strake_data

STRIPS = 48
REYNOLDS_RANGE = np.geomspace(0.05, 3.0, 7)
"""Reynolds numbers of the drag table over that of the design speed."""
SECTOR_STEP = 8
"""Sectors come in multiples of this, so that fins at multiples of 45 deg lie between the same panels on every mesh."""


@dataclass(frozen=True)
class Build:
    """A craft ready for the fast tank. ``layer`` is ahead, its last column at the design Reynolds number.

    strakes : None for a craft without.
    """

    hull: HullData
    fins: tuple[FinData, ...]
    strakes: StrakeData | None
    layer: BoundaryLayer
    reynolds: float
    panels: int


def panel_counts(resolution: float) -> tuple[int, int]:
    """Rings and sectors of the hull's panels at ``resolution``; (72, 24) at 1."""
    return _scaled(RINGS, resolution), SECTOR_STEP * _scaled(SECTORS // SECTOR_STEP, resolution)


def _scaled(count: int, resolution: float) -> int:
    return max(round(count * resolution), 1)


@functools.lru_cache(maxsize=8)
def _solved(craft: Craft, resolution: float) -> tuple[HullFlow, Array]:
    """Potential flow of hull and fins; it knows no speed."""
    flow = hull_flow(craft, *panel_counts(resolution))
    return flow, added_mass_with_fins(craft, flow, _scaled(CHORDWISE, resolution), _scaled(SPANWISE, resolution))


@functools.lru_cache(maxsize=32)
def build(craft: Craft, speed: float, resolution: float = 1.0) -> Build:
    """Solve the craft at the ``speed`` [m/s] of a test. About a second for a new craft; then kept.

    resolution : factor on the number of panels each way, of strips and of stations of the boundary layer.
    """
    flow, added = _solved(replace(craft, strakes=()), resolution)
    length = craft.length
    design = craft.water.reynolds(speed, length)
    reynolds = np.append(REYNOLDS_RANGE, 1.0) * design
    steps = _scaled(STEPS, resolution)
    layer = march(craft.profile.radius, length, reynolds, flow.panels.station, flow.surface_speed, steps)
    astern = _march_astern(craft, flow, design, steps)
    fins = tuple(_fin(craft, layer, index, speed) for index in range(len(craft.fins)))
    strakes = strake_data(craft, layer, fins, speed, resolution) if craft.strakes else None
    added = added if strakes is None else added + strakes.added
    hull = _hull(craft, flow, added, layer, astern, reynolds, _scaled(STRIPS, resolution))
    return Build(hull, fins, strakes, layer, design, int(np.prod(flow.panels.shape)))


def _march_astern(craft: Craft, flow: HullFlow, design: float, steps: int) -> BoundaryLayer:
    def reversed_radius(x: Array) -> Array:
        return craft.profile.radius(craft.length - np.asarray(x))

    station, speed = craft.length - flow.panels.station[::-1], flow.surface_speed[::-1]
    return march(reversed_radius, craft.length, np.array([design]), station, speed, steps)


def _fin(craft: Craft, layer: BoundaryLayer, index: int, speed: float) -> FinData:
    fin = craft.fins[index]
    chord = float(fin.chord(fin.half_radius))
    reynolds = max(craft.water.reynolds(speed, chord), 1e3)
    friction = 0.075 / (np.log10(reynolds) - 2.0) ** 2
    return fin_data(craft, fin, wake_factor(layer, fin, -1), friction)


def _hull(
    craft: Craft,
    flow: HullFlow,
    added: Array,
    layer: BoundaryLayer,
    astern: BoundaryLayer,
    reynolds: Array,
    strips: int,
) -> HullData:
    length, origin = craft.length, craft.origin_from_nose
    edge = np.linspace(0.0, length, strips + 1)
    middle = 0.5 * (edge[1:] + edge[:-1])
    return HullData(
        density=craft.water.density,
        viscosity=craft.water.kinematic_viscosity,
        length=length,
        largest=craft.diameter,
        bow=origin,
        wetted=hull_integrals(craft.profile).wetted_area,
        added=0.5 * (added + added.T),
        added_hull=0.5 * (flow.added_mass + flow.added_mass.T),
        log_reynolds=np.log(reynolds[:-1]),
        drag_area=layer.drag_area[:-1],
        momentum_tail=float(layer.stern_momentum_area[-1]),
        momentum_nose=float(astern.stern_momentum_area[-1]),
        x_tail=float(body_x(WAKE_STATION * length, origin)),
        x_nose=float(body_x((1.0 - WAKE_STATION) * length, origin)),
        x=body_x(middle, origin),
        diameter=2.0 * craft.profile.radius(middle),
        width=np.diff(edge),
        finite_length=finite_length_factor(length / craft.diameter),
    )
