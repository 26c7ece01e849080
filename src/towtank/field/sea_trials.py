"""Trials that a craft can make in a synthetic sea, by the word a user has for them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from towtank.errors import InputError
from towtank.field.sea_survey import identification_ready
from towtank.model.equations import Model
from towtank.quantity import Quantity
from towtank.trials.ready import Ready
from towtank.trials.standard import CLOSED_LOOP, OPEN_LOOP, standard_ready
from towtank.trials.start import ballasted, level_trim, setting
from towtank.trials.userdefined import ready_from_file

SURVEY = "survey"
"""Word of the identification mission."""
MINUTES = 10.0
"""Length of the identification mission where none is asked for."""


@dataclass(frozen=True)
class SeaTrial:
    """A trial, the model it is flown with, and what has to be said of it."""

    model: Model
    ready: Ready
    notes: tuple[str, ...] = ()


def trial_called(
    model: Model, word: str, *, minutes: float | None = None, speed: Quantity | None = None, seed: int = 0
) -> SeaTrial:
    """The trial called ``word``.

    Parameters
    ----------
    word : ``survey``, a standard trial such as ``zigzag10`` or ``turning circle``, or a file that ends in ``.toml``.
    minutes, speed, seed : of the survey, see ``identification_ready``.

    A craft that cannot be flown level is ballasted to neutral, as for its standard trials; for the trial of a file it
    is left as it is loaded.

    Raises
    ------
    InputError
        No such trial, or minutes or a speed given to a trial that takes none.
    """
    survey = word.strip().lower() == SURVEY
    given = {"minutes": minutes, "speed": speed}
    if not survey and (extra := [name for name, value in given.items() if value is not None]):
        raise InputError(
            f"{word}: its length and speed are its own; it takes no {extra[0]}. Leave it out, choose {SURVEY}, or "
            "write the trial in a file, see docs/trials.md."
        )
    if word.endswith(".toml"):
        return SeaTrial(model, ready_from_file(model, Path(word)))
    if not survey:
        return _standard(model, word)
    notes: tuple[str, ...] = ()
    trim = level_trim(model, setting(model, speed, piloted=False).speed)
    if not trim.holds and model.craft.fins:
        model, notes = ballasted(model), (f"Ballasted to neutral for this trial: {trim.why}.",)
    return SeaTrial(model, identification_ready(model, MINUTES if minutes is None else minutes, seed, speed), notes)


def words_of(model: Model) -> Mapping[str, tuple[Model, Ready]]:
    """Name of each standard trial of ``model`` -> the model it is flown with, and the trial."""
    return dict(zip((*OPEN_LOOP, *CLOSED_LOOP), standard_ready(model), strict=False))


def _standard(model: Model, word: str) -> SeaTrial:
    known = words_of(model)
    table: dict[str, str] = {}
    for name, (_, ready) in known.items():
        for alias in (name, ready.name, re.sub(r"\b(\d+)/\1\b", r"\1", name)):
            table.setdefault(_squeezed(alias), name)
    found = table.get(_squeezed(word))
    if found is None:
        near = difflib.get_close_matches(_squeezed(word), table, n=1, cutoff=0.5)
        hint = f"Did you mean {table[near[0]]!r}? " if near else ""
        raise InputError(
            f"{word!r} is no trial of {model.craft.name}. {hint}Choose from {SURVEY}, {', '.join(known)}, or name a "
            "file that ends in .toml."
        )
    flown, ready = known[found]
    notes = (
        () if flown is model else (f"Ballasted to neutral for this trial: {level_trim(model, model.craft.speed).why}.",)
    )
    return SeaTrial(flown, ready, notes)


def _squeezed(word: str) -> str:
    return re.sub(r"[^a-z0-9]", "", word.lower())
