"""Every reader gives the motion that its sample was made from, at the body origin, in our axes and SI."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sea_samples as sea
from towtank.errors import InputError, TowtankError
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


def test_a_bag_of_ros2_is_read_from_its_folder_or_its_one_file():
    whole = read_sea_log(LOGS / "petrel3", LOGS / "petrel.toml")
    for path in (LOGS / "petrel3" / "petrel3.mcap", LOGS / "petrel2" / "petrel2.db3"):
        log = read_sea_log(path, LOGS / "petrel.toml")
        np.testing.assert_array_equal(log["u"], whole["u"])


def test_packed_variables_of_netcdf_are_unpacked_and_told(tmp_path):
    from towtank.netcdf import Variable, encode

    stored = np.array([0, 100, -32768, 300], dtype=np.int16)
    attrs = {"units": "m", "scale_factor": "0.01", "add_offset": "2.0", "_FillValue": "-32768"}
    rows = {"t": Variable(("t",), np.arange(4.0), {"units": "s"}), "d": Variable(("t",), stored, attrs)}
    (tmp_path / "log.nc").write_bytes(encode(rows, {}))
    (tmp_path / "map.toml").write_text(
        'schema = "towtank/sea-log/1"\n[clock]\ncolumns = "t"\n[channels]\nz = "d"\n', encoding="utf-8"
    )
    log = read_sea_log(tmp_path / "log.nc", tmp_path / "map.toml")
    np.testing.assert_allclose(log["z"], [2.0, 3.0, np.nan, 5.0])
    assert any("unpacked by scale_factor 0.01" in text for text in log.conversions)
    assert any("1 fill values" in text for text in log.conversions)


@pytest.mark.parametrize("kind", ["5", "7.3"])
def test_one_column_of_a_matrix_in_a_mat_file(kind, tmp_path):
    import h5py
    from scipy.io import savemat

    t, servo = np.arange(5.0)[:, None], np.degrees(sea.fins(np.arange(5.0)))
    path = tmp_path / "log.mat"
    if kind == "5":
        savemat(path, {"log": {"t": t, "servo": servo}})
    else:
        with h5py.File(path, "w") as file:
            file["log/t"], file["log/servo"] = t.T, servo.T
    text = 'schema = "towtank/sea-log/1"\n[clock]\ncolumns = "log.t"\n[channels]\n'
    text += 'delta1 = { column = "log.servo(:,3)", unit = "deg" }\n'
    (tmp_path / "map.toml").write_text(text)
    log = read_sea_log(path, tmp_path / "map.toml")
    np.testing.assert_allclose(log["delta1"], sea.fins(np.arange(5.0))[:, 2], atol=1e-12)
    (tmp_path / "map.toml").write_text(text.replace("(:,3)", "(:,5)"))
    with pytest.raises(InputError, match="asks for a column of 4"):
        read_sea_log(path, tmp_path / "map.toml")


def test_a_variable_that_two_programs_post_is_read_from_one(tmp_path):
    lines = ["%% LOGSTART 0"]
    for i in range(5):
        lines += [f"{i:.2f} NAV_X pNav {i}", f"{i + 0.01:.2f} NAV_X uSim {100 + i}", f"{i:.2f} NAV_Y pNav {2 * i}"]
    (tmp_path / "log.alog").write_text("\n".join(lines) + "\n")
    text = 'schema = "towtank/sea-log/1"\n[channels]\nx = "NAV_Y"\n'
    (tmp_path / "map.toml").write_text(text + 'y = { column = "NAV_X", where = { source = "pNav" } }\n')
    log = read_sea_log(tmp_path / "log.alog", tmp_path / "map.toml")
    np.testing.assert_array_equal(log["y"], np.arange(5.0))
    np.testing.assert_array_equal(log["x"], 2.0 * np.arange(5.0))


def test_degree_signs_of_latin_1_and_rows_in_reverse(tmp_path):
    rows = [f"{9 - i},{350 + 3 * (9 - i) if 9 - i < 4 else 3 * (9 - i) - 10}" for i in range(10)]
    (tmp_path / "log.csv").write_bytes("\r\n".join(["t [s],heading [°]", *rows, ""]).encode("latin-1"))
    text = 'schema = "towtank/sea-log/1"\n[clock]\ncolumns = "t"\n[channels]\npsi = "heading"\n'
    (tmp_path / "map.toml").write_text(text)
    log = read_sea_log(tmp_path / "log.csv", tmp_path / "map.toml")
    np.testing.assert_allclose(log["psi"], np.radians(350.0 + 3.0 * np.arange(10.0)))
    assert [(flag.kind, flag.count) for flag in log.flags] == [("clock", 10)]
    assert "turned round" in log.flags[0].words


def test_messages_of_other_systems_in_an_imc_log_are_left_out_and_counted(tmp_path):
    shutil.copytree(LOGS / "imc", tmp_path / "imc")
    path = tmp_path / "imc" / "EstimatedState.csv"
    lines = path.read_bytes().decode().split("\r\n")
    strange = [line.replace("lauv-sample", "ccu-boat") for line in lines[5:8]]
    path.write_text("\r\n".join([*lines[:8], *strange, *lines[8:]]), newline="")
    log, whole = read_sea_log(tmp_path / "imc"), read_sea_log(LOGS / "imc")
    np.testing.assert_array_equal(log["x"], whole["x"])
    assert [(flag.kind, flag.count) for flag in log.flags] == [("format", 3)]
    assert "3 messages of ccu-boat left out; the craft is lauv-sample" in log.flags[0].words


def test_a_csv_whose_gps_has_a_clock_of_its_own(tmp_path):
    t = np.arange(0.0, 6.0, 0.5)
    fixes = np.where(np.arange(12) % 4 == 0, t + 0.123, np.nan)
    rows = [
        f"{a},{5 + a},{'' if np.isnan(b) else b},{'' if np.isnan(b) else 2 * b}" for a, b in zip(t, fixes, strict=True)
    ]
    (tmp_path / "log.csv").write_text("\n".join(["t,depth,tg,xg", *rows, ""]))
    text = 'schema = "towtank/sea-log/1"\n[clock]\ncolumns = "t"\n[channels]\nz = { column = "depth", unit = "m" }\n'
    (tmp_path / "map.toml").write_text(text + 'x = { column = "xg", unit = "m", time = "tg" }\n')
    log = read_sea_log(tmp_path / "log.csv", tmp_path / "map.toml")
    known = np.isfinite(log["x"])
    np.testing.assert_allclose(log["x"][known], 2.0 * log.time[known])
    np.testing.assert_allclose(log.time[known], [0.123, 2.123, 4.123])
    assert np.isfinite(log["z"]).sum() == 12
    assert log.flags == ()


def test_without_the_library_of_bags_the_way_to_it_is_told(monkeypatch, tmp_path):
    from towtank.field.writing import write_as

    log = read_sea_log(LOGS / "tern.nc", LOGS / "tern.toml")
    for name in ("rosbags.highlevel", "rosbags.typesys"):
        monkeypatch.setitem(sys.modules, name, None)
    for path, mapping in (("petrel.bag", "petrel.toml"), ("petrel2", None)):
        with pytest.raises(InputError, match=r"needs rosbags. Install it: pip install"):
            read_sea_log(LOGS / path, LOGS / mapping if mapping else None)
    for form in ("ros1", "ros2"):
        with pytest.raises(InputError, match=r"needs rosbags. Install it: pip install"):
            write_as(log, tmp_path / "log", form)


DAMAGED = {
    "kestrel.csv": "kestrel.toml", "heron.csv": "heron.toml", "iver.log": None, "moos.alog": "moos.toml",
    "osprey.mat": "osprey.toml", "osprey73.mat": "osprey.toml", "tern.nc": "tern.toml", "petrel.bag": "petrel.toml",
    "petrel3/petrel3.mcap": "petrel.toml", "petrel2/petrel2.db3": "petrel.toml", "imc/EstimatedState.csv": None,
}  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(
    name=st.sampled_from(sorted(DAMAGED)), place=st.floats(0.0, 1.0), length=st.integers(1, 400),
    seed=st.integers(0, 99), how=st.sampled_from(["overwritten", "lost", "repeated", "cut"]),
)  # fmt: skip
def test_a_log_damaged_anywhere_is_read_or_refused_in_words(name, place, length, seed, how, tmp_path_factory):
    content = bytearray((LOGS / name).read_bytes())
    at = int(place * (len(content) - 1))
    noise = np.random.default_rng(seed).integers(0, 256, length, dtype=np.uint8).tobytes()
    match how:
        case "overwritten":
            content[at : at + length] = noise
        case "lost":
            del content[at : at + length]
        case "repeated":
            content[at:at] = content[at : at + length]
        case "cut":
            del content[at:]
    path = tmp_path_factory.mktemp("damaged") / Path(name).name
    path.write_bytes(bytes(content))
    mapping = DAMAGED[name]
    try:
        log = read_sea_log(path, LOGS / mapping if mapping else None)
    except TowtankError as error:
        assert len(str(error)) > 20  # noqa: PT017
    else:
        assert (np.diff(log.time) > 0.0).all()
