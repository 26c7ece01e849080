"""mc/population.nc: the drawn craft themselves, with the numbers of their trials."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_netcdf, write_netcdf
from towtank.errors import ArtefactError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.verdict.many import Many, Population, TrialValues

SCHEMA = "towtank/population/1"
FILE = "mc/population.nc"


def write_population(it: Population, folder: Path, attrs: Mapping[str, Any] | None = None) -> Path:
    """Write ``it`` as netCDF-4 into ``folder``, schema ``towtank/population/1``. The first craft is the best estimate.

    <parameter> (craft) for the mass and every parameter that differs, in SI; <trial>.<index> (craft), with unit.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    along = ("craft",)
    variables = {
        name: Variable(along, values, {"kind": "parameter"})
        for name, values in it.craft.columns.items()
        if name == "m" or np.ptp(values) > 0.0
    }
    for trial, flown in it.trials.items():
        for index, (values, unit) in flown.indices.items():
            about = {"kind": "index", "trial": trial, "index": index, "units": unit}
            variables[f"{trial}.{index}"] = Variable(along, values, about)
    kinds = {trial: [flown.kind, flown.loop] for trial, flown in it.trials.items()}
    return write_netcdf(folder / FILE, SCHEMA, variables, {"drawn_from": it.words, "trials": kinds, **(attrs or {})})


def read_population(folder: Path, model: Model) -> Population:
    """Read what ``write_population`` wrote into ``folder`` about craft like ``model``.

    Raises
    ------
    ArtefactError
        Missing, truncated, or not a population.
    """
    path = folder / FILE
    v, attrs = read_netcdf(path, SCHEMA)
    try:
        columns: dict[str, Array] = {}
        indices: dict[str, dict[str, tuple[Array, str]]] = {}
        for name, variable in v.items():
            values = np.asarray(variable.values, dtype=float)
            if variable.attrs["kind"] == "parameter":
                columns[name] = values
            else:
                about = variable.attrs
                indices.setdefault(about["trial"], {})[about["index"]] = (values, about["units"])
        kinds = json.loads(str(attrs["trials"]))
        trials = {name: TrialValues(kinds[name][0], kinds[name][1], found) for name, found in indices.items()}
        return Population(Many(model, columns), trials, str(attrs["drawn_from"]))
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is no whole population ({error}). Delete it and run `towtank mc` again.") from None
