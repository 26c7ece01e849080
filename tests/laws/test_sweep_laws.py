"""A craft varied: what must follow from a change, and what must not."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from towtank import FastTank, Model, assess, derive, read_craft, standard_plan, tow
from towtank.craft.craft import Craft
from towtank.craft.integrals import centre_of_buoyancy, fin_integrals
from towtank.derive.straightening import with_straightening
from towtank.errors import CraftError, InputError
from towtank.sweep.files import csv_text, read_sweep, write_sweep
from towtank.sweep.point import evaluate, numbers
from towtank.sweep.run import point_keys, run_sweep
from towtank.sweep.sweep import Axis, Sweep, axis_of
from towtank.sweep.table import SweepTable
from towtank.sweep.vary import KINDS, vary
from towtank.trials.standard import standard_trials

CRAFT = "suboff-x"


@pytest.fixture(scope="module")
def craft() -> Craft:
    return read_craft(CRAFT)


@pytest.fixture(scope="module")
def values(craft: Craft) -> Callable[..., dict[str, float]]:
    """Numbers of a variant without trials or ensemble; each variant worked out once."""
    known: dict[str, dict[str, float]] = {}

    def of(**changes: float | str) -> dict[str, float]:
        key = repr(sorted(changes.items()))
        if key not in known:
            found = evaluate(vary(craft, **changes), FastTank(members=0), ())
            known[key] = {name: value for name, (value, _) in numbers(found).items()}
        return known[key]

    return of


# -- the craft ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KINDS)
def test_an_axis_at_its_base_leaves_the_craft_as_it_is(craft: Craft, name: str):
    craft = vary(craft, strake_height=0.03) if name.startswith("strake_") else craft
    base = KINDS[name].base(craft)
    assert vary(craft, **{name: f"{base!r} rad" if KINDS[name].unit == "rad" else base}) == craft


def test_the_order_of_the_changes_has_no_effect(craft: Craft):
    assert vary(craft, fin_size=1.2, cg_x=0.05, mass=650.0) == vary(craft, mass=650.0, cg_x=0.05, fin_size=1.2)


def test_a_fin_grows_about_its_stock_and_keeps_its_shape(craft: Craft):
    old, new = craft.fins[0], vary(craft, fin_size=1.3).fins[0]
    assert new.tip_chord / new.root_chord == pytest.approx(old.tip_chord / old.root_chord, rel=1e-12)
    assert new.root_chord == pytest.approx(1.3 * old.root_chord, rel=1e-12)
    # the root follows the tapering tail, so the exposed area is not exactly that of a similar figure
    areas = [fin_integrals(fin, craft.profile).exposed_area for fin in (old, new)]
    assert areas[1] / areas[0] == pytest.approx(1.3**2, rel=0.05)

    def stock(fin: object, span: float) -> float:
        return float(fin.trailing_edge_at(span) - (1.0 - fin.hinge) * fin.chord(span))  # type: ignore[attr-defined]

    # at the middle of the exposed span of each, where the hinge fraction is given
    root = old.tip_radius - (new.tip_radius - old.tip_radius) / 0.3
    middles = [0.5 * (root + fin.tip_radius) for fin in (old, new)]
    assert stock(new, middles[1]) == pytest.approx(stock(old, middles[0]), abs=1e-12)


def test_fin_area_is_the_square_of_fin_size(craft: Craft):
    assert vary(craft, fin_area=1.44) == vary(craft, fin_size=1.2)


def test_x_fins_turn_within_their_quarters(craft: Craft):
    new = vary(craft, fin_angle="30 deg")
    for fin, old in zip(new.fins, craft.fins, strict=True):
        assert math.degrees(math.atan2(abs(math.sin(fin.azimuth)), abs(math.cos(fin.azimuth)))) == pytest.approx(30.0)
        assert np.sign(np.cos(fin.azimuth)) == np.sign(np.cos(old.azimuth))
        assert np.sign(np.sin(fin.azimuth)) == np.sign(np.sin(old.azimuth))
    assert new.symmetry == "mirror"


def test_fins_are_placed_in_metres_or_in_lengths(craft: Craft):
    assert vary(craft, fin_position="0.9 L") == vary(craft, fin_position=0.9 * craft.length)
    assert max(f.trailing_edge for f in vary(craft, fin_position="0.9 L").fins) == pytest.approx(0.9 * craft.length)


@pytest.mark.parametrize("changes", [{"fin_size": 1.5, "fin_position": "0.9 L"}, {"strake_height": 0.04}])
def test_other_fins_and_strakes_leave_the_trim_as_it_was(craft: Craft, changes: dict[str, float | str]):
    new = vary(craft, **changes)
    was, now = (
        c.origin_from_nose - centre_of_buoyancy(c.profile, c.fins, c.strakes)[1] - c.mass.cg[0] for c in (craft, new)
    )
    assert now == pytest.approx(was, abs=1e-12)


def test_a_craft_without_strakes_gets_four_between_its_fins(craft: Craft):
    new = vary(craft, strake_height=0.03, strake_length=0.5, strake_taper=0.5)
    assert sorted(round(math.degrees(s.azimuth)) for s in new.strakes) == [0, 90, 180, 270]
    assert {(round(s.length, 9), s.height, s.end_height) for s in new.strakes} == {(0.5, 0.015, 0.03)}
    assert new.symmetry == "fourfold"
    assert "strake.height" in new.assumed
    assert vary(new, strake_height=0.0).strakes == () == vary(craft, strake_height=0.0, strake_length=0.4).strakes


def test_strakes_cost_drag_and_give_course_stability(values: Callable[..., dict[str, float]]):
    bare, straked = values(), values(strake_height=0.04, strake_length="0.15 L")
    assert straked["G_h"] > bare["G_h"]
    assert straked["Xuu'"] < bare["Xuu'"]


def test_the_inertia_about_the_cg_stays_when_the_cg_or_ballast_moves(craft: Craft):
    def about_cg(c: Craft) -> np.ndarray:
        r = np.array(c.mass.cg)
        return np.array(c.mass.inertia) - c.mass.mass * (r @ r * np.eye(3) - np.outer(r, r))

    for changes in ({"cg_x": 0.1}, {"cg_z": 0.02}, {"ballast": 30.0}, {"cg_x": 0.1, "ballast": -20.0}):
        new = vary(craft, **changes)
        assert about_cg(new) == pytest.approx(about_cg(craft), rel=1e-9, abs=1e-9)
    assert about_cg(vary(craft, mass=1.1 * craft.mass.mass)) == pytest.approx(1.1 * about_cg(craft), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"strakes": 1.0}, "Did you mean strake"),
        ({"strake_height": 1.0}, "half the diameter"),
        ({"strake_length": 1.0}, "has no strakes to vary"),
        ({"strake_height": 0.02, "strake_end": "1.01 L"}, "cannot stand"),
        ({"strake_height": 0.02, "strake_length": -1.0}, "leaves no strake"),
        ({"strake_height": 0.02, "strake_taper": 0.0}, "outside 0.02 to 5"),
        ({"fin_sise": 1.0}, "Did you mean fin_size"),
        ({"fin_size": 9.0}, "outside 0.1 to 5"),
        ({"fin_size": 0.0}, "outside 0.1 to 5"),
        ({"fin_area": -1.0}, "leaves no fin"),
        ({"fin_position": "1.1 L"}, "behind the tail"),
        ({"fin_angle": 30.0}, "bare angle"),
        ({"fin_angle": "85 deg"}, "outside 10 to 80 deg"),
        ({"cg_x": "1 kg"}, "cannot be converted to m"),
        ({"cg_x": 5.0}, "must lie inside the hull"),
        ({"cg_z": 0.4}, "must lie inside the hull"),
        ({"mass": 1e4}, "no submerged craft"),
        ({"ballast": -1e4}, "no submerged craft"),
        ({"speed": 0.0}, "must move ahead"),
        ({"speed": math.nan}, "not finite"),
    ],
)
def test_a_change_that_cannot_be_made_says_why(craft: Craft, changes: dict, words: str):
    with pytest.raises(InputError, match=words):
        vary(craft, **changes)


def test_a_cruciform_has_no_x_angle_and_a_bare_hull_no_fins():
    with pytest.raises(CraftError, match="form no X"):
        vary(read_craft("suboff-fins"), fin_angle="40 deg")
    with pytest.raises(CraftError, match="no fins to vary"):
        vary(read_craft("suboff-bare"), fin_size=1.1)


# -- the points --------------------------------------------------------------------------------------------------------


def test_larger_fins_damp_sway_weaken_the_munk_moment_and_steady_the_course(values: Callable[..., dict]):
    sizes = [values(fin_size=s) for s in (1.0, 1.2, 1.4)]
    for name in ("Yuv'.origin", "Yuv'", "Nur'.origin", "Yuudr'", "Nuudr'"):
        # Side force and damping of the fins grow with them; all but the rudder's force are negative.
        strength = [v[name] * (1.0 if name == "Yuudr'" else -1.0) for v in sizes]
        assert strength[0] < strength[1] < strength[2], name
    # Fins stand aft of the origin: their side force takes from the unstable moment of the hull, which is negative.
    moment = [v["Nuv'.origin"] for v in sizes]
    assert moment[0] < moment[1] < moment[2] < 0.0
    assert sizes[0]["G_h"] < sizes[1]["G_h"] < sizes[2]["G_h"]


def test_cg_forward_raises_the_index_as_its_formula_says(craft: Craft, values: Callable[..., dict]):
    length, rho = craft.length, craft.water.density
    m = craft.mass.mass / (0.5 * rho * length**3)
    found = [values(cg_x=x * length) for x in (-0.01, 0.0, 0.01)]
    for v, x in zip(found, (-0.01, 0.0, 0.01), strict=True):
        Yv, Nv, Yr, Nr = (v[f"{name}'.origin"] for name in ("Yuv", "Nuv", "Yur", "Nur"))
        # roddy1990; the derivatives are those of the same point, so only rounding is between the two
        assert v["G_h"] == pytest.approx(1.0 - Nv * (Yr - m) / (Yv * (Nr - x * m)), rel=1e-9)
        # what the water does to the craft does not know where its weight lies
        for name in ("Yuv'", "Nuv'.origin", "Yuudr'"):
            assert v[name] == pytest.approx(found[1][name], rel=1e-12)
    assert found[0]["G_h"] < found[1]["G_h"] < found[2]["G_h"]


def test_speed_enters_the_primed_derivatives_through_the_reynolds_number_alone(craft: Craft, values: Callable):
    fast = vary(craft, speed=2.0 * craft.speed)
    water = replace(craft.water, kinematic_viscosity=2.0 * craft.water.kinematic_viscosity)
    same = numbers(evaluate(replace(fast, water=water), FastTank(members=0), ()))
    base, other = values(), values(speed=2.0 * craft.speed)
    for name in ("Yuv'", "Nuv'", "Yuv'.origin", "Nur'.origin", "Yvdot'", "Yuudr'", "Xuu'"):
        assert same[name][0] == pytest.approx(base[name], rel=1e-6), name
        # A turbulent layer thins as Re^-1/5 or slower: 13 % at twice the speed for what hangs on it alone.
        assert other[name] == pytest.approx(base[name], rel=1.0 - 2.0**-0.2), name


def test_the_point_of_all_bases_is_the_plain_chain():
    craft = read_craft("hokie")
    sweep = Sweep(craft, (Axis("fin_size", (1.0,)), Axis("cg_x", (craft.mass.cg[0],)), Axis("speed", (craft.speed,))))
    found = {name: value for name, (value, _) in numbers(evaluate(sweep.craft_at(sweep.points()[0]))).items()}
    derived = derive(tow(standard_plan(craft), FastTank()))
    model = Model(craft, with_straightening(derived, craft, FastTank()))
    trials = {trial.kind: trial for trial in standard_trials(model)}
    verdict = assess(model, tuple(trials.values()))
    assert found["G_h"] == pytest.approx(verdict.horizontal.index, rel=1e-12)
    assert found["P_stable_v"] == pytest.approx(verdict.vertical.probability, rel=1e-12)
    assert found["growth_h"] == pytest.approx(max(s.real for s in verdict.horizontal.eigenvalues), rel=1e-12)
    for name, kind, index in (
        ("turning_circle", "turning circle", "tactical_diameter"),
        ("heading_step", "heading step", "settling_time"),
    ):
        assert found[f"{name}.{index}"] == pytest.approx(trials[kind].indices[index][0], rel=1e-12)


# -- the sweep ---------------------------------------------------------------------------------------------------------


def test_axes_are_read_as_they_are_written(craft: Craft):
    assert axis_of(craft, "fin_size=0.8:1.4:4") == Axis("fin_size", (0.8, 1.0, 1.2, 1.4))
    assert axis_of(craft, "cg_x=-5 cm, 0,0.05").values == pytest.approx((-0.05, 0.0, 0.05), abs=1e-15)
    assert axis_of(craft, "speed=1 m/s:3 m/s:3").values == (1.0, 2.0, 3.0)
    angles = axis_of(craft, "fin_angle=30 deg:60 deg:7")
    # the middle of the range is the craft itself, to the last bit
    assert angles.values[3] == KINDS["fin_angle"].base(craft)
    assert angles.label == "fin_angle [deg]"


@pytest.mark.parametrize(
    "text", ["fin_size", "fin_size=", "fin_size=1:2", "fin_size=1:2:1", "fin_size=1:2:x", "fin_size=a", "nothing=1"]
)
def test_an_axis_that_cannot_be_read_is_refused(craft: Craft, text: str):
    with pytest.raises(InputError):
        axis_of(craft, text)


@pytest.mark.parametrize(
    "options",
    [
        {"axes": ()},
        {"axes": (Axis("fin_size", (1.0,)), Axis("fin_size", (2.0,)))},
        {"axes": (Axis("fin_size", (1.0, 1.0)),)},
        {"axes": (Axis("fin_size", ()),)},
        {"axes": (Axis("speed", tuple(range(1, 1001))), Axis("mass", tuple(range(1, 1001))))},
        {"axes": (Axis("speed", (1.0,)),), "level": "rans"},
        {"axes": (Axis("speed", (1.0,)),), "members": 1},
        {"axes": (Axis("speed", (1.0,)),), "trials": ("spiral",)},
    ],
)
def test_a_sweep_that_makes_no_sense_is_refused(craft: Craft, options: dict):
    with pytest.raises(InputError):
        Sweep(craft, **options)


@pytest.fixture(scope="module")
def swept(craft: Craft, tmp_path_factory: pytest.TempPathFactory) -> tuple[Sweep, Path, SweepTable]:
    """Six points by two processes, two of which cannot be built."""
    sweep = Sweep(
        craft, (axis_of(craft, "fin_size=0.9,1.1"), axis_of(craft, "fin_position=0.9 L,0.95 L,1.2 L")),
        members=0, trials=(),
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("sweep")
    return sweep, folder, run_sweep(sweep, folder, workers=2)


def test_points_that_cannot_be_built_say_why_and_the_others_are_done(swept: tuple[Sweep, Path, SweepTable]):
    _, _, table = swept
    assert [bool(row.failed) for row in table.rows] == [False, False, True] * 2
    assert "behind the tail" in table.failed[0].failed
    assert np.isfinite(table.column("G_h")).tolist() == [[True, True, False]] * 2
    assert table.column("G_h").shape == (2, 3)


def test_a_second_run_starts_nothing_and_a_longer_axis_only_what_is_new(
    swept: tuple[Sweep, Path, SweepTable], monkeypatch: pytest.MonkeyPatch
):
    sweep, folder, table = swept
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "sweep").iterdir()}
    started: list[tuple[float, ...]] = []

    def spy(_: Sweep, point: tuple[float, ...]) -> dict:
        started.append(point)
        return {"values": {"G_h": 0.0}, "units": {"G_h": ""}, "notes": []}

    monkeypatch.setattr("towtank.sweep.run.work", spy)
    again = run_sweep(sweep, folder)
    assert started == []
    assert [repr(row) for row in again.rows] == [repr(row) for row in table.rows]
    assert {path: path.stat().st_mtime_ns for path in (folder / "sweep").iterdir()} == stamps
    longer = replace(sweep, axes=(Axis("fin_size", (0.9, 1.1, 1.2)), sweep.axes[1]))
    run_sweep(longer, folder)
    assert {point[0] for point in started} == {1.2}


def test_keys_cover_all_that_decides_a_result(craft: Craft):
    sweep = Sweep(craft, (Axis("fin_size", (1.0, 1.1)),))
    heavier = replace(craft, mass=replace(craft.mass, mass=craft.mass.mass + 1.0))
    variants = [
        point_keys(sweep), point_keys(sweep, "other program"), point_keys(replace(sweep, members=0)),
        point_keys(replace(sweep, trials=())), point_keys(replace(sweep, craft=heavier)),
    ]  # fmt: skip
    everything = [key for keys in variants for key in keys]
    assert len(set(everything)) == len(everything)


def test_a_table_comes_back_from_its_file(swept: tuple[Sweep, Path, SweepTable], tmp_path: Path):
    table = swept[2]
    document, text = write_sweep(table, tmp_path)
    back = read_sweep(document)
    assert [repr(row) for row in back.rows] == [repr(row) for row in table.rows]
    assert (back.axes, back.columns, back.craft, back.level) == (table.axes, table.columns, table.craft, table.level)
    lines = list(csv.DictReader(io.StringIO(text.read_text())))
    assert text.read_text() == csv_text(table)
    assert [float(line["G_h"]) if line["G_h"] else None for line in lines] == [
        row.values.get("G_h") for row in table.rows
    ]
    assert lines[2]["failed"]


def test_the_figure_shows_the_points_of_the_table(swept: tuple[Sweep, Path, SweepTable]):
    from towtank.figures.sweep import sweep_column, sweep_sheet

    table = swept[2]
    ax = sweep_column(table, "G_h")
    # two values of fin_size: one line each over the three positions
    drawn = [line.get_ydata() for line in ax.lines if len(line.get_xdata()) == 3]
    assert np.array(drawn) == pytest.approx(table.column("G_h"), nan_ok=True)
    assert ax.get_xlabel() == "fin_position [m]"
    assert len(sweep_sheet(table).axes) == 1  # no trials: no diameter


def test_contours_pass_through_the_points_and_trials_out_of_trim_are_left_out(craft: Craft):
    from towtank.figures.sweep import sweep_column
    from towtank.sweep.table import Row

    axes = (Axis("fin_size", (0.8, 1.0, 1.2)), Axis("fin_angle", tuple(np.radians([30.0, 45.0, 60.0]))))
    rows = [
        Row((s, a), {"G_h": s - 1.05, "zigzag.first_overshoot": s, "zigzag.trimmed": float(s > 0.9)})
        for s in axes[0].values
        for a in axes[1].values
    ]
    columns = {"G_h": "", "zigzag.first_overshoot": "deg", "zigzag.trimmed": ""}
    table = SweepTable("x", "semi-empirical", axes, columns, tuple(rows), (1.0, np.radians(45.0)))
    ax = sweep_column(table, "G_h")
    zero = ax.collections[-1].get_paths()[0].vertices  # the heavy line where the index changes its sign
    assert zero[:, 0] == pytest.approx(1.05)
    assert ax.get_ylabel() == "fin_angle [deg]"
    crossed = [line for line in sweep_column(table, "zigzag.first_overshoot").lines if line.get_marker() == "x"]
    assert sorted(set(crossed[0].get_xdata())) == [0.8]


def test_a_dask_cluster_gives_what_this_machine_gives(swept: tuple[Sweep, Path, SweepTable], tmp_path: Path):
    import distributed

    sweep, _, table = swept
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": 50}
    with distributed.LocalCluster(**options) as cluster:
        there = run_sweep(sweep, tmp_path, where=cluster.scheduler_address)
    for mine, theirs in zip(table.rows, there.rows, strict=True):
        assert (mine.at, mine.key, mine.failed) == (theirs.at, theirs.key, theirs.failed)
        # the same numbers from another process: its linear algebra may share its sums among threads
        assert dict(theirs.values) == pytest.approx(dict(mine.values), rel=1e-9, nan_ok=True)
