"""Verdict: what the model and its trials say about a craft."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.fins import FinUse
from towtank.verdict.speeds import SpeedSweep


@dataclass(frozen=True)
class Driver:
    """What moves a number. coefficient : its name.   effect : change of the number for one step up, in its unit.

    step : of the coefficient, one standard uncertainty or 5 % [%, of its size].   per_percent : change of the number
    for a coefficient 1 % larger in size, along the line over both steps; NaN for a coefficient that is zero.
    """

    coefficient: str
    effect: float
    step: float
    per_percent: float


@dataclass(frozen=True)
class Requirement:
    """One thing a craft should do: ``value`` in ``unit`` against ``limit``, whether it is ``met``, and why.

    sense : "at most" or "at least"; empty for a check that is no limit on a number.   margin : to the limit, positive
    inside.   std : standard uncertainty of the value.   probability : that a craft within the uncertainty meets it;
    NaN where it is not known.   wanted : the probability asked for, or None where the best estimate decides.
    drivers : strongest first.   source : of the limit.   assumed : the limit is somebody's choice.
    on_share : the value is itself a share of the drawn craft, and ``std`` that of the sampling.
    """

    name: str
    value: float
    unit: str
    limit: float
    met: bool
    note: str
    sense: str = ""
    margin: float = math.nan
    std: float = math.nan
    probability: float = math.nan
    wanted: float | None = None
    drivers: tuple[Driver, ...] = ()
    source: str = ""
    assumed: bool = False
    on_share: bool = False

    @property
    def margin_in_std(self) -> float:
        """Margin in standard uncertainties of the value; NaN where there is none."""
        return self.margin / self.std if self.std > 0.0 else math.nan


@dataclass(frozen=True)
class Criterion:
    """A closed-form number: best estimate, 5 and 95 % quantiles over the drawn craft, what it is.

    Infinite where there is no such limit, as a critical speed of a craft that has none.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    words: str


@dataclass(frozen=True)
class Comparison:
    """The same quantity without and with the pilot. NaN where the trial gave none. ``note`` names the trials."""

    quantity: str
    open: float
    closed: float
    unit: str
    note: str


@dataclass(frozen=True)
class Verdict:
    """Criteria at ``speed`` [m/s], requirements, comparison, words.

    elevator_reversal_speed [m/s] : None where the elevator never reverses.   effectiveness : name -> (value, unit).
    dominant : the derivatives that spread the horizontal index most, with their share of its variance.
    criteria : closed-form numbers with their intervals.   against_speed : eigenvalues of both planes.
    fins : how far each trial uses the fins.   together : probability of meeting all requirements at once, NaN where
    it is not known.   drawn : number of drawn craft and what they were drawn from.
    """

    craft: str
    level: str
    speed: float
    horizontal: PlaneCriteria
    vertical: PlaneCriteria
    elevator_reversal_speed: float | None
    effectiveness: Mapping[str, tuple[float, str]]
    requirements: tuple[Requirement, ...]
    comparison: tuple[Comparison, ...]
    dominant: tuple[tuple[str, float], ...] = ()
    notes: tuple[str, ...] = ()
    words: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    criteria: tuple[Criterion, ...] = ()
    against_speed: SpeedSweep | None = None
    fins: tuple[FinUse, ...] = ()
    together: float = math.nan
    drawn: str = ""
