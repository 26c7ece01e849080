"""Files of runs: exact round trip, names of the variables, broken files."""

import time
from dataclasses import fields, replace

import h5netcdf
import numpy as np
import pytest

from towtank.craft.library import read_craft
from towtank.errors import ArtefactError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Roll, Surge, Sway, Yaw
from towtank.progress import Silent
from towtank.symbols import LOADS, RATES
from towtank.tank.files import amplitude, read_run, read_runs, run_path, write_run
from towtank.tank.lpm import LpmTank

HOKIE = read_craft("hokie")
TANK = LpmTank({"Xuu": -50.0, "Yuv": -300.0, "Yvv": -400.0, "Yvdot": -4800.0, "Nuv": -3000.0, "Kup": -30.0}, noise=0.02)


def full_run(motion=None, **changes):
    """A run with everything a run may hold: parts, ensemble in single precision, flags."""
    run = TANK.run(HOKIE, CaptiveTest("x", 1.0, motion or Sway(1.0, 0.8, 0.2), (0.1, 0.0, -0.1, 0.0)), Silent())
    random = np.random.default_rng(1)
    parts = {"tail": random.normal(size=run.loads.shape), "cross-flow": random.normal(size=run.loads.shape)}
    ensemble = random.normal(size=(5, *run.loads.shape)).astype(np.float32).astype(float)
    flags = ("drift beyond 20 deg: 21.3", "été")
    provenance = {**run.provenance, "constants": {"a": 1.5, "b": [1, 2.25]}}
    return replace(run, parts=parts, ensemble=ensemble, flags=flags, exploratory=True, provenance=provenance, **changes)


def assert_same(one, other):
    for item in fields(one):
        first, second = getattr(one, item.name), getattr(other, item.name)
        if item.name == "history":
            for key, values in vars(first).items():
                np.testing.assert_array_equal(values, getattr(second, key), err_msg=key)
        elif item.name == "parts":
            assert list(first) == list(second)
            for part in first:
                np.testing.assert_array_equal(first[part], second[part], err_msg=part)
        elif isinstance(first, np.ndarray):
            np.testing.assert_array_equal(first, second, err_msg=item.name)
        else:
            assert first == second, item.name


@pytest.mark.parametrize("motion", [Sway(1.0, 0.8, 0.2), Drift(1.0, -0.1)], ids=["sway", "drift"])
def test_a_run_comes_back_exactly(tmp_path, motion):
    run = full_run(motion)
    assert_same(read_run(write_run(run, tmp_path / "run.nc")), run)


def test_a_run_of_a_craft_without_fins_comes_back_exactly(tmp_path):
    run = TANK.run(read_craft("spheroid-6-1"), CaptiveTest("x", 1.0, Yaw(1.0, 0.1, 0.5)), Silent())
    assert run.delta.shape == (193, 0)
    assert_same(read_run(write_run(run, tmp_path / "run.nc")), run)


def test_variables_have_the_names_units_and_dimensions_of_the_contract(tmp_path):
    path = write_run(full_run(), tmp_path / "run.nc")
    with h5netcdf.File(path, "r") as file:
        names = {*LOADS, *RATES, *(f"{rate}dot" for rate in RATES), "x", "y", "z", "phi", "theta", "psi"}
        for name in names:
            assert file.variables[name].dimensions == ("time",)
            assert file.variables[name].attrs["units"]
        assert file.variables["delta"].dimensions == ("time", "fin")
        assert file.variables["ensemble"].dimensions == ("member", "time", "load")
        assert file.variables["ensemble"].dtype == np.float32
        assert file.variables["N_tail"].attrs["units"] == "N m"
        for key in ("level", "kind", "amplitude", "frequency", "speed", "flags", "provenance", "schema"):
            assert key in file.attrs
        assert file.attrs["schema"] == "towtank/run/1"
        assert file.attrs["frequency"] == pytest.approx(0.2)


def test_the_dataset_has_the_same_content_with_units():
    run = full_run()
    data = run.dataset()
    np.testing.assert_array_equal(data["Y"].values, run.loads[:, 1])
    assert data["Y"].attrs["units"] == "N"
    assert data.sizes["time"] == 193
    assert data.attrs["level"] == "known coefficients"


@pytest.mark.parametrize(
    ("motion", "expected"),
    [(Sway(1.0, 0.8, 0.2), 0.8), (Yaw(1.0, 0.3, 0.2), 0.3), (Roll(1.0, 0.25, 0.4), 0.25), (Surge(1.0, 0.5, 0.3), 0.5),
     (Drift(1.0, 0.1), 0.0)],
)  # fmt: skip
def test_the_amplitude_is_found_in_the_motion(motion, expected):
    run = TANK.run(HOKIE, CaptiveTest("x", 1.0, motion), Silent())
    assert amplitude(run) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.97])
def test_a_cut_run_file_is_refused_with_the_remedy(tmp_path, share):
    path = write_run(full_run(), tmp_path / "run.nc")
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(ArtefactError, match=r"run\.nc .*Delete it"):
        read_run(path)


def test_a_file_without_a_variable_of_a_run_is_refused(tmp_path):
    path = tmp_path / "run.nc"
    with h5netcdf.File(path, "w") as file:
        file.attrs["schema"] = "towtank/run/1"
    with pytest.raises(ArtefactError, match="not a whole run"):
        read_run(path)


def test_missing_files_and_folders_without_runs_are_told(tmp_path):
    with pytest.raises(ArtefactError, match="does not exist"):
        read_run(tmp_path / "run.nc")
    with pytest.raises(ArtefactError, match="holds no runs"):
        read_runs(tmp_path)


def test_runs_of_a_folder_are_read_in_order(tmp_path):
    for name in ("b", "a"):
        write_run(full_run(id=name), run_path(tmp_path, name))
    assert [run.id for run in read_runs(tmp_path)] == ["a", "b"]
    assert [run.id for run in read_runs(tmp_path / "runs")] == ["a", "b"]


def test_writing_a_run_costs_milliseconds(tmp_path):
    run = full_run()
    write_run(run, tmp_path / "first.nc")
    spent = []
    for i in range(10):
        start = time.process_time()
        write_run(run, tmp_path / f"{i}.nc")
        spent.append(time.process_time() - start)
    # 4 ms of one core measured; h5netcdf needs 200 ms. The margin is for slow and busy machines.
    assert min(spent) < 0.04
