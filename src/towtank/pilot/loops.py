"""The linear loops of a craft under any pilot: plane by plane, and all states together with trims and delay."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from towtank.pilot.feedback import closed_loop, margins, steady_gain
from towtank.pilot.law import Pilot, authority, schedule
from towtank.pilot.plant import Loop, block, with_integral, with_servo

COMMANDS = ("rudder", "elevator", "aileron")
"""Where the loop is cut: the commands of the pilot."""
STATES = ("z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
"""States of the craft in the loop; x and y are not fed back while a heading is held."""
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
    if not delay >= 0.0:
        raise InputError(f"loop of {model.craft.name}: a delay of {delay:g} s. A delay is zero or more.")
    lag, linear = _lag(model), linearise(model, speed)
    return lagged(linear.part(STATES, COMMANDS), *law_of(pilot, linear), lag, delay)


PLANES = {
    "heading": (("v", "r", "psi"), 0, 0),
    "pitch": (("w", "q", "theta"), 1, None),
    "depth": (("w", "q", "theta", "z"), 1, 1),
    "roll": (("p", "phi"), 2, None),
}
"""Loop -> states, command in ``COMMANDS``, trim (0 of the rudder, 1 of the elevator) that integrates the last state."""


def judged(model: Model, pilot: Pilot) -> Pilot:
    """``pilot`` with the eigenvalues and margins of its loops on ``model`` at its own speed, plane by plane.

    The loops are those of ``design_pilot``: with the fins' lag, without what couples the planes. A pilot with a loop
    that is not stable gets a note that says so.

    Raises
    ------
    InputError
        The craft has no fins.
    """
    loops = planes(model, pilot)
    values = {name: tuple(complex(s) for s in closed_loop(*loop)) for name, loop in loops.items() if name != "pitch"}
    bad = [name for name, found in values.items() if not found[0].real < 0.0]
    notes = tuple(
        f"Not stable on {model.craft.name} at {pilot.speed:g} m/s in {name}: largest eigenvalue "
        f"{values[name][0].real:+.3g} 1/s."
        for name in bad
    )
    held = {name: margins(*loop) for name, loop in loops.items() if name not in bad and np.any(loop[2])}
    kept = (note for note in pilot.notes if not note.startswith("Not stable on "))
    return replace(pilot, eigenvalues=values, margins=held, notes=(*kept, *notes))


def planes(model: Model, pilot: Pilot) -> dict[str, Loop]:
    """The loops of ``pilot`` at its own speed, plane by plane, in the order of ``PLANES``."""
    linear, lag = linearise(model, pilot.speed), _lag(model)
    G, J = law_of(pilot, linear)
    loops: dict[str, Loop] = {}
    for name, (states, command, trim) in PLANES.items():
        n, here = len(states), [STATES.index(state) for state in states]
        plant, outputs, gains = with_servo(block(linear, states, COMMANDS[command]), lag), np.eye(n + 1)[:n], G[command]
        gains = gains[here]
        if name == "pitch":
            gains = np.array([pilot.heave, pilot.pitch_rate, pilot.pitch]) * float(schedule(pilot, pilot.speed, MATH))
        if trim is not None and J[trim].any():
            plant, gains = with_integral(plant, outputs[-1]), np.append(gains, J[trim, here[-1]])
            outputs = np.eye(n + 2)[[*range(n), n + 1]]
        loops[name] = (plant, outputs, gains)
    return loops


def _lag(model: Model) -> float:
    if not model.craft.fins:
        raise InputError(f"craft {model.craft.name} has no fins, so no pilot can steer it. Fly it in open loop.")
    return max(float(fin.time_constant) for fin in model.craft.fins)


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
    """The loop of a linear craft with the ``lag`` [s] of its fins, the trims of a law (G, J) and a ``delay`` [s].

    A trim that integrates nothing is no state.
    """
    used = np.flatnonzero(J.any(axis=1))
    n, m, t = len(linear.states), len(COMMANDS), len(used)
    A, B = np.zeros((n + m + t, n + m + t)), np.zeros((n + m + t, m))
    A[:n, :n], A[:n, n : n + m] = linear.A, linear.B
    A[n : n + m, n : n + m], B[n : n + m] = -np.eye(m) / lag, np.eye(m) / lag
    A[n + m :, :n] = -J[used]
    K = np.hstack([G, np.zeros((m, m)), -np.eye(m)[:, used]])
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
