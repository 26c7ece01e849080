"""Small cases, motions of the tests, and a stand-in for the solver, shared by the tests of the OpenFOAM tank."""

from __future__ import annotations

import math
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from towtank.plan.history import History
from towtank.tank.openfoam.find import PROGRAMS, Installation
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.numerics import Numerics

TINY = MeshSettings(along=24, around=8, out=10, y_plus=60.0, far=2.5)
COARSE = MeshSettings(along=40, around=12, out=22, y_plus=60.0, far=2.5)
QUICK = Numerics(steps=32, ramp=0.25, iterations=200)


@dataclass(frozen=True)
class Swing:
    """One velocity oscillates about rest: a motion no plan has, for loads in water at rest."""

    speed: float
    rate: int
    amplitude: float
    frequency: float

    kind = "swing"

    @property
    def period(self) -> float:
        return 2.0 * math.pi / self.frequency

    def history(self, time) -> History:
        time = np.asarray(time, dtype=float)
        pose, nu, nudot = (np.zeros((len(time), 6)) for _ in range(3))
        a, w = self.amplitude, self.frequency
        pose[:, self.rate] = a * np.sin(w * time)
        nu[:, self.rate] = a * w * np.cos(w * time)
        nudot[:, self.rate] = -a * w * w * np.sin(w * time)
        return History(time, pose[:, :3], pose[:, 3:], nu, nudot)


@dataclass(frozen=True)
class Held:
    """A drift angle held beside the straight path, as a motion of the mesh: what a steady run says by other means."""

    speed: float
    angle: float
    aside: float
    period: float

    kind = "held"

    def history(self, time) -> History:
        time = np.asarray(time, dtype=float)
        zero = np.zeros_like(time)
        u, v = self.speed * math.cos(self.angle), -self.speed * math.sin(self.angle)
        return History(
            time,
            np.stack([self.speed * time, zero + self.aside, zero], axis=1),
            np.stack([zero, zero, zero + self.angle], axis=1),
            np.tile([u, v, 0.0, 0.0, 0.0, 0.0], (len(time), 1)),
            np.zeros((len(time), 6)),
        )


STAND_IN = """#!/usr/bin/env python3
import os, re, signal, sys, time
from pathlib import Path
case = Path(sys.argv[sys.argv.index("-case") + 1])
control = (case / "system" / "controlDict")
starts = sorted(float(p.name) for p in case.iterdir() if p.name[:1].isdigit() and p.is_dir())
start = starts[-1]
folder = case / "postProcessing" / "forces" / f"{{start:g}}"
folder.mkdir(parents=True, exist_ok=True)
head = "# Time (total_x total_y total_z)\\n"
force, moment = (folder / "force.dat").open("w"), (folder / "moment.dat").open("w")
force.write(head); moment.write(head)
end = float(re.search(r"endTime\\s+([^;]+);", control.read_text())[1])
step = float(re.search(r"deltaT\\s+([^;]+);", control.read_text())[1])
def keep(now):
    (case / f"{{now:.12g}}").mkdir(exist_ok=True)
    (case / f"{{now:.12g}}" / "p").write_text("internalField uniform 0; boundaryField {{ }}")
def one(number):
    now = number * step
    for file, value in ((force, swollen * (100.0 + 50.0 * 0.8**number)), (moment, 20.0)):
        file.write(f"{{now:.12g}} ({{-value}} {{value}} 0)\\n"); file.flush()
    print(f"Time = {{now:.12g}}\\n")
    print("GAMG:  Solving for p, Initial residual = 0.01, Final residual = 1e-4, No Iterations 3")
    print(f"ExecutionTime = {{0.01 * number}} s  ClockTime = 0 s\\n", flush=True)
    time.sleep(0.002)
    return now
number, swollen = round(start / step), 1.0
print("trapFpe: Floating point exception trapping enabled (FOAM_SIGFPE).")
{behaviour}
while number * step < end - 0.5 * step:
    number += 1
    now = one(number)
    if number % 10 == 0:
        keep(now)
    if "writeNow" in control.read_text():
        break
keep(number * step)
print("End", flush=True)
"""
"""Writes a load that settles, times on file every ten steps, and the log of a solver; obeys stopAt writeNow."""


def stand_in(folder: Path, behaviour: str = "") -> Installation:
    """An installation whose programs write what a solver writes; ``behaviour`` is what else they do at the start."""
    binaries = folder / "bin"
    binaries.mkdir(exist_ok=True)
    for name in PROGRAMS:
        path = binaries / name
        path.write_text(STAND_IN.format(behaviour=behaviour))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return Installation(folder, "1912", "esi", binaries, {})
