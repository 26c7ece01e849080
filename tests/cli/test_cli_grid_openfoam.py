"""``towtank grid --tank openfoam``: real solvers on three meshes of a few thousand cells, and the way into the fit."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.craft.library import read_craft
from towtank.derive.files import read_derivatives
from towtank.errors import InputError
from towtank.grid.files import read_grid
from towtank.grid.rans import RESOLUTIONS, family, rans_plan
from towtank.report.build import report_study
from towtank.tank.files import read_runs
from towtank.tank.openfoam.distribution import distribution
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.tank import PRESETS, OpenFoamTank

DRAFT = (MeshSettings(along=24, around=8, out=10, y_plus=60.0, far=2.5), Numerics(steps=32, ramp=0.25, iterations=120))
"""In place of the preset's, for meshes of 1.8 to 6 thousand cells."""
THREE = ["--resolutions", "1.5,1,1.25", "--jobs", "2"]
MESHES = ("24x10x8-y60", "24x10x8-y60-r1.25", "24x10x8-y60-r1.5")
NAMES = {"drift-p04", "drift-p12", "sway-v0.12-w2"}

runner = CliRunner()


def answer(*words: str, code: int = 0) -> dict[str, Any]:
    result = runner.invoke(app, [*words, "--json"])
    assert result.exit_code == code, result.stderr
    found: dict[str, Any] = json.loads(result.stdout)
    return found


@pytest.fixture(scope="module", autouse=True)
def small() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PRESETS, "draft", DRAFT)
        yield


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("grid") / "study"
    return folder, answer("grid", "suboff-bare", "--tank", "openfoam", *THREE, "--out", str(folder))


def test_drift_and_sway_are_towed_on_three_meshes_of_one_family(studied: tuple[Path, dict[str, Any]]):
    folder, told = studied
    study = read_grid(folder / "grid.json")
    assert (study.level, told["summary"]["level"]) == ("rans", "rans")
    assert tuple(mesh.label for mesh in study.meshes) == MESHES
    assert told["summary"]["refinement"] in (1.0, 1.25, 1.5)
    assert study.chosen in MESHES
    for label in MESHES:
        assert {run.name for run in read_runs(folder / "grid" / label)} == NAMES
    found = {(item.kind, item.load, item.measure) for item in study.quantities}
    assert {("drift", "Y", "steady"), ("sway", "Y", "in phase"), ("sway", "N", "quadrature")} <= found
    for mesh in study.meshes:
        carried = study.provenance["distribution"][mesh.label]
        assert set(carried) == NAMES
        assert sum(distribution(carried["sway-v0.12-w2"]).courant) == pytest.approx(1.0)


def test_asking_again_runs_nothing_and_gives_the_same(studied: tuple[Path, dict[str, Any]]):
    folder, told = studied
    before = {path: path.stat().st_mtime_ns for path in folder.glob("grid/*/runs/*/run.nc")}
    again = answer("grid", "--tank", "openfoam", *THREE, "--out", str(folder))
    assert {path: path.stat().st_mtime_ns for path in folder.glob("grid/*/runs/*/run.nc")} == before
    assert again["summary"] == told["summary"]


def test_the_study_enters_the_fit_of_runs_in_openfoam_and_the_report(
    studied: tuple[Path, dict[str, Any]], tmp_path: Path
):
    folder = tmp_path / "study"
    shutil.copytree(studied[0], folder)
    # The runs of a mesh are those of a campaign on it: the same identity, so that none is made again.
    shutil.copytree(folder / "grid" / MESHES[1] / "runs", folder / "runs")
    asked = ["--tank", "openfoam", "--refinement", "1.25", "--only", ",".join(sorted(NAMES)), "--out", str(folder)]
    before = {path: path.stat().st_mtime_ns for path in folder.glob("runs/*/run.nc")}
    answer("tow", "suboff-bare", *asked)
    assert {path: path.stat().st_mtime_ns for path in folder.glob("runs/*/run.nc")} == before
    answer("derive", "--out", str(folder))
    derived = read_derivatives(folder / "derivatives.json")
    mesh = np.sqrt(np.diag(derived.covariance_mesh))
    assert mesh[derived.names.index("Yuv")] > 0.0
    page = report_study(folder, tmp_path / "report.html").read_text()
    for words in ("Mesh study", "Resolution of the meshes", "Resolution of the runs in OpenFOAM", "y+ on the walls"):
        assert words in page


def test_runs_of_another_tank_or_mesh_are_refused(studied: tuple[Path, dict[str, Any]], tmp_path: Path):
    folder = tmp_path / "study"
    folder.mkdir()
    shutil.copy(studied[0] / "grid.json", folder / "grid.json")
    answer("tow", "suboff-bare", "--only", "drift", "--out", str(folder))
    told = answer("derive", "--out", str(folder), code=2)
    assert "the grid study 'rans'" in told["error"]
    shutil.copytree(studied[0] / "grid" / MESHES[0] / "runs", folder / "runs", dirs_exist_ok=True)
    document = json.loads((folder / "grid.json").read_text().replace(MESHES[0], "other"))
    (folder / "grid.json").write_text(json.dumps(document))
    asked = ["--tank", "openfoam", "--only", ",".join(sorted(NAMES)), "--out", str(folder)]
    answer("tow", *asked)
    assert f"made on mesh '{MESHES[0]}'" in answer("derive", "--out", str(folder), code=2)["error"]


def test_a_finned_craft_is_also_towed_with_its_rudder_and_in_incidence_where_that_tells_more():
    assert {test.name for test in rans_plan(read_craft("suboff-bare")).tests} == NAMES
    assert {test.name for test in rans_plan(read_craft("hokie")).tests} == {*NAMES, "rudder-p10"}


@pytest.mark.parametrize("quality", ["draft", "standard", "fine"])
def test_the_meshes_of_the_default_study_are_alike(quality: str, monkeypatch: pytest.MonkeyPatch):
    if quality == "draft":
        monkeypatch.setitem(PRESETS, "draft", (MeshSettings(along=60, around=16, out=32), Numerics()))
    shapes = [OpenFoamTank(quality, refinement=factor).mesh_settings.counts() for factor in RESOLUTIONS[quality]]
    # Each count is a whole number, within half a cell of its share; those around are multiples of four.
    for factor, counts in zip(RESOLUTIONS[quality], shapes, strict=True):
        for count, one in zip(counts, shapes[1], strict=True):
            assert count == pytest.approx(factor * one, abs=0.51)


@pytest.mark.parametrize(
    ("craft", "resolutions", "named"),
    [
        ("suboff-bare", (1.0, 1.25), "3 different"),
        ("suboff-bare", (1.0, 1.0, 1.5), "3 different"),
        ("suboff-bare", (1.0, 1.04, 1.5), "refinement ratios"),
        ("suboff-bare", (0.5, 1.0, 1.5), "after refinement"),
        ("suboff-bare", (0.1, 1.0, 1.5), "outside 0.2 to 8"),
        ("hokie", (1.0, 1.5, 2.0), "chord of the fins"),
    ],
)
def test_meshes_that_make_no_study_are_refused_before_a_run(craft: str, resolutions: tuple[float, ...], named: str):
    read = read_craft(craft)
    with pytest.raises(InputError, match=named):
        family(read, rans_plan(read), resolutions, OpenFoamTank())


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--quality", "fine"], "--tank openfoam"),
        (["--tank", "openfoam", "--quality", "superb"], "draft, standard, fine"),
        (["--tank", "openfoam", "--resolutions", "1,2"], "3 different"),
        (["--tank", "openfoam", "--jobs", "0"], "at least one"),
    ],
)
def test_a_bad_study_writes_nothing(words: list[str], named: str, tmp_path: Path):
    told = answer("grid", "suboff-bare", *words, "--out", str(tmp_path / "study"), code=2)
    assert named in told["error"]
    assert not (tmp_path / "study").exists()
