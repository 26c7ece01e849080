"""Records on disk: one netCDF file each."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_netcdf, write_netcdf
from towtank.errors import ArtefactError
from towtank.field.log import CHANNELS, Flag, SeaLog

SCHEMA = "towtank/log/1"


def log_variables(log: SeaLog) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Variables and attributes of a record as they are stored."""
    variables = {"time": Variable(("time",), log.time, {"units": "s", "long_name": "time from the first sample"})}
    for name, values in log.channels.items():
        unit, words = CHANNELS[name]
        attrs: dict[str, Any] = {"units": unit, "long_name": words}
        attrs |= {
            word: repr(float(table[name])) for word, table in (("std", log.std), ("bias", log.bias)) if name in table
        }
        variables[name] = Variable(("time",), np.asarray(values, dtype=float), attrs)
    attrs = {
        "name": log.name, "craft": log.craft, "level": log.level, "synthetic": int(log.synthetic),
        "assumed": list(log.assumed), "epoch": json.dumps(log.epoch), "datum": json.dumps(log.datum),
        "flags": [asdict(flag) for flag in log.flags], "conversions": list(log.conversions),
        "provenance": dict(log.provenance),
    }  # fmt: skip
    return variables, attrs


def write_log(log: SeaLog, path: Path | str) -> Path:
    """Write ``log`` as netCDF-4 with schema ``towtank/log/1``.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_netcdf(Path(path), SCHEMA, *log_variables(log))


def read_log(path: Path | str) -> SeaLog:
    """Read a record that ``write_log`` wrote.

    Raises
    ------
    ArtefactError
        Missing, truncated, or not a record.
    """
    path = Path(path)
    v, attrs = read_netcdf(path, SCHEMA)
    try:
        time = np.asarray(v.pop("time").values, dtype=float)
        datum = json.loads(str(attrs["datum"]))
        return SeaLog(
            name=str(attrs["name"]), craft=str(attrs["craft"]), time=time,
            channels={name: np.asarray(one.values, dtype=float) for name, one in v.items()},
            std={name: float(one.attrs["std"]) for name, one in v.items() if "std" in one.attrs},
            bias={name: float(one.attrs["bias"]) for name, one in v.items() if "bias" in one.attrs},
            assumed=tuple(json.loads(str(attrs["assumed"]))), synthetic=bool(int(attrs["synthetic"])),
            epoch=json.loads(str(attrs["epoch"])), datum=None if datum is None else (datum[0], datum[1]),
            flags=tuple(Flag(**flag) for flag in json.loads(str(attrs["flags"]))),
            conversions=tuple(json.loads(str(attrs["conversions"]))),
            provenance=json.loads(str(attrs["provenance"])),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is no whole record ({error}). Read the log again with towtank log.") from error
