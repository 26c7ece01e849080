"""The plan that leaves the least uncertainty for its cost, and what it saves against the standard plan."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.experiments.candidates import candidates
from towtank.experiments.cost import CFD, CostModel, costs
from towtank.experiments.errors import ErrorModel
from towtank.experiments.evidence import Evidence, fit_weights, index_evidence, stability_index, wide_evidence
from towtank.experiments.exchange import Design, Grid, optimise
from towtank.experiments.forecast import Forecast, forecast
from towtank.frames import Array
from towtank.plan.kinds import Plan
from towtank.quantity import Quantity

CRITERIA = ("D", "A")

BEARS = 0.01
"""Smallest share of the information on an unknown for which a run of the standard plan bears on the aim."""

ROUNDS = 4
"""Searches with the lagging values counted more, after which a number of runs is given up."""


@dataclass(frozen=True)
class Scored:
    """A set of runs: names, cost in mean runs of the standard plan, predicted standard deviation of each wanted value.

    size : geometric mean of the axes of the uncertainty ellipsoid of the wanted values (determinant of their
    covariance to the power 1/2s), in mixed units: only ratios of two sizes mean something.
    """

    runs: tuple[str, ...]
    cost: float
    std: Mapping[str, float]
    size: float


@dataclass(frozen=True)
class Optimal:
    """An optimal plan and what it is compared with.

    plan : the captive tests chosen.   aim : names of the wanted values.   criterion : "D" or "A".
    budget : runs asked for; they cost no more than as many mean runs of the standard plan.
    values : predicted wanted values.   source : where the predicted loads come from.
    unit : cost of a mean run of the standard plan, in units of ``cost_model``.
    chosen : the plan.   standard : the fitted runs of the standard plan.   bearing : those that bear on the aim.
    equal : the best plan of the number and cost of ``bearing``.
    least : the smallest plan found that leaves no wanted value more uncertain than the standard plan does, or None.
    least_size : the smallest found whose ``size`` is no larger than that of the standard plan, or None.
    open_terms : unknowns of the model that the plan does not determine.
    values_of_search : the criterion after each change of the search, never rising.
    """

    plan: Plan
    aim: tuple[str, ...]
    criterion: str
    budget: int
    values: Mapping[str, float]
    source: str
    error: ErrorModel
    cost_model: CostModel
    unit: float
    candidates: int
    chosen: Scored
    standard: Scored
    bearing: Scored
    equal: Scored
    least: Scored | None
    least_size: Scored | None
    open_terms: tuple[str, ...] = ()
    values_of_search: tuple[float, ...] = ()
    problem: Problem | None = field(default=None, repr=False, compare=False)

    @property
    def saves(self) -> dict[str, float]:
        """Runs and cost saved: those of the standard plan that bear on the aim, less those of ``least``."""
        n, cost = len(self.bearing.runs), self.bearing.cost
        runs, spent = (n, cost) if self.least is None else (len(self.least.runs), self.least.cost)
        return {"runs": n - runs, "of_runs": n, "cost": cost - spent, "of_cost": cost}


def optimal_plan(
    craft: Craft,
    budget: int,
    *,
    aim: Sequence[str] = ("all",),
    criterion: str = "D",
    cost: CostModel = CFD,
    error: ErrorModel | None = None,
    known: Derivatives | None = None,
    speed: Quantity | None = None,
    violent: bool = False,
) -> Optimal:
    """The captive tests that leave the chosen derivatives least uncertain.

    Parameters
    ----------
    craft, speed : as in ``plan.standard.standard_plan``.
    budget : N runs, which together cost no more than N mean runs of the standard plan.
    aim : names of terms; ("all",) for all that can be told apart; ("index",) for the horizontal stability index.
    criterion : "D" makes the volume of the uncertainty ellipsoid small, "A" the mean square of the standard deviations,
        each counted in that of the standard plan. One value alone, such as the index, is c-optimal by either.
    cost, error : models of what a run costs and of how uncertain its loads are.
    known : derivatives of an earlier study, from which the loads are predicted; else the fast tank.
    violent : also choose among runs that ``plan.limits`` warns of.

    Returns
    -------
    Optimal. No run is taken twice, because a computed run repeated is the same run.

    Raises
    ------
    InputError
        A budget too small to determine the aim, a term no candidate excites, an unknown criterion.

    Source     fedorov1972; atkinson2007 (exact D-, A- and c-optimal designs).
    Departure  Errors of the runs, and the allowance for what the model cannot hold, are those of ``ErrorModel``.
    Valid      The range of the fit: drift to 20 deg, fins to 20 deg, ahead. Errors of different runs independent.
    """
    _refuse(budget, criterion)
    told = ErrorModel() if error is None else error
    cast = forecast(candidates(craft, speed, violent=violent), told, known)
    problem = Problem(
        craft, cast, told, _evidence(cast, told, craft, tuple(aim)), costs(cast.pool.tests, craft, cost), criterion
    )
    design = problem.best(budget)
    tests = tuple(cast.pool.tests[i] for i in design.chosen)
    chosen = problem.score(design.chosen)
    if not all(math.isfinite(std) for std in chosen.std.values()):
        raise InputError(
            f"--budget {budget}: {', '.join(n for n, s in chosen.std.items() if not math.isfinite(s))} cannot be "
            f"determined by {budget} runs of this cost. {problem.remedy(budget)}"
        )
    least, least_size = problem.least(), problem.least_size()
    return Optimal(
        plan=Plan(craft, cast.pool.speed, tests, _notes(cast, aim, criterion)),
        aim=tuple(problem.evidence.wanted), criterion=criterion, budget=budget, values=_values(problem),
        source=cast.source, error=told, cost_model=cost, unit=problem.unit, candidates=len(cast.runs), chosen=chosen,
        standard=problem.score(cast.standard), bearing=problem.score(problem.bearing),
        equal=problem.score(problem.equal.chosen), least=None if least is None else problem.score(least.chosen),
        least_size=None if least_size is None else problem.score(least_size.chosen),
        open_terms=problem.open(design.chosen), values_of_search=design.values, problem=problem,
    )  # fmt: skip


@dataclass(frozen=True)
class Problem:
    """All that a search needs: candidates with their evidence and cost (R,)."""

    craft: Craft
    cast: Forecast
    error: ErrorModel
    evidence: Evidence
    cost: Array
    criterion: str

    @cached_property
    def unit(self) -> float:
        """Cost of a mean run of the standard plan."""
        return float(self.cost[list(self.cast.standard)].mean())

    @cached_property
    def target(self) -> Array:
        """Standard deviation (s,) of each wanted value by the standard plan."""
        return np.asarray(np.sqrt(np.diag(self.covariance(self.cast.standard))))

    @cached_property
    def grid(self) -> Grid:
        """The candidates as the search sees them."""
        return self.evidence.grid(self.cost, self.criterion, self._finite)

    @cached_property
    def _finite(self) -> Array:
        return np.where(np.isfinite(self.target), self.target, 1.0)

    @cached_property
    def bearing(self) -> tuple[int, ...]:
        """Runs of the standard plan that hold a share of at least ``BEARS`` of its information on what is wanted."""
        at = list(self.cast.standard)
        held = np.einsum("rl,rlii->ri", self.weight(at), self.evidence.square[at], optimize=True)
        share = held / np.maximum(held.sum(axis=0), 1e-300)
        used = np.any(np.array(list(self.evidence.wanted.values())) != 0.0, axis=0)
        return tuple(i for i, row in zip(at, share[:, used], strict=True) if row.max() > BEARS)

    @cached_property
    def equal(self) -> Design:
        """The best design of as many runs as bear on the aim, at no more than their cost."""
        return optimise(self.grid, len(self.bearing), float(self.cost[list(self.bearing)].sum()))

    def numbers(self, names: Sequence[str]) -> tuple[int, ...]:
        """Numbers of the candidates called ``names``."""
        where = {test.name: i for i, test in enumerate(self.cast.pool.tests)}
        return tuple(where[name] for name in names)

    def weight(self, chosen: Sequence[int]) -> Array:
        """Weights of the fit (len(chosen), L) that ``derive`` will use."""
        if self.evidence.local:
            return np.ones((len(chosen), self.evidence.sigma.shape[1]))
        return fit_weights(self.cast, chosen)

    def covariance(self, chosen: Sequence[int]) -> Array:
        """Covariance (s, s) of the wanted values that ``derive`` will leave."""
        return self.evidence.covariance(chosen, self.weight(chosen))

    def score(self, chosen: Sequence[int]) -> Scored:
        """What a set of runs costs and leaves."""
        covariance = self.covariance(chosen)
        std = np.sqrt(np.diag(covariance))
        size = math.inf
        if np.isfinite(std).all():
            correlation = np.linalg.slogdet(covariance / np.outer(std, std))[1]
            size = float(np.exp((2.0 * np.log(std).sum() + correlation) / (2.0 * len(std))))
        names = tuple(self.cast.pool.tests[i].name for i in chosen)
        cost = float(self.cost[list(chosen)].sum()) / self.unit
        return Scored(names, cost, dict(zip(self.evidence.wanted, std.tolist(), strict=True)), size)

    def best(self, runs: int, starts: int = 2) -> Design:
        """The best design of at most ``runs`` runs that cost no more than as many mean runs of the standard plan."""
        return optimise(self.grid, runs, runs * self.unit, starts)

    def excess(self, design: Design) -> Array:
        """Standard deviation (s,) of each wanted value over that by the standard plan."""
        std = np.sqrt(np.diag(self.covariance(design.chosen)))
        return np.asarray(np.where(np.isfinite(self.target), std / self.target, 0.0))

    def reaching(self, runs: int) -> Design | None:
        """A design of at most ``runs`` runs with no wanted value more uncertain than by the standard plan, if found.

        The best by the criterion, then A-optimal ones in which the values that lag are counted more each round.
        """
        design = self.best(runs, starts=1)
        grid = replace(self.grid, criterion="A")
        for _ in range(ROUNDS):
            excess = self.excess(design)
            if np.all(excess <= 1.0 + 1e-9):
                return design
            if not np.isfinite(excess).all():
                return None
            grid = replace(grid, wanted=grid.wanted * excess[:, None])
            design = optimise(grid, runs, runs * self.unit, starts=1)
        return design if np.all(self.excess(design) <= 1.0 + 1e-9) else None

    def least(self) -> Design | None:
        """The smallest design found that is ``reaching``, no larger than the runs that bear on the aim."""
        return self._smallest(self.reaching)

    def least_size(self) -> Design | None:
        """The smallest design found whose ellipsoid is no larger than that of the standard plan."""
        size = self.score(self.cast.standard).size * (1.0 + 1e-9)

        def tried(runs: int) -> Design | None:
            design = self.best(runs, starts=1)
            return design if self.score(design.chosen).size <= size else None

        return self._smallest(tried)

    def _smallest(self, attempt: Callable[[int], Design | None]) -> Design | None:
        """By bisection over the number of runs, up to those that bear on the aim."""
        low, high = 0, len(self.bearing)
        found = attempt(high)
        while found is not None and high - low > 1:
            middle = (low + high) // 2
            tried = attempt(middle)
            if tried is None:
                low = middle
            else:
                found, high = tried, middle
        return found

    def open(self, chosen: Sequence[int]) -> tuple[str, ...]:
        """Unknowns that the runs hold nothing of."""
        if self.evidence.local:
            return ()
        held = np.einsum("rlii->i", self.evidence.square[list(chosen)])
        return tuple(name for name, value in zip(self.evidence.unknowns, held, strict=True) if value <= 0.0)

    def remedy(self, budget: int) -> str:
        """The least budget that determines the aim, in words."""
        for runs in range(budget + 1, len(self.cast.runs)):
            if np.isfinite(self.covariance(self.best(runs, starts=1).chosen)).all():
                return f"Give --budget {runs} or more, or aim at fewer terms with --for."
        return "Aim at fewer terms with --for."


def _refuse(budget: int, criterion: str) -> None:
    if budget < 1:
        raise InputError(f"--budget {budget} is no number of runs. Give how many runs may be spent, such as 30.")
    if criterion not in CRITERIA:
        raise InputError(f"--criterion {criterion!r}: choose D (volume of the ellipsoid) or A (mean variance).")


def _evidence(cast: Forecast, error: ErrorModel, craft: Craft, aim: tuple[str, ...]) -> Evidence:
    if not aim:
        raise InputError("--for names nothing. Name terms such as Yuv,Nuv, or index, or all.")
    if len(aim) > 1 and {"all", "index"} & set(aim):
        raise InputError("--for: all and index stand alone. Name one of them, or a list of terms.")
    return index_evidence(cast, error, craft) if aim == ("index",) else wide_evidence(cast, error, aim)


def _values(problem: Problem) -> dict[str, float]:
    """Predicted wanted values."""
    if problem.evidence.local:
        return {"G_h": stability_index(problem.cast.slopes, problem.craft)}
    return {name: float(problem.cast.values.get(name, math.nan)) for name in problem.evidence.wanted}


def _notes(cast: Forecast, aim: Sequence[str], criterion: str) -> tuple[str, ...]:
    return (
        f"{criterion}-optimal for {', '.join(aim)} among {len(cast.runs)} candidates; loads from {cast.source}.",
        "chosen for the model of symbols.TERMS: it holds no runs beside the aim, and no exploratory ones.",
    )
