"""Logs in netCDF and MAT files: each mapped variable with those of its own clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from towtank.errors import InputError
from towtank.field.reading.mapping import Channel, LogMap
from towtank.field.reading.raw import Group, Raw
from towtank.tank.imported.arrays import read_mat_columns, read_netcdf_columns
from towtank.tank.imported.table import Table

Read = Callable[[Path, Sequence[str]], Table]


def read_netcdf_log(path: Path, mapping: LogMap) -> Raw:
    """A log in a netCDF file; variables beside different clocks may differ in length.

    Raises
    ------
    InputError
        Damaged, no such variable, or variables of one clock that differ in length.
    """
    return Raw(path.name, _groups(path, mapping, read_netcdf_columns))


def read_mat_log(path: Path, mapping: LogMap) -> Raw:
    """A log in a MAT file of any version.

    Raises
    ------
    InputError
        As ``read_netcdf_log``.
    """
    return Raw(path.name, _groups(path, mapping, read_mat_columns), None, mat_note(path))


def mat_note(path: Path) -> Mapping[str, Any]:
    """What towtank says of its own MAT file, in the variable ``towtank``; nothing in those of others."""
    import json

    from scipy.io import loadmat

    try:
        found = loadmat(path, variable_names=["towtank"], squeeze_me=True).get("towtank")
        note = json.loads(str(found)) if found is not None else {}
    except Exception:  # scipy raises many kinds on damaged files and on those of version 7.3: they hold no note
        return {}
    return note if isinstance(note, dict) else {}


def _groups(path: Path, mapping: LogMap, read: Read) -> dict[str, Group]:
    """Clock columns -> the table beside them. ``lane`` names the groups in the same way."""
    wanted: dict[str, list[str]] = {}
    for channel in mapping.channels.values():
        names = wanted.setdefault(lane(channel, mapping), clock_columns(channel, mapping))
        for name in (channel.column, *channel.where):
            if name not in names and (not channel.optional or _holds(path, name, read)):
                names.append(name)
    found = {key: Group(read(path, names)) for key, names in wanted.items()}
    return {"": found[""]} if list(found) == [""] else found


def clock_columns(channel: Channel, mapping: LogMap) -> list[str]:
    """Columns of the time of a channel."""
    return [channel.time] if channel.time else list(mapping.clock.columns)


def lane(channel: Channel, mapping: LogMap) -> str:
    """Name of the group of a channel: that of its clock; "" for the common one."""
    return channel.time if channel.time and [channel.time] != list(mapping.clock.columns) else ""


def _holds(path: Path, name: str, read: Read) -> bool:
    try:
        read(path, [name])
    except InputError:
        return False
    return True
