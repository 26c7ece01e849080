"""Validity remarks: what in a run lies outside what the fast tank was checked on."""

from __future__ import annotations

import numpy as np

from towtank.craft.hydrostatics import SLENDEREST
from towtank.tank.fast.build import Build
from towtank.tank.fast.constants import CONSTANTS
from towtank.tank.fast.fins import stall_angle
from towtank.tank.fast.motion import MotionRecord
from towtank.tank.fast.strakes import TRIP

STALL_DOUBT = next(item.spread for item in CONSTANTS if item.name == "fin_stall")
"""Relative standard deviation of a stall angle."""


def flags(body: Build, record: MotionRecord) -> tuple[str, ...]:
    """Short sentences, each with the limit that is passed; empty when nothing is."""
    return tuple([*_shape_flags(body), *_motion_flags(body, record)])


def _shape_flags(body: Build) -> list[str]:
    hull = body.hull
    slenderness = hull.length / hull.largest
    found = []
    if not 6.0 <= slenderness <= 13.0:
        found.append(f"slenderness {slenderness:.1f} outside 6-13, the range compared with other data")
    if body.reynolds < 1e6:
        found.append(f"Reynolds number {body.reynolds:.1e} below 1e6: laminar flow is not modelled")
    if float(body.layer.stern_shape[-1]) > 2.2:
        found.append(
            f"shape factor {float(body.layer.stern_shape[-1]):.2f} at the stern above 2.2: close to separation"
        )
    for data in body.fins:
        ratio = 1.0 - np.sqrt(0.5 * data.aspect * data.area) / data.fin.tip_radius
        if ratio > 0.6:
            found.append(f"fin {data.fin.name}: hull radius over tip radius {ratio:.2f} above 0.6")
    if body.strakes is not None and body.strakes.aspect > SLENDEREST:
        found.append(
            f"strakes: aspect ratio {body.strakes.aspect:.2f} above {SLENDEREST:g}: a fin rather than a strake"
        )
    if body.strakes is not None and body.strakes.lowest < TRIP:
        found.append(f"strakes: height {body.strakes.lowest:.2f} hull radii below {TRIP:g}: they may lie in the layer")
    return found


def _motion_flags(body: Build, record: MotionRecord) -> list[str]:
    u = record.nu[:, 0]
    cross = np.hypot(record.nu[:, 1], record.nu[:, 2])
    angle = float(np.degrees(np.arctan2(cross, np.maximum(u, 1e-12)).max()))
    found = []
    if u.min() <= 0.0:
        found.append("not moving ahead all the time: order of magnitude only")
    elif angle > 20.5:
        found.append(f"angle to the flow {angle:.0f} deg above 20 deg: the cross-flow law was set to 18 deg")
    if len(u) > 2 and not record.remembers:
        why = "it needs headway all along the run" if record.memory else "as asked, every load is quasi-steady"
        found.append(f"memory switched off: {why}")
    for index, data in enumerate(body.fins):
        stall = float(np.degrees(stall_angle(data.aspect, data.edge, data.slope)))
        largest = float(np.degrees(np.abs(record.delta[:, index]).max()))
        if largest > 0.6 * stall:
            doubt = STALL_DOUBT * stall
            found.append(f"fin {data.fin.name} at {largest:.0f} deg, near its stall ({stall:.0f} +- {doubt:.0f} deg)")
    return found
