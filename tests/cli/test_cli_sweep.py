"""``towtank sweep``: a table, a figure, and asking again costs nothing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app

runner = CliRunner()
WORDS = ["sweep", "suboff-x", "--vary", "fin_size=0.9:1.1:2", "--vary", "fin_position=0.9 L,1.2 L", "--members", "0"]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict, str]:
    """Folder, JSON document and remarks of a sweep of four points, two of which cannot be built."""
    folder = tmp_path_factory.mktemp("sweep") / "study"
    result = runner.invoke(app, [*WORDS, "--trials", "zigzag", "--out", str(folder), "--json"])
    assert result.exit_code == 0, result.stderr
    return folder, json.loads(result.stdout), result.stderr


def test_the_study_holds_table_and_figure(first: tuple[Path, dict, str]):
    folder, answer, remarks = first
    document = json.loads((folder / "sweep.json").read_text())
    assert document["schema"] == "towtank/sweep/1"
    assert document["provenance"]["tank"]["members"] == 0
    assert [len(document[key]) for key in ("points", "failed")] == [2, 2]
    assert set(document["points"][0]["values"]) == set(document["columns"])
    assert (folder / "sweep.csv").read_text().count("\n") == 5
    assert (folder / "sweep.png").read_bytes()[:4] == b"\x89PNG"
    assert set(answer["files"]) >= {"sweep", "table", "figure", "craft"}
    assert answer["summary"]["points"] == 4
    assert "behind the tail" in answer["summary"]["failed"][0]["reason"]
    assert "not done: fin_size 0.9, fin_position" in remarks


def test_asking_again_starts_nothing_and_gives_the_same(first: tuple[Path, dict, str], monkeypatch: pytest.MonkeyPatch):
    folder, answer, _ = first
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "sweep").iterdir()}
    monkeypatch.setattr("towtank.sweep.run.work", None)  # anything started would raise
    result = runner.invoke(app, [*WORDS, "--trials", "zigzag", "--out", str(folder), "--json"])
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["summary"] == answer["summary"]
    assert {path: path.stat().st_mtime_ns for path in (folder / "sweep").iterdir()} == stamps


def test_people_get_a_table(first: tuple[Path, dict, str]):
    result = runner.invoke(app, [*WORDS, "--trials", "zigzag", "--out", str(first[0])])
    assert result.exit_code == 0, result.stderr
    assert "4 points, semi-empirical: fin_size, fin_position" in result.stdout
    assert "fin_position [m]" in result.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "nothing to vary"),
        (["--vary", "strakes=1,2"], "Did you mean strake"),
        (["--vary", "fin_size"], "write NAME=VALUES"),
        (["--vary", "fin_angle=30,40"], "bare angle"),
        (["--vary", "cg_x=0", "--vary", "cg_x=1"], "each only once"),
        (["--vary", "cg_x=0", "--trials", "spiral"], "not one of a sweep"),
        (["--vary", "cg_x=0", "--members", "1"], "2 to 1000 members"),
        (["--vary", "cg_x=0", "--cluster", "somewhere"], "tcp://host:port"),
        (["--vary", "cg_x=0", "--cluster-settings", "nothing.toml"], "Add --cluster slurm"),
        (["--vary", "cg_x=0", "--cluster-settings", "nothing.toml", "--cluster", "slurm"], "It is TOML such as"),
    ],
)
def test_a_senseless_sweep_is_refused(options: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(app, ["sweep", "suboff-x", *options])
    assert result.exit_code == 2, result.stderr
    assert words in result.stderr
    assert "Traceback" not in result.stderr


def test_a_sweep_without_any_result_fails_and_says_why(tmp_path: Path):
    result = runner.invoke(app, ["sweep", "suboff-x", "--vary", "fin_position=1.2 L,1.3 L", "--out", str(tmp_path)])
    assert result.exit_code == 3
    assert "none of the 2 points" in result.stderr
    assert len(json.loads((tmp_path / "sweep.json").read_text())["failed"]) == 2


def test_help_has_an_example():
    result = runner.invoke(app, ["sweep", "--help"])
    assert "Example: towtank sweep hokie --vary" in result.stdout


def test_an_interrupted_sweep_keeps_its_points_and_the_same_command_resumes(tmp_path: Path):
    words = [sys.executable, "-m", "towtank", "sweep", "suboff-x", "--vary", "fin_size=0.8:1.2:12", "--members", "0"]
    words += ["--trials", "none", "--out", str(tmp_path)]
    begun = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60.0
    while len(list((tmp_path / "sweep").glob("suboff*.json"))) < 2:
        assert begun.poll() is None, begun.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.02)
    os.killpg(begun.pid, signal.SIGINT)  # what a terminal does: every process of the command gets it
    remarks = begun.communicate(timeout=30)[1]
    assert begun.returncode == 130, remarks
    assert "The same command resumes." in remarks
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "sweep").glob("suboff*.json")}
    assert 2 <= len(kept) < 12
    assert not (tmp_path / "sweep.json").exists()
    subprocess.run(words, check=True, timeout=60, capture_output=True)
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert len(json.loads((tmp_path / "sweep.json").read_text())["points"]) == 12
