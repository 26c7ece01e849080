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
from towtank.experiments.evidence import (
    ROUND_OFF,
    Evidence,
    fit_weights,
    index_evidence,
    stability_index,
    wide_evidence,
)
from towtank.experiments.exchange import BETTER, Grid, exchange, optimise
from towtank.experiments.forecast import Forecast, forecast
from towtank.frames import Array
from towtank.plan.kinds import Plan
from towtank.quantity import Quantity

CRITERIA = ("D", "A")

BEARS = 0.01
"""Smallest share of the information on an unknown for which a run of the standard plan bears on the aim."""


LARGER = 2
"""Size of the set that is thinned, over the size wanted (judgement: 3 and 5 gave sets alike)."""

LEAST_KIND = 7
"""Steady runs of a kind below which a plan is not thinned: two values fitted and five degrees of freedom, where the
factor for weights found from few ends. Rehearsed campaigns with fewer scatter several times as much as predicted."""

ROUNDS = 8
"""Most searches with the lagging values counted more (judgement: later ones move a value by a few per cent)."""


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
    _refuse(budget, criterion, tuple(aim))
    told = ErrorModel() if error is None else error
    cast = forecast(candidates(craft, speed, violent=violent), told, known)
    problem = Problem(
        craft, cast, told, _evidence(cast, told, craft, tuple(aim)), costs(cast.pool.tests, craft, cost), criterion
    )
    best = problem.best(budget)
    tests = tuple(cast.pool.tests[i] for i in best)
    chosen = problem.score(best)
    if not all(math.isfinite(std) for std in chosen.std.values()):
        raise InputError(
            f"--budget {budget}: {', '.join(n for n, s in chosen.std.items() if not math.isfinite(s))} cannot be "
            f"determined by {budget} runs of this cost. {problem.remedy(budget)}"
        )
    least, least_size = problem.least, problem.least_size()
    return Optimal(
        plan=Plan(craft, cast.pool.speed, tests, _notes(cast, aim, criterion)),
        aim=tuple(problem.evidence.wanted), criterion=criterion, budget=budget, values=_values(problem),
        source=cast.source, error=told, cost_model=cost, unit=problem.unit, candidates=len(cast.runs), chosen=chosen,
        standard=problem.score(cast.standard), bearing=problem.score(problem.bearing),
        equal=problem.score(problem.equal), least=None if least is None else problem.score(least),
        least_size=None if least_size is None else problem.score(least_size),
        open_terms=problem.open(best), problem=problem,
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
    def equal(self) -> tuple[int, ...]:
        """The best set of as many runs as bear on the aim, at no more than their cost."""
        return self._best(len(self.bearing), float(self.cost[list(self.bearing)].sum()))

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
        size = math.exp(float(_volume(covariance)))
        names = tuple(self.cast.pool.tests[i].name for i in chosen)
        cost = float(self.cost[list(chosen)].sum()) / self.unit
        return Scored(names, cost, dict(zip(self.evidence.wanted, std.tolist(), strict=True)), size)

    def best(self, runs: int) -> tuple[int, ...]:
        """The best set of at most ``runs`` runs that cost no more than as many mean runs of the standard plan."""
        return self._best(runs, runs * self.unit)

    def _best(self, most: int, budget: float) -> tuple[int, ...]:
        """The search sees weights and errors simplified; so a larger set is thinned by what the fit will leave too."""
        found = [optimise(self.grid, most, budget).chosen]
        larger = optimise(self.grid, LARGER * most, LARGER * budget, starts=1).chosen
        found.append(self._within(larger, most, budget))
        least = self.least or ()
        if len(least) <= most and self.cost[list(least)].sum() <= budget:
            found.append(least)
        return min(filter(None, found), key=lambda chosen: float(self._measure(self.covariance(chosen))), default=())

    def _measure(self, covariance: Array) -> Array:
        """The criterion, of covariances (..., s, s)."""
        if self.criterion == "D":
            return _volume(covariance)
        return np.asarray((self._excess(covariance) ** 2).mean(axis=-1))

    def _within(self, start: Sequence[int], most: int, budget: float) -> tuple[int, ...]:
        """``start`` without the runs that tell least, until it keeps number and cost; empty when it cannot."""
        chosen = list(start)
        while len(chosen) > most or self.cost[chosen].sum() > budget * (1.0 + ROUND_OFF):
            kinds = [self.evidence.family[i] for i in chosen]
            small = np.array([bool(kind) and kinds.count(kind) <= LEAST_KIND for kind in kinds])
            rise = np.where(small, np.inf, self._rise(chosen, self._measure))
            if not np.isfinite(rise).any():
                return ()
            dear = rise / self.cost[chosen] if self.cost[chosen].sum() > budget else rise
            del chosen[int(np.argmin(dear))]
        return tuple(sorted(chosen))

    def _rise(self, chosen: Sequence[int], measure: Callable[[Array], Array]) -> Array:
        """Rise (len(chosen),) of ``measure`` without each run; infinite where a value is then open."""
        now = float(measure(self.covariance(chosen)))
        if not math.isfinite(now):
            return np.full(len(chosen), np.inf)
        left = measure(self.evidence.without_each(chosen, self.weight(chosen)))
        return np.asarray(np.where(np.isfinite(left), left - now, np.inf))

    @cached_property
    def least(self) -> tuple[int, ...] | None:
        """The smallest set found with no wanted value more uncertain than by the standard plan."""
        return self._thinned(self._balanced(), self._worst, 1.0)

    def least_size(self) -> tuple[int, ...] | None:
        """The smallest set found whose ellipsoid is no larger than that of the standard plan."""
        return self._thinned(self.equal, _volume, float(_volume(self.covariance(self.cast.standard))))

    def _excess(self, covariance: Array) -> Array:
        """Standard deviation (..., s) of each wanted value over that by the standard plan; covariance (..., s, s)."""
        std = np.sqrt(np.einsum("...ss->...s", covariance))
        return np.asarray(np.where(np.isfinite(self.target), std / self.target, 0.0))

    def _worst(self, covariance: Array) -> Array:
        return np.asarray(self._excess(covariance).max(axis=-1))

    def _balanced(self) -> tuple[int, ...]:
        """As ``equal``, but so that no value lags: A-optimal, laggards counted more each round; the best round."""
        budget = float(self.cost[list(self.bearing)].sum())
        found = [optimise(self.grid, len(self.bearing), budget).chosen]
        grid = replace(self.grid, criterion="A")
        for _ in range(ROUNDS):
            excess = self._excess(self.covariance(found[-1]))
            if not np.isfinite(excess).all():
                break
            grid = replace(grid, wanted=grid.wanted * excess[:, None])
            found.append(exchange(grid, found[-1], len(self.bearing), budget).chosen)
        return min(found, key=lambda chosen: float(self._worst(self.covariance(chosen))))

    def _thinned(self, start: Sequence[int], measure: Callable[[Array], Array], limit: float) -> tuple[int, ...] | None:
        """``start`` without the runs that it can spare while ``measure`` stays within ``limit``.

        Each time the run goes that raises ``measure`` least for its cost. None when ``start`` itself is beyond.
        """
        limit += BETTER * max(abs(limit), 1.0)
        chosen = list(start)
        if not measure(self.covariance(chosen)) <= limit:
            return None
        while (rest := self._spared(chosen, measure, limit)) is not None:
            chosen = rest
        return tuple(chosen)

    def _spared(self, chosen: list[int], measure: Callable[[Array], Array], limit: float) -> list[int] | None:
        rise = self._rise(chosen, measure)
        able = rise <= limit - float(measure(self.covariance(chosen)))
        for at in np.argsort(np.where(able, rise / self.cost[chosen], np.inf))[: able.sum()]:
            rest = [*chosen[:at], *chosen[at + 1 :]]
            # The weights change with the set, so it is judged anew.
            if measure(self.covariance(rest)) <= limit:
                return rest
        return None

    def open(self, chosen: Sequence[int]) -> tuple[str, ...]:
        """Unknowns that the runs hold nothing of."""
        if self.evidence.local:
            return ()
        held = np.einsum("rlii->i", self.evidence.square[list(chosen)])
        return tuple(name for name, value in zip(self.evidence.unknowns, held, strict=True) if value <= 0.0)

    def remedy(self, budget: int) -> str:
        """The least budget that determines the aim, in words."""
        for runs in range(budget + 1, len(self.cast.runs)):
            if np.isfinite(self.covariance(optimise(self.grid, runs, runs * self.unit, starts=1).chosen)).all():
                return f"Give --budget {runs} or more, or aim at fewer terms with --for."
        return "Aim at fewer terms with --for."


def _volume(covariance: Array) -> Array:
    """Logarithm of the geometric mean of the axes of the ellipsoids of covariances (..., s, s); infinite when open."""
    std = np.sqrt(np.einsum("...ss->...s", covariance))
    closed = np.isfinite(std).all(axis=-1)
    std = np.where(closed[..., None], std, 1.0)
    correlation = np.where(
        closed[..., None, None], covariance / (std[..., :, None] * std[..., None, :]), np.eye(std.shape[-1])
    )
    log = (2.0 * np.log(std).sum(axis=-1) + np.linalg.slogdet(correlation)[1]) / (2.0 * std.shape[-1])
    return np.asarray(np.where(closed, log, np.inf))


def _refuse(budget: int, criterion: str, aim: tuple[str, ...]) -> None:
    if budget < 1:
        raise InputError(f"--budget {budget} is no number of runs. Give how many runs may be spent, such as 30.")
    if criterion not in CRITERIA:
        raise InputError(f"--criterion {criterion!r}: choose D (volume of the ellipsoid) or A (mean variance).")
    if not aim:
        raise InputError("--for names nothing. Name terms such as Yuv,Nuv, or index, or all.")
    if len(aim) > 1 and {"all", "index"} & set(aim):
        raise InputError("--for: all and index stand alone. Name one of them, or a list of terms.")


def _evidence(cast: Forecast, error: ErrorModel, craft: Craft, aim: tuple[str, ...]) -> Evidence:
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
