"""Every run is judged by stated tests: the sound are accepted, the others named, and the answer is found again."""

import math
from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import SAMPLES, SPEED, W0, campaign, fourfold_coefficients, loaded, make

from towtank.derive.derive import derive
from towtank.derive.verdicts import LIMITS, Tested, verdict_of
from towtank.plan.motion import Sway, Yaw

VALUES = fourfold_coefficients(seed=2)
KEY = ("Yuv", "Yvv", "Nuv", "Nvv", "Yur", "Nur", "Yvdot", "Nrdot")


def sways(count=6):
    """Sway runs of one amplitude and several frequencies, so that one of them is judged by its own kind."""
    return [
        make(f"sway-more-{i}", Sway(SPEED, 0.2 * SPEED / (w * W0), w * W0))
        for i, w in enumerate(np.linspace(0.8, 1.8, count))
    ]


def runs_of(noise=0.0, seed=0):
    return loaded([*campaign(), *sways()], VALUES, noise=noise, seed=seed)


def changed(runs, name, loads):
    """The runs with the loads of one of them put through ``loads``(run)."""
    return [replace(run, loads=loads(run)) if run.name == name else run for run in runs]


def verdicts(runs, **options):
    return {name: entry["verdict"] for name, entry in derive(runs, **options).quality["screening"].items()}


def test_exact_runs_are_all_accepted_and_screening_changes_nothing():
    runs = runs_of()
    screened, plain = derive(runs), derive(runs, screening=False)
    assert set(verdicts(runs).values()) == {"accepted"}
    np.testing.assert_array_equal(screened.values, plain.values)
    np.testing.assert_array_equal(screened.covariance, plain.covariance)
    assert plain.quality["screening"] == {}


def test_noise_alone_is_not_held_against_a_run():
    # 5 % on every load of 60 runs, ten campaigns. The noise of an oscillation is known, and passes with 1e-5; that of a
    # steady run is guessed from a handful of others, so one in a hundred may be weighed down, and none rejected.
    found = [verdicts(runs_of(noise=0.05, seed=seed)) for seed in range(10)]
    waving = {run.name for run in runs_of() if not run.steady}
    assert {verdict for one in found for name, verdict in one.items() if name in waving} == {"accepted"}
    steady = [verdict for one in found for name, verdict in one.items() if name not in waving]
    assert "rejected" not in steady
    assert steady.count("down-weighted") <= 0.01 * len(steady)


def test_a_run_whose_loads_are_of_another_size_is_rejected_and_the_answer_is_that_of_the_others():
    runs = changed(runs_of(noise=0.01), "sway-more-2", lambda run: 1.6 * run.loads)
    found = derive(runs)
    assert dict(found.rejected)["sway-more-2"].startswith("lack of fit")
    others = derive([run for run in runs if run.name != "sway-more-2"])
    np.testing.assert_allclose(found.values, others.values, rtol=1e-12)


def test_the_worse_the_misfit_the_less_the_trust_until_rejection():
    found = [
        derive(changed(runs_of(), "sway-more-2", lambda run, f=f: f * run.loads)).quality["screening"]["sway-more-2"]
        for f in (1.05, 1.2, 1.3, 1.5)
    ]
    trust = [entry["trust"] for entry in found]
    assert trust[0] == 1.0
    assert trust[-1] == 0.0
    assert trust == sorted(trust, reverse=True)
    assert [entry["verdict"] for entry in found] == ["accepted", "down-weighted", "down-weighted", "rejected"]


def test_a_third_harmonic_that_no_term_makes_is_named():
    def ringing(run):
        third = np.cos(3.0 * 2.0 * math.pi * run.history.time / run.period)[:, None]
        return run.loads + 0.25 * np.abs(run.loads).max(axis=0) * third

    found = derive(changed(runs_of(), "sway-more-3", ringing)).quality["screening"]["sway-more-3"]
    assert not found["tests"]["third harmonic"]["passed"]
    assert found["tests"]["third harmonic"]["value"] == pytest.approx(
        0.25, rel=0.05
    )  # of the first, beside a small |v| v
    assert found["tests"]["even harmonics"]["passed"]


def test_loads_that_favour_a_side_are_named():
    found = derive(changed(runs_of(), "sway-more-3", lambda run: run.loads + 0.2 * np.abs(run.loads).max(axis=0)))
    tests = found.quality["screening"]["sway-more-3"]["tests"]
    assert not tests["even harmonics"]["passed"]
    assert tests["third harmonic"]["passed"]
    assert "sway-more-3" in dict(found.rejected)


def test_loads_that_change_from_period_to_period_are_named():
    def settling(run):
        return run.loads * (1.0 + 0.2 * np.exp(-run.history.time / run.period))[:, None]

    tests = derive(changed(runs_of(), "sway-more-1", settling)).quality["screening"]["sway-more-1"]["tests"]
    assert not tests["period to period"]["passed"]
    # 0.2 (exp(-1.5) - exp(-2.5)) between the middles of the two settled periods.
    assert tests["period to period"]["value"] == pytest.approx(0.028, rel=0.1)


@pytest.mark.parametrize(("rate", "verdict"), [(0.5, "accepted"), (0.9, "down-weighted"), (1.3, "rejected")])
def test_the_flow_at_the_stern_decides_beside_that_at_the_origin(rate, verdict):
    w = 3.0 * W0
    wild = make("yaw-wild", Yaw(SPEED, rate * W0 * SPEED / w**2, w))
    runs = loaded([*campaign(), wild], VALUES)
    entry = derive(runs).quality["screening"]["yaw-wild"]
    assert entry["verdict"] == verdict
    # The stern is half a length aft of the origin, and the sway there is r L / 2.
    angle = math.degrees(math.atan(0.5 * rate))
    assert entry["tests"]["local drift"]["value"] == pytest.approx(angle, rel=0.02)
    if verdict == "down-weighted":
        assert entry["trust"] == pytest.approx((20.0 / angle) ** 2, rel=0.05)


def test_a_kind_that_contradicts_all_others_is_not_thrown_out_whole():
    runs = runs_of()
    runs = [replace(run, loads=1.8 * run.loads) if run.kind == "sway" else run for run in runs]
    found = verdicts(runs)
    gone = [name for name, verdict in found.items() if verdict == "rejected" and name.startswith("sway")]
    kept = [name for name, verdict in found.items() if verdict != "rejected" and name.startswith("sway")]
    assert len(gone) <= len(kept)
    assert all(found[name] == "down-weighted" for name in kept)


def test_exploratory_runs_are_recorded_and_not_fitted():
    runs = [replace(run, exploratory=run.name == "sway-more-0") for run in runs_of()]
    found = derive(runs)
    assert found.quality["screening"]["sway-more-0"] == {
        "verdict": "exploratory", "trust": 0.0, "why": "exploratory: recorded, never fitted", "tests": {}
    }  # fmt: skip
    assert "sway-more-0" not in {run for rests in found.runs.values() for run in rests}


def test_the_order_of_the_runs_does_not_matter():
    runs = changed(runs_of(noise=0.01), "sway-more-2", lambda run: 1.25 * run.loads)
    order = np.random.default_rng(0).permutation(len(runs))
    one, other = derive(runs), derive([runs[i] for i in order])
    assert {n: e["verdict"] for n, e in one.quality["screening"].items()} == {
        n: e["verdict"] for n, e in other.quality["screening"].items()
    }
    # The same sums in another order, of a problem of condition 100.
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9)


def test_trust_falls_with_the_square_of_the_worst_ratio_and_influence_alone_rejects_nobody():
    tests = {"lack of fit": Tested(0.2), "local drift": Tested(25.0), "influence": Tested(2.0)}
    verdict = verdict_of(tests)
    assert verdict.verdict == "down-weighted"
    assert verdict.trust == pytest.approx(0.25)
    alone = verdict_of({"influence": Tested(50.0)})
    assert alone.verdict == "down-weighted"
    assert alone.trust == pytest.approx((LIMITS["influence"].weigh / 50.0) ** 2)


def test_noise_is_taken_out_of_a_value_in_the_mean_square():
    assert Tested(0.5, 0.3).excess == pytest.approx(0.4)
    assert Tested(0.2, 0.3).excess == 0.0
    assert SAMPLES >= 16  # of the third harmonic, which these tests rest on
