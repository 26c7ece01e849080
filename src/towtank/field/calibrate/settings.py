"""What a calibration assumes beside the record: length of windows, sensors without a stated noise, water, thrust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from towtank.errors import InputError

ASSUMED_STD: Mapping[str, float] = {
    "x": 1.0, "y": 1.0, "z": 0.02, "phi": float(np.radians(0.2)), "theta": float(np.radians(0.2)),
    "psi": float(np.radians(0.5)), "u": 0.02, "v": 0.02, "w": 0.02, "ahead": 0.02, "slip": 0.02, "plunge": 0.02,
    "p": float(np.radians(0.1)), "q": float(np.radians(0.1)), "r": float(np.radians(0.1)), "speed": 0.02,
}  # fmt: skip
"""Assumed: standard deviation of the white noise of a channel whose record does not state it; the order of size of what
small AUVs carry, no single product."""

LEFT_OUT = ("outlier", "stuck", "range")
"""Kinds of flag whose samples take no part. A gap has no samples; a repeat and a clock that jumps are sorted by the
reader, and their samples are measurements."""


@dataclass(frozen=True)
class Settings:
    """How a calibration is done. Each number is assumed unless it is given.

    window [s] : of shooting. The turbulent part of the current is constant in a window, so it is short beside
        ``memory``; and the motion in a window is then nearly linear in every unknown, so few steps are needed.
    current [m/s] : standard deviation of the mean current of a record, to the north and to the east; ``upwelling`` that
        downwards.
    turbulence [m/s], memory [s] : standard deviation of the part of the current that changes, each way, and the time in
        which it is forgotten (first-order Gauss-Markov).
    thrust : standard deviation of the factor of the thrust, 1 being that of the prior's resistance. Speed alone tells
        only the ratio of thrust to resistance.
    push [m2/s3], twist [rad2/s3] : spectral densities of the accelerations that no term holds.
    learn : the last three are taken from the records themselves (largest evidence), starting from these values.
    pairs : draws of the motions by which the coefficients go from the largest density together with the motions to the
        largest with the motions left open; 0 stays at the first. The first is biased for a short craft in strong
        eddies; the draws have a scatter of their own, which falls with the root of their number.
    rounds : most steps of the search.   tolerance : it ends when a step is expected to gain less of the cost, which
        is a sum of squares in standard deviations.
    told : a coefficient is told by the record when its standard deviation falls below this share of the prior's.
    """

    window: float = 1.0
    current: float = 0.5
    upwelling: float = 0.05
    turbulence: float = 0.02
    memory: float = 30.0
    thrust: float = 0.1
    push: float = 1e-5
    twist: float = 1e-7
    learn: bool = True
    pairs: int = 0
    rounds: int = 20
    tolerance: float = 0.1
    told: float = 0.9

    def __post_init__(self) -> None:
        """Refuse what is no number above zero."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, bool) and field.name != "pairs" and not (np.isfinite(value) and value > 0.0):
                raise InputError(
                    f"calibration: {field.name} is {value}. It is a length, a scale or a count: give a number above 0; "
                    "a very small one takes the effect away."
                )
        if self.pairs < 0:
            raise InputError(f"calibration: pairs is {self.pairs}. Give a number of draws, 0 for none.")
