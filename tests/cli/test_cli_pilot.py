"""``towtank pilot``, ``towtank tune`` and ``towtank trial --pilot``: files, words, exit codes."""

from __future__ import annotations

import builtins
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.pilot.files import read_pilot, read_schedule
from towtank.trials.files import read_trajectory

runner = CliRunner()


def answer(*words: str, code: int = 0) -> tuple[dict, str]:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, (result.stdout, result.stderr)
    return json.loads(result.stdout), result.stderr


@pytest.fixture(scope="module")
def derived(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of remus100 up to its derivatives."""
    folder = tmp_path_factory.mktemp("pilot") / "remus100"
    for words in (["plan", "remus100"], ["tow", "remus100"], ["derive", "remus100"]):
        result = runner.invoke(app, [*words, "--out", str(folder)])
        assert result.exit_code == 0, result.stderr
    return folder


@pytest.fixture
def study(derived: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(derived, tmp_path / "remus100"))


def test_a_trial_under_the_gains_of_a_vehicle_stands_beside_the_others(study: Path):
    answer("trial", "heading-step", "--out", str(study))
    told = answer("trial", "heading-step", "--pilot", "lauv-default", "--out", str(study))[0]
    assert told["summary"]["name"] == "heading-step-30deg-lauv-default"
    own, vehicle = (
        read_trajectory(study / "trials" / f"{name}.nc")
        for name in ("heading-step-30deg", "heading-step-30deg-lauv-default")
    )
    assert vehicle.indices["fin_travel"][0] != pytest.approx(own.indices["fin_travel"][0], rel=0.1)
    assert any("LAUV, default gains" in note for note in vehicle.provenance["notes"])


def test_with_a_pilot_the_elevator_works_in_a_trial_whose_rudder_is_ordered(study: Path):
    words = ("trial", "straight-run", "--out", str(study))
    names = [answer(*words, *more)[0]["summary"]["name"] for more in ((), ("--pilot", "lqi"))]
    free, held = (read_trajectory(study / "trials" / f"{name}.nc").command for name in names)
    # By itself nothing moves in a straight run; a craft that is a little off its trim is held by the pilot.
    assert np.ptp(free[:, 1]) == 0.0 < np.ptp(held[:, 1])


def test_a_schedule_is_written_and_a_trial_picks_the_pilot_of_its_speed(study: Path):
    told = answer("pilot", "--pilot", "lqi", "--speeds", "2.25 m/s,1.2 m/s,1.6 m/s", "--out", str(study))[0]
    table = read_schedule(study / "pilot.json")
    assert table.speeds == (1.2, 1.6, 2.25)
    assert [row["speed"] for row in told["summary"]["speeds"]] == [1.2, 1.6, 2.25]
    assert all(row["growth"] < 0.0 and "gain x" in row["margins"] for row in told["summary"]["speeds"])
    assert Path(told["files"]["figure"]).read_bytes()[:4] == b"\x89PNG"
    words = ("trial", "heading-step", "--pilot", str(study / "pilot.json"), "--out", str(study))
    slow, fast = (answer(*words, "--speed", speed)[0]["summary"] for speed in ("1.4 m/s", "2.25 m/s"))
    assert slow["name"] == fast["name"] == "heading-step-30deg-pilot"
    # Both are designs for their speed: the same turn in lengths, so in time by the ratio of the speeds.
    times = [trial["indices"]["rise_time"]["value"] for trial in (slow, fast)]
    assert times[0] / times[1] == pytest.approx(2.25 / 1.4, rel=0.1)


def test_tune_writes_a_pilot_that_costs_less_and_flies(study: Path):
    told = answer("tune", "--steps", "heading-step", "--drawn", "1", "--rounds", "3", "--out", str(study))[0]
    summary, tuned = told["summary"], json.loads((study / "tune.json").read_text())
    assert summary["after"]["cost"] < summary["before"]["cost"] == tuned["before"]["cost"]
    assert tuned["provenance"]["inputs"]["derivatives"]
    assert summary["speeds"] == pytest.approx([1.5, 2.25])
    pilot = read_pilot(study / "pilot.json")
    assert pilot.yaw_rate == summary["gains"]["yaw_rate"]["after"]
    flown = answer("trial", "heading-step", "--pilot", str(study / "pilot.json"), "--out", str(study))[0]
    assert np.isfinite(flown["summary"]["indices"]["settling_time"]["value"])


def test_tune_prints_before_and_after(study: Path):
    result = runner.invoke(
        app, ["tune", "--steps", "heading-step", "--drawn", "0", "--rounds", "0", "--out", str(study)]
    )
    assert result.exit_code == 0, result.stderr
    for words in ("cost ", "fin angles", "heading-step   1.5 m/s", "phase ", "yaw_rate"):
        assert words in result.stdout


@pytest.mark.parametrize(("words", "told"), [
    (("trial", "heading-step", "--pilot", "nobody"), "neither a file nor a name"),
    (("tune", "--pilot", "lauv-defult"), "lauv-default"),
    (("tune", "--speeds", "0 m/s"), "above zero"),
    (("tune", "--steps", "zigzag"), "heading-step, depth-step, both"),
    (("tune", "--speeds", "0.3 m/s,1 m/s"), "acts reversed"),
    (("pilot", "--pilot", "lauv-default", "--speeds", "1 m/s,2 m/s"), "constant over speed"),
])  # fmt: skip
def test_bad_input_is_told(derived: Path, words: tuple[str, ...], told: str):
    document, err = answer(*words, "--out", str(derived), code=2)
    assert told in document["error"]
    assert told in err


def test_without_python_control_tune_names_the_extra_and_pilot_goes_on(study: Path, monkeypatch: pytest.MonkeyPatch):
    real = builtins.__import__

    def absent(name, *args, **kwargs):
        if name == "control":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", absent)
    document, _ = answer("tune", "--steps", "heading-step", "--rounds", "0", "--out", str(study), code=3)
    assert "towtank[control]" in document["error"]
    told, err = answer("pilot", "--out", str(study))
    assert told["summary"]["speeds"][0]["margins"] == "margins not known"
    assert "towtank[control]" in err
