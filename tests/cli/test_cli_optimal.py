"""``towtank plan --optimal``: the plan it writes, what it says that saves, and what it refuses."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank import read_craft
from towtank.cli.app import app
from towtank.plan.files import read_plan
from towtank.report.build import report_study

runner = CliRunner()
ASKED = ["--optimal", "--budget", "12", "--for", "Yuv,Nuv,Yur,Nur"]


def answer(*words: str, command: str = "plan", code: int = 0) -> dict:
    result = runner.invoke(app, [command, *words, "--json"])
    assert result.exit_code == code, result.stderr
    assert "Traceback" not in result.stderr
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Folder and JSON reply of an optimal plan of hokie, rehearsed."""
    folder = tmp_path_factory.mktemp("optimal") / "hokie"
    return folder, answer("hokie", *ASKED, "--rehearse", "20", "--out", str(folder))


@pytest.fixture
def copy(planned: tuple[Path, dict], tmp_path: Path) -> Path:
    return Path(shutil.copytree(planned[0], tmp_path / "hokie"))


def test_the_plan_is_the_one_that_was_chosen(planned: tuple[Path, dict]):
    folder, told = planned
    document = json.loads((folder / "optimal.json").read_text())
    assert document["schema"] == "towtank/optimal/1"
    assert [test.name for test in read_plan(folder / "plan.toml", read_craft(str(folder))).tests] == document["chosen"][
        "runs"
    ]
    assert document["chosen"]["number"] == told["summary"]["tests"] <= 12
    assert document["chosen"]["cost"] <= 12.0 * (1.0 + 1e-9)
    assert document["aim"] == ["Yuv", "Nuv", "Yur", "Nur"]
    saves = told["summary"]["optimal"]["saves"]
    assert saves["runs"] == document["standard_bearing"]["number"] - document["least"]["number"]
    assert set(document["rehearsal"]) == {"chosen", "equal_cost", "standard_bearing"}
    assert document["rehearsal"]["chosen"]["campaigns"] == 20


def test_asking_again_changes_nothing(copy: Path):
    before = (copy / "optimal.json").stat().st_mtime_ns
    answer(*ASKED, "--rehearse", "20", "--out", str(copy))
    assert (copy / "optimal.json").stat().st_mtime_ns == before


def test_another_question_is_answered_and_an_edited_plan_put_aside(copy: Path):
    with (copy / "plan.toml").open("a") as file:
        file.write("# mine\n")
    other = answer("--optimal", "--budget", "8", "--for", "index", "--cost", "runs", "--out", str(copy))
    assert other["summary"]["optimal"]["aim"] == ["G_h"]
    assert other["summary"]["tests"] <= 8
    kept = [path for path in copy.glob("plan*") if path.suffix != ".csv" and path.name != "plan.toml"]
    assert len(kept) == 1
    assert "# mine" in kept[0].read_text()


def test_the_chosen_runs_give_what_they_were_chosen_for(copy: Path):
    answer("--out", str(copy), command="tow")
    answer("--out", str(copy), command="derive")
    terms = json.loads((copy / "derivatives.json").read_text())["terms"]
    assert {"Yuv", "Nuv", "Yur", "Nur"} <= set(terms)
    page = report_study(copy, copy / "report.html").read_text()
    assert "Captive tests chosen" in page
    assert "Saves" in page


def test_the_report_leaves_a_choice_out_that_is_not_the_plan(copy: Path):
    with (copy / "plan.toml").open("a") as file:
        file.write("# mine\n")
    page = report_study(copy, copy / "report.html").read_text()
    assert "Captive tests chosen" not in page
    assert "plan.toml is not the plan of optimal.json" in page


def test_a_cost_model_may_be_written(tmp_path: Path):
    (tmp_path / "mine.toml").write_text('base = "runs"\nsteady = 3\nunit = "days"\n')
    words = ["--optimal", "--budget", "6", "--for", "index", "--cost", str(tmp_path / "mine.toml")]
    answer("hokie", *words, "--out", str(tmp_path / "study"))
    model = json.loads((tmp_path / "study" / "optimal.json").read_text())["cost_model"]
    assert (model["steady"], model["step"], model["unit"]) == (3.0, 0.0, "days")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--budget", "20"], "belong to --optimal"),
        (["--for", "Yuv"], "Add --optimal"),
        (["--optimal"], "--budget 30"),
        (["--optimal", "--budget", "0"], "no number of runs"),
        (["--optimal", "--budget", "-3"], "no number of runs"),
        (["--optimal", "--budget", "9", "--criterion", "E"], "choose D"),
        (["--optimal", "--budget", "9", "--for", ""], "names nothing"),
        (["--optimal", "--budget", "9", "--for", "index,Yuv"], "stand alone"),
        (["--optimal", "--budget", "9", "--for", "Ybanana"], "no term of the model"),
        (["--optimal", "--budget", "2", "--for", "Yuv,Nuv,Yur,Nur"], "cannot be determined by 2 runs"),
        (["--optimal", "--budget", "9", "--cost", "gold"], "no such model"),
        (["--optimal", "--budget", "9", "--cost", "none.toml"], "readable TOML"),
        (["--optimal", "--budget", "9", "--rehearse", "3"], "20 or more"),
    ],
)
def test_a_bad_question_is_refused_and_writes_no_plan(words: list[str], named: str, tmp_path: Path):
    told = answer("hokie", *words, "--out", str(tmp_path / "study"), code=2)
    assert told["status"] == "failed"
    assert named in told["error"]
    assert not (tmp_path / "study" / "plan.toml").exists()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("stedy = 3", "Did you mean 'steady'"),
        ("steady = -1", "not a cost"),
        ("steady = true", "not a cost"),
        ("steady = 0", "free"),
        ('base = "gold"', "not a model"),
        ("steady", "readable TOML"),
    ],
)
def test_a_bad_cost_model_is_refused(text: str, named: str, tmp_path: Path):
    (tmp_path / "cost.toml").write_text(text)
    words = ["--optimal", "--budget", "9", "--cost", str(tmp_path / "cost.toml"), "--out", str(tmp_path / "study")]
    assert named in answer("hokie", *words, code=2)["error"]
