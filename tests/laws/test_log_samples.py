"""Every reader gives the motion that its sample was made from, at the body origin, in our axes and SI."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import sea_samples as sea
from towtank.errors import InputError
from towtank.field.reading import read_sea_log

LOGS = sea.FOLDER
ANGLES = ("phi", "theta", "psi")


def apart(log, names, tolerances, at=None):
    """Largest difference from the truth of each channel, over its tolerance."""
    true = sea.truth(log.time if at is None else at)
    worst = {}
    for name, tolerance in zip(names.split(), tolerances, strict=True):
        known = np.isfinite(log[name])
        assert known.sum() > 1, name
        off = log[name][known] - true[name][known]
        if name == "psi":  # the first sample is known to whole turns only
            off = off - 2.0 * np.pi * np.round(off[0] / (2.0 * np.pi))
        worst[name] = np.abs(off).max() / tolerance
    return {name: value for name, value in worst.items() if value > 1.0}


def test_a_csv_of_degrees_knots_counts_and_sensors_off_the_origin():
    log = read_sea_log(LOGS / "kestrel.csv", LOGS / "kestrel.toml")
    # Digits of the file: 1e-9 deg of latitude 0.1 mm; depth 0.05 mm; angles 5e-5 deg; rates 5e-5 deg/s at 0.9 m;
    # 5e-6 knot; 0.005 counts of 10 a degree. The derivative of the truth is good to 1e-7.
    assert not apart(log, "x y z phi theta psi p q r u v w delta1 delta2 delta3 delta4",
                     [3e-4, 3e-4, 1e-4, 1e-6, 1e-6, 1e-6, *[1e-6] * 3, *[4e-6] * 3, *[1e-5] * 4])  # fmt: skip
    assert (log.synthetic, log.level, log.name) == (True, "synthetic", "kestrel dive 3")
    assert (log.std["x"], log.std["z"], log.bias["z"], log.assumed) == (1.5, 0.05, 0.1, ("y",))
    assert log.datum == pytest.approx(sea.DATUM)
    assert log.flags == ()
    assert any("declination of -10.5 deg" in text for text in log.conversions)
    assert any("1 jumps of a turn" in text for text in log.conversions)


def test_a_csv_of_iso_times_in_east_north_up_with_a_cut_last_line():
    log = read_sea_log(LOGS / "heron.csv", LOGS / "heron.toml")
    assert not apart(log, "x y z phi theta psi delta1", [1e-6] * 7)  # six digits; fins 5e-5 deg
    assert log.epoch == sea.EPOCH
    assert np.flatnonzero(np.isnan(log["z"])).tolist() == [7]  # -9999
    assert [flag.kind for flag in log.flags] == ["format", "format"]
    assert "line 63 is another number of cells" in log.flags[1].words


def test_an_iver_log_is_read_without_a_mapping_but_for_the_counts_of_its_fins():
    log = read_sea_log(LOGS / "iver.log")
    # Hundredths of a degree, millimetres, 1e-8 deg of latitude; x and y from the first fix.
    assert not apart(log, "z phi theta psi", [6e-4, 1e-4, 1e-4, 1e-4])
    true = sea.truth(log.time)
    np.testing.assert_allclose(np.diff(log["x"])[:10], np.diff(true["x"])[:10], atol=3e-3)
    assert np.isnan(log["x"][12:15]).all()
    assert not any(log.has(f"delta{i}") for i in range(1, 5))
    assert any("counts whose zero and scale" in text for text in log.conversions)
    assert log.synthetic


def test_an_iver_mapping_extends_the_ready_one_by_the_fins(tmp_path):
    rows = {1: "Fin Yaw T", 2: "Fin Yaw B", 3: "Fin Pitch R", 4: "Fin Pitch L"}
    text = 'schema = "towtank/sea-log/1"\nextends = "iver"\n[channels]\n'
    text += "".join(
        f'delta{i} = {{ column = "{name}", counts = {{ zero = 128, per_unit = 3.2, unit = "deg" }} }}\n'
        for i, name in rows.items()
    )
    (tmp_path / "map.toml").write_text(text)
    log = read_sea_log(LOGS / "iver.log", tmp_path / "map.toml")
    # 0.05 counts of 3.2 a degree.
    assert not apart(log, "delta1 delta2 delta3 delta4 z", [*[3e-4] * 4, 6e-4])


def test_imc_messages_with_clocks_of_their_own_and_orders_that_stand():
    log = read_sea_log(LOGS / "imc")
    assert not apart(log, "x y z phi theta psi u v w p q r delta1 delta2 delta3 delta4 revolutions",
                     [*[1e-6] * 16, 2e-5])  # fmt: skip  # six digits; 5e-4 rpm
    assert log.epoch == sea.EPOCH
    assert log.synthetic
    assert log.datum == pytest.approx(sea.DATUM, abs=1e-8)
    first, second = log.time < 4.0 - 1e-9, log.time >= 4.0 - 1e-9
    assert set(np.round(log["heading_order"][first & (log.time >= 0.5)] % (2 * np.pi), 6)) == {0.2}
    assert set(np.round(log["heading_order"][second] % (2 * np.pi), 6)) == {1.2}
    assert np.isnan(log["depth_order"][log.time < 0.4]).all()
    assert set(log["depth_order"][log.time >= 0.4]) == {4.0, 5.0}  # the order of altitude is none of depth
    assert log.flags == ()


def test_moos_variables_of_numbers_and_of_text():
    log = read_sea_log(LOGS / "moos.alog", LOGS / "moos.toml")
    # Five digits of metres and degrees, four of the fins' degrees; the record begins with the first stamp, 1 ms late.
    names = "x y z psi delta1 delta2 delta3 delta4"
    assert not apart(log, names, [*[6e-6] * 3, 1e-7, *[2e-6] * 4], log.time + 0.001)
    assert log.epoch == pytest.approx(sea.EPOCH + 0.001)
    assert log["rudder"][log.time > 4.3] == pytest.approx(np.radians(-2.0))
    assert [(flag.kind, flag.count) for flag in log.flags] == [("format", 1)]


@pytest.mark.parametrize("name", ["osprey.mat", "osprey73.mat"])
def test_mat_files_of_both_kinds_with_two_clocks(name):
    log = read_sea_log(LOGS / name, LOGS / "osprey.toml")
    # Days since year 0 in double precision are good to 1e-5 s: 0.1 rad/s, 1.8 m/s.
    assert not apart(log, "x y z phi theta psi u v w delta1",
                     [*[2e-4] * 2, 1e-5, *[5e-6] * 3, *[2e-5] * 3, 2e-6])  # fmt: skip
    assert np.isfinite(log["x"]).sum() == 6
    assert log.epoch == pytest.approx(sea.EPOCH, abs=1e-4)


def test_netcdf_with_units_and_times_since_a_date():
    log = read_sea_log(LOGS / "tern.nc", LOGS / "tern.toml")
    # Seconds since 1970 in double precision are good to 1.2e-7: 1.8 m/s, 0.1 rad/s.
    assert not apart(log, "x y z psi r delta1", [*[4e-7] * 3, *[3e-8] * 3])
    assert log.epoch == sea.EPOCH


@pytest.mark.parametrize("name", ["petrel.bag", "petrel2", "petrel3"])
def test_ros_bags_in_the_axes_of_rep_103(name):
    log = read_sea_log(LOGS / name, LOGS / "petrel.toml")
    # Stamps of the headers, not those of the bag, which are up to 4 ms later; the truth's derivative is good to 1e-7.
    assert not apart(log, "x y z phi theta psi p q r u v w delta1 delta2 revolutions",
                     [*[1e-9] * 6, *[1e-9] * 3, *[1e-6] * 3, 1e-9, 1e-9, 1e-9])  # fmt: skip
    assert (log.craft, log.std["z"]) == ("hokie", 0.02)
    assert np.isfinite(log["z"]).sum() == 5
    assert log.epoch == pytest.approx(sea.EPOCH)


def test_the_samples_of_text_are_those_that_the_program_writes(tmp_path):
    for write in (sea.kestrel, sea.iso, sea.iver, sea.imc, sea.moos):
        write(tmp_path)
    for path in tmp_path.rglob("*.*"):
        if path.is_file():
            assert path.read_bytes() == (LOGS / path.relative_to(tmp_path)).read_bytes(), path.name


def cut(name, share, folder, tail=b""):
    path = folder / name
    content = (LOGS / name).read_bytes()
    path.write_bytes(content[: int(share * len(content))] + tail)
    return path


@pytest.mark.parametrize(
    ("name", "mapping", "said"),
    [
        ("osprey.mat", "osprey.toml", "is not a whole MAT file"),
        ("osprey73.mat", "osprey.toml", "is not a whole MAT file"),
        ("tern.nc", "tern.toml", "is not a whole netCDF-4 file"),
        ("petrel.bag", "petrel.toml", "is not a whole bag"),
    ],
)
def test_a_file_that_breaks_off_is_refused_with_a_reason(name, mapping, said, tmp_path):
    for share in (0.05, 0.5, 0.97):
        with pytest.raises(InputError, match=said):
            read_sea_log(cut(name, share, tmp_path), LOGS / mapping)


@pytest.mark.parametrize("name", ["petrel2", "petrel3"])
def test_a_ros2_bag_that_breaks_off_is_refused_or_flagged(name, tmp_path):
    shutil.copytree(LOGS / name, tmp_path / name)
    data = next(file for file in (tmp_path / name).iterdir() if file.suffix != ".yaml")
    whole = data.read_bytes()
    data.write_bytes(whole[: len(whole) // 2])
    try:
        log = read_sea_log(tmp_path / name, LOGS / "petrel.toml")
    except InputError as error:
        assert "bag" in str(error)  # noqa: PT017
    else:
        assert any("breaks off" in flag.words for flag in log.flags)


def test_a_text_that_breaks_off_keeps_all_of_its_whole_lines(tmp_path):
    for name, mapping in (("kestrel.csv", "kestrel.toml"), ("moos.alog", "moos.toml"), ("iver.log", "iver")):
        given = LOGS / mapping if mapping.endswith("toml") else mapping
        whole = read_sea_log(LOGS / name, given)
        path = cut(name, 0.6, tmp_path)
        log = read_sea_log(path, given)
        assert 0.5 * len(whole.time) < len(log.time) < 0.7 * len(whole.time)
        assert any(flag.kind == "format" and "no end" in flag.words for flag in log.flags), name
        np.testing.assert_allclose(log["z"][:10], whole["z"][:10])


def test_blocks_of_zero_bytes_cost_only_their_lines(tmp_path):
    path = cut("kestrel.csv", 1.0, tmp_path, b"\0" * 4096 + b"\n")
    log = read_sea_log(path, LOGS / "kestrel.toml")
    assert len(log.time) == 60
    assert [(flag.kind, flag.count) for flag in log.flags] == [("format", 1)]


@pytest.mark.parametrize("ending", [".csv", ".alog", ".mat", ".nc", ".bag"])
def test_binary_garbage_is_refused(ending, tmp_path):
    path = tmp_path / f"log{ending}"
    path.write_bytes(np.random.default_rng(0).integers(0, 256, 5000, dtype=np.uint8).tobytes())
    with pytest.raises(InputError, match="not a"):
        read_sea_log(path, LOGS / ("petrel.toml" if ending == ".bag" else "tern.toml"))


@pytest.mark.parametrize("name", ["kestrel.csv", "moos.alog", "osprey.mat", "tern.nc", "petrel.bag"])
def test_an_empty_file_is_refused(name, tmp_path):
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(InputError, match=r"empty|not a whole"):
        read_sea_log(tmp_path / name, LOGS / f"{name.partition('.')[0]}.toml")
