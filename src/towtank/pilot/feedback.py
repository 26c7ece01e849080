"""Feedback gains of least quadratic cost when not every state is measured, and their margins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are, solve_continuous_lyapunov
from scipy.optimize import brentq, minimize

from towtank.frames import Array
from towtank.pilot.plant import Plant


@dataclass(frozen=True)
class Weights:
    """What counts how much. All are largest acceptable values, so that cost = sum((value / largest)^2).

    states (n,) : of each state; infinity leaves it free.   control : of the control [rad].
    start (n,) : size of the initial disturbances the gains are chosen for.
    """

    states: Array
    control: float
    start: Array


def output_feedback(plant: Plant, outputs: Array, weights: Weights) -> Array:
    """Gains k (m,) of delta = -k y with y = ``outputs`` x, of least quadratic cost; zeros when nothing can be gained.

    outputs (m, n). The search starts from the full-state regulator projected on the outputs.

    Source     levineathans1970 (cost of output feedback through a Lyapunov equation); brysonho1975 (weights).
    Departure  The minimum is found by the simplex search of scipy instead of the paper's fixed-point iteration.
    Valid      Small motions; a local minimum.
    """
    Q, R = np.diag(weights.states**-2.0), weights.control**-2.0
    try:
        P = solve_continuous_are(plant.A, plant.B, Q + 1e-9 * np.eye(len(Q)) * np.trace(Q), np.array([[R]]))
    except (LinAlgError, ValueError):
        return np.zeros(len(outputs))
    full = (plant.B.T @ P / R)[0]
    first = full @ np.linalg.pinv(outputs)
    scale = np.where(np.abs(first) > 1e-12, first, 1e-6)

    def cost(factor: Array) -> float:
        k = factor * scale
        closed = plant.A - plant.B @ (k @ outputs)[None, :]
        growth = float(np.linalg.eigvals(closed).real.max())
        if not growth < 0.0:
            return 1e12 * (1.0 + growth)
        S = solve_continuous_lyapunov(closed.T, -(Q + R * np.outer(k @ outputs, k @ outputs)))
        return float(np.log(max((weights.start**2 * np.diag(S)).sum(), 1e-300)))

    starts = (np.ones(len(scale)), np.full(len(scale), 0.3), np.full(len(scale), 3.0))
    begin = min(starts, key=cost)
    best = minimize(cost, begin, method="Nelder-Mead", options={"xatol": 1e-2, "fatol": 1e-4, "maxfev": 300})
    return np.asarray(best.x * scale)


def closed_loop(plant: Plant, outputs: Array, gains: Array) -> Array:
    """Eigenvalues (n,) [1/s] of ``plant`` under delta = -gains @ outputs @ x, by falling real part."""
    values = np.linalg.eigvals(plant.A - plant.B @ (gains @ outputs)[None, :])
    return np.asarray(sorted(values, key=lambda s: (-s.real, -s.imag)))


def margins(plant: Plant, outputs: Array, gains: Array) -> tuple[float, float, float]:
    """Smallest factor above and largest below 1 by which the loop gain may change, and the phase margin [rad].

    The loop is cut at the command. Infinity or zero where no limit is found at rest or between 1e-3 and 1e3 rad/s.

    Source     fossen2021, ch. 15: gain and phase margin of the open loop L(jw) = k C (jw - A)^-1 B.
    """
    row = gains @ outputs

    def loop(frequency: float) -> complex:
        solved = np.linalg.solve(1j * frequency * np.eye(len(plant.A)) - plant.A, plant.B[:, 0])
        return complex(row @ solved)

    grid = np.logspace(-3, 3, 241)
    response = np.array([loop(w) for w in grid])
    up, down, phase = np.inf, 0.0, np.inf
    crossings = np.flatnonzero(np.diff(np.sign(response.imag)) != 0)
    turned = [loop(brentq(lambda s: loop(s).imag, grid[i], grid[i + 1])).real for i in crossings]
    for real in (steady_gain(plant.A, plant.B, row[None, :]), *turned):
        if real < 0.0:
            factor = -1.0 / real
            up, down = (min(up, factor), down) if factor > 1.0 else (up, max(down, factor))
    size = np.abs(response) - 1.0
    for i in np.flatnonzero(np.diff(np.sign(size)) != 0):
        w = brentq(lambda s: abs(loop(s)) - 1.0, grid[i], grid[i + 1])
        phase = min(phase, abs(float(np.angle(-loop(w)))))
    return float(up), float(down), float(phase)


def steady_gain(A: Array, B: Array, K: Array) -> float:
    """Gain K (-A)^-1 B of one loop at frequency zero; infinity, unsigned, where it integrates.

    A (n, n), B (n, 1), K (1, n). Where it is negative, a larger gain makes the craft diverge without swinging.
    """
    size = np.abs(np.linalg.eigvals(A))
    if size.min() < 1e-9 * size.max():
        return float("inf")
    return float(-(K @ np.linalg.solve(A, B))[0, 0])
