"""What a mapping says of a log, as pydantic models. ``docs/sea-logs.md`` describes every key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from towtank.field.log import CHANNELS

SCHEMA = "towtank/sea-log/1"
FORMATS = ("csv", "netcdf", "mat", "alog", "ros", "imc")
CONVENTIONS: Mapping[str, tuple[tuple[str, str, str], tuple[str, str, str]]] = {
    "ned": (("x", "y", "z"), ("x", "y", "z")),
    "ros": (("x", "-y", "-z"), ("y", "x", "-z")),
}
"""Word -> the file's body axes that point forward, starboard, down; its world axes that point north, east, down."""

GIVEN: Mapping[str, tuple[str, str]] = {
    **CHANNELS,
    "latitude": ("rad", "latitude"), "longitude": ("rad", "longitude"), "pressure": ("Pa", "absolute pressure"),
    "qw": ("1", "attitude quaternion, scalar part"), "qx": ("1", "attitude quaternion"),
    "qy": ("1", "attitude quaternion"), "qz": ("1", "attitude quaternion"),
    "vn": ("m/s", "velocity over ground along world x"), "ve": ("m/s", "velocity over ground along world y"),
    "vd": ("m/s", "velocity over ground along world z"),
}  # fmt: skip
"""What a column may be mapped to -> SI unit, meaning: the channels of a record and what they are made from."""

Number = float | int | str
Axes = tuple[str, str, str]


def _columns(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _column(value: Any) -> Any:
    return {"column": value} if isinstance(value, str) else value


class Clause(BaseModel):
    """A table of a mapping: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Counts(Clause):
    """Counts of a servo or a converter: value = (count - zero) / per_unit, in ``unit``."""

    zero: float
    per_unit: float
    unit: str


class Channel(Clause):
    """Where a channel stands and how its numbers are read.

    column : its name; "TOPIC:field" where a file has several tables.   unit : where the file does not say it.
    counts, points : of raw counts; two or more points (raw, value).
    factor, offset : value = factor * number + offset.
    missing : numbers that stand for nothing measured.   where : only rows in which other columns hold these values.
    sensor : of ``sensors``, whose place the channel belongs to.   magnetic : from magnetic north.
    held : a value that repeats the last one was not measured anew.   hold : a value stands until the next one.
    time : a clock column of its own.
    std, bias, assumed : of the noise.   limits : what it can be.   optional : may be absent.
    """

    column: Annotated[str, Field(min_length=1)]
    unit: str = ""
    counts: Counts | None = None
    points: Annotated[list[tuple[float, Number]], Field(min_length=2)] | None = None
    factor: float = 1.0
    offset: Number | None = None
    missing: list[float] = []
    where: dict[str, str | float] = {}
    sensor: str = ""
    magnetic: bool = False
    held: bool = False
    hold: bool = False
    time: str = ""
    std: Number | None = None
    bias: Number | None = None
    assumed: bool = False
    limits: tuple[Number, Number] | None = None
    optional: bool = False


class Clock(Clause):
    """How times are read.

    columns : those of the time; date first, then time of day; or week, then seconds of GPS.   unit : of numbers.
    kind : "elapsed" (any zero), "epoch" (since 1970, UTC), "iso", "date" (date and time of day), "time of day", "gps",
    "matlab" (days).   order : of the parts of a date.   utc_offset : of the clock ahead of UTC.   leap_seconds : GPS
    ahead of UTC.   reset : what is done with samples after a clock that goes back: "keep out" or "continue".
    within : stamps of several tables that are one instant.   step : of uniform ticks on which they are put.
    """

    columns: Annotated[list[str], BeforeValidator(_columns)] = []
    kind: Literal["elapsed", "epoch", "iso", "date", "time of day", "gps", "matlab"] = "elapsed"
    unit: str = "s"
    order: Literal["ymd", "mdy", "dmy"] = "ymd"
    utc_offset: Number = 0.0
    leap_seconds: int = 18
    reset: Literal["keep out", "continue"] = "keep out"
    within: Number = 1e-4
    step: Number | None = None


class Sensor(Clause):
    """Place of a sensor: aft of the nose, or from the body origin, along body axes x forward, y starboard, z down."""

    from_nose: Number | None = None
    x: Number | None = None
    y: Number = 0.0
    z: Number = 0.0


class Datum(Clause):
    """Latitude and longitude of x = y = 0."""

    latitude: Number
    longitude: Number


class Text(Clause):
    """How a table of text is laid out, where it cannot be told from the file."""

    separator: str = ""
    skip: Annotated[int, Field(ge=0)] = 0


class Pressure(Clause):
    """Depth from pressure: (pressure - surface) / (density g)."""

    surface: Number = 101325.0
    density: Number = 1025.0


class LogMap(Clause):
    """A whole mapping."""

    document: Annotated[Literal["towtank/sea-log/1"], Field(alias="schema")]
    extends: str = ""
    format: Literal["csv", "netcdf", "mat", "alog", "ros", "imc"] | None = None
    name: str = ""
    craft: str = ""
    synthetic: bool = False
    convention: Literal["ned", "ros"] = "ned"
    body: Axes | None = None
    world: Axes | None = None
    fins: Literal["towtank", "vehicle"] = "towtank"
    declination: Number = 0.0
    datum: Datum | None = None
    offsets: bool = False
    clock: Clock = Clock()
    text: Text = Text()
    pressure: Pressure = Pressure()
    sensors: dict[str, Sensor] = {}
    channels: dict[str, Annotated[Channel, BeforeValidator(_column)]] = {}
    note: str = ""
    assumes: list[str] = []

    @property
    def axes(self) -> tuple[Axes, Axes]:
        """The file's body axes and world axes that point along ours."""
        body, world = CONVENTIONS[self.convention]
        return self.body or body, self.world or world
