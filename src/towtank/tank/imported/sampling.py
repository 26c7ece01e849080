"""The part of a record that counts: an average, whole periods on a uniform grid, or a free motion on one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.plan.limits import SAMPLES_PER_PERIOD
from towtank.symbols import LOADS
from towtank.tank.imported.mapping import Window
from towtank.tank.imported.table import Doubt, Table

LAST = 0.5
"""Share of a steady record that is averaged when the mapping names no window: its first half holds the start."""

AVERAGE_CHANGE = 0.01
"""Change of an average between the halves of its window, as a share of the largest force or moment, that is remarked
on: 1 % is the floor that ``derive`` puts under the spread of a load."""

UNIFORM = 1e-3
"""Departure from a uniform grid, in steps, that is left alone: at 16 samples a period it turns a phase by 0.02 deg."""

SWING = 0.5
"""Standard deviation of the largest force of a steady record, as a share of its mean, that is remarked on. Judgement:
shedding behind a slender hull at 20 deg stays below it, and an oscillation taken for a steady run is far above."""

BATCHES = 8
"""Blocks of an average whose spread gives its standard error: few enough to be longer than the shedding in them."""

PERIOD_SLACK = 1e-4
"""Share of a period by which a record may fall short of a whole number: a step lost to the printing of times."""


@dataclass(frozen=True)
class Record:
    """Samples of one run in SI, still in the file's axes.

    time (N,) of the file; columns : name -> values (N,).   period [s], 0 when steady.   periods : whole ones.
    said : what was done, a sentence each.   average : load -> mean, change and standard error, of a steady run.
    """

    time: Array
    columns: Mapping[str, Array]
    period: float
    periods: int
    said: tuple[str, ...] = ()
    average: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def windowed(table: Table, time: Array, columns: Mapping[str, Array], window: Window) -> NDArray[np.intp]:
    """Rows of the record inside ``window``; all of their numbers must be finite.

    Raises
    ------
    InputError
        Nothing lies in the window, or a cell in it is no number.
    """
    slack = 1e-9 * float(np.ptp(time))
    rows = np.flatnonzero((time >= window.start - slack) & (time <= window.end + slack))
    if not len(rows):
        raise InputError(
            f"{table.title}: no row between {window.start:g} and {window.end:g}; the record runs from {time[0]:g} to "
            f"{time[-1]:g}. Correct the window."
        )
    if window.last is not None:
        begin = time[rows[-1]] - window.last * (time[rows[-1]] - time[rows[0]])
        rows = rows[time[rows] >= begin - slack]
    for name, values in columns.items():
        bad = rows[~np.isfinite(values[rows])]
        if len(bad):
            raise InputError(
                f"{table.place(int(bad[0]))}, column of {name}: not a finite number, the first of {len(bad)} in the "
                "window. The solver diverged or the cell is empty; move the window, or export again."
            )
    return rows


def averaged(time: Array, columns: Mapping[str, Array]) -> Record:
    """A steady record as its average, weighted by time, in two equal samples one second apart."""
    weights = np.ones(len(time))
    if len(time) > 1:
        steps = np.diff(time)
        weights = 0.5 * (np.append(steps, steps[-1]) + np.insert(steps, 0, steps[0]))
    means = {name: float(np.average(values, weights=weights)) for name, values in columns.items()}
    loads = [name for name in LOADS if name in columns]
    average = {name: _quality(means[name], columns[name]) for name in loads}
    said: list[str] = [f"steady: {len(time)} samples from {time[0]:g} to {time[-1]:g} averaged"]
    for group in ("XYZ", "KMN"):
        scale = max((abs(means[name]) for name in loads if name in group), default=0.0)
        for name in loads:
            change = abs(average[name]["change"])
            if name in group and change > AVERAGE_CHANGE * scale > 0.0:
                said.append(
                    Doubt(
                        f"average of {name} (file axes) changes by {100 * change / scale:.2g} % of the largest "
                        f"{'force' if group == 'XYZ' else 'moment'} between the halves of its window (limit "
                        f"{100 * AVERAGE_CHANGE:g} %): not settled"
                    )
                )
    swing = _swing({name: columns[name] for name in loads if name in "XYZ"}, means)
    if swing > SWING:
        said.append(
            Doubt(f"the largest force varies by {swing:.2g} of its mean (limit {SWING:g}): is this a steady run?")
        )
    if len(time) == 1:
        said.append(Doubt("one sample: nothing tells whether it is settled (limit: two)"))
    held = {name: np.full(2, value) for name, value in means.items()}
    return Record(np.array([0.0, 1.0]), held, 0.0, 1, tuple(said), average)


def _swing(forces: Mapping[str, Array], means: Mapping[str, float]) -> float:
    """Standard deviation over the mean of the force that is largest in root mean square."""
    sizes = {name: float(np.sqrt((values**2).mean())) for name, values in forces.items()}
    largest = max(sizes, key=lambda name: sizes[name], default="")
    return float(np.std(forces[largest]) / max(abs(means[largest]), 1e-300)) if sizes.get(largest) else 0.0


def _quality(mean: float, values: Array) -> dict[str, float]:
    half = len(values) // 2
    change = float(values[half:].mean() - values[:half].mean()) if half else 0.0
    blocks = [block.mean() for block in np.array_split(values, BATCHES)] if len(values) >= 2 * BATCHES else []
    error = float(np.std(blocks, ddof=1) / np.sqrt(BATCHES)) if blocks else float("nan")
    return {"mean": mean, "change": change, "standard_error": error}


def in_periods(
    table: Table, rows: NDArray[np.intp], time: Array, columns: Mapping[str, Array], period: float
) -> Record:
    """Whole periods at the end of the record, on a uniform grid with both ends.

    Raises
    ------
    InputError
        Less than one period, fewer than ``SAMPLES_PER_PERIOD`` samples in one, or a gap as long as one of those.
    """
    span = float(time[-1] - time[0]) if len(time) > 1 else 0.0
    count = int(np.floor(span / period + PERIOD_SLACK))
    if count < 1:
        raise InputError(
            f"{table.title}: the record covers {span:g} s, {span / period:.2g} of a period of {period:g} s. One whole "
            "period is the least, two let the first be dropped; correct the frequency (rad/s or Hz?) or the window."
        )
    step = _step(table, rows, time, period)
    per = max(round(period / step), 1)
    if per < SAMPLES_PER_PERIOD:
        raise InputError(
            f"{table.title}: {per} samples in a period of {period:g} s. Below {SAMPLES_PER_PERIOD} the third harmonic, "
            "which carries the cross-flow terms, is lost; write the loads more often, or correct the frequency (rad/s "
            "or Hz?)."
        )
    said: list[str] = [f"{count} whole period{'s' if count > 1 else ''} of {period:.6g} s, {per} samples each"]
    left = max(span - count * period, 0.0)
    if left > UNIFORM * step:
        said.append(f"the first {left:.4g} s before the last whole periods were left out")
    if count == 1:
        said.append(Doubt("one period only: the start-up of the wake is not dropped (limit: two periods)"))
    start = time[0] + left
    grid = start + np.arange(count * per + 1) * (period / per)
    out, words = _on_grid(time, columns, grid, step)
    return Record(grid, out, period, count, (*said, *words))


def free(table: Table, rows: NDArray[np.intp], time: Array, columns: Mapping[str, Array]) -> Record:
    """A free motion on a uniform grid of the median step: one period as long as the record.

    Raises
    ------
    InputError
        Fewer samples than one period of an oscillation needs, or a gap.
    """
    if len(time) <= SAMPLES_PER_PERIOD:
        raise InputError(f"{table.title}: {len(time)} samples of a free motion, wanted more than {SAMPLES_PER_PERIOD}.")
    span = float(time[-1] - time[0])
    step = _step(table, rows, time, span)
    count = max(round(span / step), 1)
    grid = time[0] + np.arange(count + 1) * (span / count)
    out, words = _on_grid(time, columns, grid, step)
    return Record(grid, out, span, 1, (f"free motion of {span:g} s, {count} steps", *words))


def _step(table: Table, rows: NDArray[np.intp], time: Array, period: float) -> float:
    """Median time step [s]; refuses a gap that loses a sixteenth of a period."""
    steps = np.diff(time)
    step = float(np.median(steps))
    widest = int(np.argmax(steps))
    if steps[widest] > max(period / SAMPLES_PER_PERIOD, 1.5 * step):
        raise InputError(
            f"{table.place(int(rows[widest]))}: a gap of {steps[widest]:g} s after t = {time[widest]:g}, where the "
            f"steps are {step:g} s and a period is {period:g} s. It cannot be bridged; restore the rows, or move the "
            "window."
        )
    return step


def _on_grid(
    time: Array, columns: Mapping[str, Array], grid: Array, step: float
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Columns at the times ``grid``: picked where the samples lie there already, else by a cubic spline."""
    nearest = np.clip(np.searchsorted(time, grid - 0.5 * step), 0, len(time) - 1)
    if np.abs(time[nearest] - grid).max() <= UNIFORM * step and len(np.unique(nearest)) == len(grid):
        return {name: values[nearest] for name, values in columns.items()}, ()
    from scipy.interpolate import CubicSpline

    inside = np.clip(grid, time[0], time[-1])
    steps = np.diff(time)
    said = (
        f"steps of {steps.min():.4g} to {steps.max():.4g} s resampled to {grid[1] - grid[0]:.6g} s by a cubic spline, "
        "since harmonics need a uniform grid over whole periods"
    )
    return {name: np.asarray(CubicSpline(time, values)(inside)) for name, values in columns.items()}, (said,)
