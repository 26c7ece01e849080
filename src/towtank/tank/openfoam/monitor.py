"""Watch a solver: what its log says line by line, and whether the load has settled."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from towtank.frames import Array

_TIME = re.compile(r"^Time = (\S+)")
_RESIDUAL = re.compile(r"Solving for (\w+), Initial residual = ([^,\s]+)")
_COURANT = re.compile(r"^Courant Number mean: (\S+) max: (\S+)")
_CLOCK = re.compile(r"^ExecutionTime = (\S+) s")
_ERROR = re.compile(r"FOAM FATAL (IO )?ERROR|FOAM exiting|Foam::sigFpe|\(core dumped\)")
KEPT_LINES = 40
"""Last lines kept for a message; a trace of OpenFOAM is about thirty."""

ABSURD_COURANT = 1e4
"""Judgement: runs held up to 61 and started at 100; one that passes this is on its way to infinity."""

SHARED_SCALE = 0.1
"""Judgement: a moment is judged against at least this share of the largest force times the length, and a force the
other way round, since a load that vanishes by symmetry has no size of its own. On a drifting hull it is near one."""


@dataclass
class Log:
    """What a log has said so far. ``read`` takes it line by line.

    unjudged : steps at the start whose Courant number is that of an impulsive start, and is not counted.
    steps : iterations or time steps ended.   time : the last one named.   cpu [s].   residuals : first one of each
    equation in the last step.   courant : (mean, max) of the last step; ``courant_max`` the largest of all.
    errors : lines that tell of a failure.   converged : SIMPLE met its residuals.
    """

    unjudged: int = 0
    steps: int = 0
    time: float = 0.0
    cpu: float = 0.0
    residuals: dict[str, float] = field(default_factory=dict)
    courant: tuple[float, float] = (0.0, 0.0)
    courant_max: float = 0.0
    errors: list[str] = field(default_factory=list)
    converged: bool = False
    tail: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT_LINES))
    _fresh: set[str] = field(default_factory=set)

    def read(self, line: str) -> bool:
        """Take in a line; true when a step ended with it."""
        line = line.rstrip("\n")
        self.tail.append(line)
        if found := _RESIDUAL.search(line):
            if found[1] not in self._fresh:
                self.residuals[found[1]] = _number(found[2])
                self._fresh.add(found[1])
        elif found := _TIME.match(line):
            self.time = _number(found[1])
            self._fresh.clear()
        elif found := _COURANT.match(line):
            self.courant = (_number(found[1]), _number(found[2]))
            if self.steps >= self.unjudged:
                self.courant_max = max(self.courant_max, self.courant[1])
        elif found := _CLOCK.match(line):
            self.cpu = _number(found[1])
            self.steps += 1
            return True
        elif "SIMPLE solution converged" in line:
            self.converged = True
        elif _ERROR.search(line):
            self.errors.append(line.strip())
        return False

    @property
    def worst(self) -> tuple[str, float]:
        """Equation with the largest residual of the last step, and that residual."""
        if not self.residuals:
            return "", 0.0
        return max(self.residuals.items(), key=lambda item: item[1])

    @property
    def lost(self) -> bool:
        """True when the Courant number tells that nothing of the solution is left, though no trap was sprung."""
        return self.steps > 0 and not self.courant[1] < ABSURD_COURANT

    @property
    def broken_file(self) -> bool:
        """True when the solver could not read what it was to start from."""
        return any("IO ERROR" in line for line in self.errors) or any("cannot find file" in line for line in self.tail)

    def note(self, extra: str = "") -> str:
        """A line for the progress display."""
        name, value = self.worst
        words = [f"{name} {value:.1e}"] if name else []
        words += [f"Courant {self.courant[1]:.2g}"] if self.courant[1] else []
        return ", ".join([*words, *([extra] if extra else [])])


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def changes(loads: Array, window: int, length: float) -> Array:
    """Change of the mean load from the first to the last half of the ``window`` at the end, (6,), as a share.

    loads (N, 6) are compared by ``load_scale`` on a hull of ``length`` [m]. Infinite where the record is shorter than
    the window or not finite.
    """
    half = window // 2
    if len(loads) < 2 * half or not np.isfinite(loads[-2 * half :]).all():
        return np.full(6, np.inf)
    last, before = loads[-half:].mean(axis=0), loads[-2 * half : -half].mean(axis=0)
    return np.asarray(np.abs(last - before) / load_scale(last, length))


def load_scale(mean: Array, length: float) -> Array:
    """What changes of a load (6,) are compared with: one number for forces, one for moments; never zero."""
    force, moment = float(np.abs(mean[:3]).max()), float(np.abs(mean[3:]).max())
    scale = np.repeat([max(force, SHARED_SCALE * moment / length), max(moment, SHARED_SCALE * force * length)], 3)
    return np.where(scale > 0.0, scale, np.inf)


def flat(loads: Array, window: int, length: float, share: float) -> bool:
    """True when the mean load of a steady case has settled: ``changes`` are below ``share`` now and a quarter before.

    Twice, since a mean that turns round passes through no change at all. On SUBOFF at 10 deg with 10 and 71 thousand
    cells the loads were then within 0.03 % of those at residuals of 1e-7.
    """
    return all(float(changes(loads[: len(loads) - back], window, length).max()) < share for back in (0, window // 4))
