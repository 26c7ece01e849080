"""The file of the instruments of a synthetic record. ``docs/sea-synthetic.md`` describes every key."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from towtank.errors import InputError
from towtank.field.log import CHANNELS
from towtank.field.sea_log import STANDARD, Instrument, Instruments
from towtank.pilot.sensors import Reading
from towtank.quantity import si

SCHEMA = "towtank/instruments/1"
_Number = float | int | str


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class _Instrument(_Table):
    """[[instrument]]: channels of one unit, and how well they are read."""

    channels: Annotated[tuple[str, ...], Field(min_length=1)]
    period: _Number = 0.0
    std: _Number = 0.0
    bias: _Number = 0.0
    step: _Number = 0.0
    dropout: float | int = 0.0
    lasting: _Number = 0.0
    latency: _Number = 0.0


class _File(_Table):
    """The whole file."""

    document: Literal["towtank/instruments/1"] = Field(alias="schema")
    start: Literal["standard", "exact"] = "standard"
    period: _Number | None = None
    jitter: _Number = 0.0
    outages: _Number = 0.0
    outage: _Number = 0.0
    left_out: tuple[str, ...] | None = None
    assumed: bool = True
    instrument: tuple[_Instrument, ...] = ()


def read_instruments(path: Path | str) -> Instruments:
    """The instruments of a file: those of ``STANDARD``, or none, with those of the file in their places.

    Raises
    ------
    InputError
        It cannot be read, is not TOML, or has faults.
    """
    path = Path(path)
    try:
        table = _File.model_validate(_listed(tomllib.loads(path.read_text("utf-8"))))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}). Name a file of instruments.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f'{path} is not a TOML file: {error}. Quantities need quotes: std = "1 deg".') from None
    except ValidationError as error:
        faults = [f"  {'.'.join(map(str, item['loc']))}: {item['msg'].lower()}" for item in error.errors()]
        raise InputError(f"{path}: see docs/sea-synthetic.md for the keys.\n" + "\n".join(faults)) from None
    own = tuple(_made(item, f"{path}, instrument {i}") for i, item in enumerate(table.instrument, start=1))
    taken = {name for item in own for name in item.channels}
    kept = [] if table.start == "exact" else [_without(item, taken) for item in STANDARD.items]
    return Instruments(
        items=(*(item for item in kept if item), *own),
        period=STANDARD.period if table.period is None else si(table.period, "s", f"{path}, period"),
        jitter=si(table.jitter, "s", f"{path}, jitter"), outages=si(table.outages, "1/s", f"{path}, outages"),
        outage=si(table.outage, "s", f"{path}, outage"),
        left_out=STANDARD.left_out if table.left_out is None else table.left_out, assumed=table.assumed,
    )  # fmt: skip


def _listed(value: Any) -> Any:
    """TOML's lists as tuples, which a strict model takes."""
    if isinstance(value, Mapping):
        return {key: _listed(item) for key, item in value.items()}
    return tuple(_listed(item) for item in value) if isinstance(value, list) else value


def _made(item: _Instrument, where: str) -> Instrument:
    """An instrument from its table."""
    units = {CHANNELS[name][0] for name in item.channels if name in CHANNELS}
    if len(units) > 1:
        raise InputError(
            f"{where}: {', '.join(item.channels)} have the units {', '.join(sorted(units))}. Give channels of one unit."
        )
    unit = next(iter(units), "")

    def sized(key: str) -> float:
        return si(getattr(item, key), "" if unit == "1" else unit, f"{where}, {key}")

    def lasting(key: str) -> float:
        return si(getattr(item, key), "s", f"{where}, {key}")

    if not units:
        return Instrument(item.channels)
    return Instrument(
        item.channels, Reading(lasting("period"), sized("std"), sized("bias")), sized("step"), float(item.dropout),
        lasting("lasting"), lasting("latency"),
    )  # fmt: skip


def _without(item: Instrument, taken: set[str]) -> Instrument | None:
    """``item`` without the channels that are ``taken``; None when nothing is left."""
    left = tuple(name for name in item.channels if name not in taken)
    return replace(item, channels=left) if left else None
