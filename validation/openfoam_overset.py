"""A sway with an overset mesh against the same with the whole mesh moving: loads sample by sample, and what it costs.

Run as a script, it runs what is not on file in ``bench/openfoam/overset`` and rewrites
``validation/openfoam_overset.csv``. Words after the script's name choose crafts.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from openfoam_suboff import WORK
from tables import write_table
from towtank import read_craft
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Sway
from towtank.tank.campaign import tow
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.tank import OpenFoamTank
from towtank.tank.run import Run

TARGET = Path(__file__).with_suffix(".csv")
HEAD = (
    "craft", "load", "cells_moving", "cells_overset", "cpu_s_moving", "cpu_s_overset",
    "amplitude", "largest_difference_percent", "mean_moving", "mean_overset",
    "in_phase_moving", "in_phase_overset", "quadrature_moving", "quadrature_overset",
)  # fmt: skip
SWAY = (0.14, 2.0)
"""v / U and w' of the oscillation."""
MESHES = {
    "spheroid-6-1": MeshSettings(along=40, around=12, out=20),
    "suboff-bare": MeshSettings(along=40, around=12, out=22),
}


@dataclass(frozen=True)
class Compared:
    """One craft's sway in both formulations."""

    craft: str
    moving: Run
    overset: Run


def plan(name: str) -> Plan:
    """One sway of the craft ``name`` at its own speed: a ramp of half a period, then one period."""
    craft = read_craft(name)
    ratio, w = SWAY[0], SWAY[1] * craft.speed / craft.length
    motion = Sway(craft.speed, ratio * craft.speed / w, w)
    return Plan(craft, craft.speed, (CaptiveTest("sway", craft.speed, motion, periods=1, samples=60),))


def compared(name: str) -> Compared:
    """Both runs of the craft ``name``; what is on file is read."""
    place, mesh = WORK / "overset" / name, MESHES[name]
    return Compared(
        name,
        moving=tow(plan(name), OpenFoamTank(mesh=mesh), place / "moving")[0],
        overset=tow(plan(name), OpenFoamTank(mesh=mesh, formulation="overset"), place / "overset")[0],
    )


def harmonic(load: Array) -> complex:
    """First harmonic of one period; the real part goes with the velocity of a sway, the other with its acceleration."""
    return complex(2.0 * np.fft.rfft(load[:-1])[1] / (len(load) - 1))


def rows(found: Compared) -> Iterator[tuple[str, ...]]:
    """A row for each of X, Y and N [N, N m]. Differences are shares of the load's amplitude, of its mean for X."""
    runs = (found.moving, found.overset)
    cells = [str(run.provenance["mesh"]["cells"]) for run in runs]
    cpu = [f"{run.provenance['health']['cpu']:.0f}" for run in runs]
    for name, column in (("X", 0), ("Y", 1), ("N", 5)):
        a, b = (np.asarray(run.loads)[:, column] for run in runs)
        scale = abs(a.mean()) if name == "X" else np.abs(a - a.mean()).max()
        first, second = harmonic(a), harmonic(b)
        numbers = (a.mean(), b.mean(), first.real, second.real, first.imag, second.imag)
        yield (
            found.craft, name, *cells, *cpu, f"{scale:.5g}", f"{100.0 * np.abs(b - a).max() / scale:.2f}",
            *(f"{value:.5g}" for value in numbers),
        )  # fmt: skip


if __name__ == "__main__":
    done = [compared(name) for name in (sys.argv[1:] or MESHES)]
    if len(done) == len(MESHES):
        write_table(TARGET, "bare hulls in sway", HEAD, [row for item in done for row in rows(item)])
    for item in done:
        print(*rows(item), sep="\n")
