"""Time and memory of ``towtank run hokie`` in a fresh folder: ``make bench``.

Prints a table with the goals and writes bench/run.json, with the machine. ``--keep`` also writes the summary that the
repository keeps, benchmarks/last.json.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank.artefact import write_json
from towtank.provenance import provenance

ROOT = Path(__file__).resolve().parents[1]
SCHEMA = "towtank/bench/1"
CRAFT = "hokie"
PANELS = """
import json, time
from towtank.craft.library import read_craft
from towtank.tank.fast.build import build
craft = read_craft("hokie")
started = time.perf_counter()
built = build(craft, craft.speed)
print(json.dumps([built.panels, time.perf_counter() - started]))
"""


@dataclass(frozen=True)
class Cost:
    """What a command cost: wall time [s], largest memory of all its processes together [MB], and what it printed."""

    wall: float
    memory: float
    answer: Any


def memory_of_tree(root: int) -> float:
    """Memory [MB] of a process and all below it; pages that several share are counted once (PSS)."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # ended while we looked
            continue
        parents[int(stat.parent.name)] = int(fields[1])
    total, family = 0, {root}
    for pid in sorted(parents):
        if pid == root or parents[pid] in family:
            family.add(pid)
    for pid in family:
        try:
            text = Path(f"/proc/{pid}/smaps_rollup").read_text()
        except OSError:
            continue
        total += next((int(line.split()[1]) for line in text.splitlines() if line.startswith("Pss:")), 0)
    return total / 1000.0


def measure(words: list[str], watch: bool = False) -> Cost:
    """Run ``words`` to its end. With ``watch``, memory is sampled ten times a second, which costs some wall time."""
    with tempfile.TemporaryFile() as out:
        started = time.perf_counter()
        process = subprocess.Popen(words, stdout=out, stderr=subprocess.DEVNULL)
        memory = 0.0
        while watch and process.poll() is None:
            memory = max(memory, memory_of_tree(process.pid))
            time.sleep(0.1)
        process.wait()
        wall = time.perf_counter() - started
        if process.returncode:
            sys.exit(f"{' '.join(words)} ended with code {process.returncode}; run it by hand to see why")
        out.seek(0)
        return Cost(wall, memory, json.loads(out.read()))


def machine() -> dict[str, Any]:
    """What the times depend on."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor(),
        "cores": len(os.sched_getaffinity(0)),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "load_before": round(os.getloadavg()[0], 2),
    }


def results() -> tuple[dict[str, float], dict[str, float]]:
    """Measured numbers, and seconds of each stage."""
    towtank = [sys.executable, "-m", "towtank", "run", CRAFT, "--json"]
    with tempfile.TemporaryDirectory() as folder:
        out = ["--out", f"{folder}/{CRAFT}"]
        first, again = measure([*towtank, *out]), measure([*towtank, *out])
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
        page = Path(folder, CRAFT, "report.html").stat().st_size
        runs = len(list(Path(folder).glob("*/runs/*/run.nc")))
        watched = measure([*towtank, "--out", f"{folder}/watched"], watch=True)
    panels, panel_wall = measure([sys.executable, "-c", PANELS]).answer
    stages = first.answer["summary"]["stages_s"]
    return {
        "run_wall_s": first.wall,
        "run_again_wall_s": again.wall,
        "campaign_s": stages["tow"],
        "campaign_runs": runs,
        "report_s": stages["report"],
        "panels": panels,
        "panels_per_s": panels / panel_wall,
        "peak_memory_MB": watched.memory,
        "study_MB": size / 1e6,
        "report_MB": page / 1e6,
    }, stages


GOALS = {"run_wall_s": 20.0, "campaign_s": 3.0, "peak_memory_MB": 600.0}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", action="store_true", help="also write benchmarks/last.json")
    keep = parser.parse_args().keep
    where = machine()
    numbers, stages = results()
    numbers = {name: float(f"{value:.4g}") for name, value in numbers.items()}
    print(f"towtank run {CRAFT} on {where['processor']}, {where['cores']} cores, load {where['load_before']}\n")
    print(f"{'':<20}{'measured':>12}{'goal':>10}")
    for name, value in numbers.items():
        goal = GOALS.get(name)
        verdict = "" if goal is None else f"{'<= ' + format(goal, 'g'):>10}  {'met' if value <= goal else 'missed'}"
        print(f"{name:<20}{value:>12g}{verdict}")
    print("\nstages [s]: " + ", ".join(f"{name} {wall:.2f}" for name, wall in stages.items()))
    document = {
        "schema": SCHEMA,
        "name": "run",
        "machine": where,
        "numbers": numbers,
        "goals": GOALS,
        "stages_s": stages,
        "provenance": provenance(),
    }
    files = [ROOT / "bench" / "run.json", *([ROOT / "benchmarks" / "last.json"] if keep else [])]
    for path in files:
        print(f"wrote {write_json(path, document).relative_to(ROOT)}")


if __name__ == "__main__":
    main()
