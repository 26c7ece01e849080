"""A plan carried out many times on known coefficients with random errors, to hold the prediction against."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.derive import derive
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.experiments.errors import ErrorModel, shapes
from towtank.experiments.evidence import SLOPES, stability_index
from towtank.experiments.optimal import Problem
from towtank.frames import Array
from towtank.plan.kinds import Plan
from towtank.tank.campaign import tow
from towtank.tank.lpm import LpmTank
from towtank.tank.run import Run

LEAST_SEEDS = 20
"""Fewest campaigns: the standard deviation of 20 is known to 16 %."""


@dataclass(frozen=True)
class Rehearsal:
    """Wanted values found in S campaigns.

    names (s,).   found (S, s).   std (s,) : their standard deviation.   predicted (s,) : what was predicted.
    """

    names: tuple[str, ...]
    found: Array
    std: Array
    predicted: Array


def rehearse(problem: Problem, chosen: Sequence[int], campaigns: int, seed: int = 0) -> Rehearsal:
    """Derive the wanted values from ``campaigns`` campaigns of the runs ``chosen``, each with its own errors.

    The loads are those of the predicted coefficients with errors of ``problem.error``; ``towtank.derive`` finds the
    values again, without its screening: the prediction holds for the runs as given.

    Raises
    ------
    InputError
        Fewer than ``LEAST_SEEDS`` campaigns.
    """
    check_campaigns(campaigns)
    cast, at = problem.cast, list(chosen)
    plan = Plan(problem.craft, cast.pool.speed, tuple(cast.pool.tests[i] for i in at))
    exact = tow(plan, LpmTank(_truth(problem)))
    names = tuple(problem.evidence.wanted)
    found = np.zeros((campaigns, len(names)))
    for number in range(campaigns):
        runs = [disturbed(run, cast.sigma[i], problem.error, seed + number) for run, i in zip(exact, at, strict=True)]
        found[number] = _wanted(derive(runs, screening=False), names, problem.craft)
    predicted = np.array(list(problem.score(chosen).std.values()))
    return Rehearsal(names, found, np.asarray(found.std(axis=0, ddof=1)), predicted)


def check_campaigns(campaigns: int) -> None:
    """Refuse too few campaigns."""
    if campaigns < LEAST_SEEDS:
        raise InputError(
            f"{campaigns} campaigns do not tell a spread: their standard deviation is known to "
            f"{100.0 / np.sqrt(2.0 * max(campaigns, 1)):.0f} %. Give {LEAST_SEEDS} or more."
        )


def _truth(problem: Problem) -> dict[str, float]:
    """Coefficients behind the loads. For the index the linear terms are the slopes at the origin and nothing bends."""
    values = dict(problem.cast.values)
    if problem.evidence.local:
        values |= {name: 0.0 for name in values if name[1:] in ("vv", "rr", "ww", "qq") and name[0] != "X"}
        values |= problem.cast.slopes
    return values


def disturbed(run: Run, sigma: Array, error: ErrorModel, seed: int) -> Run:
    """``run`` with random errors of standard deviation ``sigma`` (6,) [N, N m], as ``ErrorModel`` describes them.

    The same seed and run name give the same errors.
    """
    random = np.random.default_rng([seed, zlib.crc32(run.name.encode())])
    n = len(run.history.time)
    per = n if run.steady else (n - 1) // run.periods
    waves = shapes(error, per, run.steady) / np.sqrt(1.0 if run.steady else error.components)
    cycles = 1 if run.steady else run.periods
    own = random.standard_normal((waves.shape[1], 6))
    fresh = random.standard_normal((cycles, waves.shape[1], 6))
    factors = np.sqrt(error.repeated) * own + np.sqrt(1.0 - error.repeated) * fresh
    noise = np.einsum("tm,cmk->ctk", waves, factors).reshape(cycles * per, 6)
    noise = np.concatenate([noise, noise[:1]])[:n]
    return replace(run, loads=run.loads + sigma * noise)


def _wanted(derived: Derivatives, names: Sequence[str], craft: Craft) -> Array:
    if names == ("G_h",):
        slopes: Mapping[str, float] = {name: derived.origin.get(name, np.nan) for name in SLOPES}
        return np.array([stability_index(slopes, craft)])
    return np.array([derived[name] if name in derived.names else np.nan for name in names])
