"""What is written in a format is read back from it, and what is made up says so."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.errors import ArtefactError, InputError
from towtank.field.log import CHANNELS, SeaLog
from towtank.field.reading import read_sea_log
from towtank.field.writing import FORMATS, write_as
from towtank.field.writing.bags import write_ros2

EXACT = ("netcdf", "csv", "mat", "alog", "ros1", "ros2")
IMC_LACKS = {"speed", "rudder", "elevator", "aileron", "throttle", "thrust"}
IVER_HOLDS = ("x", "y", "z", "phi", "theta", "psi", "speed", "heading_order", "depth_order", "speed_order")


def record(seed=1, n=60, synthetic=True, lacking=0.1, names=tuple(CHANNELS), **more):
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(n)
    columns = {}
    for i, name in enumerate(names):
        values = 0.2 * np.sin((0.3 + 0.02 * i) * t) + 0.01 * rng.standard_normal(n)
        values[rng.random(n) < lacking] = np.nan
        columns[name] = values
    for name in {"psi", "heading_order"} & set(names):  # without holes, so that turns are not ambiguous
        columns[name] = 6.0 + 0.4 * t + 0.001 * rng.standard_normal(n)
    told = {"epoch": 1.75e9, "datum": (0.64, -1.33), "std": {"u": 0.01}, "bias": {"z": 0.1}, "assumed": ("u",)} | more
    return SeaLog("swim", "hokie", t, columns, synthetic=synthetic, **told)


def same(a, b, name, tolerance):
    off = a[name] - b[name]
    if name in ("psi", "heading_order"):  # known to whole turns
        off = off - 2.0 * np.pi * np.round(np.nanmedian(off) / (2.0 * np.pi))
    np.testing.assert_array_equal(np.isnan(a[name]), np.isnan(b[name]), err_msg=name)
    np.testing.assert_allclose(np.nan_to_num(off), 0.0, atol=tolerance, err_msg=name)


def whole(back, log):
    words = ("name", "craft", "std", "bias", "assumed", "synthetic", "epoch", "datum")
    assert [getattr(back, word) for word in words] == [getattr(log, word) for word in words]


@pytest.mark.parametrize("form", EXACT)
def test_formats_that_hold_everything_give_it_back(form, tmp_path):
    log = record()
    back = read_sea_log(write_as(log, tmp_path / "log", form))
    assert list(back.channels) == [name for name in CHANNELS if name in log.channels]
    np.testing.assert_allclose(back.time, log.time, atol=1e-9)  # whole nanoseconds in bags
    for name in log.channels:
        same(back, log, name, 1e-9)
    whole(back, log)


def test_imc_messages_give_back_what_they_have_a_place_for(tmp_path):
    log = record()
    back = read_sea_log(write_as(log, tmp_path / "log", "imc"))
    assert set(log.channels) - set(back.channels) == IMC_LACKS
    np.testing.assert_allclose(back.time, log.time, atol=1e-6)  # stamps to the microsecond
    for name in back.channels:
        same(back, log, name, 1e-8)  # 1.5 nm for each 1e-9 rad of the datum
    whole(back, log)


def test_an_iver_log_gives_back_what_it_has_a_place_for(tmp_path):
    log = record(lacking=0.0)
    path = write_as(log, tmp_path / "log", "iver")
    assert path.name == "log-synthetic.log"
    back = read_sea_log(path)
    assert tuple(back.channels) == tuple(name for name in CHANNELS if name in IVER_HOLDS)
    half = {"z": 6e-4, "depth_order": 6e-4, "speed": 3e-4, "speed_order": 3e-4}
    for name in IVER_HOLDS:  # half of the last digit: 0.005 deg, 0.5 mm, 0.0005 knot
        if name not in ("x", "y"):
            same(back, log, name, half.get(name, 9e-5))
    for name in ("x", "y"):  # from the first fix; 1e-7 deg is 11 mm
        np.testing.assert_allclose(back[name] - back[name][0], log[name] - log[name][0], atol=0.012)
    assert back.synthetic
    assert back.epoch == log.epoch


@settings(deadline=None, max_examples=12)
@given(
    seed=st.integers(0, 10**6), lacking=st.floats(0.0, 0.9), form=st.sampled_from(EXACT),
    names=st.sets(st.sampled_from(sorted(set(CHANNELS) - {"heading_order"})), min_size=1, max_size=8),
)  # fmt: skip
def test_any_channels_with_any_holes_come_back(tmp_path_factory, seed, lacking, form, names):
    log = record(seed, 40, False, lacking, tuple(name for name in CHANNELS if name in names), epoch=None, datum=None)
    held = [name for name in log.channels if np.isfinite(log[name]).any()]
    if not held:
        return
    back = read_sea_log(write_as(log, tmp_path_factory.mktemp("log") / "log", form))
    known = np.any([np.isfinite(log[name]) for name in log.channels], axis=0)
    if form in ("alog", "ros1", "ros2"):  # instants at which nothing was measured have no posting
        assert len(back.time) == int(known.sum())
    for name in held:
        expected, got = log[name][np.isfinite(log[name])], back[name][np.isfinite(back[name])]
        off = got - expected
        whole_turns = 2.0 * np.pi * np.round(np.median(off) / (2.0 * np.pi)) if name == "psi" else 0.0
        np.testing.assert_allclose(off - whole_turns, 0.0, atol=1e-9, err_msg=name)
    assert (back.epoch, back.datum, back.synthetic) == (None, None, False)


@pytest.mark.parametrize("form", FORMATS)
def test_a_record_made_up_says_so_in_its_name_and_inside(form, tmp_path):
    log = record(lacking=0.0)
    path = write_as(log, tmp_path / f"log{FORMATS[form][0]}", form)
    assert path.name == f"log-synthetic{FORMATS[form][0]}"
    again = write_as(log, path, form)
    assert again == path
    bare = path.with_name(f"renamed{path.suffix}")
    if path.is_dir():
        shutil.copytree(path, bare)
    else:
        shutil.copy(path, bare)
    assert read_sea_log(bare).synthetic  # by the mark inside
    real = write_as(record(lacking=0.0, synthetic=False), tmp_path / "real", form)
    assert "synthetic" not in real.name
    assert not read_sea_log(real).synthetic


def test_a_name_that_ends_in_the_mark_is_taken_at_its_word(tmp_path):
    real = write_as(record(synthetic=False), tmp_path / "real", "csv")
    assert read_sea_log(real.rename(tmp_path / "dive-synthetic.csv")).synthetic


def test_the_mcap_of_ros2_holds_the_same(tmp_path):
    log = record()
    back = read_sea_log(write_ros2(log, tmp_path / "log", "MCAP"))
    for name in log.channels:
        same(back, log, name, 1e-9)


def test_folders_of_others_are_not_overwritten(tmp_path):
    (tmp_path / "log").mkdir()
    (tmp_path / "log" / "thesis.txt").write_text("mine")
    for form in ("imc", "ros2"):
        with pytest.raises(ArtefactError, match="was not written by towtank"):
            write_as(record(synthetic=False), tmp_path / "log", form)
    assert (tmp_path / "log" / "thesis.txt").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["log"]


def test_what_a_format_cannot_hold_is_refused(tmp_path):
    with pytest.raises(InputError, match="no format of a log"):
        write_as(record(), tmp_path / "log", "xlsx")
    fast = record(lacking=0.0)
    with pytest.raises(InputError, match=r"closer than the 0\.01 s"):
        write_as(SeaLog("a", "", fast.time / 100.0, fast.channels), tmp_path / "log", "iver")


def test_a_log_of_towtank_takes_no_mapping(tmp_path):
    path = write_as(record(), tmp_path / "log", "netcdf")
    with pytest.raises(InputError, match="Leave the mapping out"):
        read_sea_log(path, "imc")
    assert read_sea_log(path, "towtank").synthetic
