"""The motion, the current and the biases of a record, estimated with the coefficients as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from towtank.field.calibrate.fit import Crew, Fit, case_of, fit
from towtank.field.calibrate.noise import MOTION, WATER
from towtank.field.calibrate.normal import spread
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.shoot import CHUNK, Engine, Point
from towtank.field.calibrate.unknowns import unknowns
from towtank.field.calibrate.windows import SHARED, windows_of
from towtank.field.drive import drive_of
from towtank.field.log import SeaLog
from towtank.frames import Array
from towtank.model.equations import STATE, Model
from towtank.progress import Progress, Silent

NAMES = STATE


@dataclass(frozen=True)
class Smoothed:
    """The motion of a record as the model and its measurements together have it.

    time (N + 1,) [s] : of the ticks.   states (N + 1, 12) : as in ``STATE``; NaN where the record says nothing of the
    fins.   std (N + 1, 12) : their standard deviation, that of the start of the window they lie in.
    current (N + 1, 3) [m/s, NED] : mean and changing part, one value for each window.   mean_current, mean_current_std
    (3,).   thrust, thrust_std : factor of the thrust.   bias, bias_std : channel -> offset.   log, model.
    """

    log: SeaLog
    model: Model
    time: Array
    states: Array
    std: Array
    current: Array
    mean_current: Array
    mean_current_std: Array
    thrust: float
    thrust_std: float
    bias: Mapping[str, float]
    bias_std: Mapping[str, float]
    fit: Fit

    def at(self, time: float) -> Array:
        """State (12,) at the tick nearest to ``time`` [s]."""
        held = np.flatnonzero(np.isfinite(self.states[:, 0]))
        return np.asarray(self.states[held[np.argmin(np.abs(self.time[held] - time))]])


def smooth(
    model: Model, log: SeaLog, *, settings: Settings | None = None, thrust: float | None = None,
    progress: Progress | None = None, threads: int | None = None,
) -> Smoothed:  # fmt: skip
    """The motion of ``log``, its current, thrust and biases, with the coefficients of ``model`` as they are.

    thrust [N] : that the factor multiplies; the model's own at the median speed of the record when left out.

    Source     rauch1965 (fixed-interval smoothing), as the normal equations of ``towtank.field.calibrate.fit``.

    Raises
    ------
    InputError
        A record of which nothing can be said (``windows_of``).
    TowtankError
        No compiled engine, or a motion that does not stay finite.
    """
    settings = settings or Settings()
    drive = drive_of(model, log)
    windows = windows_of(model, log, settings, None if thrust is None else replace(drive, thrust=thrust))
    found = fit(
        [case_of(windows, (), settings)], unknowns(model.derivatives, ()), settings, progress or Silent(), threads
    )
    return smoothed(found, 0, model)


def smoothed(found: Fit, number: int, model: Model, threads: int | None = None) -> Smoothed:
    """The motion of a record of a fit."""
    case, here, C = found.cases[number], found.found[number], found.shared[number]
    it, drive, point = case.windows, case.windows.drive, here.point
    P = spread(it, case.links, here.piece, here.equations, C)
    count = len(drive.time)
    states, std, current = (np.full((count, size), np.nan) for size in (MOTION, MOTION, 3))
    seen = flown(case.engine, found, point, threads)
    own = np.sqrt(np.maximum(P.states[:, range(MOTION), range(MOTION)], 0.0))
    water = point.shared[1:4] + point.states[:, WATER]
    for i, (first, ticks) in enumerate(zip(it.first, it.ticks, strict=True)):
        end = first + ticks + 1
        states[first + 1 : end], std[first:end], current[first:end] = seen[i, :ticks, :MOTION], own[i], water[i]
    # The heading of a run is counted from its own start; that of the start is counted through the record.
    for i, first in enumerate(it.first):
        span = slice(first + 1, first + it.ticks[i] + 1)
        states[span, 5] += 2.0 * np.pi * np.round((point.states[i, 5] - states[first + 1, 5]) / (2.0 * np.pi))
        states[first] = point.states[i, :MOTION]
    k = found.unknowns.size
    spread_of = np.sqrt(np.diag(C)[k:])
    names = it.shared[len(SHARED) :]
    return Smoothed(
        it.log, model, drive.time, states, std, current, point.shared[1:4], spread_of[1:4], float(point.shared[0]),
        float(spread_of[0]),
        {name.removeprefix("bias_"): float(v) for name, v in zip(names, point.shared[4:], strict=True)},
        {name.removeprefix("bias_"): float(v) for name, v in zip(names, spread_of[4:], strict=True)}, found,
    )  # fmt: skip


def flown(engine: Engine, found: Fit, point: Point, threads: int | None = None) -> Array:
    """Channels (W, n, C) of all windows at ``point``; the heading goes on over whole turns in each window."""
    common = engine.common(found.unknowns.values(found.z))
    total = len(point.states)
    spans = [slice(a, min(a + CHUNK, total)) for a in range(0, total, CHUNK)]
    crew = Crew(threads)
    try:
        parts = crew.each([partial(engine.fly, common, point, span, slopes=False) for span in spans])
    finally:
        crew.close()
    seen = np.concatenate([part for part, _ in parts])
    seen[..., 5] = np.unwrap(seen[..., 5], axis=1)
    return seen
