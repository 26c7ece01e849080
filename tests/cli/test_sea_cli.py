"""``towtank sea``: a made-up record of a trial in a sea, in each format, marked in its name and inside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from published_models import remus_model
from towtank.cli.app import app
from towtank.cli.sea import Format
from towtank.craft.library import read_craft, write_craft_copy
from towtank.derive.files import write_derivatives
from towtank.field.files import read_log
from towtank.field.reading.gate import read_sea_log
from towtank.field.writing import FORMATS
from towtank.model.equations import Model

runner = CliRunner()
OWN_TRIAL = """
schema = "towtank/trial/1"
name = "turn"
[[command]]
rudder = "-8 deg"
until = "heading 60 deg"
[[command]]
heading = "60 deg"
for = "10 s"
"""
WATER = ("--current", "0.2 m/s, -0.1 m/s", "--shear", "0.01 1/s", "--turbulence", "0.02 m/s", "--seed", "3")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of remus100 that holds the published coefficients."""
    folder = tmp_path_factory.mktemp("sea")
    craft = read_craft("remus100")
    write_craft_copy("remus100", folder)
    printed = remus_model().derivatives
    model = Model.from_values(craft, printed.as_dict(), variant=printed.variant)
    write_derivatives(model.derivatives, folder / "derivatives.json")
    return folder


def made(study: Path, *words: str) -> dict:
    result = runner.invoke(app, ["sea", str(study), *words, "--json"])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def refused(study: Path, *words: str) -> str:
    result = runner.invoke(app, ["sea", str(study), *words])
    assert result.exit_code == 2, result.stdout
    return result.stderr


def test_the_formats_are_those_of_the_writers():
    assert {item.value for item in Format} == set(FORMATS)


def test_a_zigzag_in_a_sea_is_written_and_says_that_it_is_made_up(study: Path, tmp_path: Path):
    answer = made(study, "--trial", "zigzag10", *WATER, "--out", str(tmp_path / "zz"))
    path = Path(answer["files"]["log"])
    assert path == tmp_path / "zz-synthetic.nc"
    assert answer["summary"]["synthetic"] is True
    assert answer["summary"]["level"] == "synthetic"
    log = read_log(path)
    assert log.synthetic
    assert log.craft == "remus100"
    assert log.provenance["environment"]["current"] == [0.2, -0.1, 0.0]
    assert log.provenance["environment"]["shear"] == [0.01, 0.0]
    assert log.provenance["environment"]["turbulence"] == [0.02, 0.02, 0.02]
    # The mean of half a minute of eddies of 0.02 m/s that last 20 s lies within four of their spread.
    assert answer["summary"]["drawn"]["current_mean"][1] == pytest.approx(-0.1, abs=0.08)


def test_the_same_seed_writes_the_same_numbers(study: Path, tmp_path: Path):
    logs = [
        read_log(made(study, "--trial", "zigzag10", *WATER, "--out", str(tmp_path / f"{i}.nc"))["files"]["log"])
        for i in range(2)
    ]
    for name in logs[0].channels:
        np.testing.assert_array_equal(logs[0][name], logs[1][name])


@pytest.mark.parametrize("form", list(Format))
def test_each_format_is_read_back_and_still_says_that_it_is_made_up(study: Path, tmp_path: Path, form: Format):
    words = ("--minutes", "0.2", *WATER, "--start", "2026-05-01T08:00:00", "--datum", "36.9 deg, -75.8 deg")
    path = Path(made(study, *words, "--format", form.value, "--out", str(tmp_path / "log"))["files"]["log"])
    assert path.name == f"log-synthetic{FORMATS[form.value][0]}"
    log = read_sea_log(path)
    assert log.synthetic
    assert log.level == "synthetic"
    assert log.epoch == pytest.approx(1777622400.0)
    truth = read_log(made(study, *words, "--out", str(tmp_path / "own"))["files"]["log"])
    near = np.interp(log.time, truth.time, truth["psi"])
    # An Iver log holds 0.01 deg.
    assert np.abs(log["psi"] - near).max() < np.radians(0.006)


def test_the_truth_of_the_same_swim_is_written_beside_the_record(study: Path, tmp_path: Path):
    words = ("--minutes", "1", *WATER, "--out", str(tmp_path / "a.nc"), "--truth", str(tmp_path / "b.nc"))
    files = made(study, *words)["files"]
    log, truth = read_log(files["log"]), read_log(files["truth"])
    assert truth.synthetic
    assert not truth.std
    error = log["psi"] - truth["psi"]
    # The compass of the standard instruments: noise of 0.3 deg, an offset of 1 deg, here within four.
    assert np.nanstd(error) == pytest.approx(np.radians(0.3), rel=0.2)
    assert abs(np.nanmean(error)) < np.radians(4.0)


def test_a_trial_of_ones_own_and_instruments_of_ones_own(study: Path, tmp_path: Path):
    own = tmp_path / "own.toml"
    own.write_text('schema = "towtank/instruments/1"\nstart = "exact"\nperiod = "0.5 s"\n', "utf-8")
    trial = tmp_path / "turn.toml"
    trial.write_text(OWN_TRIAL, "utf-8")
    answer = made(study, "--trial", str(trial), "--instruments", str(own), "--out", str(tmp_path / "s"))
    log = read_log(answer["files"]["log"])
    assert log.name == "turn-synthetic"
    assert np.allclose(np.diff(log.time), 0.5)
    assert not log.std


def test_eddies_of_a_length_last_their_passage(study: Path, tmp_path: Path):
    answer = made(study, "--minutes", "0.2", "--eddies", "30 m", "--out", str(tmp_path / "a"))
    found = read_log(answer["files"]["log"]).provenance
    assert found["environment"]["correlation"] == pytest.approx(30.0 / found["trial"]["speed"])


def test_a_craft_without_a_study_takes_its_derivatives_from_the_fast_tank(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    result = runner.invoke(app, ["sea", "remus100", "--minutes", "0.2"])
    assert result.exit_code == 0, result.stderr
    assert "fast tank" in result.stderr
    assert "SYNTHETIC" in result.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["remus100-survey-0.2min-0-synthetic.nc"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--trial", "zigzak20"), "Did you mean"),
        (("--trial", "zigzag10", "--minutes", "3"), "takes no minutes"),
        (("--trial", "absent.toml"), "cannot be read"),
        (("--minutes=-1",), "above zero"),
        (("--current", "0.2"), "2 or 3 numbers"),
        (("--current", "2 m/s, 0"), "not below the craft's"),
        (("--current", "2 kg, 0"), "--current"),
        (("--shear", "1 m"), "--shear"),
        (("--turbulence=-1",), "0 or more"),
        (("--eddies", "5 kg"), "a time such as"),
        (("--eddies=-3 m",), "above zero"),
        (("--seed=-1",), "whole number"),
        (("--instruments", "cheap"), "standard, exact"),
        (("--instruments", "absent.toml"), "cannot be read"),
        (("--datum", "95 deg, 0 deg"), "latitude"),
        (("--start", "yesterday"), "no time"),
        (("--out", "a.nc", "--format", "csv"), "ends in .csv"),
    ],
)
def test_bad_input_is_told_with_its_remedy(study: Path, words: tuple[str, ...], said: str):
    assert said in refused(study, *words)
