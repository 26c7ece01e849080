"""A campaign as job arrays of Slurm: one run to a task, in a script that can be read and kept.

State is files, and what Slurm says of its queue: a job carries the name of its array, and a line of the array's
``runs.txt`` is the run of a task. Nothing else is remembered, so there is nothing to get out of step.
"""

from __future__ import annotations

import getpass
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from towtank.artefact import write_text
from towtank.errors import InputError, TankError
from towtank.provenance import digest
from towtank.tank.openfoam.case import TEMPLATES

FOLDER = "slurm"
"""In the study folder: ``<number>/array.sh``, ``runs.txt`` and ``task-<n>.log`` of each array."""

TIMEOUT = 60.0
"""Seconds that a command of Slurm may take: a busy controller answers late."""

WAITING = ("PENDING", "CONFIGURING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "SPECIAL_EXIT", "SUSPENDED")
ENDED = (
    "COMPLETED",
    "CANCELLED",
    "FAILED",
    "TIMEOUT",
    "NODE_FAIL",
    "BOOT_FAIL",
    "DEADLINE",
    "OUT_OF_MEMORY",
    "PREEMPTED",
)
"""States of a task that is not under way; every other one counts as running."""

_TIME = re.compile(r"\d+(:\d\d){0,2}|\d+-\d+(:\d\d){0,2}")


@dataclass(frozen=True)
class SlurmSettings:
    """What a cluster has to be told, as in the settings file; empty means the cluster's own.

    partition, account, memory : options of sbatch, as text.   time : limit of one run, such as "04:00:00".
    cpus : of one run.   at_once : most tasks at a time, 0 for no limit.   modules : loaded before a run.
    options : further options of sbatch, such as "--qos=long".   lines : of shell before a run.
    """

    partition: str = ""
    account: str = ""
    time: str = ""
    memory: str = ""
    cpus: int = 1
    at_once: int = 0
    modules: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    lines: tuple[str, ...] = ()


def read_settings(path: Path) -> SlurmSettings:
    """Settings of a cluster from a TOML file.

    Raises
    ------
    InputError
        The file is not there or not TOML, a key is unknown, or a value is not of its kind.
    """
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"--slurm {path}: {error.strerror or error}. Name a TOML file with the settings.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"--slurm {path} is not TOML: {error}.") from None
    known = {item.name: type(item.default) for item in fields(SlurmSettings)}
    if stray := [key for key in document if key not in known]:
        raise InputError(f"{path}: {stray[0]} is not a setting. Settings are {', '.join(known)}.")
    return SlurmSettings(**{key: _value(path, key, value, known[key]) for key, value in document.items()})


def _value(path: Path, key: str, value: Any, kind: type) -> Any:
    if kind is tuple:
        if not isinstance(value, list) or not all(isinstance(item, str) and "\n" not in item for item in value):
            raise InputError(f'{path}: {key} is a list of texts of one line, such as {key} = ["..."].')
        return tuple(value)
    if kind is int:
        least = 1 if key == "cpus" else 0
        if not isinstance(value, int) or isinstance(value, bool) or value < least:
            raise InputError(f"{path}: {key} = {value!r} has to be a whole number, {least} or more.")
        return value
    if not isinstance(value, str) or not re.fullmatch(r"[\w.,:+-]*", value):
        raise InputError(f'{path}: {key} = {value!r} has to be a word in quotes, such as {key} = "...".')
    if key == "time" and value and not _TIME.fullmatch(value):
        raise InputError(f'{path}: time = "{value}" is not one that Slurm reads. Write "hh:mm:ss" or "days-hh:mm:ss".')
    return value


@dataclass(frozen=True)
class Task:
    """One task of Slurm. job : number of its array.   index : in it.   state : in Slurm's words.   log : of it."""

    run: str
    job: str
    index: int
    state: str
    log: Path

    @property
    def waiting(self) -> bool:
        """True when it is not under way yet."""
        return self.state in WAITING


def script(settings: SlurmSettings, study: Path, craft: str, number: int, tasks: int, python: str) -> str:
    """Text of the array ``number`` of ``tasks`` runs, whose ``runs.txt`` lies beside it."""
    import jinja2

    engine = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES / "slurm"), undefined=jinja2.StrictUndefined, trim_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    named = {"partition": "partition", "account": "account", "time": "time", "memory": "mem"}
    folder = array_folder(study, number)
    if any(sign in str(folder) for sign in "%\\\n"):
        raise InputError(f"{folder}: Slurm reads % and \\ in the name of a log in its own way. Choose another folder.")
    return engine.get_template("array.sh").render(
        craft=craft,
        name=job_name(study, number),
        tasks=tasks,
        at_once=settings.at_once,
        cpus=settings.cpus,
        folder=_quoted(folder),
        runs=shlex.quote(str(folder / "runs.txt")),
        study=shlex.quote(str(study.resolve())),
        options=[(option, getattr(settings, key)) for key, option in named.items() if getattr(settings, key)],
        extra=settings.options,
        modules=settings.modules,
        lines=settings.lines,
        python=shlex.quote(python),
    )


def _quoted(folder: Path) -> str:
    """A folder as sbatch reads it on a line of its own options."""
    return f'"{folder}"' if " " in str(folder) else str(folder)


def array_folder(study: Path, number: int) -> Path:
    """Folder of an array."""
    return study.resolve() / FOLDER / f"{number:03d}"


def job_name(study: Path, number: int) -> str:
    """Name of an array in Slurm: by it a job is known to be of this study."""
    return f"towtank-{digest(str(study.resolve()))}-{number:03d}"


def submit(study: Path, craft: str, runs: Sequence[str], settings: SlurmSettings, python: str = sys.executable) -> int:
    """Submit one array with a task for each of ``runs``; its number.

    Raises
    ------
    InputError
        There is no Slurm here.
    TankError
        Slurm refuses the job.
    """
    made = [int(path.name) for path in (study / FOLDER).glob("[0-9]*") if path.name.isdigit()]
    number = max(made, default=0) + 1
    folder = array_folder(study, number)
    text = script(settings, study, craft, number, len(runs), python)
    write_text(folder / "runs.txt", "".join(f"{run}\n" for run in runs))
    path = write_text(folder / "array.sh", text)
    code, _, why = slurm("sbatch", "--parsable", str(path))
    if code:
        shutil.rmtree(folder)
        raise TankError(f"sbatch refuses the job: {why}. Correct the settings, or ask the keeper of the cluster.")
    return number


def tasks(study: Path) -> dict[str, Task]:
    """Run -> its task, of all that Slurm has in its queue.

    Raises
    ------
    TankError
        Slurm does not answer.
    """
    code, said, why = slurm("squeue", "--noheader", "--array", "--user", getpass.getuser(), "--format", "%F|%K|%T|%j")
    if code:
        raise TankError(f"squeue does not answer: {why}. Jobs go on without it; ask again later.")
    found: dict[str, Task] = {}
    lists: dict[int, list[str]] = {}
    for line in said.splitlines():
        job, index, state, name = line.strip().split("|", 3)
        number = _number(study, name)
        if number is None or not index.isdigit() or state in ENDED:
            continue
        if number not in lists:
            lists[number] = _runs_of(study, number)
        if 0 < int(index) <= len(lists[number]):
            run = lists[number][int(index) - 1]
            log = array_folder(study, number) / f"task-{index}.log"
            found[run] = Task(run, job, int(index), state, log)
    return found


def _number(study: Path, name: str) -> int | None:
    head, _, tail = name.rpartition("-")
    return int(tail) if tail.isdigit() and name == job_name(study, int(tail)) and head else None


def _runs_of(study: Path, number: int) -> list[str]:
    try:
        return (array_folder(study, number) / "runs.txt").read_text(encoding="utf-8").split()
    except OSError:
        return []


def cancel(study: Path) -> tuple[Task, ...]:
    """Cancel every task of the study; those that were in the queue."""
    found = tuple(tasks(study).values())
    if found:
        code, _, why = slurm("scancel", *sorted({task.job for task in found}))
        if code:
            raise TankError(f"scancel failed: {why}. Ask again.")
    return found


def queue(study: Path) -> Mapping[str, str]:
    """Run -> running or waiting; empty where no array was ever submitted."""
    if not (study / FOLDER).is_dir() or shutil.which("squeue") is None:
        return {}
    return {run: "waiting" if task.waiting else "running" for run, task in tasks(study).items()}


def slurm(*words: str) -> tuple[int, str, str]:
    """Exit code, output and errors of a command of Slurm."""
    if shutil.which(words[0]) is None:
        raise InputError(f"there is no {words[0]} here. Ask again on a machine that submits to Slurm.")
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return 1, "", f"no answer within {TIMEOUT:.0f} s"
    return done.returncode, done.stdout, " ".join(done.stderr.split())
