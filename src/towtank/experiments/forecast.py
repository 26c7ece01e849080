"""What the candidates would measure: loads before they are run, and how far a model stays from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from towtank.derive.convert import about_point
from towtank.derive.derive import derive
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.experiments.candidates import standard_within
from towtank.experiments.errors import ErrorModel, allowance
from towtank.frames import Array
from towtank.plan.kinds import Plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.tank.run import Run
from towtank.terms import term_loads


@dataclass(frozen=True)
class Forecast:
    """Predicted runs of a pool of R candidates.

    pool : the candidates.   runs : with the predicted loads.   standard : numbers of the standard plan's runs.
    rms, misfit, sigma (R, 6) : root mean square of the loads, what a model leaves of them, and the standard deviation
    of their error [N, N m].   values, slopes : the derivatives the loads go with, wide and at the origin.
    source : where the loads come from, in words.
    """

    pool: Plan
    runs: tuple[Run, ...]
    standard: tuple[int, ...]
    rms: Array
    misfit: Array
    sigma: Array
    values: Mapping[str, float]
    slopes: Mapping[str, float]
    source: str


def forecast(pool: Plan, error: ErrorModel, known: Derivatives | None = None) -> Forecast:
    """Run the candidates in the fast tank, and compare them with what derivatives make of them.

    Parameters
    ----------
    pool : candidates, the standard plan's runs among them.
    error : of the loads.
    known : derivatives of the craft from an earlier study; the loads are then theirs. Without them the loads are those
        of the fast tank.

    The misfit is always that of the fast tank: its loads less those of the derivatives that the standard plan gives in
    it. It stands for what the coefficient model cannot hold, memory in quick oscillations above all.

    Raises
    ------
    InputError
        ``known`` belongs to another craft.
    """
    craft = pool.craft
    if known is not None and known.craft != craft.name:
        raise InputError(
            f"plan --optimal: the derivatives are those of {known.craft!r}, not of {craft.name!r}. Remove the file, or "
            "choose the study folder of this craft with --out."
        )
    runs = tow(pool, FastTank(members=0))
    standard = tuple(standard_within(pool, pool.speed))
    found = derive([runs[i] for i in standard], screening=False)
    misfit = np.array([_rms(run.loads - _loads(found, run), run) for run in runs])
    source = "fast tank, nominal constants (semi-empirical)"
    if known is not None:
        known = about_point(known, runs[0].origin_from_nose)
        runs = tuple(replace(run, loads=_loads(known, run)) for run in runs)
        source = f"derivatives of the study ({known.level}); misfit from the fast tank (semi-empirical)"
    used = found if known is None else known
    rms = np.array([_rms(run.loads, run) for run in runs])
    scale = np.sqrt((rms[list(standard)] ** 2).mean(axis=0))
    misfit = allowance(pool.tests, craft, misfit)
    return Forecast(
        pool, runs, standard, rms, misfit, error.sigma(rms, scale, misfit),
        used.as_dict(), dict(used.origin or found.origin), source,
    )  # fmt: skip


def _loads(derivatives: Derivatives, run: Run) -> Array:
    return term_loads(derivatives.as_dict(), run.history.nu, run.history.nudot, run.control)


def _rms(loads: Array, run: Run) -> Array:
    return np.asarray(np.sqrt((loads[run.settled] ** 2).mean(axis=0)))
