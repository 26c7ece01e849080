"""Planar motion of the SUBOFF hull in RANS on a coarse mesh. Needs OpenFOAM."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import COARSE
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Sway
from towtank.progress import Silent
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.tank import OpenFoamTank

CRAFT = tt.read_craft("suboff-bare")
U, W = 3.344, 2.0
STORED = json.loads((Path(__file__).parents[1] / "data" / "openfoam" / "sway.json").read_text("utf-8"))


def test_coarse_sway_has_the_inertia_and_the_moment_of_a_finer_mesh():
    motion = Sway(U, 0.14 * U / W, W)
    tank = OpenFoamTank(mesh=COARSE, numerics=Numerics(steps=80, ramp=0.5))
    run = tank.run(CRAFT, CaptiveTest("sway", U, motion, periods=2, samples=40), Silent())
    at = run.settled
    rates = np.column_stack([run.history.nu[at, 1] / U, run.history.nudot[at, 1] * CRAFT.length / U**2])
    pressure = CRAFT.water.dynamic_pressure(U)
    force = run.loads[at, 1] / (pressure * CRAFT.length**2)
    moment = run.loads[at, 5] / (pressure * CRAFT.length**3)
    yv, yvdot = np.linalg.lstsq(rates, force, rcond=None)[0]
    nv = np.linalg.lstsq(rates, moment, rcond=None)[0][0]
    # Added mass and the Munk moment are of potential flow: within 3 % of three times as many cells. The damping is of
    # the wake, which this mesh makes too strong by a sixth.
    assert yvdot == pytest.approx(STORED["primes"]["Yvdot"], rel=0.03)
    assert nv == pytest.approx(STORED["primes"]["Nv"], rel=0.03)
    assert yv == pytest.approx(STORED["primes"]["Yv"], rel=0.25)
    # Mirror symmetry: the axial force has no first harmonic.
    axial = np.linalg.lstsq(rates, run.loads[at, 0] / (pressure * CRAFT.length**2), rcond=None)[0]
    assert np.abs(axial).max() < 0.01 * abs(yv)
    assert run.provenance["health"]["residual"] < 0.02
