"""The model with published coefficients against published linear models."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from towtank.craft.craft import Craft, Fin, Mass
from towtank.craft.hull import Ellipsoid
from towtank.model.equations import Model
from towtank.model.linear import stability_indices, vertical
from towtank.model.options import ModelOptions
from towtank.water import GRAVITY, Water

DATA = Path(__file__).parents[1] / "data"
REMUS = yaml.safe_load((DATA / "model_published_remus100.yaml").read_text(encoding="utf-8"))
SUBOFF = yaml.safe_load((DATA / "model_published_suboff.yaml").read_text(encoding="utf-8"))
U = REMUS["linear"]["speed"]


def _craft(mass, cg, inertia, length, density):
    fins = tuple(
        Fin(f"fin{i}", np.radians(a), 0.05, 0.09, 0.13, 0.06, 0.95 * length) for i, a in enumerate((0, 90, 180, 270))
    )
    tensor = ((0.177, 0.0, 0.0), (0.0, inertia, 0.0), (0.0, 0.0, inertia))
    return Craft(
        "published", Ellipsoid(length, length / 7), fins, Mass(mass, mass, cg, tensor), 0.5 * length, U, Water(density)
    )


def _remus(values):
    craft = _craft(REMUS["weight_N"] / GRAVITY, (0.0, 0.0, REMUS["zG_m"]), REMUS["Iyy"], 1.33, REMUS["rho"])
    return Model.from_values(craft, values, options=ModelOptions(centre_of_buoyancy=(0.0, 0.0, 0.0)))


def _published_system(d):
    """A and B of (w, q, theta) from: inertia matrix times rates = slopes times states."""
    n, m = REMUS["nonlinear"], REMUS["weight_N"] / GRAVITY
    inertia = np.array([[m - n["Zwdot"], -n["Zqdot"], 0.0], [-n["Mwdot"], REMUS["Iyy"] - n["Mqdot"], 0.0], [0, 0, 1.0]])
    slopes = np.array([[d["Zw"], m * U + d["Zq"], 0.0], [d["Mw"], d["Mq"], d["Mtheta"]], [0.0, 1.0, 0.0]])
    return np.linalg.solve(inertia, slopes), np.linalg.solve(inertia, [d["Zds"], d["Mds"], 0.0])


def _per_speed(d):
    names = {"Zw": "Zuw", "Zq": "Zuq", "Mw": "Muw", "Mq": "Muq"}
    slopes = {term: d[name] / U for name, term in names.items()}
    return {**REMUS["nonlinear"], **slopes, "Zuude": d["Zds"] / U**2, "Muude": d["Mds"] / U**2}


def test_remus_vertical_poles_follow_the_published_linear_table():
    """The table's slopes are N, N m per m/s, rad/s, rad at 1.54 m/s: with them the model has the published poles."""
    A, B = _published_system(REMUS["linear"])
    linear = vertical(_remus(_per_speed(REMUS["linear"])), U, states=("w", "q", "theta"))
    # M_theta follows from the weight here, 1.6 % above the table's -5.77; 5 % on poles is the project's own limit
    assert np.sort_complex(linear.eigenvalues) == pytest.approx(np.sort_complex(np.linalg.eigvals(A)), rel=0.05)
    # the published system leaves out surge, which the CG below the origin couples to pitch: 0.14 %
    assert linear.B[:, 0] == pytest.approx(B, rel=2e-3)


def test_remus_restoring_moment_agrees_with_the_published_one():
    linear = vertical(_remus(REMUS["nonlinear"]), U, states=("w", "q", "theta"))
    inertia = REMUS["Iyy"] - REMUS["nonlinear"]["Mqdot"]
    # weight times zG, 299 N and 19.6 mm, against a table of three digits; heave couples through Zqdot by 0.7 %
    assert linear.A[1, 2] * inertia == pytest.approx(REMUS["linear"]["Mtheta"], rel=0.05)


def test_remus_tables_disagree_by_the_fin_lift_they_hold():
    """Why the quadratic table does not give the linear poles: it holds 0.45 of the fin lift of the linear table."""
    fin = -REMUS["rho"] * REMUS["fin"]["CLalpha"] * REMUS["fin"]["area_m2"]
    d, n, body = REMUS["linear"], REMUS["nonlinear"], REMUS["body"]
    assert d["Zds"] == pytest.approx(fin * U**2, rel=0.01)
    slenderness = body["length_m"] / body["diameter_m"]
    lift = -0.5 * REMUS["rho"] * body["diameter_m"] ** 2 * 0.003 * slenderness * np.degrees(1.0)
    assert d["Zw"] == pytest.approx((lift + fin) * U, rel=0.02)
    assert n["Zuude"] / fin == pytest.approx(0.45, abs=0.005)
    own = vertical(_remus(n), U, states=("w", "q", "theta")).eigenvalues
    published = np.linalg.eigvals(_published_system(d)[0])
    # the real pole moves by a tenth, the pair by more than a half: the 5 % of the project cannot be met from it
    assert min(own.real) == pytest.approx(min(published.real), rel=0.15)
    assert abs(max(own.real) - max(published.real)) > 0.05


def _suboff(primes):
    length, density = 4.261, 1000.0
    kg = {"Yv": (2, "Yuv"), "Nv": (3, "Nuv"), "Yr": (3, "Yur"), "Nr": (4, "Nur")}
    values = {term: primes[name] * 0.5 * density * length**power for name, (power, term) in kg.items()}
    values |= {"Zuw": values["Yuv"], "Zuq": -values["Yur"], "Muw": -values["Nuv"], "Muq": values["Nur"]}
    mass = primes["m"] * 0.5 * density * length**3
    craft = _craft(mass, (primes["xGm"] / primes["m"] * length, 0.0, 0.0), 1000.0, length, density)
    return Model.from_values(craft, values, options=ModelOptions(centre_of_buoyancy=craft.mass.cg))


@pytest.mark.parametrize("configuration", ["bare_hull", "hull_4fins"])
def test_stability_index_is_roddys(configuration):
    primes = SUBOFF["horizontal"][configuration]
    indices = stability_indices(_suboff(primes), "wide")
    # four digits of primes; the bare hull's index is the ratio of small numbers
    assert indices.horizontal == pytest.approx(primes["G"], rel=1e-3)
    assert indices.vertical == pytest.approx(indices.horizontal, rel=1e-12)
