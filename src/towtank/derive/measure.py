"""What each run says about a fit: left out of it, in its harmonics, from period to period, and at the stern."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import fdtri

from towtank.derive.cycles import Samples, family_of, scatter
from towtank.derive.fourier import harmonics
from towtank.derive.identify import Solved
from towtank.derive.regress import LEVERAGE
from towtank.derive.system import tie_matrix
from towtank.frames import Array
from towtank.symbols import LOADS
from towtank.tank.run import Run
from towtank.terms import columns

DRIVEN_LOADS = {
    "drift": "YN", "turn": "YN", "sway": "YN", "yaw": "YN", "incidence": "ZM", "heave": "ZM", "pitch": "ZM",
    "roll": "K", "surge": "X", "fins": "YZKMN",
}  # fmt: skip
"""Loads that a kind of run is made for; a kind that is not listed is judged by all six."""

ORDERS = 4
"""Harmonics 0 to 3: the mean, the driven one, the even one and the one that carries the cross-flow."""

CHANCE = 1e-5
"""Probability with which noise alone passes a limit: below one run in 50 campaigns of 100 runs and 10 tests."""

_POWER = 4.3
"""Standard deviations of a noise power that are passed with ``CHANCE``."""

_LEAST = 8
"""Least samples per period for harmonics to the third."""


@dataclass(frozen=True)
class LeftOut:
    """Each run against the fit without it; R runs, n unknowns.

    change (R, n) : unknowns without the run less those with it.
    squares (R, 6) : sum of squares of the run's nominal loads less what the others predict [N2, N2 m2].
    growth (R, n) : variance of each unknown without the run over that with it.
    """

    change: Array
    squares: Array
    growth: Array


def left_out(solved: Solved) -> LeftOut:
    """Leave each run out in turn, from the one factorisation of the fit with all of them.

    A direction of which a run holds more than ``regress.LEVERAGE`` of the information stays as it is: without the
    run nothing would determine it.

    Source     bellmccaffrey2002 (the block left out of the normal equations, as in their jackknife).
    """
    fit, system = solved.fit, solved.system
    runs, n = len(system.count), len(system.names)
    white = solve_triangular(fit.root, fit.weighted.T, trans="T").T
    back = solve_triangular(fit.root, np.eye(n)) / fit.scale[:, None]
    own_variance = (back**2).sum(axis=1)
    change, growth, squares = np.zeros((runs, n)), np.ones((runs, n)), system.rest.copy()
    order = np.argsort(system.run, kind="stable")
    edges = np.searchsorted(system.run[order], np.arange(runs + 1))
    for number in range(runs):
        at = order[edges[number] : edges[number + 1]]
        own = white[at]
        share, axes = np.linalg.eigh(own.T @ own)
        share = np.clip(share, 0.0, LEVERAGE)
        inflate = np.where(share < LEVERAGE, 1.0 / (1.0 - share), 0.0)
        step = -(axes @ (inflate * (axes.T @ (own.T @ fit.error[at]))))
        change[number] = back @ step
        growth[number] += ((back @ axes) ** 2 @ (share / (1.0 - share))) / own_variance
        error = (fit.error[at] - own @ step) ** 2 / solved.weight[number, system.load[at]]
        np.add.at(squares[number], system.load[at], error)
    return LeftOut(change, squares, growth)


@dataclass(frozen=True)
class Wave:
    """Harmonics 0 to 3 of one oscillation, and what of it does not repeat.

    load (4, 6), columns (4, 6, terms) : complex amplitudes of the loads and of the terms of the model.
    noise (6,) : variance of a sample that does not repeat from period to period; NaN with one period.
    repeat, noise_repeat (6,) : mean square change of harmonics 0 to 3 from one period to the next, the largest of
        all pairs, and what noise alone would pass with ``CHANCE``.
    samples : number of settled samples.
    """

    load: Array
    columns: Array
    noise: Array
    repeat: Array
    noise_repeat: Array
    samples: int


def waves(runs: Sequence[Run], samples: Samples, names: Sequence[str]) -> dict[int, Wave]:
    """Number of the run -> its ``Wave``, for each oscillation with at least 8 samples in a period.

    names : terms of the model, the order of ``Wave.columns``.
    """
    noise = scatter(samples, len(runs))
    out: dict[int, Wave] = {}
    for number, run in enumerate(runs):
        at = np.flatnonzero(samples.run == number)
        cycles = int(samples.period[at].max()) + 1
        if run.steady or len(at) < _LEAST * cycles:
            continue
        terms = columns(names, samples.nu[at], samples.nudot[at], samples.control[at])
        loads = samples.loads[0, at]
        repeat, limit = _repeat(loads.reshape(cycles, -1, 6))
        out[number] = Wave(
            harmonics(loads, ORDERS - 1, cycles), harmonics(terms, ORDERS - 1, cycles), noise[number], repeat, limit,
            len(at),
        )  # fmt: skip
    return out


def _repeat(cycles: Array) -> tuple[Array, Array]:
    """Mean square change of harmonics 0 to 3 between periods (6,), the largest pair, and the limit of noise (6,).

    The change of the higher harmonics is taken for noise, white within a period.
    """
    low, high = np.zeros(6), np.zeros(6)
    for a, b in itertools.pairwise(cycles):
        change = b - a
        amplitude = np.abs(np.fft.rfft(change, axis=0)[:ORDERS]) ** 2 / len(change) ** 2
        slow = amplitude[0] + 2.0 * amplitude[1:].sum(axis=0)
        low = np.maximum(low, slow)
        high = np.maximum(high, (change**2).mean(axis=0) - slow)
    ahead = 2 * ORDERS - 1
    behind = max(cycles.shape[1] - ahead, 1)
    return low, np.maximum(high, 0.0) * ahead / behind * float(fdtri(ahead, behind, 1.0 - CHANCE))


def misfits(runs: Sequence[Run], solved: Solved, out: LeftOut, found: dict[int, Wave], scale: Array) -> Array:
    """Lack of fit of each run and what noise alone may show of it (R, 2), as shares of the run's driven loads.

    The residual is that against the other runs; noise, known from the change between periods, is taken out of it.
    A steady run is compared with the root mean square load of its kind, since at a small angle its own says little.

    scale (6,) : size of each load over all runs, by which forces and moments are added up.
    """
    system = solved.system
    power = group_power(runs, system.power / system.count[:, None])
    result = np.zeros((len(runs), 2))
    for number, run in enumerate(runs):
        at = driven(run)
        size = float((power[number, at] / scale[at] ** 2).sum())
        wave = found.get(number)
        noise = np.nan_to_num(wave.noise[at]) if wave else np.zeros(len(at))
        square = out.squares[number, at] / system.count[number]
        excess = float(((square - noise) / scale[at] ** 2).sum())
        cycles = int(system.period[system.run == number].max(initial=0)) + 1
        count = max(float(system.count[number]), 1.0)
        unsure = _POWER * np.sqrt(2.0 / count + 2.0 / (count * max(cycles - 1, 1) / cycles))
        allowed = unsure * float((noise / scale[at] ** 2).sum())
        if size > 0.0:
            result[number] = np.sqrt(max(excess, 0.0) / size), np.sqrt(allowed / size)
    return result


def contents(run: Run, wave: Wave, unknowns: Array, ties: Array, scale: Array) -> dict[str, tuple[float, float]]:
    """Third and even harmonics that the model does not make, each with what noise alone may show.

    Shares of the first harmonic of the driven loads. Surge is left out of the even ones: X is no odd load.

    unknowns (n,) : of the fit without the run.   ties (terms, n) : from unknowns to the terms of ``wave``.
    """
    at = driven(run)
    strange = (wave.load - wave.columns @ (ties @ unknowns))[:, at] / scale[at]
    first = float(np.linalg.norm(wave.load[1, at] / scale[at]))
    if first == 0.0:
        return {}
    variance = float((np.nan_to_num(wave.noise[at]) / scale[at] ** 2).sum())
    noise = float(np.sqrt(-np.log(CHANCE) * 4.0 * variance / wave.samples)) / first
    out = {"third harmonic": (float(np.linalg.norm(strange[3])) / first, noise)}
    if run.kind != "surge":
        out["even harmonics"] = (float(np.linalg.norm(strange[[0, 2]])) / first, noise)
    return out


def repeatability(run: Run, wave: Wave, scale: Array) -> tuple[float, float] | None:
    """Change of the driven loads from period to period as a share of their size, and what noise alone may show.

    None where there is one period, or no load.

    Source     THEORY section 8 (period-to-period change below 1 %).
    """
    at = driven(run)
    squares = (np.abs(wave.load[:, at] / scale[at]) ** 2).sum(axis=1)
    power = float(squares[0] + 0.5 * squares[1:].sum())
    if power == 0.0 or not np.isfinite(wave.noise).all():
        return None
    change, noise = (float((part[at] / scale[at] ** 2).sum()) for part in (wave.repeat, wave.noise_repeat))
    return float(np.sqrt(change / power)), float(np.sqrt(noise / power))


def stern_angle(run: Run, samples: Samples, number: int) -> float:
    """Largest angle [deg] between the axis and the undisturbed flow at the stern: of v + x r and of w - x q over u."""
    nu = samples.nu[samples.run == number]
    x = -(run.length - run.origin_from_nose)
    across, down = nu[:, 1] + x * nu[:, 5], nu[:, 2] - x * nu[:, 4]
    return float(np.degrees(np.abs(np.arctan2(np.stack([across, down]), nu[:, 0])).max()))


def influence(solved: Solved, out: LeftOut, terms: Sequence[str], floor: float) -> Array:
    """Largest change (R,) of a key derivative when a run is left out, in standard uncertainties without it.

    The uncertainty is the jackknife's over the other runs, times what leaving out the run costs in information, and
    at least ``floor`` of the value: a run that carries the uncertainty must not hide behind it.
    """
    bases = {solved.choice.members[name][0] for name in terms if name in solved.choice.members}
    at = [i for i, name in enumerate(solved.system.names) if name in bases]
    if not at:
        return np.zeros(len(out.change))
    change, value = out.change[:, at], np.abs(solved.fit.unknowns[at, 0])
    others = (change**2).sum(axis=0) - change**2
    std = np.sqrt(np.maximum(others, 0.0) * out.growth[:, at])
    return np.asarray((np.abs(change) / np.maximum(np.maximum(std, floor * value), 1e-300)).max(axis=1))


def driven(run: Run) -> list[int]:
    """Numbers of the loads that a run is judged by."""
    return [LOADS.index(name) for name in DRIVEN_LOADS.get(run.kind, LOADS)]


def group_power(runs: Sequence[Run], power: Array) -> Array:
    """``power`` (R, 6), for steady runs the mean over their kind."""
    families = [family_of(run) for run in runs]
    out = power.copy()
    for kind in {name for name, run in zip(families, runs, strict=True) if run.steady}:
        at = [i for i, name in enumerate(families) if name == kind]
        out[at] = power[at].mean(axis=0)
    return np.asarray(out)


def ties_of(solved: Solved, names: Sequence[str]) -> Array:
    """Matrix (names, n) from the unknowns of ``solved`` to the terms ``names``; zero for a term it does not fit."""
    order, matrix = solved.choice.order, tie_matrix(solved.choice)
    at = [solved.choice.unknowns.index(name) for name in solved.system.names]
    return np.array([matrix[order.index(n), at] if n in order else np.zeros(len(at)) for n in names])
