"""The README does what it says."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from towtank.cli.app import app

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")


def test_the_script_runs_as_printed(tmp_path: Path):
    (script,) = re.findall(r"```python\n(.*?)```", README, flags=re.S)
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "hokie.html").stat().st_size > 10_000


def test_every_command_it_names_exists():
    named = set(re.findall(r"^\s+towtank (\w+)", README, flags=re.M))
    assert len(named) >= 3
    for command in named:
        assert CliRunner().invoke(app, [command, "--help"]).exit_code == 0


def test_every_file_and_target_it_names_exists():
    makefile = (ROOT / "Makefile").read_text()
    for path in re.findall(r"`((?:docs|src|tests)/[\w./-]*|[A-Z]+\.(?:md|cff))`", README):
        assert (ROOT / path).exists(), path
    for target in re.findall(r"^\s+make (\w+)", README, flags=re.M):
        assert f"\n{target}:" in makefile
