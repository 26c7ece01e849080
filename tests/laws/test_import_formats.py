"""One oscillation and one drift, the same from every format, balance, frame and source of the motion."""

from __future__ import annotations

import filecmp
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from import_cases import (
    HEAD,
    HOKIE,
    STAR_AXES,
    STAR_COLUMNS,
    forces_dat,
    inertial,
    known,
    motion_text,
    seen,
    star_csv,
    write_samples,
)
from scipy.io import savemat

from towtank.artefact import write_netcdf
from towtank.craft.hydrostatics import hydrostatics
from towtank.errors import InputError
from towtank.frames import move_load, rotation
from towtank.model.restoring import restoring_vector
from towtank.model.rigid_body import body_of, coriolis_matrix, mass_matrix
from towtank.netcdf import Variable
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Heave, Pitch, Roll, Surge, Sway, Turn, Yaw
from towtank.progress import Silent
from towtank.symbols import LOADS, RATES
from towtank.tank.imported.gate import import_runs
from towtank.tank.imported.reading import read_mapping
from towtank.tank.imported.template import template
from towtank.tank.lpm import LpmTank
from towtank.terms import term_loads

DATA = Path(__file__).parents[1] / "data" / "import"
VALUES = known()
TANK = LpmTank(VALUES)
MOTIONS = {
    "drift": Drift(1.0, 0.1), "turn": Turn(1.0, 0.05, 0.02), "sway": Sway(1.0, 0.8, 0.2),
    "heave": Heave(1.0, 0.8, 0.2), "yaw": Yaw(1.0, 0.6, 0.25), "pitch": Pitch(1.0, 0.6, 0.25),
    "roll": Roll(1.0, 0.2, 0.3), "surge": Surge(1.0, 0.5, 0.3),
}  # fmt: skip
RUNS = {
    name: TANK.run(HOKIE, CaptiveTest(name, 1.0, motion, periods=2, samples=64), Silent())
    for name, motion in MOTIONS.items()
}
NAMES = ("time", *LOADS, "x", "y", "z", "phi", "theta", "psi", *RATES, *(f"{rate}dot" for rate in RATES))
MOTION_TEXT = {name: motion_text(CaptiveTest(name, 1.0, motion)) for name, motion in MOTIONS.items()}


def table(run):
    """Every quantity of a run (N, 25) as NAMES; x is that over the carriage."""
    h = run.history
    position = h.position - np.outer(run.speed * h.time, [1.0, 0.0, 0.0])
    return np.column_stack([h.time, run.loads, position, h.attitude, h.nu, h.nudot])


def csv(path, values, names=NAMES):
    rows = [",".join(names), *(",".join(f"{v:.17g}" for v in row) for row in values)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def columns(names, prefix=""):
    unit = {**dict.fromkeys(("phi", "theta", "psi"), "rad"), **dict.fromkeys("pqr", "rad/s")}
    unit |= {f"{rate}dot": "rad/s^2" for rate in "pqr"}
    lines = [
        f'{name} = {{ name = "{prefix}{name}", unit = "{unit[name]}" }}'
        if name in unit
        else f'{name} = "{prefix}{name}"'
        for name in names
    ]
    return "\n[columns]\n" + "\n".join(lines) + "\n"


def one(
    folder, name, *, form="csv", file="run.csv", axes='["x", "y", "z"]', point='"origin"', cols="", motion="", more=""
):
    head = (
        HEAD.format(form=form, speed=1.0, density=HOKIE.water.density, axes=axes) + f"moment_point = {point}\n{more}\n"
    )
    head += cols + f'\n[[run]]\nname = "{name}"\nfile = "{file}"\nmotion = {motion or MOTION_TEXT[name]}\n'
    (folder / "map.toml").write_text(head, encoding="utf-8")
    (run,) = import_runs(folder / "map.toml")
    return run


def assert_same(found, wanted, loads=1e-12, motion=1e-12):
    size = np.abs(wanted.loads).max()
    np.testing.assert_allclose(found.loads / size, wanted.loads / size, atol=loads)
    np.testing.assert_allclose(found.history.nu, wanted.history.nu, atol=motion)
    np.testing.assert_allclose(found.history.nudot, wanted.history.nudot, atol=motion)


# Formats.


def test_netcdf(tmp_path):
    run = RUNS["sway"]
    values = table(run)
    units = {"time": "s", **{name: "N" if name in "XYZ" else "N*m" for name in LOADS}}
    variables = {n: Variable(("row",), values[:, i].copy(), {"units": units[n]}) for i, n in enumerate(NAMES[:7])}
    write_netcdf(tmp_path / "run.nc", "someone/else/1", variables, {})
    assert_same(one(tmp_path, "sway", form="netcdf", file="run.nc", cols=columns(NAMES[:7])), run)


def test_netcdf_of_another_program(tmp_path):
    import xarray

    run = RUNS["sway"]
    content = {name: ("t", table(run)[:, i]) for i, name in enumerate(NAMES[:7])}
    xarray.Dataset(content).to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    assert_same(one(tmp_path, "sway", form="netcdf", file="run.nc", cols=columns(NAMES[:7])), run)


@pytest.mark.parametrize("compressed", [False, True])
def test_mat_of_version_7_with_fields_of_a_structure_array(compressed, tmp_path):
    run = RUNS["sway"]
    fields = {name: table(run)[:, i : i + 1] for i, name in enumerate(NAMES[:7])}
    other = {name: values * 0.0 for name, values in fields.items()}
    savemat(tmp_path / "run.mat", {"runs": np.array([other, fields])}, do_compression=compressed)
    assert_same(one(tmp_path, "sway", form="mat", file="run.mat", cols=columns(NAMES[:7], "runs(2).")), run)


def test_mat_of_version_7_3(tmp_path):
    run = RUNS["sway"]
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as file:
        for i, name in enumerate(NAMES[:7]):
            file.create_dataset(f"run/{name}", data=table(run)[:, i][None, :])
    with (tmp_path / "run.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, written by a test".ljust(124) + b"\x00\x02IM")
    assert_same(one(tmp_path, "sway", form="mat", file="run.mat", cols=columns(NAMES[:7], "run.")), run)


def test_mat_of_version_7_3_with_a_structure_array(tmp_path):
    """Such an array holds a reference to each value; a name without a number is refused."""
    run = RUNS["sway"]
    with h5py.File(tmp_path / "run.mat", "w") as file:
        for i, name in enumerate(NAMES[:7]):
            values = table(run)[:, i][None, :]
            places = [file.create_dataset(f"#refs#/{name}{k}", data=values * k).ref for k in (0.0, 1.0)]
            file.create_dataset(f"runs/{name}", data=np.array(places, dtype=h5py.ref_dtype)[:, None])
    text = columns(NAMES[:7], "runs(2).")
    assert_same(one(tmp_path, "sway", form="mat", file="run.mat", cols=text), run)
    with pytest.raises(InputError, match="Choose one by its number"):
        one(tmp_path, "sway", form="mat", file="run.mat", cols=columns(NAMES[:7], "runs."))


@pytest.mark.parametrize("form", ["netcdf", "mat"])
def test_a_variable_that_is_missing_or_of_another_length_is_an_error(form, tmp_path):
    values = {name: table(RUNS["sway"])[:, i].copy() for i, name in enumerate(NAMES[:7])}
    values["N"] = values["N"][:-1]
    if form == "mat":
        savemat(tmp_path / "run.file", values, appendmat=False)
    else:
        made = {name: Variable((f"row{len(item)}",), item) for name, item in values.items()}
        write_netcdf(tmp_path / "run.file", "someone/else/1", made, {})
    with pytest.raises(InputError, match="different lengths"):
        one(tmp_path, "sway", form=form, file="run.file", cols=columns(NAMES[:7]))
    with pytest.raises(InputError, match="no variable 'r'"):
        one(tmp_path, "sway", form=form, file="run.file", cols=columns((*NAMES[:7], "r")))


def test_function_objects_of_several_patches_add_up(tmp_path):
    run = RUNS["sway"]
    for name, share in (("hull", 0.7), ("fins", 0.3)):
        forces_dat(tmp_path / "case" / name / "0" / "forces.dat", run.history.time, share * run.loads)
    point = f'{{ nose = ["{HOKIE.origin_from_nose!r} m", "0 m", "0 m"] }}'
    files = 'case/hull", "case/fins'
    head = HEAD.format(form="openfoam", speed=1.0, density=HOKIE.water.density, axes='["x", "y", "z"]')
    head += f'moment_point = {point}\nsum = true\n[[run]]\nname = "sway"\nfiles = ["{files}"]\n'
    (tmp_path / "map.toml").write_text(head + f"motion = {MOTION_TEXT['sway']}\n", encoding="utf-8")
    assert_same(import_runs(tmp_path / "map.toml")[0], run)


def test_star_monitors_in_a_file_each(tmp_path):
    run = RUNS["sway"]
    text = star_csv(tmp_path / "all.csv", *seen(run)).read_text("utf-8").splitlines()
    for i in range(1, 7):
        rows = [",".join((row.split(",")[0], row.split(",")[i])) for row in text]
        (tmp_path / f"m{i}.csv").write_text("\n".join(rows), encoding="utf-8")
    files = '", "'.join(f"m{i}.csv" for i in range(1, 7))
    path = tmp_path / "map.toml"
    head = HEAD.format(form="star", speed=1.0, density=HOKIE.water.density, axes='["-x", "y", "-z"]')
    head += 'moment_point = "origin"\n' + STAR_COLUMNS
    path.write_text(head + f'\n[[run]]\nname = "sway"\nfiles = ["{files}"]\nmotion = {MOTION_TEXT["sway"]}\n', "utf-8")
    assert_same(import_runs(path)[0], run)


def test_files_named_on_the_command_stand_in_for_those_of_the_mapping(tmp_path):
    one_file = csv(tmp_path / "elsewhere.csv", table(RUNS["sway"]))
    csv(tmp_path / "run.csv", table(RUNS["sway"]))
    first = one(tmp_path, "sway", cols=columns(NAMES[:7]))
    (found,) = import_runs(tmp_path / "map.toml", [one_file])
    assert found.id == first.id  # the content decides, not the name of the file
    assert list(found.provenance["inputs"]) == [one_file.as_posix()]


def test_a_steady_run_counted_by_iterations_is_averaged_over_its_window(tmp_path):
    run = RUNS["drift"]
    _, loads = seen(run)
    decay = np.exp(-np.arange(400) / 15.0)[:, None]
    star_csv(tmp_path / "run.csv", np.arange(1, 401), loads[0] * (1.0 + decay), clock="Iteration")
    found = one(
        tmp_path, "drift", form="star", axes='["-x", "y", "-z"]', cols=STAR_COLUMNS, more="window = { last = 0.25 }"
    )
    # The window starts at iteration 300: what is left of the start there is exp(-20) = 2e-9.
    assert_same(found, run, loads=1e-8)
    assert not found.flags
    early = one(
        tmp_path, "drift", form="star", axes='["-x", "y", "-z"]', cols=STAR_COLUMNS, more="window = { end = 60 }"
    )
    assert any("not settled" in flag for flag in early.flags)


# Motions.


@pytest.mark.parametrize("name", ["sway", "heave", "yaw", "pitch", "roll", "surge"])
def test_a_motion_from_columns_of_velocities_and_accelerations(name, tmp_path):
    csv(tmp_path / "run.csv", table(RUNS[name]))
    w = 2.0 * np.pi / RUNS[name].period
    motion = f'{{ kind = "{name}", frequency = "{w!r} rad/s", from = "columns" }}'
    assert_same(one(tmp_path, name, cols=columns(NAMES), motion=motion), RUNS[name])


@pytest.mark.parametrize("name", ["sway", "heave", "yaw", "pitch", "roll", "surge"])
@pytest.mark.parametrize("given", ["velocities", "positions"])
def test_a_motion_from_columns_is_differentiated_where_needed(name, given, tmp_path):
    names = NAMES[:7] + (NAMES[7:19] if given == "velocities" else NAMES[7:13])
    csv(tmp_path / "run.csv", table(RUNS[name])[:, : len(names)], names)
    w = 2.0 * np.pi / RUNS[name].period
    motion = f'{{ kind = "{name}", frequency = "{w!r} rad/s", from = "columns" }}'
    found = one(tmp_path, name, cols=columns(names), motion=motion)
    # Harmonics above the eighth are cut: of the heading atan(a w cos / U) of 8.6 deg the ninth is below 1e-7 of it.
    assert_same(found, RUNS[name], motion=1e-7)
    assert any("time derivatives" in text for text in found.provenance["conversions"])


def test_positions_may_be_those_in_the_water(tmp_path):
    run = RUNS["surge"]
    values = table(run)
    values[:, 7] += run.speed * run.history.time
    csv(tmp_path / "run.csv", values[:, :13], NAMES[:13])
    motion = '{ kind = "surge", frequency = "0.3 rad/s", from = "columns", position_in = "water" }'
    found = one(tmp_path, "surge", cols=columns(NAMES[:13]), motion=motion)
    # One harmonic of a motion that has one.
    assert_same(found, run)


def test_columns_along_axes_of_the_file_are_turned_with_the_loads(tmp_path):
    """x aft and z up in the whole file: positions, angles, velocities and loads alike."""
    run = RUNS["yaw"]
    values = table(run)
    for start in range(1, 25, 3):
        values[:, start : start + 3] = values[:, start : start + 3] @ STAR_AXES.T
    csv(tmp_path / "run.csv", values)
    w = 2.0 * np.pi / run.period
    motion = f'{{ kind = "yaw", frequency = "{w!r} rad/s", from = "columns" }}'
    assert_same(one(tmp_path, "yaw", axes='["-x", "y", "-z"]', cols=columns(NAMES), motion=motion), run)


def test_a_phase_and_a_start_say_where_in_the_cycle_the_file_begins(tmp_path):
    motion, phase = MOTIONS["sway"], 0.7
    time = np.arange(193) * motion.period / 64 + 5.0
    history = motion.history(time + phase / 0.2)
    control = np.tile(HOKIE.virtual(np.zeros(len(HOKIE.fins))), (len(time), 1))
    loads = term_loads(VALUES, history.nu, history.nudot, control)
    csv(tmp_path / "run.csv", np.column_stack([time, loads, history.position[:, 1]]), (*NAMES[:7], "y"))
    text = MOTION_TEXT["sway"].replace(" }", ', phase = "0.7 rad" }')
    for clause in (text, MOTION_TEXT["sway"].replace(" }", f', start = "{-0.7 / 0.2!r} s" }}')):
        found = one(tmp_path, "sway", cols=columns((*NAMES[:7], "y")), motion=clause)
        again = term_loads(VALUES, found.history.nu, found.history.nudot, found.control)
        np.testing.assert_allclose(found.loads, again, atol=1e-9 * np.abs(loads).max())
        assert any(text.startswith("measured y: phase") for text in found.provenance["conversions"])


@pytest.mark.parametrize(
    ("name", "column", "sign"), [("heave", "z", -1.0), ("pitch", "z", -1.0), ("roll", "phi", -1.0)]
)
def test_a_displacement_in_the_file_is_compared_with_the_stated_motion_along_its_axes(name, column, sign, tmp_path):
    """x aft and z up: the column has the opposite sign of the body's, and that is not taken for a phase of 180 deg."""
    run = RUNS[name]
    time, loads = seen(run)
    moved = sign * (run.history.position[:, 2] if column == "z" else run.history.attitude[:, 0])
    csv(tmp_path / "run.csv", np.column_stack([time, loads, moved]), (*NAMES[:7], column))
    found = one(tmp_path, name, axes='["-x", "y", "-z"]', cols=columns((*NAMES[:7], column)))
    assert_same(found, run)
    assert any(text.startswith(f"measured {column}: phase") for text in found.provenance["conversions"])
    assert not found.flags


@pytest.mark.parametrize(("name", "given"), [("drift", ("psi",)), ("drift", ("u", "v")), ("turn", ("u", "v", "r"))])
def test_a_steady_motion_from_columns_is_their_average(name, given, tmp_path):
    run = RUNS[name]
    h, count = run.history, 60
    held = {"psi": h.attitude[0, 2], "u": h.nu[0, 0], "v": h.nu[0, 1], "r": h.nu[0, 5]}
    row = np.concatenate([run.loads[0], [held[key] for key in given]])
    values = np.column_stack([np.arange(count) * 0.1, np.tile(row, (count, 1))])
    csv(tmp_path / "run.csv", values, (*NAMES[:7], *given))
    motion = f'{{ kind = "{name}", from = "columns" }}'
    assert_same(one(tmp_path, name, cols=columns((*NAMES[:7], *given)), motion=motion), run)


def test_a_turn_from_columns_needs_its_rate(tmp_path):
    csv(tmp_path / "run.csv", table(RUNS["turn"]))
    with pytest.raises(InputError, match="a turn from columns needs its rate"):
        one(tmp_path, "turn", cols=columns((*NAMES[:7], "u", "v")), motion='{ kind = "turn", from = "columns" }')


def test_a_free_motion_of_columns_keeps_its_loads(tmp_path):
    t = np.linspace(0.0, 60.0, 601)
    v, r = 0.1 * np.sin(0.3 * t) + 0.05 * np.sin(0.71 * t), 0.03 * np.sin(0.4 * t + 1.0)
    psi = 0.03 / 0.4 * (np.cos(1.0) - np.cos(0.4 * t + 1.0))
    nu = np.stack([np.ones_like(t), v, 0 * t, 0 * t, 0 * t, r], axis=-1)
    nudot = np.zeros_like(nu)
    nudot[:, 1] = 0.03 * np.cos(0.3 * t) + 0.0355 * np.cos(0.71 * t)
    nudot[:, 5] = 0.012 * np.cos(0.4 * t + 1.0)
    loads = term_loads(VALUES, nu, nudot, np.zeros((len(t), 4)))
    names = (*NAMES[:7], "psi", "u", "v", "r")
    csv(tmp_path / "run.csv", np.column_stack([t, loads, psi, nu[:, 0], v, r]), names)
    found = one(tmp_path, "drift", cols=columns(names), motion='{ kind = "free", from = "columns" }')
    assert (found.kind, found.periods) == ("free", 1)
    np.testing.assert_allclose(found.loads, loads, atol=1e-9 * np.abs(loads).max())
    # A quintic spline with 88 steps in the shortest period: (2 pi / 88)^5 = 2e-6, more at the ends.
    np.testing.assert_allclose(found.history.nudot, nudot, atol=1e-5)


# Balances, frames, halves.


@pytest.mark.parametrize("name", ["sway", "yaw", "pitch", "roll", "surge", "turn", "drift"])
@pytest.mark.parametrize("measured", ["craft on balance", "balance on craft"])
def test_weight_buoyancy_and_inertia_on_a_balance_are_taken_out(name, measured, tmp_path):
    """What the balance holds, by the matrices of the model: M_RB nudot + C_RB nu + G - water."""
    run = RUNS[name]
    body = body_of(HOKIE, hydrostatics(HOKIE).cb)
    down = rotation(run.history.attitude)[:, 2, :]
    held = (
        np.array(
            [
                np.array(mass_matrix(body)) @ nudot
                + np.array(coriolis_matrix(body, nu)) @ nu
                + restoring_vector(body, d)
                for nu, nudot, d in zip(run.history.nu, run.history.nudot, down, strict=True)
            ]
        )
        - run.loads
    )
    loads = held if measured == "balance on craft" else -held
    csv(tmp_path / "run.csv", np.column_stack([run.history.time, loads]), NAMES[:7])
    more = f'measured = "{measured}"\nincludes = ["weight", "buoyancy", "inertia"]\nbody = "craft"'
    found = one(tmp_path, name, cols=columns(NAMES[:7]), more=more)
    # Weight over the largest load is the loss of digits in the difference.
    assert_same(found, run, loads=1e-15 * 16 * body.m * body.g * HOKIE.length / np.abs(run.loads).max())
    assert "taken out: weight, buoyancy, inertia" in " ".join(found.provenance["conversions"])


@pytest.mark.parametrize("fixed", ["body", "carriage", "water"])
@pytest.mark.parametrize("name", ["yaw", "pitch", "roll", "surge"])
def test_a_moment_point_may_stay_with_the_body_the_carriage_or_the_water(name, fixed, tmp_path):
    run, point = RUNS[name], (0.5, 0.1, -0.2)
    turn, h = rotation(run.history.attitude), run.history
    if fixed == "body":
        body = move_load(run.loads, np.array(point))
        world = np.concatenate([np.einsum("nij,nj->ni", turn, part) for part in (body[:, :3], body[:, 3:])], axis=1)
    elif fixed == "carriage":
        world = inertial(run, point)
    else:
        world = inertial(replace(run, speed=0.0), point)
    csv(tmp_path / "run.csv", np.column_stack([h.time, world]), NAMES[:7])
    place = f'{{ from_nose = "{HOKIE.origin_from_nose - 0.5!r} m", y = "0.1 m", z = "-0.2 m", fixed = "{fixed}" }}'
    found = one(tmp_path, name, point=place, cols=columns(NAMES[:7]), more='frame = "inertial"')
    # The arm to a point left behind in the water grows to the length of the run.
    assert_same(found, run, loads=1e-12 * max(1.0, h.time[-1]))


@pytest.mark.parametrize(("name", "fixed"), [("drift", "water"), ("turn", "carriage"), ("turn", "water")])
def test_a_steady_run_about_a_point_left_behind_is_refused(name, fixed, tmp_path):
    csv(tmp_path / "run.csv", table(RUNS[name]))
    with pytest.raises(InputError, match=f"a {name} leaves a point fixed in the {fixed} behind"):
        one(tmp_path, name, point=f'{{ from_nose = "3 m", fixed = "{fixed}" }}', cols=columns(NAMES[:7]))


def test_a_half_model_cut_at_the_waterplane_is_doubled_in_the_horizontal_plane(tmp_path):
    run = RUNS["sway"]
    loads = run.loads * np.array([0.5, 0.5, 0.0, 0.0, 0.0, 0.5])
    loads[:, 2:5] = 7.0
    csv(tmp_path / "run.csv", np.column_stack([run.history.time, loads]), NAMES[:7])
    assert_same(one(tmp_path, "sway", cols=columns(NAMES[:7]), more='half_model = "xy"'), run)


def test_a_mesh_of_the_mapping_reaches_the_grid_study(tmp_path):
    from towtank.grid.gather import mesh_of

    csv(tmp_path / "run.csv", table(RUNS["sway"]))
    found = one(tmp_path, "sway", cols=columns(NAMES[:7]), more='mesh = { label = "fine", cells = 4200000 }')
    assert (mesh_of(found).label, mesh_of(found).cells) == ("fine", 4200000)


def test_identity_follows_what_decides_the_loads(tmp_path):
    csv(tmp_path / "run.csv", table(RUNS["sway"]))
    base = one(tmp_path, "sway", cols=columns(NAMES[:7]))
    assert base.id == one(tmp_path, "sway", cols=columns(NAMES[:7]), more="exploratory = true").id
    moved = one(tmp_path, "sway", cols=columns(NAMES[:7]), point='{ from_nose = "3 m" }')
    csv(tmp_path / "run.csv", table(RUNS["sway"]) * 1.01)
    other = one(
        tmp_path, "sway", cols=columns(NAMES[:7]), motion=MOTION_TEXT["sway"].replace("0.2 rad", "0.19801980198 rad")
    )
    assert len({base.id, moved.id, other.id}) == 3
    assert all(run.id.startswith("sway-") and len(run.id) == len("sway-") + 8 for run in (base, moved, other))


# Samples and templates.


def test_sample_files_are_those_that_known_coefficients_give(tmp_path):
    write_samples(tmp_path)
    names = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file())
    assert names == sorted(path.relative_to(DATA).as_posix() for path in DATA.rglob("*") if path.is_file())
    _, differing, broken = filecmp.cmpfiles(tmp_path, DATA, names, shallow=False)
    assert (differing, broken) == ([], [])


@pytest.mark.parametrize("form", ["star", "openfoam", "csv", "netcdf", "mat"])
def test_every_template_is_a_mapping(form, tmp_path):
    (tmp_path / "map.toml").write_text(template(form), encoding="utf-8")
    craft, _, specs = read_mapping(tmp_path / "map.toml")
    assert craft.name == "hokie"
    assert [spec.format for spec in specs] == [form, form]


def test_a_file_of_two_thousand_rows_takes_a_fiftieth_of_a_second(tmp_path):
    motion = Sway(1.0, 0.8, 0.2)
    run = TANK.run(HOKIE, CaptiveTest("sway", 1.0, motion, periods=4, samples=500), Silent())
    text = star_csv(tmp_path / "0.csv", *seen(run)).read_text("utf-8")
    head = HEAD.format(form="star", speed=1.0, density=HOKIE.water.density, axes='["-x", "y", "-z"]')
    head += 'moment_point = "origin"\n' + STAR_COLUMNS
    for i in range(40):
        (tmp_path / f"{i}.csv").write_text(text + "\n" * i, encoding="utf-8")
        head += f'\n[[run]]\nname = "r{i}"\nfile = "{i}.csv"\nmotion = {motion_text(CaptiveTest("", 1.0, motion))}\n'
    (tmp_path / "map.toml").write_text(head, encoding="utf-8")
    start = time.perf_counter()
    assert len(import_runs(tmp_path / "map.toml")) == 40
    # 0.02 s on one core of the machine it was written on; five times that for a slower or shared one.
    assert time.perf_counter() - start < 40 * 0.1
