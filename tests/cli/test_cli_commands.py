"""Commands answer with text or one JSON document, and with the exit code that fits."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.provenance import VERSION

COMMANDS = (
    "run",
    "new",
    "check",
    "plan",
    "tow",
    "import",
    "status",
    "derive",
    "trial",
    "pilot",
    "tune",
    "mc",
    "log",
    "sea",
    "compare",
    "calibrate",
    "assess",
    "report",
    "doctor",
)
runner = CliRunner()


def call(*words: str) -> tuple[int, str, str]:
    result = runner.invoke(app, list(words))
    return result.exit_code, result.stdout, result.stderr


def document(stdout: str) -> dict:
    """The one JSON document on stdout."""
    content = json.loads(stdout)
    assert {"schema", "status", "files", "summary", "wall_s"} <= set(content)
    return content


def test_version():
    assert call("--version") == (0, f"towtank {VERSION}\n", "")


def test_help_lists_every_command():
    code, out, _ = call("--help")
    assert code == 0
    assert all(f"  {name} " in out for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_has_an_example_and_the_common_options(name: str):
    code, out, _ = call(name, "--help")
    assert code == 0
    assert f"Example: towtank {name}" in out
    assert "--json" in out
    assert "--debug" in out


def test_the_page_on_commands_names_each_with_its_options():
    page = (Path(__file__).parents[2] / "docs" / "cli.md").read_text("utf-8")
    assert all(f"towtank {name}" in page for name in COMMANDS)


def test_an_unknown_option_is_bad_input():
    code, _, err = call("check", "hokie", "--nonsense")
    assert code == 2
    assert "--nonsense" in err


def test_help_does_not_load_the_numerical_libraries():
    """So that it answers at once; numpy alone takes longer than the rest."""
    script = "import sys, towtank.cli.app; print(*(m for m in ('numpy', 'scipy', 'pint', 'rich') if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_the_package_runs_as_a_module():
    done = subprocess.run([sys.executable, "-m", "towtank", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"towtank {VERSION}\n"


def test_check_of_a_library_craft_prints_its_hydrostatics():
    code, out, _ = call("check", "remus100")
    assert code == 0
    assert "displaced mass" in out
    assert "wetted area" in out


def test_check_in_json_holds_the_numbers_and_findings():
    code, out, _ = call("check", "spheroid-6-1", "--json")
    content = document(out)
    assert code == 0
    assert content["status"] == "ok"
    h = content["summary"]["hydrostatics"]
    assert h["length"] / h["diameter"] == pytest.approx(6.0, rel=1e-6)
    assert all(f["severity"] in ("error", "warning", "note") and f["message"] for f in content["summary"]["findings"])


def test_check_writes_the_solid_only_when_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert call("check", "spheroid-6-1")[0] == 0
    assert list(tmp_path.iterdir()) == []
    code, out, _ = call("check", "spheroid-6-1", "--out", "here", "--json")
    assert code == 0
    assert all(Path(path).stat().st_size > 1000 for path in document(out)["files"].values())


def test_new_writes_a_craft_that_checks_and_never_overwrites(tmp_path: Path):
    assert call("new", "mine", "--out", str(tmp_path))[0] == 0
    path = tmp_path / "mine.toml"
    assert call("check", str(path))[0] == 0
    path.write_text("precious")
    code, _, err = call("new", "mine", "--out", str(tmp_path))
    assert code == 2
    assert "exists" in err
    assert path.read_text() == "precious"


@pytest.mark.parametrize("name", ["../escape", "", "a b", ".hidden", "x/y"])
def test_new_refuses_a_name_that_cannot_name_files(name: str, tmp_path: Path):
    assert call("new", name, "--out", str(tmp_path))[0] == 2
    assert list(tmp_path.iterdir()) == []


def test_doctor_says_versions_and_remedies_and_ends_well():
    import numpy

    code, out, _ = call("doctor", "--json")
    items = {item["name"]: item for item in document(out)["summary"]["items"]}
    assert code == 0
    assert items["numpy"]["version"] == numpy.__version__
    assert {"python", "C compiler", "OpenFOAM", "casadi"} <= set(items)
    assert all(item["installed"] or item["remedy"] for item in items.values())
    assert call("doctor")[0] == 0


def test_doctor_names_what_is_missing(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("WM_PROJECT_VERSION", raising=False)
    _, out, _ = call("doctor", "--json")
    assert {"C compiler", "OpenFOAM"} <= set(document(out)["summary"]["missing"])


def test_an_unknown_craft_is_bad_input_and_the_near_name_is_offered():
    code, out, err = call("check", "hokey", "--json")
    assert code == 2
    assert document(out)["status"] == "failed"
    assert "hokie" in err
    assert "Traceback" not in err


def test_debug_adds_the_traceback():
    assert "Traceback" in call("check", "hokey", "--debug")[2]


def test_an_unexpected_fault_is_told_in_one_line_and_exit_code_three(monkeypatch: pytest.MonkeyPatch):
    def broken(_source: str) -> None:
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr("towtank.craft.library.read_craft", broken)
    code, _, err = call("check", "hokie")
    assert code == 3
    assert "ZeroDivisionError" in err
    assert "--debug" in err
    assert "Traceback" not in err


def test_without_a_craft_and_outside_a_study_the_remedy_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = call("status")
    assert code == 2
    assert "--out" in err
