"""Time of a calibration: 10 records of 30 min at 10 Hz, 30 coefficients.

``python benchmarks/calibrate.py [records] [minutes]`` writes ``calibrate.json`` beside it: seconds on the clock and of
the processor, rounds, and the time of some parts. Times mean something only on cores that are free.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import towtank as tt
from towtank.engine.plan import Clock, Leg
from towtank.experiments.belief import believe
from towtank.field.calibrate.calibrate import calibrate
from towtank.field.calibrate.fit import Search
from towtank.field.calibrate.unknowns import unknowns
from towtank.field.log import SeaLog
from towtank.field.sea import swim, timed
from towtank.field.sea_water import Environment
from towtank.model.equations import Model
from towtank.provenance import provenance
from towtank.trials.start import ballasted, setting

TARGET = Path(__file__).with_suffix(".json")
COEFFICIENTS, TICK, GOAL = 30, 0.1, 60.0
STD = {"z": 0.02, "phi": 3e-3, "theta": 3e-3, "psi": 9e-3, "ahead": 0.01, "slip": 0.01, "plunge": 0.01, "p": 9e-4,
       "q": 9e-4, "r": 9e-4}  # fmt: skip


def model_of() -> Model:
    """hokie with the derivatives of the fast tank."""
    craft = tt.read_craft("hokie")
    return ballasted(tt.Model(craft, tt.derive(tt.tow(tt.standard_plan(craft), tt.FastTank()))))


def records(model: Model, count: int, seconds: float) -> list[SeaLog]:
    """Synthetic records of steps in heading and depth."""
    s, rng, legs, heading, left = setting(model, None), np.random.default_rng(1), [], 0.0, seconds
    while left > 1e-6:
        within = min(left, float(round(rng.uniform(15.0, 40.0))))
        heading += float(rng.uniform(-1.2, 1.2))
        orders = s.orders(steer=1.0, heading=heading, dive=1.0, depth=float(rng.uniform(0.0, 10.0)),
                          throttle=float(rng.choice([1.0, 1.3, 0.8])))  # fmt: skip
        legs.append(Leg(f"leg{len(legs)}", orders, within))
        left -= within
    water = Environment(current=(0.1, -0.05, 0.0), turbulence=(0.02, 0.02, 0.01), piece=0.5, seed=2)
    swum = swim(model, timed(model, legs), water, count=count, clock=Clock(TICK, 2))
    out = []
    for i in range(count):
        channels = {f"delta{k + 1}": swum.channels[f"delta{k + 1}"][i] for k in range(len(model.craft.fins))}
        for name, std in STD.items():
            channels[name] = swum.channels[name][i] + std * rng.standard_normal(len(swum.time))
        channels["thrust"] = swum.channels["thrust"][i]
        out.append(SeaLog(f"bench-{i}", model.craft.name, swum.time, channels, std=STD, synthetic=True))
    return out


def terms_of(model: Model) -> list[str]:
    """Terms whose parameters, twins included, are ``COEFFICIENTS`` at most."""
    tied = believe(model.derivatives).terms
    chosen: list[str] = []
    for first in tied.first:
        more = [*chosen, tied.names[first]]
        if len(unknowns(model.derivatives, more).names) <= COEFFICIENTS:
            chosen = more
    return chosen


class Watch:
    """Progress that counts rounds."""

    def __init__(self) -> None:
        self.steps = 0

    def start(self, task: str, total: int) -> None:
        """Do nothing."""

    def step(self, task: str, note: str = "") -> None:
        """Count."""
        self.steps += 1

    def done(self, task: str) -> None:
        """Do nothing."""


def main(count: int, minutes: float) -> None:
    """Time it and write the result."""
    model = model_of()
    logs, terms = records(model, count, 60.0 * minutes), terms_of(model)
    parts: dict[str, float] = {}
    for name in ("advance", "learn"):
        _watched(name, parts)
    watch, wall, cpu = Watch(), time.perf_counter(), time.process_time()
    found = calibrate(model, logs, terms=terms, progress=watch)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    out: dict[str, Any] = {
        "records": count, "minutes": minutes, "hertz": 1.0 / TICK, "windows": sum(r.windows for r in found.records),
        "coefficients": len(unknowns(model.derivatives, terms).names), "independent": len(terms),
        "wall_s": round(wall, 1), "cpu_s": round(cpu, 1), "goal_s": GOAL, "rounds": watch.steps,
        "settled": found.settled, "cores": len(os.sched_getaffinity(0)), "load_1min": round(os.getloadavg()[0], 2),
        "wall_of_parts_s": {name: round(value, 1) for name, value in parts.items()}, "provenance": provenance(),
    }  # fmt: skip
    TARGET.write_text(json.dumps(out, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(json.dumps(out, indent=1) + "\n")


def _watched(name: str, parts: dict[str, float]) -> None:
    """Add up the time in a method of the search."""
    plain = getattr(Search, name)

    def timed_method(self: Search, *args: Any) -> Any:
        start = time.perf_counter()
        try:
            return plain(self, *args)
        finally:
            parts[name] = parts.get(name, 0.0) + time.perf_counter() - start

    setattr(Search, name, timed_method)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10, float(sys.argv[2]) if len(sys.argv) > 2 else 30.0)
