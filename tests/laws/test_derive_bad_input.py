"""Bad runs are refused with what is wrong, where, and what to do."""

from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import SPEED, campaign, fourfold_coefficients, loaded, make

from towtank.derive.convert import about_point
from towtank.derive.derive import derive
from towtank.errors import DeriveError
from towtank.plan.motion import Drift, Sway


@pytest.fixture(scope="module")
def runs():
    kinds = ("drift", "sway")
    return loaded([run for run in campaign() if run.kind in kinds], fourfold_coefficients())


def test_no_runs():
    with pytest.raises(DeriveError, match="no runs were given"):
        derive([])


def test_loads_that_are_not_numbers(runs):
    loads = runs[-1].loads.copy()
    loads[5, 1] = np.nan
    with pytest.raises(DeriveError, match=rf"{runs[-1].name} has loads that are not finite \(Y, sample 5\)"):
        derive([*runs[:-1], replace(runs[-1], loads=loads)])


def test_mixed_levels_must_be_asked_for(runs):
    mixed = [replace(runs[0], level="experiment"), *runs[1:]]
    with pytest.raises(DeriveError, match="mix_levels=True"):
        derive(mixed)
    assert derive(mixed, mix_levels=True).level == "experiment + known coefficients"


@pytest.mark.parametrize(("field", "value"), [("craft", "other"), ("length", 9.0), ("density", 1025.0)])
def test_runs_that_do_not_belong_together(runs, field, value):
    with pytest.raises(DeriveError, match=field):
        derive([*runs[:-1], replace(runs[-1], **{field: value})])


def test_same_run_twice(runs):
    with pytest.raises(DeriveError, match="twice"):
        derive([*runs, runs[0]])


def test_only_runs_beyond_the_range():
    with pytest.raises(DeriveError, match="none of the 1 runs can be fitted"):
        derive([make("wide", Drift(SPEED, np.radians(30.0)))])


def test_ensembles_of_different_size(runs):
    a = replace(runs[0], ensemble=np.stack([runs[0].loads] * 3))
    b = replace(runs[1], ensemble=np.stack([runs[1].loads] * 4))
    with pytest.raises(DeriveError, match="different sizes"):
        derive([a, b, *runs[2:]])


def test_loads_of_the_wrong_shape():
    run = make("sway", Sway(SPEED, 0.1, 1.0))
    with pytest.raises(DeriveError, match="shape"):
        derive([replace(run, loads=run.loads[:-3])])


@pytest.mark.parametrize("share", [-0.1, 1.5])
def test_weight_outside_its_range(runs, share):
    with pytest.raises(DeriveError, match="between 0"):
        derive(runs, weight_steady=share)


def test_reference_length_must_be_positive(runs):
    with pytest.raises(DeriveError, match="not positive"):
        about_point(derive(runs), length=-1.0)
