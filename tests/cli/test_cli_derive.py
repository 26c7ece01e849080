"""``towtank derive``: what is asked of a fit is kept, what was judged is told, and what makes no sense is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.derive.files import read_derivatives
from towtank.derive.study_files import read_frequencies
from towtank.symbols import OPTIONAL

runner = CliRunner()
THIRD = set(OPTIONAL["third-order"])


def ask(*words: str, code: int = 0) -> dict:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, result.stderr
    assert "Traceback" not in result.stderr
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of the fast tank with its runs made and derivatives found."""
    folder = tmp_path_factory.mktemp("derive") / "suboff-fins"
    ask("tow", "suboff-fins", "--out", str(folder))
    ask("derive", "--out", str(folder))
    return folder


def test_the_reply_and_the_text_tell_how_the_runs_were_judged(study: Path):
    told = ask("derive", "--out", str(study))["summary"]
    assert sum(told["screening"].values()) == 113
    assert told["screening"]["exploratory"] == 20
    assert told["consistency"]["pass"] > 10
    text = runner.invoke(app, ["derive", "--out", str(study)]).stdout
    assert "20 exploratory" in text


def test_the_study_of_frequencies_is_written_and_printed_when_asked(study: Path):
    found = read_frequencies(study / "frequency.json")
    assert {advice.kind for advice in found.advice} == {"sway", "heave", "yaw", "pitch", "roll", "surge"}
    told = ask("derive", "--study", "--out", str(study))
    assert told["files"]["frequency"].endswith("frequency.json")
    assert len(told["summary"]["recommended"]["sway"]["frequencies"]) == 3
    text = runner.invoke(app, ["derive", "--study", "--out", str(study)]).stdout
    assert "Recommended oscillations" in text
    assert "semi-empirical" in text
    assert "third-order turn, mixed" in text


def test_optional_terms_are_taken_up_kept_for_the_next_time_and_given_up_again(study: Path):
    assert set(ask("derive", "--with", "third-order", "--out", str(study))["summary"]["terms"]) >= THIRD
    assert set(ask("derive", "--out", str(study))["summary"]["terms"]) >= THIRD
    model = json.loads((study / "model.json").read_text())
    assert "Yvvr" in json.dumps(model)
    assert not THIRD & set(ask("derive", "--with", "none", "--out", str(study))["summary"]["terms"])


def test_a_mesh_study_of_the_folder_enters_weights_and_uncertainty(study: Path):
    before = read_derivatives(study / "derivatives.json")
    assert not before.covariance_mesh.any()
    ask("grid", "--resolutions", "0.667,1,1.333", "--out", str(study))
    told = ask("derive", "--out", str(study))
    after = read_derivatives(study / "derivatives.json")
    assert after.covariance_mesh.any()
    shares = {
        name: entry["std_parts"]["mesh"] / abs(entry["value"]) for name, entry in told["summary"]["terms"].items()
    }
    # A few per cent of the loads by the study; terms that are differences of large loads carry more.
    assert 1e-4 < shares["Nuv"] < 0.2
    (study / "grid.json").unlink()
    ask("derive", "--out", str(study))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--with", "fourth-order"), "Groups are third-order, Xuuvv, or none"),
        (("--steady", "1.5"), "between 0 (sway only) and 1"),
        (("--length", "-1 m"), "Give a length above zero"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_what_can(study: Path, words: tuple[str, ...], told: str):
    result = runner.invoke(app, ["derive", *words, "--out", str(study)])
    assert result.exit_code == 2
    assert told in " ".join(result.stderr.split())
