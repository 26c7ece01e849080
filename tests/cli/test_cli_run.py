"""``towtank run``: one command leaves a whole study, and asking again costs nothing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app

runner = CliRunner()
CRAFT = "hokie"
STAGES = ("craft", "plan", "tow", "derive", "trials", "mc", "faults", "verdict", "report")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict, str]:
    """Folder, JSON document and remarks of a first run in an empty folder."""
    folder = tmp_path_factory.mktemp("fresh")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        result = runner.invoke(app, ["run", CRAFT, "--json"])
    assert result.exit_code == 0, result.stderr
    return folder / CRAFT, json.loads(result.stdout), result.stderr


@pytest.fixture
def study(first: tuple[Path, dict, str], tmp_path: Path) -> Path:
    """A copy that a test may spoil."""
    return Path(shutil.copytree(first[0], tmp_path / CRAFT))


def _stamps(study: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in study.rglob("*") if path.is_file()}


def test_the_study_holds_every_file_of_the_contract(first: tuple[Path, dict, str]):
    study, answer, _ = first
    for name in ("craft.toml", f"{CRAFT}.stl", f"{CRAFT}.glb", "plan.toml", "plan.csv", "report.html"):
        assert (study / name).stat().st_size > 100, name
    for name, noun in (
        ("derivatives.json", "derivatives"),
        ("model.json", "model"),
        ("mc.json", "mc"),
        ("verdict.json", "verdict"),
        ("trials/index.json", "trials"),
        ("study.json", "study"),
    ):
        document = json.loads((study / name).read_text())
        assert document["schema"] == f"towtank/{noun}/1"
        assert document["provenance"]["version"]
    index = json.loads((study / "trials" / "index.json").read_text())
    assert all((study / "trials" / Path(trial["file"]).name).exists() for trial in index["trials"])
    assert answer["status"] == "ok"
    assert set(answer["summary"]["stages_s"]) == set(STAGES)
    assert {"craft", "plan", "runs", "derivatives", "model", "trials", "verdict", "report"} <= set(answer["files"])


def test_the_first_run_has_open_and_closed_loop_trials(first: tuple[Path, dict, str]):
    trials = json.loads((first[0] / "trials" / "index.json").read_text())["trials"]
    assert {trial["loop"] for trial in trials} == {"open", "closed"}
    assert len({trial["name"] for trial in trials}) == len(trials)


def test_asking_again_costs_nothing_and_writes_nothing(study: Path):
    before = _stamps(study)
    result = runner.invoke(app, ["run", "--out", str(study)])
    assert result.exit_code == 0, result.stderr
    assert result.stderr.count("already done") == len(STAGES)
    assert _stamps(study) == before


def test_a_truncated_result_is_made_again_with_what_follows(study: Path):
    whole = (study / "verdict.json").read_text()
    (study / "verdict.json").write_text("")
    runs = {path: stamp for path, stamp in _stamps(study).items() if path.name == "run.nc"}
    result = runner.invoke(app, ["assess", "--out", str(study)])
    assert result.exit_code == 0, result.stderr
    again = json.loads((study / "verdict.json").read_text())
    assert again["horizontal"] == json.loads(whole)["horizontal"]
    assert {path: stamp for path, stamp in _stamps(study).items() if path.name == "run.nc"} == runs


def test_edited_derivatives_are_kept_aside_when_derived_again(study: Path):
    path = study / "derivatives.json"
    edited = path.read_text() + "\n"
    path.write_text(edited)
    result = runner.invoke(app, ["derive", "--out", str(study)])
    assert result.exit_code == 0, result.stderr
    assert (study / "derivatives.edited-1.json").read_text() == edited
    assert "kept" in result.stderr


def test_derivatives_about_another_point_are_printed_and_saved_beside(study: Path):
    before = (study / "derivatives.json").read_text()
    words = ["derive", "--out", str(study), "--about", "4 m", "--length", "8 m", "--json"]
    result = runner.invoke(app, words)
    assert result.exit_code == 0, result.stderr
    answer = json.loads(result.stdout)
    saved = json.loads(Path(answer["files"]["derivatives_about"]).read_text())
    assert saved["reference"]["length"] == pytest.approx(8.0)
    assert saved["reference"]["origin_from_nose"] == pytest.approx(4.0)
    # the force in pure sway does not know where moments are taken
    mine = json.loads(before)["terms"]["Yuv"]["value"]
    assert saved["terms"]["Yuv"]["value"] == pytest.approx(mine, rel=1e-9)
    assert (study / "derivatives.json").read_text() == before


@pytest.mark.parametrize("option", [["--about", "12 kg"], ["--length", "-1 m"], ["--about", "nan"]])
def test_a_senseless_reference_is_refused(study: Path, option: list[str]):
    result = runner.invoke(app, ["derive", "--out", str(study), *option])
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr


def test_a_trial_is_added_to_the_study(study: Path):
    before = {trial["name"] for trial in json.loads((study / "trials" / "index.json").read_text())["trials"]}
    words = ["trial", "zigzag", "--out", str(study), "--angle", "12 deg", "--heading", "8 deg", "--json"]
    result = runner.invoke(app, words)
    assert result.exit_code == 0, result.stderr
    answer = json.loads(result.stdout)
    index = json.loads((study / "trials" / "index.json").read_text())["trials"]
    assert before < {trial["name"] for trial in index}
    assert Path(answer["files"]["trial"]).exists()
    assert answer["summary"]["indices"]


@pytest.mark.parametrize("option", [["--angle", "12"], ["--angle", "100 deg"], ["--speed", "-1 m/s"]])
def test_a_senseless_trial_is_refused(study: Path, option: list[str]):
    result = runner.invoke(app, ["trial", "zigzag", "--out", str(study), *option])
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr


def test_the_report_stands_alone(first: tuple[Path, dict, str]):
    page = (first[0] / "report.html").read_text()
    assert "semi-empirical" in page
    assert 'src="http' not in page
    assert 'href="http' not in page or "<link" not in page


def test_without_a_compiled_engine_the_run_goes_on_and_says_what_it_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TOWTANK_ENGINE", "numpy")
    result = runner.invoke(app, ["run", "spheroid-6-1", "--json"])
    assert result.exit_code == 0, result.stderr
    assert "left out" in result.stderr
    assert "towtank doctor" in result.stderr
    assert (
        json.loads((tmp_path / "spheroid-6-1" / "trials" / "index.json").read_text())["trials"][0]["name"] == "straight"
    )
    assert not (tmp_path / "spheroid-6-1" / "mc.json").exists()
    assert (tmp_path / "spheroid-6-1" / "report.html").stat().st_size > 10_000
