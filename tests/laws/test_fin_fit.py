"""The fin curve is found again from runs that were made with one, whatever the layout of the fins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import DENSITY, LENGTH, SPEED, campaign, fourfold_coefficients, loaded, make

from towtank import read_craft
from towtank.craft.craft import Fin
from towtank.derive.derive import derive
from towtank.derive.fin_curve import FinCurve
from towtank.derive.fin_fit import acting, fit_fin_curve, straight_runs, virtual_of_fins
from towtank.plan.motion import Drift
from towtank.symbols import FOURFOLD_TIES, TERMS
from towtank.tank.run import Run

X = np.array([[-1, -1, -1], [-1, 1, -1], [1, -1, -1], [1, 1, -1]], dtype=float)
"""Fin angles of rudder, elevator and aileron of four X fins (THEORY section 5)."""
TRUE = FinCurve(stall=np.radians(27.0), curvature=0.25, drop=0.35, width=np.radians(8.0), source="the test")
ANGLES = (-10, -5, 5, 10, 15, 20, 25, 30, 35, 40)
FINS = {
    name: TERMS[name].prime_factor(DENSITY, LENGTH, SPEED) * size
    for name, size in {"Yuudr": 0.007, "Kuudroll": 0.0003, "Nuudr": -0.003}.items()
}
FINS |= {name: sign * FINS[base] for name, (base, sign) in FOURFOLD_TIES.items() if base in FINS}


def deflected(name: str, fins: np.ndarray, mixing: np.ndarray, curve: FinCurve | None, **changes) -> Run:
    """A straight run with the loads of the fin terms at the angles that the curve leaves of ``fins`` [rad]."""
    virtual = np.linalg.pinv(mixing)
    run = make(name, Drift(SPEED, 0.0), kind="fins")
    acts = virtual @ (fins if curve is None else curve(fins))
    loads = np.zeros(6)
    for term, control, load in (("Yuudr", 0, 1), ("Zuude", 1, 2), ("Kuudroll", 2, 3), ("Muude", 1, 4), ("Nuudr", 0, 5)):
        loads[load] += FINS[term] * SPEED**2 * acts[control]
    shown = np.array([*(virtual @ fins), float(fins @ fins)])
    return replace(run, delta=np.tile(fins, (2, 1)), control=np.tile(shown, (2, 1)), loads=np.tile(loads, (2, 1)),
                   exploratory=bool(np.abs(fins).max() > np.radians(20.01)), **changes)  # fmt: skip


def sweep(mixing: np.ndarray = X, curve: FinCurve | None = TRUE, angles=ANGLES) -> list[Run]:
    runs = []
    for control, word in enumerate(("rudder", "elevator", "aileron")):
        if np.any(mixing[:, control]):
            runs += [deflected(f"{word}-{a}", mixing[:, control] * np.radians(a), mixing, curve) for a in angles]
    for number in range(len(mixing)):
        runs += [deflected(f"fin{number}-{a}", np.eye(len(mixing))[number] * np.radians(a), mixing, curve) for a in
                 (10, 20, 30, 40)]  # fmt: skip
    return runs


def fitted(runs: list[Run]) -> FinCurve:
    curve, why = fit_fin_curve(runs, {name: np.array([value]) for name, value in FINS.items()})
    assert curve is not None, why
    return curve


# The fit takes the first stall angle that agrees with the runs to 1 %, so it may lie before the true one; the curve
# itself must agree where there are runs, and to 8 % between them: they are 5 deg apart and the ramp is 8 deg wide.
def assert_same_curve(found: FinCurve, true: FinCurve = TRUE) -> None:
    angle = np.radians(np.arange(5.0, 40.1, 5.0))
    assert found(angle) == pytest.approx(true(angle), abs=0.02 * float(true(angle).max()))
    between = np.radians(np.linspace(1.0, 40.0, 200))
    assert found(between) == pytest.approx(true(between), abs=0.08 * float(true(between).max()))
    assert found.stall == pytest.approx(true.stall, abs=np.radians(2.5))


def test_a_known_curve_is_found_again() -> None:
    found = fitted(sweep())
    assert_same_curve(found)
    assert found.residual < 0.012
    assert found.largest == pytest.approx(np.radians(40.0))
    assert set(found.runs) == {run.name for run in sweep()}


def test_it_is_found_with_noise_within_its_uncertainty() -> None:
    rng = np.random.default_rng(4)
    noisy = [replace(run, loads=run.loads * (1.0 + 0.02 * rng.standard_normal(6))) for run in sweep()]
    found = fitted(noisy)
    assert_same_curve(found)
    assert found.std[0] > 0.0
    assert abs(found.stall - TRUE.stall) < np.hypot(3.0 * found.std[0], np.radians(1.0))


def test_fins_that_share_an_angle_unequally_give_the_same_curve() -> None:
    craft = read_craft("suboff-fins")
    three = tuple(replace(craft.fins[0], name=f"fin{i}", azimuth=np.radians(a)) for i, a in enumerate((90, 210, 330)))
    mixing = replace(craft, fins=three).mixing
    assert len(np.unique(np.abs(mixing[:, 0]).round(6))) > 1
    assert isinstance(three[0], Fin)
    assert_same_curve(fitted(sweep(mixing)))


def test_the_side_force_of_the_rudder_alone_is_enough() -> None:
    runs = [run for run in sweep() if run.name.startswith("rudder")]
    assert_same_curve(fitted(runs))
    angle = np.radians(np.array([-30.0, 10.0, 38.0]))
    assert acting(TRUE, runs, 0, angle) == pytest.approx(TRUE(angle))
    assert virtual_of_fins(runs)[0] @ X[:, 0] == pytest.approx(1.0)


def test_fins_that_do_not_stall_get_no_drop() -> None:
    found = fitted(sweep(curve=None))
    assert found.drop == 0.0
    assert found(np.radians(35.0)) == pytest.approx(np.radians(35.0), rel=0.01)
    assert "no stall to 40 deg" in found.source


def test_there_is_no_curve_without_runs_beyond_the_linear_range() -> None:
    terms = {name: np.array([value]) for name, value in FINS.items()}
    for angles, count in (((-10, -5, 5, 10, 15, 20), 0), ((-10, -5, 5, 10, 15, 20, 30), 1)):
        runs = [run for run in sweep(angles=angles) if run.name.split("-")[0] in ("rudder", "elevator", "aileron")]
        curve, why = fit_fin_curve(runs, terms)
        assert curve is None
        assert f"{count} fin angles beyond 20 deg" in why
    assert fit_fin_curve([], terms) == (None, "")
    assert fit_fin_curve(sweep(), {}) == (None, "")


def test_runs_whose_virtual_angles_are_not_those_of_their_fins_are_not_used() -> None:
    odd = [replace(run, control=np.abs(run.control) ** 2) for run in sweep()]
    assert fit_fin_curve(odd, {name: np.array([value]) for name, value in FINS.items()})[0] is None


def test_only_straight_runs_are_used() -> None:
    drifting = [make("drift-8", Drift(SPEED, np.radians(8.0)))]
    assert [run.name for run in straight_runs([*sweep(), *drifting])] == [run.name for run in sweep()]


def test_derive_keeps_the_linear_coefficients_and_adds_the_curve() -> None:
    """With the fins of the campaign replaced by the sweep: what is fitted to 20 deg does not know the curve."""
    values = fourfold_coefficients() | FINS
    others = [run for run in loaded(campaign(), values) if run.kind != "fins"]
    linear, curved = derive([*others, *sweep(curve=None)]), derive([*others, *sweep()])
    assert curved.fin_curve is not None
    within = [run for run in sweep() if not run.exploratory]
    assert derive([*others, *within]).fin_curve is None
    assert derive([*others, *within]).as_dict() == pytest.approx(curved.as_dict())
    # The curve bends by 0.25 per radian: over 20 deg the coefficient takes up 9 % of slope, as a chord does.
    assert curved["Yuudr"] / linear["Yuudr"] == pytest.approx(1.07, abs=0.03)
    load = curved["Yuudr"] * SPEED**2 * float(curved.fin_curve(np.radians(35.0)))
    true = FINS["Yuudr"] * SPEED**2 * float(TRUE(np.radians(35.0)))
    assert load == pytest.approx(true, rel=0.03)
    assert "Fin curve (known coefficients): stall" in str(curved)
