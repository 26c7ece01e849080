"""Submit what is missing to Slurm, follow it to its end, and say what came of each task."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from towtank.errors import ArtefactError, TankError
from towtank.plan.kinds import Plan
from towtank.plan.limits import enforce_plan
from towtank.progress import Progress
from towtank.tank.campaign import TASK, stored_run
from towtank.tank.failure import failure_of, forget_failure, note_failure
from towtank.tank.files import run_path
from towtank.tank.identity import run_ids
from towtank.tank.lock import alone
from towtank.tank.openfoam.slurm import SlurmSettings, Task, submit, tasks
from towtank.tank.tank import Tank

POLL = 10.0
"""Seconds between two looks at the queue; clusters ask for no more than that."""

LOOKS = 3
"""Looks at the queue that a task may be missing from before it counts as lost: shared file systems show a file late."""

SILENCE = 30
"""Looks that may fail one after the other, before Slurm counts as gone."""

LAST = 400
"""Characters of the end of a log that a message may hold."""


@dataclass
class _Following:
    """What is known of the runs that are asked for.

    names : run -> test.   seen : its task when it was last in the queue.   absent : looks since then.
    failed : test -> why.
    """

    study: Path
    names: dict[str, str]
    seen: dict[str, Task]
    absent: Counter[str]
    failed: dict[str, str]

    def look(self, told: Progress) -> bool:
        """Look at queue and files once; false when nothing is left to wait for."""
        live = tasks(self.study)
        self.seen |= live
        for run in list(self.names):
            why = "" if run in live else failure_of(self.study, run)
            if run_path(self.study, run).exists():
                told.step(TASK, self.names.pop(run))
            elif why:
                self._fail(run, why, told)
            elif run not in live:
                self.absent[run] += 1
                if self.absent[run] >= LOOKS:
                    self._lose(run, told)
            else:
                self.absent[run] = 0
        return bool(self.names)

    def _fail(self, run: str, why: str, told: Progress) -> None:
        name = self.names.pop(run)
        self.failed[name] = why
        told.step(TASK, f"{name}: failed, {why}")

    def _lose(self, run: str, told: Progress) -> None:
        task = self.seen.get(run)
        where = "its task" if task is None else f"task {task.index} of job {task.job}"
        said = "" if task is None else _end_of(task.log)
        why = (
            f"{where} ended without a word, as when it is cancelled, passes its time limit or its memory, or loses its "
            f"node{said}. Its case stays and goes on from there"
        )
        note_failure(self.study, run, self.names[run], TankError(why))
        self._fail(run, why, told)


def follow(
    plan: Plan, tank: Tank, study: Path, settings: SlurmSettings, progress: Progress, poll: float = POLL
) -> tuple[int, ...]:
    """Have every missing run of ``plan`` made by Slurm; numbers of the arrays that were submitted.

    Runs whose task is in the queue are only waited for. What failed or was lost before is submitted again.

    Raises
    ------
    TankError
        Tasks failed or were lost; each is named with its reason, and the others are whole. Another campaign has the
        folder, Slurm refuses, or does not answer any more. After an interruption the jobs go on.
    """
    enforce_plan(plan)
    (study / "runs").mkdir(parents=True, exist_ok=True)
    with alone(study):
        names = _missing(plan, tank, study)
        live = tasks(study)
        fresh = [run for run in names if run not in live]
        for run in fresh:
            forget_failure(study, run)
        progress.start(TASK, len(plan.tests))
        try:
            number = (submit(study, plan.craft.name, fresh, settings),) if fresh else ()
            for _ in range(len(plan.tests) - len(names)):
                progress.step(TASK)
            failed = _followed(_Following(study, names, live, Counter(), {}), progress, poll)
        except KeyboardInterrupt:
            raise TankError(
                f"stopped looking at {len(names)} runs, which go on in Slurm. Ask again to follow them; --cancel ends "
                "them."
            ) from None
        finally:
            progress.done(TASK)
    if failed:
        lines = [f"  {name}: {why}" for name, why in failed.items()]
        head = f"{len(failed)} of {len(plan.tests)} runs failed; the others are whole in {study}/runs."
        raise TankError("\n".join([f"{head} Ask again to submit these alone.", *lines]))
    return number


def _missing(plan: Plan, tank: Tank, study: Path) -> dict[str, str]:
    """Run -> test of what is not whole on file. A broken file is removed, so that its task does not stop at it."""
    found: dict[str, str] = {}
    for test, run in zip(plan.tests, run_ids(plan, tank), strict=True):
        try:
            stored = stored_run(test, run, study)
        except ArtefactError:
            stored = None
            run_path(study, run).unlink()
        if stored is None:
            found[run] = test.name
    return found


def _followed(following: _Following, told: Progress, poll: float) -> dict[str, str]:
    """Follow to the end; test -> why it failed."""
    silent = 0
    while True:
        try:
            if not following.look(told):
                return following.failed
            silent = 0
        except TankError:
            silent += 1
            if silent >= SILENCE:
                raise
        time.sleep(poll)


def _end_of(log: Path) -> str:
    """The last line of a log, in brackets: Slurm writes there why it ended a task."""
    try:
        lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines()]
    except OSError:
        return ""
    last = next((line for line in reversed(lines) if line), "")
    return f" ({last[-LAST:]})" if last else ""
