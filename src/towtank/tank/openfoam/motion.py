"""The motion of the mesh: time steps, the smooth start, the table that the solver reads, and loads turned back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array, rotation
from towtank.plan.kinds import CaptiveTest
from towtank.tank.openfoam.formulation import Domain, Formulation, StillWater

Steps = NDArray[np.intp]

MARGIN = 5
"""Rows of the table before the start and after the end: its spline needs two beyond the last step."""


@dataclass(frozen=True)
class Timeline:
    """Steps of a moving case. The recorded periods begin after ``lead`` steps; the solver's time begins at zero.

    step [s].   lead, recorded : numbers of steps.   every : steps from one sample of the plan to the next.
    per_period : steps in a period.
    """

    step: float
    lead: int
    recorded: int
    every: int
    per_period: int

    @property
    def steps(self) -> int:
        """Steps in all."""
        return self.lead + self.recorded

    @property
    def end(self) -> float:
        """End of the case in the solver's time [s]."""
        return self.steps * self.step

    def plan_time(self, numbers: Steps) -> Array:
        """Time of the plan [s] at step ``numbers``; negative in the ramp."""
        return np.asarray((np.asarray(numbers) - self.lead) * self.step)

    def samples(self) -> Steps:
        """Numbers of the steps that are samples of the plan, both ends included."""
        return np.arange(self.lead, self.steps + 1, self.every)


def timeline(test: CaptiveTest, steps: int, ramp: float, refinement: int = 1) -> Timeline:
    """Steps for ``test``: at least ``steps`` a period, a whole number between samples, times ``refinement``."""
    every = max(1, -(-steps // test.samples)) * refinement
    per_period = every * test.samples
    return Timeline(
        step=test.motion.period / per_period,
        lead=max(1, round(ramp * per_period)),
        recorded=test.periods * per_period,
        every=every,
        per_period=per_period,
    )


def travelled(speed: float, length: float, lengths: float, steps: int) -> Timeline:
    """``steps`` for each length of an unsteady straight run over ``lengths`` of travel; its last half is recorded.

    speed [m/s], length [m]. A "period" is the time of one length.
    """
    total = round(lengths * steps)
    return Timeline(length / speed / steps, total - total // 2, total // 2, 1, steps)


def pose(test: CaptiveTest, domain: Domain, formulation: Formulation, line: Timeline) -> tuple[Steps, Array, Array]:
    """Numbers of the steps (n,), position (n, 3) [m] and rotation vector (n, 3) [rad] of the mesh, in its first axes.

    The plan's motion, less the steady advance in a stream, grows by a quintic whose first two derivatives vanish at
    both ends, so that velocity and acceleration are smooth. Rows before the start are at rest.
    """
    numbers = np.arange(-MARGIN, line.steps + MARGIN + 1)
    time = line.plan_time(numbers)
    history = test.motion.history(time)
    share = np.clip(numbers / line.lead, 0.0, 1.0)
    swell = (share**3 * (10.0 - 15.0 * share + 6.0 * share**2))[:, None]
    advance = np.outer(test.speed * time, [1.0, 0.0, 0.0])
    position = swell * (history.position - advance)
    if isinstance(formulation, StillWater):
        position = position + np.outer(test.speed * line.step * np.maximum(numbers, 0), [1.0, 0.0, 0.0])
    return numbers, domain.to_mesh(position), domain.to_mesh(swell * history.attitude)


def motion_table(numbers: Steps, position: Array, turn: Array, step: float) -> str:
    """The table of ``tabulated6DoFMotion``: time ((x y z) (roll pitch yaw in deg)) at the solver's own steps.

    The solver runs a spline through it. Rows at its steps make the spline exact there; a coarser table leaves a
    sawtooth in the acceleration.
    """
    rows = np.column_stack([numbers * step, position, np.degrees(turn)]) + 0.0  # no minus zeros
    lines = [f"({t:.15g} (({x:.15g} {y:.15g} {z:.15g}) ({a:.15g} {b:.15g} {c:.15g})))" for t, x, y, z, a, b, c in rows]
    return "\n".join([str(len(lines)), "(", *lines, ")", ""])


def inertial_to_body(loads: Array, position: Array, turn: Array) -> Array:
    """Loads (N, 6) in axes fixed in space about their origin, as loads in the moving axes about the moving origin.

    position (N, 3) [m] and turn (N, 3) [rad], about one axis at a time, of the moving axes.
    """
    force, moment = loads[:, :3], loads[:, 3:]
    about_origin = moment - np.cross(position, force)
    back = np.swapaxes(rotation(turn), -1, -2)
    return np.concatenate([np.einsum("nij,nj->ni", back, force), np.einsum("nij,nj->ni", back, about_origin)], axis=1)
