"""The index reproduces published examples to the digits they print.

celik2008, table 1: a backward-facing step on three meshes; 18000, 8000, 4500 cells for the reattachment length and
18000, 4500, 980 for the two velocities; two-dimensional. Order by the rule h = (area / N)^(1/2).
slater2021: pressure recovery of a diffuser at r = 2.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from towtank.grid.estimate import estimate
from towtank.grid.gci import approximate_error, correction, extrapolate, index, observed_order, triplet

CELIK = {
    "reattachment length, monotone": (
        (18000, 8000, 4500), (6.063, 5.972, 5.863), {"r21": 1.5, "r32": 1.333},
        {"order": "1.53", "extrapolated": "6.1685", "error": "1.5", "extrapolated_error": "1.7", "gci": "2.2"},
    ),
    "axial velocity, order below 1": (
        (18000, 4500, 980), (10.7880, 10.7250, 10.6050), {"r21": 2.0, "r32": 2.143},
        {"order": "0.75", "extrapolated": "10.8801", "error": "0.6", "gci": "1.1"},
    ),
    "axial velocity, oscillatory": (
        (18000, 4500, 980), (6.0042, 5.9624, 6.0909), {"r21": 2.0, "r32": 2.143},
        {"order": "1.51", "extrapolated": "6.0269", "error": "0.7", "extrapolated_error": "0.4", "gci": "0.5"},
    ),
}  # fmt: skip
PERCENT = {"error", "extrapolated_error", "gci"}


@pytest.mark.parametrize("case", CELIK)
def test_celik_table_1_to_the_printed_digit(case: str):
    cells, phi, ratios, printed = CELIK[case]
    size = tuple(n**-0.5 for n in cells)
    assert size[1] / size[0] == pytest.approx(ratios["r21"], abs=5e-4)
    assert size[2] / size[1] == pytest.approx(ratios["r32"], abs=5e-4)
    found = triplet(phi, size)
    for name, text in printed.items():
        digits = len(text.partition(".")[2])
        value = getattr(found, name) * (100.0 if name in PERCENT else 1.0)
        assert f"{value:.{digits}f}" == text, name


def test_the_extrapolated_error_that_celik_prints_with_one_digit_too_many():
    """The second column prints 0.9 %, but its own 10.7880 and 10.8801 differ by 0.85 %."""
    cells, phi, _, printed = CELIK["axial velocity, order below 1"]
    found = triplet(phi, tuple(n**-0.5 for n in cells))
    own = (float(printed["extrapolated"]) - phi[0]) / float(printed["extrapolated"])
    assert found.extrapolated_error == pytest.approx(own, abs=1e-5)
    assert 100.0 * found.extrapolated_error == pytest.approx(0.9, abs=0.06)


def test_the_verdicts_of_celik_table_1():
    verdicts = [triplet(phi, tuple(n**-0.5 for n in cells)).verdict for cells, phi, _, _ in CELIK.values()]
    assert verdicts == ["monotone", "monotone", "oscillatory"]


def test_nasa_example_to_the_printed_digits():
    phi = (0.97050, 0.96854, 0.96178)
    found = triplet(phi, (1.0, 2.0, 4.0))
    assert f"{found.order:.6f}" == "1.786170"
    assert f"{found.extrapolated:.5f}" == "0.97130"
    assert f"{100.0 * found.gci:.6f}" == "0.103083"
    assert f"{100.0 * found.gci_coarse:.6f}" == "0.356249"
    assert f"{found.asymptotic:.6f}" == "1.002024"  # the page divides rounded numbers: 1.002019
    assert found.asymptotic == pytest.approx(1.002019, abs=1e-5)


def test_the_steps_give_what_the_whole_gives():
    phi, size = (0.97050, 0.96854, 0.96178), (1.0, 2.0, 4.0)
    p = observed_order(phi[1] - phi[0], phi[2] - phi[1], 2.0, 2.0)
    whole = triplet(phi, size)
    assert p == whole.order
    assert extrapolate(phi[0], phi[1], 2.0, p) == whole.extrapolated
    assert index(phi[0], phi[1], 2.0, p) == whole.gci
    assert index(phi[0], phi[1], 2.0, 2.0, meshes=2) == pytest.approx(3.0 * approximate_error(*phi[:2]) / 3.0)


def test_the_bound_of_the_finest_mesh_is_celiks_index():
    cells, phi, _, _ = CELIK["reattachment length, monotone"]
    found = estimate(np.array(phi[::-1]), np.array([n**-0.5 for n in cells[::-1]]))
    assert found.uncertainty[-1] == pytest.approx(found.gci * phi[0])
    assert round(100.0 * found.uncertainty[-1] / phi[0], 1) == 2.2


@pytest.mark.parametrize(("order", "factor"), [(1.0, 1.0 / 3.0), (2.0, 1.0), (2.05, (2.0**2.05 - 1.0) / 3.0)])
def test_ittc_uncertainty_by_hand(order: float, factor: float):
    """ittc75030101 with p_est = 2 and r = 2, worked out from the printed branches."""
    phi1, phi2 = 1.0, 1.1
    error = 0.1 / (2.0**order - 1.0)
    off = abs(1.0 - factor)
    plain = (9.6 * off**2 + 1.1) if off < 0.125 else 2.0 * off + 1.0
    corrected = (2.4 * off**2 + 0.1) if off < 0.25 else off
    found = correction(phi1, phi2, 2.0, order)
    assert found.factor == pytest.approx(factor)
    assert found.error == pytest.approx(error)
    assert found.uncertainty == pytest.approx(plain * error)
    assert found.corrected_uncertainty == pytest.approx(corrected * error)
    assert found.corrected == pytest.approx(1.0 - factor * error)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_branches_of_the_ittc_factors_meet(side: float):
    for limit, name in ((0.125, "uncertainty"), (0.25, "corrected_uncertainty")):
        near = []
        for nudge in (1.0 - 1e-9, 1.0 + 1e-9):
            factor = 1.0 + side * limit * nudge
            order = math.log2(1.0 + 3.0 * factor)
            found = correction(1.0, 1.1, 2.0, order)
            near.append(getattr(found, name) / abs(found.error))
        assert near[0] == pytest.approx(near[1], rel=1e-6)
        assert near[0] == pytest.approx({0.125: 1.25, 0.25: 0.25}[limit], rel=1e-6)
