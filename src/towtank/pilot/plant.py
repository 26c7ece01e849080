"""The craft's own linear model about level, straight flight, for the design of the pilot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.frames import Array
from towtank.model.linear import LinearModel


@dataclass(frozen=True)
class Plant:
    """Linear model xdot = A x + B delta with one control [rad]: A (n, n), B (n, 1); ``states`` names the n states."""

    A: Array
    B: Array
    states: tuple[str, ...]


Loop = tuple[Plant, Array, Array]
"""Plant, outputs (m, n), gains (m,)."""


def block(linear: LinearModel, states: tuple[str, ...], control: str) -> Plant:
    """The sub-model of ``states`` with one control; what couples to the other states is left out."""
    part = linear.part(states, (control,))
    return Plant(part.A, part.B, states)


def with_servo(plant: Plant, time_constant: float) -> Plant:
    """``plant`` with the first-order lag of its fins as a last state; the input is then the angle asked for."""
    n = len(plant.A)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[:n, n:], A[n, n] = plant.A, plant.B, -1.0 / time_constant
    B = np.zeros((n + 1, 1))
    B[n] = 1.0 / time_constant
    return Plant(A, B, (*plant.states, "delta"))


def with_integral(plant: Plant, of: Array) -> Plant:
    """``plant`` with the integral of the output ``of`` (n,) as a last state."""
    n = len(plant.A)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[n, :n] = plant.A, of
    return Plant(A, np.vstack([plant.B, np.zeros((1, 1))]), (*plant.states, "integral"))
