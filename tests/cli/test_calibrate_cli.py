"""``towtank calibrate``: from records to a corrected set, and what it says of bad ones."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from calibrate_cases import hokie, records
from towtank.cli.app import app
from towtank.craft.library import write_craft_copy
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.field.files import write_log
from towtank.field.sea_water import Environment

runner = CliRunner()
TERMS = "Yuv,Nuv,Yur,Nur"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of hokie with derivatives, and two records of a craft ballasted to neutral beside it."""
    folder = tmp_path_factory.mktemp("calibrate") / "hokie"
    folder.mkdir()
    write_craft_copy("hokie", folder)
    write_derivatives(hokie().derivatives, folder / "derivatives.json")
    water = Environment(current=(0.1, 0.0, 0.0), turbulence=(0.01, 0.01, 0.003))
    for i, log in enumerate(records(hokie(), 60.0, water, count=2)):
        write_log(log, folder.parent / f"sea-{i}.nc")
    return folder


def called(study: Path, *words: str, code: int = 0):
    result = runner.invoke(app, ["calibrate", str(study), *words])
    assert result.exit_code == code, result.output
    return result


def test_a_study_is_corrected_by_a_record_and_another_is_held_out(study: Path):
    logs = [str(study.parent / f"sea-{i}.nc") for i in range(2)]
    told = called(
        study, logs[0], "--hold-out", logs[1], "--terms", TERMS, "--ballasted", "--doubt", "0.2", "--json"
    ).stdout
    answer = json.loads(told)
    assert answer["summary"]["level"] == "semi-empirical + synthetic"
    # Twins of the other plane move with those that were named.
    assert set(answer["summary"]["moves"]) == {*TERMS.split(","), "Zuw", "Muw", "Zuq", "Muq"}
    new = read_derivatives(answer["files"]["calibrated"])
    assert new["Nuv"] == pytest.approx(answer["summary"]["moves"]["Nuv"]["value"])
    assert set(new.provenance["inputs"]) == {"synthetic sea0-0", "derivatives"}
    tables = json.loads(Path(answer["files"]["calibration"]).read_text())
    assert tables["schema"] == "towtank/calibration/1"
    assert tables["hold_out"][0]["after"]["windows"] == 2
    assert tables["records"][0]["hash"] in new.provenance["inputs"].values()


def test_the_table_names_moves_the_water_and_combinations_that_are_not_told(study: Path):
    told = called(study, str(study.parent / "sea-0.nc"), "--ballasted").stdout
    for words in ("moved", "left", "current", "turbulence", "thrust", "independent combinations"):
        assert words in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.nc"], "no such file"),
        (["LOG", "--terms", "Ypp"], "holds no Ypp"),
        (["LOG", "LOG"], "same record"),
        (["LOG", "--window", "3 m"], "--window"),
        (["TOML"], "craft.toml"),
    ],
)
def test_what_cannot_be_used_is_said(study: Path, words: list[str], said: str):
    places = {"LOG": str(study.parent / "sea-0.nc"), "TOML": str(study / "craft.toml")}
    result = called(study, *(places.get(word, word) for word in words), code=2)
    assert said in result.stderr


def test_a_study_without_derivatives_is_told_the_way(tmp_path: Path):
    write_craft_copy("hokie", tmp_path)
    (tmp_path / "log.nc").write_bytes(b"")
    result = runner.invoke(app, ["calibrate", str(tmp_path), str(tmp_path / "log.nc")])
    assert result.exit_code == 2
    assert "towtank derive" in result.stderr
