"""Shares of y+ and Courant number against what OpenFOAM says of the same fields. Needs OpenFOAM."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import QUICK, TINY
from towtank.craft.hydrostatics import hydrostatics
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway
from towtank.progress import Silent
from towtank.tank.files import read_run, write_run
from towtank.tank.openfoam import runner
from towtank.tank.openfoam.case import write_case
from towtank.tank.openfoam.dictionary import times
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, distribution, distribution_of, shares
from towtank.tank.openfoam.fields import read_field, read_mesh
from towtank.tank.openfoam.find import require
from towtank.tank.openfoam.health import y_plus
from towtank.tank.openfoam.measure import courant_numbers, kept
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors
from towtank.tank.openfoam.runner import solve
from towtank.tank.openfoam.tank import OpenFoamTank

CRAFT = tt.read_craft("suboff-bare")
U = 3.344
SWAY = CaptiveTest("sway", U, Sway(U, 0.2, 2.0), periods=1, samples=16)


@pytest.fixture(scope="module")
def sway(tmp_path_factory):
    """A solved sway, and a copy of it with the fields that are removed at its end."""
    folder = tmp_path_factory.mktemp("sway")
    keep = runner.keep

    def copied(case):
        shutil.copytree(case.folder, folder / "copy")
        keep(case)

    patch = pytest.MonkeyPatch()
    patch.setattr(runner, "keep", copied)
    case, _ = solve(write_case(folder / "case", CRAFT, SWAY, TINY, replace(QUICK, ramp=0.5)), require(), Silent())
    patch.undo()
    return case, folder / "copy"


def courant(case, folder):
    """Courant numbers and volumes of the last time in a folder."""
    mesh = read_mesh(folder)
    numbers = courant_numbers(mesh, read_field(times(folder)[-1] / "phi"), case.line.step)
    return numbers, cell_volumes(mesh, *face_vectors(mesh))[1]


def test_the_courant_number_is_that_of_the_log(sway):
    case, copy = sway
    numbers, volumes = courant(case, copy)
    log = (case.folder / "log.pimpleFoam").read_text()
    mean, most = (float(v) for v in re.findall(r"Courant Number mean: (\S+) max: (\S+)", log)[-1])
    # The log tells the one of the step before the last: at the end of a period the speed hardly changes in a step.
    assert numbers.max() == pytest.approx(most, rel=0.01)
    assert np.average(numbers, weights=volumes) == pytest.approx(mean, rel=0.01)
    assert distribution(kept(case.folder)).courant == shares(numbers, np.ones(len(numbers)), COURANT)


def test_y_plus_lies_between_the_least_and_largest_that_openfoam_says(sway):
    case, _ = sway
    least, most, _ = y_plus(case.folder)["hull"]
    found = np.array(distribution(kept(case.folder)).y_plus["hull"])
    assert found.sum() == pytest.approx(1.0)
    held = np.flatnonzero(found)
    assert (held[0], held[-1]) == (np.digitize(least, Y_PLUS), np.digitize(most, Y_PLUS))


def test_files_in_ascii_say_what_files_in_binary_say(sway):
    case, copy = sway
    before, volumes = courant(case, copy)
    control = copy / "system" / "controlDict"
    control.write_text(re.sub(r"writeFormat\s+binary", "writeFormat ascii", control.read_text()))
    program = require().program("foamFormatConvert")
    command = [program, "-case", str(copy), "-constant", "-latestTime"]
    subprocess.run(command, env=require().surroundings(), check=True, capture_output=True)
    assert "ascii" in (copy / "constant" / "polyMesh" / "faces").read_text(errors="replace")[:1200]
    after, ascii_volumes = courant(case, copy)
    assert after == pytest.approx(before, rel=1e-4)  # ten digits, of numbers whose differences make the volume
    assert ascii_volumes == pytest.approx(volumes, rel=1e-4)
    wall = read_field(times(copy)[-1] / "yPlus").on("hull", read_mesh(copy).patch("hull").count)
    assert wall.min() == pytest.approx(y_plus(case.folder)["hull"][0], rel=1e-6)


def test_a_run_carries_its_distributions_to_its_file_and_back(tmp_path):
    tank = OpenFoamTank(mesh=TINY, numerics=QUICK, where=tmp_path)
    run = tank.run(CRAFT, CaptiveTest("drift", U, Drift(U, 0.1)), Silent())
    found = distribution_of(run)
    # A half domain: half the wetted area, on flat faces, 8 of them around.
    assert 2.0 * found.area["hull"] == pytest.approx(hydrostatics(CRAFT).hull_wetted_area, rel=0.02)
    assert sum(found.y_plus["hull"]) == pytest.approx(1.0)
    assert found.courant == ()
    assert found.missing == ()
    assert distribution_of(read_run(write_run(run, tmp_path / "run.nc"))) == found


def test_a_case_that_was_solved_before_distributions_were_kept_is_still_read(tmp_path):
    tank = OpenFoamTank(mesh=TINY, numerics=QUICK, where=tmp_path)
    test = CaptiveTest("drift", U, Drift(U, 0.1))
    run = tank.run(CRAFT, test, Silent())
    for path in tmp_path.glob("runs/*/case/distribution.json"):
        path.unlink()
    again = tank.run(CRAFT, test, Silent())
    assert again.provenance["health"]["distribution"] == {}
    assert distribution_of(again) is None
    assert np.array_equal(again.loads, run.loads)
