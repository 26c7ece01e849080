"""``compare.json``: comparisons of a study, their series in ``compare/<record>-<loop>.nc``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_json, read_netcdf, write_json, write_netcdf
from towtank.errors import ArtefactError
from towtank.field.align import Lag
from towtank.field.comparing.result import ChannelScore, Comparison, Score, Series, Spectrum, Uncertainty
from towtank.field.log import CHANNELS
from towtank.frames import Array
from towtank.provenance import provenance

SCHEMA, SERIES_SCHEMA = "towtank/compare/1", "towtank/compare-series/1"
FILE, FOLDER = "compare.json", "compare"
MOST = 2000
"""Most samples of a series that is kept for figures; the numbers rest on all samples."""
_SIDES = ("record", "model", "low", "high")


def stem(it: Comparison) -> str:
    """Name of the files of a comparison."""
    return f"{re.sub(r'[^A-Za-z0-9._-]+', '-', it.name)}-{it.loop}"


def write_comparison(it: Comparison, folder: Path) -> tuple[Path, Path]:
    """Write ``it`` into the study ``folder``: ``compare.json`` and its series.

    Comparisons of other records, and of the other loop, stay when they are of the same derivatives; of others they are
    dropped, since a page never mixes two models.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    entry, series = _entry(it), folder / FOLDER / f"{stem(it)}.nc"
    kept = []
    if (folder / FILE).exists():
        try:
            old = read_json(folder / FILE, SCHEMA).get("records", [])
        except ArtefactError:
            old = []
        same = it.provenance.get("inputs", {}).get("derivatives")
        kept = [
            one for one in old
            if one.get("series") != entry["series"]
            and one.get("provenance", {}).get("inputs", {}).get("derivatives") == same
        ]  # fmt: skip
    write_netcdf(series, SERIES_SCHEMA, _variables(it.series), {"record": it.name, "level": it.record_level})
    records = sorted([*kept, entry], key=lambda one: str(one["series"]))
    return write_json(folder / FILE, {"schema": SCHEMA, "records": records, "provenance": provenance({})}), series


def _entry(it: Comparison) -> dict[str, Any]:
    """What goes into the document. SI and radians; null where there is nothing."""
    plain = {
        f.name: getattr(it, f.name) for f in fields(it) if f.name not in ("channels", "metrics", "series", "spectra")
    }
    plain["lag"] = asdict(it.lag)
    return plain | {
        "channels": [asdict(one) | {"bias": _score(one.bias)} for one in it.channels],
        "metrics": [_score(one) for one in it.metrics],
        "spectra": [asdict(one) for one in it.spectra],
        "series": f"{FOLDER}/{stem(it)}.nc",
        "validated": list(it.validated),
    }


def _score(one: Score) -> dict[str, Any]:
    more = {"error": one.error, "U_val": one.uncertainty.total, "validated": one.validated}
    return asdict(one) | more


def _variables(series: Series) -> dict[str, Variable]:
    step = max(1, -(-len(series.time) // MOST))
    out = {"time": Variable(("time",), series.time[::step], {"units": "s"})}
    for side in _SIDES:
        for name, values in getattr(series, side).items():
            unit = CHANNELS[name][0] if name in CHANNELS else ""
            kept = np.asarray(values[::step], dtype=float)
            out[f"{side}_{name}"] = Variable(("time",), kept, {"units": unit, "side": side, "channel": name})
    return out


def read_comparisons(folder: Path | str) -> tuple[Comparison, ...]:
    """Read what ``write_comparison`` wrote into the study ``folder``.

    Raises
    ------
    ArtefactError
        Missing, another schema, or not whole.
    """
    root = Path(folder)
    document = read_json(root / FILE, SCHEMA)
    try:
        return tuple(_comparison(one, root) for one in document["records"])
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{root / FILE} is not whole ({error!r}). Run `towtank compare` again.") from None


def _comparison(one: Mapping[str, Any], root: Path) -> Comparison:
    plain = {f.name: one[f.name] for f in fields(Comparison)}
    plain |= {
        "parts": tuple((float(a), float(b)) for a, b in one["parts"]), "lag": Lag(**_numbers(one["lag"], Lag)),
        "current": np.array(one["current"], dtype=float), "current_std": np.array(one["current_std"], dtype=float),
        "channels": tuple(_channel(row) for row in one["channels"]),
        "metrics": tuple(_read_score(row) for row in one["metrics"]), "series": _series(root / str(one["series"])),
        "spectra": tuple(_spectrum(row) for row in one["spectra"]),
    }  # fmt: skip
    plain |= {name: tuple(one[name]) for name in ("assumed", "included", "missing", "words")}
    return Comparison(**plain)


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _numbers(row: Mapping[str, Any], of: type) -> dict[str, Any]:
    return {f.name: _number(row[f.name]) if row[f.name] is None else row[f.name] for f in fields(of)}


def _read_score(row: Mapping[str, Any]) -> Score:
    parts = Uncertainty(**{name: _number(value) for name, value in row["uncertainty"].items()})
    return Score(**{**_numbers(row, Score), "uncertainty": parts})


def _channel(row: Mapping[str, Any]) -> ChannelScore:
    lists = {name: tuple(_number(value) for value in row[name]) for name in ("growth", "parts")}
    return ChannelScore(**{**_numbers(row, ChannelScore), **lists, "bias": _read_score(row["bias"])})


def _spectrum(row: Mapping[str, Any]) -> Spectrum:
    arrays = {name: _array(row[name]) for name in ("frequency", "record", "model")}
    return Spectrum(row["channel"], **arrays, coherence=tuple(_number(value) for value in row["coherence"]))


def _array(values: Any) -> Array:
    return np.array([_number(value) for value in values])


def _series(path: Path) -> Series:
    v, _ = read_netcdf(path, SERIES_SCHEMA)
    sides: dict[str, dict[str, Array]] = {side: {} for side in _SIDES}
    for name, variable in v.items():
        if name != "time":
            sides[str(variable.attrs["side"])][str(variable.attrs["channel"])] = np.asarray(
                variable.values, dtype=float
            )
    return Series(np.asarray(v["time"].values, dtype=float), **sides)
