"""Runs side by side: each once, in an order that pays, and nothing lost when one fails or the campaign is ended."""

from __future__ import annotations

import errno
import json
import os
import platform
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import towtank.artefact
from towtank.craft.library import read_craft
from towtank.errors import ArtefactError, TankError
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Sway, Turn
from towtank.tank.account import Account, duration
from towtank.tank.campaign import status, tow, tow_one
from towtank.tank.failure import failure_of
from towtank.tank.identity import run_ids
from towtank.tank.lock import FILE, alone
from towtank.tank.lpm import LpmTank
from towtank.tank.openfoam.mesh.grid import MeshSettings
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.schedule import schedule
from towtank.tank.pool import Schedule, as_ended, in_turn

HOKIE = read_craft("hokie")
PLAN = Plan(HOKIE, 1.0, tuple(CaptiveTest(f"drift-{i}", 1.0, Drift(1.0, 0.02 * i)) for i in range(8)))
NAMES = tuple(test.name for test in PLAN.tests)
PATIENCE = 60.0
"""Seconds that a loaded machine may take for what needs one."""


class SlowTank(LpmTank):
    """A tank that takes its time and remembers; ``acts`` is done before the run of a test."""

    def __init__(self, acts: Callable[[str], None] = lambda name: None, takes: float = 0.01) -> None:
        super().__init__({"Yuv": -300.0})
        object.__setattr__(self, "ran", [])
        object.__setattr__(self, "stop", threading.Event())
        object.__setattr__(self, "acts", acts)
        object.__setattr__(self, "takes", takes)

    def ended_by(self, stop):
        object.__setattr__(self, "stop", stop)
        return self

    def run(self, craft, test, progress):
        self.ran.append(test.name)
        self.acts(test.name)
        if self.stop.wait(self.takes):
            raise TankError("stopped")
        return super().run(craft, test, progress)


class Spy:
    def __init__(self, step: Callable[[str], None] = lambda note: None) -> None:
        self.notes: list[str] = []
        self.act = step

    def start(self, task, total):
        pass

    def step(self, task, note=""):
        self.notes.append(note)
        self.act(note)

    def done(self, task):
        pass


@given(
    st.lists(st.integers(1, 5), min_size=1, max_size=6), st.integers(1, 5),
    st.lists(st.floats(0.0, 9.0), min_size=30, max_size=30),
)  # fmt: skip
def test_every_run_is_made_once_and_a_chain_begins_at_its_head(lengths, jobs, costs):
    numbers = iter(range(sum(lengths)))
    chains = tuple(tuple(next(numbers) for _ in range(length)) for length in lengths)
    begun: list[int] = []

    def work(number: int) -> int:
        begun.append(number)
        return -number

    found = dict(as_ended(work, Schedule(chains, tuple(costs)), jobs, threading.Event()))
    assert found == {number: -number for chain in chains for number in chain}
    assert sorted(begun) == list(range(sum(lengths)))


def test_a_chain_is_one_run_at_a_time_while_there_are_others():
    under_way: set[int] = set()
    together: list[set[int]] = []

    def work(number: int) -> None:
        under_way.add(number)
        together.append(set(under_way))
        time.sleep(0.005)
        under_way.discard(number)

    list(as_ended(work, Schedule(((0, 1, 2, 3), (4, 5, 6, 7)), (1.0,) * 8), 2, threading.Event()))
    assert all(len(both & {0, 1, 2, 3}) <= 1 for both in together[:-2])
    assert max(map(len, together)) == 2


def test_a_core_without_a_chain_takes_the_far_half_of_one():
    order: list[int] = []
    gate = threading.Event()

    def work(number: int) -> None:
        order.append(number)
        if number == 0:
            gate.wait(PATIENCE)
        elif len(order) == 6:
            gate.set()

    list(as_ended(work, Schedule((tuple(range(6)),), (1.0,) * 6), 2, threading.Event()))
    # 0 is held; the other job works off 3 4 5, then what is left of the near half.
    assert order[:4] == [0, 3, 4, 5]
    assert sorted(order) == list(range(6))


def test_the_longest_work_is_not_left_for_the_end():
    begun: list[int] = []
    list(as_ended(begun.append, Schedule(((0,), (1,), (2, 3)), (1.0, 9.0, 2.0, 2.0)), 1, threading.Event()))
    assert begun == [1, 2, 3, 0]


@pytest.mark.parametrize("jobs", [1, 3])
def test_jobs_change_neither_runs_nor_files(tmp_path, jobs):
    alike, tank = tow(PLAN, SlowTank()), SlowTank()
    runs = tow(PLAN, tank, tmp_path, jobs=jobs)
    assert sorted(tank.ran) == sorted(NAMES)
    assert tuple(run.name for run in runs) == NAMES
    for one, other in zip(runs, alike, strict=True):
        assert one.id == other.id
        np.testing.assert_array_equal(one.loads, other.loads)
    assert not list(tmp_path.rglob(FILE))


@pytest.mark.parametrize("jobs", [1, 3])
def test_failed_runs_are_named_at_the_end_and_only_they_are_tried_again(tmp_path, jobs):
    def refuse(name: str) -> None:
        if name in ("drift-2", "drift-5"):
            raise TankError(f"no water for {name}")

    with pytest.raises(TankError, match=r"2 of 8 runs failed(.|\n)*drift-2: no water(.|\n)*drift-5: no water"):
        tow(PLAN, SlowTank(refuse), tmp_path, jobs=jobs)
    found = status(PLAN, SlowTank(), tmp_path)
    assert set(found.to_do) == {"drift-2", "drift-5"}
    ids = dict(zip(NAMES, run_ids(PLAN, SlowTank()), strict=True))
    assert failure_of(tmp_path, ids["drift-2"]) == "no water for drift-2"
    assert failure_of(tmp_path, ids["drift-3"]) == ""
    tank = SlowTank()
    assert len(tow(PLAN, tank, tmp_path, jobs=jobs)) == len(NAMES)
    assert sorted(tank.ran) == ["drift-2", "drift-5"]
    assert failure_of(tmp_path, ids["drift-2"]) == ""


def test_a_full_disk_ends_the_campaign_and_the_runs_under_way(tmp_path, monkeypatch):
    write, left = towtank.artefact._write_bytes, [3]

    def full(part, content):
        if left[0] == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        left[0] -= 1
        write(part, content)

    monkeypatch.setattr(towtank.artefact, "_write_bytes", full)
    tank = SlowTank()
    with pytest.raises(ArtefactError, match="No space left"):
        tow(PLAN, tank, tmp_path, jobs=2)
    assert tank.stop.is_set()
    assert len(status(PLAN, SlowTank(), tmp_path).done) == 3
    assert len(tank.ran) < len(NAMES)
    assert not list(tmp_path.rglob("*.part"))
    monkeypatch.undo()
    again = SlowTank()
    assert len(tow(PLAN, again, tmp_path, jobs=2)) == len(NAMES)
    assert len(again.ran) == len(NAMES) - 3


def test_ctrl_c_ends_the_runs_under_way_and_keeps_the_others(tmp_path):
    def interrupt(note: str) -> None:
        raise KeyboardInterrupt

    tank = SlowTank()
    with pytest.raises(TankError, match="interrupted after 1 of 8"):
        tow(PLAN, tank, tmp_path, Spy(interrupt), jobs=2)
    assert tank.stop.is_set()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("tow")]
    assert len(status(PLAN, SlowTank(), tmp_path).done) == 1


PARENT = """
import sys, time
sys.path[:0] = {path!r}
from pathlib import Path
from test_tank_pool import PLAN, SlowTank
from towtank.tank.campaign import tow
out = Path(sys.argv[1])
def note(name):
    with (out / "ran.txt").open("a") as log:
        log.write(name + "\\n")
tow(PLAN, SlowTank(note, takes=float(sys.argv[2])), out, jobs=2)
"""


def _campaign(out: Path, takes: float) -> subprocess.Popen[str]:
    text = PARENT.format(path=[str(Path(__file__).parent)])
    return subprocess.Popen([sys.executable, "-c", text, str(out), str(takes)], stderr=subprocess.PIPE, text=True)


def _until(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    assert condition(), process.communicate(timeout=1.0)[1] if process.poll() is not None else "too slow"


def test_after_kill_9_at_most_the_runs_under_way_are_made_again(tmp_path):
    process = _campaign(tmp_path, 0.2)
    _until(lambda: len(list(tmp_path.glob("runs/*/run.nc"))) >= 3, process)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=PATIENCE)
    done = status(PLAN, SlowTank(), tmp_path).done
    assert 3 <= len(done) < len(NAMES)
    assert (tmp_path / "runs" / FILE).is_file()
    resumed = SlowTank()
    assert len(tow(PLAN, resumed, tmp_path, jobs=2)) == len(NAMES)
    first = (tmp_path / "ran.txt").read_text().split()
    assert set(resumed.ran) == set(NAMES) - set(done)
    assert len(first) + len(resumed.ran) <= len(NAMES) + 2
    assert not (tmp_path / "runs" / FILE).exists()


def test_a_second_campaign_in_the_folder_is_told_who_runs_there(tmp_path):
    process = _campaign(tmp_path, 30.0)
    try:
        _until((tmp_path / "ran.txt").exists, process)
        with pytest.raises(TankError, match=rf"process {process.pid} on {platform.node()}, since .*--out"):
            tow(PLAN, SlowTank(), tmp_path)
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE)
    assert len(tow(PLAN, SlowTank(), tmp_path)) == len(NAMES)


def test_the_lock_of_a_campaign_on_another_host_is_not_broken(tmp_path):
    (tmp_path / "runs").mkdir()
    path = tmp_path / "runs" / FILE
    path.write_text(json.dumps({"pid": 1, "host": "elsewhere", "since": "2020"}))
    with pytest.raises(TankError, match=r"process 1 on elsewhere.*remove"):
        tow(PLAN, SlowTank(), tmp_path)
    path.write_text("not whole")
    with alone(tmp_path), pytest.raises(TankError, match="runs in"), alone(tmp_path):
        pass
    assert not path.exists()


def test_one_run_alone_is_made_once_and_an_unknown_one_is_told(tmp_path):
    ids, tank = run_ids(PLAN, SlowTank()), SlowTank()
    assert tow_one(PLAN, ids[3], tank, tmp_path).name == "drift-3"
    assert tow_one(PLAN, ids[3], tank, tmp_path).id == ids[3]
    assert tank.ran == ["drift-3"]
    with pytest.raises(TankError, match="another version"):
        tow_one(PLAN, "drift-3-00000000", tank, tmp_path)
    assert "another version" in failure_of(tmp_path, "drift-3-00000000")


def test_time_left_follows_from_the_costs_and_not_from_the_number_of_runs(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    account = Account(Schedule(((0, 1),), (1.0, 9.0)))
    (run,) = tow(Plan(HOKIE, 1.0, PLAN.tests[:1]), SlowTank(takes=0.0))
    clock[0] = 20.0
    dear = type(run)(**{**vars(run), "provenance": {"health": {"cpu": 31.0}}})
    assert account.note(0, dear) == ", 31 s of CPU so far, about 3.0 min left"
    assert Account(in_turn(1)).note(0, run) == ""
    assert (duration(42.4), duration(7200.0)) == ("42 s", "2.0 h")


def test_straight_runs_are_chained_outwards_and_others_stand_alone():
    angles = (-0.2, -0.1, 0.0, 0.1, 0.2)
    tests = (
        *(CaptiveTest(f"d{i}", 1.0, Drift(1.0, angle)) for i, angle in enumerate(angles)),
        CaptiveTest("sway", 1.0, Sway(1.0, 0.1, 0.3)),
        CaptiveTest("turn", 1.0, Turn(1.0, 0.1)),
        CaptiveTest("fins", 1.0, Drift(1.0, 0.0), tuple(0.1 * HOKIE.mixing[:, 0])),
    )
    order = schedule(HOKIE, tests, MeshSettings(), Numerics())
    assert set(order.chains) == {(2, 3, 4), (1, 0), (5,), (6,), (7,)}
    # A time step costs three times an iteration, and there are more of them.
    assert order.costs[5] > order.costs[0]
