"""How often the stated 95 % interval of a derivative holds the truth, on synthetic campaigns.

The standard plan of "hokie" is towed with known coefficients, noise is added, and ``derive`` is asked for values and
intervals. Run as a script, it writes ``validation/interval_coverage.csv``: one row for each kind of noise and term, and
one for all terms together. ``python validation/interval_coverage.py 50`` takes 50 campaigns of each kind of noise.
"""

from __future__ import annotations

import functools
import multiprocessing
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tables import write_table
from towtank.craft.library import read_craft
from towtank.derive.derive import derive
from towtank.derive.select import GATED, allowed
from towtank.plan.standard import standard_plan
from towtank.symbols import FOURFOLD_TIES, TERMS
from towtank.tank.campaign import tow
from towtank.tank.lpm import LpmTank
from towtank.tank.run import Run

Array = NDArray[np.float64]
TARGET = Path(__file__).with_suffix(".csv")
CRAFT, LEVEL, NORMAL = "hokie", 0.02, 1.959964
"""Craft; standard deviation of the noise over the rms of a load in its run; half-width of the 95 % interval."""
CAMPAIGNS, TRUTHS = 400, 8
"""Campaigns for each kind of noise; sets of true coefficients, used in turn."""
SAMPLES = 32


@functools.cache
def truth(seed: int) -> tuple[dict[str, float], tuple[Run, ...]]:
    """Coefficients with primes of 0.3 to 1 % and the runs they make, without noise."""
    craft = read_craft(CRAFT)
    rng = np.random.default_rng([7, seed])
    names = [n for n in allowed(craft.symmetry) if n not in GATED]
    unit = {n: TERMS[n].prime_factor(craft.water.density, craft.length, craft.speed) for n in names}
    values = {n: -unit[n] * float(rng.uniform(3e-3, 1e-2)) for n in names}
    values["Nvdot"] = values["Yrdot"]
    values |= {name: sign * values[base] for name, (base, sign) in FOURFOLD_TIES.items()}
    return values, tow(standard_plan(craft, samples=SAMPLES), LpmTank(values))


def independent_terms() -> tuple[str, ...]:
    """Terms that are no copies of another by symmetry: the others have the same errors."""
    tied = {*FOURFOLD_TIES, *GATED, "Nvdot"}
    return tuple(n for n in allowed("fourfold") if n not in tied)


def white(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """Independent from sample to sample."""
    return [LEVEL * _size(run) * rng.standard_normal(run.loads.shape) for run in runs]


def correlated(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """First-order autoregressive; it forgets in an eighth of a period. A steady run has one error."""
    out = []
    for run in runs:
        keep = 1.0 if run.steady else float(np.exp(-8.0 / SAMPLES))
        noise = rng.standard_normal(run.loads.shape)
        for i in range(1, len(noise)):
            noise[i] = keep * noise[i - 1] + np.sqrt(1.0 - keep * keep) * noise[i]
        out.append(LEVEL * _size(run) * noise)
    return out


def uneven(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """White, a quarter to four times as large from run to run."""
    return [4.0 ** rng.uniform(-1.0, 1.0) * error for error in white(runs, rng)]


def even(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """White, of one size in all runs, as a balance has: the share of ``LEVEL`` in the rms of a load over all runs."""
    size = LEVEL * np.sqrt(np.mean([_size(run) ** 2 for run in runs], axis=0))
    return [size * rng.standard_normal(run.loads.shape) for run in runs]


def one_each(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """A steady run is off by one share, the same in its six loads and all its samples; oscillations are white."""
    return [
        LEVEL * _size(run) * rng.standard_normal() * np.ones_like(run.loads) if run.steady else error
        for run, error in zip(runs, white(runs, rng), strict=True)
    ]


def zero_shift(runs: Sequence[Run], rng: np.random.Generator) -> list[Array]:
    """White, and a balance whose zero is off by as much in every run: an error that all runs share."""
    largest = np.max([_size(run) for run in runs], axis=0)
    shift = 0.25 * LEVEL * largest * rng.standard_normal(6)
    return [error + shift for error in white(runs, rng)]


NOISES: dict[str, Callable[[Sequence[Run], np.random.Generator], list[Array]]] = {
    noise.__name__: noise for noise in (white, correlated, uneven, even, one_each, zero_shift)
}


def pulls(noise: str, seed: int) -> Array:
    """Error over stated standard deviation of the ``independent_terms`` in one campaign."""
    values, exact = truth(seed % TRUTHS)
    rng = np.random.default_rng([11, list(NOISES).index(noise), seed])
    errors = NOISES[noise](exact, rng)
    found = derive([replace(run, loads=run.loads + e) for run, e in zip(exact, errors, strict=True)])
    std = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    return np.array([(found[n] - values[n]) / std[n] for n in independent_terms()])


def inside(found: Array) -> Array:
    """1 where the stated 95 % interval holds the truth, 0 elsewhere, for pulls of any shape."""
    return (np.abs(found) < NORMAL).astype(float)


def _size(run: Run) -> Array:
    return np.asarray(np.sqrt((run.loads**2).mean(axis=0)))


def _one(job: tuple[str, int]) -> Array:
    return pulls(*job)


def rows(campaigns: int) -> Iterator[list[str]]:
    """Noise, term ("all" for the mean over the terms), campaigns, coverage, standard deviation of the pulls."""
    terms = independent_terms()
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        for noise in NOISES:
            found = np.array(list(pool.map(_one, [(noise, seed) for seed in range(campaigns)], chunksize=10)))
            for term, column in (("all", found), *zip(terms, found.T, strict=True)):
                yield [noise, term, str(campaigns), f"{inside(column).mean():.4f}", f"{column.std():.3f}"]


def main(campaigns: int) -> None:
    """Run the campaigns and write the table."""
    made_by = f"{CRAFT}, {TRUTHS} sets of coefficients, seeds 0 to {campaigns - 1} of each noise, level {LEVEL:g}"
    write_table(TARGET, made_by, ("noise", "term", "campaigns", "coverage_95", "std_of_pulls"), rows(campaigns))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else CAMPAIGNS)
