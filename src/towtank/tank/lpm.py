"""The tank of known coefficients: only for tests of identification."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import TankError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import sampled
from towtank.progress import Progress
from towtank.symbols import TERMS
from towtank.tank.record import record
from towtank.tank.run import Run
from towtank.terms import term_loads


@dataclass(frozen=True)
class LpmTank:
    """Evaluates a known coefficient set on the motion of a test. Only for tests of identification.

    It knows nothing about a hull: what it gives is what was put in, so a fit must find it again.

    values : term -> value [SI], names of ``symbols.TERMS``, variant "lumped".
    noise : standard deviation of Gaussian noise as a share of the root mean square of each load in each run.
    seed : of the noise; the same seed and run name give the same noise.
    """

    values: Mapping[str, float]
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        unknown = sorted(set(self.values) - set(TERMS))
        if unknown:
            raise TankError(f"LpmTank: {', '.join(unknown)} are no terms of the model. Use names of symbols.TERMS.")
        if not 0.0 <= self.noise < np.inf:
            raise TankError(f"LpmTank: noise {self.noise} is not a share of the load. Give 0.02 for 2 %.")

    @property
    def level(self) -> str:
        """Level of evidence."""
        return "known coefficients"

    def settings(self) -> dict[str, Any]:
        """Coefficients, noise and seed."""
        return {"values": dict(self.values), "noise": self.noise, "seed": self.seed}

    def run(self, craft: Craft, test: CaptiveTest, progress: Progress) -> Run:
        """Run one test; loads (N, 6) are those of ``terms.term_loads`` plus the noise."""
        history = sampled(test)
        fins = np.array(test.fins or (0.0,) * len(craft.fins), dtype=float)
        control = np.tile(craft.virtual(fins), (len(history.time), 1))
        exact = term_loads(self.values, history.nu, history.nudot, control)
        return record(self, craft, test, history, exact + self._noise(exact, test.name))

    def _noise(self, loads: Array, name: str) -> Array:
        if self.noise == 0.0:
            return np.zeros_like(loads)
        sigma = self.noise * np.sqrt((loads**2).mean(axis=0))
        random = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        return np.asarray(sigma * random.standard_normal(loads.shape))
