"""How well a model foresees a record it was not fitted to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import InputError
from towtank.field.calibrate.noise import WATER
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.shoot import Engine, Point, wrapped
from towtank.field.calibrate.smooth import flown, smooth
from towtank.field.calibrate.windows import SHARED, Windows, windows_of
from towtank.field.log import SeaLog
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.progress import Progress

HORIZON = 30.0
"""Length [s] of a prediction."""


@dataclass(frozen=True)
class Score:
    """Root mean square of what is missed in predictions of ``horizon`` [s], over ``windows`` of them.

    rms : channel -> of all samples of all windows, in the channel's unit.   end : of the last fifth of each window.
    noise : channel -> std of its noise, the least that any model can reach.   total : root mean square of all samples,
    each over the std of its channel: 1 where nothing is missed but noise.
    """

    log: str
    horizon: float
    windows: int
    rms: Mapping[str, float]
    end: Mapping[str, float]
    noise: Mapping[str, float]
    total: float


def score(
    model: Model, log: SeaLog, horizon: float = HORIZON, *, settings: Settings | None = None,
    thrust: float | None = None, progress: Progress | None = None, threads: int | None = None,
) -> Score:  # fmt: skip
    """Predictions of ``log`` over ``horizon`` [s], each begun from the motion that the model's own smoothing finds.

    The fins and the thrust are those of the record. In a prediction the current is the mean of the record, and that
    part of what was felt at its start which is expected to last.

    thrust [N] : that the throttle multiplies, such as that of another model under comparison.

    Raises
    ------
    InputError
        The record has no stretch of half a horizon.
    """
    settings = settings or Settings()
    told = smooth(model, log, settings=settings, thrust=thrust, progress=progress, threads=threads)
    case = told.fit.cases[0]
    it = windows_of(model, log, replace(settings, window=horizon), case.windows.drive)
    kept = it.ticks * it.drive.clock.tick >= 0.5 * horizon
    if not kept.any():
        raise InputError(
            f"log {log.name}: no stretch of {0.5 * horizon:g} s in which what drove the craft is known, so nothing can "
            "be foretold. Take a longer record, or a shorter horizon."
        )
    lasting = settings.memory / horizon * (1.0 - np.exp(-horizon / settings.memory))
    states = np.zeros((len(it.first), 15))
    states[:, :12] = told.states[it.first]
    states[:, WATER] = lasting * (told.current[it.first] - told.mean_current)
    point = Point(states, told.fit.found[0].point.shared)
    rest = _rest(it, flown(Engine(it, ()), told.fit, point, threads), point)
    rms: dict[str, float] = {}
    end: dict[str, float] = {}
    last = np.arange(rest.shape[1]) >= 0.8 * rest.shape[1]
    for name in it.std:
        column = rest[kept][..., it.channels.index(name)]
        for table, part in ((rms, column), (end, column[:, last])):
            if np.isfinite(part).any():
                table[name] = float(np.sqrt(np.nanmean(part**2)))
    whole = np.concatenate([(rest[kept][..., it.channels.index(n)] / std).ravel() for n, std in it.std.items()])
    total = float(np.sqrt(np.nanmean(whole**2)))
    return Score(log.name, horizon, int(kept.sum()), rms, end, dict(it.std), total)


def _rest(it: Windows, seen: Array, point: Point) -> Array:
    """What is missed (W, n, C), NaN where nothing was measured."""
    rest = np.where(it.weight > 0.0, it.measured - seen, np.nan)
    rest[..., it.biased] -= point.shared[len(SHARED) :]
    for name in ("phi", "psi"):
        place = it.channels.index(name)
        rest[..., place] = wrapped(rest[..., place])
    return rest
