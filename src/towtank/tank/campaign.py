"""Run a plan in a tank. Files are the state: what is whole is read, what is missing or broken is run."""

from __future__ import annotations

import contextlib
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from towtank.errors import ArtefactError, TankError, TowtankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.limits import enforce_plan
from towtank.progress import Progress, Silent
from towtank.tank.account import Account
from towtank.tank.failure import forget_failure, note_failure
from towtank.tank.files import read_run, run_path, write_run
from towtank.tank.identity import run_ids
from towtank.tank.lock import alone
from towtank.tank.pool import as_ended, in_turn
from towtank.tank.run import Run
from towtank.tank.tank import Tank

TASK = "tow"


@dataclass(frozen=True)
class CampaignStatus:
    """Names of the tests of a plan that are done, still to do, and whose file is broken (to be run again)."""

    done: tuple[str, ...]
    to_do: tuple[str, ...]
    broken: tuple[str, ...]


def tow(
    plan: Plan,
    tank: Tank | None = None,
    out: Path | str | None = None,
    progress: Progress | None = None,
    *,
    jobs: int = 1,
) -> tuple[Run, ...]:
    """Run every captive test of ``plan``.

    Parameters
    ----------
    plan : checked against ``plan.limits`` before any test is run.
    tank : the fast tank by default.
    out : study folder. Each run is written to ``runs/<id>/run.nc`` as it ends; a whole file is read and not repeated,
        a broken one is run again. Without it nothing is written.
    progress : told of each test.
    jobs : runs under way at a time. More than one is for tanks whose work is done by other programs.

    Returns
    -------
    One Run for each test, in the plan's order.

    Raises
    ------
    PlanError
        A test is too violent and not exploratory.
    ArtefactError
        The study folder cannot be written, or is full. The runs under way end.
    TankError
        Tests failed, another campaign has the folder, or this one was interrupted. A test that fails leaves the
        others to go on; the message names each with its reason, and ``runs/<id>/failed.json`` keeps it. Finished runs
        stay whole; the same call goes on from there and tries again what failed.
    """
    enforce_plan(plan)
    chosen = _fast_tank() if tank is None else tank
    told: Progress = Silent() if progress is None else progress
    folder = None if out is None else _writable(Path(out))
    with contextlib.nullcontext() if folder is None else alone(folder):
        return _Campaign(plan, _placed(chosen, folder), folder, told, jobs).done()


def tow_one(plan: Plan, identity: str, tank: Tank, out: Path, progress: Progress | None = None) -> Run:
    """The run ``identity`` of ``plan`` alone, from its file or from the tank: one task of a cluster.

    It takes no lock of the campaign, whose other tasks run beside it. Why it failed is written as in ``tow``.

    Raises
    ------
    TankError
        It failed, or the plan in this tank has no such run: the installation differs from that of the campaign.
    """
    forget_failure(out, identity)
    name = identity
    try:
        known = dict(zip(run_ids(plan, tank), plan.tests, strict=True))
        if identity not in known:
            raise TankError(
                f"{out} has no run {identity} here. Its plan was changed since, or this machine has another version of "
                "the solver or of towtank than the one that asked. Ask again from a machine with the same."
            )
        name = known[identity].name
        with contextlib.suppress(ArtefactError):
            if (stored := stored_run(known[identity], identity, out)) is not None:
                return stored
        run = _placed(tank, out).run(plan.craft, known[identity], Silent() if progress is None else progress)
        write_run(replace(run, id=identity), run_path(out, identity))
    except TowtankError as error:
        note_failure(out, identity, name, error)
        raise
    return replace(run, id=identity)


class _Campaign:
    """The runs of one call of ``tow``."""

    def __init__(self, plan: Plan, tank: Tank, folder: Path | None, told: Progress, jobs: int) -> None:
        self.plan, self.folder, self.told, self.jobs = plan, folder, told, jobs
        self.ids = run_ids(plan, tank)
        self.stop = threading.Event()
        ended_by = getattr(tank, "ended_by", None)
        self.tank: Tank = tank if ended_by is None else ended_by(self.stop)
        self.runs: dict[int, Run] = {}
        self.failed: dict[int, str] = {}

    def done(self) -> tuple[Run, ...]:
        """Every run, in the order of the plan."""
        self.told.start(TASK, len(self.plan.tests))
        try:
            self._tow(self._missing())
        except KeyboardInterrupt:
            raise TankError(_interruption(len(self.runs), len(self.plan.tests), self.folder)) from None
        finally:
            self.told.done(TASK)
        if self.failed:
            raise TankError(self._failures())
        return tuple(self.runs[number] for number in range(len(self.plan.tests)))

    def _missing(self) -> dict[int, str]:
        """Numbers of the tests to be run, each with a remark; the others are taken from their files."""
        remarks: dict[int, str] = {}
        for number, (test, identity) in enumerate(zip(self.plan.tests, self.ids, strict=True)):
            try:
                stored = None if self.folder is None else stored_run(test, identity, self.folder)
            except ArtefactError as error:
                stored, remarks[number] = None, f"{test.name}: run again, {error}"
            if stored is None:
                remarks.setdefault(number, test.name)
                continue
            self.runs[number] = stored
            self.told.step(TASK, f"{test.name}: on file")
        return remarks

    def _tow(self, remarks: Mapping[int, str]) -> None:
        tests, craft = self.plan.tests, self.plan.craft
        schedule = getattr(self.tank, "schedule", None)
        order = in_turn(len(tests)) if schedule is None else schedule(craft, tests)
        account = Account(order.only(list(remarks)))
        for number, answer in as_ended(self._attempt, account.schedule, self.jobs, self.stop):
            name, identity = tests[number].name, self.ids[number]
            if isinstance(answer, TowtankError):
                self._fail(number, answer)
                self.told.step(TASK, f"{name}: failed, {answer}")
                continue
            run = replace(answer, id=identity)
            if self.folder is not None:
                write_run(run, run_path(self.folder, identity))
                forget_failure(self.folder, identity)
            self.runs[number] = run
            head, _, tail = remarks[number].partition(":")
            self.told.step(TASK, f"{head}{account.note(number, run)}" + (f":{tail}" if tail else ""))

    def _attempt(self, number: int) -> Run | TowtankError:
        """The run of a test, or why there is none. What no other test would survive is raised."""
        try:
            return self.tank.run(self.plan.craft, self.plan.tests[number], self.told)
        except ArtefactError:
            raise
        except TowtankError as error:
            return error

    def _fail(self, number: int, error: TowtankError) -> None:
        if self.folder is None:
            raise error
        self.failed[number] = str(error)
        note_failure(self.folder, self.ids[number], self.plan.tests[number].name, error)

    def _failures(self) -> str:
        lines = [f"  {self.plan.tests[number].name}: {why}" for number, why in sorted(self.failed.items())]
        head = f"{len(self.failed)} of {len(self.plan.tests)} runs failed; the others are whole in {self.folder}/runs."
        return "\n".join([f"{head} Ask again to try these alone.", *lines])


def status(plan: Plan, tank: Tank | None = None, out: Path | str = ".") -> CampaignStatus:
    """Which tests of ``plan`` are done in the study folder ``out``. Reads every file; runs nothing."""
    found: dict[str, list[str]] = {"done": [], "to_do": [], "broken": []}
    for test, identity in zip(plan.tests, run_ids(plan, _fast_tank() if tank is None else tank), strict=True):
        try:
            state = "to_do" if stored_run(test, identity, Path(out)) is None else "done"
        except ArtefactError:
            state = "broken"
        found[state].append(test.name)
    return CampaignStatus(**{state: tuple(names) for state, names in found.items()})


def _fast_tank() -> Tank:
    from towtank.tank.fast.tank import FastTank

    return FastTank()


def _placed(tank: Tank, folder: Path | None) -> Tank:
    """The tank with its own files, such as cases, below the study folder; most tanks have none."""
    below = getattr(tank, "below", None)
    placed: Tank = tank if folder is None or below is None else below(folder)
    return placed


def _writable(folder: Path) -> Path:
    """``folder`` itself, after its ``runs`` was made and found fit to be written: known before a solver is started."""
    runs = folder / "runs"
    try:
        runs.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=runs):
            return folder
    except OSError as error:
        raise ArtefactError(
            f"cannot write {runs}: {error.strerror or error}. Choose a folder you may write to with --out DIR."
        ) from error


def stored_run(test: CaptiveTest, identity: str, folder: Path) -> Run | None:
    """The whole run on file, or None when there is no file.

    Raises
    ------
    ArtefactError
        The file is broken, or is that of another run.
    """
    path = run_path(folder, identity)
    if not path.exists():
        return None
    run = read_run(path)
    if run.id != identity:
        raise ArtefactError(f"{path} holds run {run.id}. Files of runs carry their own id; do not rename them.")
    return replace(run, exploratory=test.exploratory)


def _interruption(done: int, total: int, folder: Path | None) -> str:
    if folder is None:
        return f"interrupted after {done} of {total} runs. Nothing was on file: give out=DIR to keep finished runs."
    return (
        f"interrupted after {done} of {total} runs. They are whole in {folder / 'runs'}; ask again to go on from there."
    )
