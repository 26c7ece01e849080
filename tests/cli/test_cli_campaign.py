"""A campaign can be stopped at any moment, goes on where it was, and repeats only what is broken."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app

COMMAND = [sys.executable, "-m", "towtank"]
PATIENCE = 120.0
"""Seconds that a loaded machine may take for what needs five."""
CRAFT = "spheroid-6-1"

runner = CliRunner()


def _files(study: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in study.glob("runs/*/run.nc")}


@pytest.fixture(scope="module")
def towed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = tmp_path_factory.mktemp("towed") / "study"
    result = runner.invoke(app, ["tow", CRAFT, "--out", str(study)])
    assert result.exit_code == 0, result.stderr
    return study


def test_ctrl_c_keeps_finished_runs_and_the_same_command_resumes(tmp_path: Path):
    study = tmp_path / "study"
    words = [*COMMAND, "tow", CRAFT, "--out", str(study)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + PATIENCE
    while len(_files(study)) < 5 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    kept = _files(study)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert str(study / "runs") in err
    assert "same command resumes" in err

    resumed = subprocess.run([*words, "--json"], capture_output=True, text=True, timeout=PATIENCE, check=False)
    after = _files(study)
    assert resumed.returncode == 0, resumed.stderr
    assert 5 <= len(kept) < len(after) == json.loads(resumed.stdout)["summary"]["runs"]
    assert {path: after[path] for path in kept} == kept
    assert "run again" not in resumed.stderr
    assert not list(study.rglob("*.part"))


@pytest.mark.parametrize("size", [0, 1000], ids=["empty", "truncated"])
def test_a_broken_run_is_made_again_and_told_and_the_others_stay(towed: Path, size: int):
    before = _files(towed)
    victim = sorted(before)[3]
    whole = victim.read_bytes()
    assert len(whole) > size
    victim.write_bytes(whole[:size])
    result = runner.invoke(app, ["tow", "--out", str(towed)])
    after = _files(towed)
    assert result.exit_code == 0, result.stderr
    assert "run again" in result.stderr
    assert str(victim) in result.stderr
    assert victim.stat().st_size > size
    assert {path for path in after if after[path] != before[path]} == {victim}


def test_a_run_that_is_missing_is_made_again_alone(towed: Path):
    before = _files(towed)
    victim = sorted(before)[0]
    victim.unlink()
    assert runner.invoke(app, ["tow", "--out", str(towed)]).exit_code == 0
    after = _files(towed)
    assert set(after) == set(before)
    assert {path for path in after if after[path] != before[path]} == {victim}


def test_asking_again_writes_nothing(towed: Path):
    assert runner.invoke(app, ["tow", "--out", str(towed)]).exit_code == 0
    before = {path: path.stat().st_mtime_ns for path in towed.rglob("*") if path.is_file()}
    result = runner.invoke(app, ["tow", CRAFT, "--out", str(towed)])
    assert result.exit_code == 0
    assert len(re.findall("already done", result.stderr)) == 3
    assert {path: path.stat().st_mtime_ns for path in towed.rglob("*") if path.is_file()} == before


def test_status_says_what_is_done_and_what_changed(towed: Path):
    runner.invoke(app, ["tow", "--out", str(towed)])
    stages = json.loads(runner.invoke(app, ["status", "--out", str(towed), "--json"]).stdout)["summary"]["stages"]
    assert stages["tow"] == "done"
    assert stages["report"] == "not done"
    victim = sorted(_files(towed))[1]
    whole = victim.read_bytes()
    victim.write_bytes(b"")
    stages = json.loads(runner.invoke(app, ["status", "--out", str(towed), "--json"]).stdout)["summary"]["stages"]
    victim.write_bytes(whole)
    assert stages["tow"].startswith("out of date")


def test_an_edited_plan_is_used_and_not_overwritten(towed: Path):
    plan = towed / "plan.toml"
    text = plan.read_text()
    head, *tests = text.split("[[test]]")
    shorter = "[[test]]".join([head, *tests[:4]])
    try:
        plan.write_text(shorter)
        result = runner.invoke(app, ["tow", "--out", str(towed), "--json"])
        assert result.exit_code == 0, result.stderr
        assert json.loads(result.stdout)["summary"]["runs"] == 4
        assert "edited" in result.stderr
        assert plan.read_text() == shorter
    finally:
        plan.write_text(text)


def test_a_broken_ledger_is_no_obstacle(towed: Path):
    before = _files(towed)
    (towed / "study.json").write_text("{")
    result = runner.invoke(app, ["tow", CRAFT, "--out", str(towed)])
    assert result.exit_code == 0, result.stderr
    assert "study.json" in result.stderr
    assert _files(towed) == before


def test_another_craft_does_not_overwrite_the_craft_file_of_a_study(towed: Path):
    own = (towed / "craft.toml").read_text()
    (towed / "craft.toml").write_text(own + "\n# a remark of the user\n")
    try:
        result = runner.invoke(app, ["plan", "remus100", "--out", str(towed)])
        assert result.exit_code == 2
        assert "--out" in result.stderr
        assert (towed / "craft.toml").read_text().endswith("# a remark of the user\n")
    finally:
        (towed / "craft.toml").write_text(own)
