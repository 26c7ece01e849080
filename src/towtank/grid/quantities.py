"""What is compared between meshes: steady loads, and mean, peak and harmonics of oscillations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.symbols import LOADS, RATES
from towtank.tank.run import Run

DRIVEN: Mapping[str, tuple[str, str]] = {
    "surge": ("u", "X"), "sway": ("v", "YN"), "heave": ("w", "ZM"), "roll": ("p", "K"), "pitch": ("q", "MZ"),
    "yaw": ("r", "NY"),
}  # fmt: skip
"""Oscillation -> the rate it drives and the loads that answer at its frequency."""

STEADY, MEAN, PEAK, WITH_VELOCITY, WITH_ACCELERATION, THIRD = (
    "steady", "mean", "peak", "in phase", "quadrature", "third",
)  # fmt: skip
"""Measures: a held load; mean of the axial force; largest size; first harmonic with the driven rate (damping) and with
its time derivative (added mass); size of the third harmonic."""
HARMONICS = (WITH_VELOCITY, WITH_ACCELERATION, THIRD)
"""Measures that are amplitudes of a sinusoid."""

NEGLIGIBLE = 0.01
"""Loads below this share of the largest of their run are left out: symmetry makes them zero, or they decide nothing.
Moments count over the length of the craft."""
PERIODS = 2
"""Periods analysed, the last ones: the first carries the start-up (perron, section 3.5)."""
LEAST_SAMPLES = 8
"""Least samples per period: the third harmonic needs more than six."""


def measures(run: Run) -> dict[tuple[str, str], float]:
    """(load, measure) -> value [N, N m] of all that may be compared between meshes, small loads too.

    Raises
    ------
    InputError
        Loads that are not finite, or an oscillation with too few samples per period.
    """
    _check(run)
    if run.steady:
        return {(load, STEADY): float(value) for load, value in zip(LOADS, run.loads.mean(axis=0), strict=True)}
    used = last_periods(run)
    found = {("X", MEAN): float(run.loads[used, 0].mean())} if run.kind in DRIVEN else {}
    rate, loads = DRIVEN.get(run.kind, ("", ""))
    if not rate:
        return {(load, PEAK): float(np.abs(run.loads[used, i]).max()) for i, load in enumerate(LOADS)}
    count = cycles(run)
    drive = _harmonic(run.history.nu[used, RATES.index(rate)], 1, count)
    phase = drive / abs(drive)
    for load in loads:
        values = run.loads[used, LOADS.index(load)]
        first = _harmonic(values, 1, count) / phase
        found |= {
            (load, PEAK): float(np.abs(values).max()),
            (load, WITH_VELOCITY): float(first.real),
            (load, WITH_ACCELERATION): float(first.imag),
            (load, THIRD): float(abs(_harmonic(values, 3, count))),
        }
    return found


def root_mean_square(run: Run) -> Array:
    """Root mean square (6,) of the loads over what is analysed: the scale of every measure of a load."""
    loads = run.loads if run.steady else run.loads[last_periods(run)]
    return np.asarray(np.sqrt((loads**2).mean(axis=0)))


def considerable(run: Run) -> tuple[str, ...]:
    """Loads that are not negligible in ``run``."""
    arm = np.where(np.arange(6) < 3, 1.0, run.length)
    size = root_mean_square(run) / arm
    return tuple(load for i, load in enumerate(LOADS) if size[i] > NEGLIGIBLE * size.max() > 0.0)


def last_periods(run: Run) -> slice:
    """Samples of the last PERIODS whole periods of an oscillation, fewer when it has no more."""
    per = (len(run.history.time) - 1) // run.periods
    stop = run.periods * per
    return slice(max(stop - PERIODS * per, per if run.periods > 1 else 0), stop)


def cycles(run: Run) -> int:
    """Number of periods that ``last_periods`` holds."""
    used = last_periods(run)
    return int((used.stop - used.start) * run.periods // (len(run.history.time) - 1))


def _harmonic(values: Array, order: int, count: int) -> complex:
    """Complex amplitude c of the harmonic k = ``order`` over ``count`` periods; the signal holds Re(c exp(i k w t))."""
    n = len(values)
    angle = 2.0 * np.pi * order * count * np.arange(n) / n
    return complex(2.0 * (values * np.exp(-1j * angle)).mean())


def _check(run: Run) -> None:
    if not np.isfinite(run.loads).all():
        raise InputError(f"grid: run {run.name} holds loads that are not finite. Run that mesh again.")
    per = (len(run.history.time) - 1) // max(run.periods, 1)
    if not run.steady and per < LEAST_SAMPLES:
        raise InputError(
            f"grid: run {run.name} has {per} samples per period; harmonics to the third need {LEAST_SAMPLES}. "
            "Record it more often."
        )
