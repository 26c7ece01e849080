"""A made-up record has the noise, offsets, rates and holes that were asked for, and says that it is made up."""

from dataclasses import replace

import numpy as np
import pytest

from published_models import remus_model
from towtank.errors import InputError
from towtank.field.drive import drive_of
from towtank.field.files import read_log, write_log
from towtank.field.log import CHANNELS, trajectory
from towtank.field.sea import swim, timed
from towtank.field.sea_files import read_instruments
from towtank.field.sea_log import EXACT, STANDARD, Instrument, Instruments, observe
from towtank.field.sea_survey import identification_ready
from towtank.field.sea_trials import trial_called
from towtank.field.sea_water import Environment
from towtank.pilot.orders import ORDERS
from towtank.pilot.sensors import Reading

WATER = Environment(current=(0.1, -0.05, 0.0), shear=(0.01, 0.0), turbulence=(0.02, 0.02, 0.01), seed=6)


@pytest.fixture(scope="module")
def swum():
    model = remus_model()
    return swim(model, identification_ready(model, 5.0, seed=4), WATER)


def truth(swum, log, name):
    return np.interp(log.time, swum.time, swum.channels[name][0])


def only(*items, **more):
    return Instruments(items, **more)


def test_exact_instruments_record_the_truth(swum):
    log = observe(swum, EXACT)
    for name in ("x", "psi", "u", "r", "delta1", "ahead"):
        # A straight line between control periods 35 ms apart, as here.
        np.testing.assert_allclose(log[name], truth(swum, log, name), atol=1e-12)
    assert not log.std
    assert not log.bias
    speed = np.sqrt(log["u"] ** 2 + log["v"] ** 2 + log["w"] ** 2)
    np.testing.assert_allclose(log["speed"], speed, atol=1e-12)


def test_the_noise_has_the_spread_that_is_stated(swum):
    log = observe(swum, STANDARD, seed=1)
    for name in ("z", "phi", "theta", "psi", "u", "w", "ahead", "q", "r", "delta1", "delta3"):
        error = log[name] - truth(swum, log, name)
        error = error[np.isfinite(error)]
        # White: n readings know their std to 1 / sqrt(2 n), here within four of it; 1 % for the share of the counts.
        assert error.std() == pytest.approx(log.std[name], rel=4.0 / np.sqrt(2.0 * len(error)) + 0.01), name
        pair = np.corrcoef(error[1:], error[:-1])[0, 1]
        assert abs(pair) < 4.5 / np.sqrt(len(error)), name


def test_the_offset_lasts_the_record_and_is_drawn_anew_for_each(swum):
    found = []
    for seed in range(100):
        log = observe(swum, only(Instrument(("psi", "z"), Reading(0.0, 0.0, 0.01))), seed)
        error = log["psi"] - truth(swum, log, "psi")
        assert np.ptp(error) < 1e-9
        assert error.mean() == pytest.approx(log.provenance["drawn"]["offsets"]["psi"], abs=1e-12)
        found.append([error.mean(), (log["z"] - truth(swum, log, "z")).mean()])
    # 100 draws know a std to 7 %, a mean to 10 % of it, a correlation to 0.1; four of each.
    np.testing.assert_allclose(np.std(found, axis=0), 0.01, rtol=0.28)
    assert (np.abs(np.mean(found, axis=0)) < 0.004).all()
    assert abs(np.corrcoef(np.transpose(found))[0, 1]) < 0.4
    assert log.bias["psi"] == 0.01


def test_each_channel_is_read_at_its_own_rate(swum):
    log = observe(swum, replace(STANDARD, items=tuple(replace(item, dropout=0.0) for item in STANDARD.items)))
    assert np.allclose(np.diff(log.time), 0.1)
    for name, period in (("x", 1.0), ("psi", 0.1), ("r", 0.1), ("u", 0.2), ("delta1", 0.1)):
        rows = np.flatnonzero(np.isfinite(log[name]))
        assert set(np.diff(rows)) == {round(period / 0.1)}, name


def test_readings_stand_on_whole_counts(swum):
    log = observe(swum, STANDARD)
    for name, step in (
        ("psi", np.radians(0.1)),
        ("z", 0.001),
        ("delta1", np.radians(0.1)),
        ("revolutions", 1.0 / 60.0),
    ):
        if log.has(name):
            counts = log[name][np.isfinite(log[name])] / step
            np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
            assert len(np.unique(np.round(counts))) > 1, name


def test_dropouts_are_nan_for_as_long_as_asked_and_as_often(swum):
    item = Instrument(("u", "v", "w"), Reading(0.2), dropout=0.02, lasting=3.0)
    lost = holes = 0
    for seed in range(20):
        log = observe(swum, only(item), seed)
        readings = np.isfinite(log["u"])[::2]
        np.testing.assert_array_equal(np.isfinite(log["u"]), np.isfinite(log["v"]))
        lost += np.count_nonzero(~readings)
        edges = np.flatnonzero(np.diff(np.concatenate([[1], readings, [1]])))
        lengths = edges[1::2] - edges[::2]
        holes += len(lengths)
        inside = lengths[:-1] if not readings[-1] else lengths
        assert (inside >= 15).all()
    total = 20 * len(readings)
    # A reading is there unless one of 15 began a dropout. Holes of 15 readings or more make about total / 65 = 460
    # independent parts: the share is known to some 2 %, here within five of it.
    assert 1.0 - lost / total == pytest.approx(0.98**15, abs=0.10)
    assert holes > 100


def test_an_outage_takes_whole_rows_and_is_flagged(swum):
    log = observe(swum, only(outages=0.02, outage=2.0), seed=3)
    gaps = np.diff(log.time)
    wide = gaps[gaps > 0.15]
    assert len(wide) == len(log.flags) > 0
    assert (wide > 2.0).all()
    assert sum(flag.count for flag in log.flags) + len(log.time) == 3000
    assert {flag.kind for flag in log.flags} == {"gap"}


def test_time_stamps_are_off_by_the_jitter_and_stay_in_order(swum):
    log = observe(swum, only(jitter=0.01), seed=3)
    off = log.time - 0.1 * np.arange(len(log.time))
    # 3000 stamps know their spread to 1.3 %; cut off at four of it, which takes nothing away.
    assert off.std() == pytest.approx(0.01, rel=0.06)
    assert (np.diff(observe(swum, only(jitter=0.2), seed=3).time) > 0.0).all()


def test_a_late_sensor_tells_the_past(swum):
    log = observe(swum, only(Instrument(("psi",), latency=0.35)))
    past = np.interp(np.maximum(log.time - 0.35, 0.0), swum.time, swum.channels["psi"][0])
    np.testing.assert_allclose(log["psi"], past, atol=1e-12)


def test_the_same_seed_makes_the_same_record_and_one_more_instrument_changes_no_other(swum):
    a, b, c = (observe(swum, STANDARD, seed) for seed in (5, 5, 6))
    for name in a.channels:
        np.testing.assert_array_equal(a[name], b[name])
    assert np.nanmax(np.abs(a["psi"] - c["psi"])) > 1e-3
    compass = next(item for item in STANDARD.items if "psi" in item.channels)
    np.testing.assert_array_equal(observe(swum, only(compass), 5)["psi"], a["psi"])


def test_what_drove_the_craft_is_recorded_and_drives_the_model(swum):
    log = observe(swum, EXACT)
    fins = np.stack([log[f"command{i + 1}"] for i in range(4)], axis=-1)
    virtual = np.stack([log[name] for name in ("rudder", "elevator", "aileron")], axis=-1)
    legs, leg = swum.trial.legs, swum.leg[np.searchsorted(swum.time, log.time + 1e-9, side="right") - 1]
    own = np.array([[getattr(legs[i].orders, f"fin{k + 1}") for k in range(4)] for i in leg])
    np.testing.assert_allclose(fins, virtual @ np.asarray(swum.model.craft.mixing).T + own, atol=1e-12)
    drive = drive_of(swum.model, log)
    assert drive.measured
    assert drive.whole.all()
    throttle = np.array([legs[i].orders.throttle for i in leg])
    # The thrust in newton is what acts, whatever speed the throttle counts from.
    acts = drive.thrust * drive.orders[:, ORDERS.index("throttle")]
    np.testing.assert_allclose(acts, swum.trial.setting.thrust * throttle[:-1], rtol=1e-9)


def test_a_made_up_record_says_so_everywhere(swum, tmp_path):
    log = observe(swum, STANDARD, seed=7, epoch=1.7e9, datum=(0.6, -1.2), notes=("ballasted",))
    back = read_log(write_log(log, tmp_path / f"{log.name}.nc"))
    for one in (log, back):
        assert one.synthetic
        assert one.level == "synthetic"
        assert one.name.endswith("-synthetic")
        assert trajectory(one).level == "synthetic"
        assert "Synthetic" in one.conversions[0]
        origin = one.provenance
        assert origin["synthetic"] is True
        assert origin["seed"] == 7
        assert list(origin["environment"]["turbulence"]) == [0.02, 0.02, 0.01]
        assert origin["environment"]["seed"] == 6
        assert len(origin["inputs"]["model"]) == 16
        assert "ballasted" in origin["trial"]["notes"]
    assert set(log.assumed) == set(log.std) | set(log.bias)
    assert back.std == pytest.approx(dict(log.std))


def test_another_model_has_another_hash(swum):
    other = remus_model(lift=1.0)
    log = observe(swim(other, timed(other, identification_ready(other, 0.1).legs)), EXACT)
    assert log.provenance["inputs"]["model"] != observe(swum, EXACT).provenance["inputs"]["model"]


def test_orders_stand_where_they_were_given():
    model = remus_model()
    log = observe(swim(model, trial_called(model, "depth step").ready), EXACT)
    step = np.nanmax(log["depth_order"])
    assert set(np.unique(log["depth_order"])) == {0.0, step}
    assert np.isfinite(log["heading_order"]).all()
    log = observe(swim(model, trial_called(model, "zigzag10").ready), EXACT)
    assert not log.has("heading_order")
    assert set(np.unique(np.round(np.degrees(log["rudder"]), 6))) <= {-10.0, 0.0, 10.0}


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Instrument(("yaw",)), "no channel 'yaw'"),
        (lambda: Instrument(()), "no channel"),
        (lambda: Instrument(("psi",), dropout=1.5), "at most 1"),
        (lambda: Instrument(("psi",), step=-1.0), "0 or more"),
        (lambda: only(Instrument(("psi",)), Instrument(("psi",))), "two of them"),
        (lambda: only(period=0.0), "period above zero"),
        (lambda: only(jitter=-1.0), "0 or more"),
    ],
)
def test_what_is_no_instrument_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_instruments_of_a_file_take_the_places_of_the_standard_ones(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(
        'schema = "towtank/instruments/1"\nperiod = "50 ms"\noutages = "2 / hour"\noutage = "10 s"\n'
        '[[instrument]]\nchannels = ["psi", "phi"]\nperiod = "0.5 s"\nstd = "0.5 deg"\nbias = "2 deg"\nstep = "1 deg"\n'
        'dropout = 0.1\nlasting = "3 s"\nlatency = "200 ms"\n', "utf-8",
    )  # fmt: skip
    found = read_instruments(path)
    one = found.of("psi")
    assert one.channels == ("psi", "phi")
    numbers = [one.reading.period, one.reading.std, one.reading.bias, one.step, one.dropout, one.lasting, one.latency]
    assert numbers == pytest.approx([0.5, np.radians(0.5), np.radians(2.0), np.radians(1.0), 0.1, 3.0, 0.2])
    assert found.of("theta").channels == ("theta",)
    assert found.of("theta").reading == STANDARD.of("theta").reading
    assert found.period == pytest.approx(0.05)
    assert found.outages == pytest.approx(2.0 / 3600.0)
    assert {name for item in found.items for name in item.channels} <= set(CHANNELS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("period = 0.1", "schema"),
        ('schema = "towtank/instruments/1"\nspeed = 1', "speed"),
        ('schema = "towtank/instruments/1"\n[[instrument]]\nchannels = ["psi"]\nstd = 0.5', "bare angle"),
        ('schema = "towtank/instruments/1"\n[[instrument]]\nchannels = ["psi", "z"]', "one unit"),
        ('schema = "towtank/instruments/1"\n[[instrument]]\nchannels = ["yaw"]', "no channel 'yaw'"),
        ('schema = "towtank/instruments/1"\n[[instrument]]\nchannels = []', "channels"),
        ("schema = ", "not a TOML file"),
    ],
)
def test_a_file_of_instruments_with_faults_is_refused(tmp_path, text, said):
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match=said):
        read_instruments(path)
