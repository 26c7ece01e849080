"""A campaign runs each test once, whatever happens to the process and to the files in between."""

import contextlib
import os
import re
from dataclasses import replace

import numpy as np
import pytest

import towtank.tank.files
from towtank.craft.library import read_craft
from towtank.errors import ArtefactError, PlanError, TankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Sway
from towtank.tank.campaign import status, tow
from towtank.tank.identity import run_id, run_ids
from towtank.tank.lpm import LpmTank

HOKIE = read_craft("hokie")
VALUES = {"Xuu": -50.0, "Yuv": -300.0, "Yvdot": -4800.0}
PLAN = Plan(
    HOKIE,
    1.0,
    (
        *(CaptiveTest(f"drift-{i}", 1.0, Drift(1.0, 0.02 * i)) for i in range(4)),
        *(CaptiveTest(f"sway-{i}", 1.0, Sway(1.0, 0.2 * (i + 1), 0.2), samples=16) for i in range(3)),
    ),
)


class CountingTank(LpmTank):
    """A tank that remembers what it ran, and is stopped by Ctrl-C, or fails, at the run of a given number."""

    def __init__(self, stop_at=None, error=KeyboardInterrupt, values=VALUES):
        super().__init__(values)
        object.__setattr__(self, "ran", [])
        object.__setattr__(self, "stop", (stop_at, error))

    def run(self, craft, test, progress):
        if len(self.ran) == self.stop[0]:
            raise self.stop[1]
        self.ran.append(test.name)
        return super().run(craft, test, progress)


class Spy:
    def __init__(self):
        self.told = []

    def start(self, task, total):
        self.told.append(("start", total))

    def step(self, task, note=""):
        self.told.append(("step", note))

    def done(self, task):
        self.told.append(("done", None))


NAMES = tuple(test.name for test in PLAN.tests)


def test_runs_come_in_the_order_of_the_plan_with_or_without_files(tmp_path):
    plain, filed = tow(PLAN, CountingTank()), tow(PLAN, CountingTank(), tmp_path)
    assert tuple(run.name for run in plain) == tuple(run.name for run in filed) == NAMES
    assert sorted(path.parent.name for path in tmp_path.glob("runs/*/run.nc")) == sorted(run.id for run in filed)
    for one, other in zip(plain, filed, strict=True):
        np.testing.assert_array_equal(one.loads, other.loads)


@pytest.mark.parametrize("stop_at", range(len(NAMES)))
def test_after_ctrl_c_at_any_run_each_test_is_run_exactly_once(tmp_path, stop_at):
    first = CountingTank(stop_at)
    with pytest.raises(TankError, match=rf"after {stop_at} of {len(NAMES)} runs.*ask again"):
        tow(PLAN, first, tmp_path)
    assert status(PLAN, CountingTank(), tmp_path).done == NAMES[:stop_at]
    second = CountingTank()
    runs = tow(PLAN, second, tmp_path)
    assert first.ran + second.ran == list(NAMES)
    for run, whole in zip(runs, tow(PLAN, CountingTank()), strict=True):
        np.testing.assert_array_equal(run.loads, whole.loads)
        np.testing.assert_array_equal(run.history.nudot, whole.history.nudot)


def test_ctrl_c_while_a_file_is_written_leaves_no_part_of_it(tmp_path, monkeypatch):
    write = towtank.artefact._write_bytes

    def interrupted(part, content):
        write(part, content[: len(content) // 2])
        raise KeyboardInterrupt

    monkeypatch.setattr(towtank.artefact, "_write_bytes", interrupted)
    with pytest.raises(TankError, match="after 0 of"):
        tow(PLAN, CountingTank(), tmp_path)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    monkeypatch.undo()
    assert len(tow(PLAN, CountingTank(), tmp_path)) == len(NAMES)


def test_interruption_without_a_folder_says_that_nothing_was_kept():
    with pytest.raises(TankError, match="out=DIR"):
        tow(PLAN, CountingTank(2))


def test_a_failing_test_leaves_the_runs_before_it(tmp_path):
    with pytest.raises(TankError, match="no water"):
        tow(PLAN, CountingTank(3, TankError("no water")), tmp_path)
    assert status(PLAN, CountingTank(), tmp_path).done == NAMES[:3]


@pytest.mark.parametrize("share", [0.0, 0.4, 0.95])
def test_a_broken_file_is_run_again_and_said_so(tmp_path, share):
    ids = [run.id for run in tow(PLAN, CountingTank(), tmp_path)]
    broken = tmp_path / "runs" / ids[2] / "run.nc"
    content = broken.read_bytes()
    broken.write_bytes(content[: int(share * len(content))])
    found = status(PLAN, CountingTank(), tmp_path)
    assert found.broken == (NAMES[2],)
    assert (len(found.done), found.to_do) == (len(NAMES) - 1, ())
    tank, spy = CountingTank(), Spy()
    tow(PLAN, tank, tmp_path, spy)
    assert tank.ran == [NAMES[2]]
    notes = [note for what, note in spy.told if what == "step"]
    assert ["run again" in note for note in notes].count(True) == 1
    assert ["on file" in note for note in notes].count(True) == len(NAMES) - 1
    assert status(PLAN, CountingTank(), tmp_path).done == NAMES


def test_a_file_moved_to_another_run_is_not_taken_for_it(tmp_path):
    ids = [run.id for run in tow(PLAN, CountingTank(), tmp_path)]
    (tmp_path / "runs" / ids[0] / "run.nc").replace(tmp_path / "runs" / ids[1] / "run.nc")
    tank = CountingTank()
    tow(PLAN, tank, tmp_path)
    assert tank.ran == [NAMES[0], NAMES[1]]


def test_too_violent_a_plan_is_refused_before_any_test_is_run(tmp_path):
    violent = CaptiveTest("violent", 1.0, Sway(1.0, 3.0, 0.5))
    tank = CountingTank()
    with pytest.raises(PlanError, match="violent"):
        tow(replace(PLAN, tests=(*PLAN.tests, violent)), tank, tmp_path)
    assert tank.ran == []
    assert list(tmp_path.iterdir()) == []


@contextlib.contextmanager
def unprivileged():
    """As a user who may not write everywhere: root may, so it steps down to nobody."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


def test_a_read_only_folder_is_told_before_any_test_is_run(tmp_path):
    for folder in (tmp_path, *tmp_path.parents[:2]):
        folder.chmod(0o755)
    tmp_path.chmod(0o555)
    tank = CountingTank()
    try:
        with unprivileged(), pytest.raises(ArtefactError, match=r"cannot write .*--out"):
            tow(PLAN, tank, tmp_path)
    finally:
        tmp_path.chmod(0o755)
    assert tank.ran == []
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_place_of_the_study_folder_is_told(tmp_path):
    (tmp_path / "study").write_text("in the way")
    with pytest.raises(ArtefactError, match=r"study.*--out"):
        tow(PLAN, CountingTank(), tmp_path / "study")


def test_progress_is_told_of_every_test_and_of_the_end():
    spy = Spy()
    tow(PLAN, CountingTank(), None, spy)
    assert spy.told[0] == ("start", len(NAMES))
    assert [what for what, _ in spy.told].count("step") == len(NAMES)
    assert spy.told[-1] == ("done", None)


def test_an_identity_is_a_slug_and_eight_hex_digits_and_does_not_change():
    tank = CountingTank()
    identity = run_id(HOKIE, PLAN.tests[0], tank)
    assert re.fullmatch(r"drift-0-[0-9a-f]{8}", identity)
    assert run_ids(PLAN, tank)[0] == identity == run_id(read_craft("hokie"), PLAN.tests[0], CountingTank())
    assert len(set(run_ids(PLAN, tank))) == len(PLAN.tests)


def test_identity_follows_everything_that_changes_a_load_and_nothing_else():
    test, tank = PLAN.tests[4], CountingTank()
    base = run_id(HOKIE, test, tank)
    fin = HOKIE.fins[0]

    def with_fin(**changes):
        return replace(HOKIE, fins=(replace(fin, **changes), *HOKIE.fins[1:]))

    changed = [
        run_id(replace(HOKIE, origin_from_nose=HOKIE.origin_from_nose + 0.01), test, tank),
        run_id(replace(HOKIE, water=replace(HOKIE.water, density=1025.0)), test, tank),
        run_id(with_fin(tip_chord=fin.tip_chord * 1.01), test, tank),
        run_id(replace(HOKIE, profile=read_craft("spheroid-6-1").profile), test, tank),
        run_id(HOKIE, replace(test, motion=replace(test.motion, amplitude=0.21)), tank),
        run_id(HOKIE, replace(test, fins=(0.1, 0.0, 0.0, 0.0)), tank),
        run_id(HOKIE, replace(test, samples=32), tank),
        run_id(HOKIE, test, CountingTank(values={**VALUES, "Yuv": -301.0})),
    ]
    assert len({base, *changed}) == len(changed) + 1
    same = [
        run_id(with_fin(max_angle=0.3, max_rate=0.1, time_constant=1.0), test, tank),
        run_id(replace(HOKIE, mass=replace(HOKIE.mass, mass=5000.0)), test, tank),
        run_id(HOKIE, replace(test, exploratory=True), tank),
        run_id(HOKIE, replace(test, fins=(0.0,) * 4), tank),
    ]
    assert set(same) == {base}


def test_marking_a_run_exploratory_afterwards_repeats_nothing(tmp_path):
    tow(PLAN, CountingTank(), tmp_path)
    tank = CountingTank()
    marked = replace(PLAN, tests=tuple(replace(test, exploratory=True) for test in PLAN.tests))
    assert all(run.exploratory for run in tow(marked, tank, tmp_path))
    assert tank.ran == []
