"""Classical identification: in-phase and quadrature harmonics of each oscillation, one run at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from towtank.derive.cycles import Samples
from towtank.derive.screen import name_of
from towtank.frames import Array
from towtank.symbols import LOADS, RATES, TERMS
from towtank.tank.run import Run

DRIVEN = {"surge": "u", "sway": "v", "heave": "w", "roll": "p", "pitch": "q", "yaw": "r"}
"""Kind of oscillation -> the velocity it drives."""

_ODD = {"sway": "YKN", "heave": "ZM", "roll": "YKN", "pitch": "ZM", "yaw": "YKN"}
FIRST = 8.0 / (3.0 * math.pi)
"""First harmonic of |cos| cos."""
THIRD = 8.0 / (15.0 * math.pi)
"""Third harmonic of |cos| cos."""


def harmonics(values: Array, count: int, cycles: int) -> Array:
    """Complex amplitudes (count + 1, ...) of ``values`` (N, ...) over an integer number of cycles.

    Entry k multiplies exp(i k w t); entry 0 is the mean.

    Source     THEORY section 4: F_c = (2 / nT) int F cos wt, F_s likewise; here F_c - i F_s.
    """
    size = len(values)
    # Whole turns taken out of the angle before it is one, so that long records lose no digits. A few sums, not a
    # transform: only the first of hundreds of harmonics are wanted.
    angle = 2.0 * np.pi / size * (np.outer(np.arange(count + 1) * cycles, np.arange(size)) % size)
    flat = values.reshape(size, -1)
    orders = (np.cos(angle) @ flat - 1j * (np.sin(angle) @ flat)).reshape(count + 1, *values.shape[1:]) / size
    return np.asarray(np.concatenate([orders[:1], 2.0 * orders[1:]]))


def fourier(runs: Sequence[Run], samples: Samples) -> dict[str, dict[str, float]]:
    """Run name -> term -> value, for every oscillation; ``<term>_equivalent`` is the linear coefficient unsplit.

    ``even_share`` is the mean and second harmonic of the driven loads over their first: it should vanish.

    Source     perron, section 3.6; ittc75020602; THEORY section 4.
    Valid      Small angles, one frequency. Splitting linear from quadratic by the third harmonic magnifies noise in
               the quadratic term 5.9 times; the regression uses several amplitudes instead.
    """
    return {
        name_of(run, runs): {term: float(value) for term, value in _one(run, samples, i).items()}
        for i, run in enumerate(runs)
        if run.kind in DRIVEN and not run.steady
    }


def _one(run: Run, samples: Samples, number: int) -> dict[str, float]:
    at = samples.run == number
    cycles = int(samples.period[at].max()) + 1
    if at.sum() < 8 * cycles:
        return {}
    rate = DRIVEN[run.kind]
    w = 2.0 * math.pi / run.period
    motion = harmonics(samples.nu[at], 3, cycles)
    load = harmonics(samples.loads[0, at], 3, cycles)
    drive, u = motion[1, RATES.index(rate)], float(motion[0, 0].real)
    if abs(drive) == 0.0 or u == 0.0:
        return {}
    if run.kind == "surge":
        return _surge(drive, u, w, load)
    out: dict[str, float] = {}
    for name in _ODD[run.kind]:
        out |= _odd(name, rate, drive, abs(u), w, load[:, LOADS.index(name)])
    return out | _axial(rate, drive, samples.nu[at], load[:, 0], cycles) | _even(load, run.kind)


def _odd(name: str, rate: str, drive: complex, u: float, w: float, load: Array) -> dict[str, float]:
    """In-phase part -> added mass; quadrature -> equivalent linear damping, split by the third harmonic."""
    transfer = load[1] / drive
    amplitude = abs(drive)
    phase = drive / amplitude
    quadratic = float((load[3] / phase**3).real) / (THIRD * amplitude**2)
    linear = f"{name}u{rate}"
    out = {f"{name}{rate}dot": float(transfer.imag) / w}
    if linear in TERMS:
        out[f"{linear}_equivalent"] = float(transfer.real) / u
        out[linear] = (float(transfer.real) - FIRST * quadratic * amplitude) / u
        out[f"{name}{rate}{rate}"] = quadratic
    return out


def _axial(rate: str, drive: complex, nu: Array, load: Array, cycles: int) -> dict[str, float]:
    """X = Xuu |u| u + Xvv v v and the like: two unknowns from the mean and the second harmonic in phase with v v.

    In yaw and pitch u u has a second harmonic of its own, since the speed along the path varies.
    """
    term = f"X{rate}{rate}"
    if term not in TERMS:
        return {}
    u, x = nu[:, 0], nu[:, RATES.index(rate)]
    phase = (drive / abs(drive)) ** 2
    squares = harmonics(np.stack([np.abs(u) * u, x * x], axis=1), 2, cycles)
    matrix = np.stack([squares[0].real, (squares[2] / phase).real])
    ahead, across = np.linalg.solve(matrix, np.array([load[0].real, (load[2] / phase).real]))
    return {term: float(across), "Xuu": float(ahead)}


def _surge(drive: complex, u: float, w: float, load: Array) -> dict[str, float]:
    transfer = load[1, 0] / drive
    return {
        "Xudot": float(transfer.imag) / w,
        "Xuu": float(load[0, 0].real) / (u * u + 0.5 * abs(drive) ** 2),
        "Xuu_quadrature": float(transfer.real) / (2.0 * abs(u)),
    }


def _even(load: Array, kind: str) -> dict[str, float]:
    at = [LOADS.index(name) for name in _ODD[kind]]
    first = np.linalg.norm(load[1, at])
    even = np.linalg.norm(load[[0, 2]][:, at])
    return {"even_share": float(even / first)} if first > 0.0 else {}
