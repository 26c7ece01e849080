"""A preset of the OpenFOAM tank carries the error it was measured to have, and no claim beyond."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from openfoam_suboff import SLOPES, TARGET, preset_errors
from tables import read_table
from towtank.artefact import read_json
from towtank.craft.library import read_craft
from towtank.derive.derive import derive
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import Drift, Roll, Turn
from towtank.plan.standard import standard_plan
from towtank.report.of_trust import limits
from towtank.report.pictures import Sketchbook
from towtank.report.study import Study
from towtank.symbols import LOADS
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.tank.openfoam.errors import FILE, MEMBERS, SCHEMA, error_of, measured, with_model_form

HOKIE = read_craft("hokie")


def runs_of(*motions):
    tests = tuple(CaptiveTest(f"{m.kind}-{i}", 1.0, m) for i, m in enumerate(motions))
    return tow(Plan(HOKIE, 1.0, tests), FastTank(members=0))


def test_the_errors_of_the_package_are_those_of_the_table():
    assert read_json(FILE, SCHEMA)["presets"] == preset_errors(read_table(TARGET), read_table(SLOPES))


def test_the_ensemble_has_the_measured_error_and_no_mean():
    (run,) = runs_of(Drift(1.0, np.radians(10.0)))
    told = with_model_form(run, "draft")
    assert told.ensemble is not None
    assert told.ensemble.shape == (MEMBERS, *run.loads.shape)
    factors = told.ensemble[:, 0] / np.where(run.loads[0] == 0.0, 1.0, run.loads[0])
    for load in "XYN":
        size, known = error_of("draft", "drift", load, 10.0, fins=True)
        assert known
        assert factors[:, LOADS.index(load)].mean() == pytest.approx(1.0, abs=1e-12)
        assert factors[:, LOADS.index(load)].std() == pytest.approx(size, rel=1e-12)


def test_members_belong_together_within_a_family_and_not_across():
    small, large, turn = runs_of(Drift(1.0, 0.05), Drift(1.0, 0.3), Turn(1.0, 0.03))
    parts = [with_model_form(run, "draft").ensemble[:, 0, 1] / run.loads[0, 1] - 1.0 for run in (small, large, turn)]
    assert np.corrcoef(parts[0], parts[1])[0, 1] == pytest.approx(1.0)
    # 24 independent pairs: a correlation of 0.65 has a chance of 1 in 1000.
    assert abs(np.corrcoef(parts[0], parts[2])[0, 1]) < 0.65


def test_what_was_not_measured_takes_the_largest_error_and_says_so():
    (run,) = runs_of(Roll(1.0, 0.2, 0.3))
    told = with_model_form(run, "draft")
    assert any("K" in flag and "in roll not measured" in flag for flag in told.flags)
    worst = max(error.size for error in measured("draft"))
    assert error_of("draft", "roll", "K", 0.0) == (worst, False)


def test_a_set_up_that_was_never_compared_claims_nothing():
    (run,) = runs_of(Drift(1.0, 0.1))
    told = with_model_form(run, "no such preset")
    assert told.ensemble is None
    assert "never compared with an experiment" in told.flags[-1]


def test_the_error_reaches_the_derivatives_as_model_form():
    runs = [
        with_model_form(replace(run, level="rans"), "draft") for run in tow(standard_plan(HOKIE), FastTank(members=0))
    ]
    found = derive(runs)
    std = dict(zip(found.names, np.sqrt(np.diag(found.covariance_model)), strict=True))
    # The main part of the drift is at 6 to 20 deg, where Y was off by a fifth; terms of a fit share it unequally.
    assert 0.05 < std["Nuv"] / abs(found["Nuv"]) < 0.3
    assert std["Nur"] / abs(found["Nur"]) > 0.3


def test_the_report_prints_the_measured_errors_and_names_what_has_none():
    known, other = (replace(run, level="rans") for run in runs_of(Drift(1.0, 0.1), Drift(1.0, 0.2)))
    section = limits(Study(runs=(with_model_form(known, "draft"), with_model_form(other, ""))), Sketchbook())
    (table,) = [block for block in section.blocks if getattr(block, "title", "").endswith("preset draft")]
    assert len(table.rows) == len(measured("draft"))
    assert any("never compared" in getattr(block, "words", "") for block in section.blocks)


def test_a_craft_with_fins_takes_the_larger_error_of_the_two_hulls():
    for kind, load, angle in (("drift", "Y", 2.0), ("drift", "N", 2.0), ("turn", "N", 0.0), ("drift", "X", 12.0)):
        bare, fins = (error_of("draft", kind, load, angle, fins=has)[0] for has in (False, True))
        assert fins >= bare
    # The yaw moment of the hull with fins was off by 19 % at small drift, that of the bare one by 6 %.
    assert error_of("draft", "drift", "N", 2.0, fins=True)[0] > 2.0 * error_of("draft", "drift", "N", 2.0)[0]
