"""The page on campaigns says what the code does."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from pathlib import Path

from typer.main import get_command

from towtank.cli.app import app
from towtank.tank.openfoam.case import WRITE_EVERY, WRITES_PER_PERIOD
from towtank.tank.openfoam.schedule import Pace
from towtank.tank.openfoam.slurm import SlurmSettings, read_settings

PAGE = (Path(__file__).parents[2] / "docs" / "openfoam-campaign.md").read_text(encoding="utf-8")
SHARED = {"--out", "--json", "--debug", "--help"}


def test_every_option_of_tow_has_its_row():
    tow = get_command(app).commands["tow"]  # type: ignore[attr-defined]
    options = {name for option in tow.params for name in option.opts if name.startswith("--")} - SHARED
    rows = {word for line in PAGE.splitlines() if line.startswith("| `--") for word in re.findall(r"--\w+", line)}
    assert options <= rows


def test_the_settings_file_of_the_page_is_whole_and_can_be_read(tmp_path):
    block = re.search(r"    # cluster\.toml.*?(?=\n\n)", PAGE, re.DOTALL)
    assert block is not None
    text = re.sub(r"^    ", "", block[0], flags=re.MULTILINE)
    (tmp_path / "cluster.toml").write_text(text)
    assert read_settings(tmp_path / "cluster.toml").at_once == tomllib.loads(text)["at_once"]
    assert set(tomllib.loads(text)) == {item.name for item in fields(SlurmSettings)}


def test_the_figures_of_the_estimate_are_those_of_the_code():
    pace = Pace()
    assert f"{1e5 * pace.steady:.2f} s for 100 thousand cells" in PAGE
    assert f"{1e5 * pace.unsteady:.1f} s for 100 thousand cells" in PAGE
    assert f"{pace.iterations:.0f} iterations" in PAGE
    assert (f"every {WRITE_EVERY} iterations" in PAGE, WRITES_PER_PERIOD) == (True, 4)
