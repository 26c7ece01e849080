"""What a comparison found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.field.align import Lag
from towtank.frames import Array

GROWTH = (2.0, 5.0, 10.0, 20.0, 30.0)
"""Times [s] after a begin at which the error of the prediction is told."""


@dataclass(frozen=True)
class Uncertainty:
    """Parts of U_val, half a 95 % interval each: of the input (derivatives, current, begin), the numbers, the data."""

    input: float
    numerical: float
    data: float

    @property
    def total(self) -> float:
        """U_val.

        Source     asmevv20: the root of the sum of squares.
        """
        return float(np.sqrt(self.input**2 + self.numerical**2 + self.data**2))


@dataclass(frozen=True)
class Score:
    """One number of the record beside that of the model.

    error : E, record less model.   share : of the drawn craft that have the number.
    """

    name: str
    channel: str
    unit: str
    formula: str
    source: str
    record: float
    model: float
    uncertainty: Uncertainty
    share: float = 1.0

    @property
    def error(self) -> float:
        """E, record less model.

        Source     ittc75030101, eq. 5: E = D - S.
        """
        return self.record - self.model

    @property
    def validated(self) -> bool | None:
        """Whether |E| is at most U_val; None where one of them is not told.

        Source     ittc75030101; asmevv20.
        """
        if not (np.isfinite(self.error) and np.isfinite(self.uncertainty.total)):
            return None
        return bool(abs(self.error) <= self.uncertainty.total)


@dataclass(frozen=True)
class ChannelScore:
    """The error of one channel over all its samples.

    bias : mean of record less model, as a ``Score`` whose record is that mean and whose model is 0.   rms, nrms.
    expected : rms that the drawn craft have about the best estimate, with sensor noise.
    inside, inside_with_noise : shares within the band.   growth : rms at ``GROWTH`` [s] after a begin, NaN beyond.
    parts : rms of each part.   noise : standard deviation of noise and bias that the record states, 0 for none.
    """

    channel: str
    unit: str
    samples: int
    bias: Score
    rms: float
    nrms: float
    expected: float
    inside: float
    inside_with_noise: float
    growth: tuple[float, ...]
    parts: tuple[float, ...]
    noise: float


@dataclass(frozen=True)
class Series:
    """time (N,) [s]; record, model, low, high (of the 95 % band) : channel -> (N,), NaN where there is nothing."""

    time: Array
    record: Mapping[str, Array]
    model: Mapping[str, Array]
    low: Mapping[str, Array]
    high: Mapping[str, Array]


@dataclass(frozen=True)
class Spectrum:
    """frequency (F,) [Hz], power of record and model (F,), coherence in ``signals.BANDS``."""

    channel: str
    frequency: Array
    record: Array
    model: Array
    coherence: tuple[float, ...]


@dataclass(frozen=True)
class Comparison:
    """A record beside the model.

    record_level : "sea record" or "synthetic".   level : of the model's derivatives.   horizon [s], None for none.
    parts : begin and end [s] of each part that was flown.   current, current_std (3,).   assumed : channels whose noise
    is assumed.   included, missing : uncertainties that are in U_val and that are not.   words : what was assumed.
    """

    name: str
    craft: str
    record_level: str
    level: str
    loop: str
    pilot: str
    horizon: float | None
    samples: int
    tick: float
    parts: tuple[tuple[float, float], ...]
    lag: Lag
    current: Array
    current_std: Array
    channels: tuple[ChannelScore, ...]
    metrics: tuple[Score, ...]
    series: Series
    spectra: tuple[Spectrum, ...] = ()
    assumed: tuple[str, ...] = ()
    included: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    flags: Mapping[str, int] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def flown(self) -> float:
        """Time [s] that was flown."""
        return float(sum(b - a for a, b in self.parts))

    @property
    def validated(self) -> tuple[int, int]:
        """Numbers whose |E| is at most U_val, and numbers with both."""
        known = [one.validated for one in self.scores if one.validated is not None]
        return sum(known), len(known)

    @property
    def scores(self) -> tuple[Score, ...]:
        """Biases of the channels, then the metrics."""
        return (*(one.bias for one in self.channels), *self.metrics)
