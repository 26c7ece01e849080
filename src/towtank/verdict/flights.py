"""Trials flown by many craft, as they are: under the pilot, trim and thrust of the best estimate."""

from __future__ import annotations

import numpy as np

from towtank.engine.clock import clock_of
from towtank.engine.flights import Flights
from towtank.engine.plan import Clock, Ended, Log
from towtank.engine.run import Ensemble
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.trials.ready import Readings, Ready, fly_ready, readings
from towtank.verdict.many import Many, neutral

RAN_AWAY = (Ended.NOT_FINITE, Ended.TOO_FAST)


def fly_many(
    model: Model, trial: Ready, craft: Many, kept: Log | bool | None = None, start: Array | None = None,
    clock: Clock | None = None,
) -> Flights:  # fmt: skip
    """``trial`` of ``model`` flown by every ``craft``.

    A model that was ballasted to neutral stays so: its displaced mass goes with its mass.

    kept : record over time; what the readings need when left out.   start (n, 13 + n_fins + 3) : where they differ.
    clock : the trial's own when left out.

    Valid      Inertia about the origin stays that of the best estimate when mass or CG differ.
    """
    columns = dict(craft.columns)
    if neutral(model) and "m" in columns:
        columns["b"] = columns["m"]
    ensemble = Ensemble(len(craft), columns, start)
    return fly_ready(model, trial, ensemble, record=_needed(model, trial, kept), clock=clock)


def _needed(model: Model, trial: Ready, kept: Log | bool | None) -> Log | bool:
    if kept is not None:
        return kept
    every = max(1, round(trial.interval / clock_of(model, trial.setting.speed).tick))
    return Log(trial.needs, every) if trial.needs else False


def sound_readings(model: Model, trial: Ready, flights: Flights) -> Readings:
    """Indices of ``trial`` (n,); NaN for a craft that ran away: it left the range of its derivatives."""
    away = np.isin(flights.ended, RAN_AWAY)
    return {
        name: (np.where(away, np.nan, values), unit) for name, (values, unit) in readings(model, trial, flights).items()
    }
