"""Mesh study of real runs: drift and sway of the bare SUBOFF hull on three meshes of one family.

Run as a script, it runs what is not on file in ``bench/openfoam`` and rewrites ``validation/openfoam_grid.csv``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from openfoam_suboff import WORK
from suboff import U, drift_point
from tables import write_table
from towtank import read_craft
from towtank.grid.study import GridStudy, grid_study
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Sway
from towtank.tank.campaign import tow
from towtank.tank.openfoam.tank import OpenFoamTank

TARGET = Path(__file__).with_suffix(".csv")
HEAD = ("quantity", "cells", "values", "order", "extrapolated", "bound_percent", "verdict")
REFINEMENTS = (0.75, 1.0, 4.0 / 3.0)
SWAY = (0.2, 2.0)
"""v / U and w' of the oscillation."""


def plan() -> Plan:
    """Drift at 4 and 12 deg, and one sway."""
    craft = read_craft("suboff-bare")
    v, w = SWAY[0], SWAY[1] * U / craft.length
    tests = [CaptiveTest(f"drift-{angle}", U, Drift(U, drift_point(angle)[0])) for angle in (4, 12)]
    return Plan(craft, U, (*tests, CaptiveTest("sway", U, Sway(U, v * U / w, w), periods=3, samples=60)))


def study() -> GridStudy:
    """The same tests on each mesh of the draft's family."""
    return grid_study([tow(plan(), OpenFoamTank("draft", refinement=factor), WORK / "grid") for factor in REFINEMENTS])


def rows(found: GridStudy) -> Iterator[tuple[str, ...]]:
    """One row for each quantity; the bound is that of the chosen mesh."""
    chosen = found.number(found.chosen)
    cells = " ".join(str(mesh.cells) for mesh in found.meshes)
    for item in found.quantities:
        yield (
            item.name, cells, " ".join(f"{value:.6g}" for value in item.values), f"{item.estimate.order:.2f}",
            f"{item.estimate.extrapolated:.6g}", f"{100.0 * item.share(chosen):.2f}", item.estimate.verdict,
        )  # fmt: skip


if __name__ == "__main__":
    done = study()
    print(done.words)
    write_table(TARGET, f"bare hull of DARPA SUBOFF, chosen {done.chosen}", HEAD, rows(done))
