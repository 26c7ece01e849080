"""What each candidate says about the unknowns, and how uncertain a set of them leaves the result."""

from __future__ import annotations

import typing
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive import weights
from towtank.derive.cycles import family_of, settled
from towtank.derive.expand import expand
from towtank.derive.origin import WINDOW_DEG, WINDOW_TURN
from towtank.derive.select import GATED, choose, independent
from towtank.derive.system import System, build, tie_matrix
from towtank.errors import InputError
from towtank.experiments.errors import FITTED, ErrorModel, found_weight, shapes
from towtank.experiments.exchange import PRIOR, Grid
from towtank.experiments.forecast import Forecast
from towtank.frames import Array
from towtank.symbols import LOADS
from towtank.terms import columns

KEPT = 1e-10
"""Share of the largest eigenvalue of a run's information below which a direction is round-off."""
CONFUSED = 1e-2 / PRIOR
"""Growth of a variance by the other unknowns above which the prior, not the runs, tells the values apart."""

ROUND_OFF = 1e-12
"""Share of the information on an unknown that is left by subtraction when no run holds it."""

SLOPES = ("Yuv", "Nuv", "Yur", "Nur")
"""Slopes at the origin that the horizontal stability index is made of."""


@dataclass(frozen=True)
class Evidence:
    """R candidates, n unknowns, L channels (the six loads), m components of the error.

    unknowns : names.   square (R, L, n, n) : mean over a cycle of the outer product of the regressors.
    across (R, L, n, m) : mean over a cycle of regressor times component.
    sigma (R, L) : standard deviation of the load.   witness (R,) : variance of a component of unit variance.
    components (R,) : in how many components the variance is spread.
    found (R,) : factor on the variance because the weight of an oscillation is found from its own residual.
    family (R,) : of steady runs, which are weighted together by the residual of all; empty for the others.
    wanted : name -> combination (n,) of the unknowns.   local : True for the slopes at the origin.
    """

    unknowns: tuple[str, ...]
    square: Array
    across: Array
    sigma: Array
    witness: Array
    components: Array
    found: Array
    family: tuple[str, ...]
    wanted: Mapping[str, Array]
    local: bool = False

    def grid(self, cost: Array, criterion: str, unit: Array | None = None) -> Grid:
        """The candidates for the search. unit (s,) : standard deviation that each wanted value is counted in.

        A run counts once, whatever its sampling: each component of a load is taken to be as uncertain as the load,
        which is the weight that ``derive`` gives it. So oscillations are better than the search takes them for.
        """
        information = np.einsum("rl,rlij->rij", 1.0 / self.sigma**2, self.square, optimize=True)
        norm = np.sqrt(np.maximum(np.einsum("rii->i", information), 1e-300))
        scaled = information / np.outer(norm, norm)
        wanted = np.array(list(self.wanted.values())) / norm
        if unit is not None:
            wanted = wanted / unit[:, None]
        return Grid(_rows(scaled), cost, wanted, PRIOR * np.eye(len(norm)), criterion)

    @cached_property
    def noise(self) -> Array:
        """Mean product (R, L, n, n) of regressors and error, for an error of unit standard deviation."""
        factor = self.witness / self.components
        return np.asarray(np.einsum("r,rlim,rljm->rlij", factor, self.across, self.across, optimize=True))

    def weight_factor(self, chosen: Sequence[int]) -> Array:
        """Factor (len(chosen),) on the variance of each run because its weight is found from residuals."""
        size = Counter(self.family[i] for i in chosen)
        freedom = np.array([float(size[self.family[i]] - FITTED) for i in chosen])
        alone = np.array([not self.family[i] for i in chosen])
        return np.asarray(np.where(alone, self.found[list(chosen)], found_weight(freedom)))

    def covariance(self, chosen: Sequence[int], weight: Array) -> Array:
        """Covariance (s, s) of the wanted values, of a weighted fit to the runs ``chosen``.

        weight : (len(chosen), L) of a run's mean square. A value that the runs do not hold has an infinite variance.

        Source     cameronmiller2015, section II (variance of a weighted fit whose errors are not as weighted).
        """
        information, middle = self._parts(chosen, weight)
        return self._sandwich(information.sum(axis=0), middle.sum(axis=0))

    def without_each(self, chosen: Sequence[int], weight: Array) -> Array:
        """Covariances (len(chosen), s, s) without each run of ``chosen`` in turn, the others weighted as before."""
        information, middle = self._parts(chosen, weight)
        return self._sandwich(information.sum(axis=0) - information, middle.sum(axis=0) - middle)

    def _parts(self, chosen: Sequence[int], weight: Array) -> tuple[Array, Array]:
        """Information and its noise (len(chosen), n, n) of each run."""
        at = list(chosen)
        information = np.einsum("rl,rlij->rij", weight, self.square[at], optimize=True)
        noise = self.weight_factor(at)[:, None] * (weight * self.sigma[at]) ** 2
        return information, np.einsum("rl,rlij->rij", noise, self.noise[at], optimize=True)

    def _sandwich(self, information: Array, middle: Array) -> Array:
        """Covariances (..., s, s) of the wanted values."""
        own = np.einsum("...ii->...i", information)
        held = own > ROUND_OFF * own.max(axis=tuple(range(own.ndim - 1)), initial=0.0)
        norm = np.sqrt(np.where(held, own, 1.0))
        square = norm[..., :, None] * norm[..., None, :]
        prior = PRIOR * np.eye(own.shape[-1])
        inverse = np.linalg.inv(information / square + prior)
        # The prior is an observation of its own, so that what the runs leave open stays open.
        unknown = inverse @ (middle / square + prior) @ inverse
        combinations = np.array(list(self.wanted.values()))
        scaled = combinations / norm[..., None, :]
        out = np.asarray(scaled @ unknown @ np.swapaxes(scaled, -1, -2))
        open_ = np.any((combinations != 0.0) & ~held[..., None, :], axis=-1)
        spread = np.einsum("...si,...ij,...sj->...s", scaled, inverse, scaled)
        open_ |= spread > CONFUSED * (scaled**2).sum(axis=-1)
        diagonal = np.einsum("...ss->...s", out)
        diagonal[open_] = np.inf
        return out


def wide_evidence(cast: Forecast, error: ErrorModel, wanted: Sequence[str]) -> Evidence:
    """Evidence on the terms of the wide fit.

    wanted : names of terms; ("all",) for every unknown that the candidates tell apart.

    Raises
    ------
    InputError
        A term that the candidates do not excite.
    """
    runs = cast.runs
    samples = settled([replace(run, ensemble=None) for run in runs])
    choice = choose(runs, samples)
    forbidden = GATED if runs[0].symmetry in ("fourfold", "mirror") else ()
    out = {name: "symmetry makes it zero" for name in choice.unknowns if name in forbidden}
    choice = choice.keep([name for name in choice.unknowns if name not in out], out)
    system = build(samples, choice)
    kept, reasons = independent(system.matrix / weights.load_scale(system)[system.load][:, None], system.names)
    choice = choice.keep([system.names[i] for i in kept], reasons)
    n = len(choice.unknowns)
    first = samples.period == 0
    parts = columns(choice.order, samples.nu[first], samples.nudot[first], samples.control[first]) @ tie_matrix(choice)
    owner = samples.run[first]
    square, across = np.zeros((len(runs), 6, n, n)), np.zeros((len(runs), 6, n, error.components))
    for number, run in enumerate(runs):
        own = parts[owner == number]
        waves = shapes(error, len(own), run.steady)
        square[number] = np.einsum("tli,tlj->lij", own, own, optimize=True) / len(own)
        across[number, :, :, : waves.shape[1]] = np.einsum("tli,tm->lim", own, waves, optimize=True) / len(own)
    expansion = expand(choice, runs[0].symmetry, np.zeros(n), np.zeros((n, n)))
    rows = dict(zip(expansion.names, expansion.matrix, strict=True))
    combinations = _all(choice.unknowns, rows) if tuple(wanted) == ("all",) else _picked(wanted, rows, choice.left_out)
    cycles = np.array([1.0 if run.steady else max(run.periods - 1.0, 1.0) for run in runs])
    spread = np.array([1.0 if run.steady else float(error.components) for run in runs])
    found = np.array([1.0 if run.steady else error.weight_factor(c) for run, c in zip(runs, cycles, strict=True)])
    family = tuple(family_of(run) if run.steady else "" for run in runs)
    return Evidence(
        choice.unknowns, square, across, cast.sigma, error.witness(cycles), spread, found, family, combinations
    )


def _all(unknowns: Sequence[str], rows: Mapping[str, Array]) -> dict[str, Array]:
    """Every unknown as a term of the model; of the two halves of the added mass, which are averaged, one."""
    out: dict[str, Array] = {}
    for name in unknowns:
        if not any(np.array_equal(rows[name], row) for row in out.values()):
            out[name] = rows[name]
    return out


def _picked(wanted: Sequence[str], rows: Mapping[str, Array], left_out: Mapping[str, str]) -> dict[str, Array]:
    for name in wanted:
        if name not in rows:
            why = left_out.get(name, "it is no term of the model of this craft")
            raise InputError(
                f"--for: {name} cannot be aimed at: {why}. Terms of this craft: {', '.join(rows)}; or index, or all."
            )
    picked: dict[str, Array] = {}
    for name in wanted:
        if np.linalg.matrix_rank(np.array([*picked.values(), rows[name]])) == len(picked):
            raise InputError(f"--for: {name} follows from {', '.join(picked)} by symmetry. Leave one of them out.")
        picked[name] = rows[name]
    return picked


def index_evidence(cast: Forecast, error: ErrorModel, craft: Craft) -> Evidence:
    """Evidence on the horizontal stability index, through the slopes at the origin as ``derive.origin`` finds them.

    Steady drift and steady turns of small angle inform a slope, a cubic and a constant each, in Y and in N.

    Raises
    ------
    InputError
        No slopes are known, or the craft has no damping there, so that the index says nothing.
    """
    runs, length = cast.runs, craft.length
    names = tuple(f"{load}{part}" for part in ("uv", "vvv", "0v", "ur", "rrr", "0r") for load in "YN")
    square = np.zeros((len(runs), 4, 12, 12))
    across, sigma = np.zeros((len(runs), 4, 12, 1)), np.ones((len(runs), 4))
    for number, run in enumerate(runs):
        nu, U = run.history.nu[0], run.speed
        if not run.steady or np.any(np.abs(nu[2:5]) > 0.0) or np.any(run.control[0] != 0.0):
            continue
        for plane, (x, size) in enumerate(((nu[1], abs(nu[1]) / U), (nu[5], abs(nu[5]) * length / U))):
            other = nu[5] if plane == 0 else nu[1]
            if other != 0.0 or size > (np.sin(np.radians(WINDOW_DEG)), WINDOW_TURN)[plane]:
                continue
            basis = np.array([nu[0] * x, x**3 / U, U * U])
            for k, load in enumerate("YN"):
                row = np.zeros(12)
                row[6 * plane + k + 2 * np.arange(3)] = basis
                square[number, 2 * plane + k] = np.outer(row, row)
                across[number, 2 * plane + k, :, 0] = row
                sigma[number, 2 * plane + k] = cast.sigma[number, LOADS.index(load)]
    slope = np.zeros(12)
    for name, part in gradient(cast.slopes, craft).items():
        slope[names.index(name)] = part
    ones = np.ones(len(runs))
    return Evidence(
        names, square, across, sigma, error.witness(ones), ones, ones, ("",) * len(runs), {"G_h": slope}, True
    )


def stability_index(slopes: Mapping[str, float], craft: Craft) -> float:
    """G_h = 1 - Nuv (Yur - m) / (Yuv (Nur - xG m)) of slopes at the origin; NaN where nothing damps.

    Source     roddy1990; THEORY section 7.
    """
    m, arm = craft.mass.mass, craft.mass.cg[0]
    above = slopes["Nuv"] * (slopes["Yur"] - m)
    below = slopes["Yuv"] * (slopes["Nur"] - arm * m)
    return 1.0 - above / below if below > 0.0 else float("nan")


def gradient(slopes: Mapping[str, float], craft: Craft) -> dict[str, float]:
    """Slope -> change of G_h per unit, by central differences of 0.01 %.

    Raises
    ------
    InputError
        No slopes, or no damping.
    """
    if not all(name in slopes for name in SLOPES) or not np.isfinite(stability_index(slopes, craft)):
        raise InputError(
            "--for index: the slopes at the origin that are known do not damp sway or yaw, so the stability index has "
            "no value to aim at. Aim at the slopes: --for Yuv,Nuv,Yur,Nur."
        )
    out = {}
    for name in SLOPES:
        step = 1e-4 * max(abs(slopes[name]), 1e-12)
        up, down = ({**slopes, name: slopes[name] + sign * step} for sign in (1.0, -1.0))
        out[name] = (stability_index(up, craft) - stability_index(down, craft)) / (2.0 * step)
    return out


@dataclass(frozen=True)
class _Expected:
    """What the rules of ``derive.weights`` read of a System: ``rest`` stands for the squared residuals."""

    rest: Array
    power: Array
    count: Array

    def squares(self, unknowns: Array) -> Array:
        return self.rest.copy()


def fit_weights(cast: Forecast, chosen: Sequence[int], weight_steady: float | None = None) -> Array:
    """Weight (len(chosen), 6) of a run's mean square that ``derive`` is expected to give it.

    Its own rules are asked, with the error model in place of the residuals.
    """
    at = list(chosen)
    runs = [cast.runs[i] for i in at]
    count = np.array([len(run.settled) if not run.steady else 1 for run in runs], dtype=float)
    expected = _Expected(cast.sigma[at] ** 2 * count[:, None], cast.rms[at] ** 2 * count[:, None], count)
    system = typing.cast(System, expected)
    share = weights.family(system, runs, weights.default_share(runs) if weight_steady is None else weight_steady)
    return np.asarray(share * count[:, None] / weights.spread(system, runs, np.zeros(0)) ** 2)


def _rows(information: Array) -> Array:
    """Rows (R, k, n) whose outer products add up to ``information`` (R, n, n), k the largest rank."""
    values, vectors = np.linalg.eigh(information)
    largest = np.maximum(values[:, -1:], 1e-300)
    values = np.where(values > KEPT * largest, values, 0.0)
    rank = max(int((values > 0.0).sum(axis=1).max()), 1)
    return np.asarray(np.swapaxes(vectors[:, :, -rank:] * np.sqrt(values[:, None, -rank:]), 1, 2))
