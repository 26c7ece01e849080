"""Run a plan in a tank. Files are the state: what is whole is read, what is missing or broken is run."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from towtank.errors import ArtefactError, TankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.limits import enforce_plan
from towtank.progress import Progress, Silent
from towtank.tank.files import read_run, run_path, write_run
from towtank.tank.identity import run_ids
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
    plan: Plan, tank: Tank | None = None, out: Path | str | None = None, progress: Progress | None = None
) -> tuple[Run, ...]:
    """Run every captive test of ``plan``.

    Parameters
    ----------
    plan : checked against ``plan.limits`` before any test is run.
    tank : the fast tank by default.
    out : study folder. Each run is written to ``runs/<id>/run.nc`` as it ends; a whole file is read and not repeated,
        a broken one is run again. Without it nothing is written.
    progress : told of each test.

    Returns
    -------
    One Run for each test, in the plan's order.

    Raises
    ------
    PlanError
        A test is too violent and not exploratory.
    ArtefactError
        The study folder cannot be written.
    TankError
        A test failed, or the campaign was interrupted. Finished runs stay whole; the same call goes on from there.
    """
    enforce_plan(plan)
    chosen = _fast_tank() if tank is None else tank
    told: Progress = Silent() if progress is None else progress
    folder = None if out is None else _writable(Path(out))
    chosen = _placed(chosen, folder)
    runs: list[Run] = []
    told.start(TASK, len(plan.tests))
    try:
        for test, identity in zip(plan.tests, run_ids(plan, chosen), strict=True):
            run, note = _recorded(plan, test, chosen, identity, folder, told)
            runs.append(run)
            told.step(TASK, note)
    except KeyboardInterrupt:
        raise TankError(_interruption(len(runs), len(plan.tests), folder)) from None
    finally:
        told.done(TASK)
    return tuple(runs)


def status(plan: Plan, tank: Tank | None = None, out: Path | str = ".") -> CampaignStatus:
    """Which tests of ``plan`` are done in the study folder ``out``. Reads every file; runs nothing."""
    found: dict[str, list[str]] = {"done": [], "to_do": [], "broken": []}
    for test, identity in zip(plan.tests, run_ids(plan, _fast_tank() if tank is None else tank), strict=True):
        try:
            state = "to_do" if _stored(test, identity, Path(out)) is None else "done"
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


def _recorded(
    plan: Plan, test: CaptiveTest, tank: Tank, identity: str, folder: Path | None, progress: Progress
) -> tuple[Run, str]:
    """The run of one test, from its file or from the tank, and a note on where it came from."""
    note = test.name
    if folder is not None:
        try:
            stored = _stored(test, identity, folder)
        except ArtefactError as error:
            stored, note = None, f"{test.name}: run again, {error}"
        if stored is not None:
            return stored, f"{test.name}: on file"
    run = replace(tank.run(plan.craft, test, progress), id=identity)
    if folder is not None:
        write_run(run, run_path(folder, identity))
    return run, note


def _stored(test: CaptiveTest, identity: str, folder: Path) -> Run | None:
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
