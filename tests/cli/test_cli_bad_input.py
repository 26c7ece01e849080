"""Bad input ends with code 2, a message that names the fault, no traceback, and nothing written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.craft.template import template

runner = CliRunner()

FAULTS = {
    "negative mass": ('mass     = "53.84 kg"', 'mass     = "-53.84 kg"', "mass"),
    "zero diameter": ('diameter   = "0.20 m"', 'diameter   = "0 m"', "diameter"),
    "cg outside the hull": ('z = "0.01 m"', 'z = "0.5 m"', "cg"),
    "fins off the body": ('trailing_edge = "1.88 m"', 'trailing_edge = "2.60 m"', "fin"),
    "unknown key": ('nose       = "0.25 m"', 'nose       = "0.25 m"\nbanana = 3', "banana"),
    "bare angle": ('tail_angle = "20 deg"', "tail_angle = 20", "bare angle"),
    "not a number": ('nose       = "0.25 m"', "nose       = nan", "nose"),
    "infinite": ('density = "1026 kg/m^3"', "density = inf", "density"),
    "wrong dimension": ('speed   = "1.5 m/s"', 'speed   = "1.5 kg"', "speed"),
    "not TOML": ("[hull]", "[hull", "TOML"),
    "missing table": ("[hull]", "[hull_of_another]", "hull"),
}


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(("old", "new", "named"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_craft_is_refused(old: str, new: str, named: str, command: str, tmp_path: Path):
    text = template("faulty")
    assert text.count(old) == 1
    path = tmp_path / "faulty.toml"
    path.write_text(text.replace(old, new))
    study = tmp_path / "study"
    result = runner.invoke(app, [command, str(path), "--out", str(study), "--json"])
    answer = json.loads(result.stdout)
    assert result.exit_code == answer["exit_code"] == 2
    assert answer["status"] == "failed"
    assert named in answer["error"]
    assert answer["error"] in result.stderr
    assert "Traceback" not in result.stderr
    assert not study.exists()


def test_all_faults_of_a_file_are_told_at_once(tmp_path: Path):
    path = tmp_path / "faulty.toml"
    text = template("faulty").replace('"53.84 kg"', '"-1 kg"').replace('tail_angle = "20 deg"', "tail_angle = 20")
    path.write_text(text)
    result = runner.invoke(app, ["check", str(path)])
    assert "mass" in result.stderr
    assert "bare angle" in result.stderr


@pytest.mark.parametrize("text", ["", "\x00\x01\x02", "a = 1", "[craft]\nname = 3"])
def test_a_file_that_is_no_craft_is_refused(text: str, tmp_path: Path):
    path = tmp_path / "none.toml"
    path.write_text(text)
    result = runner.invoke(app, ["check", str(path)])
    assert result.exit_code == 2
    assert "none.toml" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("speed", ["fast", "nan m/s", "-1 m/s", "0 m/s", "3 kg"])
def test_a_speed_that_is_none_is_refused(speed: str, tmp_path: Path):
    result = runner.invoke(app, ["plan", "spheroid-6-1", "--speed", speed, "--out", str(tmp_path / "study")])
    assert result.exit_code == 2
    assert "speed" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", ["run", "plan", "tow"])
def test_a_folder_that_cannot_be_written_is_refused(command: str, tmp_path: Path):
    """Below a regular file no folder can be made, whoever asks; permissions would not stop the superuser."""
    (tmp_path / "file").write_text("kept")
    result = runner.invoke(app, [command, "spheroid-6-1", "--out", str(tmp_path / "file" / "study")])
    assert result.exit_code == 2
    assert "cannot write" in result.stderr
    assert "--out" in result.stderr
    assert "Traceback" not in result.stderr
    assert (tmp_path / "file").read_text() == "kept"


def test_a_read_only_file_system_is_refused():
    """The kernel's own tree takes no files, not even from the superuser."""
    result = runner.invoke(app, ["new", "mine", "--out", "/proc/self"])
    assert result.exit_code == 2
    assert "cannot write" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", ["derive", "assess", "report"])
def test_a_stage_without_its_input_names_the_stage_before(command: str, tmp_path: Path):
    result = runner.invoke(app, [command, "spheroid-6-1", "--out", str(tmp_path / "empty")])
    assert result.exit_code == 2
    assert "towtank" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_trial_says_which_options_it_takes():
    result = runner.invoke(app, ["trial", "depth-step", "hokie", "--angle", "10 deg"])
    assert result.exit_code == 2
    assert "--depth" in result.stderr


def test_an_unknown_trial_is_refused_with_the_list():
    result = runner.invoke(app, ["trial", "loop-the-loop", "hokie"])
    assert result.exit_code == 2
    assert "zigzag" in result.stderr
