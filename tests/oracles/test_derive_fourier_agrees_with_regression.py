"""The classical in-phase and quadrature results beside the regression, on small single-harmonic motions."""

import numpy as np
import pytest

from towtank.derive.derive import derive
from towtank.derive.fourier import FIRST, THIRD, harmonics
from towtank.symbols import FOURFOLD_TIES

from derive_cases import AMPLITUDES, oscillations, truth  # isort: skip


def test_harmonics_of_cos_abs_cos_are_those_of_the_series():
    phase = 2 * np.pi * np.arange(4096) / 4096
    got = harmonics(np.abs(np.cos(phase)) * np.cos(phase), 3, 1)
    # The series converges as k^-4, so aliasing on 4096 points is below 1e-8.
    assert got[1] == pytest.approx(FIRST, rel=1e-7)
    assert got[3] == pytest.approx(THIRD, rel=1e-7)
    assert abs(got[[0, 2]]).max() < 1e-12


@pytest.mark.parametrize("kind", ["sway", "yaw", "heave", "pitch", "roll", "surge"])
def test_fourier_equals_regression_and_truth(kind):
    runs = oscillations(kind)
    values = truth()
    found = derive(runs)
    classical = found.quality["fourier"]
    assert set(classical) == {run.name for run in runs}
    for run in runs:
        for term, value in classical[run.name].items():
            if term in found.names and term in values:
                # Yaw and pitch keep u constant to 0.5 psi^2, psi = r'/w' = 0.01: 1e-4 in u and u r. The quadratic
                # part is 1 % of the load there and takes that error 100-fold; 64 samples alias |cos| cos by 1e-4.
                loose = term[1:] in ("vv", "ww", "pp", "qq", "rr")
                assert value == pytest.approx(found[term], rel=0.02 if loose else 2e-3), (run.name, term)
                assert value == pytest.approx(values[term], rel=0.02 if loose else 2e-3), (run.name, term)
        assert classical[run.name].get("even_share", 0.0) < 1e-9


def test_sway_equivalent_slope_holds_the_crossflow_by_eight_over_three_pi():
    values = truth()
    for run, amplitude in zip(oscillations("sway"), AMPLITUDES, strict=True):
        got = derive([run]).quality["fourier"][run.name]
        speed = float(run.history.nu[0, 0])
        for load in "YN":
            expected = values[f"{load}uv"] + FIRST * values[f"{load}vv"] * amplitude
            assert got[f"{load}uv_equivalent"] == pytest.approx(expected, rel=1e-4)
        assert speed == run.speed


def test_vertical_results_carry_the_signs_of_the_ties():
    sway = derive(oscillations("sway")).quality["fourier"]["sway-0"]
    heave = derive(oscillations("heave")).quality["fourier"]["heave-0"]
    for name in ("Zuw", "Muw", "Zwdot", "Mwdot"):
        base, sign = FOURFOLD_TIES[name]
        assert heave[name] == pytest.approx(sign * sway[base], rel=1e-9)
