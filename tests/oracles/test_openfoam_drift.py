"""Steady RANS of the SUBOFF hull on a coarse mesh, against a finer one of its family. Needs OpenFOAM."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import COARSE, Held
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift
from towtank.progress import Silent
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.tank import OpenFoamTank

CRAFT = tt.read_craft("suboff-bare")
U, BETA = 3.344, math.radians(10.0)
STORED = json.loads((Path(__file__).parents[1] / "data" / "openfoam" / "drift.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def drift():
    tank = OpenFoamTank(mesh=COARSE, numerics=Numerics())
    return tank.run(CRAFT, CaptiveTest("drift", U, Drift(U, BETA)), Silent())


def _primes(load):
    pressure = CRAFT.water.dynamic_pressure(U)
    return load / (pressure * CRAFT.length ** np.array([2.0, 2.0, 2.0, 3.0, 3.0, 3.0]))


def test_a_coarse_drift_point_is_near_that_of_a_finer_mesh(drift):
    found = _primes(drift.loads[0])
    # The moment is of potential flow and hardly depends on the mesh. Drag and side force come from the boundary layer
    # at the stern, which 12 cells around and 22 out do not resolve: an eighth and a fifth are what they cost.
    for at, tolerance in ((0, 0.16), (1, 0.22), (5, 0.03)):
        assert found[at] == pytest.approx(STORED["primes"]["XYZKMN"[at]], rel=tolerance)
    assert found[[2, 3, 4]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_a_drift_point_ends_by_its_flat_load_in_good_health(drift):
    health = drift.provenance["health"]
    assert health["ended"] == "flat"
    assert health["change"] < 0.002
    assert health["steps"] < 250
    # A set-up of its own was never compared with an experiment, and says so; the solution itself has nothing to say.
    assert [flag for flag in drift.flags if "model form" not in flag] == []
    least, largest, mean = health["y_plus"]["hull"]
    assert least < mean < largest
    # The mesher aims at a mean y+ by a flat-plate law; on the hull it comes within a fifth.
    assert mean == pytest.approx(COARSE.y_plus, rel=0.2)


def test_a_reynolds_stress_model_carries_the_moment_of_potential_flow(drift):
    stress = OpenFoamTank(mesh=COARSE, numerics=Numerics(turbulence="SSG"))
    run = stress.run(CRAFT, CaptiveTest("drift", U, Drift(U, BETA)), Silent())
    assert run.provenance["health"]["ended"] == "flat"
    assert run.loads[0, 5] == pytest.approx(drift.loads[0, 5], rel=0.1)


def test_a_drift_angle_held_by_moving_the_mesh_is_steady_drift(drift):
    """The mesh turns by the angle and moves aside in a stream; loads in space, turned back, are those of drift."""
    test = CaptiveTest("held", U, Held(U, BETA, 0.3, 2.0), periods=1, samples=16)
    tank = OpenFoamTank(mesh=COARSE, numerics=Numerics(steps=48, ramp=1.0))
    moved = tank.run(CRAFT, test, Silent())
    assert moved.provenance["case"]["formulation"] == "moving"
    found, steady = _primes(moved.loads[-1]), _primes(drift.loads[0])
    # A stern wake of 12 cells and steps of a tenth of a length leave 2 %; a load not turned, or about the wrong point,
    # is off by 17 % in X and 7 % in N.
    assert found[[0, 1, 5]] == pytest.approx(steady[[0, 1, 5]], rel=0.025)
