"""A log opened: what format it is of, the mapping that reads it, the craft it names, and its content as it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from towtank.craft.craft import Craft
from towtank.craft.library import library_names, read_craft
from towtank.errors import ArtefactError, InputError
from towtank.field.files import SCHEMA as OWN
from towtank.field.files import read_log
from towtank.field.log import FINS, SeaLog
from towtank.field.reading.alog import read_alog
from towtank.field.reading.arrays import lane, mat_note, read_mat_log, read_netcdf_log
from towtank.field.reading.imc import read_imc
from towtank.field.reading.mapping import Channel, LogMap
from towtank.field.reading.mapping_file import READY, read_map
from towtank.field.reading.raw import Raw
from towtank.field.reading.ros import read_ros, topics_of
from towtank.field.reading.text import NOTE, read_delimited_log
from towtank.tank.imported.table import read_bytes

ENDINGS: Mapping[str, str] = {".nc": "netcdf", ".mat": "mat", ".alog": "alog", ".bag": "ros", ".h5": "netcdf"}
"""Ending of a file -> format; all others are text."""
_IVER = ("latitude;longitude;", "c true heading")
_IMC = "timestamp (seconds since 01/01/1970)"


@dataclass(frozen=True)
class Opened:
    """A log before the gate.

    channels : quantity -> how it is read, fins by their number, without optional ones that the file does not hold.
    """

    raw: Raw
    mapping: LogMap
    channels: Mapping[str, Channel]
    craft: Craft | None
    format: str
    mapping_name: str
    said: tuple[str, ...] = ()

    def place(self, channel: Channel) -> tuple[str, str]:
        """Group and column of a channel."""
        if self.format in ("netcdf", "mat"):
            return lane(channel, self.mapping), channel.column
        return self.raw.split(channel.column)


def opened(path: Path, mapping: Path | str | LogMap | None, craft: str | Path | None) -> Opened | SeaLog:
    """A log with its mapping; a log of towtank's own netCDF as it is.

    Raises
    ------
    InputError
        No such file, no mapping where one is needed, or a mapping that does not fit.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist. Give a log file, or the folder of a ROS 2 bag or of IMC messages.")
    form, ready = _known(path)
    if form == "own":
        if mapping is not None and str(mapping) != "towtank":
            raise InputError(f"{path} is a log of towtank: its channels are known. Leave the mapping out.")
        return read_log(path)
    if mapping is None and not ready:
        raise InputError(
            f"{path}: its columns are not known, so a mapping must say what they hold. `towtank log --template "
            f"{form} > map.toml` writes one to edit; then --map map.toml.{_shown(path, form)}"
        )
    found = read_map(mapping if mapping is not None else ready)
    form = found.format or form
    name = str(mapping) if isinstance(mapping, str | Path) else ready or "given"
    owner = _craft(found, mapping, craft)
    channels = _numbered(found.channels, owner)
    numbered = found.model_copy(update={"channels": channels})
    raw = _read(path, form, numbered)
    kept, said = _present(raw, form, numbered)
    words = [*([found.note] if found.note else []), *(f"assumed: {text}" for text in found.assumes), *said]
    return Opened(raw, numbered, kept, owner, form, Path(name).name, tuple(words))


def _known(path: Path) -> tuple[str, str]:
    """Format of a file or folder, and the ready schema that reads it, or ""."""
    if path.is_dir():
        if (path / "metadata.yaml").exists() or list(path.glob("*.db3")) or list(path.glob("*.mcap")):
            return "ros", "ros" if any(topic.startswith("/towtank/") for topic in topics_of(path)) else ""
        return "imc", "imc"
    form = ENDINGS.get(path.suffix.lower(), "csv")
    if form == "netcdf":
        return ("own", "") if _is_own(path) else (form, "")
    if form == "mat":
        return form, "towtank" if "towtank" in mat_note(path) else ""
    if form == "ros":
        return form, "ros" if any(topic.startswith("/towtank/") for topic in topics_of(path)) else ""
    if form == "alog":
        return form, "moos"
    head = read_bytes(path)[:4000].decode("utf-8", errors="replace").lower()
    if _IMC in head.partition("\n")[0]:
        return "imc", "imc"
    if head.startswith("# towtank/sea-log-csv/1") or f"# {NOTE}" in head:
        return form, "towtank"
    first = next((line for line in head.splitlines() if line.strip()), "")
    return form, "iver" if all(word in first for word in _IVER) else ""


def _is_own(path: Path) -> bool:
    from towtank.netcdf import decode

    try:
        return bool(decode(read_bytes(path))[1].get("schema") == OWN)
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise ArtefactError(
            f"{path} is not a whole netCDF-4 file ({error}). Copy it again from the craft; an older netCDF-3 file is "
            "turned by nccopy -k 4."
        ) from None


def _shown(path: Path, form: str) -> str:
    if form != "csv":
        return ""
    from towtank.field.reading.mapping import Text

    names = read_delimited_log(path, Text()).groups[""].table.names
    return f" The file has {', '.join(repr(name) for name in names[:24])}."


def _craft(found: LogMap, mapping: Path | str | LogMap | None, craft: str | Path | None) -> Craft | None:
    source = craft if craft is not None else found.craft
    if not source:
        return None
    if craft is None and isinstance(mapping, str | Path) and str(source) not in library_names():
        beside = Path(mapping).parent / str(source)
        source = beside if beside.exists() else source
    return read_craft(source)


def _numbered(channels: Mapping[str, Channel], craft: Craft | None) -> dict[str, Channel]:
    """Channels of fins that are called by their names, by their numbers in the craft file."""
    out = {}
    for key, channel in channels.items():
        word, colon, fin = key.partition(":")
        if not colon:
            out[key] = channel
            continue
        names = [item.name for item in craft.fins] if craft else []
        if fin not in names or names.index(fin) >= FINS:
            known = ", ".join(names) if craft else "none without a craft: name it"
            raise InputError(f"channels.{key}: no fin {fin!r}. The fins are {known}.")
        out[f"{word}{names.index(fin) + 1}"] = channel
    return out


def _read(path: Path, form: str, mapping: LogMap) -> Raw:
    wanted: dict[str, list[str]] = {}
    for channel in mapping.channels.values():
        group, _, column = channel.column.partition(":")
        fields = wanted.setdefault(group, [])
        if column not in fields:
            fields.append(column)
    match form:
        case "netcdf":
            return read_netcdf_log(path, mapping)
        case "mat":
            return read_mat_log(path, mapping)
        case "alog":
            return read_alog(path)
        case "ros":
            sparse = all(channel.optional for channel in mapping.channels.values())
            return read_ros(path, wanted, sparse)
        case "imc":
            return read_imc(path, frozenset(wanted))
        case _:
            return read_delimited_log(path, mapping.text)


def _present(raw: Raw, form: str, mapping: LogMap) -> tuple[dict[str, Channel], list[str]]:
    """Channels that the file holds; and which optional ones it does not.

    Raises
    ------
    InputError
        None is held, or one that must be is not.
    """
    kept, lacking = {}, []
    for key, channel in mapping.channels.items():
        if form in ("netcdf", "mat"):
            group = raw.groups.get(lane(channel, mapping))
            held = group is not None and group.table.holds(channel.column)
        else:
            held = raw.has(channel.column) and _any_row(raw, channel)
        if held or not channel.optional:
            if not held:
                group = raw.group(channel.column)
                group.table.find(raw.split(channel.column)[1])
            kept[key] = channel
        else:
            lacking.append(key)
    if not kept:
        some = ", ".join(dict.fromkeys(channel.column for channel in mapping.channels.values())) or "none"
        raise InputError(f"{raw.title}: none of the mapped columns is in it ({some}). Correct [channels].")
    return kept, [f"not in the file: {', '.join(lacking)}"] if lacking else []


def _any_row(raw: Raw, channel: Channel) -> bool:
    """Whether an optional channel has rows as its ``where`` says."""
    from towtank.field.reading.values import rows_where

    group = raw.group(channel.column)
    if not all(name in group.texts or group.table.holds(name) for name in channel.where):
        return False
    return not channel.optional or len(rows_where(group, channel)) > 0


def lane_of(channel: Channel, found: Opened) -> tuple[str, ...]:
    """What rows a channel is read from and by which clock."""
    return (found.place(channel)[0], *clock_of(channel, found), *(f"{k}={v}" for k, v in channel.where.items()))


def clock_of(channel: Channel, found: Opened) -> list[str]:
    """Columns of the time of a channel; none where the file times its rows itself."""
    if found.format in ("alog", "ros"):
        return []
    return [channel.time] if channel.time else list(found.mapping.clock.columns)


__all__ = ["READY", "Opened", "clock_of", "lane_of", "opened"]
