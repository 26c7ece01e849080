"""mc.json, the bands of every trial, and the standard uncertainties in the index of the trials."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_json, read_netcdf, write_json, write_netcdf
from towtank.errors import ArtefactError
from towtank.montecarlo.craft import write_population
from towtank.montecarlo.draw import Tolerances
from towtank.montecarlo.fly import BAND_CHANNELS
from towtank.montecarlo.result import Bands, MonteCarlo, PlaneSpread, TrialSpread
from towtank.trials.files import INDEX_SCHEMA
from towtank.verdict.spread import QUANTILES, Spread

SCHEMA, BANDS_SCHEMA = "towtank/mc/1", "towtank/bands/1"
FOLDER, DOCUMENT = "mc", "mc.json"
SAME = 1e-3
"""Relative difference within which an index of a trial is that of the best estimate."""
_UNITS = dict.fromkeys(("x", "y", "z"), "m") | dict.fromkeys(("phi", "theta", "psi", "rudder", "elevator"), "rad")
_UNITS |= dict.fromkeys(("u", "v", "w", "speed"), "m/s") | {"r": "rad/s"}


def write_mc(it: MonteCarlo, folder: Path | str) -> tuple[Path, ...]:
    """Write ``mc.json``, ``mc/<trial>.nc`` for every trial with bands, ``mc/population.nc``; the document comes first.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    folder = Path(folder)
    document = {
        "schema": SCHEMA,
        "craft": it.craft,
        "level": it.level,
        "samples": it.samples,
        "done": it.done,
        "complete": it.complete,
        "seed": it.seed,
        "tolerances": asdict(it.given),
        "quantile_levels": list(QUANTILES),
        "stability": {name: _plane_document(plane) for name, plane in it.planes.items()},
        "trials": [_trial_document(trial, trial.name in it.bands) for trial in it.trials.values()],
        "provenance": dict(it.provenance),
    }
    paths = [write_json(folder / DOCUMENT, document)]
    attrs = {"craft": it.craft, "level": it.level, "samples": it.done, "provenance": dict(it.provenance)}
    for name, bands in it.bands.items():
        paths.append(write_bands(name, bands, folder / FOLDER / f"{name}.nc", attrs))
    if it.population is not None:
        paths.append(write_population(it.population, folder, attrs))
    return tuple(paths)


def _plane_document(plane: PlaneSpread) -> dict[str, Any]:
    return {
        "probability_stable": plane.probability,
        "interval": list(plane.interval),
        "index": _spread_document(plane.index),
        "growth": _spread_document(plane.growth),
    }


def _trial_document(trial: TrialSpread, banded: bool) -> dict[str, Any]:
    return {
        "name": trial.name, "kind": trial.kind, "loop": trial.loop, "finished": trial.finished,
        "ended": dict(trial.ended), "file": f"{FOLDER}/{trial.name}.nc" if banded else None,
        "indices": {name: _spread_document(spread) for name, spread in trial.indices.items()},
    }  # fmt: skip


def _spread_document(s: Spread) -> dict[str, Any]:
    return {
        "unit": s.unit, "best": s.best, "mean": s.mean, "std": s.std, "robust": s.heavy,
        "quantiles": list(s.quantiles), "share": s.share, "drivers": [list(pair) for pair in s.drivers],
    }  # fmt: skip


def write_bands(name: str, bands: Bands, path: Path, attrs: Mapping[str, Any] | None = None) -> Path:
    """Write the bands of the trial ``name`` as netCDF-4, schema ``towtank/bands/1``.

    <channel> (quantile, time), <channel>_best (time), under_way (time), track_x and track_y (craft, time).
    """
    along = ("time",)
    variables = {
        "time": Variable(along, bands.time, {"units": "s", "long_name": "time from the execute"}),
        "quantile": Variable(("quantile",), np.array(QUANTILES), {"long_name": "share of the craft below"}),
        "under_way": Variable(along, bands.under_way, {"long_name": "share of the craft still under way"}),
    }
    for channel, values in bands.quantiles.items():
        unit = {"units": _UNITS[channel]}
        variables[channel] = Variable(("quantile", "time"), values, unit)
        variables[f"{channel}_best"] = Variable(along, bands.best[channel], {**unit, "long_name": "best estimate"})
    for axis, values in bands.tracks.items():
        variables[f"track_{axis}"] = Variable(
            ("craft", "time"), values, {"units": "m", "long_name": "some drawn craft"}
        )
    return write_netcdf(path, BANDS_SCHEMA, variables, {"trial": name, **(attrs or {})})


def read_bands(path: Path | str) -> Bands:
    """Read the bands of one trial.

    Raises
    ------
    ArtefactError
        Missing, truncated, or not bands.
    """
    path = Path(path)
    v, _ = read_netcdf(path, BANDS_SCHEMA)
    try:
        values = {name: np.asarray(variable.values, dtype=float) for name, variable in v.items()}
        return Bands(
            time=values["time"],
            quantiles={name: values[name] for name in BAND_CHANNELS},
            best={name: values[f"{name}_best"] for name in BAND_CHANNELS},
            under_way=values["under_way"],
            tracks={axis: values[f"track_{axis}"] for axis in ("x", "y")},
        )
    except KeyError as error:
        raise ArtefactError(f"{path} holds no whole bands ({error}). Delete it and run `towtank mc` again.") from None


def read_mc(folder: Path | str) -> MonteCarlo:
    """Read what ``write_mc`` wrote into ``folder``; the craft themselves are read by ``read_population``.

    Raises
    ------
    ArtefactError
        Missing, not a Monte Carlo study, or a part is missing.
    """
    folder = Path(folder)
    path = folder / DOCUMENT
    d = read_json(path, SCHEMA)
    try:
        trials = {t["name"]: _trial_of(t) for t in d["trials"]}
        given = d["tolerances"]
        planes = {
            name: PlaneSpread(
                name, p["probability_stable"], tuple(p["interval"]), _spread_of(p["index"]), _spread_of(p["growth"])
            )
            for name, p in d["stability"].items()
        }
        made = MonteCarlo(
            craft=d["craft"], level=d["level"], samples=d["samples"], done=d["done"], seed=d["seed"],
            given=Tolerances(given["mass"], tuple(given["cg"]), given["current"]), trials=trials, planes=planes,
            bands={t["name"]: read_bands(folder / t["file"]) for t in d["trials"] if t["file"]},
            provenance=d["provenance"],
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is not a whole study ({error}). Run `towtank mc` again.") from None
    return made


def _trial_of(t: Mapping[str, Any]) -> TrialSpread:
    indices = {name: _spread_of(s) for name, s in t["indices"].items()}
    return TrialSpread(t["name"], t["kind"], t["loop"], t["ended"], indices)


def _spread_of(s: Mapping[str, Any]) -> Spread:
    return Spread(
        s["unit"], _number(s["best"]), _number(s["mean"]), _number(s["std"]), bool(s["robust"]),
        tuple(_number(q) for q in s["quantiles"]), float(s["share"]), tuple((n, rank) for n, rank in s["drivers"]),
    )  # fmt: skip


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def std_of(it: MonteCarlo, values: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Standard uncertainties for ``values`` (trial -> index -> value): where the best estimate has that value.

    A trial of the same name at another speed or angle is another one, and gets none.
    """
    out: dict[str, dict[str, float]] = {}
    for trial, known in it.std().items():
        spreads, found = it.trials[trial].indices, values.get(trial, {})
        same = {n for n in known if n in found and math.isclose(found[n], spreads[n].best, rel_tol=SAME, abs_tol=1e-6)}
        out[trial] = {name: std for name, std in known.items() if name in same}
    return out


def write_std(it: MonteCarlo, folder: Path | str) -> Path:
    """Put the standard uncertainties of ``it`` into ``folder/index.json``; the trajectories stay as they are.

    An index without one gets null: what stood there was of another study.

    Raises
    ------
    ArtefactError
        There is no index, or it cannot be written.
    """
    path = Path(folder) / "index.json"
    document = read_json(path, INDEX_SCHEMA)
    values = {
        trial["name"]: {name: _number(entry["value"]) for name, entry in trial["indices"].items()}
        for trial in document["trials"]
    }
    known = std_of(it, values)
    for trial in document["trials"]:
        for name, entry in trial["indices"].items():
            entry["std"] = known.get(trial["name"], {}).get(name)
    return write_json(path, document)
