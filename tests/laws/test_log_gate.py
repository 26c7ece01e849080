"""At the gate of logs: places of sensors, axes, units, clocks and doubts."""

from __future__ import annotations

import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sea_samples as sea
from towtank.errors import InputError
from towtank.field.reading import read_sea_log
from towtank.field.reading.doubts import outliers
from towtank.field.reading.geodesy import latitude_longitude, north_east, radii
from towtank.field.reading.mapping import SCHEMA
from towtank.field.reading.mapping_file import map_of
from towtank.frames import rotation

ARM = st.floats(-2.0, 2.0).map(lambda x: round(x, 3))
T = sea.clock(6.0)
PLAIN = {name: name for name in ("x", "y", "z", "u", "v", "w")}
TURNS = {name: {"column": name, "unit": "rad"} for name in ("phi", "theta", "psi")}
SPINS = {name: {"column": name, "unit": "rad/s"} for name in ("p", "q", "r")}


def csv(path, columns, digits=12):
    rows = zip(*columns.values(), strict=True)
    lines = [
        ",".join(columns),
        *(",".join(x if isinstance(x, str) else f"{x:.{digits}g}" for x in row) for row in rows),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def mapped(channels, **more):
    return map_of({"schema": SCHEMA, "clock": {"columns": "t"}, "channels": channels, **more}, "map")


def read(folder, columns, channels, **more):
    return read_sea_log(csv(folder / "log.csv", columns), mapped(channels, **more))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("gate")


def measured_at(arm):
    """What a sensor at ``arm`` measures beside the attitude and rates of the craft."""
    d = sea.truth(T)
    places, speeds = sea.place_of(T, np.array(arm)), sea.velocity_of(T, np.array(arm))
    columns = {"t": T, **dict(zip("xyz", places.T, strict=True)), **dict(zip("uvw", speeds.T, strict=True))}
    return columns | {name: d[name] for name in (*TURNS, *SPINS)}


def at_sensor(channels, place):
    rows = {name: {"column": name, "sensor": "pod"} for name in channels}
    return {"channels": {**rows, **TURNS, **SPINS}, "sensors": {"pod": dict(zip("xyz", place, strict=True))}}


@settings(deadline=None, max_examples=15)
@given(st.tuples(ARM, ARM, ARM))
def test_a_sensor_anywhere_on_the_craft_gives_the_motion_of_its_origin(folder, arm):
    told = at_sensor(PLAIN, arm)
    log = read(folder, measured_at(arm), told.pop("channels"), **told)
    d = sea.truth(T)
    for name in PLAIN:  # velocities and rates of the sample are differentiated over 0.2 ms: good to 1e-7
        np.testing.assert_allclose(log[name], d[name], atol=1e-6, err_msg=name)


def test_a_place_from_the_nose_is_that_from_the_origin_of_the_craft(folder):
    from towtank.craft.library import read_craft

    craft = read_craft("hokie")
    columns = measured_at((0.7, 0.0, -0.1))
    told = at_sensor(PLAIN, (0.0, 0.0, 0.0))
    sensors = {"pod": {"from_nose": f"{craft.origin_from_nose - 0.7} m", "z": "-10 cm"}}
    log = read(folder, columns, told["channels"], sensors=sensors, craft="hokie")
    np.testing.assert_allclose(log["x"], sea.truth(T)["x"], atol=1e-6)
    with pytest.raises(InputError, match="from_nose needs the craft"):
        read(folder, columns, told["channels"], sensors=sensors)


def test_what_cannot_be_brought_to_the_origin_is_said_and_nothing_is_made_up(folder):
    arm = (0.5, 0.0, 0.2)
    columns = measured_at(arm)
    told = at_sensor(("x", "v", "w"), arm)
    channels = {name: one for name, one in told["channels"].items() if name not in ("psi", "q")}
    log = read(folder, columns, channels, sensors=told["sensors"])
    np.testing.assert_allclose(log["x"], columns["x"], atol=1e-9)
    d = sea.truth(T)
    np.testing.assert_allclose(log["v"], d["v"], atol=1e-6)  # needs p and r only
    np.testing.assert_allclose(log["w"], columns["w"], atol=1e-9)  # needs q
    words = " ".join(log.conversions)
    assert "x is left at its sensor: psi is not in the log" in words
    assert "left out for lack of a channel: q x 0.5 m" in words


def test_samples_without_a_rate_at_their_time_are_left_out_and_flagged(folder):
    columns = measured_at((0.5, 0.0, 0.0))
    columns["r"] = np.where((T > 2.0) & (T < 4.0), np.nan, columns["r"])
    told = at_sensor(("v",), (0.5, 0.0, 0.0))
    log = read(folder, columns, told["channels"], sensors=told["sensors"])
    lost = np.isnan(log["v"])
    assert lost[(T > 2.05) & (T < 3.95)].all()
    assert not lost[(T < 1.95) | (T > 4.05)].any()
    assert [(flag.kind, flag.count) for flag in log.flags if flag.channel == "v"] == [("gap", int(lost.sum()))]


def test_axes_of_ros_and_ours_are_the_same_motion(folder):
    d = sea.truth(T)
    ours = read(folder, {"t": T, **{n: d[n] for n in (*PLAIN, *TURNS, *SPINS)}}, {**PLAIN, **TURNS, **SPINS})
    signs = {"u": 1, "v": -1, "w": -1, "p": 1, "q": -1, "r": -1, "phi": 1, "theta": -1}
    columns = {name: sign * d[name] for name, sign in signs.items()}
    columns |= {"t": T, "x": d["y"], "y": d["x"], "z": -d["z"], "psi": 0.5 * np.pi - d["psi"]}
    theirs = read(folder, columns, {**PLAIN, **TURNS, **SPINS}, convention="ros")
    stated = read(
        folder, columns, {**PLAIN, **TURNS, **SPINS}, body=["x", "-y", "-z"], world=["y", "x", "-z"]
    )  # fmt: skip
    for name in ours.channels:
        whole = 2.0 * np.pi * np.round((ours[name][0] - theirs[name][0]) / (2.0 * np.pi)) if name == "psi" else 0.0
        np.testing.assert_allclose(theirs[name] + whole, ours[name], atol=1e-9, err_msg=name)
        np.testing.assert_array_equal(stated[name], theirs[name])


def test_axes_that_mix_the_angles_are_turned_as_a_whole(folder):
    """x aft, y starboard, z up on the craft, and north, west, up in the world."""
    body = np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]])
    world = np.diag([1.0, -1.0, -1.0])
    d = sea.truth(T)
    from towtank.tank.imported.convert import euler

    theirs = euler(world.T @ rotation(np.stack([d[n] for n in TURNS], axis=-1)) @ body)
    columns = {"t": T, **dict(zip(TURNS, theirs.T, strict=True))}
    log = read(folder, columns, TURNS, body=["-x", "y", "-z"], world=["x", "-y", "-z"])
    for name in ("phi", "theta"):
        np.testing.assert_allclose(log[name], d[name], atol=1e-9)
    assert np.cos(log["psi"] - d["psi"]) == pytest.approx(1.0)
    with pytest.raises(InputError, match="needs all three"):
        read(folder, columns, {"psi": TURNS["psi"]}, body=["-x", "y", "-z"], world=["x", "-y", "-z"])
    with pytest.raises(InputError, match="left-handed"):
        read(folder, columns, TURNS, body=["x", "y", "-z"])


def test_ground_velocities_along_north_and_east_become_those_of_the_body(folder):
    d = sea.truth(T)
    body = np.stack([d[n] for n in "uvw"], axis=-1)
    ground = np.einsum("nij,nj->ni", rotation(np.stack([d[n] for n in TURNS], axis=-1)), body)
    columns = {"t": T, **dict(zip(("vn", "ve", "vd"), ground.T, strict=True)), **{n: d[n] for n in TURNS}}
    log = read(folder, columns, {n: n for n in ("vn", "ve", "vd")} | TURNS)
    for name in "uvw":
        np.testing.assert_allclose(log[name], d[name], atol=1e-9)


@pytest.mark.parametrize(
    ("latitude", "north", "east"),
    [(0.0, 110574.3, 111319.5), (45.0, 111131.8, 78846.8), (60.0, 111412.2, 55800.0)],
)
def test_lengths_of_a_degree_are_those_of_the_tables(latitude, north, east):
    """Snyder's table of the lengths of degrees, by the radii: good to the metre in which it changes over a degree."""
    meridian, across = radii(np.radians(latitude))
    # The table gives the degree centred on the latitude; the change over half a degree is 5 m at most.
    assert np.radians(1.0) * meridian == pytest.approx(north, abs=1.0)
    assert np.radians(1.0) * across * np.cos(np.radians(latitude)) == pytest.approx(east, abs=1.0)


@given(st.floats(-1.4, 1.4), st.floats(-3.1, 3.1), st.floats(-2e4, 2e4), st.floats(-2e4, 2e4))
def test_metres_and_degrees_are_each_others_inverse(lat, lon, north, east):
    there = latitude_longitude(np.array([north]), np.array([east]), (lat, lon))
    back = north_east(*there, (lat, lon))
    # Earth-centred coordinates of 6.4e6 m in double precision.
    np.testing.assert_allclose([back[0][0], back[1][0]], [north, east], atol=1e-7)


def test_near_the_datum_the_plane_is_that_of_the_radii():
    lat, lon = np.radians(37.0), np.radians(-76.0)
    meridian, across = radii(lat)
    d = 1e-5
    north, east = north_east(np.array([lat + d, lat]), np.array([lon, lon + d]), (lat, lon))
    # Second order in 64 m over the radius of the Earth: 0.3 mm.
    np.testing.assert_allclose([north[0], east[1]], [d * meridian, d * across * np.cos(lat)], atol=1e-3)


STAMPS = sea.EPOCH + np.array([0.0, 0.5, 1.0, 1.5, 2.5])


def moment(at):
    return datetime.datetime.fromtimestamp(at, tz=datetime.UTC)


CLOCKS = {
    "seconds": ({"t": STAMPS - sea.EPOCH + 7.0}, {"columns": "t"}, None),
    "milliseconds": ({"t": 1e3 * (STAMPS - sea.EPOCH)}, {"columns": "t", "unit": "ms"}, None),
    "header": ({"t [us]": 1e6 * (STAMPS - sea.EPOCH)}, {"columns": "t"}, None),
    "epoch": ({"t": STAMPS}, {"columns": "t", "kind": "epoch"}, 0.0),
    "epoch ms": ({"t": 1e3 * STAMPS}, {"columns": "t", "kind": "epoch", "unit": "ms"}, 0.0),
    "iso": ({"t": [moment(a).isoformat() for a in STAMPS]}, {"columns": "t", "kind": "iso"}, 0.0),
    "zulu": ({"t": [f"{moment(a):%Y-%m-%dT%H:%M:%S.%f}Z" for a in STAMPS]}, {"columns": "t", "kind": "iso"}, 0.0),
    "ahead": (
        {"t": [f"{moment(a + 7200):%Y-%m-%d %H:%M:%S.%f}" for a in STAMPS]},
        {"columns": "t", "kind": "iso", "utc_offset": "2 hour"},
        0.0,
    ),
    "date": (
        {"d": [f"{moment(a):%m/%d/%Y}" for a in STAMPS], "h": [f"{moment(a):%H:%M:%S.%f}" for a in STAMPS]},
        {"columns": ["d", "h"], "kind": "date", "order": "mdy"},
        0.0,
    ),
    "one cell": (
        {"t": [f"{moment(a):%d.%m.%Y %H:%M:%S.%f}" for a in STAMPS]},
        {"columns": "t", "kind": "date", "order": "dmy"},
        0.0,
    ),
    "half days": (
        {"d": [f"{moment(a):%Y-%m-%d}" for a in STAMPS], "h": [f"{moment(a):%I:%M:%S.%f %p}" for a in STAMPS]},
        {"columns": ["d", "h"], "kind": "date"},
        0.0,
    ),
    "midnight": (
        {"t": ["23:59:59.0", "23:59:59.5", "00:00:00.0", "0:00:00.5", "0:00:01.5"]},
        {"columns": "t", "kind": "time of day"},
        None,
    ),
    "gps": (
        {"w": (STAMPS + 18 - 315964800) // 604800, "s": (STAMPS + 18 - 315964800) % 604800},
        {"columns": ["w", "s"], "kind": "gps"},
        0.0,
    ),
    "matlab": ({"t": [f"{719529 + a / 86400:.15g}" for a in STAMPS]}, {"columns": "t", "kind": "matlab"}, 0.0),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_every_clock_tells_the_same_times(kind, tmp_path):
    columns, clock, zero = CLOCKS[kind]
    log = read_sea_log(
        csv(tmp_path / "log.csv", {**columns, "z": np.arange(5.0)}, 17),
        map_of({"schema": SCHEMA, "clock": clock, "channels": {"z": "z"}}, "map"),
    )
    # A day number of 15 digits is good to 1e-4 s; a double of seconds since 1970 to 2.4e-7.
    slack = 1e-4 if kind == "matlab" else 5e-7
    np.testing.assert_allclose(log.time, STAMPS - sea.EPOCH, atol=slack)
    assert log.epoch == (None if zero is None else pytest.approx(sea.EPOCH, abs=slack))


def clocked(folder, times, **clock):
    columns = {"t": times, "z": np.arange(float(len(times)))}
    more = {"columns": "t", **clock}
    return read_sea_log(
        csv(folder / "log.csv", columns), map_of({"schema": SCHEMA, "clock": more, "channels": {"z": "z"}}, "map")
    )


def found(log, *kinds):
    return [(flag.kind, flag.count) for flag in log.flags if flag.kind in (kinds or ("gap", "repeat", "clock"))]


def test_one_wrong_stamp_costs_one_sample_and_is_flagged(tmp_path):
    times = np.arange(50.0)
    times[20] = 9e9
    log = clocked(tmp_path, times)
    assert found(log, "clock") == [("clock", 1)]
    assert len(log.time) == 49
    assert 20.0 not in log["z"]


def test_a_clock_set_back_keeps_out_the_shorter_part_that_overlaps(tmp_path):
    log = clocked(tmp_path, np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(8.2, 20.0, 0.5)]))
    assert found(log) == [("clock", 3)]
    assert (np.diff(log.time) > 0.0).all()
    assert len(log.time) == 20 + 24 - 3


def test_a_clock_that_starts_again_is_continued_when_asked(tmp_path):
    times = np.concatenate([np.arange(0.0, 5.0, 0.5), np.arange(0.0, 5.0, 0.5)])
    log = clocked(tmp_path, times, reset="continue")
    np.testing.assert_allclose(log.time, np.arange(0.0, 10.0, 0.5))
    assert found(log) == [("clock", 1)]
    with pytest.raises(InputError, match="out of order"):
        clocked(tmp_path, np.tile(np.arange(5.0), 3))


def test_repeated_stamps_and_holes_are_flagged_with_their_counts(tmp_path):
    times = np.concatenate([np.arange(0.0, 5.0, 0.1), [4.9, 4.9], np.arange(7.0, 9.0, 0.1)])
    log = clocked(tmp_path, times)
    assert found(log) == [("repeat", 2), ("gap", 20)]
    gap = next(flag for flag in log.flags if flag.kind == "gap")
    assert (gap.start, gap.end) == pytest.approx((4.9, 7.0))


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.0, 1e3).map(lambda x: round(x, 2)), min_size=4, max_size=60))
def test_whatever_the_clock_every_row_is_kept_or_counted(folder, times):
    try:
        log = clocked(folder, np.array(times))
    except InputError:
        return
    assert (np.diff(log.time) > 0.0).all()
    lost = sum(flag.count for flag in log.flags if flag.kind in ("repeat", "clock") and flag.channel == "time")
    assert len(log.time) + lost == len(times)


@pytest.mark.parametrize(
    ("key", "unit", "number", "si"),
    [
        ("psi", "deg", 90.0, np.pi / 2), ("r", "deg/s", 90.0, np.pi / 2), ("r", "°/s", 90.0, np.pi / 2),
        ("u", "knots", 2.0, 2 * 1852 / 3600), ("u", "kn", 2.0, 2 * 1852 / 3600), ("u", "cm/s", 150.0, 1.5),
        ("z", "feet", 10.0, 3.048), ("revolutions", "rpm", 600.0, 10.0), ("revolutions", "Hz", 10.0, 10.0),
        ("throttle", "%", 80.0, 0.8), ("thrust", "kN", 0.2, 200.0), ("turn_order", "deg/min", 60.0, np.radians(1.0)),
    ],
)  # fmt: skip
def test_units_of_the_header_and_of_the_mapping_mean_the_same(key, unit, number, si, folder):
    for header, channel in ((f"a [{unit}]", {"column": "a"}), ("a", {"column": "a", "unit": unit})):
        log = read(folder, {"t": [0.0, 1.0, 2.0], header: [number] * 3}, {key: channel})
        np.testing.assert_allclose(log[key], si, rtol=1e-9)
        assert any(
            text.startswith(f"{key}: {unit if unit not in ('knots', 'kn', '°/s') else ''}") for text in log.conversions
        )


@pytest.mark.parametrize(
    ("header", "channel", "said"),
    [
        ("a", "a", "no unit. Degrees and radians cannot be told apart"),
        ("a [m]", "a", "is no unit of rad"),
        ("a [deg]", {"column": "a", "unit": "rad"}, "One of them is wrong by a factor"),
        ("a [deg]", "b", "no column 'b'"),
        ("a [deg]", {"column": "a", "counts": {"zero": 1, "per_unit": 0, "unit": "deg"}}, "per_unit is zero"),
        ("a", {"column": "a", "points": [[1, "1 deg"], [1, "2 deg"]]}, "a raw number stands twice"),
        ("a", {"column": "a", "points": [[1, 5], [2, "2 deg"]]}, "bare angle"),
    ],
)
def test_a_column_whose_numbers_are_not_known_is_refused(header, channel, said, folder):
    with pytest.raises(InputError, match=said):
        read(folder, {"t": [0.0, 1.0, 2.0], header: [1.0] * 3}, {"psi": channel})


def test_counts_points_factors_and_offsets_are_straight_lines(folder):
    raw = np.array([1400.0, 1500.0, 1650.0])
    columns = {"t": [0.0, 1.0, 2.0], "s": raw}
    counts = {"column": "s", "counts": {"zero": 1500, "per_unit": -10, "unit": "deg"}}
    points = {"column": "s", "points": [[1600, "-10 deg"], [1500, "0 deg"]]}
    turned = {"column": "s", "counts": {"zero": 1500, "per_unit": 10, "unit": "deg"}, "factor": -1, "offset": "2 deg"}
    log = read(folder, columns, {"delta1": counts, "delta2": points, "delta3": turned})
    np.testing.assert_allclose(log["delta1"], np.radians((1500 - raw) / 10))
    np.testing.assert_allclose(log["delta2"], log["delta1"])
    np.testing.assert_allclose(log["delta3"], log["delta1"] + np.radians(2.0))


def test_headings_go_on_over_north_and_orders_stand_beside_them(folder):
    psi = np.radians(np.arange(0.0, 1000.0, 7.0))
    columns = {"t": np.arange(len(psi)), "h": np.degrees(psi) % 360.0, "o": np.full(len(psi), 350.0)}
    columns["o"][:] = 359.0
    told = {"psi": {"column": "h", "unit": "deg"}, "heading_order": {"column": "o", "unit": "deg"}}
    log = read(folder, columns, told)
    np.testing.assert_allclose(log["psi"], psi, atol=1e-9)
    np.testing.assert_allclose(log["heading_order"], np.radians(-1.0))
    assert any("2 jumps of a turn taken out; it ends +2.76 turns" in text for text in log.conversions)


def test_fins_in_the_sense_of_the_vehicle_are_turned_by_the_craft_file(tmp_path):
    from towtank.craft.library import craft_text

    text = craft_text("hokie").replace("[fins]", "[fins]\nsigns = [-1, -1, -1, -1]", 1)
    (tmp_path / "craft.toml").write_text(text)
    columns = {"t": [0.0, 1.0, 2.0], "a": [1.0, 2.0, 3.0]}
    told = {"delta1": {"column": "a", "unit": "deg"}}
    log = read(tmp_path, columns, told, fins="vehicle", craft=str(tmp_path / "craft.toml"))
    np.testing.assert_allclose(log["delta1"], -np.radians([1.0, 2.0, 3.0]))
    with pytest.raises(InputError, match="the sense of each fin is in the craft file"):
        read(tmp_path, columns, told, fins="vehicle")


def test_fins_are_called_by_the_names_of_the_craft(folder):
    from towtank.craft.library import read_craft

    names = [fin.name for fin in read_craft("hokie").fins]
    columns = {"t": [0.0, 1.0], "a": [1.0, 2.0]}
    log = read(folder, columns, {f"delta:{names[2]}": {"column": "a", "unit": "deg"}}, craft="hokie")
    assert list(log.channels) == ["delta3"]
    with pytest.raises(InputError, match="no fin 'keel'"):
        read(folder, columns, {"delta:keel": {"column": "a", "unit": "deg"}}, craft="hokie")


def noisy(n=400, seed=3):
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(n)
    return t, 5.0 + np.sin(0.5 * t) + 0.01 * rng.standard_normal(n)


def test_spikes_are_flagged_and_nothing_else_is(folder):
    t, z = noisy()
    z[[50, 51, 200]] += [0.5, -0.4, 3.0]
    log = read(folder, {"t": t, "z": z}, {"z": "z"})
    assert [(flag.kind, flag.count) for flag in log.flags] == [("outlier", 3)]
    np.testing.assert_allclose(log["z"], z, rtol=1e-11)  # flagged, never repaired
    assert np.flatnonzero(outliers(z)).tolist() == [50, 51, 200]


def test_noise_steps_and_turns_are_no_outliers():
    rng = np.random.default_rng(0)
    found = sum(int(outliers(rng.standard_normal(1000)).sum()) for _ in range(100))
    assert found == 0  # 1e5 samples
    steps = np.repeat(rng.standard_normal(40), 25)
    assert not outliers(steps).any()
    t = 0.1 * np.arange(600)
    assert not outliers(np.sin(2.0 * t)).any()  # 31 samples a period
    assert not outliers(np.round(np.sin(0.3 * t), 2)).any()


def test_a_sensor_that_stands_still_is_flagged_and_a_coarse_one_is_not(folder):
    t, z = noisy()
    z[100:180] = z[100]
    log = read(folder, {"t": t, "z": z}, {"z": "z"})
    stuck = [flag for flag in log.flags if flag.kind == "stuck"]
    assert [flag.count for flag in stuck] == [80]
    assert (stuck[0].start, stuck[0].end) == pytest.approx((10.0, 17.9))
    coarse = read(folder, {"t": t, "z": np.round(noisy()[1], 1)}, {"z": "z"})
    assert not [flag for flag in coarse.flags if flag.kind == "stuck"]


def test_a_slow_sensor_in_a_fast_log_is_flagged_and_thinned_when_asked(folder):
    t, z = noisy()
    slow = np.repeat(z[::10], 10)
    log = read(folder, {"t": t, "z": slow}, {"z": "z"})
    assert [(flag.kind, flag.count) for flag in log.flags] == [("repeat", 360)]
    thin = read(folder, {"t": t, "z": slow}, {"z": {"column": "z", "held": True}})
    assert thin.flags == ()
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(thin["z"])), np.arange(0, 400, 10))


def test_values_out_of_range_are_flagged_by_any_crafts_limits_or_the_mappings(folder):
    t, z = noisy()
    z[7] = 12000.0
    log = read(folder, {"t": t, "z": z}, {"z": "z"})
    assert ("range", 1) in [(flag.kind, flag.count) for flag in log.flags]
    close = read(folder, {"t": t, "z": noisy()[1]}, {"z": {"column": "z", "limits": ["0 m", "5.5 m"]}})
    beyond = int((noisy()[1] > 5.5).sum())
    assert [(flag.kind, flag.count) for flag in close.flags if flag.kind == "range"] == [("range", beyond)]


def test_several_clocks_on_one_base_keep_every_sample_where_it_was(folder, tmp_path):
    lines = ["%% LOGSTART 0"]
    rng = np.random.default_rng(2)
    held = {}
    for name, rate in (("A", 0.1), ("B", 0.25), ("C", 0.07)):
        times = np.round(np.cumsum(rate * (1.0 + 0.2 * rng.random(40))), 4)
        held[name] = dict(zip(times.tolist(), rng.standard_normal(40).round(6).tolist(), strict=True))
        lines += [f"{at:.4f} {name} p {value}" for at, value in held[name].items()]
    (tmp_path / "log.alog").write_text("\n".join(lines) + "\n")
    channels = {"x": "A", "y": "B", "z": "C"}
    log = read_sea_log(tmp_path / "log.alog", map_of({"schema": SCHEMA, "channels": channels}, "map"))
    first = min(min(times) for times in held.values())
    for channel, name in channels.items():
        known = np.isfinite(log[channel])
        assert known.sum() == 40
        # Stamps are joined within 0.1 ms.
        np.testing.assert_allclose(log.time[known] + first, sorted(held[name]), atol=1.01e-4)
        np.testing.assert_allclose(log[channel][known], [held[name][at] for at in sorted(held[name])])
    ticks = map_of({"schema": SCHEMA, "clock": {"step": "0.1 s"}, "channels": channels}, "map")
    even = read_sea_log(tmp_path / "log.alog", ticks)
    np.testing.assert_allclose(np.diff(even.time), 0.1, rtol=1e-9)
    assert any("left out where two fell on one" in text for text in even.conversions)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"schema": "towtank/import/1"}, "wanted 'towtank/sea-log/1'"),
        ({"chanels": {}}, "Did you mean 'channels'"),
        ({"channels": {"depth": "d"}}, "no channel 'depth'"),
        ({"channels": {"z": {"colum": "d"}}}, "Did you mean 'column'"),
        ({"channels": {"z": {"unit": "m"}}}, r"channels.z.column: this key is missing"),
        ({"channels": {"z": {"column": "d", "sensor": "cell"}}}, "no sensor 'cell'"),
        ({"clock": {"kind": "epochs"}}, "is not one of"),
        ({"sensors": {"a": {"y": 1}}}, "give from_nose"),
        ({"extends": "remus"}, "is no ready schema"),
        ({"convention": "enu"}, "is not one of"),
    ],
)
def test_faults_of_a_mapping_are_told_with_their_place(document, said):
    with pytest.raises(InputError, match=said):
        map_of({"schema": SCHEMA, **document}, "map.toml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t;z\n" + "\n".join(f"{i};{i}" for i in range(9)), None),
        ("t,z\n" + "\n".join(f"{i},5,{i},5" for i in range(9)), "do not have the 2 cells"),
        ("t z\n", "no rows"),
        ("# nothing\n", "only comments"),
        ("t,z\n0,1\n1,two\n2,3\n", None),
        ("t,z\n0,one\n1,two\n2,three\n", "no number in it"),
        ("when,z\n0,1\n1,2\n", "no column 't'"),
        ("t,z\na,1\nb,2\n", 'the clock is of kind "elapsed"'),
    ],
)
def test_tables_of_text_are_read_or_refused_with_a_reason(text, said, tmp_path):
    (tmp_path / "log.csv").write_text(text + "\n")
    if said is not None:
        with pytest.raises(InputError, match=said):
            read_sea_log(tmp_path / "log.csv", mapped({"z": "z"}))
        return
    log = read_sea_log(tmp_path / "log.csv", mapped({"z": "z"}))
    spoilt = int("two" in text)
    assert sum(flag.count for flag in log.flags if flag.kind == "format") == spoilt
    assert int(np.isnan(log["z"]).sum()) == spoilt
