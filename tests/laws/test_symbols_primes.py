"""Terms: units and primes follow from dimensional analysis; symmetry ties from a quarter turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import towtank
from towtank.symbols import FOURFOLD_ADDED_MASS, FOURFOLD_TIES, LOADS, OPTIONAL_TIES, RATES, TERMS, Term
from towtank.terms import regressor, term_loads

POSITIVE = st.floats(0.1, 10.0)
NAMES = sorted(TERMS)
QUARTER = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
"""Turn by 90 deg about x: starboard becomes keel."""


def _turned(vectors: np.ndarray) -> np.ndarray:
    return np.concatenate([vectors[:, :3] @ QUARTER.T, vectors[:, 3:] @ QUARTER.T], axis=1)


def _motion(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    nu = rng.normal(size=(5, 6))
    nu[:, 0] = 1.0 + 0.1 * rng.random(5)
    return nu, rng.normal(size=(5, 6))


@given(st.sampled_from(NAMES), POSITIVE, POSITIVE, POSITIVE)
def test_primes_do_not_change_with_the_scale_of_the_test(name: str, density: float, length: float, speed: float):
    """A geometrically similar motion at another scale has the same primed load when the primed term is the same."""
    term = TERMS[name]
    nu, nudot = _motion(1)
    control = np.full((5, 4), 0.1)
    unit = regressor(term, nu, nudot, control)
    scale_v, scale_w = speed, speed / length
    scaled_nu = nu * np.repeat([scale_v, scale_w], 3)
    scaled_dot = nudot * np.repeat([speed**2 / length, speed**2 / length**2], 3)
    load = term.prime_factor(density, length, speed) * regressor(term, scaled_nu, scaled_dot, control)
    divisor = 0.5 * density * speed**2 * np.repeat([length**2, length**3], 3)
    # equal by dimensional analysis; only round-off of powers remains
    np.testing.assert_allclose(load / divisor, unit, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("Yvdot", "kg"), ("Yrdot", "kg m"), ("Nrdot", "kg m2"), ("Xuu", "kg/m"), ("Yuv", "kg/m"), ("Nuv", "kg"),
     ("Yur", "kg"), ("Nur", "kg m"), ("Nrr", "kg m2"), ("Yuudr", "kg/m"), ("Kuudroll", "kg"), ("Xvvvv", "kg/m")],
)  # fmt: skip
def test_units_of_terms(name: str, unit: str):
    """Y [kg m/s2] per v2 [m2/s2] is kg/m, and so on."""
    assert TERMS[name].unit == unit


@given(st.integers(0, 50))
def test_tied_terms_make_the_load_turn_with_the_motion(seed: int):
    """With the ties of a 4-fold craft, a motion turned by 90 deg gives the load turned by 90 deg.

    Cross-flow terms in v|v| and w|w| obey it too: a quarter turn only exchanges and reflects the two planes.
    """
    rng = np.random.default_rng(seed)
    ties = FOURFOLD_TIES | OPTIONAL_TIES
    own = [n for n in NAMES if n not in ties and not n.startswith("K") and not n.endswith(("dr", "dd", "dot"))]
    values = {name: rng.normal() for name in own}
    values |= {name: rng.normal() for name in ("Xudot", "Yvdot", "Kpdot", "Nrdot")}
    values["Yrdot"] = values["Nvdot"] = rng.normal()
    values |= {name: sign * values[of] for name, (of, sign) in ties.items() if of in values}
    nu, nudot = _motion(seed + 1000)
    still = np.zeros((5, 4))
    np.testing.assert_allclose(
        term_loads(values, _turned(nu), _turned(nudot), still),
        _turned(term_loads(values, nu, nudot, still)),
        atol=1e-10,  # sums of about forty terms of order one
    )


def test_the_added_mass_entries_of_a_fourfold_craft_commute_with_the_quarter_turn():
    values = dict.fromkeys(FOURFOLD_ADDED_MASS, 1.0)
    values |= {name: sign * values[of] for name, (of, sign) in FOURFOLD_TIES.items() if name.endswith("dot")}
    matrix = np.array([[values.get(f"{load}{rate}dot", 0.0) for rate in RATES] for load in LOADS])
    turn = np.kron(np.eye(2), QUARTER)
    np.testing.assert_allclose(turn @ matrix @ turn.T, matrix, atol=1e-15)


def test_added_mass_forces_do_no_work():
    """Kirchhoff: the velocity-dependent part of the added-mass load has no power, whatever the matrix."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        entries = rng.normal(size=(6, 6))
        symmetric = entries + entries.T
        values = {f"{load}{rate}dot": symmetric[i, j] for i, load in enumerate(LOADS) for j, rate in enumerate(RATES)}
        nu, _unused = _motion(int(rng.integers(1000)))
        load = term_loads(values, nu, np.zeros_like(nu), np.zeros((5, 4)))
        np.testing.assert_allclose((load * nu).sum(axis=1), 0.0, atol=1e-11)


def _row(term: Term) -> str:
    factors = " ".join(term.factors).replace("|", "\\|")
    a, b = term.powers
    return f"| `{term.name}` | {term.load} | {factors} | {term.unit} | {a}, {b} | {term.meaning} |"


def test_the_nomenclature_page_lists_exactly_the_terms():
    page = (Path(towtank.__file__).parents[2] / "docs" / "nomenclature.md").read_text("utf-8")
    listed = [line for line in page.splitlines() if line.startswith("| `")]
    assert listed == [_row(term) for term in TERMS.values()]
