"""Pilots for a range of speeds: a table of pilots, and what flies between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.pilot.design import design_pilot
from towtank.pilot.law import GAINS, Pilot

FINS = ("yaw_rate", "sway", "pitch_rate", "pitch", "pitch_order", "heave", "roll", "roll_rate")
"""Gains that the law's own schedule multiplies by (speed / u)^2."""
SHARED = ("speed", "scheduled", "reversal")
"""Numbers that are not blended."""


@dataclass(frozen=True)
class PilotSchedule:
    """Pilots of one craft by rising design speed. ``at`` gives the one to fly at a speed.

    The law's own schedule (speed / u)^2 acts within a trial, when a turn slows the craft; the table between trials.

    Raises
    ------
    InputError
        No pilot, pilots of several craft, one speed twice, or some scheduled by the law and some not.
    """

    pilots: tuple[Pilot, ...]

    def __post_init__(self) -> None:
        """Refuse what is no table."""
        order = sorted(self.pilots, key=lambda pilot: pilot.speed)
        speeds = [pilot.speed for pilot in order]
        alike = {(pilot.craft, pilot.scheduled) for pilot in order}
        if not order or len(alike) > 1 or len(set(speeds)) < len(speeds):
            raise InputError(
                f"pilot schedule: speeds {', '.join(f'{u:g}' for u in speeds) or 'none'} m/s of "
                f"{', '.join(sorted({p.craft for p in order})) or 'no craft'}. Give pilots of one craft, each for "
                "another speed, all scheduled by the law or none."
            )
        object.__setattr__(self, "pilots", tuple(order))

    @property
    def speeds(self) -> tuple[float, ...]:
        """Design speeds [m/s], rising."""
        return tuple(pilot.speed for pilot in self.pilots)

    def at(self, speed: float) -> Pilot:
        """The pilot for ``speed`` [m/s].

        At a speed of the table it is that pilot. Between two of them the gains are blended in the logarithm of the
        speed, each brought to ``speed`` by the law's own schedule first. Beyond either end it is the nearest pilot,
        under the law's schedule. Pilots on two sides of the elevator's inversion speed are not blended, because the
        depth gains change sign there through infinity: the one of the side of ``speed`` flies.

        Raises
        ------
        InputError
            The speed is not positive.
        """
        if not speed > 0.0 or not np.isfinite(speed):
            raise InputError(f"pilot schedule at {speed:g} m/s: fins need forward speed. Give a positive one.")
        above = int(np.searchsorted(self.speeds, speed))
        if above < len(self.pilots) and self.speeds[above] == speed:
            return self.pilots[above]
        if above in (0, len(self.pilots)):
            near = self.pilots[0 if above == 0 else -1]
            return replace(near, notes=(*near.notes, f"Flown at {speed:g} m/s, outside its table of speeds."))
        low, high = self.pilots[above - 1], self.pilots[above]
        turn = high.reversal if low.reversal == 0.0 else 0.0
        if turn > low.speed:
            return low if speed < turn else high
        return _blended(low, high, speed)


def _blended(low: Pilot, high: Pilot, speed: float) -> Pilot:
    """The pilot between two."""
    share = float(np.log(speed / low.speed) / np.log(high.speed / low.speed))

    def value(name: str) -> float:
        ends = [
            getattr(pilot, name) * ((pilot.speed / speed) ** 2 if name in FINS and pilot.scheduled else 1.0)
            for pilot in (low, high)
        ]
        return float((1.0 - share) * ends[0] + share * ends[1])

    gains: dict[str, Any] = {name: value(name) for name in GAINS if name not in SHARED}
    note = f"Between the pilots for {low.speed:g} and {high.speed:g} m/s."
    notes = tuple(dict.fromkeys((*low.notes, *high.notes)))
    return replace(low, speed=speed, reversal=max(low.reversal, high.reversal), eigenvalues={}, margins={},
                   notes=(*notes, note), **gains)  # fmt: skip


def design_schedule(
    model: Model, speeds: Sequence[float], design: Callable[[Model, float], Pilot] = design_pilot
) -> PilotSchedule:
    """A pilot designed for each of ``speeds`` [m/s].

    design : function of model and speed, such as ``design_pilot`` or ``design_lqi``.

    Valid      As the pilots. Spacing of 1.5 or less keeps the margins between them near those at them.

    Raises
    ------
    InputError
        No speed, one that is not positive, or one twice.
    TrialError
        A speed at which the craft cannot be stabilised.
    """
    return PilotSchedule(tuple(design(model, float(speed)) for speed in speeds))
