"""What the unit gate lets in, and what it refuses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from towtank.errors import InputError
from towtank.quantity import si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("2 in", "m", 0.0508),
        ("1 ft", "m", 0.3048),
        ("3 knot", "m/s", 3 * 1852 / 3600),
        ("15 deg", "rad", math.pi / 12),
        ("30 deg/s", "rad/s", math.pi / 6),
        ("4857.12 kg", "kg", 4857.12),
        ("1 lb", "kg", 0.45359237),
        ("62.4 lb/ft^3", "kg/m^3", 62.4 * 0.45359237 / 0.3048**3),
        ("5 %", "", 0.05),
        ("1.5", "m", 1.5),
    ],
)
def test_text_with_a_unit_becomes_si(text: str, unit: str, value: float):
    # The factors are exact by definition (inch, knot, pound); only round-off remains.
    assert si(text, unit) == pytest.approx(value, rel=1e-12)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_bare_number_is_si(value: float):
    assert si(value, "m") == value


@given(st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: x != 0.0))
def test_a_bare_angle_is_refused(value: float):
    with pytest.raises(InputError, match="bare angle"):
        si(value, "rad", "fin.max_angle")


def test_a_bare_angle_in_text_is_refused_and_zero_is_not():
    with pytest.raises(InputError, match="bare angle"):
        si("15", "rad")
    assert si(0, "rad") == 0.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "nan m", "inf m"])
def test_a_number_that_is_not_finite_is_refused(value: float | str):
    with pytest.raises(InputError, match=r"not finite|not a quantity"):
        si(value, "m")


@pytest.mark.parametrize(("value", "unit"), [("2 kg", "m"), ("2 m", "m/s"), ("2 m", ""), ("1 s", "rad")])
def test_a_wrong_dimension_is_refused(value: str, unit: str):
    with pytest.raises(InputError, match="cannot be converted"):
        si(value, unit)


@pytest.mark.parametrize("value", [True, None, [1.0], "two metres of it", "", "2 furlongz"])
def test_what_is_no_number_is_refused_with_its_place(value: object):
    with pytest.raises(InputError, match=r"hull\.length"):
        si(value, "m", "hull.length")  # type: ignore[arg-type]


def test_a_hertz_is_a_turn_in_a_second() -> None:
    assert si("0.5 Hz", "rad/s") == pytest.approx(math.pi)
    assert si("500 mHz", "rad/s") == pytest.approx(math.pi)
    assert si("30 deg/s", "rad/s") == pytest.approx(math.pi / 6)
    assert si("60 rpm", "rad/s") == pytest.approx(2 * math.pi)
