"""Captive tests: which motion, at what speed, with which fin angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from towtank.craft.craft import Craft
from towtank.frames import Array
from towtank.plan.history import History


class Motion(Protocol):
    """A prescribed motion in closed form. Implementations live in ``plan.motion``."""

    @property
    def kind(self) -> str:
        """drift, incidence, turn, sway, yaw, heave, pitch, roll, surge."""

    @property
    def period(self) -> float:
        """Period [s]; 0 for a steady motion."""

    def history(self, time: Array) -> History:
        """Sample the motion at ``time`` (N,) [s]; valid for negative times too."""


@dataclass(frozen=True)
class CaptiveTest:
    """One captive test.

    name : unique in its plan, fit for a folder name: "sway-a0.50-w2.0".
    speed : reference (carriage) speed U [m/s].
    motion : what the body does.
    fins : fin angles [rad], one per fin in the craft's order, held through the test.
    periods : number of periods run; the first is dropped in the analysis. Ignored for steady motions.
    samples : samples per period (steady motions have 2 samples in all).
    exploratory : recorded, never fitted.
    """

    name: str
    speed: float
    motion: Motion
    fins: tuple[float, ...] = ()
    periods: int = 3
    samples: int = 64
    exploratory: bool = False

    @property
    def kind(self) -> str:
        """Kind of the motion, or ``fins`` for a straight run with a deflected fin."""
        steady_ahead = self.motion.kind in ("drift", "incidence") and getattr(self.motion, "angle", 1.0) == 0.0
        return "fins" if steady_ahead and any(self.fins) else self.motion.kind


@dataclass(frozen=True)
class Plan:
    """Captive tests to be run, in order, of one craft. ``notes``: warnings given when it was made."""

    craft: Craft
    speed: float
    tests: tuple[CaptiveTest, ...]
    notes: tuple[str, ...] = ()
