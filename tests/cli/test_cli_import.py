"""``towtank import``: files of others become runs of a study, and the study goes on from there."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from towtank.cli.app import app
from towtank.tank.files import read_runs

DATA = Path(__file__).parents[1] / "data" / "import"
runner = CliRunner()


def call(*words) -> tuple[int, str, str]:
    result = runner.invoke(app, [str(word) for word in words])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def data(tmp_path, monkeypatch) -> Path:
    """A folder of one's own with the sample files, and the present folder."""
    shutil.copytree(DATA, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    return Path("data")


def test_import_says_what_it_converts_and_derive_goes_on_without_a_plan(data):
    code, out, err = call("import", data / "star.toml", "--out", "study")
    assert code == 0, err
    for words in (
        "axes of the file: forward -x, starboard y, down -z",
        "moments moved from",
        "3 m aft of the nose, to the origin",
        "half model cut at xz: X Z M doubled, Y K N zero",
        "units of the file: N, N-m",
        "steady: 10 samples from 31 to 40 averaged",
        "4 runs in study/runs. Next: towtank derive study",
    ):
        assert words in out
    assert {run.name for run in read_runs(Path("study"))} == {"drift-p08", "straight", "sway", "heave"}
    code, out, err = call("derive", "study", "--json")
    assert code == 0, err
    content = json.loads(out)
    assert content["summary"]["level"] == "known coefficients"
    assert not Path("study/plan.toml").exists()
    # The files hold 8 digits of loads of known coefficients; the drift run keeps exp(-30 / 4) = 6e-4 of its start.
    terms = {name: entry["value"] for name, entry in content["summary"]["terms"].items()}
    from synthetic_craft import SUBOFF, values
    from towtank.craft.library import read_craft

    exact = values(SUBOFF, read_craft("hokie"))
    for name in ("Yvdot", "Nvdot", "Yuv", "Nuv", "Yvv", "Xuu"):
        assert terms[name] == pytest.approx(exact[name], rel=5e-3), name


@pytest.mark.parametrize("name", ["openfoam", "sheet"])
def test_every_sample_is_imported(name, data):
    code, out, err = call("import", data / f"{name}.toml", "--json")
    assert code == 0, err
    content = json.loads(out)
    assert content["summary"]["runs"] == 1
    assert content["files"]["runs"] == "hokie/runs"
    told = content["summary"]["imported"]["sway"]
    assert told["id"].startswith("sway-")
    assert any("axes of the file" in text for text in told["conversions"])
    run = read_runs(Path("hokie"))[0]
    # Both files are of the same run; 8 and 9 digits of its loads.
    star = call("import", data / "star.toml", "--out", "star")
    assert star[0] == 0
    other = next(item for item in read_runs(Path("star")) if item.name == "sway")
    np.testing.assert_allclose(run.loads, other.loads, atol=1e-6 * np.abs(other.loads).max())


@pytest.mark.parametrize("form", ["star", "openfoam", "csv", "netcdf", "mat"])
def test_a_template_is_printed_and_only_lacks_the_files(form, data):
    code, out, _ = call("import", "--template", form)
    assert code == 0
    Path("map.toml").write_text(out, encoding="utf-8")
    code, _, err = call("import", "map.toml")
    assert code == 2
    assert "drift-p04" in err
    assert "does not exist" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "--template star"),
        (("nothing.toml",), "--template star"),
        (("--template", "fluent"), "star, openfoam, csv, netcdf, mat"),
        (("data/star.toml", "a.csv"), "1 files for 4 runs"),
        (("data/sway.csv",), "not a readable TOML file"),
    ],
)
def test_what_cannot_be_imported_is_bad_input_with_a_remedy(words, told, data):
    code, _, err = call("import", *words)
    assert code == 2
    assert told in err


def test_a_bad_file_among_good_ones_leaves_no_half_study(data):
    (data / "heave.csv").write_text("", encoding="utf-8")
    code, _, err = call("import", data / "star.toml")
    assert code == 2
    assert "heave.csv is empty" in err
    assert not Path("hokie").exists()


def test_files_of_the_command_stand_in_for_those_of_the_mapping(data):
    (data / "sheet.csv").rename("elsewhere.csv")
    assert call("import", data / "sheet.toml")[0] == 2
    code, out, err = call("import", data / "sheet.toml", "elsewhere.csv")
    assert code == 0, err
    assert "from elsewhere.csv" in out


def test_a_run_imported_again_with_other_keys_takes_the_place_of_the_first(data):
    call("import", data / "star.toml")
    first = {run.id for run in read_runs(Path("hokie"))}
    assert call("import", data / "star.toml")[0] == 0
    assert {run.id for run in read_runs(Path("hokie"))} == first
    text = (data / "star.toml").read_text("utf-8")
    (data / "star.toml").write_text(text.replace('from_nose = "3 m"', 'from_nose = "3.1 m"'), encoding="utf-8")
    code, _, err = call("import", data / "star.toml")
    assert code == 0
    assert "was imported before" in err
    again = read_runs(Path("hokie"))
    assert len(again) == 4
    assert not first & {run.id for run in again}


def test_a_study_with_a_plan_is_not_imported_into(data):
    assert call("plan", "hokie")[0] == 0
    code, _, err = call("import", data / "star.toml")
    assert code == 2
    assert "plan.toml is there" in err
    assert "--out DIR" in err


@pytest.mark.parametrize("command", ["run", "plan", "tow"])
def test_no_plan_is_laid_over_imported_runs(command, data):
    assert call("import", data / "star.toml", "--out", "study")[0] == 0
    code, _, err = call(command, "study")
    assert code == 2
    assert "holds imported runs and no plan" in err
    assert not Path("study/plan.toml").exists()


def test_imported_runs_of_three_meshes_make_a_grid_study(data):
    text = (data / "sheet.toml").read_text("utf-8")
    head, *rows = (data / "sheet.csv").read_text("utf-8").splitlines()
    for label, cells in (("coarse", 1_000_000), ("medium", 8_000_000), ("fine", 64_000_000)):
        # An error of second order: 4 % on the coarse mesh, a quarter of it on each halving of the cells' size.
        factor = 1.0 + 0.04 * (1_000_000 / cells) ** (2.0 / 3.0)
        made = [";".join([*row.split(";")[:3], *(scaled(cell, factor) for cell in row.split(";")[3:])]) for row in rows]
        (data / "sheet.csv").write_text("\n".join([head, *made]), encoding="utf-8")
        (data / "sheet.toml").write_text(text + f'mesh = {{ label = "{label}", cells = {cells} }}\n', encoding="utf-8")
        assert call("import", data / "sheet.toml", "--out", label)[0] == 0
    code, out, err = call("grid", "coarse", "medium", "fine", "--out", "grid", "--json")
    assert code == 0, err
    assert json.loads(out)["summary"]["meshes"] == {"coarse": 1_000_000, "medium": 8_000_000, "fine": 64_000_000}


def scaled(cell: str, factor: float) -> str:
    return f"{float(cell.replace(',', '.')) * factor:.9g}".replace(".", ",")


def test_the_page_on_mappings_names_every_key_and_column():
    from towtank.tank.imported.mapping import COLUMN_UNITS, MOTION_KINDS
    from towtank.tank.imported.reading import _RUN_KEYS

    page = (Path(__file__).parents[2] / "docs" / "import.md").read_text("utf-8")
    assert [key for key in (*_RUN_KEYS, "schema", "craft", *MOTION_KINDS) if f"`{key}`" not in page] == []
    shown = (
        page.replace("udot` .. `rdot", " ".join(f"{rate}dot" for rate in "uvwpqr")).replace("`", " ").replace(";", " ")
    )
    assert [name for name in COLUMN_UNITS if f" {name} " not in shown] == []


def test_plan_export_writes_what_import_reads_back(data):
    code, out, err = call("plan", "hokie", "--export", "star")
    assert code == 0, err
    assert "TowtankPlan.java" in out
    assert len(list(Path("star/motions").glob("*.csv"))) > 50
    code, _, err = call("import", "star/import.toml", "--out", "back")
    assert code == 2
    assert "monitors" in err  # the mapping is whole: only the monitors are not there yet
    assert "does not exist" in err
