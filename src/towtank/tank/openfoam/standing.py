"""How far each run of a campaign is, what it has cost and what is to come. Reads files; runs nothing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from towtank.errors import ArtefactError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.tank.campaign import stored_run
from towtank.tank.failure import failure_of
from towtank.tank.files import run_path
from towtank.tank.identity import run_ids
from towtank.tank.openfoam.case import Case, read_case
from towtank.tank.openfoam.runner import LOCK
from towtank.tank.openfoam.schedule import Pace, cells_of, pace_of
from towtank.tank.openfoam.tank import OpenFoamTank

_TOLD = re.compile(r"^(?:Time = (?P<time>\S+)|ExecutionTime = (?P<cpu>\S+) s)", re.MULTILINE)


@dataclass(frozen=True)
class Standing:
    """One run of a campaign.

    state : done, running, waiting (in the queue of a cluster), failed, stopped (begun, and nobody is at it), to do.
    step, total : iterations or time steps, as many as there are at most; 0 before the case is written.
    cpu [s] : so far.   left [s] : of CPU, estimated.   why : it failed.
    """

    name: str
    id: str
    state: str
    step: int = 0
    total: int = 0
    cpu: float = 0.0
    left: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class Standings:
    """Every run, in the order of the plan, and the pace that the estimates are made with."""

    runs: tuple[Standing, ...]
    pace: Pace

    def names(self, state: str) -> tuple[str, ...]:
        """Runs in a state."""
        return tuple(run.name for run in self.runs if run.state == state)

    @property
    def cpu(self) -> float:
        """CPU so far [s]."""
        return sum(run.cpu for run in self.runs)

    @property
    def left(self) -> float:
        """CPU to come [s]."""
        return sum(run.left for run in self.runs)

    def wall(self, jobs: int) -> float:
        """Time to come [s] with ``jobs`` runs at a time; no run is shorter than itself."""
        return max(self.left / jobs, *(run.left for run in self.runs), 0.0)

    def document(self) -> dict[str, Any]:
        """Plain content."""
        return {
            "runs": [asdict(run) for run in self.runs],
            "cpu_s": self.cpu,
            "cpu_left_s": self.left,
            "pace": asdict(self.pace),
        }


def standings(plan: Plan, tank: OpenFoamTank, out: Path, queue: Mapping[str, str] | None = None) -> Standings:
    """State of every run of ``plan`` in the study folder ``out``.

    queue : identity -> running or waiting, of the tasks that a cluster has.
    """
    pace = pace_of(out)
    pairs = zip(plan.tests, run_ids(plan, tank), strict=True)
    runs = (_standing(plan, test, identity, tank, Path(out), pace, queue or {}) for test, identity in pairs)
    return Standings(tuple(runs), pace)


def _standing(
    plan: Plan, test: CaptiveTest, identity: str, tank: OpenFoamTank, out: Path, pace: Pace, queue: Mapping[str, str]
) -> Standing:
    folder = run_path(out, identity).with_name("case")
    case = _case(folder)
    step, cpu = (0, 0.0) if case is None else spent(case)
    total = 0 if case is None else case.total
    try:
        run = stored_run(test, identity, out)
    except ArtefactError:
        run = None
    if run is not None:
        health = run.provenance.get("health", {})
        return Standing(test.name, identity, "done", step, total, cpu or float(health.get("cpu", 0.0)))
    why = failure_of(out, identity)
    state = queue.get(identity, "")
    if not state:
        state = "running" if held(folder / LOCK) else "failed" if why else "stopped" if step else "to do"
    cells = cells_of(plan.craft, test, tank.mesh_settings) if case is None else case.cells
    whole = pace.cpu(cells, tank.solution, test)
    expected = min(pace.iterations, total) if case is None or case.steady else total
    left = whole * max(0.0, 1.0 - step / expected) if step else whole
    return Standing(test.name, identity, state, step, total, cpu, left, why if state == "failed" else "")


def _case(folder: Path) -> Case | None:
    try:
        return read_case(folder)
    except ArtefactError:
        return None


def spent(case: Case) -> tuple[int, float]:
    """Last step of a case and CPU seconds of all its starts, from the log of its solver."""
    try:
        text = (case.folder / f"log.{case.application}").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0, 0.0
    time, cpu, before = 0.0, 0.0, 0.0
    for found in _TOLD.finditer(text):
        if found["time"]:
            time = float(found["time"])
            continue
        now = float(found["cpu"])
        if now < before:  # the clock of another start
            cpu += before
        before = now
    return round(time if case.line is None else time / case.line.step), cpu + before


def held(lock: Path) -> bool:
    """True when a process of this machine holds the lock of a case. Looked up, since a try could be in its way."""
    try:
        known = Path("/proc/locks").read_text(encoding="utf-8")
        number = lock.stat().st_ino
    except OSError:
        return False
    return any("FLOCK" in line and f":{number} " in line for line in known.splitlines())
