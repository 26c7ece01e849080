"""The whole campaign of ``hokie`` in OpenFOAM beside the fast tank's: its cost, and the derivatives of both.

Run as a script with the folder of a finished study, it rewrites ``validation/openfoam_hokie.csv``:
``towtank run hokie --tank openfoam --out FOLDER``, then ``openfoam_hokie.py FOLDER``. The study has 113 runs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import towtank as tt
from tables import write_table
from towtank.artefact import read_json
from towtank.derive.files import read_derivatives
from towtank.tank.openfoam.case import read_case
from towtank.tank.openfoam.runner import SCHEMA as OUTCOME

TARGET = Path(__file__).with_suffix(".csv")
HEAD = ("what", "name", "openfoam", "deviation", "fast_tank", "deviation_fast")


def cost(study: Path) -> dict[str, tuple[int, float]]:
    """Kind of run -> how many, and CPU seconds."""
    out: dict[str, tuple[int, float]] = {}
    for path in sorted(study.glob("runs/*/case/outcome.json")):
        outcome, case = read_json(path, OUTCOME), read_case(path.parent)
        runs, seconds = out.get(case.test.kind, (0, 0.0))
        out[case.test.kind] = (runs + 1, seconds + float(outcome["cpu"]))
    return out


def rows(study: Path) -> Iterator[tuple[str, ...]]:
    """Cost by kind of run, then the terms, SI; deviations are standard uncertainties, all shares together."""
    dear = read_derivatives(study / "derivatives.json")
    found = cost(study)
    for kind, (runs, seconds) in found.items():
        yield ("cost", kind, str(runs), "", f"{seconds:.0f}", "")
    total = sum(seconds for _, seconds in found.values())
    yield ("cost", "all", str(sum(runs for runs, _ in found.values())), "", f"{total:.0f}", "")
    yield ("cost", "CPU seconds a derivative", "", "", f"{total / len(dear.names):.0f}", "")
    cheap = tt.derive(tt.tow(tt.standard_plan(tt.read_craft("hokie")), tank=tt.FastTank()))
    one, other = _stated(dear), _stated(cheap)
    for name in sorted({*one} | {*other}):
        yield ("term", name, *one.get(name, ("", "")), *other.get(name, ("", "")))


def _stated(d: tt.Derivatives) -> dict[str, tuple[str, str]]:
    """Term -> value and its standard uncertainty."""
    deviations = np.sqrt(np.diag(d.covariance))
    return {name: (f"{v:.5g}", f"{s:.2g}") for name, v, s in zip(d.names, d.values, deviations, strict=True)}


if __name__ == "__main__":
    place = Path(sys.argv[1])
    write_table(TARGET, f"hokie, {place.name}; costs: runs and CPU seconds in the columns of values", HEAD, rows(place))
