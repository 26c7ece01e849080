"""Run a case: one solver, watched line by line, ended when the load is flat, tried again where it fails."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.errors import InputError, TankError
from towtank.progress import Progress
from towtank.symbols import LOADS
from towtank.tank.imported.joining import ordered
from towtank.tank.imported.openfoam import read_forces
from towtank.tank.openfoam.case import MARGIN_OF_TIME, Case
from towtank.tank.openfoam.dictionary import set_entry, times
from towtank.tank.openfoam.find import Installation
from towtank.tank.openfoam.formulation import Arm, load_limit
from towtank.tank.openfoam.measure import keep
from towtank.tank.openfoam.monitor import Log, changes, flat
from towtank.tank.openfoam.retry import next_rung

SCHEMA = "towtank/case-outcome/1"
LOCK = ".lock"
"""In the folder of a case; held while it is run."""

CHECK_EVERY = 10
"""Iterations between two looks at the load; a look takes some milliseconds."""

BROKEN_TIMES = 2
"""Damaged times on file that are dropped in turn; as many as are kept."""

DIVERGED = "diverged"
"""What the log is said to hold when numbers, not the solver, tell of the end."""

PATIENCE = 5.0
"""Seconds a solver is given to end by itself before it is killed."""


@dataclass(frozen=True)
class Outcome:
    """How a solution ended.

    ended : flat, residuals or last step.   steps, cpu [s], wall [s] : of the last start; ``resumed`` tells of others.
    residuals : of the last step.   courant_max : largest, 0 when steady.   change : of the mean load at the end, as a
    share of the largest.   retries : what was changed after a failure, a sentence each.
    """

    ended: str
    steps: int
    cpu: float
    wall: float
    residuals: Mapping[str, float]
    courant_max: float
    change: float
    retries: tuple[str, ...] = ()
    resumed: bool = False


def solve(
    case: Case, installation: Installation, progress: Progress, *, stop: threading.Event | None = None
) -> tuple[Case, Outcome]:
    """Solve ``case`` from where it stands; a solved one is only read.

    Returns the case as it was solved, since a failed one is tried again with smaller steps, and how it ended.

    Raises
    ------
    TankError
        Another process runs it, the solver failed at every try, or ``stop`` was set. What is on file stays; the
        same call goes on from there.
    """
    with _alone(case.folder) as lock:
        done = case.folder / "outcome.json"
        if done.is_file():
            return case, _read_outcome(done)
        retries: tuple[str, ...] = ()
        broken = 0
        while True:
            log, started = _prepared(case, installation), time.monotonic()
            resumed = bool(_written(case))
            code = _watched(case, installation, progress, log, lock, stop)
            if stop is not None and stop.is_set():
                raise TankError(f"{case.folder} was stopped after step {log.time:g}. Ask again to go on from there.")
            if code == 0 and not log.errors:
                break
            if resumed and log.broken_file and broken < BROKEN_TIMES:
                broken += 1
                retries = (*retries, _drop_last(case))
                continue
            changed = next_rung(case) if _diverged(log, code) else None
            if changed is None:
                raise TankError(_failure(case, log, code))
            case, words = changed
            retries = (*retries, words)
        _finish(case, installation)
        outcome = _outcome(case, log, time.monotonic() - started, retries, resumed)
        write_json(done, {"schema": SCHEMA, **asdict(outcome)})
        return case, outcome


def _read_outcome(path: Path) -> Outcome:
    document = {key: value for key, value in read_json(path, SCHEMA).items() if key != "schema"}
    return Outcome(**{**document, "retries": tuple(document["retries"])})


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[int]:
    """Hold the lock of the case; the solver holds it too, so that an orphan is noticed."""
    try:
        handle = (folder / LOCK).open("a")
    except OSError as error:
        raise TankError(
            f"cannot write {folder}: {error.strerror}. Free some space, or choose another folder."
        ) from None
    with handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise TankError(
                f"{folder} is being run by another process, and two solvers in one case destroy it. Wait for it, or "
                "end it and ask again."
            ) from None
        yield handle.fileno()


def _written(case: Case) -> list[Path]:
    """Times on file, of the whole or of the first part of a case that is cut."""
    part = case.folder / "processor0"
    return times(part if part.is_dir() else case.folder)


def _prepared(case: Case, installation: Installation) -> Log:
    """A fresh log, after the cell zones and parts were made that the solver needs."""
    _drop_empty(case.folder / "postProcessing")
    control = case.folder / "system" / "controlDict"
    set_entry(control, "stopAt", "endTime")
    back = time.time() - MARGIN_OF_TIME
    os.utime(control, (back, back))
    if isinstance(case.formulation, Arm) and not (case.folder / "constant" / "polyMesh" / "cellZones").exists():
        _utility(case, installation, "topoSet")
    if case.ranks > 1 and not (case.folder / "processor0").is_dir():
        _utility(case, installation, "decomposePar")
    return Log(unjudged=0 if case.line is None else case.line.lead)


def _drop_empty(place: Path) -> None:
    """Remove files of loads without a row, which a solver leaves that dies before its first step."""
    for path in place.glob("*/*/*.dat"):
        with path.open(encoding="utf-8", errors="replace") as lines:
            empty = all(line.startswith("#") for line in lines)
        if empty:
            path.unlink()


def _utility(case: Case, installation: Installation, name: str, *options: str) -> None:
    program = installation.program(name)
    if program is None:
        raise TankError(f"OpenFOAM in {installation.project} has no {name}. Install the whole package.")
    with (case.folder / f"log.{name}").open("w") as log:
        code = subprocess.run(
            [program, "-case", str(case.folder), *options],
            env=installation.surroundings(),
            stdout=log,
            stderr=subprocess.STDOUT,
            check=False,
        ).returncode
    if code:
        raise TankError(f"{name} failed in {case.folder} with code {code}; log.{name} there says why.")


def _command(case: Case, installation: Installation) -> list[str]:
    """The solver, tied to the life of this process where setpriv can do that, under mpirun on several cores."""
    program = installation.program(case.application)
    if program is None:
        raise TankError(f"OpenFOAM in {installation.project} has no {case.application}. Install the whole package.")
    tie = shutil.which("setpriv")
    command = [tie, "--pdeathsig", "KILL"] if tie else []
    if case.ranks == 1:
        return [*command, program, "-case", str(case.folder)]
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        raise TankError(f"{case.folder} is cut for {case.ranks} cores and there is no mpirun. Install Open MPI.")
    cores = ["--oversubscribe", "-np", str(case.ranks)]
    return [*command, mpirun, *cores, program, "-parallel", "-case", str(case.folder)]


def _watched(
    case: Case,
    installation: Installation,
    progress: Progress,
    log: Log,
    lock: int,
    stop: threading.Event | None,
) -> int:
    """Run the solver to its end and return its code; it never outlives this call."""
    task = f"{case.application} {case.test.name}"
    ended = threading.Event()
    try:
        with (
            (case.folder / f"log.{case.application}").open("a") as out,
            subprocess.Popen(
                _command(case, installation),
                env=installation.surroundings(),
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                start_new_session=True,
                pass_fds=(lock,),
            ) as process,
        ):
            progress.start(task, case.total)
            guard = threading.Thread(target=_end_when_told, args=(process, stop, ended), daemon=True)
            guard.start()
            try:
                _follow(case, process, out, progress, task, log)
                return _code(process.wait())
            finally:
                ended.set()
                _end(process)
                progress.done(task)
    except OSError as error:
        raise TankError(
            f"cannot run {case.folder}: {error.strerror or error}. Free some space; what is on file stays, and the "
            "same call goes on from there."
        ) from error


def _follow(case: Case, process: subprocess.Popen[str], out: IO[str], progress: Progress, task: str, log: Log) -> None:
    assert process.stdout is not None  # a pipe was asked for
    told = False
    for line in process.stdout:
        out.write(line)
        if not log.read(line):
            continue
        progress.step(task, log.note())
        if log.lost or (log.steps % CHECK_EVERY == 0 and _beyond(case)):
            log.errors.append(DIVERGED)
            _end(process)
            return
        if case.steady and not told and log.steps % CHECK_EVERY == 0 and _settled(case):
            set_entry(case.folder / "system" / "controlDict", "stopAt", "writeNow")
            told = True


def _beyond(case: Case) -> bool:
    """True when the last load is one that no solution has."""
    loads = measured(case)
    limit = load_limit(case.test, case.length, case.density)
    return loads is not None and not bool((np.abs(loads[-1, 1:4]) < limit).all())


def _settled(case: Case) -> bool:
    loads = measured(case)
    numerics = case.numerics
    return loads is not None and flat(loads[:, 1:], numerics.window, case.length, numerics.flat)


def measured(case: Case, name: str = "forces") -> Any:
    """Time and loads (N, 7) that a function object has written, None where there are none yet."""
    try:
        table = ordered(read_forces(case.folder / "postProcessing" / name), "time")
    except InputError:
        return None
    return table.values[:, [table.find("time"), *(table.find(load) for load in LOADS)]]


def _end_when_told(process: subprocess.Popen[str], stop: threading.Event | None, ended: threading.Event) -> None:
    while stop is not None and not ended.wait(0.1):
        if stop.is_set():
            _end(process)
            return


def _end(process: subprocess.Popen[str]) -> None:
    """End the solver and all its ranks."""
    with contextlib.suppress(ProcessLookupError):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(PATIENCE)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def _code(returned: int) -> int:
    """Exit code as a shell states it: 128 and the signal for a process that died of one."""
    return 128 - returned if returned < 0 else returned


def _drop_last(case: Case) -> str:
    """Remove the last time on file, which cannot be read."""
    last = _written(case)[-1].name
    for folder in (case.folder, *case.folder.glob("processor*")):
        shutil.rmtree(folder / last, ignore_errors=True)
    return f"time {last} on file could not be read and was dropped"


def _finish(case: Case, installation: Installation) -> None:
    """One set of fields, that of the last time: for restarts, neighbours and pictures."""
    if case.ranks > 1:
        _utility(case, installation, "reconstructPar", "-latestTime")
        for part in case.folder.glob("processor*"):
            shutil.rmtree(part)
    for folder in times(case.folder)[:-1]:
        shutil.rmtree(folder)
    keep(case)
    for name in ("phi", "yPlus", "meshPhi"):
        for extra in case.folder.glob(f"[0-9]*/{name}"):
            extra.unlink()


def _outcome(case: Case, log: Log, wall: float, retries: tuple[str, ...], resumed: bool) -> Outcome:
    loads = measured(case)
    if loads is None:
        raise TankError(f"{case.folder}: the solver ended and wrote no load. Its log says why.")
    change = float(changes(loads[:, 1:], case.numerics.window, case.length).max()) if case.steady else 0.0
    share = case.numerics.flat
    ended = "residuals" if log.converged else "flat" if case.steady and change < share else "last step"
    return Outcome(ended, log.steps, log.cpu, wall, dict(log.residuals), log.courant_max, change, retries, resumed)


def _diverged(log: Log, code: int) -> bool:
    return code == 128 + signal.SIGFPE or any("sigFpe" in line or line == DIVERGED for line in log.errors)


def _failure(case: Case, log: Log, code: int) -> str:
    where = f"{case.folder}: {case.application} ended with code {code} at step {log.time:g}"
    if _diverged(log, code):
        remedy = (
            "Look at the mesh quality first; then try a finer first field, a smaller refinement or smaller relaxation."
            if case.steady
            else "No gentler setting is left; try more steps a period or a smaller amplitude."
        )
        how = (
            "its Courant number or load is beyond any solution"
            if DIVERGED in log.errors
            else "floating-point exception"
        )
        return f"{where}: the solution diverged ({how}). {remedy}"
    if code in (128 + signal.SIGKILL, 128 + signal.SIGTERM):
        return f"{where}: it was killed, as by a full memory. What is on file stays; ask again to go on from there."
    if log.broken_file:
        return f"{where}: a file could not be read: {_reason(log)}. Remove the case folder to have it written again."
    return f"{where}: {_reason(log)}. The log is log.{case.application} there; ask again to go on from what is on file."


def _reason(log: Log) -> str:
    lines = [line.strip() for line in log.tail if line.strip()]
    starts = [i for i, line in enumerate(lines) if "FATAL" in line]
    return " ".join(lines[starts[-1] + 1 : starts[-1] + 4] if starts else lines[-2:]) or "it said nothing"
