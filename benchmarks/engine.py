"""The engine against the machine: ``make bench-engine``.

Every figure of one table comes from one run: jobs take turns, CPU time of the process, median of the rounds. The
measured peak of fused multiply-adds is one of the jobs. Prints a table with the goals and writes bench/engine.json;
``--keep`` also writes benchmarks/engine.json, which the repository keeps.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import towtank as tt

sys.path.insert(0, str(Path(__file__).resolve().parent))
from bench import ROOT, SCHEMA, machine

from towtank.artefact import write_json
from towtank.craft.library import read_craft
from towtank.engine.build import Target, c_text, compiler
from towtank.engine.form import form_of
from towtank.engine.library import CHOICE, wanted
from towtank.engine.plan import Clock, Gauge, Leg
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.model.equations import Model
from towtank.model.files import write_model
from towtank.pilot.design import design_pilot
from towtank.pilot.files import write_pilot
from towtank.pilot.orders import Orders
from towtank.plan.standard import standard_plan
from towtank.provenance import provenance
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.start import ballasted

ROUNDS = 11
LASTING, DT = 600.0, 0.05
"""Length [s] of a run and its RK4 step [s]."""
LANES = 256
"""Trajectories of the ensemble that is timed."""
MANY = 100_000
COLD = """
import towtank as tt
from towtank.engine.plan import Clock, Leg
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.pilot.files import read_pilot
from towtank.pilot.orders import Orders
model, pilot = tt.read_model("model.json"), read_pilot("pilot.json")
start = at([0.0] * 6 + [model.craft.speed] + [0.0] * (5 + len(model.craft.fins)))
orders = Orders(piloted=1.0, steer=1.0, dive=1.0, heading=0.5, depth=2.0)
given = {"thrust": model.thrust(model.craft.speed), "pilot": pilot}
done = fly(model, start, [Leg("run", orders, 600.0)], clock=Clock(0.1, 2), **given)
assert done.finished.all() and done.path != "numpy", done.path
"""
MEMORY = """
import resource, sys
exec(open("cold.py").read())
import numpy as np
from towtank.engine.plan import Gauge
from towtank.engine.run import Ensemble
count = int(sys.argv[1])
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
d, along = model.derivatives, np.linspace(0.9, 1.1, count)
spread = {name: d[name] * along for name in ("Yuv", "Nuv", "Yur", "Nur", "Yvdot", "Nrdot")}
gauges = [Gauge(name) for name in ("psi", "z", "phi", "fin_square", "fin_largest", "speed")]
clock, ensemble = Clock(0.1, 1), Ensemble(count, spread)
fly(model, start, [Leg("run", orders, 10.0)], clock=clock, gauges=gauges, ensemble=ensemble, **given)
print(base, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""

Job = Callable[[], Any]


@contextmanager
def engine(name: str) -> Iterator[None]:
    """The engine's path chosen by name."""
    before = os.environ.get(CHOICE)
    os.environ[CHOICE] = name
    try:
        yield
    finally:
        os.environ.pop(CHOICE) if before is None else os.environ.update({CHOICE: before})


class Case:
    """Hokie, ballasted, with derivatives of the fast tank, on a heading and a depth step under its pilot."""

    def __init__(self) -> None:
        craft = read_craft("hokie")
        runs = tow(standard_plan(craft), FastTank(members=1))
        self.model = ballasted(Model(craft, tt.derive(runs)))
        self.speed = craft.speed
        self.pilot = design_pilot(self.model)
        self.start = at([0.0] * 6 + [self.speed] + [0.0] * (5 + len(craft.fins)))
        self.thrust = float(self.model.thrust(self.speed))
        self.orders = Orders(piloted=1.0, steer=1.0, dive=1.0, heading=0.5, depth=2.0)
        self.legs = [Leg("run", self.orders, LASTING)]
        self.gauges = [Gauge("psi", 0.5), Gauge("z", 2.0), Gauge("fin_square"), Gauge("speed")]

    def fly(self, steps: int, lasting: float = LASTING, **options: Any) -> Any:
        """One run, or an ensemble, at ``DT`` with ``steps`` RK4 steps in a control period."""
        return fly(
            self.model, self.start, [Leg("run", self.orders, lasting)], thrust=self.thrust, pilot=self.pilot,
            clock=Clock(DT * steps, steps), **options,
        )  # fmt: skip

    def ensemble(self, count: int) -> Ensemble:
        """``count`` craft that differ in two derivatives."""
        d = self.model.derivatives
        return Ensemble(
            count, {"Yuv": d["Yuv"] * np.linspace(0.9, 1.1, count), "Nur": d["Nur"] * np.linspace(1.1, 0.9, count)}
        )


def peak_job(target: Target, folder: Path) -> tuple[Job, float]:
    """A job that does nothing but fused multiply-adds in packs of ``target``, and its number of operations."""
    made = folder / f"peak_{target.name}.so"
    here = str(Path(__file__).with_name("peak.c"))
    flags = ["-O2", "-Wno-psabi", "-shared", "-fPIC", *target.flags, f"-DWIDE={target.lanes}"]
    subprocess.run([compiler() or "cc", *flags, here, "-o", str(made)], check=True)
    chains = ctypes.CDLL(str(made)).chains
    chains.argtypes, chains.restype = [ctypes.c_int64], ctypes.c_double
    n = 4_000_000
    return (lambda: chains(n)), n * 12.0 * 2.0 * target.lanes


def flops_per_step(case: Case, steps: int) -> float:
    """Floating-point operations of one RK4 step with its share of a control period, counted on the traced text."""
    text = c_text(form_of(case.model))["model.h"]
    count = {name: int(value) for name, value in re.findall(r"#define (\w+) (\d+)", text)}
    step = 4 * (count["FLOPS_DYNAMICS"] + 4 * count["NX"])
    return step + (count["FLOPS_OBSERVE"] + count["FLOPS_STEER"]) / steps


def medians(jobs: dict[str, Job], rounds: int = ROUNDS) -> dict[str, float]:
    """Median CPU time [s] of each job; the jobs take turns."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(rounds):
        for name, job in jobs.items():
            begun = time.process_time()
            job()
            times[name].append(time.process_time() - begun)
    return {name: float(np.median(values)) for name, values in times.items()}


def speeds(case: Case, folder: Path) -> dict[str, float]:
    """Cost per step, peak, derivatives; one target after the other."""
    from towtank.engine.slopes import misfit, record_of, sensitivities

    out: dict[str, float] = {}
    names = [*case.model.derivatives.names, "m", "xG", "zG", "Ixx", "Iyy", "Izz", "b", "zB"][:48]
    clock = Clock(2.0 * DT, 2)
    record = record_of(case.legs, clock)
    seen = ("x", "y", "z", "psi")
    measured = np.zeros((len(record.row), len(seen)))
    shared = {"thrust": case.thrust, "pilot": case.pilot}
    n = LASTING / DT
    for target in wanted():
        word = target.name
        with engine(word):
            peak, flops = peak_job(target, folder)
            jobs: dict[str, Job] = {
                "peak": peak,
                "single": lambda: case.fly(2),
                "single, pilot every step": lambda: case.fly(1),
                "ensemble": lambda: case.fly(2, 60.0, ensemble=case.ensemble(LANES), threads=1),
                "ensemble, gauges": lambda: case.fly(
                    2, 60.0, ensemble=case.ensemble(LANES), threads=1, gauges=case.gauges
                ),
                "adjoint": lambda: misfit(
                    case.model, case.start, record, measured, np.ones_like(measured), seen, **shared
                ),
                "tangents": lambda: sensitivities(case.model, case.start, record, seen, names, **shared),
            }
            t = medians(jobs)
        peak_rate = flops / t["peak"]
        each = t["ensemble"] / (LANES * 60.0 / DT)
        out |= {
            f"{word}_peak_gflops": peak_rate / 1e9,
            f"{word}_single_us": t["single"] / n * 1e6,
            f"{word}_single_pilot_every_step_us": t["single, pilot every step"] / n * 1e6,
            f"{word}_ensemble_ns": each * 1e9,
            f"{word}_ensemble_gauges_ns": t["ensemble, gauges"] / (LANES * 60.0 / DT) * 1e9,
            f"{word}_share_of_peak": flops_per_step(case, 2) / each / peak_rate,
            f"{word}_adjoint_ratio": t["adjoint"] / t["single"],
            f"{word}_jacobian_{len(names)}_ratio": t["tangents"] / t["single"],
        }
    with engine("numpy"):
        t = medians({"numpy": lambda: case.fly(2, 10.0)}, 3)
    out["numpy_single_us"] = t["numpy"] / (10.0 / DT) * 1e6
    return out


def two_threads(case: Case, folder: Path) -> dict[str, float]:
    """Wall time of one thread over two, for the engine and for the peak kernel as a control."""
    target = wanted()[0]
    peak, _ = peak_job(target, folder)

    def kernel(threads: int) -> None:
        work = [threading.Thread(target=lambda: [peak() for _ in range(4 // threads)]) for _ in range(threads)]
        for worker in work:
            worker.start()
        for worker in work:
            worker.join()

    def wall(job: Job) -> float:
        begun = time.perf_counter()
        job()
        return time.perf_counter() - begun

    big = case.ensemble(8192)
    runs: dict[str, list[float]] = {name: [] for name in ("engine 1", "engine 2", "peak 1", "peak 2")}
    for _ in range(7):
        for k in (1, 2):
            runs[f"engine {k}"].append(wall(lambda k=k: case.fly(2, 120.0, ensemble=big, threads=k)))
            runs[f"peak {k}"].append(wall(lambda k=k: kernel(k)))
    best = {name: float(np.median(values)) for name, values in runs.items()}
    return {
        "two_threads_speedup": best["engine 1"] / best["engine 2"],
        "two_threads_speedup_of_peak": best["peak 1"] / best["peak 2"],
    }


def fresh(folder: Path, words: list[str], times: int = 9) -> float:
    """Smallest wall time [s] of a fresh process."""
    best = np.inf
    for _ in range(times):
        begun = time.perf_counter()
        subprocess.run([sys.executable, *words], cwd=folder, check=True)
        best = min(best, time.perf_counter() - begun)
    return float(best)


def cold(case: Case, folder: Path) -> dict[str, float]:
    """Fresh process to a finished 600 s run, beside numpy's import; memory per trajectory."""
    write_model(case.model, folder / "model.json")
    write_pilot(case.pilot, folder / "pilot.json")
    (folder / "cold.py").write_text(COLD)
    (folder / "memory.py").write_text(MEMORY)
    used = {}
    for count in (10_000, MANY):
        answer = subprocess.run(
            [sys.executable, "memory.py", str(count)], cwd=folder, check=True, capture_output=True, text=True
        ).stdout.split()
        used[count] = float(answer[1])
    return {
        "numpy_import_s": fresh(folder, ["-c", "import numpy"]),
        "cold_start_s": fresh(folder, ["cold.py"]),
        "memory_per_trajectory_kB": (used[MANY] - used[10_000]) / (MANY - 10_000),
        "memory_100000_MB": used[MANY] / 1024.0,
    }


def many(case: Case) -> dict[str, float]:
    """10^5 trajectories of 600 s at 0.1 s with gauges, on all cores."""
    begun = time.perf_counter()
    done = fly(
        case.model, case.start, case.legs, thrust=case.thrust, pilot=case.pilot, clock=Clock(0.1, 1),
        gauges=case.gauges, ensemble=case.ensemble(MANY),
    )  # fmt: skip
    return {"many_wall_s": time.perf_counter() - begun, "many_finished": float(done.finished.sum())}


def goals(numbers: dict[str, float]) -> dict[str, tuple[str, float]]:
    """Name -> (side, goal) for the numbers there are."""
    best = wanted()[0].name
    out = {
        f"{best}_single_us": ("<=", 0.7), f"{best}_single_pilot_every_step_us": ("<=", 0.7),
        "avx512_ensemble_ns": ("<=", 120.0), "avx2_ensemble_ns": ("<=", 220.0), f"{best}_share_of_peak": (">=", 0.30),
        f"{best}_adjoint_ratio": ("<=", 6.0), "two_threads_speedup": (">=", 1.7), "many_wall_s": ("<=", 600.0),
        "memory_100000_MB": ("<=", 1024.0),
    }  # fmt: skip
    out |= {name: ("<=", 20.0) for name in numbers if name.startswith(f"{best}_jacobian")}
    if "cold_start_s" in numbers:
        out["cold_start_s"] = ("<=", round(numbers["numpy_import_s"] + 0.15, 3))
    return {name: goal for name, goal in out.items() if name in numbers}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", action="store_true", help="also write benchmarks/engine.json")
    parser.add_argument("--quick", action="store_true", help="leave out the 10^5 trajectories")
    options = parser.parse_args()
    where, case = machine(), Case()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        numbers = speeds(case, folder) | two_threads(case, folder) | cold(case, folder)
        numbers |= {} if options.quick else many(case)
    numbers = {name: float(f"{value:.4g}") for name, value in numbers.items()}
    wanted_ = goals(numbers)
    print(f"engine on {where['processor']}, {where['cores']} cores, load {where['load_before']}\n")
    for name, value in numbers.items():
        side, goal = wanted_.get(name, ("", 0.0))
        met = value <= goal if side == "<=" else value >= goal
        print(f"{name:<36}{value:>12g}" + (f"   {side} {goal:<8g}{'met' if met else 'missed'}" if side else ""))
    document = {
        "schema": SCHEMA, "name": "engine", "machine": where, "numbers": numbers,
        "goals": {name: list(goal) for name, goal in wanted_.items()}, "provenance": provenance(),
    }  # fmt: skip
    for path in [ROOT / "bench" / "engine.json", *([ROOT / "benchmarks" / "engine.json"] if options.keep else [])]:
        print(f"wrote {write_json(path, document).relative_to(ROOT)}")


if __name__ == "__main__":
    main()
