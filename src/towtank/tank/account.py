"""What a campaign has cost so far, and what is still to come."""

from __future__ import annotations

import time

from towtank.tank.pool import Schedule
from towtank.tank.run import Run


class Account:
    """Told of each run as it ends. Time left follows from the costs of ``schedule`` and the time taken so far."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.cpu = 0.0
        self._started = time.monotonic()
        self._left = schedule.cost([number for chain in schedule.chains for number in chain])
        self._done = 0.0

    def note(self, number: int, run: Run) -> str:
        """Words on the cost after a run; empty where the tank states none, as the fast one."""
        spent = run.provenance.get("health", {}).get("cpu")
        self._done += self.schedule.costs[number]
        self._left -= self.schedule.costs[number]
        if spent is None:
            return ""
        self.cpu += float(spent)
        wall = (time.monotonic() - self._started) * self._left / self._done
        return f", {duration(self.cpu)} of CPU so far, about {duration(wall)} left"


def duration(seconds: float) -> str:
    """Seconds in words: 42 s, 3.5 min, 2.1 h."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
