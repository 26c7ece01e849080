"""A record drives the model as it drove the craft."""

import numpy as np
import pytest

import towtank as tt
from towtank.craft.library import read_craft
from towtank.engine.slopes import sensitivities
from towtank.errors import InputError
from towtank.field.drive import bridged, drive_of, nearest
from towtank.field.files import read_log, write_log
from towtank.field.log import Flag, SeaLog, trajectory
from towtank.model.equations import Model
from towtank.plan.standard import standard_plan
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank


@pytest.fixture(scope="module")
def model():
    craft = read_craft("hokie")
    return Model(craft, tt.derive(tow(standard_plan(craft), FastTank(members=1))))


def record(time, **more):
    fins = {f"delta{i + 1}": 0.2 * np.sin(time * (0.3 + 0.1 * i)) for i in range(4)}
    return SeaLog("swim", "hokie", time, {**fins, "u": np.full(len(time), 2.0), **more}, std={"u": 0.01})


def test_fins_pass_through_the_measured_angles_whatever_their_lag_and_limits(model):
    log = record(np.arange(0.0, 30.0, 0.1))
    drive = drive_of(model, log)
    start = drive.start(0, np.array([0.0] * 6 + [2.0] + [0.0] * 5))
    names = ("delta1", "delta2", "delta3", "delta4")
    ticks = len(drive.orders)
    seen = sensitivities(drive.model, start, drive.record(0, ticks), names, (), thrust=drive.thrust).seen
    # Round-off: the order undoes the RK4 step of the lag exactly.
    for i, name in enumerate(names):
        np.testing.assert_allclose(seen[:, i], log[name][1:], atol=1e-12)


def test_a_hole_in_the_fins_parts_the_record_and_a_short_one_is_bridged(model):
    time = np.arange(0.0, 30.0, 0.1)
    long, short = (time > 10.0) & (time < 12.0), (time > 20.0) & (time < 20.5)
    log = record(time)
    broken = {name: np.where(long | short, np.nan, values) for name, values in log.channels.items()}
    drive = drive_of(model, SeaLog("swim", "hokie", time, broken))
    ticks = drive.time[:-1]
    assert not drive.whole[(ticks > 10.05) & (ticks < 11.85)].any()
    assert drive.whole[(ticks < 9.85) | (ticks > 12.15)].all()


def test_slow_channels_stand_where_they_were_measured():
    time = np.array([0.0, 0.11, 0.19, 0.31, 0.4])
    found = nearest(time, np.array([1.0, np.nan, 3.0, np.nan, 5.0]), np.arange(5) * 0.1, 0.1)
    np.testing.assert_array_equal(found, [1.0, np.nan, 3.0, np.nan, 5.0])


def test_a_straight_line_bridges_samples_that_are_close():
    values, known = bridged(np.array([0.0, 1.0, 5.0]), np.array([0.0, 1.0, 5.0]), np.array([0.5, 1.0, 3.0, 5.0]))
    np.testing.assert_allclose(values, [0.5, 1.0, 3.0, 5.0])
    np.testing.assert_array_equal(known, [True, True, False, True])


def test_a_record_is_the_same_after_the_disk(tmp_path):
    time = np.arange(0.0, 2.0, 0.1)
    flag = Flag("gap", "time", 1.0, 1.5, 5, "no sample for 0.5 s")
    log = SeaLog(
        "swim", "hokie", time, {"psi": np.where(time < 1.0, time, np.nan)}, std={"psi": 0.01}, bias={"psi": 0.02},
        assumed=("psi",), synthetic=True, epoch=1.7e9, datum=(0.6, -1.2), flags=(flag,), conversions=("degrees",),
        provenance={"file": "a.csv"},
    )  # fmt: skip
    back = read_log(write_log(log, tmp_path / "log.nc"))
    for name in log.channels:
        np.testing.assert_array_equal(back[name], log[name])
    words = ("name", "craft", "std", "bias", "assumed", "synthetic", "epoch", "datum", "flags", "conversions")
    assert [getattr(back, word) for word in words] == [getattr(log, word) for word in words]
    assert back.level == "synthetic"
    assert trajectory(back).level == "synthetic"


@pytest.mark.parametrize(
    ("channels", "said"),
    [
        ({"u": [1.0, 1.0]}, "says nothing of the fins"),
        ({"delta1": [0.0, 0.0], "delta2": [0.0, 0.0]}, "has 4 fins"),
    ],
)
def test_a_record_without_the_fins_of_the_craft_is_refused(model, channels, said):
    log = SeaLog("swim", "hokie", np.array([0.0, 0.1]), {k: np.array(v) for k, v in channels.items()})
    with pytest.raises(InputError, match=said):
        drive_of(model, log)


@pytest.mark.parametrize(
    ("time", "channels", "said"),
    [
        ([0.0, 0.0], {}, "increasing"),
        ([0.0, 1.0], {"yaw": [0.0, 0.0]}, "no channel 'yaw'"),
        ([0.0, 1.0], {"psi": [0.0]}, "shape"),
    ],
)
def test_what_is_no_record_is_refused(time, channels, said):
    with pytest.raises(InputError, match=said):
        SeaLog("swim", "hokie", np.array(time), {k: np.array(v) for k, v in channels.items()})


def test_the_tick_is_that_of_a_sensor_not_of_the_union_of_clocks(model):
    # Fins and compass at 10 Hz, 3 ms apart: the union of their stamps has a step of 3 ms.
    ticks = np.arange(0.0, 20.0, 0.1)
    time = np.sort(np.concatenate([ticks, ticks + 0.003]))
    even = np.isin(time, ticks)
    fins = {f"delta{i + 1}": np.where(even, 0.1, np.nan) for i in range(4)}
    log = SeaLog("swim", "hokie", time, {**fins, "psi": np.where(even, np.nan, 0.2)})
    drive = drive_of(model, log)
    assert drive.clock.tick == pytest.approx(0.1)
    assert drive.whole.all()
    assert np.isfinite(drive.seen["psi"]).all()
