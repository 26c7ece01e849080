"""The file of a user-defined trial as pydantic models, and the words for what is seen in a run.

``docs/trials.md`` describes every key.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from towtank.errors import InputError

SCHEMA = "towtank/trial/1"
NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"
INDEX = r"^[a-z][a-z0-9_]*$"


@dataclass(frozen=True)
class Seen:
    """A quantity of the run: the engine's channel, its SI unit, the unit indices are given in and its factor."""

    channel: str
    unit: str
    shown: str
    factor: float = 1.0


_DEG = 57.29577951308232
SEEN: Mapping[str, Seen] = {
    "north": Seen("x", "m", "m"),
    "east": Seen("y", "m", "m"),
    "depth": Seen("z", "m", "m"),
    "roll": Seen("phi", "rad", "deg", _DEG),
    "pitch": Seen("theta", "rad", "deg", _DEG),
    "heading": Seen("psi", "rad", "deg", _DEG),
    "speed": Seen("speed", "m/s", "m/s"),
    "speed through water": Seen("ahead", "m/s", "m/s"),
    "turn": Seen("turn", "rad/s", "deg/s", _DEG),
    "pitch rate": Seen("q", "rad/s", "deg/s", _DEG),
    "depth rate": Seen("sink", "m/s", "m/s"),
    "drift": Seen("drift", "rad", "deg", _DEG),
}
"""What a command may wait for and an index may read."""
HELD: Mapping[str, Seen] = {
    "rudder": Seen("rudder", "rad", "deg", _DEG),
    "elevator": Seen("elevator", "rad", "deg", _DEG),
    "fin angle": Seen("fin_largest", "rad", "deg", _DEG),
}
"""What an index may read besides, over a command."""
TIME = "time"

Number = float | int | str
Text = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _given(table: BaseModel, keys: Iterable[str]) -> list[str]:
    return [key for key in keys if getattr(table, key) is not None]


STEERING, DIVING = ("rudder", "heading", "turn"), ("elevator", "depth", "pitch")
"""Orders that take each other's place."""


class CommandTable(_Table):
    """[[command]]: orders that stand from its beginning on, and its end."""

    name: Annotated[str, Field(pattern=NAME)] | None = None
    rudder: Number | None = None
    heading: Number | None = None
    turn: Number | None = None
    elevator: Number | None = None
    depth: Number | None = None
    pitch: Number | None = None
    throttle: Number | None = None
    lasting: Number | None = Field(None, alias="for")
    until: Text | None = None
    within: Number | None = None

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        for keys in (STEERING, DIVING):
            if len(some := _given(self, keys)) > 1:
                raise ValueError(f"{' and '.join(some)} are ordered together. Give one of {', '.join(keys)}")
        if (self.lasting is None) == (self.until is None):
            raise ValueError('it needs one end: for = "20 s" or "5 L", or until = "heading 90 deg"')
        if self.within is not None and self.until is None:
            raise ValueError("within is the longest wait for an until; a command with for has none")
        return self


class IndexTable(_Table):
    """[index.NAME]: a number read at the end of a command, over commands, or where a level is crossed."""

    of: Text
    at: Text | None = None
    since: Text | None = None
    take: Literal["largest", "smallest", "mean", "rms", "largest size"] | None = None
    during: Text | tuple[Text, ...] | None = None
    crossing: Literal["first", "last"] | None = None
    level: Number | None = None
    less: Number | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = _given(self, ("at", "take", "crossing"))
        if len(ways) != 1:
            raise ValueError(f"{' and '.join(ways) or 'none'} given. Give one of at, take, crossing")
        misplaced = {
            "since": self.at is None,
            "during": self.at is not None,
            "level": self.crossing is None,
            "less": self.crossing is not None or self.take == "largest size",
        }
        if wrong := [key for key in _given(self, misplaced) if misplaced[key]]:
            raise ValueError(f"{wrong[0]} does not go with {ways[0]}")
        if self.crossing and (self.level is None or not isinstance(self.during, str)):
            raise ValueError("a crossing needs a level and during, the name of one command")
        return self


class WaypointTable(_Table):
    """[[waypoint]]: a point to pass."""

    north: Number
    east: Number
    depth: Number = 0.0
    speed: Number | None = None


class TrialTable(_Table):
    """The whole file."""

    document: Literal["towtank/trial/1"] | None = Field(None, alias="schema")
    name: str = Field(pattern=NAME)
    title: str = ""
    speed: Number | None = None
    loop: Literal["open", "closed"] = "closed"
    current: Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)] | None = None
    command: tuple[CommandTable, ...] = ()
    waypoint: tuple[WaypointTable, ...] = ()
    index: Mapping[Annotated[str, Field(pattern=INDEX)], IndexTable] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if bool(self.command) == bool(self.waypoint):
            raise ValueError("it needs commands, [[command]], or waypoints, [[waypoint]], and not both")
        if self.waypoint and (self.index or self.loop == "open"):
            raise ValueError("a mission has its own indices and a pilot: leave [index] and loop out")
        return self


def read_trial(path: Path | str) -> TrialTable:
    """The file of a user-defined trial, its keys and words checked; numbers are converted where they are used.

    Raises
    ------
    InputError
        It cannot be read, is not TOML, or has faults; all of them are named.
    """
    path = Path(path)
    try:
        document = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}). Name the file of a trial.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(
            f'{path} is not a TOML file: {error}. Quantities with units need quotes, for example rudder = "10 deg".'
        ) from None
    try:
        return TrialTable.model_validate(_listed(document))
    except ValidationError as error:
        faults = list(dict.fromkeys(_fault(item) for item in error.errors()))
        raise InputError(f"{path}:\n" + "\n".join(f"  {fault}" for fault in faults)) from None


def _listed(value: Any) -> Any:
    """TOML's lists as tuples, which a strict model takes."""
    if isinstance(value, Mapping):
        return {key: _listed(item) for key, item in value.items()}
    return tuple(_listed(item) for item in value) if isinstance(value, list) else value


_TABLES: Mapping[str, type[BaseModel]] = {"command": CommandTable, "waypoint": WaypointTable, "index": IndexTable}


def _fault(error: Any) -> str:
    location = [
        part for part in error["loc"] if not (isinstance(part, str) and re.search(r"[\[(]|^(str|int|float)$", part))
    ]
    path = ""
    for part in location:
        path += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if path else str(part)
    path, kind, context = path or "file", error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        owner = _TABLES.get(str(location[0]), TrialTable) if len(location) > 1 else TrialTable
        keys = [info.alias or key for key, info in owner.model_fields.items()]
        return f"{path}: unknown key. {closest(str(location[-1]), keys)}"
    if kind == "missing":
        return f"{path}: this key is missing. Add it."
    if kind == "literal_error":
        return f"{path}: {error['input']!r} is not one of {context['expected']}."
    if kind == "string_pattern_mismatch":
        use = (
            "small letters, digits and underscore"
            if location[0] == "index"
            else "letters, digits, dash, dot, underscore"
        )
        return f"{path}: {error['input']!r} is no short name. Use {use}."
    if kind == "value_error":
        return f"{path}: {str(context['error']).rstrip('.')}."
    if kind in ("model_type", "tuple_type", "mapping_type"):
        return f"{path}: {error['input']!r} is not a table, or not a list of tables. Write [[command]] or [index.name]."
    return f"{path}: {error['input']!r} {error['msg'].replace('Input should', 'should').lower()}."


def closest(name: str, words: Iterable[str]) -> str:
    """What may have been meant by ``name``."""
    words = list(words)
    near = difflib.get_close_matches(name, words, n=1, cutoff=0.5)
    return f"Did you mean {near[0]}?" if near else f"Known here: {', '.join(words)}."
