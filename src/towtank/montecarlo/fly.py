"""Every trial flown by every drawn craft: one piece of a Monte Carlo study."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.clock import clock_of
from towtank.engine.flights import Flights
from towtank.engine.plan import Clock, Ended, Log
from towtank.engine.start import at
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.montecarlo.draw import CURRENT, Tolerances, draw, starts
from towtank.montecarlo.packed import packed, unpacked
from towtank.montecarlo.stable import stability
from towtank.progress import Progress, Silent
from towtank.trials.ready import Ready
from towtank.verdict.flights import RAN_AWAY, fly_many, sound_readings
from towtank.verdict.many import Many
from towtank.verdict.spread import quantiles

BAND_CHANNELS = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "r", "rudder", "elevator", "speed")
"""Channels whose bands are kept over time, where the first piece of a study is flown."""
UNDER_WAY = 0.9
"""Share of the craft that must still fly for a band to be stated; later it would be one of the slow craft only."""
LOGGED, KEPT = 1200, 300
"""Samples over the longest time a trial may take, and of a band."""
TRACKS = 40
"""Craft of the first piece whose tracks are kept."""
COARSE = 0.5
"""Longest RK4 step of drawn craft, in lags of the fins: RK4 follows a lag to 4e-4. Against steps a quarter as long, the
largest error of an index of hokie is 2 % of its standard uncertainty; nine in ten are below 0.4 %."""

Trials = Sequence[tuple[Model, Ready]]
Recipe = Callable[[Model], Trials]
"""What makes the trials of a model ready; a function of a module where other processes are to work."""


@dataclass(frozen=True)
class Piece:
    """Part of a study that one worker does: ``count`` craft of piece ``number``."""

    number: int
    count: int


_READY: dict[str, tuple[tuple[Model, Ready], ...]] = {}
"""Key of the study at hand -> its trials; they hold functions and are made anew in every process."""


@dataclass(frozen=True)
class Study:
    """What all pieces share. Can be pickled; what hears of the progress stays behind.

    key : name of all that decides the numbers.   root : of the covariance, taken once so that all draw the same.
    """

    model: Model
    recipe: Recipe
    given: Tolerances
    seed: int
    root: Array
    key: str
    told: Progress = field(default_factory=Silent)

    @property
    def trials(self) -> tuple[tuple[Model, Ready], ...]:
        """The trials, each with the model it is flown with."""
        return _READY[self.key] if self.key in _READY else hold(self.key, self.recipe(self.model))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "told": Silent()}


def hold(key: str, trials: Trials) -> tuple[tuple[Model, Ready], ...]:
    """Keep the trials of the study ``key`` in this process, in the place of those of another."""
    _READY.clear()
    _READY[key] = tuple(trials)
    return _READY[key]


def fly_piece(study: Study, piece: Piece) -> dict[str, Any]:
    """Numbers of one piece, in a form that JSON holds, so that they can be kept in a file or sent; arrays ``packed``.

    "trials" : name -> {"kind", "loop", "indices": name -> {"unit", "values" (count)}, "ended" (count)}, the last as in
    ``Ended``; "stability" : name -> (count). In the first piece the best estimate comes before the ``count``
    craft, and "bands" are stated: name -> as ``bands`` returns.

    Raises
    ------
    KeyboardInterrupt
        The flights were stopped: nothing of the piece is kept.
    """
    first = piece.number == 0
    drawn = draw(study.model, piece.count, study.given, study.seed, piece.number, study.root)
    stable = stability(study.model, drawn.columns)
    order = side_by_side(stable["horizontal_index"], first)
    sorted_ = Many(study.model, {name: values[order] for name, values in drawn.columns.items()})
    best = Many(study.model, {name: values[:1] for name, values in drawn.columns.items()})
    task = f"piece {piece.number + 1}"
    study.told.start(task, len(study.trials))
    found: dict[str, Future[tuple[dict[str, Any], dict[str, Any] | None]]] = {}
    # The numbers of a trial are read while the next one flies.
    with ThreadPoolExecutor(1) as pool:
        for model, trial in study.trials:
            clock = drawn_clock(model, trial.setting.speed)
            flights = fly_drawn(model, trial, sorted_, record(model, trial, first), clock)
            alone = fly_drawn(model, trial, best, record(model, trial, False)) if first else None
            found[trial.name] = pool.submit(_read, model, trial, flights, np.argsort(order), alone)
            study.told.step(task, trial.name)
    study.told.done(task)
    read = {name: each.result() for name, each in found.items()}
    return {
        "trials": {name: numbers for name, (numbers, _) in read.items()},
        "stability": {name: packed(values) for name, values in stable.items()},
        "bands": {name: band for name, (_, band) in read.items() if band is not None},
    }


def side_by_side(index: Array, first: bool) -> NDArray[np.intp]:
    """Order (n,) in which craft fly: by stability ``index`` (n,), where the ``first`` is the best estimate it stays.

    Craft that are alike take alike long, and a pack of them flies until its last one is through.
    """
    order = np.argsort(index, kind="stable")
    return np.concatenate([[0], order[order != 0]]) if first else order


def _read(
    model: Model, trial: Ready, flights: Flights, back: NDArray[np.intp], alone: Flights | None
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Numbers of one trial in the order ``back`` of the draw; in the first piece its bands too.

    There the best estimate, which comes first, has the numbers of its flight ``alone``, with all steps.
    """
    ended, best = flights.ended[back], sound_readings(model, trial, alone) if alone else {}
    indices = {}
    for name, (values, unit) in sound_readings(model, trial, flights).items():
        drawn = values[back]
        if name in best:
            drawn[0] = best[name][0][0]
        indices[name] = {"unit": unit, "values": packed(drawn)}
    if alone:
        ended[0] = alone.ended[0]
    numbers = {"kind": trial.kind, "loop": trial.loop, "indices": indices, "ended": packed(ended, "f4")}
    return numbers, bands(flights, np.isin(flights.ended, RAN_AWAY), back) if alone else None


def record(model: Model, trial: Ready, first: bool) -> Log | bool:
    """What is kept over time: what the readings need; in the first piece the channels of the bands."""
    clock = clock_of(model, trial.setting.speed)
    own = max(1, round(trial.interval / clock.tick))
    if trial.needs:
        return Log(tuple(dict.fromkeys((*trial.needs, *(BAND_CHANNELS if first else ())))), own)
    longest = sum(leg.within for leg in trial.legs)
    return Log(BAND_CHANNELS, max(own, math.ceil(longest / clock.tick / LOGGED))) if first else False


def drawn_clock(model: Model, speed: float) -> Clock:
    """Control period of ``clock_of``, with as few RK4 steps in it as are ``COARSE`` lags of the fins long or less."""
    clock = clock_of(model, speed)
    lag = min((float(fin.time_constant) for fin in model.craft.fins), default=math.inf)
    return replace(clock, steps=min(clock.steps, max(1, math.ceil(clock.tick / (COARSE * lag) - 1e-9))))


def fly_drawn(model: Model, trial: Ready, drawn: Many, kept: Log | bool = True, clock: Clock | None = None) -> Flights:
    """``trial`` flown by the ``drawn`` craft, all under the pilot, the trim and the thrust of the best estimate.

    clock : the trial's own when left out.

    Raises
    ------
    KeyboardInterrupt
        Interrupted before every craft was through.
    """
    columns = {name: drawn.columns[name] + trial.current[i] for i, name in enumerate(CURRENT)}
    start = at(trial.setting.state if trial.start is None else trial.start, trial.setting.memory)
    # The trial's own current is in its start already.
    begin = starts(start, drawn.columns)
    flights = fly_many(model, trial, Many(model, {**drawn.columns, **columns}), kept, begin, clock)
    if np.any(flights.ended == Ended.STOPPED):
        raise KeyboardInterrupt
    return flights


def bands(flights: Flights, away: NDArray[np.bool_], back: NDArray[np.intp]) -> dict[str, Any]:
    """Quantiles over the drawn craft at every sample, the best estimate being the first craft.

    ``back`` : place of each craft of the draw among the flights.

    "time" (S), "under_way" (S) share of the craft, "quantiles": channel -> (len(QUANTILES), S), "best": channel ->
    (S), "tracks": "x", "y" -> (up to TRACKS, S). S ends where less than ``UNDER_WAY`` fly. In single precision.
    """
    log = np.where(away[:, None, None], np.nan, flights.log)
    flying = ~np.isnan(log[1:, :, 0])
    share = flying.mean(axis=0) / max(float((~away[1:]).mean()), 1.0 / len(flights))
    size = int(np.argmax(share < UNDER_WAY)) if np.any(share < UNDER_WAY) else len(share)
    at_ = slice(0, size, max(1, math.ceil(size / KEPT)))
    series = {name: log[:, at_, flights.logged.index(name)] for name in BAND_CHANNELS}
    return {
        "time": packed(flights.time[at_], "f4"),
        "under_way": packed(share[at_], "f4"),
        "quantiles": {name: packed(quantiles(values[1:]), "f4") for name, values in series.items()},
        "best": {name: packed(values[0], "f4") for name, values in series.items()},
        "tracks": {name: packed(series[name][back[1 : TRACKS + 1]], "f4") for name in ("x", "y")},
    }


def pieces(samples: int, size: int) -> Sequence[Piece]:
    """``samples`` craft in pieces of at most ``size``."""
    return [Piece(i, min(size, samples - first)) for i, first in enumerate(range(0, samples, size))]


def gathered(answers: Mapping[int, Mapping[str, Any]]) -> dict[str, Any]:
    """Pieces by number as one, in order: arrays end to end (N,), reasons as lists, bands of the first piece."""
    ordered = [answers[i] for i in sorted(answers)]
    first = ordered[0]
    trials: dict[str, Any] = {}
    for name, trial in first["trials"].items():
        parts = [answer["trials"][name] for answer in ordered]
        values = {
            key: (np.concatenate([unpacked(part["indices"][key]["values"]) for part in parts]), entry["unit"])
            for key, entry in trial["indices"].items()
        }
        ended = [Ended(int(code)).name.lower() for part in parts for code in unpacked(part["ended"])]
        trials[name] = {"kind": trial["kind"], "loop": trial["loop"], "indices": values, "ended": ended}
    stable = {
        key: np.concatenate([unpacked(answer["stability"][key]) for answer in ordered]) for key in first["stability"]
    }
    return {"trials": trials, "stability": stable, "bands": first["bands"]}
