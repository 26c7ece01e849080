"""Trajectories on disk: one netCDF file per trial, one index of their numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_netcdf, series, write_json, write_netcdf
from towtank.errors import ArtefactError
from towtank.provenance import provenance
from towtank.trials.trajectory import Trajectory

SCHEMA = "towtank/trajectory/1"
INDEX_SCHEMA = "towtank/trials/1"

_POSITION, _ATTITUDE, _NU = ("x", "y", "z"), ("phi", "theta", "psi"), ("u", "v", "w", "p", "q", "r")
_COMMAND = ("rudder", "elevator", "aileron")
_LONG = {
    "x": "north", "y": "east", "z": "down", "phi": "roll", "theta": "pitch", "psi": "heading, unwrapped",
    "u": "surge velocity over ground", "v": "sway velocity over ground", "w": "heave velocity over ground",
    "p": "roll rate", "q": "pitch rate", "r": "yaw rate",
    "rudder": "rudder asked for", "elevator": "elevator asked for", "aileron": "aileron asked for",
}  # fmt: skip
_UNITS = dict.fromkeys(_POSITION, "m") | dict.fromkeys(_ATTITUDE + _COMMAND, "rad") | dict.fromkeys("uvw", "m/s")
_UNITS |= dict.fromkeys("pqr", "rad/s")
_SETPOINTS = {"depth": "m", "turn": "rad/s", "throttle": "1"}
_ATTRS = {name: {"units": _UNITS[name], "long_name": _LONG[name]} for name in _LONG}


def trajectory_variables(t: Trajectory) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Variables and attributes of a trajectory as they are stored."""
    along = ("time",)
    variables = {"time": Variable(along, t.time, {"units": "s", "long_name": "time from the execute"})}
    for names, values in ((_POSITION, t.position), (_ATTITUDE, t.attitude), (_NU, t.nu), (_COMMAND, t.command)):
        variables |= series(names, values, along, _ATTRS)
    variables["delta"] = Variable(("time", "fin"), t.delta, {"units": "rad", "long_name": "fin angles"})
    for name, values in t.setpoint.items():
        unit = _SETPOINTS.get(name, "rad")
        variables[f"setpoint_{name}"] = Variable(along, values, {"units": unit, "long_name": f"{name} ordered"})
    attrs = {
        "name": t.name, "kind": t.kind, "loop": t.loop, "craft": t.craft, "level": t.level, "status": t.status,
        "indices": {name: {"value": value, "unit": unit} for name, (value, unit) in t.indices.items()},
        "provenance": dict(t.provenance),
    }  # fmt: skip
    return variables, attrs


def write_trajectory(t: Trajectory, path: Path | str) -> Path:
    """Write ``t`` as netCDF-4 with schema ``towtank/trajectory/1``.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_netcdf(Path(path), SCHEMA, *trajectory_variables(t))


def read_trajectory(path: Path | str) -> Trajectory:
    """Read a trajectory.

    Raises
    ------
    ArtefactError
        Missing, truncated, or not a trajectory.
    """
    path = Path(path)
    v, attrs = read_netcdf(path, SCHEMA)
    try:
        indices = json.loads(str(attrs["indices"]))

        def stack(names: Sequence[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
            return np.stack([np.asarray(v[name].values, dtype=float) for name in names], axis=-1)

        return Trajectory(
            **{key: str(attrs[key]) for key in ("name", "kind", "loop", "craft", "level", "status")},
            time=np.asarray(v["time"].values, dtype=float),
            position=stack(_POSITION),
            attitude=stack(_ATTITUDE),
            nu=stack(_NU),
            delta=np.asarray(v["delta"].values, dtype=float),
            command=stack(_COMMAND),
            setpoint={k.removeprefix("setpoint_"): v[k].values for k in v if k.startswith("setpoint_")},
            indices={k: (math.nan if i["value"] is None else float(i["value"]), i["unit"]) for k, i in indices.items()},
            provenance=json.loads(str(attrs["provenance"])),
        )
    except (KeyError, ValueError, TypeError) as error:
        raise ArtefactError(
            f"{path} is not a whole trajectory ({error}). Delete it and run `towtank trial` again."
        ) from None


def write_index(
    trajectories: Sequence[Trajectory],
    folder: Path | str,
    spread: Mapping[str, Mapping[str, float]] | None = None,
) -> Path:
    """Write every trajectory to ``folder/<name>.nc`` and ``folder/index.json``.

    spread : trial name -> index name -> standard uncertainty, from ``trials.spread``; null where not computed.
    """
    folder = Path(folder)
    known = spread or {}
    for t in trajectories:
        write_trajectory(t, folder / f"{t.name}.nc")
    document = {
        "schema": INDEX_SCHEMA,
        "trials": [
            {
                "name": t.name, "kind": t.kind, "loop": t.loop, "level": t.level, "status": t.status,
                "file": f"{t.name}.nc",
                "indices": {
                    name: {"value": value, "std": known.get(t.name, {}).get(name), "unit": unit}
                    for name, (value, unit) in t.indices.items()
                },
            }
            for t in trajectories
        ],
        "provenance": provenance(),
    }  # fmt: skip
    return write_json(folder / "index.json", document)
