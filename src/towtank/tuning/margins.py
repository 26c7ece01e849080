"""Robust margins of a pilot on the whole linear loop, by python-control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from towtank.engine.clock import clock_of
from towtank.errors import TowtankError, TrialError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.pilot.law import Pilot
from towtank.pilot.loops import COMMANDS, WholeLoop, whole_loop

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Disk:
    """A disk margin: what gain and phase may change by at once, at every frequency.

    alpha [-] : size of the balanced disk.   gain : factor either way.   phase [rad].
    """

    alpha: float
    gain: float
    phase: float


@dataclass(frozen=True)
class LoopMargins:
    """One loop cut at its command, the other two closed.

    up, down : smallest factor above and largest below 1 by which the gain may change; infinity and 0 without a limit.
    phase [rad], infinity without a crossover.   delay [s] : that uses up the phase.   modulus : smallest distance of
    the Nyquist curve to -1, the inverse of the largest sensitivity.   disk : gain and phase together.
    """

    up: float
    down: float
    phase: float
    delay: float
    modulus: float
    disk: Disk


@dataclass(frozen=True)
class RobustMargins:
    """Margins of a pilot at ``speed`` [m/s], with ``held`` [s] of delay in each command.

    growth [1/s] : largest real part of an eigenvalue with all loops closed.   loops : command -> margins; a command the
    pilot does not move is absent.   together : all loops changed at once, each in its own way.
    """

    speed: float
    held: float
    growth: float
    loops: Mapping[str, LoopMargins]
    together: Disk

    @property
    def gain(self) -> float:
        """Smallest factor, either way, by which the gain of one loop may change."""
        return min((min(m.up, 1.0 / max(m.down, 1e-300)) for m in self.loops.values()), default=np.inf)

    @property
    def phase(self) -> float:
        """Smallest phase margin of one loop [rad]."""
        return min((m.phase for m in self.loops.values()), default=np.inf)


def robust_margins(
    model: Model, pilot: Pilot, speed: float | None = None, *, delay: float | None = None
) -> RobustMargins:
    """Margins of ``pilot`` on ``model`` at ``speed`` [m/s], the pilot's own when not given; all planes coupled.

    delay [s] : in each command; half the control period of the engine when not given, for a held command.

    Source     python-control: ``stability_margins``, ``disk_margins`` (seiler2020).
    Departure  The margin of all loops together takes the structured singular value from scaled norms
               (``structured_norm``), because python-control has it from a library under the GPL.
    Valid      Small motions about straight level flight.

    Raises
    ------
    TowtankError
        python-control is not installed.
    TrialError
        The loop is not stable, so it has no margins.
    """
    control = _control()
    speed = pilot.speed if speed is None else float(speed)
    held = clock_of(model, speed).tick / 2.0 if delay is None else float(delay)
    whole = whole_loop(model, pilot, speed, delay=held)
    growth = float(whole.eigenvalues[0].real)
    if not growth < 0.0:
        raise TrialError(
            f"pilot {pilot.craft} at {speed:g} m/s: the loop is not stable (largest eigenvalue {growth:+.3g} 1/s), so "
            "it has no margins. Design or tune a pilot for this speed."
        )
    moved = [i for i in range(len(COMMANDS)) if np.any(whole.K[i, :10]) and _acts(whole, i)]
    frequency = whole.frequencies
    loops = {COMMANDS[i]: _one(control, whole, i, frequency) for i in moved}
    return RobustMargins(speed, held, growth, loops, _together(whole, moved, frequency))


def _control() -> Any:
    try:
        import control
    except ImportError:
        raise TowtankError(
            "robust margins need python-control, which is not installed. Install the extra: "
            'pip install "towtank[control]".'
        ) from None
    return control


def _acts(whole: WholeLoop, at: int) -> bool:
    """True where the command moves anything but its own fin."""
    fins = 10 + at
    return bool(np.abs(np.delete(whole.A[:, fins], fins)).max() > 1e-12)


def _one(control: Any, whole: WholeLoop, at: int, frequency: Array) -> LoopMargins:
    """Margins of the loop cut at one command."""
    A, B, K = whole.cut(at)
    loop = control.ss(A, B, K, 0)
    response = control.frd(loop, frequency)
    gains, phases, distances, _, crossings, _ = control.stability_margins(response, returnall=True)
    # The curve of a loop that does not integrate also begins on the axis, at rest, which is no crossing to the library.
    gains = np.append(gains, -1.0 / whole.steady(at) if whole.steady(at) < 0.0 else np.inf)
    alpha, gain, phase = control.disk_margins(loop, frequency)
    phases = np.radians(phases)
    delays = np.mod(phases, 2.0 * np.pi) / np.where(crossings > 0.0, crossings, np.nan)
    seen = np.abs(1.0 + response(1j * frequency))
    return LoopMargins(
        up=float(min(gains[gains > 1.0], default=np.inf)),
        down=float(max(gains[gains < 1.0], default=0.0)),
        phase=float(min(np.abs(phases), default=np.inf)),
        delay=float(min(delays, default=np.inf)),
        modulus=float(min([*distances, seen.min()])),
        disk=Disk(float(alpha), float(10.0 ** (gain / 20.0)), float(np.radians(phase))),
    )


def _together(whole: WholeLoop, moved: list[int], frequency: Array) -> Disk:
    """Disk margin of the loops ``moved`` changed at once.

    Source     seiler2020: alpha = 1 / max over w of mu(S - I/2), S = (I + L)^-1, for the balanced disk.
    """
    others = [i for i in range(len(COMMANDS)) if i not in moved]
    closed = WholeLoop(whole.A - whole.B[:, others] @ whole.K[others], whole.B[:, moved], whole.K[moved])
    unit = np.eye(len(moved))
    balanced = np.linalg.inv(unit + closed.response(frequency)) - 0.5 * unit
    # The plain norm is an upper bound: from where it falls below the largest value found, nothing larger can come.
    bound, largest = np.linalg.norm(balanced, 2, axis=(1, 2)), 0.0
    for i in np.argsort(-bound):
        if bound[i] <= largest:
            break
        largest = max(largest, structured_norm(balanced[i]))
    return disk_of(1.0 / largest)


def disk_of(alpha: float) -> Disk:
    """Gain and phase that a balanced disk of size ``alpha`` holds; gain infinite and phase 90 deg or more from 2 on.

    Source     seiler2020, eq. for the balanced disk: gain (2 + alpha) / (2 - alpha), phase 2 atan(alpha / 2).
    """
    gain = (2.0 + alpha) / (2.0 - alpha) if alpha < 2.0 else np.inf
    return Disk(float(alpha), float(gain), float(2.0 * np.arctan(alpha / 2.0)))


def structured_norm(M: Complex) -> float:
    """Structured singular value of ``M`` (n, n) for n changes, each complex and on its own: min over D of |D M D^-1|.

    Source     packarddoyle1993: the scaled norm is convex in the logarithms of D and exact for up to three changes.
    """
    n = len(M)

    def scaled(logs: Array) -> float:
        d = np.exp(np.concatenate([[0.0], logs]))
        return float(np.linalg.norm(M * d[:, None] / d, 2))

    if n < 2:
        return float(np.abs(M).max(initial=0.0))
    # Balancing rows against columns (Osborne) comes close; the simplex does the rest.
    start = np.log(np.maximum(np.abs(M).sum(axis=0), 1e-12) / np.maximum(np.abs(M).sum(axis=1), 1e-12)) / 2.0
    best = minimize(scaled, start[1:] - start[0], method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-9})
    return float(min(best.fun, scaled(np.zeros(n - 1))))
