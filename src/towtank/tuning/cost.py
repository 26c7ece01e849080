"""What a pilot costs: errors, fin angles and speeds, noise and lack of margin, with exact slopes to its gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import TowtankError
from towtank.frames import Array
from towtank.pilot.law import Pilot
from towtank.tuning.cases import SEEN, Case
from towtank.tuning.fence import Fence
from towtank.tuning.noise import Noise

FREE = (
    "yaw_rate", "sway", "heading", "heading_integral", "pitch_rate", "pitch", "heave", "depth", "depth_rate",
    "depth_integral", "roll", "roll_rate",
)  # fmt: skip
"""Gains that are tuned; ``pitch_order`` follows pitch and heave."""
LOST = 1e6
"""Cost of a flight that ran away."""
REST = 0.01
"""Cost of a gain that changed tenfold, as a share of the start's cost: a gain that no flight needs stays."""


@dataclass(frozen=True)
class Price:
    """Cost of one flight, or the mean of many; the sum is what is minimised.

    tracking : mean square of the errors of heading, depth and roll.   fins : of fin angles off level flight.
    rates : of fin speeds.   Each is relative to the sizes of ``Case``, so that 1 is an error as large as acceptable.
    """

    tracking: float
    fins: float
    rates: float

    @property
    def total(self) -> float:
        """Sum of the three."""
        return self.tracking + self.fins + self.rates


def residuals(case: Case, seen: Array) -> Array:
    """Relative errors (ticks, 3 + 2 n): of ``SEEN``, fin angles, fin speeds. Fins begin in level flight.

    seen (ticks, 3 + n) : as from ``Case.fly``.
    """
    off = (seen - case.wanted) / case.scale
    moved = np.diff(seen[:, len(SEEN) :], axis=0, prepend=case.wanted[None, len(SEEN) :])
    return np.hstack([off, moved / (case.record.clock.tick * case.rate)])


def price(case: Case, seen: Array) -> Price:
    """Cost of a flight; ``LOST`` where it ran away."""
    if not np.isfinite(seen).all():
        return Price(LOST, 0.0, 0.0)
    square = np.mean(residuals(case, seen) ** 2, axis=0)
    n = seen.shape[1] - len(SEEN)
    parts = np.split(square, [len(SEEN), len(SEEN) + n])
    return Price(*(float(part.sum()) for part in parts))


@dataclass(frozen=True)
class Tie:
    """How pitch_order follows, so that the pitch keeps following the pitch asked for: d = d pitch + slope d heave."""

    slope: float


@dataclass
class Objective:
    """Cost over the logarithms of the gains: x (n,) with gain = start gain * exp(x), signs kept.

    Beside the flights: lack of margin (``fence``) and fin speeds from the sensors' noise (``noise``).

    Gains that are zero at the start stay zero. ``names`` are those that move. Slopes are those of the flown loop
    (tangents of the engine) and, of the fence, of the linear loops.   rest : cost of a tenfold change of a gain.

    Source     Gauss and Newton: with residuals r the gradient is 2 J^T r, the second derivative about 2 J^T J.
    """

    start: Pilot
    cases: Sequence[Case]
    fence: Fence
    noise: Noise
    tie: Tie
    rest: float = 0.0
    threads: int = 1

    def __post_init__(self) -> None:
        """Which gains move, and nothing known yet."""
        self.names = tuple(name for name in FREE if getattr(self.start, name) != 0.0)
        self.flights = 0
        self.forget()

    def forget(self) -> None:
        """Drop what is known, after a weight was changed."""
        self._known: dict[bytes, tuple[float, Array, Array]] = {}

    def pilot(self, x: Array) -> Pilot:
        """The pilot of ``x`` (n,)."""
        gains = {name: getattr(self.start, name) * float(np.exp(v)) for name, v in zip(self.names, x, strict=True)}
        order = self.start.pitch_order
        order += gains.get("pitch", self.start.pitch) - self.start.pitch
        order += self.tie.slope * (gains.get("heave", self.start.heave) - self.start.heave)
        return replace(self.start, **gains, pitch_order=order, eigenvalues={}, margins={})

    def prices(self, pilot: Pilot) -> list[Price]:
        """Cost of each flight."""
        self.flights += len(self.cases)
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda case: price(case, case.fly(pilot)), self.cases))

    def value(self, x: Array) -> float:
        """Mean cost of the flights and of the fence at ``x`` (n,)."""
        if x.tobytes() in self._known:
            return self._known[x.tobytes()][0]
        pilot = self.pilot(x)
        flown = float(np.mean([p.total for p in self.prices(pilot)]))
        return flown + self.fence.cost(pilot) + self.noise.cost(pilot) + self.stay(x)

    def stay(self, x: Array) -> float:
        """Cost of having moved to ``x`` (n,)."""
        return float(self.rest * (x**2).sum() / np.log(10.0) ** 2)

    def gradient(self, x: Array) -> Array:
        """Slope (n,) of ``value``."""
        return self._slopes(x)[1]

    def hessian(self, x: Array) -> Array:
        """Second derivative (n, n) of ``value`` without the curvature of the residuals."""
        return self._slopes(x)[2]

    def _slopes(self, x: Array) -> tuple[float, Array, Array]:
        key = x.tobytes()
        if key not in self._known:
            pilot = self.pilot(x)
            self.flights += len(self.cases)
            with ThreadPoolExecutor(self.threads) as pool:
                parts = list(pool.map(lambda case: self._one(case, pilot), self.cases))
            value, slope, bend = (sum(part[i] for part in parts) / len(parts) for i in range(3))
            pull = 2.0 * self.rest / np.log(10.0) ** 2
            value, slope, bend = value + self.stay(x), slope + pull * x, bend + pull * np.eye(len(x))
            for more in (self.fence, self.noise):
                extra = more.slopes(pilot, self._moving(pilot))
                value, slope, bend = value + extra[0], slope + extra[1], bend + extra[2]
            self._known = {key: (float(value), slope, bend)}
        return self._known[key]

    def _moving(self, pilot: Pilot) -> Mapping[str, Array]:
        """Gain of the law -> its slope (n,) to x."""
        out = {name: getattr(pilot, name) * np.eye(len(self.names))[i] for i, name in enumerate(self.names)}
        none = np.zeros(len(self.names))
        return {**out, "pitch_order": out.get("pitch", none) + self.tie.slope * out.get("heave", none)}

    def _one(self, case: Case, pilot: Pilot) -> tuple[float, Array, Array]:
        moving = self._moving(pilot)
        try:
            seen, slope = case.slopes(pilot, tuple(moving))
        except TowtankError:
            if not np.isfinite(case.fly(pilot)).all():
                return LOST, np.zeros(len(self.names)), np.eye(len(self.names))
            raise
        slope = slope @ np.stack(list(moving.values()))
        r = residuals(case, seen)
        moved = np.diff(slope[:, len(SEEN) :], axis=0, prepend=0.0) / (case.record.clock.tick * case.rate)
        J = np.concatenate([slope / case.scale[:, None], moved], axis=1).reshape(-1, len(self.names))
        n = len(r)
        return float((r**2).sum()) / n, 2.0 * J.T @ r.ravel() / n, 2.0 * J.T @ J / n
