"""FastTank: the built-in tank. Level semi-empirical: not CFD, not experiment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import sampled
from towtank.progress import Progress
from towtank.tank.fast import fins, hull, strakes
from towtank.tank.fast.build import Build, build, panel_counts
from towtank.tank.fast.constants import NOMINAL, sample
from towtank.tank.fast.flags import flags
from towtank.tank.fast.motion import MotionRecord, record_of
from towtank.tank.record import record
from towtank.tank.run import Run

LEVEL = "semi-empirical"
PHYSICS = 2
"""Raised when a formula of the tank changes, so that runs made with the former one are not taken for its own."""
MEMORY_TRAVEL = 1.3
"""Lead-in before a test, in lengths travelled: the longest memory is one length."""

RESOLUTIONS = (1.0 / 3.0, 3.0)
"""Least and largest resolution: 24 by 8 panels, which still have the fins between panels, and 216 by 72, ten s."""
SURFACE = 2
"""Dimensions of the mesh: panels cover a surface, so their size goes with the root of their number."""

Part = Callable[[hull.HullData, MotionRecord, Mapping[str, Array]], Array]
HULL_PARTS: dict[str, Part] = {
    "inertia": hull.inertia,
    "kirchhoff": hull.kirchhoff,
    "tail": hull.tail_lift,
    "crossflow": hull.crossflow,
    "drag": hull.axial_drag,
}
POTENTIAL = ("inertia", "kirchhoff")


@dataclass(frozen=True)
class FastTank:
    """Panels, boundary layer, cross-flow strips and fins.

    parts : "all", or "potential" for added mass and Kirchhoff loads alone.
    members : size of the model-form ensemble run beside the nominal constants; 0 for none.
    memory : False makes every load quasi-steady.   seed : of the ensemble.
    resolution : factor on the panels each way, the strips and the stations of the boundary layer, 1/3 to 3. Meshes are
        alike at multiples of 1/3.
    """

    parts: Literal["all", "potential"] = "all"
    members: int = 48
    memory: bool = True
    seed: int = 0
    resolution: float = 1.0

    def __post_init__(self) -> None:
        least, most = RESOLUTIONS
        if not least - 1e-9 <= self.resolution <= most:
            raise InputError(
                f"FastTank: resolution {self.resolution:g} is outside {least:.3g} to {most:g}. Below it the panels no "
                "longer follow the hull, above it they take minutes and gigabytes. Give a number between, such as 1."
            )

    @property
    def level(self) -> str:
        """Level of evidence."""
        return LEVEL

    def settings(self) -> dict[str, Any]:
        """Everything that decides the result beside craft and test."""
        return {
            "tank": "fast",
            "physics": PHYSICS,
            "parts": self.parts,
            "members": self.members,
            "memory": self.memory,
            "seed": self.seed,
            "resolution": self.resolution,
            "constants": NOMINAL,
        }

    @property
    def mesh(self) -> dict[str, Any]:
        """Name of the mesh, number of hull panels, and dimensions: panels are a surface mesh."""
        rings, sectors = panel_counts(self.resolution)
        return {"label": f"panels-{rings}x{sectors}", "cells": rings * sectors, "dimensions": SURFACE}

    def run(self, craft: Craft, test: CaptiveTest, progress: Progress) -> Run:
        """Run one captive test. Loads about the body origin, with parts, ensemble and validity flags."""
        body = build(craft, test.speed, self.resolution)
        motion = self._record(craft, test)
        parts = self.part_loads(body, motion)
        kept = slice(motion.lead, None)
        total = np.sum(list(parts.values()), axis=0)[:, kept]
        return record(
            self,
            craft,
            test,
            sampled(test),
            total[0],
            parts={name: load[0, kept] for name, load in parts.items()},
            ensemble=total[1:] if self.members else None,
            flags=flags(body, motion) if self.parts == "all" else ("potential part only",),
            mesh=self.mesh,
        )

    def part_loads(self, body: Build, record: MotionRecord) -> dict[str, Array]:
        """Shares of the load (members + 1, N, 6), the nominal constants first."""
        constants = {**sample(self.members, self.seed), "density": np.full(self.members + 1, body.hull.density)}
        names = POTENTIAL if self.parts == "potential" else tuple(HULL_PARTS)
        loads = {name: HULL_PARTS[name](body.hull, record, constants) for name in names}
        if self.parts == "potential":
            return loads
        wash = None
        if body.strakes is not None:
            loads["strakes"], wash = strakes.strakes_load(body.strakes, record, body.hull.length, constants)
        if body.fins:
            loads["fins"] = fins.fins_load(body.fins, record, body.hull.length, body.hull.bow, constants, wash)
        return loads

    def _record(self, craft: Craft, test: CaptiveTest) -> MotionRecord:
        times = sampled(test).time
        if not test.motion.period or not self.memory:
            return record_of(test.motion.history(times), 0, _fins(craft, test), self.memory)
        step = times[1] - times[0]
        lead = int(np.ceil(MEMORY_TRAVEL * craft.length / (test.speed * step)))
        extended = np.concatenate([times[0] - step * np.arange(lead, 0, -1), times])
        return record_of(test.motion.history(extended), lead, _fins(craft, test))


def _fins(craft: Craft, test: CaptiveTest) -> Array:
    return np.array(test.fins) if test.fins else np.zeros(len(craft.fins))
