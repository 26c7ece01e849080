"""The curve of a fin's load: its shape, its way through files and to another point of reference."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from derive_synthetic import campaign, fourfold_coefficients, loaded

from towtank.derive.convert import about_point
from towtank.derive.derive import derive
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.derive.fin_curve import FinCurve
from towtank.derive.table import Derivatives
from towtank.errors import ArtefactError, InputError

CURVE = FinCurve(
    stall=0.45, curvature=0.3, drop=0.4, width=0.2, source="a test", runs=("rudder-30", "rudder-40"), level="rans",
    std=(0.02, 0.1, 0.05, 0.03), residual=0.01, largest=0.7, kappa_v=0.45, kappa_r=0.8, kappa_std=(0.1, 0.2),
    station_from_nose=7.0, kappa_level="semi-empirical", kappa_source="hull and fins less hull",
)  # fmt: skip


@pytest.fixture(scope="module")
def derived() -> Derivatives:
    return dataclasses.replace(derive(loaded(campaign(), fourfold_coefficients())), fin_curve=CURVE)


def test_curve_is_odd_has_unit_slope_and_its_peak_at_the_stall() -> None:
    angle = np.linspace(-0.9, 0.9, 1801)
    load = CURVE(angle)
    assert np.allclose(load, -load[::-1])
    assert float(CURVE(1e-6)) == pytest.approx(1e-6, rel=1e-6)
    assert abs(angle[np.argmax(load)]) == pytest.approx(CURVE.stall, abs=1e-3)
    assert float(CURVE(0.8)) == pytest.approx(0.6 * 0.45 * (1 + 0.3 * 0.45))


def test_curve_is_read_back_equal_and_old_files_have_none(derived, tmp_path) -> None:
    path = write_derivatives(derived, tmp_path / "derivatives.json")
    assert read_derivatives(path).fin_curve == CURVE
    content = json.loads(path.read_text())
    del content["fin_curve"]
    path.write_text(json.dumps(content))
    assert read_derivatives(path).fin_curve is None


@pytest.mark.parametrize(("entry", "value"), [("stall", -0.4), ("drop", 1.5), ("width", "wide"), ("curvature", -3.0)])
def test_a_damaged_curve_in_a_file_is_refused(derived, tmp_path, entry, value) -> None:
    path = write_derivatives(derived, tmp_path / "derivatives.json")
    content = json.loads(path.read_text())
    content["fin_curve"][entry] = value
    path.write_text(json.dumps(content))
    with pytest.raises(ArtefactError, match=r"derivatives\.json"):
        read_derivatives(path)


def test_flow_angle_at_the_fins_is_that_of_any_point(derived) -> None:
    """kappa_v v + kappa_r x r is a property of the flow at the fins; the point of reference is bookkeeping."""
    origin, moved = derived.reference.origin_from_nose, about_point(derived, 3.0)
    v, r = 0.2, 0.05
    there = moved.fin_curve
    assert there is not None
    shift = origin - 3.0
    old = CURVE.kappa_v * v + CURVE.kappa_r * (origin - 7.0) * r
    new = there.kappa_v * (v + shift * r) + there.kappa_r * (3.0 - 7.0) * r
    assert new == pytest.approx(old)
    back = about_point(moved, origin).fin_curve
    assert back is not None
    assert back.kappa_r == pytest.approx(CURVE.kappa_r)
    assert about_point(derived, length=2.0).fin_curve == CURVE


def test_a_point_at_the_fins_is_refused(derived) -> None:
    with pytest.raises(InputError, match="where the fins stand"):
        about_point(derived, 7.0)


@pytest.mark.parametrize(
    "wrong", [{"stall": 0.0}, {"width": -1.0}, {"drop": 1.2}, {"curvature": -5.0}, {"stall": np.nan}]
)
def test_a_curve_that_turns_its_sign_is_refused(wrong) -> None:
    with pytest.raises(InputError, match="fin curve"):
        dataclasses.replace(CURVE, **wrong)
