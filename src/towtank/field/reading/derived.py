"""Channels made from others: places from latitude and longitude, depth from pressure, true from magnetic heading."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from towtank.errors import InputError
from towtank.field.drive import bridged
from towtank.field.reading.axes import ANGLES as EULER
from towtank.field.reading.axes import WORLD, Columns, body_velocity
from towtank.field.reading.geodesy import north_east
from towtank.field.reading.mapping import LogMap
from towtank.field.reading.values import ANGLES, TURNED, unturned, within_half_turn
from towtank.frames import Array
from towtank.quantity import si
from towtank.water import GRAVITY


def made(
    columns: Mapping[str, Array], mapping: LogMap, datum: tuple[float, float] | None, said: list[str]
) -> tuple[Columns, tuple[float, float] | None]:
    """Columns with those that are made from others, still along the file's axes; and the datum of x and y."""
    out = dict(columns)
    if "pressure" in out:
        down = mapping.axes[1][2]
        depth = _depth(out.pop("pressure"), mapping, said)
        out[down[-1]] = -depth if down.startswith("-") else depth
    return out, _placed(out, mapping, datum, said)


def finished_angles(time: Array, columns: Columns, mapping: LogMap, said: list[str]) -> Columns:
    """Columns along our axes, with true headings, angles without jumps, and u, v, w from velocities north and east."""
    out = dict(columns)
    for name in TURNED:
        if name in out:
            out[name] = _true(name, out[name], mapping, said)
            out[name], jumps = unturned(out[name])
            known = out[name][np.isfinite(out[name])]
            if len(known):
                turns = (known[-1] - known[0]) / (2.0 * np.pi)
                said.append(f"{name}: {jumps} jumps of a turn taken out; it ends {turns:+.2f} turns from its start")
    if "heading_order" in out and "psi" in out:
        out["heading_order"] = _beside(time, out["heading_order"], out["psi"])
    for name in ANGLES:
        if name in out:
            out[name], far = within_half_turn(out[name])
            if far:
                said.append(f"{name}: {far} values beyond half a turn brought within it")
    if any(name in out for name in WORLD[1]):
        _along(time, out, said)
    return out


def _true(name: str, values: Array, mapping: LogMap, said: list[str]) -> Array:
    channel = mapping.channels.get(name)
    if channel is None or not channel.magnetic:
        return values
    declination = si(mapping.declination, "rad", "declination")
    said.append(f"{name}: magnetic; declination of {np.degrees(declination):.4g} deg added")
    return values + declination


def _beside(time: Array, order: Array, psi: Array) -> Array:
    """A heading ordered, by whole turns, in the turn of the heading where it is first given."""
    at = np.flatnonzero(np.isfinite(order))
    known = np.flatnonzero(np.isfinite(psi))
    if not len(at) or not len(known):
        return order
    there = psi[known[np.argmin(np.abs(time[known] - time[at[0]]))]]
    return np.asarray(order - 2.0 * np.pi * np.round((order[at[0]] - there) / (2.0 * np.pi)))


def _depth(pressure: Array, mapping: LogMap, said: list[str]) -> Array:
    surface = si(mapping.pressure.surface, "Pa", "pressure.surface")
    density = si(mapping.pressure.density, "kg/m^3", "pressure.density")
    stated = mapping.pressure.model_fields_set
    assumed = [word for word in ("surface", "density") if word not in stated]
    said.append(
        f"z from pressure: {surface:.6g} Pa at the surface, water of {density:.5g} kg/m3"
        + (f" (assumed: {', '.join(assumed)})" if assumed else "")
    )
    return np.asarray((pressure - surface) / (density * GRAVITY))


def _placed(
    out: Columns, mapping: LogMap, datum: tuple[float, float] | None, said: list[str]
) -> tuple[float, float] | None:
    """Puts x and y in from latitude and longitude; adds to them where the file holds offsets from such a point."""
    held = [name for name in ("latitude", "longitude") if name in out]
    if not held:
        return datum
    if len(held) == 1:
        raise InputError(f"channels: {held[0]} is mapped alone. A place needs latitude and longitude.")
    latitude, longitude = out.pop("latitude"), out.pop("longitude")
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not len(known):
        said.append("latitude and longitude hold no fix: left out")
        return datum
    first = datum or (float(latitude[known[0]]), float(longitude[known[0]]))
    north, east = north_east(latitude, longitude, first)
    said.append(
        f"latitude and longitude to metres north and east of {np.degrees(first[0]):.7f}, "
        f"{np.degrees(first[1]):.7f} deg ({'stated' if datum else 'the first fix'})"
    )
    both = "x" in out or "y" in out
    if both and not mapping.offsets:
        raise InputError(
            "channels: x, y and latitude, longitude are mapped together. Write offsets = true when x and y count from "
            "that latitude and longitude; else map one pair."
        )
    # Along the file's world axes, so that turning them gives north and east.
    for value, axis in ((north, mapping.axes[1][0]), (east, mapping.axes[1][1])):
        along = -value if axis.startswith("-") else value
        out[axis[-1]] = out[axis[-1]] + along if axis[-1] in out else along
    if both:
        said.append("x and y of the file are added: they count from its latitude and longitude")
    return first


def _along(time: Array, out: Columns, said: list[str]) -> None:
    lacking = [name for name in (*WORLD[1], *EULER) if name not in out]
    if lacking:
        said.append(f"velocities north and east are left out: {', '.join(lacking)} is not in the log")
    else:
        angles, known = zip(*(bridged(time, out[name], time) for name in EULER), strict=True)
        attitude = np.where(np.all(known, axis=0)[:, None], np.stack(angles, axis=-1), np.nan)
        for name, values in zip(("u", "v", "w"), body_velocity(out, attitude), strict=True):
            out[name] = values
        said.append("u, v, w from velocities north, east and down by the attitude")
    for name in WORLD[1]:
        out.pop(name, None)
