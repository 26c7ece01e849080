"""Every trial flown by every drawn craft: one piece of a Monte Carlo study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.engine.flights import Flights
from towtank.engine.plan import Ended
from towtank.engine.run import Ensemble
from towtank.engine.start import at
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.montecarlo.draw import Drawn, Tolerances, draw, starts
from towtank.montecarlo.stable import stability
from towtank.trials.ready import Ready, fly_ready, readings

BAND_CHANNELS = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "r", "rudder", "elevator", "speed")
"""Channels whose bands are kept over time, where the first piece of a study is flown."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
LEAST = 20
"""Craft that must still be under way for a band to be stated."""


@dataclass(frozen=True)
class Piece:
    """Part of a study that one worker does: ``count`` craft of piece ``number``."""

    number: int
    count: int


@dataclass(frozen=True)
class Study:
    """What all pieces share: the trials with the model each is flown with, tolerances, seed."""

    model: Model
    trials: tuple[tuple[Model, Ready], ...]
    given: Tolerances
    seed: int


def fly_piece(study: Study, piece: Piece) -> dict[str, Any]:
    """Numbers of one piece, as plain lists so that they can be kept in a file or sent.

    "trials" : name -> {"indices": name -> {"unit", "values" (count)}, "ended" (count)}; "stability" : plane -> (count);
    in the first piece, "bands": name -> {"time", channel -> (quantiles, samples)}.
    """
    drawn = draw(study.model, piece.count, study.given, study.seed, piece.number)
    out: dict[str, Any] = {"trials": {}, "stability": stability(study.model, drawn.columns), "bands": {}}
    for model, trial in study.trials:
        flights = fly_drawn(model, trial, drawn)
        read = readings(model, trial, flights)
        out["trials"][trial.name] = {
            "indices": {name: {"unit": unit, "values": _plain(values)} for name, (values, unit) in read.items()},
            "ended": [Ended(int(code)).name.lower() for code in flights.ended],
        }
        if piece.number == 0:
            out["bands"][trial.name] = bands(flights)
    return out


def fly_drawn(model: Model, trial: Ready, drawn: Drawn) -> Flights:
    """``trial`` flown by the ``drawn`` craft, all under the pilot of the best estimate.

    A model that was ballasted to neutral stays so: its displaced mass goes with its mass.
    """
    columns = dict(drawn.columns)
    body = model.constants.body
    if body.b == body.m:
        columns["b"] = columns["m"]
    for i, name in enumerate(("current_north", "current_east")):
        columns[name] = columns[name] + trial.current[i]
    start = at(trial.setting.state if trial.start is None else trial.start, trial.setting.memory)
    # The trial's own current is in its start already.
    begin = starts(start, drawn.columns)
    return fly_ready(model, trial, Ensemble(len(drawn), columns, begin))


def bands(flights: Flights) -> dict[str, Any]:
    """Quantiles over the craft at every sample: channel -> (len(QUANTILES), S); S ends where fewer than LEAST fly."""
    flying = np.count_nonzero(~np.isnan(flights.log[:, :, 0]), axis=0)
    size = (
        int(np.argmax(flying < min(LEAST, len(flights)))) if np.any(flying < min(LEAST, len(flights))) else len(flying)
    )
    out: dict[str, Any] = {"time": flights.time[:size].tolist()}
    for name in BAND_CHANNELS:
        values = flights.series(name)[:, :size]
        out[name] = np.nanquantile(values, QUANTILES, axis=0).tolist() if size else []
    return out


def pieces(samples: int, size: int) -> Sequence[Piece]:
    """``samples`` craft in pieces of at most ``size``."""
    return [Piece(i, min(size, samples - first)) for i, first in enumerate(range(0, samples, size))]


def _plain(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def merged(answers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Pieces in order as one: values end to end, bands of the first."""
    first = answers[0]
    trials: dict[str, Any] = {}
    for name, trial in first["trials"].items():
        parts = [answer["trials"][name] for answer in answers]
        trials[name] = {
            "indices": {
                key: {"unit": entry["unit"], "values": [x for part in parts for x in part["indices"][key]["values"]]}
                for key, entry in trial["indices"].items()
            },
            "ended": [x for part in parts for x in part["ended"]],
        }
    stable = {key: [x for answer in answers for x in answer["stability"][key]] for key in first["stability"]}
    return {"trials": trials, "stability": stable, "bands": first["bands"]}
