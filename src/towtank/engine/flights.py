"""What came out of a run: ends of legs, gauges, logs, for one trajectory or many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.engine.plan import Ended, Gauge, Leg, Stat
from towtank.frames import Array


@dataclass(frozen=True)
class Flights:
    """N trajectories through L legs with G gauges, S samples of C channels.

    time (S,) [s]; log (N, S, C), NaN after a trajectory's end; logged (C,) names.
    mark_time (N, L) [s], NaN for a leg that was not finished; by_event (N, L); mark (N, L, channels).
    stats (N, L, G, len(Stat)), NaN likewise.
    ended (N,) as in ``Ended``; end_time (N,) [s]; state (N, 13 + n + 3): last state and memory.
    """

    legs: tuple[Leg, ...]
    gauges: tuple[Gauge, ...]
    names: tuple[str, ...]
    logged: tuple[str, ...]
    time: Array
    log: Array
    mark_time: Array
    by_event: NDArray[np.bool_]
    mark: Array
    stats: Array
    ended: NDArray[np.int64]
    end_time: Array
    state: Array
    path: str

    def __len__(self) -> int:
        return len(self.ended)

    @property
    def finished(self) -> NDArray[np.bool_]:
        """True (N,) for the trajectories that went through all their legs."""
        return np.asarray(self.ended == Ended.DONE)

    def leg(self, name: str) -> int:
        """Place of the leg called ``name``."""
        return next(i for i, leg in enumerate(self.legs) if leg.name == name)

    def at(self, leg: str, channel: str, *, event: bool = True) -> Array:
        """Channel (N,) at the end of a leg; NaN where it did not end, or not by its ``event``."""
        i = self.leg(leg)
        values = self.mark[:, i, self.names.index(channel)]
        return np.where(self.by_event[:, i], values, np.nan) if event else values

    def when(self, leg: str, *, event: bool = True) -> Array:
        """Time (N,) [s] of the end of a leg; NaN where it did not end, or not by its ``event``."""
        i = self.leg(leg)
        return np.where(self.by_event[:, i], self.mark_time[:, i], np.nan) if event else self.mark_time[:, i]

    def duration(self, leg: str) -> Array:
        """Time (N,) [s] spent in a leg that was finished."""
        i = self.leg(leg)
        return self.mark_time[:, i] - (self.mark_time[:, i - 1] if i else 0.0)

    @property
    def finished_time(self) -> Array:
        """Time (N,) [s] of the last end of a leg; NaN where no leg was finished. ``over`` holds what came before it."""
        with np.errstate(all="ignore"):
            return np.asarray(np.fmax.reduce(self.mark_time, axis=1))

    def stat(self, leg: str, gauge: Gauge, stat: Stat) -> Array:
        """What ``gauge`` holds for a leg (N,)."""
        return self.stats[:, self.leg(leg), self.gauges.index(gauge), stat]

    def over(self, gauge: Gauge, stat: Stat) -> Array:
        """What ``gauge`` holds over all finished legs (N,): sums of integrals and times, extremes of extremes.

        NaN where no leg was finished.
        """
        values = self.stats[:, :, self.gauges.index(gauge), stat]
        with np.errstate(all="ignore"):
            if stat is Stat.LOW:
                found = np.fmin.reduce(values, axis=1)
            elif stat is Stat.HIGH:
                found = np.fmax.reduce(values, axis=1)
            else:
                found = np.nansum(values, axis=1)
        return np.where(np.isnan(values).all(axis=1), np.nan, found)

    def series(self, channel: str) -> Array:
        """Logged channel (N, S)."""
        return self.log[:, :, self.logged.index(channel)]
