"""``towtank compare``: files, figures, words, exit codes, the section of the report."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sea_records import OPEN, swum
from towtank.cli.app import app
from towtank.craft.library import read_craft, write_craft_copy
from towtank.derive.derive import derive
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.field.comparing.files import read_comparisons
from towtank.field.files import read_log, write_log
from towtank.model.equations import Model
from towtank.model.values import replaced
from towtank.plan.standard import standard_plan
from towtank.report.study import read_study
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.start import ballasted

runner = CliRunner()
MAPPING = """
schema = "towtank/sea-log/1"
format = "csv"
craft = "hokie"
fins = "towtank"
[clock]
columns = ["time"]
kind = "elapsed"
unit = "s"
[channels]
psi = { column = "psi", unit = "rad" }
r = { column = "r", unit = "rad/s" }
delta1 = { column = "delta1", unit = "rad" }
delta2 = { column = "delta2", unit = "rad" }
delta3 = { column = "delta3", unit = "rad" }
delta4 = { column = "delta4", unit = "rad" }
"""
PNG = b"\x89PNG\r\n\x1a\n"


def answer(*words: str, code: int = 0) -> tuple[dict, str]:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, (result.stdout, result.stderr)
    return json.loads(result.stdout), result.stderr


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of hokie up to its derivatives, and a record beside it."""
    folder = tmp_path_factory.mktemp("compare") / "hokie"
    folder.mkdir()
    write_craft_copy("hokie", folder)
    craft = read_craft("hokie")
    derivatives = derive(tow(standard_plan(craft), FastTank(members=4)))
    write_derivatives(derivatives, folder / "derivatives.json")
    model = ballasted(Model(craft, derivatives))
    log, _ = swum(model, OPEN)
    random = np.random.default_rng(1)
    channels = {n: v + random.normal(0.0, 0.002, len(v)) if n in ("psi", "r") else v for n, v in log.channels.items()}
    made = replace(log, channels={**channels, "heading_order": np.zeros(len(log.time))}, std={"psi": 0.002, "r": 0.002})
    write_log(made, folder.parent / "swim.nc")
    write_log(replace(made, craft="remus100"), folder.parent / "other.nc")
    write_log(replace(log, channels={"psi": log["psi"]}), folder.parent / "bare.nc")
    return folder


def test_a_comparison_leaves_a_document_series_and_figures(study: Path):
    told, said = answer(
        "compare", str(study), str(study.parent / "swim.nc"), "--ballasted", "--samples", "20", "--speed", "1 m/s"
    )
    summary = told["summary"]
    assert summary["record_level"] == "synthetic"
    assert summary["loop"] == "open"
    assert summary["horizon"] == 30.0
    assert summary["channels"]["psi"]["rms"] < 0.02
    assert summary["validated"]["of"] > 10
    assert "time alignment" in said
    names = {"psi", "r", "levels", "growth", "residuals", "track"}
    assert names <= set(told["files"])
    assert all(Path(told["files"][name]).read_bytes().startswith(PNG) for name in names)
    assert not list(study.rglob("*.part"))
    (one,) = read_comparisons(study)
    assert one.name == "swim"
    assert one.samples == 20


def test_the_table_is_for_people_and_names_a_synthetic_record(study: Path):
    result = runner.invoke(
        app, ["compare", str(study), str(study.parent / "swim.nc"), "--ballasted", "--samples", "10", "--horizon", "0"]
    )
    assert result.exit_code == 0, result.stderr
    assert "SYNTHETIC" in result.stdout
    for word in ("channel", "U_val", "metric", "r_power_0_0.1_hz", "In U_val", "Not in it"):
        assert word in result.stdout
    # Radians are shown as degrees.
    line = next(line for line in result.stdout.splitlines() if line.strip().startswith("psi"))
    assert line.split()[1] == "deg"


def test_orders_are_flown_by_the_pilot_that_is_named(study: Path):
    told, _ = answer(
        "compare", str(study), str(study.parent / "swim.nc"), "--ballasted", "--samples", "5", "--pilot", "lqi"
    )
    assert told["summary"]["loop"] == "closed"
    assert told["summary"]["horizon"] is None
    assert {one.loop for one in read_comparisons(study)} == {"open", "closed"}


def test_the_report_has_a_section_with_the_level_of_the_record(study: Path):
    answer("compare", str(study), str(study.parent / "swim.nc"), "--ballasted", "--samples", "5")
    answer("report", "--out", str(study))
    page = (study / "report.html").read_text()
    section = page[page.index('id="compare"') :]
    section = section[: section.index("</section>")]
    for word in ("Comparison with sea records", "SYNTHETIC record", "swim: error of every channel", "swim: metrics"):
        assert word in section
    assert section.count("<svg") >= 3


def test_a_comparison_with_other_derivatives_is_called_one(study: Path, tmp_path: Path):
    answer("compare", str(study), str(study.parent / "swim.nc"), "--ballasted", "--samples", "5")
    copy = Path(shutil.copytree(study, tmp_path / "copy"))
    assert not [words for words in read_study(copy).remarks if "compare.json" in words]
    found = read_derivatives(copy / "derivatives.json")
    write_derivatives(replaced(found, {"Nuv": 0.9 * found["Nuv"]}), copy / "derivatives.json")
    assert any("compare.json was made with other derivatives" in words for words in read_study(copy).remarks)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("missing.nc",), "does not exist"),
        (("other.nc",), "a record of remus100"),
        (("bare.nc", "--open"), "says nothing of the fins"),
        (("bare.nc", "--closed"), "holds no order"),
        (("swim.nc", "--open", "--pilot", "lqi"), "Leave one of them out"),
        (("swim.nc", "--pilot", "nobody"), "neither a file nor a name"),
        (("swim.nc", "--horizon", "0.5"), "horizon of 0.5 s"),
        (("swim.nc", "--samples", "1"), "make no band"),
        (("swim.nc", "--speed", "0 m/s"), "above zero"),
    ],
)
def test_what_cannot_be_compared_is_said(study: Path, words: tuple[str, ...], said: str):
    told, error = answer("compare", str(study), str(study.parent / words[0]), *words[1:], code=2)
    assert said in error
    assert told["status"] == "failed"


def test_a_study_without_derivatives_says_what_comes_first(tmp_path: Path, study: Path):
    _, error = answer("compare", "remus100", str(study.parent / "swim.nc"), "--out", str(tmp_path / "empty"), code=2)
    assert "towtank derive" in error


def test_a_log_of_another_form_is_read_on_the_way(study: Path, tmp_path: Path):
    log = read_log(study.parent / "swim.nc")
    names = ("psi", "r", "delta1", "delta2", "delta3", "delta4")
    rows = np.stack([log.time, *(log[name] for name in names)], axis=1)
    np.savetxt(tmp_path / "swim.csv", rows, delimiter=",", header="time," + ",".join(names), comments="", fmt="%.9f")
    (tmp_path / "map.toml").write_text(MAPPING)
    told, _ = answer(
        "compare", str(study), str(tmp_path / "swim.csv"), "--map", str(tmp_path / "map.toml"), "--ballasted",
        "--samples", "5", "--speed", "1 m/s",
    )  # fmt: skip
    assert told["summary"]["record_level"] == "sea record"
    # No speed is in the file: the craft's own at the begin leaves some degrees after half a minute.
    assert told["summary"]["channels"]["psi"]["rms"] < 0.2
    assert any("u: not measured" in words for one in read_comparisons(study) for words in one.words)
