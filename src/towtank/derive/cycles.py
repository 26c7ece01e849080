"""Settled samples: whole periods, the first one dropped; a steady run is one sample."""

from __future__ import annotations

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
    parts = [_of(run, number, members) for number, run in enumerate(runs)]
    joined = [np.concatenate([part[i] for part in parts]) for i in (0, 1, 2)]
    loads = np.concatenate([part[3] for part in parts], axis=1)
    run, period = (np.concatenate([part[i] for part in parts]) for i in (4, 5))
    return Samples(joined[0], joined[1], joined[2], loads, run.astype(np.intp), period.astype(np.intp))


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


def _of(run: Run, number: int, members: int) -> tuple[Array, ...]:
    at = run.settled
    stack = [run.loads[None, at]]
    if members:
        stack.append(np.broadcast_to(run.loads, (members, *run.loads.shape))[:, at] if run.ensemble is None
                     else run.ensemble[:, at])  # fmt: skip
    loads = np.concatenate(stack)
    arrays = [run.history.nu[at], run.history.nudot[at], run.control[at]]
    period = np.zeros(len(at), dtype=np.intp)
    if run.steady:
        arrays, loads, period = [a.mean(axis=0, keepdims=True) for a in arrays], loads.mean(axis=1)[:, None], period[:1]
    else:
        per = (len(run.history.time) - 1) // run.periods
        period = np.arange(len(at)) // per
    return (*arrays, loads, np.full(len(period), number), period)


def scatter(samples: Samples, runs: int) -> Array:
    """Mean square difference of a load from one period to the next, halved, (runs, 6); NaN where there is one period.

    For noise that is independent from period to period this is its variance; for loads that repeat it is zero.
    """
    out = np.full((runs, 6), np.nan)
    for number in range(runs):
        at = samples.run == number
        periods = samples.period[at]
        count = int(periods.max()) + 1
        if count > 1:
            cycles = samples.loads[0, at].reshape(count, -1, 6)
            out[number] = 0.5 * (np.diff(cycles, axis=0) ** 2).mean(axis=(0, 1))
    return out
