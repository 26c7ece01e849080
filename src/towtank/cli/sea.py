"""``towtank sea``: a record of a craft at sea that is made up, and says so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Speed
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.field.log import SeaLog
    from towtank.field.sea import Swim
    from towtank.field.sea_log import Instruments
    from towtank.field.sea_trials import SeaTrial
    from towtank.field.sea_water import Environment
    from towtank.model.equations import Model


class Format(StrEnum):
    """Formats on offer."""

    NETCDF = "netcdf"
    CSV = "csv"
    MAT = "mat"
    ALOG = "alog"
    ROS1 = "ros1"
    ROS2 = "ros2"
    IMC = "imc"
    IVER = "iver"


SPEEDY = (Format.ALOG, Format.IVER)
"""Formats whose craft tell one speed and no velocities."""


def _option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, show_default=False)


CraftWord = Annotated[
    str,
    typer.Argument(
        metavar="STUDY|CRAFT",
        help="A study folder with its derivatives, a craft of the library or a craft.toml (then the fast tank).",
        show_default=False,
    ),
]
TrialWord = Annotated[
    str,
    _option(
        "NAME|FILE.toml",
        "survey (identification mission), a standard trial such as zigzag10 or lawnmower, or a trial of your own.",
    ),
]
Current = Annotated[
    str | None, _option("N,E[,D]", 'Mean current to the north, east and down, such as "0.2 m/s, -0.1 m/s".')
]
Shear = Annotated[
    str | None, _option("N[,E]", 'Gain of the north and east current with depth, such as "0.01 1/s, 0 1/s".')
]
Turbulence = Annotated[
    str | None,
    _option("STD[,STD,STD]", 'Standard deviation of the eddies, one or north, east, down, such as "0.03 m/s".'),
]
Eddies = Annotated[
    str | None, _option("TIME|LENGTH", 'How long an eddy lasts, "20 s", or how long it is, "30 m". Default: 20 s.')
]
Minutes = Annotated[float | None, _option("MIN", "Length of the survey. Default: 10.")]
InstrumentsWord = Annotated[
    str, typer.Option("--instruments", metavar="standard|exact|FILE.toml", help="What measures, and how well.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="The same seed gives the same record.")]
FormatWord = Annotated[Format, typer.Option("--format", help="Of the file.")]
Datum = Annotated[
    str | None, _option("LAT,LON", 'Where north = east = 0 is, such as "36.9 deg, -75.8 deg". Default: not said.')
]
Start = Annotated[str | None, _option("TIME", "UTC of the first row, such as 2026-05-01T08:00:00. Default: not said.")]
Out = Annotated[
    Path | None,
    _option("FILE", "Where it goes; its name gets -synthetic. Default: <craft>-<trial>-synthetic in this folder."),
]
Truth = Annotated[Path | None, _option("FILE.nc", "The same swim without any error of measurement, too.")]


def sea(
    craft: CraftWord,
    trial: TrialWord = "survey",
    current: Current = None,
    shear: Shear = None,
    turbulence: Turbulence = None,
    eddies: Eddies = None,
    seed: Seed = 0,
    minutes: Minutes = None,
    speed: Speed = None,
    instruments: InstrumentsWord = "standard",
    datum: Datum = None,
    start: Start = None,
    format: FormatWord = Format.NETCDF,
    out: Out = None,
    truth: Truth = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Make up a record of a craft at sea: a trial in a current, seen through instruments.

    The record is synthetic, and its name, level and provenance say so.

    Example: towtank sea hokie --trial zigzag10 --current "0.2 m/s, 0 m/s" --turbulence "0.03 m/s" --seed 1
    """
    with answering("sea", json, debug) as reply:
        from towtank.field.sea import swim
        from towtank.field.sea_log import EXACT
        from towtank.field.sea_trials import trial_called
        from towtank.field.writing import write_as

        _check_name(out, format)
        when, where = _epoch(start), _datum(datum)
        measuring = _instruments(instruments)
        measuring = replace(measuring, left_out=()) if format in SPEEDY else measuring
        water, lasting = _environment(current, shear, turbulence, seed), _lasting(eddies)
        chain = open_chain(reply, craft, None).keep_speed()
        reply.files.pop("study", None)
        chosen = trial_called(_model(chain, reply), trial, minutes=minutes, speed=speed, seed=seed)
        water = replace(water, correlation=lasting(chosen.ready.setting.speed))
        swum = swim(chosen.model, chosen.ready, water, progress=reply.progress)
        log = _observed(swum, chosen, measuring, seed, when, where)
        reply.file("log", write_as(log, out or Path(f"{log.craft}-{log.name}"), format.value))
        if truth is not None:
            exact = _observed(swum, chosen, EXACT, seed, when, where)
            reply.file("truth", write_as(exact, truth, Format.NETCDF.value))
        _tell(reply, swum, log, chosen)


def _model(chain: Chain, reply: Reply) -> Model:
    """The model of the study; where it has no derivatives yet, that of the fast tank."""
    from towtank.derive.derive import derive
    from towtank.model.equations import Model
    from towtank.plan.standard import standard_plan
    from towtank.tank.campaign import tow
    from towtank.tank.fast.tank import FastTank

    if chain.study.derivatives.exists():
        reply.log(f"derivatives from {chain.study.derivatives}")
        return chain.model()
    reply.log(f"{chain.study.derivatives} does not exist; derivatives from the fast tank")
    return Model(chain.craft, derive(tow(standard_plan(chain.craft), FastTank(), progress=reply.progress)))


def _environment(current: str | None, shear: str | None, turbulence: str | None, seed: int) -> Environment:
    """The water that the options describe.

    Raises
    ------
    InputError
        An option that cannot be read.
    """
    from towtank.field.sea_water import Environment

    flow = _numbers(current, "m/s", "--current", (2, 3))
    slope = _numbers(shear, "1/s", "--shear", (1, 2))
    spread = _numbers(turbulence, "m/s", "--turbulence", (1, 3))
    north, east, down = (*flow, 0.0, 0.0, 0.0)[:3]
    by_north, by_east = (*slope, 0.0, 0.0)[:2]
    of_north, of_east, of_down = (spread * 3 if len(spread) == 1 else (*spread, 0.0, 0.0, 0.0))[:3]
    return Environment((north, east, down), (by_north, by_east), turbulence=(of_north, of_east, of_down), seed=seed)


def _numbers(text: str | None, unit: str, where: str, counts: tuple[int, ...]) -> tuple[float, ...]:
    """Numbers of a list such as ``"0.1 m/s, 0.2 m/s"``; none of no text."""
    from towtank.quantity import si

    if text is None:
        return ()
    parts = [part.strip() for part in text.split(",")]
    if len(parts) not in counts:
        raise InputError(f'{where} "{text}": give {" or ".join(map(str, counts))} numbers with commas between them.')
    return tuple(si(_bare(part), unit, where) for part in parts)


def _bare(text: str) -> float | str:
    """A number without a unit as a number, so that the gate for units treats it as such."""
    try:
        return float(text)
    except ValueError:
        return text


def _lasting(text: str | None) -> Callable[[float], float]:
    """Speed [m/s] -> correlation time [s], of a time, or of a length that is passed at this speed.

    Raises
    ------
    InputError
        Neither a time nor a length, or not above zero.
    """
    from towtank.field.sea_water import LASTING, passing_time
    from towtank.quantity import si

    if text is None:
        return lambda speed: LASTING
    try:
        length = si(_bare(text), "m", "--eddies")
    except InputError:
        length = 0.0
    if length > 0.0 and isinstance(_bare(text), str):
        return lambda speed: passing_time(length, speed)
    try:
        time = si(_bare(text), "s", "--eddies")
    except InputError:
        time = 0.0
    if time <= 0.0:
        raise InputError(f'--eddies {text}: give a time such as "20 s" or a length such as "30 m", above zero.')
    return lambda speed: time


def _instruments(word: str) -> Instruments:
    from towtank.field.sea_files import read_instruments
    from towtank.field.sea_log import EXACT, STANDARD

    known = {"standard": STANDARD, "exact": EXACT}
    if word in known:
        return known[word]
    if not word.endswith(".toml"):
        raise InputError(f"--instruments {word}: give {', '.join(known)}, or a file that ends in .toml.")
    return read_instruments(word)


def _datum(text: str | None) -> tuple[float, float] | None:
    from math import pi

    if text is None:
        return None
    latitude, longitude = _numbers(text, "rad", "--datum", (2,))
    if abs(latitude) > pi / 2.0 or abs(longitude) > pi:
        raise InputError(f'--datum "{text}": latitude lies within 90 deg, longitude within 180 deg, north and east up.')
    return latitude, longitude


def _epoch(text: str | None) -> float | None:
    from datetime import UTC, datetime

    if text is None:
        return None
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(f"--start {text}: no time. Write it as 2026-05-01T08:00:00, in UTC.") from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def _observed(
    swum: Swim, chosen: SeaTrial, instruments: Instruments, seed: int, epoch: float | None,
    datum: tuple[float, float] | None,
) -> SeaLog:  # fmt: skip
    from towtank.field.sea_log import observe

    return observe(swum, instruments, seed, epoch=epoch, datum=datum, notes=chosen.notes)


def _check_name(out: Path | None, format: Format) -> None:
    """Refuse a name with the ending of another format."""
    from towtank.field.writing import FORMATS

    if out is None or (own := FORMATS[format.value][0]) == out.suffix or not out.suffix:
        return
    if out.suffix in {ending for ending, _ in FORMATS.values()}:
        raise InputError(
            f"--out {out} is no name of the format {format.value}, which ends in {own or 'nothing: it is a folder'}. "
            "Change the name, or the format with --format."
        )


def _tell(reply: Reply, swum: Swim, log: SeaLog, chosen: SeaTrial) -> None:
    import numpy as np

    origin = log.provenance
    lasted, rows = float(log.time[-1]), len(log.time)
    read = {name: int(np.isfinite(values).sum()) for name, values in log.channels.items()}
    reply.summary |= {
        "name": log.name, "craft": log.craft, "level": log.level, "synthetic": log.synthetic, "seconds": lasted,
        "rows": rows, "readings": read, "ended": origin["ended"], "drawn": origin["drawn"],
    }  # fmt: skip
    reply.say(f"{log.name}: SYNTHETIC record of {log.craft}, {lasted:.1f} s in {rows} rows: {origin['ended']}")
    mean, std = origin["drawn"]["current_mean"], origin["drawn"]["current_std"]
    words = ", ".join(f"{m:+.3f} +/- {s:.3f}" for m, s in zip(mean, std, strict=True))
    reply.say(f"  current felt north, east, down  {words} m/s")
    fewer = [f"{name} {count}" for name, count in read.items() if count < rows]
    reply.say(f"  {len(read)} channels; in fewer rows: {', '.join(fewer) or 'none'}")
    for note in dict.fromkeys((*swum.trial.setting.notes, *chosen.notes)):
        reply.log(f"  note: {note}")
