"""The whole linear loop of a craft under a pilot: all states together, with fins' lag, trims and delay."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.interpolate import pade
from scipy.linalg import block_diag
from scipy.signal import tf2ss

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.algebra import MATH
from towtank.model.equations import Model
from towtank.model.linear import LinearModel, linearise
from towtank.pilot.feedback import steady_gain
from towtank.pilot.law import Pilot, authority, schedule

COMMANDS = ("rudder", "elevator", "aileron")
"""Where the loop is cut: the commands of the pilot."""
STATES = ("z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
"""States of the craft in the loop; x and y are not fed back while a heading is held."""
TRIMS = ("trim_rudder", "trim_elevator")
ORDER = 3
"""Order of the Pade approximant of a delay T; its phase is off by 1e-5 rad at 1 / T and by 5e-3 rad at 2.5 / T."""

POINTS = 80
"""Frequencies in a decade."""


@dataclass(frozen=True)
class WholeLoop:
    """xdot = A x + B command, command = -K x, about straight level flight.

    A (n, n), B (n, 3), K (3, n) : n states, in the order of ``STATES``, lagged fins, trims, delay.
    """

    A: Array
    B: Array
    K: Array

    @property
    def eigenvalues(self) -> Array:
        """Eigenvalues (n,) [1/s] with all loops closed, least damped first."""
        values = np.linalg.eigvals(self.A - self.B @ self.K)
        return np.asarray(sorted(values, key=lambda s: (-s.real, -s.imag)))

    def cut(self, at: int) -> tuple[Array, Array, Array]:
        """A (n, n), B (n, 1), K (1, n) of the loop cut at command ``at`` alone, the other two closed."""
        closed = [i for i in range(len(COMMANDS)) if i != at]
        return self.A - self.B[:, closed] @ self.K[closed], self.B[:, [at]], self.K[[at]]

    def response(self, frequency: Array) -> Array:
        """Loop gain L(jw) (m, 3, 3) = K (jw - A)^-1 B at ``frequency`` (m,) [rad/s]."""
        n = len(self.A)
        return np.asarray(self.K @ np.linalg.solve(1j * frequency[:, None, None] * np.eye(n) - self.A, self.B + 0j))

    def steady(self, at: int) -> float:
        """Gain of the loop cut at command ``at`` at frequency zero; infinity, unsigned, for a loop that integrates."""
        return steady_gain(*self.cut(at))

    @property
    def frequencies(self) -> Array:
        """Frequencies (m,) [rad/s] from a decade below the slowest mode to one above the fastest, denser at resonances.

        Modes are those with all loops closed and all open.
        """
        modes = np.concatenate([self.eigenvalues, np.linalg.eigvals(self.A)])
        size = np.abs(modes)
        size = size[size > 1e-6 * size.max()]
        low, high = np.log10(size.min()) - 1.0, np.log10(size.max()) + 1.0
        even = np.logspace(low, high, int(POINTS * (high - low)))
        near = np.abs(modes.imag)[:, None] + np.abs(modes.real)[:, None] * np.linspace(-4.0, 4.0, POINTS // 2)
        near = near[(np.abs(modes.imag) > 0.0)[:, None] & (near > even[0]) & (near < even[-1])]
        return np.unique(np.concatenate([even, near]))


def whole_loop(model: Model, pilot: Pilot, speed: float | None = None, *, delay: float = 0.0) -> WholeLoop:
    """The loop of ``model`` flown by ``pilot`` at ``speed`` [m/s], the pilot's own when not given.

    Heading and depth are held, no limit is reached. Unlike the design of a pilot, loop by loop, all planes are coupled
    and the schedule (speed / u)^2 and the fading of the depth order have the value they have at ``speed``.

    delay [s] : in each command, as that of a held command, half a control period.

    Source     The text of ``Pilot``; fossen2021, ch. 15 for the delay of a held signal.
    Departure  The fins have one lag, the largest of theirs, in the three virtual angles.
    Valid      Small motions about straight level flight.

    Raises
    ------
    InputError
        A speed that is not positive, a negative delay, or a craft without fins.
    """
    speed = pilot.speed if speed is None else float(speed)
    if not model.craft.fins or not delay >= 0.0:
        raise InputError(
            f"loop of {model.craft.name}: {len(model.craft.fins)} fins, a delay of {delay:g} s. A pilot needs fins, "
            "and a delay is zero or more."
        )
    linear = linearise(model, speed)
    lag = max(float(fin.time_constant) for fin in model.craft.fins)
    return lagged(linear.part(STATES, COMMANDS), *law_of(pilot, linear), lag, delay)


def law_of(pilot: Pilot, linear: LinearModel) -> tuple[Array, Array]:
    """Gains of the law at the speed of ``linear``: command (3,) = -G x + trims, rates of the trims (2,) = -J x.

    G (3, 10), J (2, 10) over ``STATES``; the trims act on rudder and elevator.

    Source     The text of ``Pilot``, with heading and depth ordered zero.
    """
    at = {name: i for i, name in enumerate(STATES)}
    G, J = np.zeros((3, len(STATES))), np.zeros((2, len(STATES)))
    followed = float(authority(pilot, linear.speed, MATH))
    sink = linear.part(("z", *STATES[1:]), ("elevator",)).A[0]
    G[0, [at["v"], at["r"], at["psi"]]] = pilot.sway, pilot.yaw_rate, pilot.yaw_rate * pilot.heading
    G[1, [at["w"], at["q"], at["theta"]]] = pilot.heave, pilot.pitch_rate, pilot.pitch
    G[1] -= pilot.pitch_order * followed * pilot.depth_rate * sink
    G[1, at["z"]] -= pilot.pitch_order * followed * pilot.depth
    G[2, [at["p"], at["phi"]]] = pilot.roll_rate, pilot.roll
    J[0, at["psi"]] = pilot.heading_integral
    J[1, at["z"]] = pilot.depth_integral * float(followed >= 1.0)
    return G * float(schedule(pilot, linear.speed, MATH)), J


def lagged(linear: LinearModel, G: Array, J: Array, lag: float, delay: float) -> WholeLoop:
    """The loop of a linear craft with the ``lag`` [s] of its fins, the trims of a law (G, J) and a ``delay`` [s]."""
    n, m, t = len(linear.states), len(COMMANDS), len(TRIMS)
    A, B = np.zeros((n + m + t, n + m + t)), np.zeros((n + m + t, m))
    A[:n, :n], A[:n, n : n + m] = linear.A, linear.B
    A[n : n + m, n : n + m], B[n : n + m] = -np.eye(m) / lag, np.eye(m) / lag
    A[n + m :, :n] = -J
    K = np.hstack([G, np.zeros((m, m)), -np.eye(m)[:, :t]])
    if delay == 0.0:
        return WholeLoop(A, B, K)
    parts = delayed(delay)
    slow, into, out = (block_diag(*[part] * m) for part in parts[:3])
    whole = np.block([[A, B @ out], [np.zeros((len(slow), len(A))), slow]])
    return WholeLoop(whole, np.vstack([B * parts[3], into]), np.hstack([K, np.zeros((m, len(slow)))]))


def delayed(delay: float) -> tuple[Array, Array, Array, float]:
    """A, B, C, D of a ``delay`` [s] as the Pade approximant of ``ORDER``, by scipy."""
    series = [(-delay) ** k / factorial(k) for k in range(2 * ORDER + 1)]
    above, below = pade(series, ORDER, ORDER)
    A, B, C, D = tf2ss(above.coeffs, below.coeffs)
    return np.asarray(A), np.asarray(B), np.asarray(C), float(D[0, 0])
