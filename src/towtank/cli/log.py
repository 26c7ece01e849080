"""``towtank log``: a log of a craft at sea, read and shown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.options import Debug, Json
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.field.log import SeaLog

_DEG = 57.29577951308232
SHOWN = {"rad": ("deg", _DEG), "rad/s": ("deg/s", _DEG)}
"""SI unit -> unit in the table and its factor."""
MOST_FLAGS = 12
"""Flags of one kind and channel that are told one by one."""

File = Annotated[
    Path | None, typer.Argument(metavar="FILE", help="Log file, or folder of a bag or of messages.", show_default=False)
]
Map = Annotated[
    str | None,
    typer.Option(
        "--map", metavar="MAPPING", help="TOML file, or imc, iver, moos, ros, towtank. Default: told by the file.",
        show_default=False,
    ),
]  # fmt: skip
CraftOption = Annotated[
    str | None, typer.Option(metavar="CRAFT", help="In place of the mapping's craft.", show_default=False)
]
OutFile = Annotated[
    Path | None, typer.Option("--out", metavar="LOG.nc", help="Write the record as netCDF.", show_default=False)
]
Template = Annotated[
    str | None,
    typer.Option(
        metavar="FORMAT", help="Print a mapping to edit: csv, netcdf, mat, alog, ros, imc or iver.", show_default=False
    ),
]


def log(
    file: File = None,
    map: Map = None,
    craft: CraftOption = None,
    out: OutFile = None,
    template: Template = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Read a log of a craft at sea: its channels, what was converted, what is doubtful.

    CSV, netCDF, MAT, MOOS .alog, ROS 1 and 2 bags, IMC messages as CSV, Iver and EcoMapper logs. Nothing is repaired.

    Example: towtank log --template csv > map.toml

    Example: towtank log dive3.csv --map map.toml --out dive3.nc
    """
    with answering("log", json, debug) as reply:
        if template is not None:
            from towtank.field.reading.template import template as written

            text = written(template)
            reply.summary["template"] = text
            reply.say(text.rstrip("\n"))
        elif file is None:
            raise InputError("no log is named. `towtank log --template csv > map.toml` writes a mapping to edit.")
        else:
            _read(reply, file, map, craft, out)


def _read(reply: Reply, file: Path, mapping: str | None, craft: str | None, out: Path | None) -> None:
    from towtank.field.files import write_log
    from towtank.field.reading import read_sea_log

    if out is not None and out.resolve() == file.resolve():
        raise InputError(f"--out {out} is the log itself. Choose another name.")
    record = read_sea_log(file, mapping, craft=craft)
    _tell(reply, record)
    if out is not None:
        reply.file("log", write_log(record, out))
        reply.say(f"Record in {out}.")


def _tell(reply: Reply, record: SeaLog) -> None:
    import datetime

    from towtank.field.log import CHANNELS

    rows = {name: _row(record, name) for name in CHANNELS if name in record.channels}
    seconds = float(record.time[-1] - record.time[0])
    start = None if record.epoch is None else datetime.datetime.fromtimestamp(record.epoch, tz=datetime.UTC)
    reply.summary |= {
        "name": record.name, "craft": record.craft, "level": record.level, "synthetic": record.synthetic,
        "samples": len(record.time), "duration_s": seconds, "start": None if start is None else start.isoformat(),
        "channels": rows, "conversions": list(record.conversions),
        "flags": [vars(flag) for flag in record.flags],
    }  # fmt: skip
    when = f", from {start.isoformat(timespec='seconds')}" if start else ""
    reply.say(
        f"{record.name} ({record.level}), craft {record.craft or 'not named'}: {len(record.time)} instants in "
        f"{seconds:.6g} s{when}"
    )
    reply.say(f"  {'channel':<14}{'unit':<7}{'samples':>8}{'rate Hz':>9}{'from':>12}{'to':>12}{'std of noise':>14}")
    for name, row in rows.items():
        unit, factor = SHOWN.get(row["unit"], (row["unit"], 1.0))
        noise = (
            "not stated" if row["std"] is None else f"{factor * row['std']:.3g}" + (" (a)" if row["assumed"] else "")
        )
        rate = "" if row["rate"] is None else f"{row['rate']:.3g}"
        spread = "".join(
            f"{'' if row[key] is None else format(factor * row[key], '.5g'):>12}" for key in ("min", "max")
        )
        reply.say(f"  {name:<14}{unit:<7}{row['samples']:>8}{rate:>9}{spread}{noise:>14}")
    for title, lines in (("Converted:", record.conversions), ("Doubtful:", _flags(record))):
        if lines:
            reply.say(title)
            for text in lines:
                reply.say(f"  {text}")
    if not record.flags:
        reply.say("Nothing doubtful was found.")


def _row(record: SeaLog, name: str) -> dict[str, Any]:
    """What is shown of one channel, in SI."""
    import numpy as np

    from towtank.field.log import CHANNELS

    known = np.isfinite(record[name])
    values, time = record[name][known], record.time[known]
    steps = np.diff(time)
    return {
        "unit": CHANNELS[name][0], "samples": int(known.sum()),
        "rate": float(1.0 / np.median(steps)) if len(steps) else None,
        "min": float(values.min()) if len(values) else None, "max": float(values.max()) if len(values) else None,
        "std": record.std.get(name), "bias": record.bias.get(name), "assumed": name in record.assumed,
    }  # fmt: skip


def _flags(record: SeaLog) -> list[str]:
    """Doubts, those of one kind and channel in one line where they are many."""
    groups: dict[tuple[str, str], list[str]] = {}
    for flag in record.flags:
        span = f"{flag.start:.6g} s" if flag.start == flag.end else f"{flag.start:.6g} to {flag.end:.6g} s"
        groups.setdefault((flag.kind, flag.channel), []).append(f"! {flag.kind:<8}{span}: {flag.words}")
    out = []
    for (kind, channel), lines in groups.items():
        out += lines[:MOST_FLAGS]
        if len(lines) > MOST_FLAGS:
            out.append(f"! {kind:<8}{len(lines) - MOST_FLAGS} more of {channel}; all are in --json and in the record")
    return out
