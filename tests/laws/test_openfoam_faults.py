"""What goes wrong around a solver: it is missing, fails, is killed or stopped. A message, and a state to go on from."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import QUICK, TINY, stand_in
from towtank.errors import TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway
from towtank.progress import Silent
from towtank.tank import identity
from towtank.tank.openfoam import find as finding
from towtank.tank.openfoam.case import read_case, write_case
from towtank.tank.openfoam.dictionary import entry, times
from towtank.tank.openfoam.find import Installation, find, missing, require, unfit
from towtank.tank.openfoam.runner import measured, solve
from towtank.tank.openfoam.tank import OpenFoamTank

BARE = tt.read_craft("suboff-bare")
U = 3.0
PATIENCE = 60.0
"""Seconds that a loaded machine may take to start a solver."""
DRIFT = CaptiveTest("drift", U, Drift(U, 0.1))
SWAY = CaptiveTest("sway", U, Sway(U, 0.1, 2.0), periods=2, samples=16)


@pytest.fixture
def drift(tmp_path):
    return write_case(tmp_path / "case", BARE, DRIFT, TINY, QUICK)


@pytest.fixture
def sway(tmp_path):
    return write_case(tmp_path / "case", BARE, SWAY, TINY, QUICK)


class Told:
    """A spy of progress."""

    def __init__(self):
        self.steps, self.begun, self.over = 0, [], []

    def start(self, task, total):
        self.begun.append((task, total))

    def step(self, task, note=""):
        self.steps += 1

    def done(self, task):
        self.over.append(task)


def _tree(root, version):
    """An installation as openfoam.com and openfoam.org lay it out."""
    project = root / version
    binaries = project / "platforms" / "linux64GccDPInt32Opt" / "bin"
    binaries.mkdir(parents=True)
    (project / "platforms" / "linux64GccDPInt32Opt" / "lib" / "sys-openmpi").mkdir(parents=True)
    (project / "etc").mkdir()
    (project / "etc" / "controlDict").write_text("")
    for name in finding.PROGRAMS:
        (binaries / name).write_text("#!/bin/sh\n")
        (binaries / name).chmod(0o755)
    return project


@pytest.mark.parametrize(
    ("folder", "version", "kind"),
    [("openfoam2312", "2312", "esi"), ("OpenFOAM-v2112", "2112", "esi"), ("openfoam10", "10", "foundation")],
)
def test_an_installation_is_found_without_its_bashrc(tmp_path, folder, version, kind):
    project = _tree(tmp_path, folder)
    found = find({"WM_PROJECT_DIR": str(project)})
    assert found is not None
    assert (found.version, found.kind) == (version, kind)
    assert found.environment["WM_PROJECT_DIR"] == str(project)
    assert "sys-openmpi" in found.environment["LD_LIBRARY_PATH"]
    assert missing(found) == ()
    assert bool(unfit(found)) == (kind == "foundation")


def test_the_newest_of_several_installations_is_taken(tmp_path, monkeypatch):
    for folder in ("openfoam2206", "openfoam2312", "openfoam2112"):
        _tree(tmp_path, folder)
    monkeypatch.setattr(finding, "ROOTS", (str(tmp_path),))
    monkeypatch.setattr(finding, "DEBIAN", tmp_path / "none")
    found = find({})
    assert found is not None
    assert found.version == "2312"


def test_an_absent_openfoam_is_told_with_its_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr(finding, "ROOTS", ())
    monkeypatch.setattr(finding, "DEBIAN", tmp_path)
    monkeypatch.delenv("WM_PROJECT_DIR", raising=False)
    with pytest.raises(TankError, match=r"not installed.*make openfoam"):
        OpenFoamTank().run(BARE, DRIFT, Silent())


@pytest.mark.parametrize("version", ["1806", "v1806"])
def test_a_version_the_cases_are_not_written_for_is_refused(tmp_path, monkeypatch, version):
    old = Installation(tmp_path, version, "esi", None, {})
    monkeypatch.setattr(finding, "find", lambda: old)
    monkeypatch.setattr(finding, "missing", lambda _: ())
    with pytest.raises(TankError, match=r"older than v1912.*make openfoam"):
        require()
    monkeypatch.setattr(finding, "missing", lambda _: ("pimpleFoam",))
    with pytest.raises(TankError, match="lacks pimpleFoam"):
        require()


WAITS = """
def unwatched(number, one=one):
    now, end = one(number), time.monotonic() + 60
    while number >= 150 and "writeNow" not in control.read_text() and time.monotonic() < end:
        time.sleep(0.01)
    return now
one = unwatched
"""
"""Iterations cost the stand-in nothing, so it waits for the one who watches it, as a loaded machine may be slow."""


def test_a_steady_case_ends_when_its_load_is_flat_and_is_not_solved_twice(drift, tmp_path):
    told = Told()
    case, outcome = solve(drift, stand_in(tmp_path, WAITS), told)
    # The load has 0.8^n of its swing left: the halves of 50 iterations agree to 0.2 % from about the 80th on.
    assert outcome.ended == "flat"
    assert outcome.steps < case.numerics.iterations
    assert told.steps == outcome.steps
    assert told.begun == [("simpleFoam drift", case.numerics.iterations)]
    assert told.over == ["simpleFoam drift"]
    assert len(times(case.folder)) == 1
    again = Told()
    assert solve(read_case(case.folder), stand_in(tmp_path), again)[1] == outcome
    assert again.steps == 0


def test_a_moving_case_runs_to_its_last_step(sway, tmp_path):
    case, outcome = solve(sway, stand_in(tmp_path), Silent())
    assert outcome.ended == "last step"
    assert outcome.steps == case.line.steps


def test_a_killed_solver_leaves_a_case_that_goes_on(drift, tmp_path):
    dies = "import threading\nthreading.Timer(0.0, lambda: None)\nif start == 0: end = 25.0\n"
    kill = dies + "import atexit\nif start == 0: atexit.register(lambda: os.kill(os.getpid(), signal.SIGKILL))\n"
    with pytest.raises(TankError, match=r"killed.*go on"):
        solve(drift, stand_in(tmp_path, kill), Silent())
    assert [path.name for path in times(drift.folder)] == ["10", "20", "25"]
    _, outcome = solve(read_case(drift.folder), stand_in(tmp_path), Silent())
    assert outcome.resumed
    loads = measured(drift)
    assert np.array_equal(loads[:, 0], np.arange(1, len(loads) + 1))


def test_a_damaged_time_is_dropped_and_the_one_before_is_gone_on_from(drift, tmp_path):
    for name in ("10", "20"):
        (drift.folder / name).mkdir()
        (drift.folder / name / "p").write_text("cut off" if name == "20" else "whole")
    checks = (
        "for p in case.iterdir():\n"
        "    if p.name[:1].isdigit() and (p / 'p').read_text() == 'cut off':\n"
        "        print('--> FOAM FATAL IO ERROR:\\nkeyword internalField is undefined', flush=True); sys.exit(1)\n"
    )
    _, outcome = solve(drift, stand_in(tmp_path, checks), Silent())
    assert outcome.retries == ("time 20 on file could not be read and was dropped",)


def test_a_diverged_steady_case_is_told_as_one(drift, tmp_path):
    with pytest.raises(TankError, match=r"code 136.*diverged"):
        solve(drift, stand_in(tmp_path, "os.kill(os.getpid(), signal.SIGFPE)"), Silent())
    assert not (drift.folder / "outcome.json").exists()


def test_a_diverged_steady_case_is_tried_with_one_more_pressure_solution(drift, tmp_path):
    """The stand-in diverges unless the correctors are there."""
    kept = "if 'Correctors 1;' not in (case / 'system/fvSolution').read_text():\n    os.kill(os.getpid(), 8)\n"
    case, outcome = solve(drift, stand_in(tmp_path, kept), Silent())
    assert outcome.retries == ("diverged; run with one further solution of each pressure equation",)
    assert case.numerics.non_orthogonal == 1
    assert read_case(case.folder) == case


def test_a_diverged_motion_is_tried_with_half_the_step_and_then_with_euler(sway, tmp_path):
    """The stand-in diverges unless the scheme is Euler."""
    gentle = "if 'timeScheme      Euler' not in (case / 'system/fvSchemes').read_text():\n    os.kill(os.getpid(), 8)\n"
    case, outcome = solve(sway, stand_in(tmp_path, gentle), Silent())
    assert len(outcome.retries) == 2
    assert case.numerics.scheme == "Euler"
    assert case.line.per_period == 4 * sway.line.per_period
    assert float(entry(case.folder / "system" / "controlDict", "deltaT")) == pytest.approx(sway.line.step / 4)
    assert case.line.plan_time(case.line.samples()) == pytest.approx(sway.line.plan_time(sway.line.samples()))
    rows = (case.folder / "constant" / "motion.dat").read_text("utf-8").splitlines()
    assert int(rows[0]) > 4 * sway.line.steps
    assert read_case(case.folder) == case


def test_a_killed_motion_keeps_its_step(sway, tmp_path):
    with pytest.raises(TankError, match="killed"):
        solve(sway, stand_in(tmp_path, "os.kill(os.getpid(), signal.SIGKILL)"), Silent())
    assert read_case(sway.folder) == sway


@pytest.mark.parametrize(
    "said",
    ["print('Courant Number mean: 1e3 max: 1e60', flush=True); one(1)", "swollen = 1e30"],
    ids=["Courant", "load"],
)
def test_numbers_beyond_any_solution_end_a_solver_that_does_not_end_itself(sway, tmp_path, said):
    endless = f"{said}\nend = 1e9\nsignal.signal(signal.SIGPIPE, signal.SIG_DFL)\n"
    with pytest.raises(TankError, match="beyond any solution"):
        solve(sway, stand_in(tmp_path, endless), Silent())


def test_a_motion_that_diverges_at_every_try_says_so(sway, tmp_path):
    with pytest.raises(TankError, match=r"diverged.*No gentler setting"):
        solve(sway, stand_in(tmp_path, "os.kill(os.getpid(), 8)"), Silent())


def test_an_event_stops_the_solver_and_leaves_no_process(drift, tmp_path):
    stop = threading.Event()
    slow = "(case / 'part').write_text(str(os.getpid()))\n(case / 'part').rename(case / 'pid')\ntime.sleep(600)"

    def stopped() -> float:
        """Wait until the solver runs; the time at which it was stopped."""
        end = time.monotonic() + PATIENCE
        while not (drift.folder / "pid").exists() and time.monotonic() < end:
            time.sleep(0.02)
        stop.set()
        return time.monotonic()

    with ThreadPoolExecutor(1) as aside:
        begun = aside.submit(stopped)
        with pytest.raises(TankError, match="stopped"):
            solve(drift, stand_in(tmp_path, slow), Silent(), stop=stop)
        assert time.monotonic() - begun.result() < 20.0
    with pytest.raises(ProcessLookupError):
        os.kill(int((drift.folder / "pid").read_text()), 0)


def test_an_interrupt_leaves_no_process(drift, tmp_path):
    class Impatient(Told):
        def step(self, task, note=""):
            raise KeyboardInterrupt

    hangs = "(case / 'pid').write_text(str(os.getpid()))\nsignal.signal(signal.SIGPIPE, signal.SIG_IGN)"
    with pytest.raises(KeyboardInterrupt):
        solve(drift, stand_in(tmp_path, hangs), Impatient())
    with pytest.raises(ProcessLookupError):
        os.kill(int((drift.folder / "pid").read_text()), 0)


def test_two_processes_do_not_run_one_case(drift, tmp_path):
    hold = (
        "import fcntl, sys, time\n"
        f"f = open({str(drift.folder / '.lock')!r}, 'a')\n"
        "fcntl.flock(f, fcntl.LOCK_EX)\nprint('held', flush=True)\ntime.sleep(60)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", hold], stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(TankError, match="another process"):
            solve(drift, stand_in(tmp_path), Silent())
    finally:
        other.send_signal(signal.SIGKILL)
        other.wait()
        other.stdout.close()
    assert solve(drift, stand_in(tmp_path), Silent())[1].ended == "flat"


def test_a_full_disk_under_the_solver_is_told_and_nothing_is_lost(drift, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("towtank.tank.openfoam.runner._follow", full)
        with pytest.raises(TankError, match=r"No space left.*goes on"):
            solve(drift, stand_in(tmp_path), Silent())
    assert solve(read_case(drift.folder), stand_in(tmp_path), Silent())[1].ended == "flat"


def test_what_a_solver_says_of_its_failure_is_passed_on(drift, tmp_path):
    says = "print('--> FOAM FATAL ERROR:\\nUnknown turbulence model kGuess', flush=True); sys.exit(1)"
    with pytest.raises(TankError, match="Unknown turbulence model kGuess"):
        solve(drift, stand_in(tmp_path, says), Silent())


def test_a_case_of_another_version_is_written_again(tmp_path, monkeypatch):
    monkeypatch.setattr("towtank.tank.openfoam.tank.require", lambda: stand_in(tmp_path))
    tank = OpenFoamTank(mesh=TINY, numerics=QUICK, where=tmp_path / "study")
    run = tank.run(BARE, DRIFT, Silent())
    folder = tmp_path / "study" / "runs" / run.id / "case"
    (folder / "case.json").write_text('{"schema": "towtank/case/0"}')
    # The step at which a flat load is noticed depends on the clock; within the limit of flatness it is the same.
    assert tank.run(BARE, DRIFT, Silent()).loads == pytest.approx(run.loads, rel=2e-3)
    assert read_case(folder).test == DRIFT


def test_a_campaign_keeps_its_cases_below_the_study_and_goes_on_from_them(tmp_path, monkeypatch):
    from towtank.plan.kinds import Plan

    monkeypatch.setattr("towtank.tank.openfoam.tank.require", lambda: stand_in(tmp_path))
    plan = Plan(BARE, U, (DRIFT, SWAY))
    runs = tt.tow(plan, OpenFoamTank(mesh=TINY, numerics=QUICK), tmp_path / "study")
    assert [run.level for run in runs] == ["rans", "rans"]
    for run in runs:
        assert (tmp_path / "study" / "runs" / run.id / "case" / "outcome.json").is_file()
        assert run.provenance["mesh"]["dimensions"] == 3
        assert run.provenance["health"]["steps"] > 0
    steady, swaying = runs
    # The stand-in's load on half the water, about the origin: (-100, 100, 0) N and (-20, 20, 0) N m.
    assert steady.loads[0] == pytest.approx([-200.0, 200.0, 0.0, 0.0, 0.0, 0.0], rel=1e-3)
    assert len(steady.loads) == 2
    assert len(swaying.loads) == 2 * 16 + 1


def test_cores_and_folders_do_not_change_the_identity_of_a_run(tmp_path, monkeypatch):
    monkeypatch.setattr("towtank.tank.openfoam.tank.require", lambda: stand_in(tmp_path))
    run_id = identity.run_id

    base = OpenFoamTank()
    assert run_id(BARE, DRIFT, base) == run_id(BARE, DRIFT, OpenFoamTank(cores=2, where=tmp_path))
    others = (OpenFoamTank(refinement=1.5), OpenFoamTank(turbulence="kOmegaSST"), OpenFoamTank(quality="standard"))
    assert len({run_id(BARE, DRIFT, tank) for tank in (base, *others)}) == 4
