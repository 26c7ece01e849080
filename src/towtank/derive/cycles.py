"""Settled samples: whole periods, the first one dropped; a steady run is one sample."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.tank.run import Run


@dataclass(frozen=True)
class Samples:
    """Settled samples of several runs, one after the other; N samples.

    nu, nudot (N, 6); control (N, 4); loads (1 + members, N, 6), the nominal first [N, N m].
    run (N,) : number of the run.   period (N,) : number of the period within its run.
    """

    nu: Array
    nudot: Array
    control: Array
    loads: Array
    run: NDArray[np.intp]
    period: NDArray[np.intp]


def settled(runs: Sequence[Run]) -> Samples:
    """Samples of ``runs`` to be analysed. The samples of a steady run are averaged into one.

    Raises
    ------
    DeriveError
        The model-form ensembles of the runs differ in size.

    Source     perron, section 3.5 (the first period carries the start-up of the wake).
    """
    members = ensemble_size(runs)
    size = [1 if run.steady else len(run.settled) for run in runs]
    nu, nudot, control = (np.empty((sum(size), k)) for k in (6, 6, 4))
    loads = np.empty((1 + members, sum(size), 6))
    number = np.repeat(np.arange(len(runs), dtype=np.intp), size)
    period = np.zeros(sum(size), dtype=np.intp)
    start = 0
    for run, count in zip(runs, size, strict=True):
        at, to = run.settled, slice(start, start + count)
        for out, values in ((nu, run.history.nu), (nudot, run.history.nudot), (control, run.control)):
            out[to] = values[at].mean(axis=0) if run.steady else values[at]
        loads[0, to] = run.loads[at].mean(axis=0) if run.steady else run.loads[at]
        if members and run.ensemble is None:
            loads[1:, to] = loads[0, to]
        elif run.ensemble is not None:
            loads[1:, to] = run.ensemble[:, at].mean(axis=1)[:, None] if run.steady else run.ensemble[:, at]
        if not run.steady:
            period[to] = np.arange(count) // ((len(run.history.time) - 1) // run.periods)
        start += count
    return Samples(nu, nudot, control, loads, number, period)


def family_of(run: Run) -> str:
    """Kind of the run; ``<kind>, mixed`` for a steady run that holds more than one of sway, heave, rates and fins.

    A mixed run also sees what the model leaves out (v|r|, fins in drift), so it is not judged together with pure ones.
    """
    if not run.steady:
        return run.kind
    held = int((np.abs(run.history.nu[:, 1:]).max(axis=0) > 1e-9).sum()) + int(np.any(run.control != 0.0))
    return f"{run.kind}, mixed" if held > 1 else run.kind


def ensemble_size(runs: Sequence[Run]) -> int:
    """Members of the model-form ensemble, 0 when no run has one."""
    sizes = {len(run.ensemble) for run in runs if run.ensemble is not None}
    if len(sizes) > 1:
        raise DeriveError(
            f"derive: the runs have model-form ensembles of different sizes ({sorted(sizes)}), so their members do not "
            "belong together. Tow all runs with the same number of members."
        )
    return sizes.pop() if sizes else 0


def scatter(samples: Samples, runs: int) -> Array:
    """Mean square difference of a load from one period to the next, halved, (runs, 6); NaN where there is one period.

    For noise that is independent from period to period this is its variance; for loads that repeat it is zero.
    """
    out = np.full((runs, 6), np.nan)
    edges = np.searchsorted(samples.run, np.arange(runs + 1))
    for number, (start, stop) in enumerate(itertools.pairwise(edges)):
        count = int(samples.period[stop - 1]) + 1 if stop > start else 0
        if count > 1:
            cycles = samples.loads[0, start:stop].reshape(count, -1, 6)
            out[number] = 0.5 * (np.diff(cycles, axis=0) ** 2).mean(axis=(0, 1))
    return out
