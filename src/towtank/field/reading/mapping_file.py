"""Mapping files and ready schemas: TOML to ``LogMap``, every fault with its place and remedy."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from towtank.errors import InputError
from towtank.field.log import CHANNELS
from towtank.field.reading.mapping import GIVEN, SCHEMA, Channel, Clock, Counts, Datum, LogMap, Sensor, Text

READY = ("imc", "iver", "moos", "ros", "towtank")
"""Schemas that come with the package."""

_CLAUSES: Mapping[str, type[BaseModel]] = {
    "clock": Clock, "text": Text, "datum": Datum, "sensors": Sensor, "channels": Channel, "counts": Counts,
}  # fmt: skip


def read_map(source: Path | str | LogMap) -> LogMap:
    """A mapping: the name of a ready schema, or the path of a TOML file.

    Raises
    ------
    InputError
        Missing, not TOML, another schema, an unknown or missing key, a wrong value; all faults at once.
    """
    if isinstance(source, LogMap):
        return source
    if str(source) in READY:
        return map_of(_ready(str(source)), f"schema {source!r}")
    path = Path(source)
    try:
        return map_of(tomllib.loads(path.read_text(encoding="utf-8")), path.name)
    except FileNotFoundError:
        raise InputError(
            f"mapping {path} does not exist, and no ready schema has this name ({', '.join(READY)}). "
            f"`towtank log --template csv > {path.name}` writes one to edit."
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path} is not a readable TOML file ({error}). Texts and quantities with units need quotes, as in "
            'std = "0.5 deg".'
        ) from None


def map_of(document: Mapping[str, Any], where: str) -> LogMap:
    """A mapping from the content of its file; keys of the schema that it extends come behind its own.

    Raises
    ------
    InputError
        As ``read_map``.
    """
    content = dict(document)
    if content.get("schema") != SCHEMA:
        raise InputError(
            f"{where}: schema {content.get('schema')!r}, wanted {SCHEMA!r}. `towtank log --template csv` shows one."
        )
    if base := content.get("extends"):
        if base not in READY:
            raise InputError(f"{where}: extends = {base!r} is no ready schema. Those are {', '.join(READY)}.")
        content = _merged(_ready(base), content)
    try:
        found = LogMap.model_validate(content)
    except ValidationError as error:
        faults = list(dict.fromkeys(_fault(item) for item in error.errors()))
        raise InputError(f"{where}: " + "\n  ".join(faults)) from None
    _check(found, where)
    return found


def _ready(name: str) -> dict[str, Any]:
    """The content of a ready schema; a log holds as many of its channels as it does."""
    if name == "towtank":
        own = {key: {"column": key, "unit": "" if unit == "1" else unit} for key, (unit, _) in CHANNELS.items()}
        document: dict[str, Any] = {"schema": SCHEMA, "clock": {"columns": ["time"]}, "channels": own}
    else:
        place = resources.files("towtank.field.reading").joinpath("schemas", f"{name}.toml")
        document = tomllib.loads(place.read_text(encoding="utf-8"))
    for key, channel in document["channels"].items():
        table = {"column": channel} if isinstance(channel, str) else channel
        document["channels"][key] = {**table, "optional": True}
    return document


def _merged(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in own.items():
        both = isinstance(value, dict) and isinstance(base.get(key), dict) and key in ("clock", "channels", "sensors")
        out[key] = {**base[key], **value} if both else value
    return out


def _check(found: LogMap, where: str) -> None:
    for key, channel in found.channels.items():
        if key not in GIVEN and not key.startswith(("delta:", "command:")):
            raise InputError(f"{where}, channels: no channel {key!r}. {closest(key, GIVEN)}")
        if channel.sensor and channel.sensor not in found.sensors:
            raise InputError(
                f"{where}, channels.{key}: no sensor {channel.sensor!r}. State its place in [sensors.{channel.sensor}]."
            )
        if channel.counts and channel.points:
            raise InputError(f"{where}, channels.{key}: counts and points are given together. Write one of them.")
    for name, sensor in found.sensors.items():
        if (sensor.from_nose is None) == (sensor.x is None):
            raise InputError(
                f"{where}, sensors.{name}: give from_nose, aft of the nose, or x, forward of the body origin; one."
            )


def _fault(error: Any) -> str:
    where = ".".join(str(part) for part in error["loc"]) or "mapping"
    key = str(error["loc"][-1]) if error["loc"] else ""
    if error["type"] == "extra_forbidden":
        owner = _CLAUSES.get(str(error["loc"][0]), LogMap) if len(error["loc"]) > 1 else LogMap
        return f"{where}: unknown key. {closest(key, ('schema', *owner.model_fields))}"
    if error["type"] == "missing":
        return f"{where}: this key is missing. Add it."
    if error["type"] == "literal_error":
        return f"{where}: {error['input']!r} is not one of {error['ctx']['expected']}."
    return f"{where}: {error['input']!r} {str(error['msg']).replace('Input should', 'should')}."


def closest(word: str, words: Iterable[str]) -> str:
    """A hint at what was meant."""
    known = list(words)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    return f"Did you mean {near[0]!r}?" if near else f"Known: {', '.join(known)}."
