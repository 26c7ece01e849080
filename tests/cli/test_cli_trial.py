"""``towtank trial``: every kind, a trial of one's own from a file, and the report of a study that holds them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.cli.trial import PARAMETERS, Kind

runner = CliRunner()
S_TURN = Path(__file__).parents[1] / "data" / "trial_s_turn.toml"
POINTS = ["--waypoint", "30 L, 0, 3 m", "--waypoint", "30L,25L,3,1.2 m/s"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of hokie with a model."""
    folder = tmp_path_factory.mktemp("trial") / "hokie"
    for words in (["plan", "hokie"], ["tow", "hokie"], ["derive", "hokie"]):
        result = runner.invoke(app, [*words, "--out", str(folder)])
        assert result.exit_code == 0, result.stderr
    return folder


def tried(study: Path, *words: str) -> dict:
    result = runner.invoke(app, ["trial", *words, "--out", str(study), "--json"])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


GIVEN = {
    Kind.ACCELERATION: (["--hold-course"], "acceleration", "distance_to_90_percent"),
    Kind.STOPPING: (["--throttle", "0"], "stopping-coasting", "track_reach"),
    Kind.REVERSE_SPIRAL: (["--angle", "12 deg"], "reverse-spiral-12deg", "loop_width"),
    Kind.MEANDER: (["--angle", "12 deg", "--pitch", "4 deg"], "meander-12-4", "period"),
    Kind.STEEP_DIVE: (["--pitch", "8 deg", "--depth", "5 m"], "steep-dive-8deg", "depth_overshoot"),
    Kind.WAYPOINT_MISSION: ([*POINTS, "--current", "0.1 m/s, -0.1 m/s"], "waypoint-mission", "thrust_energy"),
    Kind.LAWNMOWER: (["--legs", "1", "--current", "0.1, 0"], "lawnmower", "off_track_rms"),
}


@pytest.mark.parametrize("kind", GIVEN)
def test_a_kind_is_flown_with_its_options(study: Path, kind: Kind):
    options, name, index = GIVEN[kind]
    answer = tried(study, kind, *options, "--ballasted")
    assert answer["summary"]["name"] == name
    assert answer["summary"]["ended"] == "done"
    assert answer["summary"]["indices"][index]["value"] is not None
    assert Path(answer["files"]["trial"]).name == f"{name}.nc"


def test_a_file_is_flown_and_stands_in_the_index(study: Path):
    answer = tried(study, str(S_TURN), "--ballasted")
    assert answer["summary"]["indices"]["heading_overshoot"]["unit"] == "deg"
    index = json.loads((study / "trials" / "index.json").read_text())["trials"]
    assert {t["kind"] for t in index if t["name"] == "s-turn"} == {"user-defined"}


def test_a_heavy_craft_is_noted_and_ballasted_only_when_asked(study: Path):
    result = runner.invoke(app, ["trial", "stopping", "--out", str(study)])
    assert "note: Not trimmed" in result.stderr
    assert "ended early" in result.stdout
    result = runner.invoke(app, ["trial", "stopping", "--ballasted", "--out", str(study)])
    assert "note: Ballasted to neutral" in result.stderr
    assert "done" in result.stdout


def test_the_report_shows_every_kind(study: Path):
    for kind, (options, _, _) in GIVEN.items():
        tried(study, kind, *options, "--ballasted")
    tried(study, str(S_TURN), "--ballasted")
    result = runner.invoke(app, ["report", "--out", str(study)])
    assert result.exit_code == 0, result.stderr
    page = (study / "report.html").read_text()
    for words in (
        "Reverse spiral reverse-spiral-12deg", "Meander meander-12-4", "Steep dive steep-dive-8deg",
        "Acceleration acceleration", "Stopping, coasting stopping-coasting", "Waypoint mission waypoint-mission",
        "Lawnmower lawnmower", "User-defined s-turn",
    ):  # fmt: skip
        assert words in page, words


def test_every_kind_is_a_function_of_the_package():
    import inspect

    import towtank

    for kind in Kind:
        takes = inspect.signature(getattr(towtank, kind.name.lower())).parameters
        assert set(PARAMETERS[kind].values()) <= set(takes), kind


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["loop-the-loop", "hokie"], "is no trial. Those are: straight-run"),
        (["none.toml", "hokie"], "none.toml cannot be read"),
        ([str(S_TURN), "hokie", "--speed", "1 m/s"], "takes no --speed"),
        (["waypoint-mission", "hokie"], "needs points"),
        (["waypoint-mission", "hokie", "--waypoint", "100 m"], "waypoint 1.*no point"),
        (["waypoint-mission", "hokie", "--waypoint", "100 m, 5 kg"], "waypoint 1, east"),
        (["lawnmower", "hokie", "--current", "0.1 kg, 0"], "--current"),
        (["lawnmower", "hokie", "--current", "0.1"], "three finite numbers"),
        (["stopping", "hokie", "--throttle", "1"], "thrust astern"),
        (["meander", "hokie", "--depth", "3 m"], "takes no --depth"),
    ],
)
def test_what_cannot_be_tried_is_refused_with_the_reason(study: Path, words: list[str], said: str):
    import re

    result = runner.invoke(app, ["trial", *words, "--out", str(study)])
    assert result.exit_code == 2
    assert re.search(said, result.stderr.replace("\n", " ")), result.stderr
