"""``towtank log`` as a user meets it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import sea_samples as sea
from towtank.cli.app import app
from towtank.field.files import read_log
from towtank.field.reading.mapping import FORMATS
from towtank.field.reading.mapping_file import read_map

LOGS = sea.FOLDER


def run(*words):
    return CliRunner().invoke(app, ["log", *map(str, words)])


def test_a_log_is_shown_and_written(tmp_path):
    out = tmp_path / "dive.nc"
    result = run(LOGS / "kestrel.csv", "--map", LOGS / "kestrel.toml", "--craft", "hokie", "--out", out)
    assert result.exit_code == 0, result.output
    assert "kestrel dive 3 (synthetic), craft hokie: 60 instants in 5.9 s" in result.stdout
    assert "Nothing doubtful was found." in result.stdout
    for words in ("psi           deg", "2.9", "1.5 (a)", "x brought to the body origin from (0.9, 0.1, -0.2) m"):
        assert words in result.stdout, words
    log = read_log(out)
    assert log.craft == "hokie"
    np.testing.assert_allclose(log["z"], sea.truth(log.time)["z"], atol=1e-4)
    again = run(out)
    assert again.exit_code == 0
    assert "kestrel dive 3 (synthetic)" in again.stdout


def test_the_document_holds_channels_conversions_and_flags():
    result = run(LOGS / "heron.csv", "--map", LOGS / "heron.toml", "--json")
    assert result.exit_code == 0
    summary = json.loads(result.stdout)["summary"]
    assert summary["synthetic"] is True
    assert summary["start"].startswith("2026-05-02T09:30:00")
    assert summary["channels"]["z"]["samples"] == 59
    assert summary["channels"]["psi"]["rate"] == pytest.approx(10.0, rel=1e-3)
    assert {flag["kind"] for flag in summary["flags"]} == {"format"}
    assert any("-9999" not in text for text in summary["conversions"])


@pytest.mark.parametrize("form", [*FORMATS, "iver"])
def test_every_template_is_a_mapping(form, tmp_path):
    result = run("--template", form)
    assert result.exit_code == 0
    (tmp_path / "map.toml").write_text(result.stdout)
    assert len(read_map(tmp_path / "map.toml").channels) > 10


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no log is named"),
        (("absent.csv",), "does not exist"),
        ((LOGS / "kestrel.csv",), "a mapping must say what they hold"),
        ((LOGS / "kestrel.csv", "--map", "absent.toml"), "no ready schema has this name"),
        ((LOGS / "kestrel.csv", "--map", LOGS / "heron.toml"), "no column 'stamp'"),
        ((LOGS / "kestrel.csv", "--map", LOGS / "kestrel.csv"), "not a readable TOML file"),
        ((LOGS / "kestrel.csv", "--map", "iver"), "none of the mapped columns"),
        ((LOGS / "osprey.mat",), "a mapping must say"),
        ((LOGS / "petrel.bag", "--map", "ros"), "no message on"),
        ((LOGS, "--map", "imc"), "no file of the messages"),
        (("--template", "xlsx"), "is unknown"),
        ((LOGS / "tern.nc", "--map", LOGS / "tern.toml", "--craft", "nobody"), "nobody"),
        ((LOGS / "tern.nc", "--map", LOGS / "tern.toml", "--out", LOGS / "tern.nc"), "is the log itself"),
    ],
)
def test_bad_input_is_told_in_one_message(words, said):
    result = run(*words)
    assert result.exit_code == 2, result.output
    assert said in result.stderr
    assert "Traceback" not in result.output
    assert "unexpected" not in result.stderr
