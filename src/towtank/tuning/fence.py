"""The margins a tuned pilot must keep, as a cost that is zero inside and grows outside, on the linear loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.engine.clock import clock_of
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import LinearModel, linearise
from towtank.pilot.law import Pilot
from towtank.pilot.loops import COMMANDS, STATES, law_of

GAIN = 2.0
"""Factor, either way, by which the gain of a loop must be free to change."""
ALPHA = 2.0 * (GAIN - 1.0) / (GAIN + 1.0)
"""Disk margin that holds it: 2/3, which also holds a phase of 2 atan(1/3) = 36.9 deg."""
AIM = 1.05
"""The fence stands at this multiple of ``ALPHA``, so that a cost near zero keeps the margin itself."""
POINTS = 160


@dataclass(frozen=True)
class Plane:
    """The craft at one speed, seen from its commands: what no gain changes.

    linear : model at the speed.   frequency (m,) [rad/s].   response (m, 10, 3) : of ``STATES`` to the commands,
    with the fins' lag and the delay.
    """

    linear: LinearModel
    frequency: Array
    response: NDArray[np.complex128]


def plane(model: Model, speed: float) -> Plane:
    """The craft at ``speed`` [m/s] with half a control period of delay in its commands.

    Frequencies reach from a hundredth of the convective one to a hundred times it, or ten times the fins' own.
    """
    linear, delay = linearise(model, speed), clock_of(model, speed).tick / 2.0
    lag = max(float(fin.time_constant) for fin in model.craft.fins)
    slow = speed / model.craft.length
    frequency = np.logspace(np.log10(slow) - 2.0, np.log10(max(100.0 * slow, 10.0 / lag)), POINTS)
    part, s = linear.part(STATES, COMMANDS), 1j * frequency
    fins = np.exp(-s * delay) / (1.0 + lag * s)
    states = np.linalg.solve(s[:, None, None] * np.eye(len(STATES)) - part.A, part.B + 0j)
    return Plane(linear, frequency, states * fins[:, None, None])


@dataclass(frozen=True)
class Fence:
    """Lack of margin of the loops at some speeds.

    With S the sensitivity at a command, all other loops closed, a disk margin of alpha is |S - 1/2| <= 1 / alpha at all
    frequencies. cost = weight * sum over speeds, commands, frequencies of (alpha |S - 1/2| - 1)^2 where positive.

    Source     seiler2020 for the disk; the quadratic penalty of constrained minimisation.
    """

    planes: Sequence[Plane]
    weight: float

    def lack(self, pilot: Pilot) -> Array:
        """What alpha |S - 1/2| - 1 is above 0; one number for each speed, frequency and command."""
        return np.asarray(np.maximum(np.concatenate([self._excess(p, pilot).ravel() for p in self.planes]), 0.0))

    def kept(self, pilot: Pilot) -> bool:
        """True where the margin itself, without ``AIM``, is kept."""
        return bool(self.lack(pilot).max() <= AIM - 1.0)

    def cost(self, pilot: Pilot) -> float:
        """Cost of ``pilot``."""
        return float(self.weight * (self.lack(pilot) ** 2).sum())

    def slopes(self, pilot: Pilot, moving: Mapping[str, Array]) -> tuple[float, Array, Array]:
        """Cost, gradient (n,) and second derivative (n, n) as of ``quadratic``."""
        return quadratic(lambda one: np.sqrt(self.weight) * self.lack(one), pilot, moving)

    @staticmethod
    def _excess(p: Plane, pilot: Pilot) -> Array:
        G, J = law_of(pilot, p.linear)
        law = np.repeat(G[None].astype(complex), len(p.frequency), axis=0)
        law[:, :2] += J / (1j * p.frequency[:, None, None])
        S = np.linalg.inv(np.eye(len(COMMANDS)) + law @ p.response)
        own = np.diagonal(S, axis1=1, axis2=2)
        return np.asarray(AIM * ALPHA * np.abs(own - 0.5) - 1.0)


def quadratic(
    residual: Callable[[Pilot], Array], pilot: Pilot, moving: Mapping[str, Array]
) -> tuple[float, Array, Array]:
    """Sum of squares of ``residual`` of the pilot, its gradient (n,) and 2 J^T J (n, n) in x.

    moving : gain -> its slope (n,) to x.   Central differences of the linear loops, 1e-6 of each gain: no flight.
    """
    n, step, r = len(next(iter(moving.values()))), 1e-6, residual(pilot)
    J = np.zeros((len(r), n))
    for i in range(n):
        ends = [
            residual(replace(pilot, **{k: getattr(pilot, k) + sign * step * v[i] for k, v in moving.items()}))
            for sign in (1.0, -1.0)
        ]
        J[:, i] = (ends[0] - ends[1]) / (2.0 * step)
    return float((r**2).sum()), 2.0 * J.T @ r, 2.0 * J.T @ J
