"""Records in the formats of vehicles: MOOS .alog, folders of IMC messages as CSV, Iver and EcoMapper logs."""

from __future__ import annotations

import datetime
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from towtank.artefact import write_text
from towtank.errors import ArtefactError, InputError
from towtank.field.log import FINS, SeaLog
from towtank.field.reading.alog import NOTE as ALOG_NOTE
from towtank.field.reading.geodesy import latitude_longitude
from towtank.field.reading.imc import BOOK
from towtank.field.reading.note import WORDS, note_text
from towtank.frames import Array

_DEG = 180.0 / np.pi
KNOT = 1852.0 / 3600.0
NOWHERE = (np.pi / 6.0, -np.pi / 6.0)
"""Datum of an Iver log of a record without one: 30 deg north, 30 deg west."""
_MOOS: Mapping[str, tuple[str, float]] = {
    "x": ("NAV_Y", 1.0), "y": ("NAV_X", 1.0), "z": ("NAV_DEPTH", 1.0), "psi": ("NAV_HEADING", _DEG),
    "speed": ("NAV_SPEED", 1.0), "heading_order": ("DESIRED_HEADING", _DEG), "depth_order": ("DESIRED_DEPTH", 1.0),
    "speed_order": ("DESIRED_SPEED", 1.0), "rudder": ("DESIRED_RUDDER", _DEG), "elevator": ("DESIRED_ELEVATOR", _DEG),
}  # fmt: skip
"""Channel -> variable of MOOS and its factor; all others are written in SI as TOWTANK_<NAME>."""
_STATE = (
    ("lat", "rad"), ("lon", "rad"), ("height", "m"), ("x", "m"), ("y", "m"), ("z", "m"), ("phi", "rad"),
    ("theta", "rad"), ("psi", "rad"), ("u", "m/s"), ("v", "m/s"), ("w", "m/s"), ("vx", "m/s"), ("vy", "m/s"),
    ("vz", "m/s"), ("p", "rad/s"), ("q", "rad/s"), ("r", "rad/s"), ("depth", "m"), ("alt", "m"),
)  # fmt: skip
"""Fields of the IMC message EstimatedState and their units."""
_SINGLE: Mapping[str, tuple[str, tuple[tuple[str, str], ...], str, float]] = {
    "revolutions": ("Rpm", (("value", "rpm"),), "{}", 60.0),
    "heading_order": ("DesiredHeading", (("value", "rad"),), "{}", 1.0),
    "depth_order": ("DesiredZ", (("value", "m"), ("z_units", "")), "{}, DEPTH", 1.0),
    "pitch_order": ("DesiredPitch", (("value", "rad"),), "{}", 1.0),
    "turn_order": ("DesiredHeadingRate", (("value", "rad/s"),), "{}", 1.0),
    "speed_order": ("DesiredSpeed", (("value", ""), ("speed_units", "")), "{}, METERS_PS", 1.0),
}  # fmt: skip
"""Channel -> IMC message, its fields, the cells of a row, and the factor of the value."""
_IVER = (
    "Latitude", "Longitude", "Time", "Date", "Number of Sats", "GPS Speed (Kn)", "GPS True Heading",
    "GPS Magnetic Variation", "HDOP", "C Magnetic Heading", "C True Heading", "Pitch Angle", "Roll Angle",
    "C Inside Temp (c)", "DFS Depth (m)", "DTB Height (m)", "Total Water Column (m)", "Batt Percent", "Power Watts",
    "Watt-Hours", "Batt Volts", "Batt Ampers", "Batt State", "Time to Empty", "Current Step", "Dist To Next (m)",
    "Next Speed (kn)", "Vehicle Speed (kn)", "Motor Speed CMD", "Next Heading", "Next Long", "Next Lat",
    "Next Depth (m)", "Depth Goal (m)", "Vehicle State", "Error State", "Distance to Track (m)", "Fin Pitch R",
    "Fin Pitch L", "Pitch Goal", "Fin Yaw T", "Fin Yaw B", "Yaw Goal", "Fin Roll",
)  # fmt: skip


def write_alog(log: SeaLog, path: Path) -> Path:
    """A record as a MOOS log: one posting for each number, times to 1 us.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    line = "%" * 100
    head = [
        line, f"%% LOG FILE:       {path.name}", *([f"%% {WORDS}"] if log.synthetic else []),
        f"%% LOGSTART        {log.epoch or 0.0:.6f}", line, f"{0.0:<15.6f} {ALOG_NOTE:<28} towtank {note_text(log)}",
    ]  # fmt: skip
    postings: list[tuple[float, str]] = []
    for name, values in log.channels.items():
        variable, factor = _MOOS.get(name, (f"TOWTANK_{name.upper()}", 1.0))
        shown = values % (2.0 * np.pi) if name in ("psi", "heading_order") else values
        known = np.isfinite(values)
        postings += [
            (at, f"{at:<15.6f} {variable:<28} towtank {value!r}")
            for at, value in zip(log.time[known].tolist(), (factor * shown[known]).tolist(), strict=True)
        ]
    body = [text for _, text in sorted(postings, key=lambda item: item[0])]
    return write_text(path, "\n".join([*head, *body]) + "\n")


def write_imc(log: SeaLog, path: Path) -> Path:
    """A record as a folder of IMC messages, one CSV file for each type, as Neptus exports them.

    Held: position, attitude, velocities, rates, fins, revolutions and orders; not virtual fins, thrust, throttle and
    speed. Times are to 1 us.

    Raises
    ------
    ArtefactError
        The folder cannot be written, or holds something else.
    """
    files = {BOOK: _book(log)}
    if state := _estimated(log):
        files["EstimatedState"] = state
    water = [log[name] for name in ("ahead", "slip", "plunge")]
    if any(np.isfinite(values).any() for values in water):
        water_fields = (("validity", ""), ("x", "m/s"), ("y", "m/s"), ("z", "m/s"))
        cells = [f"{x!r}, {y!r}, {z!r}" for x, y, z in zip(*(v.tolist() for v in water), strict=True)]
        known = np.any(np.isfinite(water), axis=0)
        files["WaterVelocity"] = _message(
            log, water_fields, [(int(i), f"VALID, {cells[i]}") for i in np.flatnonzero(known)]
        )
    for message, word in (("ServoPosition", "delta"), ("SetServoPosition", "command")):
        rows = [
            (int(i), f"{fin}, {log[f'{word}{fin + 1}'][i].item()!r}")
            for fin in range(FINS)
            for i in np.flatnonzero(np.isfinite(log[f"{word}{fin + 1}"]))
        ]
        if rows:
            files[message] = _message(log, (("id", ""), ("value", "rad")), sorted(rows, key=lambda row: row[0]))
    for name, (message, fields, cells_of, factor) in _SINGLE.items():
        known = np.flatnonzero(np.isfinite(log[name]))
        if len(known):
            values = (factor * log[name]).tolist()
            files[message] = _message(log, fields, ((int(i), cells_of.format(repr(values[i]))) for i in known))
    return _folder(path, {f"{name}.csv": text for name, text in files.items()})


def _message(
    log: SeaLog, fields: Sequence[tuple[str, str]], rows: Iterator[tuple[int, str]] | list[tuple[int, str]]
) -> str:
    named = [f"{name} ({unit})" if unit else name for name, unit in fields]
    head = ", ".join(["timestamp (seconds since 01/01/1970)", "system", "entity ", *named])
    start, source = log.epoch or 0.0, log.craft or "craft"
    stamps = log.time.tolist()
    return "\r\n".join([head, *(f"{start + stamps[i]:.6f}, {source}, towtank, {cells}" for i, cells in rows)]) + "\r\n"


def _book(log: SeaLog) -> str:
    fields = (("type", ""), ("htime", "s"), ("context", ""), ("text", ""))
    return _message(log, fields, [(0, f"INFO, {log.epoch or 0.0:.6f}, towtank, {note_text(log)}")])


def _estimated(log: SeaLog) -> str:
    """EstimatedState: NaN where nothing was measured; empty when nothing of it ever was."""
    latitude, longitude = log.datum or (0.0, 0.0)
    same = {"depth": "z"}
    unset = {
        "lat": latitude,
        "lon": longitude,
        "height": 0.0,
        "z": 0.0,
        "vx": np.nan,
        "vy": np.nan,
        "vz": np.nan,
        "alt": np.nan,
    }
    columns: list[Array] = []
    for name, _ in _STATE:
        fixed = name in unset
        columns.append(np.full(len(log.time), unset[name]) if fixed else log[same.get(name, name)])
    held = [i for i, (name, _) in enumerate(_STATE) if name not in unset]
    known = np.flatnonzero(np.any([np.isfinite(columns[i]) for i in held], axis=0))
    table = np.column_stack(columns).tolist()
    rows = [(int(i), ", ".join("NaN" if np.isnan(x) else repr(x) for x in table[i])) for i in known]
    return _message(log, _STATE, rows) if rows else ""


def _folder(path: Path, files: Mapping[str, str]) -> Path:
    def fill(part: Path) -> None:
        part.mkdir(parents=True)
        for name, text in files.items():
            (part / name).write_text(text, encoding="utf-8", newline="")

    return replace_folder(path, fill, BOOK)


def replace_folder(path: Path, fill: Callable[[Path], None], own: str) -> Path:
    """Let ``fill`` make a folder beside ``path``, then give it that name; one of towtank's own is replaced.

    own : part of the name of a file by which a folder that towtank wrote is known; other folders are refused.

    Raises
    ------
    ArtefactError
        The folder cannot be written, or another one is there.
    """
    if path.exists() and not (path.is_dir() and _wrote(path, own)):
        raise ArtefactError(f"{path} is there and was not written by towtank. Choose another name, or move it away.")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(part, ignore_errors=True)
        fill(part)
        if path.exists():
            shutil.rmtree(path)
        part.replace(path)
    except OSError as error:
        raise ArtefactError(
            f"cannot write {path}: {error.strerror or error}. Choose a folder you may write to, or free some space."
        ) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return path


def _wrote(path: Path, own: str) -> bool:
    return any(own in file.name and b"towtank" in file.read_bytes() for file in path.iterdir() if file.is_file())


def write_iver(log: SeaLog, path: Path) -> Path:
    """A record as a log of Iver and EcoMapper: one row for each sample, cells between semicolons.

    Held: place, depth, attitude, speed, and orders of heading, depth and speed. Times are to 0.01 s, angles to
    0.01 deg, depth and speed to 0.001 m and knot, places to 1e-7 deg; columns of what a record does not hold are 0.

    Raises
    ------
    InputError
        Samples closer than 0.01 s: their times would be the same.
    ArtefactError
        The folder cannot be written.
    """
    stamps = np.round(log.time + (log.epoch or 0.0), 2)
    if not (np.diff(stamps) > 0.0).all():
        raise InputError(f"log {log.name}: samples closer than the 0.01 s of an Iver log. Write another format.")
    cells: dict[str, list[str]] = {}
    if log.has("x", "y"):
        latitude, longitude = latitude_longitude(log["x"], log["y"], log.datum or NOWHERE)
        cells["Latitude"], cells["Longitude"] = _cells(latitude * _DEG, 7), _cells(longitude * _DEG, 7)
    heading, ordered = log["psi"] % (2.0 * np.pi), log["heading_order"] % (2.0 * np.pi)
    for column, values, digits in (
        ("C True Heading", heading * _DEG, 2), ("Pitch Angle", log["theta"] * _DEG, 2),
        ("Roll Angle", log["phi"] * _DEG, 2), ("DFS Depth (m)", log["z"], 3),
        ("Vehicle Speed (kn)", log["speed"] / KNOT, 3), ("Next Heading", ordered * _DEG, 2),
        ("Next Speed (kn)", log["speed_order"] / KNOT, 3), ("Depth Goal (m)", log["depth_order"], 3),
    ):  # fmt: skip
        cells[column] = _cells(values, digits)
    moments = [datetime.datetime.fromtimestamp(at, tz=datetime.UTC) for at in stamps.tolist()]
    cells["Date"] = [f"{at.month}/{at.day}/{at.year}" for at in moments]
    cells["Time"] = [
        f"{at.hour}:{at.minute:02d}:{at.second:02d}.{round(at.microsecond / 1e4) % 100:02d}" for at in moments
    ]
    state = "SYNTHETIC" if log.synthetic else "N"
    fixed = {"Vehicle State": state, "Error State": state, "Batt State": "N", "Time to Empty": "0"}
    rows = [
        ";".join(cells[name][i] if name in cells else fixed.get(name, "0") for name in _IVER) + ";"
        for i in range(len(log.time))
    ]
    return write_text(path, "\r\n".join([";".join(_IVER) + ";", *rows]) + "\r\n")


def _cells(values: Array, digits: int) -> list[str]:
    return ["" if np.isnan(x) else f"{x:.{digits}f}" for x in values.tolist()]
