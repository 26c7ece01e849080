"""Cases of the OpenFOAM tank: what is written, how the motion is given, what is read back. No solver is needed."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import towtank as tt
from openfoam_cases import COARSE, QUICK, TINY
from towtank.errors import ArtefactError, InputError, TankError
from towtank.frames import rotation
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Heave, Incidence, Pitch, Roll, Surge, Sway, Turn, Yaw
from towtank.tank.openfoam.case import read_case, split, write_case
from towtank.tank.openfoam.dictionary import entry, set_entry, take_over_field
from towtank.tank.openfoam.formulation import (
    Arm,
    Domain,
    Moving,
    StillWater,
    Straight,
    Unsteady,
    domain_of,
    formulation_of,
)
from towtank.tank.openfoam.health import harmonic_residual, period_difference
from towtank.tank.openfoam.monitor import Log, changes, flat
from towtank.tank.openfoam.motion import inertial_to_body, pose, timeline
from towtank.tank.openfoam.numerics import MODELS, RESOLVED_ONLY, Numerics

BARE, FINNED = tt.read_craft("suboff-bare"), tt.read_craft("suboff-x")
U, L = 3.0, BARE.length
TESTS = {
    "straight": CaptiveTest("drift", U, Drift(U, 0.1)),
    "arm": CaptiveTest("turn", U, Turn(U, 0.3 * U / L, 0.1)),
    "moving": CaptiveTest("sway", U, Sway(U, 0.1, 2.0), periods=2, samples=16),
    "still": CaptiveTest("slow", 0.05, Sway(0.05, 0.1, 2.0), periods=2, samples=16),
}


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    place = tmp_path_factory.mktemp("cases")
    return {word: write_case(place / word, BARE, test, TINY, QUICK) for word, test in TESTS.items()}


def _tokens_balance(text: str) -> bool:
    text = re.sub(r"//[^\n]*|/\*.*?\*/|\"[^\"]*\"", " ", text, flags=re.S)
    stack = []
    for sign in re.findall(r"[{}()]", text):
        if sign in "{(":
            stack.append(sign)
        elif not stack or stack.pop() + sign not in ("{}", "()"):
            return False
    return not stack


@pytest.mark.parametrize("word", TESTS)
def test_every_dictionary_is_whole_text_with_nothing_left_to_fill_in(cases, word):
    case = cases[word]
    files = [path for part in ("0", "constant", "system") for path in (case.folder / part).iterdir() if path.is_file()]
    names = {path.name for path in files}
    assert {"U", "p", "k", "epsilon", "nut", "controlDict", "fvSchemes", "fvSolution", "transportProperties"} <= names
    assert "omega" not in names
    for path in files:
        text = path.read_text("utf-8")
        assert _tokens_balance(text), path
        assert "{{" not in text, path
        assert "{%" not in text, path
        assert path.name == "motion.dat" or "FoamFile" in text, path


@pytest.mark.parametrize("model", MODELS)
def test_a_turbulence_model_has_its_fields_and_no_others(tmp_path, model):
    wall = "resolved" if model in RESOLVED_ONLY else "functions"
    case = write_case(tmp_path / "case", BARE, TESTS["straight"], TINY, replace(QUICK, turbulence=model, wall=wall))
    assert {path.name for path in (case.folder / "0").iterdir()} == {"U", "p", *MODELS[model]}
    said = (case.folder / "constant" / "turbulenceProperties").read_text("utf-8")
    assert ("laminar;" if model == "laminar" else f"{model};") in said


@pytest.mark.parametrize("model", RESOLVED_ONLY)
def test_a_model_of_the_layer_at_the_wall_without_a_resolved_wall_is_refused(model):
    with pytest.raises(InputError, match="resolved"):
        Numerics(turbulence=model)


def test_a_travel_too_short_for_a_wake_is_refused():
    with pytest.raises(InputError, match="1 to 100"):
        Numerics(travel=0.5)


def test_a_straight_run_in_time_records_the_last_half_of_its_travel(tmp_path):
    case = write_case(tmp_path / "case", BARE, TESTS["straight"], TINY, replace(QUICK, travel=5.0))
    assert isinstance(case.formulation, Unsteady)
    assert case.application == "pimpleFoam"
    assert case.line.end == pytest.approx(5.0 * L / U)
    assert case.line.samples()[0] == case.line.steps // 2
    assert not (case.folder / "constant" / "motion.dat").exists()
    assert read_case(case.folder) == case


def test_a_case_on_file_reads_back_as_it_was_written(cases):
    for case in cases.values():
        assert read_case(case.folder) == case


def test_a_folder_that_holds_something_is_not_written_over(tmp_path):
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "mine").write_text("kept")
    with pytest.raises(ArtefactError, match="not empty"):
        write_case(tmp_path / "case", BARE, TESTS["straight"], TINY, QUICK)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["mine"]


def test_a_full_disk_leaves_no_half_written_case(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("towtank.tank.openfoam.meshing.write_mesh", full)
    with pytest.raises(ArtefactError, match="No space left"):
        write_case(tmp_path / "case", BARE, TESTS["straight"], TINY, QUICK)
    assert list(tmp_path.iterdir()) == []


def test_the_inflow_of_a_straight_run_is_minus_the_velocity_of_the_body(cases):
    said = re.search(r"internalField\s+uniform \(([^)]*)\)", (cases["straight"].folder / "0" / "U").read_text("utf-8"))
    velocity = np.array([float(cell) for cell in said[1].split()])
    assert velocity == pytest.approx([-U * math.cos(0.1), U * math.sin(0.1), 0.0], abs=1e-12)


def test_the_centre_of_a_turn_is_where_the_body_as_a_whole_is_at_rest(cases):
    arm = cases["arm"].formulation
    nu = TESTS["arm"].motion.history(np.zeros(1)).nu[0]
    at = np.array([*arm.centre, 0.0])
    assert nu[:3] + np.cross(nu[3:], at) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_motions_choose_their_formulation():
    kinds = {Straight: (Drift(U, 0.2), Incidence(U, 0.2), Turn(U, 0.0, 0.1)), Arm: (Turn(U, 0.3, 0.0),),
             Moving: (Sway(U, 0.1, 2.0), Yaw(U, 0.1, 2.0), Roll(U, 0.2, 2.0), Surge(U, 0.1, 2.0)),
             StillWater: (Sway(0.1, 0.1, 2.0), Surge(0.1, 0.1, 2.0))}  # fmt: skip
    for kind, motions in kinds.items():
        for motion in motions:
            test = CaptiveTest("x", motion.speed, motion)
            assert isinstance(formulation_of(test, Domain(False, False), L), kind), motion


def test_the_half_domain_follows_from_motion_layout_and_deflections():
    half, rolled, whole = Domain(True, False), Domain(True, True), Domain(False, False)
    for motion, domain in ((Drift(U, 0.1), half), (Turn(U, 0.3), half), (Yaw(U, 0.1, 2.0), half),
                           (Incidence(U, 0.1), rolled), (Pitch(U, 0.1, 2.0), rolled), (Heave(U, 0.1, 2.0), rolled),
                           (Roll(U, 0.1, 2.0), whole)):  # fmt: skip
        for craft in (BARE, FINNED):
            assert domain_of(craft, CaptiveTest("x", U, motion)) == domain
    ahead = Drift(U, 0.0)
    for column, domain in zip(FINNED.mixing.T, (half, rolled, whole), strict=True):
        assert domain_of(FINNED, CaptiveTest("x", U, ahead, tuple(0.1 * column))) == domain
    assert domain_of(FINNED, CaptiveTest("x", U, ahead, (0.1, 0.0, 0.0, 0.0))) == whole
    # A rudder held in a vertical motion leaves no plane of symmetry.
    assert domain_of(FINNED, CaptiveTest("x", U, Incidence(U, 0.1), tuple(0.1 * FINNED.mixing[:, 0]))) == whole
    with pytest.raises(TankError, match="half"):
        domain_of(BARE, CaptiveTest("x", U, Roll(U, 0.1, 2.0)), half=True)


def test_fins_are_rolled_with_the_mesh():
    rolled = Domain(True, True)
    for ours, theirs in zip(rolled.craft_in_mesh(FINNED).fins, FINNED.fins, strict=True):
        assert ours.span_direction == pytest.approx(rolled.to_mesh(theirs.span_direction), abs=1e-12)


@given(st.lists(st.floats(-9.0, 9.0), min_size=3, max_size=3), st.booleans())
def test_axes_of_the_mesh_and_of_the_body_are_turned_into_each_other(vector, turned):
    domain = Domain(False, turned)
    there = domain.to_mesh(np.array(vector))
    assert domain.to_body(there) == pytest.approx(vector, abs=1e-12)
    assert np.linalg.norm(there) == pytest.approx(np.linalg.norm(vector), abs=1e-12)
    # A rotation, not a reflection.
    basis = domain.to_mesh(np.eye(3))
    assert np.linalg.det(basis) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "motion", [Sway(U, 0.2, 2.0), Heave(U, 0.2, 2.0), Yaw(U, 0.3, 2.0), Pitch(U, 0.3, 2.0), Roll(U, 0.3, 2.0),
               Surge(U, 0.2, 2.0), Sway(0.05, 0.1, 2.0)]
)  # fmt: skip
def test_the_recorded_motion_of_the_mesh_is_that_of_the_plan(motion):
    test = CaptiveTest("x", motion.speed, motion, periods=2, samples=16)
    domain = domain_of(BARE, test)
    formulation = formulation_of(test, domain, L)
    line = timeline(test, 40, 0.5)
    numbers, position, turn = pose(test, domain, formulation, line)
    at = line.samples() - numbers[0]
    plan = motion.history(np.arange(2 * 16 + 1) * motion.period / 16)
    stream = motion.speed if isinstance(formulation, Moving) else 0.0
    begun = 0.0 if isinstance(formulation, Moving) else motion.speed * line.lead * line.step
    carried = plan.position - np.outer(stream * plan.time - begun, [1.0, 0.0, 0.0])
    assert domain.to_body(position[at]) == pytest.approx(carried, abs=1e-9)
    assert domain.to_body(turn[at]) == pytest.approx(plan.attitude, abs=1e-12)
    # One rotation at a time, so roll, pitch and yaw of the solver's table need no order.
    assert (np.abs(turn).max(axis=0) > 0.0).sum() <= 1


def test_the_motion_starts_from_rest_without_a_jump_in_velocity_or_acceleration():
    test = CaptiveTest("x", U, Sway(U, 0.2, 2.0), periods=1, samples=64)
    sizes = []
    for steps in (256, 512):
        line = timeline(test, steps, 0.5)
        numbers, position, _ = pose(test, Domain(True, False), Moving(U), line)
        assert not position[numbers <= 0].any()
        sizes.append(np.abs(np.diff(position[:, 1], 4)).max() / line.step**3)
    # Fourth differences fall as the fourth power of the step where the motion is smooth, as the second where the
    # acceleration jumps. Over the cube of the step the former halve, the latter double.
    assert sizes[1] < 0.6 * sizes[0]


def test_the_table_has_a_row_at_every_step_and_reaches_beyond_both_ends(cases):
    case = cases["moving"]
    text = (case.folder / "constant" / "motion.dat").read_text("utf-8")
    rows = [[float(cell) for cell in re.findall(r"[-+0-9.e]+", line)] for line in text.splitlines()[2:-1]]
    assert int(text.splitlines()[0]) == len(rows)
    time = np.array(rows)[:, 0]
    step = float(entry(case.folder / "system" / "controlDict", "deltaT"))
    end = float(entry(case.folder / "system" / "controlDict", "endTime"))
    assert np.diff(time) == pytest.approx(step, rel=1e-9)
    assert time[0] <= -2 * step
    assert time[-1] >= end + 2 * step
    assert np.abs(time / step - np.rint(time / step)).max() < 1e-9
    assert np.array(rows)[time <= 0.0][:, 1:].any() == np.False_


def test_samples_of_the_plan_are_steps_of_the_solver():
    for steps in (16, 50, 64, 100):
        line = timeline(CaptiveTest("x", U, Sway(U, 0.1, 2.0), periods=3, samples=24), steps, 0.3)
        assert line.per_period >= steps
        assert line.plan_time(line.samples()) == pytest.approx(np.arange(73) * math.pi / 24, abs=1e-12)


def test_loads_in_space_become_loads_on_the_body():
    """A force fixed in the body, at a fixed arm, seen from space while the body moves and turns."""
    angles = np.linspace(0.0, 1.2, 7)
    for axis in range(3):
        turn = np.zeros((7, 3))
        turn[:, axis] = angles
        position = np.stack([angles, -0.5 * angles, 2.0 * angles], axis=1)
        force, moment = np.array([3.0, -2.0, 1.0]), np.array([0.4, 5.0, -1.0])
        to_space = rotation(turn)
        in_space = to_space @ force
        about_origin = to_space @ moment + np.cross(position, in_space)
        found = inertial_to_body(np.concatenate([in_space, about_origin], axis=1), position, turn)
        assert found == pytest.approx(np.tile([*force, *moment], (7, 1)), abs=1e-12)


def test_half_the_water_gives_twice_the_load_in_its_plane_and_none_across():
    load = np.arange(1.0, 7.0)[None]
    assert Domain(True, False).loads_to_body(load)[0] == pytest.approx([2.0, 4.0, 0.0, 0.0, 0.0, 12.0])
    assert Domain(True, True).loads_to_body(load)[0] == pytest.approx([2.0, 0.0, 4.0, 0.0, -12.0, 0.0])
    assert Domain(False, False).loads_to_body(load)[0] == pytest.approx(load[0])


def test_a_settled_load_is_flat_and_a_drifting_one_is_not():
    steps = np.arange(400.0)
    settled = np.outer(1.0 + np.exp(-steps / 15.0), [10.0, 4.0, 0.0, 0.0, 0.0, 8.0])
    drifting = np.outer(1.0 + 0.0002 * steps, [10.0, 4.0, 0.0, 0.0, 0.0, 8.0])
    noisy = settled + np.random.default_rng(1).normal(0.0, 0.02, settled.shape)
    assert not flat(settled[:60], 50, 1.0, 0.002)
    assert flat(settled[:200], 50, 1.0, 0.002)
    assert flat(noisy, 50, 1.0, 0.002)
    assert not flat(drifting, 50, 1.0, 0.002)
    assert not flat(settled[:30], 50, 1.0, 0.002)
    assert not flat(np.full((400, 6), np.nan), 50, 1.0, 0.002)


def test_a_load_that_vanishes_by_symmetry_does_not_keep_a_case_from_ending():
    noise = np.random.default_rng(2).normal(0.0, 1e-6, (200, 6))
    loads = np.tile([-10.0, 0.0, 0.0, 0.0, 0.0, 0.0], (200, 1)) + noise
    assert float(changes(loads, 50, 4.0).max()) < 1e-5


def test_a_mean_that_turns_round_is_not_taken_for_settled():
    swing = 10.0 + np.sin(2.0 * np.pi * np.arange(400.0) / 100.0)
    loads = np.outer(swing, np.ones(6))
    assert not any(flat(loads[:n], 50, 1.0, 0.002) for n in range(100, 400, 10))


def test_periods_that_repeat_and_loads_of_low_order_pass_without_remark():
    angle = 2.0 * np.pi * np.arange(3 * 32 + 1) / 32
    clean = np.outer(np.cos(angle) + 0.2 * np.cos(3.0 * angle), [0.0, 10.0, 0.0, 0.0, 0.0, 30.0])
    assert period_difference(clean, 32, 4.0) == pytest.approx(0.0, abs=1e-12)
    assert harmonic_residual(clean, 32, 4.0) == pytest.approx(0.0, abs=1e-12)
    sawtooth = clean + np.outer((-1.0) ** np.arange(97), [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    # Share of a +-1 sawtooth in a signal of standard deviation 10 sqrt((1 + 0.2^2) / 2).
    assert harmonic_residual(sawtooth, 32, 4.0) == pytest.approx(1.0 / np.hypot(7.211, 1.0), rel=1e-3)
    growing = clean * np.linspace(1.0, 1.3, 97)[:, None]
    assert period_difference(growing, 32, 4.0) > 0.05
    assert math.isnan(period_difference(clean[:65], 32, 4.0))


SAID = """Time = 0.5

Courant Number mean: 0.15 max: 12.5
smoothSolver:  Solving for Ux, Initial residual = 0.02, Final residual = 1e-05, No Iterations 2
GAMG:  Solving for p, Initial residual = 0.3, Final residual = 0.002, No Iterations 4
GAMG:  Solving for p, Initial residual = 0.001, Final residual = 1e-05, No Iterations 4
ExecutionTime = 7.25 s  ClockTime = 8 s
"""


def test_the_log_tells_residuals_courant_number_and_time():
    log = Log()
    ends = [log.read(line) for line in SAID.splitlines(keepends=True)]
    assert ends.count(True) == 1
    assert (log.steps, log.time, log.cpu, log.courant_max) == (1, 0.5, 7.25, 12.5)
    assert log.residuals == {"Ux": 0.02, "p": 0.3}
    assert "p 3.0e-01" in log.note()
    assert log.errors == []


def test_the_log_knows_a_failure_from_the_banner_of_its_trap():
    log = Log()
    log.read("trapFpe: Floating point exception trapping enabled (FOAM_SIGFPE).\n")
    assert log.errors == []
    log.read("#1  Foam::sigFpe::sigHandler(int) at ??:?\n")
    log.read("--> FOAM FATAL IO ERROR: \n")
    assert len(log.errors) == 2
    assert log.broken_file


def test_an_entry_is_changed_and_all_else_stays(cases, tmp_path):
    text = (cases["straight"].folder / "system" / "controlDict").read_text("utf-8")
    path = tmp_path / "controlDict"
    path.write_text(text)
    set_entry(path, "stopAt", "writeNow")
    assert entry(path, "stopAt") == "writeNow"
    assert path.read_text("utf-8").replace("writeNow;", "endTime;", 1) == text
    with pytest.raises(TankError, match="no entry"):
        set_entry(path, "nothing", "1")


def test_a_field_of_a_neighbour_keeps_the_new_boundary(cases, tmp_path):
    head = b'FoamFile { version 2.0; format binary; arch "LSB;label=32;scalar=64"; class volScalarField; object p; }\n'
    values = np.arange(5.0).tobytes()
    theirs = head + b"internalField nonuniform List<scalar> \n5\n(" + values + b");\nboundaryField { old }\n"
    (tmp_path / "theirs").write_bytes(theirs)
    (tmp_path / "ours").write_bytes((cases["straight"].folder / "0" / "p").read_bytes())
    take_over_field(tmp_path / "ours", tmp_path / "theirs", 5)
    made = (tmp_path / "ours").read_bytes()
    assert values in made
    assert b"format binary" in made
    assert b"LSB;label=32" in made
    assert b"freestreamPressure" in made
    assert b"old" not in made
    with pytest.raises(TankError, match="5 cells"):
        take_over_field(tmp_path / "ours", tmp_path / "theirs", 6)
    (tmp_path / "theirs").write_bytes(theirs[:60])
    with pytest.raises(TankError, match="not a whole field"):
        take_over_field(tmp_path / "ours", tmp_path / "theirs", 5)


@pytest.mark.parametrize(("ranks", "parts"), [(1, (1, 1, 1)), (2, (2, 1, 1)), (8, (2, 2, 2)), (12, (3, 2, 2))])
def test_parts_are_as_near_to_a_cube_as_the_cores_allow(ranks, parts):
    assert split(ranks) == parts


def test_a_finer_mesh_has_another_label(tmp_path):
    labels = {
        write_case(tmp_path / f"{r:g}", BARE, TESTS["straight"], replace(COARSE, refinement=r), QUICK).label
        for r in (0.7, 1.0)
    }
    assert len(labels) == 2
