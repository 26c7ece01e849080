"""Identification of a large campaign: ``python benchmarks/derive.py``.

220 runs: 200 oscillations of 2000 settled samples each and 20 steady ones, from known coefficients with 2 % noise, once
without a model-form ensemble and once with 48 members. Each case runs in a process of its own, which settles the
samples, identifies, and prints wall time, processor time (all threads) and memory; ``derive_s`` is the whole of
``derive`` with its screening. BLAS has one thread: its matrices are small here, and on a machine that is also busy
elsewhere two threads spend as long again waiting for each other. Prints a table with the goals and writes
bench/derive.json; ``--keep`` also writes benchmarks/derive.json, which the repository keeps.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from bench import ROOT, SCHEMA, machine

from towtank.artefact import write_json
from towtank.craft.library import read_craft
from towtank.derive.cycles import settled
from towtank.derive.derive import derive
from towtank.derive.identify import Method, identify
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Heave, Pitch, Roll, Surge, Sway, Turn, Yaw
from towtank.progress import Silent
from towtank.provenance import provenance
from towtank.symbols import FOURFOLD_ADDED_MASS, FOURFOLD_TIES, STANDING, TERMS
from towtank.tank.lpm import LpmTank

OSCILLATIONS, SAMPLES, PERIODS = 200, 500, 5
"""Runs, samples in a period, periods of which the first is dropped: 2000 settled samples a run."""
MEMBERS = 48
ROUNDS = 5
GOAL_S, GOAL_MB = 2.0, 1024.0


def campaign() -> list:
    """The runs of the library craft "hokie" on a grid of amplitudes and frequencies, with noise."""
    craft = read_craft("hokie")
    U, L = craft.speed, craft.length
    rng = np.random.default_rng(1)
    names = [name for name in STANDING if not TERMS[name].is_added_mass or name in FOURFOLD_ADDED_MASS]
    values = {name: TERMS[name].prime_factor(1025.0, L, U) * float(rng.uniform(-0.01, -0.003)) for name in names}
    values |= {name: sign * values[base] for name, (base, sign) in FOURFOLD_TIES.items()}
    steady = [Drift(U, float(np.radians(a))) for a in range(-18, 19, 4)]
    steady += [Turn(U, float(r) * U / L) for r in np.linspace(-0.5, 0.5, 10)]
    tests = [CaptiveTest(f"steady-{i}", U, motion) for i, motion in enumerate(steady)]
    for i in range(OSCILLATIONS):
        w, size = (1.0 + 2.0 * rng.random()) * U / L, 0.05 + 0.25 * rng.random()
        kind = (Sway, Heave, Yaw, Pitch, Surge, Roll)[i % 6]
        reach = {Sway: U / w, Heave: U / w, Surge: U / w, Yaw: U * U / L / w**2, Pitch: U * U / L / w**2, Roll: 1.0}
        motion = kind(U, size * reach[kind], w)
        tests.append(CaptiveTest(f"{kind.__name__.lower()}-{i}", U, motion, periods=PERIODS, samples=SAMPLES))
    tank = LpmTank(values, noise=0.02, seed=3)
    return [tank.run(craft, test, Silent()) for test in tests]


def one(members: int) -> dict[str, float]:
    """Wall time [s] of settling and identification, smallest of the rounds; memory [MB] before and at the peak."""
    runs = campaign()
    if members:
        rng = np.random.default_rng(2)
        factors = 1.0 + 0.1 * rng.standard_normal(members)
        runs = [replace(run, ensemble=run.loads * factors[:, None, None]) for run in runs]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    walls, work, whole = [], [], []
    for _ in range(ROUNDS if not members else 2):
        begun, busy = time.perf_counter(), time.process_time()
        solved = identify(runs, settled(runs), Method(0.7))
        walls.append(time.perf_counter() - begun)
        work.append(time.process_time() - busy)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    for _ in range(0 if members else 3):
        begun = time.perf_counter()
        derive(runs)
        whole.append(time.perf_counter() - begun)
    out = {
        "identify_s": min(walls),
        "identify_cpu_s": min(work),
        "runs_MB": before,
        "peak_MB": after,
        "unknowns": float(len(solved.covariance)),
    }
    return out | ({"derive_s": min(whole)} if whole else {})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", action="store_true", help="also write benchmarks/derive.json")
    parser.add_argument("--one", type=int, help="run one case with so many members and print it as JSON")
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(one(options.one)))
        return
    where, numbers = machine(), {}
    for members in (0, MEMBERS):
        words = [sys.executable, __file__, "--one", str(members)]
        alone = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        found = json.loads(subprocess.run(words, check=True, capture_output=True, text=True, env=alone).stdout)
        numbers |= {f"members_{members}_{name}": float(f"{value:.4g}") for name, value in found.items()}
    goals = {"members_0_identify_s": ("<=", GOAL_S), "members_0_peak_MB": ("<=", GOAL_MB)}
    for name, value in numbers.items():
        side, goal = goals.get(name, ("", 0.0))
        print(
            f"{name:<28}{value:>10g}" + (f"   {side} {goal:<8g}{'met' if value <= goal else 'missed'}" if side else "")
        )
    document = {
        "schema": SCHEMA, "name": "derive", "machine": where, "numbers": numbers,
        "goals": {name: list(goal) for name, goal in goals.items()}, "provenance": provenance(),
    }  # fmt: skip
    for path in [ROOT / "bench" / "derive.json", *([ROOT / "benchmarks" / "derive.json"] if options.keep else [])]:
        print(f"wrote {write_json(path, document).relative_to(ROOT)}")


if __name__ == "__main__":
    main()
