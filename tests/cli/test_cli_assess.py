"""``towtank assess``: requirements kept in the study, judged with probability and driver, bad ones told."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app

runner = CliRunner()

MINE = """
schema = "towtank/requirements/1"

[[requirement]]
name = "turns within five lengths"
trial = "turning circle"
index = "tactical_diameter"
at_most = "5 L"
share = 0.5

[[requirement]]
name = "stable"
criterion = "P_stable_horizontal"
at_least = 0.9
"""


def answer(*words: str, code: int = 0) -> tuple[dict, str]:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, result.stderr
    return json.loads(result.stdout), result.stderr


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of hokie up to its derivatives and a small Monte Carlo study."""
    folder = tmp_path_factory.mktemp("assess") / "hokie"
    for words in (["plan", "hokie"], ["tow", "hokie"], ["derive", "hokie"], ["mc", "hokie", "--samples", "20"]):
        result = runner.invoke(app, [*words, "--out", str(folder)])
        assert result.exit_code == 0, result.stderr
    return folder


@pytest.fixture(scope="module")
def judged(study: Path) -> tuple[Path, dict]:
    """The study with requirements of its own, and the JSON document."""
    mine = study.parent / "mine.toml"
    mine.write_text(MINE)
    return study, answer("assess", "--requirements", str(mine), "--out", str(study))[0]


def test_requirements_are_judged_with_margin_probability_and_driver(judged: tuple[Path, dict]):
    folder, told = judged
    turns, stable = told["summary"]["requirements"][:2]
    assert turns["name"] == "turns within five lengths"
    assert turns["limit"] == pytest.approx(5.0 * 8.15, rel=1e-3)
    assert turns["margin"] == pytest.approx(turns["limit"] - turns["value"])
    assert turns["met"] == (turns["probability"] >= 0.5)
    # hokie is four-fold: the pitch twin of each yaw derivative moves with it.
    assert {d["coefficient"] for d in turns["drivers"]} & {"Nuv/Muw", "Nur/Muq"}
    mc = json.loads((folder / "mc.json").read_text())["stability"]["horizontal"]
    assert stable["value"] == mc["probability_stable"]
    document = json.loads((folder / "verdict.json").read_text())
    assert document["drawn"] == "20 craft drawn from derivatives"
    assert document["horizontal"]["P_stable"] == mc["probability_stable"]
    assert {c["name"] for c in document["criteria"]} >= {"G_h", "loop_width", "roll_period", "critical_speed"}
    assert len(document["against_speed"]["speed"]) == len(document["against_speed"]["horizontal"]["low"])
    assert any(use["trial"] == "lawnmower" for use in document["fins"])


def test_people_get_the_table(judged: tuple[Path, dict]):
    result = runner.invoke(app, ["assess", "--out", str(judged[0])])
    assert result.exit_code == 0, result.stderr
    line = next(line for line in result.stdout.splitlines() if "turns within five lengths" in line)
    assert "at most" in line
    assert " m " in line
    assert "%" in line
    assert "P: share of 20 craft drawn from derivatives that meets it." in result.stdout


def test_the_file_is_kept_and_its_change_makes_a_new_verdict(judged: tuple[Path, dict], tmp_path: Path):
    folder = Path(shutil.copytree(judged[0], tmp_path / "hokie"))
    assert (folder / "requirements.toml").read_text() == MINE
    again, remarks = answer("assess", "--out", str(folder))
    assert "verdict  already done" in remarks
    assert again["summary"]["requirements"] == judged[1]["summary"]["requirements"]
    (folder / "requirements.toml").write_text(MINE.replace("5 L", "2 L"))
    stages = answer("status", "--out", str(folder))[0]["summary"]["stages"]
    assert stages["verdict"].startswith("out of date")
    changed = answer("assess", "--out", str(folder))[0]["summary"]["requirements"][0]
    assert changed["limit"] == pytest.approx(2.0 * 8.15, rel=1e-3)
    standard = answer("assess", "--requirements", "standard", "--out", str(folder))[0]["summary"]["requirements"]
    assert not (folder / "requirements.toml").exists()
    assert "first overshoot 10/10" in {r["name"] for r in standard}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name = 1", "The first line of the file is schema"),
        (MINE.replace("tactical_diameter", "tactical"), "Did you mean tactical_diameter?"),
        (MINE.replace("turning circle", "turning squares"), "Did you mean"),
        (MINE.replace('"5 L"', '"5 kg"'), "cannot be converted to m"),
        (MINE.replace("P_stable_horizontal", "P_stable"), "unknown criterion"),
    ],
)
def test_bad_requirements_are_told_and_leave_the_verdict(
    judged: tuple[Path, dict], tmp_path: Path, text: str, words: str
):
    folder = Path(shutil.copytree(judged[0], tmp_path / "hokie"))
    bad = tmp_path / "bad.toml"
    bad.write_text(text)
    before = (folder / "verdict.json").read_bytes()
    result = runner.invoke(app, ["assess", "--requirements", str(bad), "--out", str(folder)])
    assert result.exit_code == 2, result.stderr
    assert words in result.stderr
    assert "Traceback" not in result.stderr
    assert (folder / "verdict.json").read_bytes() == before
    assert (folder / "requirements.toml").read_text() == MINE


def test_a_missing_file_is_told(judged: tuple[Path, dict]):
    result = runner.invoke(app, ["assess", "--requirements", "nowhere.toml", "--out", str(judged[0])])
    assert result.exit_code == 2
    assert "towtank assess --template" in result.stderr


def test_the_template_is_a_file_to_start_from(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(app, ["assess", "--template"])
    assert result.exit_code == 0
    Path("mine.toml").write_text(result.stdout)
    folder = Path(shutil.copytree(study, tmp_path / "hokie"))
    told = answer("assess", "--requirements", "mine.toml", "--out", str(folder))[0]["summary"]["requirements"]
    assert all(r["probability"] is not None or r["name"].startswith(("probability", "level", "pilot")) for r in told)
    assert (folder / "requirements.toml").read_text() == result.stdout
