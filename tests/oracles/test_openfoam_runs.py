"""Laws that hold on any mesh, on real solvers and a mesh of two thousand cells. Needs OpenFOAM."""

from __future__ import annotations

import math
import re
import threading
from dataclasses import replace

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import TINY
from towtank.errors import TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Incidence, Sway, Turn
from towtank.progress import Silent
from towtank.tank.openfoam.case import read_case, write_case
from towtank.tank.openfoam.dictionary import times
from towtank.tank.openfoam.find import require
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.read import case_loads
from towtank.tank.openfoam.runner import solve
from towtank.tank.openfoam.tank import OpenFoamTank

CRAFT = tt.read_craft("suboff-bare")
U, BETA, L = 3.344, math.radians(8.0), CRAFT.length
DRIFT = CaptiveTest("drift", U, Drift(U, BETA))
TANK = OpenFoamTank(mesh=TINY, numerics=Numerics(flat=1e-4))


@pytest.fixture(scope="module")
def drift():
    return TANK.run(CRAFT, DRIFT, Silent())


def _close(found, wanted, share):
    scale = np.repeat([np.abs(wanted[:3]).max(), np.abs(wanted[3:]).max()], 3)
    return np.abs(found - wanted) / scale < share


def test_incidence_of_a_body_of_revolution_is_drift_seen_from_the_side(drift):
    load = TANK.run(CRAFT, CaptiveTest("up", U, Incidence(U, BETA)), Silent()).loads[0]
    X, Y, _, _, _, N = drift.loads[0]
    # Drift moves the bow to starboard, v < 0; incidence w > 0. So Z answers as -Y and M as N. Both stop at 0.01 %.
    assert _close(load, np.array([X, 0.0, -Y, 0.0, N, 0.0]), 1e-3).all()


def test_half_the_water_carries_the_loads_of_the_whole(drift):
    whole = replace(TANK, mesh=replace(TINY, half=False)).run(CRAFT, DRIFT, Silent())
    assert whole.provenance["mesh"]["cells"] == 2 * drift.provenance["mesh"]["cells"]
    # The same cells, with a mirror in their place: iterations differ, and both stop at 0.01 %.
    assert _close(whole.loads[0], drift.loads[0], 2e-3).all()


def test_a_straight_run_solved_in_time_settles_at_the_load_of_the_steady_one(drift):
    in_time = replace(TANK, numerics=Numerics(travel=4.0, steps=50)).run(CRAFT, DRIFT, Silent())
    assert in_time.provenance["case"]["formulation"] == "unsteady"
    # The flow is steady at 8 deg. What differs is how SIMPLE and PIMPLE interpolate velocities to the faces, which on
    # two thousand cells is 4 % of the force, on ten thousand 1 %.
    assert _close(in_time.loads[0], drift.loads[0], 0.06).all()
    assert in_time.loads[0, 5] == pytest.approx(drift.loads[0, 5], rel=0.02)
    assert max(in_time.provenance["health"]["scatter"]) < 0.01


@pytest.mark.parametrize("model", ["realizableKE", "RNGkEpsilon", "ShihQuadraticKE", "SpalartAllmaras"])
def test_other_models_carry_the_load_of_potential_flow(drift, model):
    run = replace(TANK, turbulence=model, numerics=Numerics(iterations=150)).run(CRAFT, DRIFT, Silent())
    # The yaw moment is mostly that of potential flow, which no model changes; drag is wall friction on one wall law.
    assert run.loads[0, 5] == pytest.approx(drift.loads[0, 5], rel=0.12)
    assert run.loads[0, 0] == pytest.approx(drift.loads[0, 0], rel=0.3)


def test_two_cores_give_the_loads_of_one(drift):
    two = replace(TANK, cores=2).run(CRAFT, DRIFT, Silent())
    assert _close(two.loads[0], drift.loads[0], 2e-3).all()


def test_a_slow_turn_is_nearly_the_straight_path(drift):
    slow = TANK.run(CRAFT, CaptiveTest("turn", U, Turn(U, 1e-3 * U / L, BETA)), Silent())
    assert slow.provenance["case"]["formulation"] == "arm"
    # Another frame and another far field, the same equations: what is left is the turn itself, a thousandth of a radian
    # in a length. A symmetry plane that turned with the body took 12 % of X and 6 % of N here.
    assert _close(slow.loads[0], drift.loads[0], 5e-3).all()


def test_a_stopped_solver_goes_on_to_the_same_load(tmp_path, drift, monkeypatch):
    # Stopped at the first time on file, long before the residuals end it at step 117.
    monkeypatch.setattr("towtank.tank.openfoam.case.WRITE_EVERY", 20)
    stop = threading.Event()

    class Stops(Silent):
        def step(self, task, note=""):
            if int(task == "simpleFoam drift") and len(times(folder)) > 0:
                stop.set()

    folder = tmp_path / "case"
    case = write_case(folder, CRAFT, DRIFT, TINY, replace(TANK.solution, flat=1e-5, iterations=400))
    with pytest.raises(TankError, match="stopped"):
        solve(case, require(), Stops(), stop=stop)
    assert all(int(path.name) % 20 == 0 for path in times(folder))
    assert not (folder / "outcome.json").exists()
    case, outcome = solve(read_case(folder), require(), Silent())
    assert outcome.resumed
    assert _close(case_loads(case)[-1], drift.loads[0], 2e-3).all()


def test_a_motion_goes_on_from_a_time_on_file_as_if_it_had_not_stopped(tmp_path):
    test = CaptiveTest("sway", U, Sway(U, 0.2, 2.0), periods=1, samples=16)
    numerics = Numerics(steps=32, ramp=0.5)
    straight, _ = solve(write_case(tmp_path / "one", CRAFT, test, TINY, numerics), require(), Silent())
    stop = threading.Event()
    folder = tmp_path / "two"

    class Stops(Silent):
        def step(self, task, note=""):
            if len(times(folder)) > 1:
                stop.set()

    case = write_case(folder, CRAFT, test, TINY, numerics)
    with pytest.raises(TankError, match="stopped"):
        solve(case, require(), Stops(), stop=stop)
    case, outcome = solve(read_case(folder), require(), Silent())
    assert outcome.resumed
    once, twice = case_loads(straight), case_loads(case)
    # Fields are written with all their digits and two old times; what differs is the first solution of pressure.
    assert np.abs(once - twice)[:, 1].max() < 0.02 * np.abs(once[:, 1]).max()


def test_a_solution_that_blows_up_is_recognised(tmp_path):
    """A stream whose square is beyond any number."""
    case = write_case(tmp_path / "case", CRAFT, DRIFT, TINY, TANK.solution)
    path = case.folder / "0" / "U"
    path.write_text(re.sub(r"uniform \(-[^)]*\)", "uniform (-1e200 0 0)", path.read_text("utf-8")))
    with pytest.raises(TankError, match="diverged"):
        solve(case, require(), Silent())
