"""A campaign in OpenFOAM from the command line: real solvers on meshes of four thousand cells."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import towtank.tank.openfoam.find
import towtank.tank.openfoam.tank
from towtank.cli.app import app
from towtank.craft.library import read_craft
from towtank.craft.solid import write_stl
from towtank.errors import TankError
from towtank.report.study import read_study
from towtank.tank.files import read_runs

OFTEN = "import towtank.tank.openfoam.case as case; case.WRITE_EVERY = 20; from towtank.cli import main; main()"
"""The command, whose cases are on file every 20 of their 120 iterations, so that there is time to end it in between."""
CRAFT = "suboff-bare"
ASKED = ["--tank", "openfoam", "--refinement", "0.5", "--only", "drift-00,drift-p02,drift-p04"]
PATIENCE = 120.0
"""Seconds that a loaded machine may take for what needs ten."""

runner = CliRunner()


def _invoke(*words: str) -> Any:
    return runner.invoke(app, list(words))


def _status(study: Path) -> dict[str, Any]:
    result = _invoke("status", "--out", str(study), "--json")
    assert result.exit_code == 0, result.stderr
    found: dict[str, Any] = json.loads(result.stdout)["summary"]["campaign"]
    return found


def _states(study: Path) -> dict[str, str]:
    return {run["name"]: run["state"] for run in _status(study)["runs"]}


def _written(study: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in study.glob("runs/*/run.nc")}


def _solvers(study: Path) -> list[int]:
    """Processes of the solvers that run in the study."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if b"-case" in words and any(os.fsencode(study) in word for word in words):
            found.append(int(path.parent.name))
    return found


def _signalled(processes: list[int], how: signal.Signals) -> list[int]:
    for process in processes:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, how)
    return processes


def _times(study: Path) -> list[Path]:
    """Times on file of cases that are not solved."""
    found = (path for path in study.glob("runs/*/case/[1-9]*") if not (path.parent / "outcome.json").exists())
    return list(found)


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    assert condition()


@pytest.fixture(scope="module")
def towed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = tmp_path_factory.mktemp("towed") / "study"
    result = _invoke("tow", CRAFT, *ASKED, "--jobs", "2", "--out", str(study), "--json")
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)["summary"]
    assert (summary["runs"], summary["levels"]) == (3, ["rans"])
    return study


def test_runs_of_a_campaign_are_of_the_level_rans_and_carry_their_verdict(towed: Path):
    runs = {run.name: run for run in read_runs(towed)}
    assert set(runs) == {"drift-00", "drift-p02", "drift-p04"}
    for run in runs.values():
        assert run.level == "rans"
        assert run.provenance["health"]["cpu"] > 0.0
        # The bow turned to starboard of the path: the side force grows with the angle.
    sides = [abs(runs[name].loads[0, 1]) for name in ("drift-00", "drift-p02", "drift-p04")]
    assert sides[0] < 0.05 * sides[2]
    assert 0.3 * sides[2] < sides[1] < 0.6 * sides[2]


def test_a_sweep_goes_on_from_its_neighbours(towed: Path):
    starts = {}
    for path in towed.glob("runs/*/case/case.json"):
        document = json.loads(path.read_text())
        starts[document["test"]["name"]] = document["start"]
    assert starts["drift-00"] == "uniform"
    assert starts["drift-p04"] == "drift-p02" or starts["drift-p02"] in ("drift-00", "drift-p04")


def test_the_study_keeps_its_tank_and_asking_again_runs_nothing(towed: Path):
    before = _written(towed)
    again = _invoke("tow", "--out", str(towed))
    assert again.exit_code == 0, again.stderr
    assert "tow      already done" in again.stderr
    assert _written(towed) == before
    assert json.loads((towed / "study.json").read_text())["stages"]["tank"]["inputs"]["tank"] == "openfoam"


def test_status_tells_cost_and_state_of_every_run(towed: Path):
    found = _status(towed)
    assert {run["state"] for run in found["runs"]} == {"done"}
    assert found["cpu_s"] > 0.0
    assert found["cpu_left_s"] == found["wall_left_s"] == 0.0
    assert found["pace"]["measured"] == 3
    said = _invoke("status", "--out", str(towed)).stdout
    assert "done     3" in said
    assert "of CPU so far" in said


def test_what_is_to_come_is_told_from_the_pace_of_what_is_done(towed: Path):
    victim = sorted(_written(towed))[0]
    whole, case = victim.read_bytes(), victim.with_name("case")
    aside = case.rename(case.with_name("aside"))
    victim.unlink()
    try:
        found = _status(towed)
        (left,) = [run for run in found["runs"] if run["state"] == "to do"]
        done = [run["cpu"] for run in found["runs"] if run["state"] == "done"]
        # Cells are known within 10 %, iterations within their scatter.
        assert left["left"] == pytest.approx(sum(done) / 2, rel=0.5)
        assert found["wall_left_s"] == left["left"]
    finally:
        victim.write_bytes(whole)
        aside.rename(case)


def test_a_failed_run_is_named_with_its_reason_and_tried_again_alone(towed: Path, monkeypatch: pytest.MonkeyPatch):
    solve = towtank.tank.openfoam.tank.solve
    victims = [path for path in sorted(_written(towed)) if "drift-00" not in str(path)]
    for victim in victims:
        victim.unlink()

    def diverging(case, installation, progress, **options):
        if case.test.name == "drift-p02":
            raise TankError("the solution diverged")
        return solve(case, installation, progress, **options)

    monkeypatch.setattr(towtank.tank.openfoam.tank, "solve", diverging)
    result = _invoke("tow", "--out", str(towed), "--json")
    assert result.exit_code == 3
    assert "drift-p02: the solution diverged" in json.loads(result.stdout)["error"]
    assert _states(towed) == {"drift-00": "done", "drift-p02": "failed", "drift-p04": "done"}
    assert "drift-p02: the solution diverged" in _invoke("status", "--out", str(towed)).stdout
    monkeypatch.undo()
    before = _written(towed)
    assert _invoke("tow", "--out", str(towed)).exit_code == 0
    assert set(_written(towed)) - set(before) == {path for path in victims if "drift-p02" in str(path)}
    assert {path: time for path, time in _written(towed).items() if path in before} == before


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_an_ended_campaign_leaves_no_solver_and_goes_on_from_its_files(tmp_path: Path, how: signal.Signals):
    study = tmp_path / "study"
    asked = [*ASKED[:-1], "drift-00,drift-p02", "--jobs", "2"]
    words = [sys.executable, "-c", OFTEN, "tow", CRAFT, *asked, "--out", str(study)]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    _until(lambda: any(float(path.name) >= 40.0 for path in _times(study)))  # two times on file, so one can be lost
    frozen = _signalled(_solvers(study), signal.SIGSTOP)
    second, states = _invoke("tow", "--out", str(study)), _states(study)
    process.send_signal(how)
    _, told = process.communicate(timeout=PATIENCE)
    _signalled(frozen, signal.SIGCONT)  # not before: a solver that goes on may be at its end before it is told
    _until(lambda: not _solvers(study))
    assert second.exit_code == 3
    assert f"process {process.pid}" in second.stderr
    if how == signal.SIGINT:
        assert process.returncode == 130
        assert "same command resumes" in told
    assert "running" in states.values()
    states = _states(study)
    assert set(states.values()) <= {"stopped", "done", "to do"}
    assert "stopped" in states.values()
    before = _written(study)
    last = max(_times(study), key=lambda path: float(path.name))
    if how == signal.SIGKILL:
        (last / "p").unlink()  # as a full disk leaves it
    result = _invoke("tow", "--out", str(study))
    assert result.exit_code == 0, result.stderr
    assert {path: time for path, time in _written(study).items() if path in before} == before
    if how == signal.SIGKILL:
        outcome = json.loads((last.parent / "outcome.json").read_text())
        assert f"time {last.name} on file could not be read" in outcome["retries"][0]
    outcomes = [json.loads(path.read_text()) for path in study.glob("runs/*/case/outcome.json")]
    assert any(outcome["resumed"] for outcome in outcomes)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--tank", "towing"], "fast, openfoam"),
        (["--quality", "draft"], "--tank openfoam"),
        (["--jobs", "2"], "--tank openfoam"),
        (["--tank", "openfoam", "--jobs", "0"], "at least one"),
        (["--tank", "openfoam", "--quality", "superb"], "draft, standard, fine"),
        (["--tank", "openfoam", "--turbulence", "none"], "kOmegaSST"),
        (["--tank", "openfoam", "--refinement", "0.21"], "after refinement"),
        (["--surface", "hull.stl"], "--tank openfoam"),
        (["--tank", "openfoam", "--surface", "nowhere.stl"], "metres, body axes of the craft"),
        (["--only", "drfit"], "Kinds are drift, sway"),
    ],
)
def test_what_the_tank_cannot_do_is_bad_input_with_the_remedy(tmp_path: Path, words: list[str], told: str):
    result = _invoke("tow", CRAFT, *words, "--out", str(tmp_path / "study"))
    assert result.exit_code == 2, result.stderr
    assert told in result.stderr
    assert not list(tmp_path.glob("study/runs/*"))


def test_a_surface_that_is_another_hull_or_has_to_turn_its_fins_is_refused_before_a_case_is_written(tmp_path: Path):
    study, stl = tmp_path / "study", write_stl(read_craft("suboff-fins"), tmp_path / "fins.stl")
    asked = ["--tank", "openfoam", "--surface", str(stl), "--out", str(study)]
    result = _invoke("tow", "suboff-fins", *asked)
    assert result.exit_code == 2, result.stderr
    assert "turn fins" in result.stderr
    assert "--only drift" in result.stderr
    other = _invoke("tow", "hokie", *asked[:-1], str(tmp_path / "hokie"), "--only", "drift")
    assert other.exit_code == 2, other.stderr
    assert "is not where craft" in other.stderr
    assert not list(tmp_path.glob("*/runs/*/case"))


def test_without_openfoam_the_remedy_is_told_and_no_run_is_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(towtank.tank.openfoam.find, "find", lambda environ=None: None)
    result = _invoke("tow", CRAFT, *ASKED, "--out", str(tmp_path / "study"))
    assert result.exit_code == 3
    assert "apt-get install" in result.stderr
    assert not list(tmp_path.glob("study/runs/*"))


def test_the_report_of_a_campaign_does_not_show_runs_of_another_tank(tmp_path: Path, towed: Path):
    study = tmp_path / "study"
    shutil.copytree(towed, study)
    assert _invoke("tow", "--tank", "fast", "--only", "drift", "--out", str(study)).exit_code == 0
    assert {run.level for run in read_study(study).runs} == {"semi-empirical"}
    assert _invoke("tow", *ASKED, "--out", str(study)).exit_code == 0
    runs = read_study(study).runs
    assert ({run.level for run in runs}, len(runs)) == ({"rans"}, 3)


def test_only_some_tests_of_the_fast_tank_and_all_of_them_again(tmp_path: Path):
    study = str(tmp_path / "study")
    few = _invoke("tow", "spheroid-6-1", "--only", "sway,drift-p1*", "--out", study, "--json")
    assert few.exit_code == 0, few.stderr
    kinds = {run.kind for run in read_runs(Path(study))}
    assert kinds == {"sway", "drift"}
    everything = _invoke("tow", "--only", "all", "--out", study, "--json")
    number = [json.loads(result.stdout)["summary"]["runs"] for result in (few, everything)]
    assert 0 < number[0] < number[1]
