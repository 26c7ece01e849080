"""From the places of sensors to the body origin: positions, depths and velocities."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.field.drive import bridged
from towtank.field.log import Flag
from towtank.field.reading.axes import ANGLES, Columns
from towtank.field.reading.mapping import Channel, Sensor
from towtank.frames import Array, body_x, rotation
from towtank.quantity import si

VELOCITIES = (("u", "v", "w"), ("ahead", "slip", "plunge"))
RATES = ("p", "q", "r")
POSITION = ("x", "y", "z")
ANYWHERE = ("phi", "theta", "psi", "p", "q", "r")
"""Channels that are the same at every point of a rigid body."""
_CROSS = ((1, 2, 2, 1), (2, 0, 0, 2), (0, 1, 1, 0))
"""Component of omega x r: omega[a] r[b] - omega[c] r[d]."""


def place_of(sensor: Sensor, craft: Craft | None, name: str) -> Array:
    """Place (3,) [m] of a sensor from the body origin, body axes.

    Raises
    ------
    InputError
        It is given from the nose, and no craft says where the origin is.
    """
    where = f"sensors.{name}"
    y, z = si(sensor.y, "m", f"{where}.y"), si(sensor.z, "m", f"{where}.z")
    if sensor.x is not None:
        return np.array([si(sensor.x, "m", f"{where}.x"), y, z])
    if craft is None:
        raise InputError(
            f"{where}: from_nose needs the craft, whose origin it is counted from. Write craft = in the mapping or "
            "--craft, or give x forward of the body origin."
        )
    return np.array([float(body_x(si(sensor.from_nose or 0.0, "m", where), craft.origin_from_nose)), y, z])


def to_origin(
    time: Array, columns: Columns, places: Mapping[str, Array], said: list[str]
) -> tuple[Columns, tuple[Flag, ...]]:
    """Channels (N,) of the body origin from those of their sensors.

    places : channel -> place (3,) [m] of what measured it, body axes.

    Source     fossen2021, ch. 2: v_s = v_o + omega x r, p_s = p_o + R r.
    Valid      A rigid craft; the rates and attitude of the record itself, by straight lines between samples at most
               1 s apart.
    """
    out = dict(columns)
    flags: list[Flag] = []
    for names in VELOCITIES:
        for i, name in enumerate(names):
            if name in columns and name in places and np.any(places[name]):
                out[name] = _velocity(time, columns, name, i, places[name], said, flags)
    for i, name in enumerate(POSITION):
        if name in columns and name in places and np.any(places[name]):
            out[name] = _position(time, columns, name, i, places[name], said, flags)
    for name in places:
        if name == "speed" and name in columns and np.any(places[name]):
            said.append("speed is left as that of its sensor: it has no direction")
        elif name in ANYWHERE and name in columns:
            said.append(f"{name} is the same at every point of the craft: its place counts for nothing")
    return out, tuple(flags)


def _velocity(
    time: Array, columns: Columns, name: str, axis: int, r: Array, said: list[str], flags: list[Flag]
) -> Array:
    a, b, c, d = _CROSS[axis]
    values, lacking, unknown = columns[name].copy(), [], np.zeros(len(time), dtype=bool)
    for sign, rate, arm in ((1.0, a, b), (-1.0, c, d)):
        if r[arm] == 0.0:
            continue
        if RATES[rate] not in columns:
            lacking.append(f"{RATES[rate]} x {r[arm]:g} m")
            continue
        omega, known = bridged(time, columns[RATES[rate]], time)
        values = values - sign * np.where(known, omega, np.nan) * r[arm]
        unknown |= ~known
    _say(name, r, lacking, said)
    return _without(time, columns[name], values, name, "rates", unknown, flags)


def _position(
    time: Array, columns: Columns, name: str, axis: int, r: Array, said: list[str], flags: list[Flag]
) -> Array:
    needed = ("phi", "theta") if name == "z" else ANGLES
    lacking = [angle for angle in needed if angle not in columns]
    if "psi" in lacking or (name == "z" and "theta" in lacking and r[0] != 0.0):
        said.append(f"{name} is left at its sensor: {', '.join(lacking)} is not in the log")
        return columns[name]
    unknown = np.zeros(len(time), dtype=bool)
    angles = np.zeros((len(time), 3))
    for i, angle in enumerate(ANGLES):
        if angle in needed and angle in columns:
            values, known = bridged(time, columns[angle], time)
            angles[:, i] = values
            unknown |= ~known
    arm = (rotation(angles) @ r)[:, axis]
    _say(name, r, [f"{angle} (taken as zero)" for angle in lacking], said)
    return _without(
        time, columns[name], columns[name] - np.where(unknown, np.nan, arm), name, "attitude", unknown, flags
    )


def _say(name: str, r: Array, lacking: list[str], said: list[str]) -> None:
    words = f"{name} brought to the body origin from ({r[0]:.4g}, {r[1]:.4g}, {r[2]:.4g}) m"
    said.append(words + (f"; left out for lack of a channel: {', '.join(lacking)}" if lacking else ""))


def _without(
    time: Array, before: Array, after: Array, name: str, what: str, unknown: Array, flags: list[Flag]
) -> Array:
    """``after``, and a flag on samples that could not be moved."""
    lost = np.isfinite(before) & np.asarray(unknown, dtype=bool)
    if lost.any():
        at = time[lost]
        words = f"{int(lost.sum())} samples of {name} have no {what} within 1 s to bring them to the origin: left out"
        flags.append(Flag("gap", name, float(at[0]), float(at[-1]), int(lost.sum()), words))
    return after


def sensors_of(channels: Mapping[str, Channel], sensors: Mapping[str, Sensor], craft: Craft | None) -> dict[str, Array]:
    """Channel -> place (3,) of its sensor; those of latitude and longitude stand for x and y, of pressure for z."""
    out = {}
    for key, channel in channels.items():
        if not channel.sensor:
            continue
        place = place_of(sensors[channel.sensor], craft, channel.sensor)
        for name in _MADE.get(key, (key,)):
            out[name] = place
    return out


_MADE: Mapping[str, tuple[str, ...]] = {
    "latitude": ("x", "y"), "longitude": ("x", "y"), "pressure": ("z",), "vn": ("u", "v", "w"),
    "ve": ("u", "v", "w"), "vd": ("u", "v", "w"),
}  # fmt: skip
