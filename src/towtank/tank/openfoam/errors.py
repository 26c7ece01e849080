"""What a preset was measured to miss, and the model-form uncertainty of a run that follows from it.

``errors.json`` is written by ``validation/openfoam_suboff.py`` from runs against an experiment. A preset claims no more
than it has shown: a kind of load that was never measured takes the largest error that was.
"""

from __future__ import annotations

import functools
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from towtank.artefact import read_json
from towtank.frames import Array, drift_angle, incidence_angle
from towtank.symbols import LOADS
from towtank.tank.run import Run

FILE = Path(__file__).with_name("errors.json")
SCHEMA = "towtank/preset-errors/1"
SOURCE = "SUBOFF, hull with and without fins, roddy1990"
MEMBERS = 48
"""Size of the ensemble, that of the fast tank by default."""

FAMILIES: Mapping[str, str] = {
    "drift": "translation", "incidence": "translation", "sway": "translation", "heave": "translation",
    "surge": "translation", "turn": "rotation", "yaw": "rotation", "pitch": "rotation",
}  # fmt: skip
"""Kind of run -> family of the measured errors; other kinds have none."""

TWINS = {"Z": "Y", "M": "N"}
"""Load of the vertical plane -> the load of the horizontal plane whose error stands for it."""


@dataclass(frozen=True)
class Measured:
    """Error of a load, predicted over measured less one.

    fins : of a hull with fins.   up_to [deg] : largest drift.   points : number of measurements.
    """

    family: str
    load: str
    up_to: float
    bias: float
    scatter: float
    points: int
    fins: bool = False

    @property
    def size(self) -> float:
        """Root mean square error."""
        return float(np.hypot(self.bias, self.scatter))


@functools.cache
def measured(preset: str) -> tuple[Measured, ...]:
    """Errors of a preset; empty where it was never compared with an experiment.

    Raises
    ------
    ArtefactError
        The file of the package cannot be read.
    """
    found = read_json(FILE, SCHEMA)["presets"].get(preset, ())
    return tuple(Measured(**entry) for entry in found)


def error_of(preset: str, kind: str, load: str, angle: float, fins: bool = False) -> tuple[float, bool]:
    """Root mean square error of a load in a kind of run at ``angle`` [deg], and whether it was measured as such.

    Beyond the largest measured angle that of the last range stands. With fins, the larger error of the hull with fins
    and of the bare one: the first was measured at small angles only, and totals hide errors that cancel.
    """
    errors = measured(preset)
    own = [e for e in errors if (e.family, e.load) == (FAMILIES.get(kind), TWINS.get(load, load))]
    sizes = []
    for kept in (False, True)[: 1 + fins]:
        ranges = sorted((e for e in own if e.fins == kept), key=lambda e: e.up_to)
        sizes += [next((e.size for e in ranges if angle <= e.up_to + 0.5), ranges[-1].size)] if ranges else []
    if sizes:
        return max(sizes), True
    return max((e.size for e in errors), default=float("nan")), False


def with_model_form(run: Run, preset: str) -> Run:
    """``run`` with the ensemble and the flags that the measured errors of ``preset`` give it.

    A load errs by one factor in all runs of a family: one model fails alike in them. So the members belong together
    from run to run, as those of the fast tank do.

    Departure  A bias is taken as uncertainty, not taken out: it was measured on one hull.
    """
    if not measured(preset):
        named = f"preset {preset}" if preset else "this set-up"
        return replace(run, flags=(*run.flags, f"{named} was never compared with an experiment: no model form"))
    nu = run.history.nu
    angle = float(np.degrees(max(np.abs(drift_angle(nu)).max(), np.abs(incidence_angle(nu)).max())))
    errors = {load: error_of(preset, run.kind, load, angle, "fins" in run.parts) for load in LOADS}
    family = FAMILIES.get(run.kind, run.kind)
    factors = 1.0 + np.array([size * _draws(family, load) for load, (size, _) in errors.items()])
    acting = [load for i, load in enumerate(LOADS) if np.any(run.loads[:, i])]
    guessed = ", ".join(load for load in acting if not errors[load][1])
    flags = (f"model form of {guessed} in {run.kind} not measured: the largest error found stands for it",)
    told = {load: {"error": size, "measured": known} for load, (size, known) in errors.items()}
    return replace(
        run,
        ensemble=run.loads[None] * factors.T[:, None, :],
        flags=(*run.flags, *(flags if guessed else ())),
        provenance={**run.provenance, "model_form": {"preset": preset, "errors": told, "source": SOURCE}},
    )


def _draws(family: str, load: str) -> Array:
    """Standard normal numbers (MEMBERS,) of mean zero, the same for a family and load in every run."""
    rng = np.random.default_rng(zlib.crc32(f"{family} {TWINS.get(load, load)}".encode()))
    half = rng.standard_normal(MEMBERS // 2)
    return np.asarray(np.concatenate([half, -half]) / np.sqrt(np.mean(half**2)))
