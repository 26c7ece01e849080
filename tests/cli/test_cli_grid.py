"""``towtank grid``: of a craft in the fast tank, of folders of runs, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.grid.files import read_grid
from towtank.report.build import report_study

runner = CliRunner()
MESHES = ("panels-48x16", "panels-72x24", "panels-96x32")
THREE = ["--resolutions", "0.667,1,1.333"]


def answer(*words: str, code: int = 0) -> dict:
    result = runner.invoke(app, ["grid", *words, "--json"])
    assert result.exit_code == code, result.stderr
    assert "Traceback" not in result.stderr
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Folder and JSON reply of ``towtank grid hokie`` on three meshes."""
    folder = tmp_path_factory.mktemp("grid") / "hokie"
    return folder, answer("hokie", *THREE, "--out", str(folder))


def test_a_craft_is_studied_in_the_fast_tank(studied: tuple[Path, dict]):
    folder, told = studied
    assert told["status"] == "ok"
    document = json.loads((folder / "grid.json").read_text())
    assert document["schema"] == "towtank/grid/1"
    assert {"meshes", "values", "order", "extrapolated", "gci", "verdict"} <= set(
        document["quantities"]["drift-p10 Y steady"]
    )
    assert document["chosen"] == told["summary"]["chosen"]
    assert list(told["summary"]["meshes"]) == list(MESHES)
    assert document["level"] == told["summary"]["level"] == "semi-empirical"
    assert document["provenance"]["version"]
    assert len(list((folder / "grid" / MESHES[0] / "runs").iterdir())) > 8


def test_asking_again_makes_no_run_and_gives_the_same(studied: tuple[Path, dict]):
    folder, told = studied
    before = {path: path.stat().st_mtime_ns for path in folder.glob("grid/*/runs/*/run.nc")}
    again = answer(*THREE, "--out", str(folder))
    assert {path: path.stat().st_mtime_ns for path in folder.glob("grid/*/runs/*/run.nc")} == before
    assert again["summary"] == told["summary"]


def test_folders_of_runs_give_what_the_craft_gives_in_any_order(studied: tuple[Path, dict], tmp_path: Path):
    folder, told = studied
    places = [str(folder / "grid" / mesh) for mesh in reversed(MESHES)]
    assert answer(*places, "--out", str(tmp_path))["summary"] == told["summary"]
    here, there = read_grid(folder / "grid.json"), read_grid(tmp_path / "grid.json")
    assert {q.name: q.values for q in here.quantities} == {q.name: q.values for q in there.quantities}


def test_a_looser_target_takes_a_coarser_mesh(studied: tuple[Path, dict], tmp_path: Path):
    folder, _ = studied
    places = [str(folder / "grid" / mesh) for mesh in MESHES]
    loose = answer(*places, "--target", "20 %", "--out", str(tmp_path))["summary"]
    assert (loose["chosen"], loose["met"]) == (MESHES[0], True)


def test_the_report_of_the_study_holds_the_mesh_study(studied: tuple[Path, dict], tmp_path: Path):
    folder, told = studied
    page = report_study(folder, tmp_path / "report.html").read_text()
    assert "Mesh study" in page
    assert told["summary"]["words"].partition(".")[0] in page
    assert "drift-p10 Y steady" in page


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["nothing"], "no craft"),
        (["hokie", "--target", "3"], "0.02 asks for 2 %"),
        (["hokie", "--target", "many"], "--target"),
        (["hokie", "--resolutions", "1,b,2"], "with commas"),
        (["hokie", "--resolutions", "1,2"], "3 different"),
        (["hokie", "--resolutions", "0.667,0.6667,1"], "multiples of 1/3"),
        (["hokie", "--resolutions", "1,2,9"], "resolution 9"),
    ],
)
def test_a_bad_study_of_a_craft_writes_nothing(words: list[str], named: str, tmp_path: Path):
    told = answer(*words, "--out", str(tmp_path / "study"), code=2)
    assert told["status"] == "failed"
    assert named in told["error"]
    assert not (tmp_path / "study").exists()


def test_folders_that_do_not_fit_are_refused(studied: tuple[Path, dict], tmp_path: Path):
    folder, _ = studied
    a, b, c = (str(folder / "grid" / mesh) for mesh in MESHES)
    (tmp_path / "empty").mkdir()
    for words, named in (
        ([a, b], "2 sets"),
        ([a, a, b], "two meshes"),
        ([a, b, str(tmp_path / "empty")], "holds no runs"),
        ([a, b, c, "--resolutions", "1,2,3"], "for runs to be made"),
        ([a, b, c, "--tank", "openfoam"], "--tank is for runs to be made"),
    ):
        told = answer(*words, "--out", str(tmp_path / "study"), code=2)
        assert named in told["error"]
    assert not (tmp_path / "study").exists()
