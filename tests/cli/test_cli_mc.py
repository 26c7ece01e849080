"""``towtank mc``: bands, probabilities, the std of the trials; part of the study, resumable."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.cli.chain import open_chain
from towtank.cli.reply import Reply
from towtank.cli.scatter import asked
from towtank.montecarlo import study
from towtank.montecarlo.fly import Piece, Study

runner = CliRunner()
FEW = ["--samples", "15", "--mass", "1 %", "--cg", "2 mm", "--current", "0.02 m/s"]


def answer(*words: str, code: int = 0) -> tuple[dict, str]:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, result.stderr
    return json.loads(result.stdout), result.stderr


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of hokie up to its trials and verdict."""
    folder = tmp_path_factory.mktemp("mc") / "hokie"
    for words in (["plan", "hokie"], ["tow", "hokie"], ["derive", "hokie"], ["trial", "turning-circle", "hokie"]):
        result = runner.invoke(app, [*words, "--out", str(folder)])
        assert result.exit_code == 0, result.stderr
    return folder


@pytest.fixture(scope="module")
def first(flown: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Folder and JSON document after ``towtank mc``."""
    folder = Path(shutil.copytree(flown, tmp_path_factory.mktemp("done") / "hokie"))
    return folder, answer("mc", *FEW, "--out", str(folder))[0]


def test_the_study_holds_document_and_bands(first: tuple[Path, dict]):
    folder, told = first
    document = json.loads((folder / "mc.json").read_text())
    assert document["schema"] == "towtank/mc/1"
    assert (document["samples"], document["done"], document["complete"]) == (15, 15, True)
    assert document["tolerances"] == {"mass": 0.01, "cg": [0.002] * 3, "current": 0.02}
    assert document["provenance"]["version"]
    assert len(document["trials"]) == 14
    assert all((folder / trial["file"]).stat().st_size > 1000 for trial in document["trials"])
    for plane in ("horizontal", "vertical"):
        low, high = told["summary"]["stability"][plane]["interval"]
        assert low <= told["summary"]["stability"][plane]["probability_stable"] <= high
    assert len(told["summary"]["widest"]) == 5


def test_asking_again_flies_nothing_and_says_the_same(first: tuple[Path, dict], monkeypatch: pytest.MonkeyPatch):
    folder, told = first
    stamps = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    monkeypatch.setattr("towtank.montecarlo.study.fly_piece", None)  # anything started would raise
    again, remarks = answer("mc", *FEW, "--out", str(folder))
    assert again["summary"] == told["summary"]
    assert "already done" in remarks
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()} == stamps
    (folder / "mc.json").unlink()  # the pieces are still on file
    assert answer("mc", *FEW, "--out", str(folder))[0]["summary"] == told["summary"]


def test_people_get_probability_and_the_widest_indices(first: tuple[Path, dict]):
    result = runner.invoke(app, ["mc", *FEW, "--out", str(first[0])])
    assert result.exit_code == 0, result.stderr
    assert "15 craft drawn from derivatives, mass 1 %, CG 2 mm, current 0.02 m/s" in result.stdout
    assert "course stable, horizontal plane:" in result.stdout
    assert "Widest indices" in result.stdout


def _circle(folder: Path) -> dict:
    index = json.loads((folder / "trials" / "index.json").read_text())["trials"]
    return next(trial for trial in index if trial["name"] == "turning-15deg")["indices"]


def test_the_trials_get_their_std_and_stay_done(flown: Path, tmp_path: Path):
    folder = Path(shutil.copytree(flown, tmp_path / "hokie"))
    assert all(entry["std"] is None for entry in _circle(folder).values())
    chain = open_chain(Reply("run"), None, folder)
    chain.prepare()
    chain.try_out()
    chain.judge()
    assert runner.invoke(app, ["mc", "--samples", "15", "--out", str(folder)]).exit_code == 0
    stated = json.loads((folder / "mc.json").read_text())["trials"]
    expected = next(trial for trial in stated if trial["name"] == "turning-15deg")["indices"]["advance"]["std"]
    assert _circle(folder)["advance"]["std"] == expected > 0.0
    stages = answer("status", "--out", str(folder))[0]["summary"]["stages"]
    assert [stages[name] for name in ("trials", "mc")] == ["done"] * 2
    assert stages["verdict"].startswith("out of date")  # its probabilities are those of the drawn craft
    # A further trial leaves the std of the others in place, and the chain keeps the craft that were asked for.
    assert runner.invoke(app, ["trial", "zigzag", "--angle", "15 deg", "--out", str(folder)]).exit_code == 0
    assert _circle(folder)["advance"]["std"] == expected
    again = open_chain(Reply("run"), None, folder)
    assert again.done("mc")
    assert asked(again)["samples"] == "15"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--samples", "0"], "whole number from 1"),
        (["--mass", "-1 %"], "zero or more"),
        (["--mass", "1 kg"], "mass tolerance"),
        (["--cg", "5"], "no positive mass matrix"),
        (["--current", "fast"], "current tolerance"),
        (["--seed", "-1"], "seed -1"),
        (["--cluster", "somewhere"], "tcp://host:port"),
        (["--cluster-settings", "nothing.toml"], "Add --cluster slurm"),
    ],
)
def test_a_senseless_study_is_refused(first: tuple[Path, dict], options: list[str], words: str):
    result = runner.invoke(app, ["mc", *options, "--out", str(first[0])])
    assert result.exit_code == 2, result.stderr
    assert words in result.stderr
    assert "Traceback" not in result.stderr


def test_an_unknown_craft_and_a_study_without_derivatives_are_refused(tmp_path: Path):
    result = runner.invoke(app, ["mc", "no-such-craft", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "no-such-craft" in result.stderr
    result = runner.invoke(app, ["mc", "hokie", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "First: towtank derive" in result.stderr


def test_help_has_an_example():
    result = runner.invoke(app, ["mc", "--help"])
    assert "Example: towtank mc hokie --samples 2000" in result.stdout


def test_an_interrupted_study_keeps_its_pieces_and_the_same_command_resumes(
    flown: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    folder = Path(shutil.copytree(flown, tmp_path / "hokie"))
    words = ["mc", "--samples", "12", "--out", str(folder)]
    whole = study.fly_piece

    def stopping(shared: Study, piece: Piece) -> dict:
        if piece.number == 1:
            raise KeyboardInterrupt
        return whole(shared, piece)

    monkeypatch.setattr(study, "monte_carlo", partial(study.monte_carlo, size=4))
    monkeypatch.setattr(study, "fly_piece", stopping)
    result = runner.invoke(app, words)
    assert result.exit_code == 130, result.stderr
    assert "stopped after 1 of 3" in result.stderr
    assert "The same command resumes." in result.stderr
    kept = {path: path.stat().st_mtime_ns for path in (folder / "mc" / "pieces").glob("hokie*.json")}
    assert len(kept) == 1
    assert not (folder / "mc.json").exists()
    monkeypatch.setattr(study, "fly_piece", whole)
    assert runner.invoke(app, words).exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert json.loads((folder / "mc.json").read_text())["done"] == 12


def test_an_interruption_of_the_flights_themselves_keeps_no_half_piece(flown: Path, tmp_path: Path):
    folder = Path(shutil.copytree(flown, tmp_path / "hokie"))
    words = [sys.executable, "-m", "towtank", "mc", "--samples", "4000", "--out", str(folder)]
    begun = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60.0
    while not (folder / "mc" / "pieces" / ".ledger.json").exists():
        assert begun.poll() is None, begun.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(0.5)  # the first of eight pieces is in the air for seconds
    os.killpg(begun.pid, signal.SIGINT)  # what a terminal does
    remarks = begun.communicate(timeout=30)[1]
    assert begun.returncode == 130, remarks
    assert "stopped after 0 of 8" in remarks
    assert not list((folder / "mc" / "pieces").glob("hokie*.json"))
