"""What the noise of the sensors makes the fins do, in closed form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from towtank.engine.clock import clock_of
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import LinearModel, linearise
from towtank.pilot.law import Pilot
from towtank.pilot.loops import STATES, law_of
from towtank.pilot.sensors import CHANNELS, Sensors
from towtank.tuning.cases import fin_size
from towtank.tuning.fence import quadratic

READ = (*STATES, "sink")
"""What the law reads while heading and depth are held."""


@dataclass(frozen=True)
class Jitter:
    """Fin speeds from the noise of the sensors at one speed, over the speed that counts one.

    linear : model there.   mixing (n, 3).   size (11,) : fin speed, over what counts one, per unit gain on ``READ``.
    """

    linear: LinearModel
    mixing: Array
    size: Array

    def residual(self, pilot: Pilot) -> Array:
        """Root of each share of the mean square (n * 11,): one for each fin and each reading."""
        still, falling = (law_of(replace(pilot, depth_rate=rate), self.linear)[0] for rate in (0.0, pilot.depth_rate))
        # The rate of depth is a reading of its own; the law's matrix holds it as w and theta, with w entering as it is.
        sink = (falling - still)[:, [STATES.index("w")]]
        return np.asarray((self.mixing @ np.hstack([still, sink]) * self.size).ravel())


def jitter(model: Model, sensors: Sensors, speed: float) -> Jitter:
    """The jitter of ``model`` seen through ``sensors`` at ``speed`` [m/s].

    A reading of std s every T seconds, held in between, on a gain K, moves fins of lag l with a mean square speed of
    (K s)^2 (1 - exp(-T / l)) / (l T).

    Source     First-order lag driven by a held white sequence, its variance in the steady state.
    Valid      Noise that stays below the fins' largest speed; what the craft answers to its own fins is left out.
    """
    fins, tick = model.craft.fins, clock_of(model, speed).tick
    lag = max(float(fin.time_constant) for fin in fins)
    of = {channel: getattr(sensors, name) for name, group in CHANNELS.items() for channel in group}
    std = np.array([of[name].std for name in READ])
    period = np.array([tick * max(1.0, round(of[name].period / tick)) for name in READ])
    size = std * np.sqrt((1.0 - np.exp(-period / lag)) / (lag * period)) / fin_size(model, speed)[1]
    return Jitter(linearise(model, speed), np.asarray(model.craft.mixing, dtype=float), size)


@dataclass(frozen=True)
class Noise:
    """Mean square of the fin speeds that the sensors' noise causes, over some speeds."""

    parts: Sequence[Jitter]

    def _all(self, pilot: Pilot) -> Array:
        return np.asarray(np.concatenate([part.residual(pilot) for part in self.parts]) / np.sqrt(len(self.parts)))

    def cost(self, pilot: Pilot) -> float:
        """Cost of ``pilot``."""
        return float((self._all(pilot) ** 2).sum())

    def slopes(self, pilot: Pilot, moving: Mapping[str, Array]) -> tuple[float, Array, Array]:
        """Cost, gradient (n,) and second derivative (n, n) as of ``quadratic``."""
        return quadratic(self._all, pilot, moving)
