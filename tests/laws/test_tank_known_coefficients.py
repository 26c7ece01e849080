"""The tank of known coefficients gives what was put in, and noise of the stated size."""

import math

import numpy as np
import pytest

from towtank.craft.library import read_craft
from towtank.errors import TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway
from towtank.progress import Silent
from towtank.tank.lpm import LpmTank

HOKIE = read_craft("hokie")
SWAY = CaptiveTest("sway", 1.0, Sway(1.0, 0.8, 0.2))


def test_sway_gives_the_classical_harmonics():
    a, w = 0.8, 0.2
    run = LpmTank({"Yvdot": -4800.0, "Yuv": -300.0, "Nuv": -2000.0}).run(HOKIE, SWAY, Silent())
    settled, phase = run.settled, w * run.history.time[run.settled]
    assert len(settled) == 128
    in_phase = 2.0 * np.mean(run.loads[settled, 1] * np.sin(phase))
    quadrature = 2.0 * np.mean(run.loads[settled, 1] * np.cos(phase))
    # fossen2021, THEORY section 4: Y_s = -Yvdot a w2 and Y_c = Yuv U a w; means over whole periods are exact.
    assert in_phase == pytest.approx(4800.0 * a * w**2, rel=1e-10)
    assert quadrature == pytest.approx(-300.0 * a * w, rel=1e-10)


def test_deflected_fins_act_through_the_virtual_controls():
    angle = math.radians(10.0)
    fins = tuple(float(x) for x in HOKIE.mixing[:, 0] * angle)
    run = LpmTank({"Yuudr": 500.0, "Xuudd": -40.0}).run(HOKIE, CaptiveTest("r", 2.0, Drift(2.0, 0.0), fins), Silent())
    assert run.kind == "fins"
    np.testing.assert_allclose(run.loads[:, 1], 500.0 * 4.0 * angle, rtol=1e-12)
    np.testing.assert_allclose(run.loads[:, 0], -40.0 * 4.0 * sum(x * x for x in fins), rtol=1e-12)


def test_noise_is_a_share_of_the_root_mean_square_and_repeatable():
    values = {"Yvdot": -4800.0, "Yuv": -300.0}
    exact = LpmTank(values).run(HOKIE, SWAY, Silent()).loads
    noisy = LpmTank(values, noise=0.02, seed=3).run(HOKIE, SWAY, Silent()).loads
    error = noisy - exact
    # 193 samples give the standard deviation to 1 / sqrt(2 * 193) = 5 %; four of those.
    assert error[:, 1].std() == pytest.approx(0.02 * np.sqrt((exact[:, 1] ** 2).mean()), rel=0.2)
    assert np.all(error[:, 2] == 0.0)
    np.testing.assert_array_equal(noisy, LpmTank(values, noise=0.02, seed=3).run(HOKIE, SWAY, Silent()).loads)
    other = LpmTank(values, noise=0.02, seed=4).run(HOKIE, SWAY, Silent()).loads
    renamed = CaptiveTest("sway-2", 1.0, SWAY.motion)
    assert not np.array_equal(noisy, other)
    assert not np.array_equal(noisy, LpmTank(values, noise=0.02, seed=3).run(HOKIE, renamed, Silent()).loads)


@pytest.mark.parametrize(("values", "noise", "word"), [({"Yvw": 1.0}, 0.0, "Yvw"), ({}, -0.1, "noise")])
def test_what_is_no_coefficient_set_is_refused(values, noise, word):
    with pytest.raises(TankError, match=word):
        LpmTank(values, noise)
