"""Runs as netCDF-4 files: ``runs/<id>/run.nc``."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import Variable, read_netcdf, series, write_netcdf
from towtank.errors import ArtefactError
from towtank.frames import Array
from towtank.plan.history import History
from towtank.symbols import CONTROLS, LOADS, RATES
from towtank.tank.run import Run

SCHEMA = "towtank/run/1"
FILE = "run.nc"

_POSITION, _ATTITUDE = ("x", "y", "z"), ("phi", "theta", "psi")
_DOTS = tuple(f"{rate}dot" for rate in RATES)
_TEXT = ("id", "name", "kind", "craft", "symmetry", "level")
_NUMBERS = ("speed", "period", "density", "length", "origin_from_nose", "diameter")

_NAMES = {
    **dict(zip(LOADS, ("surge force", "sway force", "heave force", "roll moment", "pitch moment", "yaw moment"),
               strict=True)),
    **dict(zip(RATES, ("surge velocity", "sway velocity", "heave velocity", "roll rate", "pitch rate", "yaw rate"),
               strict=True)),
    "x": "north", "y": "east", "z": "down", "phi": "roll angle", "theta": "pitch angle", "psi": "heading",
}  # fmt: skip


def _attrs() -> dict[str, dict[str, str]]:
    units = {name: "N" if name in "XYZ" else "N m" for name in LOADS}
    units |= {name: "m/s" if name in "uvw" else "rad/s" for name in RATES}
    units |= {f"{name}dot": "m/s2" if name in "uvw" else "rad/s2" for name in RATES}
    units |= dict.fromkeys(_POSITION, "m") | dict.fromkeys(_ATTITUDE, "rad")
    words = {**_NAMES, **{f"{rate}dot": f"rate of change of {_NAMES[rate]}" for rate in RATES}}
    return {name: {"units": unit, "long_name": words[name]} for name, unit in units.items()}


_ATTRS = _attrs()


def run_variables(run: Run) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Variables and attributes of a run, as they stand in its file.

    Variables over ``time``: loads X Y Z K M N [N, N m], velocities u..r, accelerations udot..rdot, x y z [m] and
    phi theta psi [rad]; shares of the load as ``X_<part>``; ``delta`` (time, fin) [rad]; ``control``
    (time, input) [rad, rad, rad, rad2]; ``ensemble`` (member, time, load) in single precision.
    """
    history, time = run.history, ("time",)
    variables = {"time": Variable(time, history.time, {"units": "s", "long_name": "time"})}
    variables |= series(LOADS, run.loads, time, _ATTRS)
    for part, loads in run.parts.items():
        attrs = {f"{k}_{part}": {**_ATTRS[k], "long_name": f"{_NAMES[k]}, {part}"} for k in LOADS}
        variables |= series(tuple(attrs), loads, time, attrs)
    for names, values in (
        (RATES, history.nu),
        (_DOTS, history.nudot),
        (_POSITION, history.position),
        (_ATTITUDE, history.attitude),
    ):
        variables |= series(names, values, time, _ATTRS)
    if run.delta.shape[1]:
        variables["delta"] = Variable(("time", "fin"), run.delta, {"units": "rad", "long_name": "fin angle"})
    variables["control"] = Variable(
        ("time", "input"),
        run.control,
        {"units": "rad", "long_name": f"virtual controls {' '.join(CONTROLS)} (dd: rad2)"},
    )
    if run.ensemble is not None:
        variables["ensemble"] = Variable(
            ("member", "time", "load"),
            np.asarray(run.ensemble, dtype=np.float32),
            {"units": "N, N m", "long_name": f"loads {' '.join(LOADS)} of the model-form ensemble"},
        )
    return variables, _file_attrs(run)


def _file_attrs(run: Run) -> dict[str, Any]:
    return {
        **{name: getattr(run, name) for name in _TEXT},
        **{name: float(getattr(run, name)) for name in _NUMBERS},
        "periods": run.periods,
        "frequency": 0.0 if run.steady else 2.0 * math.pi / run.period,
        "amplitude": amplitude(run),
        "exploratory": int(run.exploratory),
        "parts": json.dumps(list(run.parts)),
        "flags": json.dumps(list(run.flags)),
        "provenance": json.dumps(_plain(run.provenance)),
    }


def _plain(value: Any) -> Any:
    """``value`` as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value


def amplitude(run: Run) -> float:
    """Half the stroke of an oscillation [m; rad in roll], from the recorded motion; 0 for a steady run."""
    history = run.history
    stroke = {
        "sway": history.position[:, 1],
        "yaw": history.position[:, 1],
        "heave": history.position[:, 2],
        "pitch": history.position[:, 2],
        "roll": history.attitude[:, 0],
        "surge": history.position[:, 0] - run.speed * history.time,
    }.get(run.kind)
    return 0.0 if run.steady or stroke is None else float(np.ptp(stroke) / 2.0)


def write_run(run: Run, path: Path) -> Path:
    """Write ``run`` to ``path`` whole or not at all.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    variables, attrs = run_variables(run)
    return write_netcdf(Path(path), SCHEMA, variables, attrs)


def read_run(path: Path) -> Run:
    """Read a run written by ``write_run``. Everything comes back as it was, the ensemble to single precision.

    Raises
    ------
    ArtefactError
        Missing, empty, truncated, of another schema, or without a variable that a run needs.
    """
    variables, attrs = read_netcdf(Path(path), SCHEMA)
    try:
        return _run(variables, attrs)
    except (KeyError, ValueError) as error:
        raise ArtefactError(
            f"{path} is not a whole run ({error}). Delete it; `towtank tow` will write it again."
        ) from None


def _run(variables: Mapping[str, Variable], attrs: Mapping[str, Any]) -> Run:
    def stack(names: tuple[str, ...]) -> Array:
        return np.stack([variables[name].values for name in names], axis=-1)

    history = History(variables["time"].values, stack(_POSITION), stack(_ATTITUDE), stack(RATES), stack(_DOTS))
    samples = len(history.time)
    text = {name: str(attrs[name]) for name in _TEXT}
    number = {name: float(attrs[name]) for name in _NUMBERS if name != "diameter"}
    return Run(
        id=text["id"],
        name=text["name"],
        kind=text["kind"],
        craft=text["craft"],
        symmetry=text["symmetry"],
        level=text["level"],
        speed=number["speed"],
        period=number["period"],
        density=number["density"],
        length=number["length"],
        origin_from_nose=number["origin_from_nose"],
        periods=int(attrs["periods"]),
        history=history,
        delta=variables["delta"].values if "delta" in variables else np.zeros((samples, 0)),
        control=variables["control"].values,
        loads=stack(LOADS),
        parts={part: stack(tuple(f"{load}_{part}" for load in LOADS)) for part in json.loads(attrs["parts"])},
        ensemble=variables["ensemble"].values.astype(float) if "ensemble" in variables else None,
        flags=tuple(json.loads(attrs["flags"])),
        exploratory=bool(attrs["exploratory"]),
        provenance=json.loads(attrs["provenance"]),
        diameter=float(attrs.get("diameter", 0.0)),
    )


def run_path(out: Path, run_id: str) -> Path:
    """File of a run in the study folder ``out``."""
    return Path(out) / "runs" / run_id / FILE


def read_runs(folder: Path) -> tuple[Run, ...]:
    """Every run of a study folder, or of its ``runs`` folder, in the order of their ids.

    Raises
    ------
    ArtefactError
        No run is there, or one is broken.
    """
    folder = Path(folder)
    paths = sorted(folder.glob(f"runs/*/{FILE}")) or sorted(folder.glob(f"*/{FILE}"))
    if not paths:
        raise ArtefactError(
            f"{folder} holds no runs. Run `towtank tow` first, or name the study folder with --out DIR."
        )
    return tuple(read_run(path) for path in paths)
