"""What is known of a craft: numbers of the best estimate, of drawn craft, and of craft with one coefficient moved."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from towtank.engine.form import form_of
from towtank.engine.library import library
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.trials.ready import Readings, Ready
from towtank.trials.standard import CLOSED_LOOP, OPEN_LOOP, standard_ready
from towtank.trials.trajectory import Trajectory
from towtank.verdict.flights import fly_many, sound_readings
from towtank.verdict.many import Many, Population, same_craft
from towtank.verdict.measures import MEASURES
from towtank.verdict.needs import Need
from towtank.verdict.steps import Steps, stepped

SAME = 1e-3
"""Relative difference within which an index is that of the same trial."""
TRIED = 4
"""Coefficients whose effect on a probability is worked out: those that move the growth rate most."""


@dataclass(frozen=True)
class Numbers:
    """One number of a craft, in ``unit``. best : of the best estimate.

    values (1 + N,) : of the best estimate and the drawn craft, or None.   effect (K,) : change for one step up of each
    coefficient, or None.   share (K,) : those steps as shares of the coefficients, signed.
    """

    unit: str
    best: float
    values: Array | None
    effect: Array | None
    share: Array


class Evidence:
    """Numbers of one model: looked up, or worked out once when asked for.

    Raises
    ------
    InputError
        The population was drawn from another craft.
    """

    def __init__(
        self,
        model: Model,
        population: Population,
        trajectories: Sequence[Trajectory] = (),
        ready: Sequence[tuple[Model, Ready]] | None = None,
    ) -> None:
        """``ready`` : the trials, ready to fly; the standard set when left out."""
        self.model, self.population, self.trajectories, self._given = model, population, tuple(trajectories), ready
        same_craft(model, population)
        self._measured: dict[tuple[str, bool], Array] = {}
        self._flown: dict[str, Readings] = {}

    @cached_property
    def steps(self) -> Steps:
        """Craft with one coefficient moved."""
        return stepped(self.model, self.population)

    @cached_property
    def ready(self) -> Mapping[str, tuple[Model, Ready]]:
        """Trials that many craft can fly, by name."""
        made = standard_ready(self.model) if self._given is None else self._given
        return {trial.name: (model, trial) for model, trial in made}

    def measure(self, name: str, moved: bool = False) -> Array:
        """A criterion of the population (1 + N,), or of the craft with one coefficient ``moved`` (1 + 2 K,)."""
        if (name, moved) not in self._measured:
            self._measured[name, moved] = MEASURES[name].of(self.steps.craft if moved else self.population.craft)
        return self._measured[name, moved]

    def numbers(self, need: Need) -> Numbers | None:
        """What ``need`` is about; None where this craft has no such trial.

        Raises
        ------
        InputError
            A trial or an index that is not known.
        """
        size = np.abs if need.magnitude else lambda values: values
        if need.criterion:
            of, measured = MEASURES[need.criterion], size(self.measure(need.criterion))
            moves = self.steps.effect(size(self.measure(need.criterion, moved=True)))
            return Numbers(of.unit, float(measured[0]), measured, moves, self.steps.share(of.wide))
        name = self.trial(need)
        if name is None:
            return None
        own = next((dict(t.indices) for t in self.trajectories if t.name == name), {})
        drawn = self.population.trials[name].indices if name in self.population.trials else {}
        if need.index not in {**own, **drawn}:
            raise InputError(
                f"{need.where}.index: {name} has no index {need.index!r}. {_near(need.index, {**own, **drawn})}"
            )
        best, unit = own.get(need.index) or (float(drawn[need.index][0][0]), drawn[need.index][1])
        # A trial of the same name at another speed is another one.
        values, moved = (
            size(found[need.index][0]) if need.index in found and _same(found[need.index][0][0], best) else None
            for found in (drawn, self.flown(name))
        )
        effect = None if moved is None else self.steps.effect(moved)
        return Numbers(unit, float(size(np.array(best))), values, effect, self.steps.share())

    def best(self, need: Need) -> tuple[float, str] | None:
        """The number of the best estimate that ``need`` is about, and its unit; None where it has none.

        Raises
        ------
        InputError
            A trial that is not known.
        """
        if need.criterion:
            value, unit = float(self.measure(need.criterion)[0]), MEASURES[need.criterion].unit
        else:
            name = self.trial(need)
            own = next((dict(t.indices) for t in self.trajectories if t.name == name), {})
            if need.index not in own:
                return None
            value, unit = own[need.index]
        return (abs(value) if need.magnitude else value), unit

    def flown(self, name: str) -> Readings:
        """Indices of the craft with one coefficient moved, in the trial ``name``.

        Empty where the trial is not at hand, or there is no compiled engine, on which it costs little.
        """
        if library(form_of(self.model)) is None or name not in self.ready:
            return {}
        if name not in self._flown:
            model, trial = self.ready[name]
            self._flown[name] = sound_readings(model, trial, fly_many(model, trial, self.steps.craft))
        return self._flown[name]

    def trial(self, need: Need) -> str | None:
        """Name of the trial that ``need`` means, by its name or kind; None where the craft has not made it.

        Raises
        ------
        InputError
            No such trial, or several of the kind.
        """
        kinds = {t.name: t.kind for t in self.trajectories} | {n: t.kind for n, t in self.population.trials.items()}
        wanted = plain(need.trial)
        found = [name for name, kind in kinds.items() if wanted in (plain(name), plain(kind))]
        exact = [name for name in found if plain(name) == wanted]
        # The kind means the standard trial of it where others were flown beside.
        standard = [name for name in found if name in self.population.trials]
        for choice in (exact, standard, found):
            if len(choice) == 1 or (choice and need.optional):
                return choice[0]
        if found:
            raise InputError(
                f"{need.where}.trial: {need.trial!r} may be {' or '.join(sorted(found))}. Write one of these names."
            )
        if need.optional or wanted in [plain(name) for name in (*OPEN_LOOP, *CLOSED_LOOP)]:
            return None
        raise InputError(
            f"{need.where}.trial: this craft has made no trial {need.trial!r}. {_near(need.trial, kinds)} "
            "`towtank trial` makes others."
        )

    def probability_effect(self, measure: str) -> Array:
        """Change (K,) of the share of drawn craft whose ``measure`` is below zero, for one step up of a coefficient.

        All drawn craft are moved by the step, up and down. Zero but for the ``TRIED`` coefficients that move the
        measure of the best estimate most.
        """
        effect = np.abs(self.steps.effect(self.measure(measure, moved=True)))
        out = np.zeros(len(effect))
        for i in np.argsort(-np.nan_to_num(effect))[:TRIED]:
            up, down = (MEASURES[measure].of(self._moved(i, way))[1:] < 0.0 for way in (1.0, -1.0))
            out[i] = 0.5 * (float(up.mean()) - float(down.mean()))
        return out

    def _moved(self, i: int, way: float) -> Many:
        """The population with all its craft moved by step i, up or down."""
        craft, best = self.population.craft, self.steps.craft.columns
        known = {name: craft.columns.get(name, np.full(len(craft), best[name][0])) for name in self.steps.moves[i]}
        shifted = {name: known[name] + way * step for name, step in self.steps.moves[i].items()}
        return Many(self.model, {**craft.columns, **shifted})


def _same(one: float, other: float) -> bool:
    """True for an index of one trial, flown alone and among others."""
    return bool(np.isclose(one, other, rtol=SAME, atol=1e-6, equal_nan=True))


def plain(name: str) -> str:
    """A name as it is compared: small letters, digits, dots, and a hyphen for everything else."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-")


def _near(name: str, known: Iterable[str]) -> str:
    known = list(known)
    found = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"Did you mean {found[0]}?" if found else f"There are: {', '.join(known)}."
