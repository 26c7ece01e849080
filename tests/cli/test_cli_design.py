"""``towtank design``: a study from the command line, the speed of least energy, bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app

runner = CliRunner()
WORDS = ["design", "suboff-x", "--vary", "fin_span=1:1.6:2", "--members", "0", "--evaluations", "3", "--workers", "1"]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict, str]:
    """Folder, JSON document and remarks of a study of one axis."""
    folder = tmp_path_factory.mktemp("design") / "study"
    result = runner.invoke(app, [*WORDS, "--target", "90 %", "--out", str(folder), "--json"])
    assert result.exit_code == 0, result.stderr
    return folder, json.loads(result.stdout), result.stderr


def test_the_study_holds_document_figure_and_variants(first: tuple[Path, dict, str]) -> None:
    folder, answer, _ = first
    document = json.loads((folder / "design.json").read_text())
    assert document["schema"] == "towtank/design/1"
    assert document["target"] == 0.9
    assert document["provenance"]["inputs"]["craft"]
    assert document["drive"]["assumed"]
    assert [axis["name"] for axis in document["axes"]] == ["fin_span"]
    assert {document["base"], *document["pareto"]} <= {point["key"] for point in document["points"]}
    assert (folder / "design.png").read_bytes()[:4] == b"\x89PNG"
    assert len(list((folder / "design").glob("*.json"))) >= answer["summary"]["variants"]
    assert answer["summary"]["as_given"]["changes"] == {}
    assert answer["summary"]["as_given"]["values"]["turning_circle.tactical_diameter_lengths"] > 0.0


def test_asking_again_starts_nothing(first: tuple[Path, dict, str], monkeypatch: pytest.MonkeyPatch) -> None:
    folder, answer, _ = first
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "design").iterdir()}
    result = runner.invoke(app, [*WORDS, "--target", "90 %", "--out", str(folder), "--json"])
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["summary"] == answer["summary"]
    assert {path: path.stat().st_mtime_ns for path in (folder / "design").iterdir()} == stamps


def test_people_get_sentences_and_a_table_and_the_report_shows_them(first: tuple[Path, dict, str]) -> None:
    folder = first[0]
    result = runner.invoke(app, [*WORDS, "--target", "90 %", "--out", str(folder)])
    assert result.exit_code == 0, result.stderr
    assert "with fixed fins suboff-x as given is" in result.stdout
    assert "as given" in result.stdout
    assert runner.invoke(app, ["report", "--out", str(folder)]).exit_code == 0
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Design study" in page
    assert "fin_span alone" in page
    # A range asked for afterwards makes the page anew.
    assert runner.invoke(app, ["design", "--range", "--hotel", "30 W", "--out", str(folder)]).exit_code == 0
    assert runner.invoke(app, ["report", "--out", str(folder)]).exit_code == 0
    assert "Speed of least energy per metre" in (folder / "report.html").read_text(encoding="utf-8")


def test_a_study_of_another_state_of_the_craft_says_so(first: tuple[Path, dict, str]) -> None:
    folder = first[0]
    own = folder / "craft.toml"
    text = own.read_text(encoding="utf-8")
    assert '"30 deg"' in text
    own.write_text(text.replace('"30 deg"', '"29 deg"'), encoding="utf-8")
    try:
        assert runner.invoke(app, ["report", "--out", str(folder)]).exit_code == 0
        assert "design.json was made of another craft" in (folder / "report.html").read_text(encoding="utf-8")
    finally:
        own.write_text(text, encoding="utf-8")


def test_the_speed_of_least_energy_of_a_neutral_craft_is_the_closed_form(tmp_path: Path) -> None:
    words = ["design", "suboff-x", "--range", "--hotel", "30 W", "--out", str(tmp_path / "s"), "--json"]
    result = runner.invoke(app, words)
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)["summary"]
    assert summary["neutral"]["u"] == pytest.approx(summary["closed_form_speed"], rel=2e-3)
    document = json.loads((tmp_path / "s" / "cruise.json").read_text())
    assert document["schema"] == "towtank/cruise/1"
    assert (tmp_path / "s" / "cruise.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--range"], "needs the hotel power"),
        (["--range", "--hotel", "-4 W"], "positive"),
        (["--range", "--hotel", "4 kg"], "dimension of W"),
        (["--current", "1 m/s"], "belongs to --range"),
        (["--vary", "fin_sise=1:2"], "Did you mean fin_size"),
        (["--vary", "fin_span=1"], "LOW:HIGH"),
        (["--vary", "strake_length=0.2:0.4"], "Add strake_height"),
        (["--target", "100 %"], "0.5 to 0.995"),
        (["--reach", "5 kg"], "dimension of m"),
        (["--members", "1"], "members"),
    ],
)
def test_bad_input_is_refused_before_anything_is_done(tmp_path: Path, words: list[str], told: str) -> None:
    result = runner.invoke(app, ["design", "suboff-x", *words, "--out", str(tmp_path / "s")])
    assert result.exit_code == 2
    assert told in result.stderr
    assert not (tmp_path / "s").exists() or not list((tmp_path / "s").glob("*.stl"))
