"""Reverse spiral against the algebraic curve of steady turns, and against the direct spiral where that has one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import synthetic_craft as synthetic
from towtank.errors import InputError
from towtank.trials.reverse import reverse_spiral
from towtank.trials.spiral import spiral
from towtank.trials.steady import steady_turns

LOOP = ("loop_width", "loop_height", "slope")


@pytest.fixture(scope="module")
def unstable():
    return reverse_spiral(synthetic.model(synthetic.SUBOFF))


@pytest.fixture(scope="module")
def stable():
    return reverse_spiral(synthetic.model(synthetic.STABLE))


def test_a_stable_craft_has_no_loop_and_the_slope_of_its_curve(stable):
    assert stable.indices["loop_width"][0] == 0.0
    assert stable.indices["loop_height"][0] == 0.0
    # Points left and right of zero are 0.05 deg/s apart, each not quite steady: 5 %.
    assert stable.indices["slope"][0] == pytest.approx(stable.indices["slope_algebraic"][0], rel=0.05)


def test_an_unstable_craft_has_the_loop_of_the_algebraic_curve(unstable):
    # Measured: 1.3 % of width, 6 % of height and 8 % of slope, because speed and rate still change in a step.
    for name, tolerance in zip(LOOP, (0.03, 0.1, 0.1), strict=True):
        assert unstable.indices[name][0] == pytest.approx(unstable.indices[f"{name}_algebraic"][0], rel=tolerance), name
    assert unstable.indices["loop_width"][0] > 10.0


def test_the_unstable_branch_lies_on_the_algebraic_curve(unstable):
    measured = unstable.provenance["curves"]["reverse spiral"]
    turns = steady_turns(synthetic.model(synthetic.SUBOFF), 1.0)
    ahead = np.array(measured["speed"]) * np.cos(np.radians(measured["drift"]))
    curvature = np.radians(measured["rate"]) / ahead
    wanted = np.degrees(CubicSpline(turns.curvature, turns.rudder)(curvature))
    inside = np.abs(measured["rate"]) < 1.4
    assert inside.sum() >= 12
    # The rudder that turns the craft into its next rate adds to that which holds it.
    assert np.array(measured["rudder"])[inside] == pytest.approx(wanted[inside], abs=0.06 * np.ptp(wanted[inside]))
    # A steady turn to port takes rudder to starboard there: the reverse of what a stable craft does.
    small = np.abs(measured["rate"]) < 0.5
    assert np.polyfit(np.array(measured["rudder"])[small], np.array(measured["rate"])[small], 1)[0] > 0.0


def test_direct_and_reverse_spiral_have_their_loop_under_the_same_names(unstable):
    direct = spiral(synthetic.model(synthetic.SUBOFF), "15 deg")
    for name in LOOP:
        assert direct.indices[name][1] == unstable.indices[name][1]
        assert direct.indices[f"{name}_algebraic"] == unstable.indices[f"{name}_algebraic"]
    # The direct one jumps at the first step beyond a fold, so its loop is wider.
    assert direct.indices["loop_width"][0] > unstable.indices["loop_width"][0]
    assert direct.indices["loop_height"][0] == pytest.approx(unstable.indices["loop_height"][0], rel=0.1)


@pytest.mark.parametrize("nuv", [-0.0070, -0.0080])
def test_a_loop_narrower_than_the_steps_of_a_direct_spiral_is_found(nuv):
    craft = synthetic.model({**synthetic.STABLE, "Nuv": nuv, "Yuv": -0.012})
    found = reverse_spiral(craft).indices
    assert 0.05 < found["loop_width_algebraic"][0] < 6.0
    # The rudder that turns the craft into its next rate, up to 0.05 deg on each side, is beside that of a narrow loop.
    assert found["loop_width"][0] == pytest.approx(found["loop_width_algebraic"][0], rel=0.1, abs=0.1)
    # The direct spiral has steps of 1.5 deg at its middle.
    direct = spiral(craft, "15 deg").indices["loop_width"][0]
    assert abs(direct - found["loop_width_algebraic"][0]) > 5.0 * abs(
        found["loop_width"][0] - found["loop_width_algebraic"][0]
    )


def test_to_port_first_is_the_mirror_of_to_starboard_first(unstable):
    other = reverse_spiral(synthetic.model(synthetic.SUBOFF), "-15 deg")
    assert other.attitude[:, 2] == pytest.approx(-unstable.attitude[:, 2], abs=1e-6)
    for name in LOOP:
        assert other.indices[name][0] == pytest.approx(unstable.indices[name][0], rel=1e-6)


def test_the_height_of_the_centre_of_gravity_does_not_move_the_algebraic_curve():
    # Roll is left out of the curve, so the CG's height must not come in by way of the coupled inertia.
    low, level = (steady_turns(synthetic.model(synthetic.SUBOFF, zg=zg), 1.0) for zg in (0.1, 0.0))
    # The loads are solved to 1e-6 of the scale.
    assert low.rudder == pytest.approx(level.rudder, abs=2e-5)
    assert low.rudder_span() == pytest.approx(level.rudder_span(), rel=1e-4)


def test_a_craft_that_cannot_hold_a_rate_has_no_curve():
    # A hull so unstable that no rudder holds it on the inner branch.
    wild = synthetic.model({**synthetic.SUBOFF, "Nuv": -0.022})
    trial = reverse_spiral(wild)
    assert "were held" in trial.status
    assert np.isnan(trial.indices["loop_width"][0])
    assert "reverse spiral" not in trial.provenance["curves"]


def test_no_rudder_makes_no_spiral():
    with pytest.raises(InputError, match="makes no turn"):
        reverse_spiral(synthetic.model(synthetic.STABLE), "0 deg")
