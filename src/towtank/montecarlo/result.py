"""What a Monte Carlo study gives: spreads of all indices, probability of stability, bands over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.frames import Array
from towtank.montecarlo.draw import Tolerances
from towtank.verdict.many import Population
from towtank.verdict.spread import Spread

SMALLEST = {"m": 0.05, "deg": 0.2, "deg/s": 0.02, "s": 0.1, "%": 0.5, "1/s": 1e-3, "m/s": 0.01, "": 0.02}
"""Half the 5-95 % band below which an index is not among the widest, however small its value."""


@dataclass(frozen=True)
class TrialSpread:
    """One trial over all craft. ended : reason -> number of drawn craft.   indices : name -> spread."""

    name: str
    kind: str
    loop: str
    ended: Mapping[str, int]
    indices: Mapping[str, Spread]

    @property
    def finished(self) -> float:
        """Share of the drawn craft that went through the whole trial."""
        return self.ended.get("done", 0) / max(sum(self.ended.values()), 1)


@dataclass(frozen=True)
class PlaneSpread:
    """Stability of one plane in straight flight with fixed controls.

    probability : share of the drawn craft whose least damped mode decays.   interval : its 95 % sampling interval.
    index : stability index G.   growth : of the least damped mode [1/s].
    """

    plane: str
    probability: float
    interval: tuple[float, float]
    index: Spread
    growth: Spread

    def __str__(self) -> str:
        """In words."""
        low, high = (100.0 * p for p in self.interval)
        return f"{100.0 * self.probability:.1f} % ({low:.1f} to {high:.1f} % with this number of samples)"


@dataclass(frozen=True)
class Bands:
    """Channels of one trial over time [SI], while most of the craft are under way.

    time (S).   quantiles : channel -> (5, S), 5 25 50 75 95 %.   best : channel -> (S) of the best estimate.
    under_way (S) : share of the craft.   tracks : "x", "y" -> (K, S) of some of the drawn craft.
    """

    time: Array
    quantiles: Mapping[str, Array]
    best: Mapping[str, Array]
    under_way: Array
    tracks: Mapping[str, Array]


@dataclass(frozen=True)
class MonteCarlo:
    """A craft's trials under the uncertainty of its derivatives and the ``given`` tolerances.

    level : of the derivatives.   samples : drawn craft asked for; done : flown. The best estimate is beside them.
    bands : trial -> of the first piece's craft.   population : the first 5000 craft themselves with their indices;
    None where they were not kept.
    """

    craft: str
    level: str
    samples: int
    done: int
    seed: int
    given: Tolerances
    trials: Mapping[str, TrialSpread]
    planes: Mapping[str, PlaneSpread]
    bands: Mapping[str, Bands] = field(default_factory=dict)
    population: Population | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """False when it was stopped before all samples were flown."""
        return self.done >= self.samples

    @property
    def common(self) -> tuple[str, ...]:
        """Indices that every trial has, such as its duration; none for a single trial."""
        trials = list(self.trials.values())
        return tuple(n for n in trials[0].indices if all(n in t.indices for t in trials)) if len(trials) > 1 else ()

    def std(self) -> dict[str, dict[str, float]]:
        """Trial -> index -> standard uncertainty, where it is stated."""
        return {
            name: {key: s.uncertainty for key, s in trial.indices.items() if s.uncertainty is not None}
            for name, trial in self.trials.items()
        }

    def widest(self, count: int = 5) -> tuple[tuple[str, str], ...]:
        """(trial, index) with the widest 5-95 % band for their size, widest first.

        The width is that of the band over the larger of its ends, so 2 where a band reaches as far to either side of
        zero. Left out: what every trial has, lengths given in craft lengths beside metres, bands too narrow to matter.
        """
        found = []
        for trial in self.trials.values():
            for name, spread in trial.indices.items():
                twice = name.removesuffix("_lengths") != name and name.removesuffix("_lengths") in trial.indices
                low, high = spread.band
                matters = 0.5 * (high - low) >= SMALLEST.get(spread.unit, 0.0)
                if name in self.common or twice or spread.uncertainty is None or not matters:
                    continue
                found.append(((high - low) / max(abs(low), abs(high)), trial.name, name))
        return tuple((trial, name) for _, trial, name in sorted(found, key=lambda item: -item[0])[:count])

    def __str__(self) -> str:
        """The table of ``table``."""
        return table(self)

    __repr__ = __str__


def table(it: MonteCarlo) -> str:
    """All indices but those that every trial has, as text for a terminal."""
    lines = [headline(it)]
    lines += [f"course stable, {plane.plane} plane: {plane}" for plane in it.planes.values()]
    head = f"{'':<28} {'best':>10} {'mean':>10} {'std':>10} {'5 %':>10} {'95 %':>10}  {'':<6} {'share':>5}  driven by"
    for trial in it.trials.values():
        lines += ["", f"{trial.name}: {100.0 * trial.finished:.1f} % finished{_others(trial)}", head]
        for name, s in trial.indices.items():
            if name not in it.common:
                numbers = (s.best, s.mean, s.std, *s.band)
                row = " ".join(f"{number:>10.4g}" if math.isfinite(number) else f"{'-':>10}" for number in numbers)
                mark = "*" if s.heavy else " "
                lines.append(f"  {name:<26} {row}{mark} {s.unit:<6} {100.0 * s.share:>4.0f}%  {driven(s)}".rstrip())
    lines.append("\n* heavy tails: std is half the 16-84 % range.   driven by: rank correlation with what was drawn.")
    return "\n".join(lines)


def headline(it: MonteCarlo) -> str:
    """What was drawn, in one line."""
    part = "" if it.complete else f"; stopped, {it.samples} were asked for"
    return f"{it.craft}, {it.level}: {it.done} craft drawn from {it.given} (seed {it.seed}{part})"


def driven(spread: Spread) -> str:
    """Names and rank correlations of what drives an index."""
    return ", ".join(f"{name} {rank:+.2f}" for name, rank in spread.drivers)


def _others(trial: TrialSpread) -> str:
    rest = {reason: n for reason, n in trial.ended.items() if reason != "done"}
    return "".join(f", {n} {WORDS.get(reason, reason)}" for reason, n in rest.items())


WORDS = {
    "not_finite": "left the range of numbers",
    "too_fast": "ran away in speed",
    "late": "did not reach a required mark",
}
"""Reasons why a craft did not finish."""
