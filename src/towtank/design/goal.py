"""What a design must reach, as limits on the numbers of a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.hydrostatics import SLENDEREST
from towtank.errors import InputError

TARGET = 0.95
"""Probability of course stability that is asked for unless another is given."""


@dataclass(frozen=True)
class Goal:
    """A limit on one column.

    at_least : the value must reach the limit; else it must not pass it.   reason : why it is asked.
    smooth : column that is negative where the goal is met and has no steps, for the search; empty: the value itself.
    scale : what makes a number of that column a share, such as a time for a growth.
    """

    name: str
    column: str
    limit: float
    at_least: bool
    unit: str = ""
    reason: str = ""
    smooth: str = ""
    scale: float = 1.0

    def met(self, values: Mapping[str, float]) -> bool:
        """True when the point with ``values`` meets it. A number that is missing or NaN does not."""
        value = values.get(self.column, np.nan)
        return bool(value >= self.limit if self.at_least else value <= self.limit)

    def margin(self, values: Mapping[str, float]) -> float:
        """Distance to the limit for the search, positive where the goal is met; -1 where there is no number."""
        if self.smooth:
            margin = -self.scale * values.get(self.smooth, np.nan)
        else:
            gap = values.get(self.column, np.nan) - self.limit
            margin = (gap if self.at_least else -gap) / max(abs(self.limit), 1e-9)
        return float(margin) if np.isfinite(margin) else -1.0

    def words(self) -> str:
        """As it is printed."""
        return f"{self.name} {'at least' if self.at_least else 'at most'} {self.limit:g} {self.unit}".rstrip()


def stability_goals(craft: Craft, target: float = TARGET) -> tuple[Goal, ...]:
    """Course stability of ``craft`` with fixed fins in both planes, with the probability ``target``.

    Raises
    ------
    InputError
        Not a probability that a sample of two thousand can tell from 0 or 1.
    """
    if not 0.5 <= target <= 0.995:
        raise InputError(
            f"target {target:g}: the probability of stability is a share of 2000 sampled sets of derivatives. Ask for "
            "0.5 to 0.995."
        )
    why = "fins fixed, at the design speed, within the uncertainty of the derivatives"
    return tuple(
        Goal(
            f"P(stable), {plane} plane,", f"P_stable_{letter}", target, True, "", why, f"growth_{letter}_quantile",
            craft.length / craft.speed,
        )
        for letter, plane in (("h", "horizontal"), ("v", "vertical"))
    )  # fmt: skip


def reach_goal(limit: float) -> Goal:
    """Nothing further from the axis than ``limit`` [m]."""
    return Goal("distance from the axis", "reach", limit, False, "m", "room in the launcher, on deck, at the dock")


def slender_goal() -> Goal:
    """Strakes stay within slender-body theory, on which their load rests."""
    reason = "beyond it the load of strakes is not that of slender-body theory"
    return Goal("aspect ratio of the strakes", "strake_aspect", SLENDEREST, False, "", reason)


def all_met(goals: Sequence[Goal], values: Mapping[str, float]) -> bool:
    """True when ``values`` meet every goal."""
    return all(goal.met(values) for goal in goals)


def least_margin(goals: Sequence[Goal], values: Mapping[str, float]) -> float:
    """The smallest margin of all goals."""
    return min(goal.margin(values) for goal in goals)
