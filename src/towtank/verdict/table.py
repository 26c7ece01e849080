"""Verdict: what the model and its trials say about a craft."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.verdict.criteria import PlaneCriteria


@dataclass(frozen=True)
class Requirement:
    """One thing a craft should do: ``value`` in ``unit`` against ``limit``, whether it is ``met``, and why."""

    name: str
    value: float
    unit: str
    limit: float
    met: bool
    note: str


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
