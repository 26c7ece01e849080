"""Requirements put to the points of a design study: numbers of the best estimate, and goals on them."""

from __future__ import annotations

from collections.abc import Sequence

from towtank.craft.craft import Craft
from towtank.design.goal import Goal
from towtank.errors import InputError
from towtank.model.equations import Model
from towtank.sweep.point import Numbers
from towtank.trials.ready import Ready, run_trial
from towtank.trials.standard import standard_ready
from towtank.verdict.evidence import Evidence, plain
from towtank.verdict.many import drawn
from towtank.verdict.measures import SHARES
from towtank.verdict.needs import Need

PLANES = {"P_stable_horizontal": "h", "P_stable_vertical": "v"}
"""Criterion on a share of the drawn craft -> plane of the columns that a point has of it."""
FEWEST = 2
"""Craft drawn beside the best estimate, which alone is read."""


def column(need: Need) -> str:
    """Column of a point that holds what ``need`` is about."""
    return f"P_stable_{PLANES[need.criterion]}" if need.criterion in PLANES else f"asked.{need.of}"


def needed(model: Model, needs: Sequence[Need]) -> Numbers:
    """Numbers of the best estimate that ``needs`` are about, by ``column``; only trials asked for are flown.

    A number that the craft has not, because it cannot make the trial, is left out.

    Raises
    ------
    InputError
        A trial or an index that is not known.
    """
    numbers = [need for need in needs if need.criterion not in SHARES]
    if not numbers:
        return {}
    asked = [need for need in numbers if not need.criterion]
    ready = [(own, trial) for own, trial in (standard_ready(model) if asked else ()) if _wanted(trial, asked)]
    evidence = Evidence(model, drawn(model, FEWEST), [run_trial(own, trial) for own, trial in ready], ready)
    found = {column(need): evidence.best(need) for need in numbers}
    return {name: number for name, number in found.items() if number is not None}


def goals_of(needs: Sequence[Need], values: Numbers, craft: Craft, target: float) -> tuple[Goal, ...]:
    """``needs`` as goals of a search. values : of ``needed`` for the craft as given, for the units.

    A requirement on a share of the drawn craft holds for the best estimate here, but for the probability of stability.
    That is smooth for the search where its limit is ``target``. Lengths and speeds are those of ``craft``.

    Raises
    ------
    InputError
        A limit of another unit, or a number that the craft as given has not.
    """
    out = []
    for need in needs:
        at_least, letter = need.sense == "at_least", PLANES.get(need.criterion, "")
        if letter:
            limit = need.bound("", craft)
            smooth = f"growth_{letter}_quantile" if at_least and limit == target else ""
            scale = craft.length / craft.speed
            out.append(Goal(need.name, column(need), limit, at_least, "", need.source, smooth, scale))
        elif column(need) in values:
            unit = values[column(need)][1]
            out.append(Goal(need.name, column(need), need.bound(unit, craft), at_least, unit, need.source))
        elif not need.optional:
            raise InputError(
                f"{need.where}: {craft.name} as given has no {need.of}: it does not make the trial. Name a standard "
                "trial, or leave the requirement out of the design study."
            )
    return tuple(out)


def _wanted(trial: Ready, needs: Sequence[Need]) -> bool:
    return any(plain(need.trial) in (plain(trial.name), plain(trial.kind)) for need in needs)
