"""Ties of a 4-fold craft, symmetry of the added mass, the weight of steady drift, gates and range."""

from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import ROLL, SPEED, campaign, coefficients, fourfold_coefficients, loaded, make

from towtank.derive.derive import derive
from towtank.derive.select import allowed
from towtank.plan.motion import Drift, Sway, Turn
from towtank.symbols import FOURFOLD_TIES

VERTICAL = ("heave", "pitch", "incidence")


def test_vertical_plane_of_a_fourfold_craft_is_copied_from_the_horizontal_one():
    values = fourfold_coefficients(seed=2)
    runs = [run for run in loaded(campaign(), values) if run.kind not in VERTICAL]
    found = derive(runs)
    for name, (base, sign) in FOURFOLD_TIES.items():
        assert found[name] == pytest.approx(sign * found[base], rel=1e-14)
        assert found[name] == pytest.approx(values[name], rel=1e-8)
        i, j = found.names.index(name), found.names.index(base)
        assert found.covariance[i, j] == pytest.approx(sign * found.covariance[j, j], abs=1e-30)


def test_runs_that_break_the_ties_are_reported():
    values = fourfold_coefficients(seed=2)
    values["Zuw"] *= 1.5
    gap = derive(loaded(campaign(), values)).quality["tie_gaps"]["Zuw"]
    assert gap["untied"] == pytest.approx(values["Zuw"], rel=1e-6)
    assert abs(gap["difference"]) > 0.2 * abs(gap["untied"])


def test_added_mass_halves_are_averaged_and_their_gap_reported():
    values = fourfold_coefficients(seed=4)
    half = values["Nvdot"]
    for name, sign in (("Nvdot", 1.0), ("Mwdot", -1.0)):
        values[name] = 1.2 * sign * half
    found = derive(loaded(campaign(), values))
    assert found["Yrdot"] == found["Nvdot"] == pytest.approx(1.1 * half, rel=1e-8)
    assert found.quality["symmetry_gaps"]["Yrdot - Nvdot"]["difference"] == pytest.approx(-0.2 * half, rel=1e-6)


def test_one_half_of_the_added_mass_serves_for_both():
    values = fourfold_coefficients(seed=4)
    found = derive([run for run in loaded(campaign(), values) if run.kind not in ("yaw", "pitch")])
    assert found["Yrdot"] == pytest.approx(values["Nvdot"], rel=1e-8)
    assert found.quality["by_reciprocity"]["Yrdot"] == "Nvdot"
    assert "Nrdot" in found.quality["not_excited"]
    assert "Nrdot" not in found.names


def test_roll_terms_that_symmetry_forbids_are_reported_and_left_out():
    values = fourfold_coefficients(seed=2) | coefficients(ROLL, seed=8)
    found = derive(loaded(campaign(), values))
    for name in ROLL:
        gate = found.quality["gated"][name]
        assert gate["value"] == pytest.approx(values[name], rel=1e-6)
        assert not gate["in_model"]
        assert name not in found.names


def test_roll_terms_within_the_noise_stay_out_of_a_craft_that_may_have_them():
    values = {n: v for n, v in coefficients(allowed("port-starboard"), seed=6).items() if n not in ROLL}
    found = derive(loaded(campaign("port-starboard"), values, noise=0.02, seed=4))
    for name in ROLL:
        gate = found.quality["gated"][name]
        assert gate["in_model"] == (abs(gate["value"]) > 3.0 * gate["std"])
        assert (name in found.names) == gate["in_model"]


def test_terms_that_cannot_be_told_apart_are_said_so():
    """Drift at one angle only, ahead: |v| v and u v are then the same column."""
    values = fourfold_coefficients()
    runs = loaded([make(f"drift{b}", Drift(SPEED, np.radians(b))) for b in (-6, 6)], values)
    found = derive(runs)
    assert "Yuv" in found.names
    assert "Yuv" in found.quality["not_excited"]["Yvv"]
    assert found.quality["not_excited"]["Nrdot"].startswith("no run has rdot")


def _disagreeing(slope=0.5):
    """Sway runs whose Yuv is ``slope`` times that of the drift runs."""
    values = fourfold_coefficients(seed=9)
    base = [run for run in campaign() if run.kind in ("drift", "sway")]
    other = {**values, "Yuv": slope * values["Yuv"], "Zuw": slope * values["Zuw"]}
    return values, [loaded([run], other if run.kind == "sway" else values)[0] for run in base]


def test_lambda_moves_the_answer_from_sway_to_steady_drift():
    values, runs = _disagreeing()
    only_sway, half, only_drift = (derive(runs, weight_steady=w)["Yuv"] for w in (0.0, 0.5, 1.0))
    # At the ends the outvoted tests keep a share of 1e-6.
    assert only_drift == pytest.approx(values["Yuv"], rel=1e-3)
    assert only_sway == pytest.approx(0.5 * values["Yuv"], rel=1e-3)
    assert min(only_sway, only_drift) < half < max(only_sway, only_drift)


def test_sensitivity_to_lambda_is_stored_and_is_what_derive_gives():
    _, runs = _disagreeing()
    # Without screening: verdicts are kept when lambda is varied, and these runs contradict each other.
    found = derive(runs, screening=False)
    assert found.quality["weight_steady"] == 0.7
    for text, value in found.quality["sensitivity"]["Yuv"].items():
        assert derive(runs, weight_steady=float(text), screening=False)["Yuv"] == pytest.approx(value, rel=1e-9)
    # In-phase sway is untouched by steady drift.
    assert derive(runs, weight_steady=1.0)["Yvdot"] == pytest.approx(derive(runs, weight_steady=0.0)["Yvdot"], rel=1e-6)


def test_runs_outside_the_range_are_left_out_with_the_reason():
    values = fourfold_coefficients()
    extra = [
        make("wide", Drift(SPEED, np.radians(25.0))),
        make("violent", Sway(SPEED, 0.6, SPEED)),
        make("stalled", Drift(SPEED, 0.0), control=(np.radians(30.0), 0.0, 0.0), kind="fins"),
        replace(make("trial", Turn(SPEED, 0.1)), exploratory=True),
        make("astern", Drift(SPEED, np.radians(180.0))),
    ]
    # Loads of another craft: were they fitted, the answer would move.
    wrong = [replace(run, loads=run.loads + 1e6) for run in extra]
    found = derive([*loaded(campaign(), values), *wrong])
    why = dict(found.rejected)
    assert set(why) == {"wide", "violent", "stalled", "trial", "astern"}
    assert "25.0 deg" in why["wide"]
    assert "31.0 deg" in why["violent"]  # atan(0.6)
    assert "30.0 deg" in why["stalled"]
    assert "exploratory" in why["trial"]
    assert found["Yuv"] == pytest.approx(values["Yuv"], rel=1e-8)


def test_fourth_order_axial_term_needs_drift_beyond_ten_degrees():
    values = fourfold_coefficients()
    runs = [run for run in loaded(campaign(), values) if not (run.kind == "drift" and abs(float(run.name[6:])) > 10)]
    found = derive(runs)
    assert "Xvvvv" not in found.names
    assert "10 deg" in found.quality["not_excited"]["Xvvvv"]


def test_each_term_names_the_runs_it_rests_on():
    found = derive(loaded(campaign(), fourfold_coefficients()))
    assert all(name.startswith("surge") or name.startswith(("yaw", "pitch")) for name in found.runs["Xudot"])
    assert any(name.startswith("surge") for name in found.runs["Xudot"])
    assert all(name.startswith("roll") for name in found.runs["Kpp"])
    assert any(name.startswith("turn") and "drift" in name for name in found.runs["Xvr"])


def test_turns_with_drift_do_not_spoil_the_pure_rotary_terms():
    """A v|r| load is outside the model: it shows in the residual of the mixed runs and hardly in Yur or Nur."""
    values = fourfold_coefficients(seed=3)

    def cross(run):
        v, r = run.history.nu[:, 1], run.history.nu[:, 5]
        extra = np.zeros_like(run.loads)
        extra[:, 1], extra[:, 5] = 5.0 * values["Yrr"] / 8.0 * v * np.abs(r), 5.0 * values["Nrr"] / 8.0 * v * np.abs(r)
        return replace(run, loads=run.loads + extra)

    # A little noise, since with exact data every misfit would be as large as any other.
    found = derive([cross(run) for run in loaded(campaign(), values, noise=0.005, seed=1)])
    mixed = found.quality["residuals"]["turn-0.3-drift-6"]
    pure = found.quality["residuals"]["turn-0.3"]
    for load, term in (("Y", "Yur"), ("N", "Nur")):
        assert mixed[load]["rms"] > 5.0 * pure[load]["rms"]
        assert found[term] == pytest.approx(values[term], rel=0.05)


def test_one_run_of_each_kind_alone_gives_what_it_determines_and_no_more():
    """A single run leaves terms undetermined; those it gives are right or tied up with named others."""
    values = fourfold_coefficients(seed=6)
    seen = {run.kind: run for run in loaded(campaign(), values)}
    assert set(seen) == {"drift", "turn", "fins", "sway", "heave", "surge", "yaw", "pitch", "roll"}
    for run in seen.values():
        found = derive([run])
        assert np.isfinite(found.values).all()
        assert np.isfinite(found.covariance).all()
        assert not set(found.names) & set(found.quality["not_excited"])
    assert derive([seen["roll"]])["Kpdot"] == pytest.approx(values["Kpdot"], rel=1e-8)
    assert derive([seen["sway"]])["Yuv"] == pytest.approx(values["Yuv"], rel=1e-8)


def test_runs_without_load_give_zero_without_complaint():
    found = derive(campaign())
    assert not found.values.any()
    assert not found.covariance.any()
