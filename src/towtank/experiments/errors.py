"""How uncertain the loads of a run are, before it is run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest
from towtank.plan.limits import assess


@dataclass(frozen=True)
class ErrorModel:
    """Random error of the loads of a run.

    Each load of each run has an error of root mean square sigma, sigma^2 = (share * load's rms in the run)^2
    + (floor * load's rms over the standard plan)^2 + misfit^2. It is a sum of a mean and of the first ``harmonics`` of
    the cycle in equal parts with random factors; the part ``repeated`` of its variance is the same in every cycle of
    the run, the rest is new in each. So more samples do not make it smaller, and cycles do only down to the part
    that repeats. A steady run has the mean alone.

    Source     This project's RANS runs: side force of a steady finned hull scatters by 1 to 2 %, 4 % at 4 deg of drift,
               which share and floor give together; coefficients of sway and yaw
               move by 0.01 to 0.4 % with the window analysed.
    Departure  ``repeated`` and ``harmonics`` are choices: half of an error of unknown origin taken as the run's own,
               and the harmonics that a load linear plus quadratic in its cause has.
    Valid      Errors of different runs and of different loads independent of each other.
    """

    share: float = 0.02
    floor: float = 0.01
    repeated: float = 0.5
    harmonics: int = 3

    def __post_init__(self) -> None:
        for name in ("share", "floor", "repeated"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise InputError(f"error model: {name} {value:g} is not a share. Give 0.02 for 2 %.")
        if self.floor == 0.0 and self.share == 0.0:
            raise InputError(
                "error model: share and floor are both zero, and exact runs need no plan. Give share 0.02."
            )

    @property
    def components(self) -> int:
        """Independent components of the error of an oscillation: the mean, and sine and cosine of each harmonic."""
        return 1 + 2 * self.harmonics

    def sigma(self, rms: Array, scale: Array, misfit: Array) -> Array:
        """Standard deviation (R, 6) [N, N m]. rms, misfit (R, 6); scale (6,) of each load; all [N, N m].

        Never below 1e-9 of the largest scale, so that a load that is always zero does not count as infinitely known.
        """
        square = (self.share * rms) ** 2 + (self.floor * scale) ** 2 + misfit**2
        return np.asarray(np.maximum(np.sqrt(square), 1e-9 * float(scale.max(initial=1e-300))))

    def witness(self, cycles: Array) -> Array:
        """Variance (R,) of one component of unit variance over ``cycles`` (R,) analysed cycles."""
        return np.asarray(self.repeated + (1.0 - self.repeated) / np.maximum(cycles, 1.0))

    def weight_factor(self, cycles: float) -> float:
        """Factor on the variance of a result because an oscillation is weighted by its own residual."""
        m, own = float(self.components), self.repeated + (1.0 - self.repeated) / cycles
        fresh = (1.0 - self.repeated) * (1.0 - 1.0 / cycles)
        freedom = m / (own**2 + fresh**2 / max(cycles - 1.0, 1.0))
        return float(found_weight(freedom))


FITTED = 2
"""Values of a load that a steady kind fits from its own runs, slope and bend: they take that much from its residual."""


def found_weight(freedom: float | Array) -> Array:
    """Factor on the variance of a result whose weights are 1 / mean square of a residual of n degrees of freedom.

    Such a weight w is itself uncertain: E(w^2) / E(w)^2 = (n - 2) / (n - 4).

    Source     atkinson2007 has the weights known; this is the moment of the inverse chi-square distribution.
    Valid      n above 5; below it the factor at 5 is given. A bound where one kind of run alone tells a value: its
               weight then does not matter.
    """
    kept = np.maximum(freedom, 5.0)
    return np.asarray((kept - 2.0) / (kept - 4.0))


def shapes(error: ErrorModel, samples: int, steady: bool) -> Array:
    """Components of the error over one cycle (samples, m), each of unit root mean square."""
    if steady:
        return np.ones((samples, 1))
    angle = 2.0 * np.pi * np.arange(samples) / samples
    waves = [np.ones(samples)]
    for k in range(1, error.harmonics + 1):
        waves += [np.sqrt(2.0) * np.cos(k * angle), np.sqrt(2.0) * np.sin(k * angle)]
    return np.stack(waves, axis=1)


def allowance(tests: Sequence[CaptiveTest], craft: Craft, misfit: Array) -> Array:
    """What a model leaves unexplained (R, 6), made to grow with violence.

    misfit : (R, 6) root mean square residual of each load of each test about the model [N, N m].

    A run gets the largest misfit of the runs of its kind that are no more violent than itself, in the peaks of
    velocities, rates, fin angle and frequency. So a run that happens to lie where the misfit crosses zero is not taken
    for a good one, and a more violent run is never trusted more.
    """
    sizes = [assess(test, craft) for test in tests]
    where = np.array([[s.v, s.w, s.p, s.q, s.r, s.slowing, s.fin, s.frequency] for s in sizes])
    kinds = np.array([test.kind for test in tests])
    out = np.empty_like(misfit)
    for i in range(len(tests)):
        milder = (kinds == kinds[i]) & np.all(where <= where[i] * (1.0 + 1e-9) + 1e-12, axis=1)
        out[i] = misfit[milder].max(axis=0)
    return out
