"""Requirements put to a craft: met or not, with what margin and probability, and what decides it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array
from towtank.verdict.evidence import Evidence, Numbers
from towtank.verdict.measures import SHARES
from towtank.verdict.needs import Need
from towtank.verdict.spread import spread_of, wilson
from towtank.verdict.steps import Steps
from towtank.verdict.table import Driver, Requirement

NAMED = 3
"""Drivers that are named."""
WORTH = 0.05
"""Effect that is worth naming, as a share of the strongest."""
ROUND_OFF = 1e-9
"""Effect that is one of round-off, in any of the units."""


def judge(needs: Sequence[Need], evidence: Evidence) -> tuple[tuple[Requirement, ...], float]:
    """Each of ``needs`` judged, and the probability that a craft meets all of them at once.

    A drawn craft without the number, for example one that does not complete a trial, does not meet the requirement.
    Requirements on a share of the craft have no part in the probability of all; it is NaN where one has none.

    Raises
    ------
    InputError
        A criterion, trial or index that is not known, or a limit of another unit.
    """
    out: list[Requirement] = []
    every: list[NDArray[np.bool_] | None] = []
    for need in needs:
        if need.criterion in SHARES:
            out.append(_on_share(need, evidence))
            continue
        found = evidence.numbers(need)
        if found is None or (need.optional and not _has_any(found)):
            out += [] if need.optional else [_not_made(need)]
            every += [] if need.optional else [None]
            continue
        requirement, inside = _on_number(need, found, evidence)
        out.append(requirement)
        every.append(inside)
    known = [inside for inside in every if inside is not None]
    whole = bool(known) and len(known) == len(every)
    return tuple(out), float(np.logical_and.reduce(known).mean()) if whole else math.nan


def _has_any(found: Numbers) -> bool:
    return not math.isnan(found.best) or (found.values is not None and not np.isnan(found.values).all())


def _not_made(need: Need) -> Requirement:
    note = f"this craft has not made the trial {need.trial}: it cannot, or `towtank trial` is still to be asked for it"
    return Requirement(
        need.name, math.nan, "", math.nan, False, note, need.sense.replace("_", " "), wanted=need.share,
        source=need.source, assumed=need.assumed,
    )  # fmt: skip


def _on_number(need: Need, found: Numbers, evidence: Evidence) -> tuple[Requirement, NDArray[np.bool_] | None]:
    limit = need.bound(found.unit, evidence.model.craft)
    sign = 1.0 if need.sense == "at_least" else -1.0
    notes = [f'the limit is "{need.limit}"'] if isinstance(need.limit, str) and need.limit.rstrip()[-1:] in "LU" else []
    inside, probability, std = None, math.nan, math.nan
    if found.values is not None:
        drawn = found.values[1:]
        inside = sign * drawn >= sign * limit
        probability, std = float(inside.mean()), spread_of(found.values, found.unit).std
        if gone := int(np.isnan(drawn).sum()):
            notes.append(f"{gone} of {len(drawn)} drawn craft have no such number and count as not meeting it")
    else:
        notes.append("no drawn craft has made this trial, so there is no probability")
    met = probability >= need.share if need.share is not None else sign * found.best >= sign * limit
    return Requirement(
        need.name, found.best, found.unit, limit, bool(met), "; ".join(notes), need.sense.replace("_", " "),
        margin=sign * (found.best - limit), std=std, probability=probability, wanted=need.share,
        drivers=() if found.effect is None else drivers(evidence.steps, found.effect, found.share),
        source=need.source, assumed=need.assumed,
    ), inside  # fmt: skip


def _on_share(need: Need, evidence: Evidence) -> Requirement:
    """A requirement on the share of drawn craft whose measure is below zero; its std is that of the sampling."""
    measure = SHARES[need.criterion]
    inside = evidence.measure(measure)[1:] < 0.0
    count, of, limit = int(inside.sum()), len(inside), need.bound("", evidence.model.craft)
    share, sign = count / of, 1.0 if need.sense == "at_least" else -1.0
    low, high = wilson(count, of)
    note = f"{of} craft drawn from {evidence.population.words}; 95 % interval of the sampling {low:.3f} to {high:.3f}"
    return Requirement(
        need.name, share, "", limit, bool(sign * share >= sign * limit), note, need.sense.replace("_", " "),
        margin=sign * (share - limit), std=math.sqrt(share * (1.0 - share) / of),
        drivers=drivers(evidence.steps, evidence.probability_effect(measure), evidence.steps.share(wide=False)),
        source=need.source, assumed=need.assumed, on_share=True,
    )  # fmt: skip


def drivers(steps: Steps, effect: Array, share: Array) -> tuple[Driver, ...]:
    """The coefficients with the largest ``effect`` (K,), strongest first; ``share`` (K,) : their steps."""
    size = np.nan_to_num(np.abs(effect))
    order = np.argsort(-size, kind="stable")[:NAMED]
    return tuple(
        Driver(steps.names[i], float(effect[i]), 100.0 * abs(float(share[i])), _per_percent(effect[i], share[i]))
        for i in order
        if size[i] > ROUND_OFF and size[i] >= WORTH * size[order[0]]
    )


def _per_percent(effect: float, share: float) -> float:
    return 0.01 * float(effect) / float(share) if math.isfinite(share) else math.nan
