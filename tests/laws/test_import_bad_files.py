"""Damaged and mistaken files: each gives one error that names the place and the remedy, or a repair that is told."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
from import_cases import HEAD, HOKIE, STAR_COLUMNS, force_and_moment, forces_dat, known, motion_text, seen, star_csv

from towtank.errors import InputError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway
from towtank.progress import Silent
from towtank.tank.imported.gate import import_runs
from towtank.tank.lpm import LpmTank

DATA = Path(__file__).parents[1] / "data" / "import"
SWAY = CaptiveTest("sway", 1.0, Sway(1.0, 0.8, 0.2), periods=3, samples=32)
DRIFT = CaptiveTest("drift", 1.0, Drift(1.0, 0.1))
TANK = LpmTank(known())
RUN = TANK.run(HOKIE, SWAY, Silent())
TIME, LOADS = seen(RUN)


def mapping(folder, *, form="star", file="sway.csv", test=SWAY, columns=STAR_COLUMNS, more="", motion=""):
    head = HEAD.format(form=form, speed=1.0, density=HOKIE.water.density, axes='["-x", "y", "-z"]')
    nose = f'{{ nose = ["{-HOKIE.origin_from_nose!r} m", "0 m", "0 m"] }}' if form == "openfoam" else '"origin"'
    head += f"moment_point = {nose}\n{more}\n" + columns
    head += f'\n[[run]]\nname = "{test.name}"\nfile = "{file}"\nmotion = {motion or motion_text(test)}\n'
    (folder / "map.toml").write_text(head, encoding="utf-8")
    return folder / "map.toml"


def imported(folder, **kwargs):
    (run,) = import_runs(mapping(folder, **kwargs))
    return run


def refused(folder, *words, **kwargs):
    """The message of the one error; it holds each of ``words``, and ends with what to do."""
    with pytest.raises(InputError) as told:
        import_runs(mapping(folder, **kwargs))
    text = str(told.value)
    for word in words:
        assert re.search(word, text), text
    return text


def star(folder, time=TIME, loads=LOADS, **kwargs):
    return star_csv(folder / "sway.csv", time, loads, **kwargs)


def lines_of(path):
    return path.read_text("utf-8").splitlines()


def said(run):
    return " | ".join(run.provenance["conversions"])


def assert_right(run, rel=1e-12):
    size = np.abs(RUN.loads).max()
    assert np.abs(run.loads - RUN.loads[-len(run.loads) :]).max() < rel * size


# Damaged files.


def test_a_last_row_that_was_cut_off_is_left_out_and_told(tmp_path):
    path = star(tmp_path)
    path.write_text(path.read_text("utf-8")[:-60], encoding="utf-8")
    run = imported(tmp_path)
    assert any("line 98: the last row is cut off and was left out" in flag for flag in run.flags)
    assert run.periods == 2  # the third is no longer whole
    np.testing.assert_allclose(run.history.time[-1], TIME[-2], rtol=1e-12)


def test_a_row_cut_off_in_the_middle_is_an_error_with_its_line(tmp_path):
    lines = lines_of(star(tmp_path))
    lines[40] = lines[40][:30]
    (tmp_path / "sway.csv").write_text("\n".join(lines), encoding="utf-8")
    refused(tmp_path, "sway.csv, line 41", "2 cells, wanted 7", "export it again")


def test_a_number_that_was_cut_off_at_the_end_of_openfoam_is_left_out(tmp_path):
    path = forces_dat(tmp_path / "case" / "postProcessing" / "forces" / "0" / "forces.dat", TIME, LOADS)
    path.write_text(path.read_text("utf-8")[:-30], encoding="utf-8")
    run = imported(tmp_path, form="openfoam", file="case", columns="")
    assert any("last row is cut off" in flag for flag in run.flags)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["is empty", "export it again"]),
        (b"\n \n", ["is empty"]),
        (b'"Physical Time (s)","Force X (N)"\n', ["headers", "no rows"]),
        (bytes(range(256)) * 20, ["not a text file", "control characters", "netcdf"]),
        (b"# only\n# comments\n", ["only comments"]),
    ],
)
def test_a_file_without_a_table_is_an_error(content, words, tmp_path):
    (tmp_path / "sway.csv").write_bytes(content)
    refused(tmp_path, "sway.csv", *words)


def test_a_missing_file_is_an_error(tmp_path):
    refused(tmp_path, "sway.csv does not exist")


@pytest.mark.parametrize("form", ["netcdf", "mat"])
def test_garbage_is_no_binary_table(form, tmp_path):
    (tmp_path / "sway.csv").write_bytes(bytes(range(256)) * 20)
    refused(tmp_path, "not a whole", form=form, columns='[columns]\ntime = "t"\nX = "X"\n')


def test_a_cell_that_is_no_number_is_an_error_with_line_and_column(tmp_path):
    lines = lines_of(star(tmp_path))
    lines[12] = lines[12].replace(lines[12].split(",")[2], "***")
    (tmp_path / "sway.csv").write_text("\n".join(lines), encoding="utf-8")
    refused(tmp_path, "line 13", "Force Y", r"'\*\*\*' is not a number")


@pytest.mark.parametrize("word", ["nan", "NaN", "", "inf"])
def test_a_number_that_is_not_finite_is_an_error_inside_the_window_only(word, tmp_path):
    lines = lines_of(star(tmp_path))
    cells = lines[10].split(",")
    lines[10] = ",".join([*cells[:3], word, *cells[4:]])
    (tmp_path / "sway.csv").write_text("\n".join(lines), encoding="utf-8")
    refused(tmp_path, "line 11", "column of Z", "not a finite number", "move the window")
    later = imported(tmp_path, more=f'window = {{ start = "{float(TIME[32])!r} s" }}')
    assert_right(later)


# Columns and units.


def test_a_missing_column_is_an_error_that_lists_the_others(tmp_path):
    star(tmp_path)
    columns = STAR_COLUMNS.replace('"Moment Z"', '"Momemt Z"')
    refused(tmp_path, "no column 'Momemt Z'", "Did you mean 'Moment Z'", "Physical Time", columns=columns)


def test_a_load_that_is_not_mapped_is_an_error_unless_symmetry_makes_it_zero(tmp_path):
    star(tmp_path)
    without = "\n".join(line for line in STAR_COLUMNS.splitlines() if not line.startswith("N ="))
    refused(tmp_path, "no column for N", r'absent = \["N"\]', columns=without + "\n")
    run = imported(tmp_path, columns=without + "\n", more='absent = ["N"]')
    assert any("N not measured" in flag for flag in run.flags)
    without = "\n".join(line for line in STAR_COLUMNS.splitlines() if line[:1] not in ("Z", "K", "M"))
    run = imported(tmp_path, columns=without + "\n")
    assert "no column for Z K M: zero by symmetry" in said(run)
    assert_right(run)


def test_a_unit_of_another_dimension_is_an_error(tmp_path):
    star(tmp_path, units=("Pa", "N-m"))
    refused(tmp_path, "Force X", "'Pa' is no unit of N", "correct the unit")


def test_two_units_that_differ_are_an_error(tmp_path):
    star(tmp_path)
    columns = STAR_COLUMNS.replace('X = "Force X"', 'X = { name = "Force X", unit = "kN" }')
    refused(tmp_path, "the file says 'N' and the mapping 'kN'", "factor 1000", columns=columns)


def test_units_of_the_file_are_converted(tmp_path):
    star(tmp_path, loads=LOADS / np.array([4.4482216152605] * 3 + [1000.0] * 3), units=("lbf", "kN-m"))
    run = imported(tmp_path)
    assert "units of the file: kN-m, lbf, s" in said(run)
    # pint and the number above agree on the pound-force to its 14 digits.
    assert_right(run)


def test_milliseconds_taken_for_seconds_are_an_error(tmp_path):
    star(tmp_path, time=TIME * 1e3)
    refused(tmp_path, "samples in a period|do not follow the stated frequency")


def test_an_angle_without_a_unit_is_an_error(tmp_path):
    rows = ["t,Fx,Fy,Fz,Mx,My,Mz,psi"] + [
        ",".join(f"{v:.9g}" for v in (t, *row, 0.1)) for t, row in zip(TIME, LOADS, strict=True)
    ]
    (tmp_path / "sway.csv").write_text("\n".join(rows), encoding="utf-8")
    columns = '[columns]\ntime = "t"\npsi = "psi"\n'
    columns += "".join(f'{a} = "{b}"\n' for a, b in zip("XYZKMN", ("Fx", "Fy", "Fz", "Mx", "My", "Mz"), strict=True))
    motion = '{ kind = "sway", frequency = "0.2 rad/s", from = "columns" }'
    refused(tmp_path, "psi", "no unit", "deg", form="csv", columns=columns, motion=motion)


def test_iterations_are_no_time_of_an_oscillation(tmp_path):
    star(tmp_path, clock="Iteration")
    refused(tmp_path, "counted by 'Iteration'", "Physical Time")


# Time.


def test_rows_in_reverse_order_are_turned_round(tmp_path):
    star(tmp_path, TIME[::-1], LOADS[::-1])
    run = imported(tmp_path)
    assert any("time runs backwards" in flag for flag in run.flags)
    assert_right(run)


def test_a_time_that_jumps_about_is_an_error(tmp_path):
    order = np.random.default_rng(1).permutation(len(TIME))
    star(tmp_path, TIME[order], LOADS[order])
    refused(tmp_path, "time goes back", "sort the rows")


def test_a_time_that_is_no_number_is_an_error(tmp_path):
    time = TIME.copy()
    time[7] = np.nan
    star(tmp_path, time)
    refused(tmp_path, "line 9", "the time", "not a number")


def test_of_inner_iterations_at_one_time_the_last_is_kept(tmp_path):
    time, loads = np.repeat(TIME, 2), np.repeat(LOADS, 2, axis=0)
    loads[::2] *= 5.0
    star(tmp_path, time, loads)
    run = imported(tmp_path)
    assert "97 rows have the time of the row after them" in said(run)
    assert_right(run)


def test_a_time_step_that_varies_is_resampled_and_told(tmp_path):
    """Step growing by 40 % through the record: the spline's error falls with the fourth power of the step."""
    count = 3 * 200
    share = np.linspace(0.0, 1.0, count + 1)
    time = 3.0 * SWAY.motion.period * (share + 0.15 * share**2) / 1.15
    control = np.tile(HOKIE.virtual(np.zeros(len(HOKIE.fins))), (len(time), 1))
    from towtank.terms import term_loads

    history = SWAY.motion.history(time)
    exact = term_loads(TANK.values, history.nu, history.nudot, control)
    star(tmp_path, *seen(replace(RUN, history=history, loads=exact)))
    run = imported(tmp_path)
    assert "resampled" in said(run)
    again = term_loads(TANK.values, run.history.nu, run.history.nudot, run.control)
    # The second derivative of v|v| jumps; a cubic spline of 200 steps a period meets it with (2 pi / 200)^2 / 8.
    assert np.abs(run.loads - again).max() < 2e-4 * np.abs(exact).max()


def test_a_gap_is_an_error_with_its_place(tmp_path):
    keep = np.r_[0:40, 46 : len(TIME)]
    star(tmp_path, TIME[keep], LOADS[keep])
    refused(tmp_path, "line 41", "a gap of", "restore the rows")


def test_less_than_one_period_is_an_error(tmp_path):
    star(tmp_path, TIME[:20], LOADS[:20])
    refused(tmp_path, "0.59 of a period", "rad/s or Hz")


def test_too_few_samples_in_a_period_are_an_error(tmp_path):
    star(tmp_path, TIME[::4], LOADS[::4])
    refused(tmp_path, "8 samples in a period", "third harmonic")


def test_a_window_without_rows_is_an_error(tmp_path):
    star(tmp_path)
    refused(tmp_path, "no row between 900", "runs from 0 to", more='window = { start = "900 s" }')


# Restarts and runs that were mixed up.


def test_of_restarts_that_overlap_the_later_one_holds(tmp_path):
    case = tmp_path / "case" / "postProcessing" / "forces"
    spoilt = LOADS.copy()
    spoilt[50:] *= 3.0
    force_and_moment(case / "0", TIME[:60], spoilt[:60])
    force_and_moment(case / f"{TIME[50]:.9g}", TIME[50:80], LOADS[50:80])
    force_and_moment(case / f"{TIME[75]:.9g}", TIME[75:], LOADS[75:])
    run = imported(tmp_path, form="openfoam", file="case", columns="")
    assert said(run).count("overlaps what was written before") == 2
    assert_right(run)


def test_parts_of_a_run_named_in_any_order_are_put_in_that_of_time(tmp_path):
    star_csv(tmp_path / "late.csv", TIME[48:], LOADS[48:])
    star_csv(tmp_path / "early.csv", TIME[:56], LOADS[:56])
    path = mapping(tmp_path)
    text = path.read_text("utf-8").replace('file = "sway.csv"', 'files = ["late.csv", "early.csv"]')
    path.write_text(text, encoding="utf-8")
    (run,) = import_runs(path)
    assert run.periods == 3
    assert_right(run)


def test_the_same_restart_twice_changes_nothing(tmp_path):
    case = tmp_path / "case" / "postProcessing" / "forces"
    forces_dat(case / "0" / "forces.dat", TIME, LOADS)
    forces_dat(case / "0" / "forces_0.dat", TIME, LOADS)
    run = imported(tmp_path, form="openfoam", file="case", columns="")
    assert "overlaps" in said(run)
    assert_right(run)


def test_restarts_about_different_points_are_an_error(tmp_path):
    case = tmp_path / "case" / "postProcessing" / "forces"
    forces_dat(case / "0" / "forces.dat", TIME[:50], LOADS[:50])
    forces_dat(case / "9" / "forces.dat", TIME[50:], LOADS[50:], centre=(1.0, 0.0, 0.0))
    refused(tmp_path, "different CofR", form="openfoam", file="case", columns="")


def test_a_moment_file_that_is_missing_is_an_error(tmp_path):
    place = force_and_moment(tmp_path / "case" / "postProcessing" / "forces" / "0", TIME, LOADS)
    (place / "moment.dat").unlink()
    refused(tmp_path, "force.dat is there and moment.dat is not", form="openfoam", file="case", columns="")


def test_two_function_objects_are_an_error(tmp_path):
    for name in ("forcesHull", "forcesAll"):
        forces_dat(tmp_path / "case" / "postProcessing" / name / "0" / "forces.dat", TIME, LOADS)
    refused(tmp_path, "2 forces function objects", "forcesAll", form="openfoam", file="case", columns="")


def test_monitors_of_another_run_do_not_join(tmp_path):
    text = star(tmp_path).read_text("utf-8").splitlines()
    (tmp_path / "forces.csv").write_text("\n".join(",".join(r.split(",")[:4]) for r in text), encoding="utf-8")
    star(tmp_path, TIME * 1.37)
    text = lines_of(tmp_path / "sway.csv")
    rows = [",".join([r.split(",")[0], *r.split(",")[4:]]) for r in text]
    (tmp_path / "moments.csv").write_text("\n".join(rows), encoding="utf-8")
    path = mapping(tmp_path)
    path.write_text(
        path.read_text("utf-8").replace('file = "sway.csv"', 'files = ["forces.csv", "moments.csv"]'), "utf-8"
    )
    with pytest.raises(InputError, match="They are not of one run"):
        import_runs(path)


def test_a_file_of_a_run_of_another_frequency_is_an_error(tmp_path):
    other = CaptiveTest("sway", 1.0, Sway(1.0, 0.8, 0.2 * 1.43), periods=8, samples=32)
    star(tmp_path, *seen(TANK.run(HOKIE, other, Silent())))
    refused(tmp_path, "do not follow the stated frequency", "rad/s against Hz", "of this run")


def test_a_file_of_a_steady_run_is_no_oscillation(tmp_path):
    star(tmp_path, loads=np.tile(LOADS[:1], (len(TIME), 1)))
    refused(tmp_path, "no load varies", "steady run")


def test_an_oscillation_taken_for_a_steady_run_is_flagged(tmp_path):
    star(tmp_path)
    run = imported(tmp_path, test=replace(DRIFT, name="sway"), more='absent = ["K"]')
    assert any("varies by" in flag or "not settled" in flag for flag in run.flags)


def test_a_phase_or_amplitude_against_the_column_of_the_motion_is_an_error(tmp_path):
    rows = [",".join(f"{v:.17g}" for v in (t, *row, 0.8 * np.sin(0.2 * t + 0.6)))
            for t, row in zip(TIME, LOADS, strict=True)]  # fmt: skip
    (tmp_path / "sway.csv").write_text("\n".join(["t,Fx,Fy,Fz,Mx,My,Mz,y", *rows]), encoding="utf-8")
    columns = '[columns]\ntime = "t"\ny = "y"\n'
    columns += "".join(f'{a} = "{b}"\n' for a, b in zip("XYZKMN", ("Fx", "Fy", "Fz", "Mx", "My", "Mz"), strict=True))
    refused(tmp_path, r"phase \+34.4 deg", "damping and added mass", form="csv", columns=columns)


def test_two_runs_of_one_file_are_an_error(tmp_path):
    star(tmp_path)
    path = mapping(tmp_path)
    text = path.read_text("utf-8")
    path.write_text(text + text[text.index("\n[[run]]") :].replace('"sway"', '"sway-2"', 1), encoding="utf-8")
    with pytest.raises(InputError, match="sway-2 and sway read the same rows of the same file"):
        import_runs(path)


def test_decimal_commas_between_commas_are_an_error(tmp_path):
    rows = ["t,Fx"] + [f"{t:.3f}".replace(".", ",") + "," + f"{x:.3f}".replace(".", ",") for t, x in
                       zip(TIME, LOADS[:, 0], strict=True)]  # fmt: skip
    (tmp_path / "sway.csv").write_text("\n".join(rows), encoding="utf-8")
    columns = '[columns]\ntime = "t"\nX = "Fx"\n'
    refused(tmp_path, "4 cells, wanted 2", "Decimal commas", "semicolons", form="csv", columns=columns)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_between_semicolons_or_tabs_are_understood(separator, tmp_path):
    path = star(tmp_path)
    head, *rows = lines_of(path)
    rows = [row.replace(",", separator).replace(".", ",") for row in rows]
    path.write_text("\n".join([head.replace('","', f'"{separator}"'), *rows]), encoding="utf-8")
    assert_right(imported(tmp_path))


# Damage of any kind.


def damaged(content: bytearray, random) -> bytearray:
    """Content that was cut, or lost, gained or changed some bytes or lines."""
    at, lines = random.randrange(len(content)), content.split(b"\n")
    line = random.randrange(len(lines))
    match random.randrange(5):
        case 0:
            return content[:at]
        case 1:
            return content[:at] + bytes([random.randrange(256)]) + content[at + 1 :]
        case 2:
            return content[:at] + content[at + random.randrange(1, 80) :]
        case 3:
            return bytearray(b"\n".join([*lines[:line], lines[line], *lines[line:]]))
    return bytearray(b"\n".join([*lines[:line], *lines[line + 1 :]]))


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_file_gives_an_error_of_ours_or_a_whole_run(seed, tmp_path):
    random = Random(seed)
    shutil.copytree(DATA, tmp_path / "data")
    path = random.choice(sorted(item for item in (tmp_path / "data").rglob("*.*") if item.suffix in (".csv", ".dat")))
    path.write_bytes(damaged(bytearray(path.read_bytes()), random))
    for name in ("star", "openfoam", "sheet"):
        try:
            runs = import_runs(tmp_path / "data" / f"{name}.toml")
        except InputError:
            continue
        assert all(np.isfinite(run.loads).all() and np.isfinite(run.history.nu).all() for run in runs)


# Mappings.


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('axes = ["-x", "y", "-z"]', "", ["axes missing", "x aft and z up"]),
        ('["-x", "y", "-z"]', '["x", "y", "-z"]', ["left-handed", "Correct one sign"]),
        ('["-x", "y", "-z"]', '["x", "x", "z"]', ["used twice"]),
        ('moment_point = "origin"', "", ["moment_point: missing", "from_nose"]),
        ('level = "known coefficients"', "", ["level missing", "'rans'"]),
        ('kind = "sway"', 'kind = "swai"', ["no captive test", "Did you mean 'sway'"]),
        ('frequency = "0.2 rad/s"', 'frequency = "0.2"', ["frequency", "bare angle"]),
        (', frequency = "0.2 rad/s"', "", ["sway needs frequency"]),
        ("density =", "densty =", ["unknown key 'densty'", "density"]),
        ('craft = "hokie"', 'craft = "hoky"', ["no craft 'hoky'", "hokie"]),
        ("import/1", "import/9", ["wanted 'towtank/import/1'", "--template"]),
        ('speed = "1.0 m/s"', 'speed = "-1 m/s"', ["speed -1 is not above zero"]),
        ("motion = {", 'half_model = "xz"\nmotion = {', ["cannot move with v", "run of the whole model"]),
        ("motion = {", 'includes = ["weight"]\nmotion = {', ["body", "missing", 'body = "craft"']),
        ("motion = {", 'fins = { top = "3 deg" }\nmotion = {', ["unknown key 'top'", "fins of hokie"]),
        ("motion = {", "mesh = { cells = 1000 }\nmotion = {", ["mesh", "label"]),
        ('file = "sway.csv"', "", ["no file", "or name files on the command"]),
    ],
)
def test_a_fault_of_the_mapping_is_told_with_its_key_and_remedy(old, new, words, tmp_path):
    star(tmp_path)
    path = mapping(tmp_path)
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as told:
        import_runs(path)
    for word in words:
        assert word in str(told.value)
