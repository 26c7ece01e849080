"""The whole campaign of ``hokie`` in OpenFOAM beside the fast tank's: its cost, and the derivatives of both.

``towtank run hokie --tank openfoam --out FOLDER`` and ``towtank grid hokie --tank openfoam --out GRID``, then
``openfoam_hokie.py FOLDER GRID`` rewrites ``validation/openfoam_hokie.csv`` and ``openfoam_hokie_grid.csv``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import towtank as tt
from openfoam_grid import HEAD as GRID_HEAD
from openfoam_grid import rows as grid_rows
from tables import write_table
from towtank.artefact import read_json
from towtank.grid.files import read_grid
from towtank.grid.study import GridStudy
from towtank.tank.files import read_run
from towtank.tank.openfoam.case import read_case
from towtank.tank.openfoam.runner import SCHEMA as OUTCOME

TARGET = Path(__file__).with_suffix(".csv")
HEAD = ("what", "name", "openfoam", "deviation", "of_mesh", "fast_tank", "deviation_fast")
MESHES = TARGET.with_name("openfoam_hokie_grid.csv")


def cost(study: Path) -> dict[str, tuple[int, float]]:
    """Kind of run -> how many, and CPU seconds."""
    out: dict[str, tuple[int, float]] = {}
    for path in sorted(study.glob("runs/*/case/outcome.json")):
        outcome, case = read_json(path, OUTCOME), read_case(path.parent)
        runs, seconds = out.get(case.test.kind, (0, 0.0))
        out[case.test.kind] = (runs + 1, seconds + float(outcome["cpu"]))
    return out


def rows(study: Path, grid: GridStudy) -> Iterator[tuple[str, ...]]:
    """Cost by kind of run, then the terms, SI; deviations are standard uncertainties, all shares together."""
    dear = tt.derive([read_run(path) for path in sorted(study.glob("runs/*/run.nc"))], grid=grid)
    found = cost(study)
    for kind, (runs, seconds) in found.items():
        yield ("cost", kind, str(runs), "", "", f"{seconds:.0f}", "")
    total = sum(seconds for _, seconds in found.values())
    yield ("cost", "all", str(sum(runs for runs, _ in found.values())), "", "", f"{total:.0f}", "")
    yield ("cost", "CPU seconds a derivative", "", "", "", f"{total / len(dear.names):.0f}", "")
    cheap = tt.derive(tt.tow(tt.standard_plan(tt.read_craft("hokie")), tank=tt.FastTank()))
    one, other = _stated(dear), _stated(cheap)
    for name in sorted({*one} | {*other}):
        yield ("term", name, *one.get(name, ("", "", "")), *other.get(name, ("", "", ""))[:2])


def _stated(d: tt.Derivatives) -> dict[str, tuple[str, str, str]]:
    """Term -> value, its standard uncertainty, and the part of that which is the mesh's."""
    whole, mesh = (np.sqrt(np.diag(c)) for c in (d.covariance, d.covariance_mesh))
    return {n: (f"{v:.5g}", f"{s:.2g}", f"{m:.2g}") for n, v, s, m in zip(d.names, d.values, whole, mesh, strict=True)}


if __name__ == "__main__":
    place, meshes = Path(sys.argv[1]), read_grid(Path(sys.argv[2]) / "grid.json")
    title = f"hokie, {place.name}; costs: runs and CPU seconds in the columns of values"
    write_table(TARGET, title, HEAD, rows(place, meshes))
    write_table(MESHES, f"hokie, chosen {meshes.chosen}", GRID_HEAD, grid_rows(meshes))
