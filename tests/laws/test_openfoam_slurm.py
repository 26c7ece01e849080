"""A campaign as job arrays: nothing lost, nothing done twice, and every task that ends without a run is named."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.craft.library import read_craft
from towtank.errors import InputError, TankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift
from towtank.progress import Silent
from towtank.tank.campaign import status, tow, tow_one
from towtank.tank.identity import run_ids
from towtank.tank.lpm import LpmTank
from towtank.tank.openfoam import slurm as module
from towtank.tank.openfoam.follow import follow
from towtank.tank.openfoam.slurm import SlurmSettings, cancel, queue, read_settings, script, tasks

PLAN = Plan(read_craft("hokie"), 1.0, tuple(CaptiveTest(f"drift-{i}", 1.0, Drift(1.0, 0.02 * i)) for i in range(5)))
NAMES = tuple(test.name for test in PLAN.tests)
TANK = LpmTank({"Yuv": -300.0})
IDS = run_ids(PLAN, TANK)
SETTINGS = SlurmSettings(partition="short", account="hydro", time="01:00:00", memory="2G", cpus=4)
PATIENCE = 120.0
"""Seconds that a loaded machine may take for what needs ten."""

runner = CliRunner()


class Cluster:
    """Stands in for Slurm's commands: each look at the queue ends one task by ``ends``, which may do nothing."""

    def __init__(self, study: Path, ends: Callable[[str], None]) -> None:
        self.study, self.ends = study, ends
        self.queue: list[tuple[int, int, str, str]] = []
        self.submitted: list[list[str]] = []
        self.answers = True

    def __call__(self, *words: str) -> tuple[int, str, str]:
        if words[0] == "sbatch":
            text = Path(words[-1]).read_text()
            name = re.search(r"--job-name=(\S+)", text)[1]  # type: ignore[index]
            runs = Path(words[-1]).with_name("runs.txt").read_text().split()
            self.submitted.append(runs)
            job = len(self.submitted)
            self.queue += [(job, index + 1, run, name) for index, run in enumerate(runs)]
            return 0, f"{job}\n", ""
        if not self.answers:
            return 1, "", "controller is away"
        if words[0] == "scancel":
            self.queue = [task for task in self.queue if str(task[0]) not in words]
            return 0, "", ""
        states = ["RUNNING", *["PENDING"] * len(self.queue)]
        rows = [
            f"{job}|{index}|{state}|{name}" for (job, index, _, name), state in zip(self.queue, states, strict=False)
        ]
        if self.queue:
            self.ends(self.queue.pop(0)[2])
        return 0, "\n".join(["77|1|RUNNING|somebody-else-001", *rows]), ""


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    made = Cluster(tmp_path, lambda run: tow_one(PLAN, run, TANK, tmp_path))
    monkeypatch.setattr(module, "slurm", made)
    return made


def _follow(study: Path) -> tuple[int, ...]:
    return follow(PLAN, TANK, study, SETTINGS, Silent(), poll=0.0)


def test_every_run_is_a_task_and_asking_again_submits_nothing(tmp_path, cluster):
    assert _follow(tmp_path) == (1,)
    assert cluster.submitted == [list(IDS)]
    assert status(PLAN, TANK, tmp_path).done == NAMES
    assert _follow(tmp_path) == ()
    assert len(cluster.submitted) == 1
    assert [run.id for run in tow(PLAN, TANK, tmp_path)] == list(IDS)


def test_a_task_that_vanishes_is_named_with_the_end_of_its_log_and_alone_submitted_again(tmp_path, cluster):
    work = cluster.ends

    def killed(run: str) -> None:
        if run == IDS[2]:
            (tmp_path / "slurm" / "001" / "task-3.log").write_text("...\nCANCELLED DUE TO TIME LIMIT\n")
            return
        work(run)

    cluster.ends = killed
    with pytest.raises(TankError, match=r"1 of 5 runs failed(.|\n)*drift-2: task 3 of job 1 .*DUE TO TIME LIMIT"):
        _follow(tmp_path)
    assert set(status(PLAN, TANK, tmp_path).done) == set(NAMES) - {"drift-2"}
    cluster.ends = work
    _follow(tmp_path)
    assert cluster.submitted[1:] == [[IDS[2]]]
    assert not list(tmp_path.rglob("failed.json"))


def test_a_task_that_fails_is_told_with_its_own_reason(tmp_path, cluster):
    def diverges(run: str) -> None:
        with pytest.raises(TankError):
            tow_one(PLAN, run, Diverging(TANK.values), tmp_path)

    cluster.ends = diverges
    with pytest.raises(TankError, match=r"5 of 5 runs failed(.|\n)*drift-4: the solution diverged"):
        _follow(tmp_path)


class Diverging(LpmTank):
    def run(self, craft, test, progress):
        raise TankError("the solution diverged")


Diverging.__name__ = "LpmTank"  # the same identity of its runs


def test_after_an_interruption_the_jobs_go_on_and_are_followed_and_not_submitted_again(tmp_path, cluster):
    work = cluster.ends
    cluster.ends = _interrupt
    with pytest.raises(TankError, match="go on in Slurm"):
        _follow(tmp_path)
    assert len(queue_of(cluster)) == len(NAMES) - 1
    cluster.queue.insert(0, (1, 1, IDS[0], module.job_name(tmp_path, 1)))
    cluster.ends = work
    assert _follow(tmp_path) == ()
    assert len(cluster.submitted) == 1


def _interrupt(run: str) -> None:
    raise KeyboardInterrupt


def queue_of(cluster: Cluster) -> list[str]:
    return [task[2] for task in cluster.queue]


def test_tasks_are_known_by_name_and_cancelled(tmp_path, cluster):
    cluster.ends = _interrupt
    with pytest.raises(TankError):
        _follow(tmp_path)
    cluster.ends = lambda run: None
    found = tasks(tmp_path)
    assert set(found) == set(IDS[1:])
    assert {task.state for task in found.values()} == {"RUNNING", "PENDING"}
    assert cancel(tmp_path)
    assert tasks(tmp_path) == {}
    assert cancel(tmp_path) == ()


def test_a_controller_that_is_away_for_a_while_is_waited_for(tmp_path, cluster, monkeypatch):
    away = iter([True, False, False, True, *[True] * 50])
    work = cluster.__call__

    def flaky(*words: str) -> tuple[int, str, str]:
        cluster.answers = words[0] != "squeue" or next(away)
        return work(*words)

    monkeypatch.setattr(module, "slurm", flaky)
    assert _follow(tmp_path) == (1,)
    cluster.queue = [(9, 1, IDS[0], module.job_name(tmp_path, 1))]
    monkeypatch.setattr(module, "slurm", lambda *words: (1, "", "no controller"))
    with pytest.raises(TankError, match="no controller"):
        _follow(tmp_path)


def test_a_refused_job_leaves_no_array_behind(tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(module, "slurm", lambda *words: (int(words[0] == "sbatch"), "", "invalid partition"))
    with pytest.raises(TankError, match="invalid partition"):
        _follow(tmp_path)
    assert list((tmp_path / "slurm").iterdir()) == []


def test_the_script_says_what_the_settings_say_and_is_shell(tmp_path):
    settings = replace(SETTINGS, at_once=2, modules=("openfoam/2312",), options=("--qos=long",), lines=("ulimit -s",))
    study = tmp_path / "a study"
    text = script(settings, study, "hokie", 3, 7, "/opt/python 3/bin/python")
    for line in (
        "#SBATCH --array=1-7%2", "#SBATCH --partition=short", "#SBATCH --account=hydro", "#SBATCH --time=01:00:00",
        "#SBATCH --mem=2G", "#SBATCH --ntasks=4", "#SBATCH --qos=long", "module load openfoam/2312", "ulimit -s",
    ):  # fmt: skip
        assert line in text.splitlines()
    assert "'/opt/python 3/bin/python' -m towtank solve-case" in text
    assert f'--output="{study}/slurm/003"/task-%a.log' in text or f'--output="{study}/slurm/003/task-%a.log"' in text
    assert subprocess.run(["bash", "-n"], input=text, text=True, check=False).returncode == 0
    bare = script(SlurmSettings(), study, "hokie", 1, 1, "python")
    assert not re.search("partition|account|--time|--mem|module", bare)
    # Options end at the first line that is none.
    kept = [line.startswith("#") for line in text.splitlines() if line]
    assert kept == sorted(kept, reverse=True)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('queue = "short"', "Settings are partition"),
        ("cpus = 0", "1 or more"),
        ("cpus = true", "whole number"),
        ("time = 3600", "word in quotes"),
        ('time = "soon"', "hh:mm:ss"),
        ('partition = "a b"', "word in quotes"),
        ('modules = "openfoam"', "list of texts"),
        ('lines = ["a\\nb"]', "one line"),
        ("cpus =", "not TOML"),
    ],
)
def test_settings_that_are_none_are_refused_with_the_remedy(tmp_path, text, told):
    path = tmp_path / "cluster.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_settings(path)
    with pytest.raises(InputError, match=r"Name a TOML file"):
        read_settings(tmp_path / "absent.toml")


def test_without_slurm_and_in_the_fast_tank_the_option_is_refused(tmp_path, monkeypatch):
    (tmp_path / "cluster.toml").write_text('partition = "short"')
    words = ["tow", "spheroid-6-1", "--out", str(tmp_path / "study"), "--slurm", str(tmp_path / "cluster.toml")]
    result = runner.invoke(app, words)
    assert result.exit_code == 2
    assert "--tank openfoam" in result.stderr
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="submits to Slurm"):
        cancel(tmp_path)
    assert queue(tmp_path) == {}


TOW = ["tow", "suboff-bare", "--tank", "openfoam", "--refinement", "0.5", "--only", "drift-00,drift-p02,sway-v0.12-w2"]


@pytest.mark.slurm
def test_a_campaign_on_a_real_slurm_loses_nothing_when_a_task_is_killed(slurm: Path, tmp_path: Path):
    study, settings = tmp_path / "study", tmp_path / "cluster.toml"
    settings.write_text('partition = "short"\ntime = "00:10:00"\nmemory = "500M"\n')
    words = [sys.executable, "-m", "towtank", *TOW, "--out", str(study), "--slurm", str(settings)]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    # The oscillation takes half a minute; a quarter of a period is on file after some seconds.
    _until(lambda: [path for path in study.glob("runs/sway*/case/[0-9]*") if path.name != "0"], process)
    found = tasks(study)
    (victim,) = (task for run, task in found.items() if run.startswith("sway"))
    states = {run["name"]: run["state"] for run in _campaign(study)["runs"]}
    assert states["sway-v0.12-w2"] == "running"
    assert "queue of Slurm" in runner.invoke(app, ["tow", "--out", str(study)]).stderr
    subprocess.run(["scancel", "--signal=KILL", "--full", f"{victim.job}_{victim.index}"], check=True)
    _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3, told
    assert f"sway-v0.12-w2: task {victim.index} of job {victim.job} ended without a word" in told
    runs = {path: path.stat().st_mtime_ns for path in study.glob("runs/*/run.nc")}
    assert sorted(path.parent.name[:5] for path in runs) == ["drift", "drift"]

    again = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert again.returncode == 0, again.stderr
    assert (study / "slurm" / "002" / "runs.txt").read_text().split() == [victim.run]
    assert {path: path.stat().st_mtime_ns for path in runs} == runs
    outcome = json.loads((study / "runs" / victim.run / "case" / "outcome.json").read_text())
    assert outcome["resumed"]
    assert {run["state"] for run in _campaign(study)["runs"]} == {"done"}


@pytest.mark.slurm
def test_cancelled_runs_leave_the_queue_and_their_solvers_end(slurm: Path, tmp_path: Path):
    study, settings = tmp_path / "study", tmp_path / "cluster.toml"
    settings.write_text('partition = "short"\ncpus = 1\nat_once = 1\n')
    words = [sys.executable, "-m", "towtank", *TOW, "--out", str(study), "--slurm", str(settings)]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    _until(lambda: list(study.glob("runs/*/case/log.*")), process)
    assert sum(task.waiting for task in tasks(study).values()) >= 1
    result = runner.invoke(app, ["tow", "--out", str(study), "--cancel", "--json"])
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["summary"]["cancelled"]
    _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3, told
    end = time.monotonic() + PATIENCE
    while tasks(study) and time.monotonic() < end:
        time.sleep(0.5)
    assert tasks(study) == {}
    assert "ended without a word" in told


def _campaign(study: Path) -> dict:
    result = runner.invoke(app, ["status", "--out", str(study), "--json"])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)["summary"]["campaign"]


def _until(condition: Callable[[], object], process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.1)
    assert condition(), process.communicate(timeout=PATIENCE)[1] if process.poll() is not None else "too slow"
