"""A record corrects the coefficients, and says what it cannot tell."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calibrate_cases import STD, hokie, off, records
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.engine.plan import Leg
from towtank.errors import InputError
from towtank.experiments.belief import believe
from towtank.field.calibrate.calibrate import calibrate
from towtank.field.calibrate.fit import Crew, Search, case_of, gathered
from towtank.field.calibrate.normal import cost
from towtank.field.calibrate.score import score
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.shoot import Point, quaternion_slopes
from towtank.field.calibrate.smooth import smooth
from towtank.field.calibrate.unknowns import unknowns, with_errors
from towtank.field.calibrate.windows import windows_of
from towtank.field.log import Flag
from towtank.field.sea import swim, timed
from towtank.field.sea_water import Environment
from towtank.model.dual import DUAL, gradients, variables
from towtank.model.kinematics import quaternion_of
from towtank.trials.start import setting

WATER = Environment(current=(0.1, -0.05, 0.0), turbulence=(0.02, 0.02, 0.01), piece=0.1, seed=3)
TERMS = {"Yuv": 0.2, "Nuv": -0.2, "Yur": 0.2, "Nur": -0.2, "Yuudr": 0.2, "Nuudr": -0.2}
"""Coefficients of the horizontal plane, and the share by which a start is wrong."""


@cache
def swum():
    return tuple(records(hokie(), 300.0, WATER, count=2))


def wrong():
    """hokie with a wrong start that states how wrong it may be."""
    model = hokie()
    return model.with_derivatives(with_errors(off(model.derivatives, TERMS), dict.fromkeys(TERMS, 0.2)))


@cache
def found():
    return calibrate(wrong(), swum()[:1])


def test_slopes_of_the_quaternion_are_those_of_dual_numbers():
    rng = np.random.default_rng(0)
    for angles in rng.uniform(-1.4, 1.4, (5, 3)):
        exact = gradients(quaternion_of(variables(angles), DUAL), 3)
        np.testing.assert_allclose(quaternion_slopes(angles[None])[0], exact, atol=1e-14)


def test_the_slope_of_the_cost_is_that_of_finite_differences():
    model, settings = wrong(), Settings(learn=False)
    free = unknowns(model.derivatives)
    (log,) = records(hokie(), 20.0, WATER)
    case = case_of(windows_of(model, log, settings), free.names, settings)
    crew = Crew(1)
    search = Search([case], free, settings, crew)
    rng = np.random.default_rng(2)
    # Away from the guess, so that every part of the cost has a slope.
    scale = np.array([1.0] * 3 + [0.01] * 3 + [0.02] * 3 + [1e-3] * 3 + [0.01] * 3)
    search.points = [
        Point(p.states + 0.1 * scale * rng.standard_normal(p.states.shape), p.shared * 1.01) for p in search.points
    ]
    search.z = 0.1 * rng.standard_normal(free.size)
    at = search.z.copy(), search.points[0]

    def value(z, point):
        (piece,) = gathered(crew, [case], free, z, [point])
        noise = search.noise[0]
        return float(z @ z) + cost(case.windows, case.links, noise, case.prior, point, piece.end, piece.square), piece

    _, search.pieces[0] = value(*at)
    (it,) = search.equations()
    k = free.size
    for _ in range(4):
        dz = rng.standard_normal(k)
        states, shared = scale * rng.standard_normal(at[1].states.shape), 0.01 * rng.standard_normal(len(at[1].shared))
        step = 1e-5
        ends = [
            value(at[0] + s * dz, Point(at[1].states + s * states, at[1].shared + s * shared))[0] for s in (-step, step)
        ]
        slope = 2.0 * (at[0] @ dz - it.g @ np.concatenate([dz, shared]) - (it.s * states).sum())
        # Central differences: truncation of step^2 and round-off of 1e-16 cost / step, both below 1e-6 of the slope.
        assert (ends[1] - ends[0]) / (2.0 * step) == pytest.approx(slope, rel=2e-5)
    crew.close()


def test_a_record_without_noise_gives_the_coefficients_back():
    (log,) = records(hokie(), 120.0, Environment(current=(0.1, -0.05, 0.0)), noise=0.0)
    still = Settings(learn=False, turbulence=1e-5, push=1e-10, twist=1e-12)
    fine = replace(log, std={name: 1e-3 * std for name, std in STD.items()})
    result = calibrate(wrong(), [fine], settings=still)
    truth = hokie().derivatives
    for move in result.moves:
        # The sensors are a thousandth of the usual, so the prior pulls by some 1e-6 of its error. What is left is the
        # path of the fins between samples where they move as fast as they can, 1e-5 rad/s of the turn: 1e-3.
        assert move.value == pytest.approx(truth[move.name], rel=2e-3)
    shared = result.records[0].shared
    assert shared["current_north"][0] == pytest.approx(0.1, abs=1e-3)
    assert shared["current_east"][0] == pytest.approx(-0.05, abs=1e-3)


def test_the_truth_lies_within_the_intervals_and_they_are_narrower_than_before():
    truth = hokie().derivatives
    pulls = [(m.value - truth[m.name]) / m.std for m in found().moves if not m.slope]
    # Six independent values and their twins: one beyond 3.5 standard deviations has a chance of 3e-3.
    assert np.abs(pulls).max() < 3.5
    assert all(m.left < 0.5 for m in found().moves if not m.slope)


@cache
def all_wrong():
    """hokie with every independent value off by a fifth, either way, and an error that says so."""
    model = hokie()
    tied = believe(model.derivatives).terms
    names = [tied.names[i] for i in tied.first]
    ways = np.random.default_rng(4).choice([-0.2, 0.2], len(names))
    start = with_errors(off(model.derivatives, dict(zip(names, ways, strict=True))), dict.fromkeys(names, 0.2))
    return model.with_derivatives(start)


def test_a_start_that_is_a_fifth_off_foretells_a_record_held_out_half_as_badly_after():
    result = calibrate(all_wrong(), swum()[:1], hold_out=swum()[1:])
    (held,) = result.hold_out
    assert held.before.windows == held.after.windows == 10
    assert held.ratio < 0.5
    assert held.after.rms["psi"] < 0.5 * held.before.rms["psi"]
    # Nobody foresees the eddies: the true coefficients miss about as much.
    exact = score(hokie(), swum()[1])
    assert held.after.total < 1.15 * exact.total


def test_what_a_record_cannot_tell_stays_at_its_prior_and_is_named():
    # In straight and level flight nothing tells the cross-flow drag of a sway.
    model = hokie()
    trial = timed(model, [Leg("ahead", setting(model, None).orders(steer=1.0, dive=1.0), 60.0)])
    flown = swim(model, trial)
    names = [*STD, "delta1", "delta2", "delta3", "delta4", "thrust"]
    rng = np.random.default_rng(5)
    channels = {n: flown.channels[n][0] + STD.get(n, 0.0) * rng.standard_normal(len(flown.time)) for n in names}
    log = replace(swum()[0], name="straight", time=flown.time, channels=channels, bias={})
    prior = model.derivatives
    # Independent priors, so that no coefficient moves with another.
    alone = model.with_derivatives(with_errors(off(prior, {}), {"Yvv": 0.3, "Nrr": 0.3, "Xuu": 0.3}))
    result = calibrate(alone, [log])
    stays = {m.name: m for m in result.moves}
    for name in ("Yvv", "Nrr"):
        assert name in result.untold
        assert stays[name].left == pytest.approx(1.0, abs=0.02)
        assert abs(stays[name].sigmas) < 0.1
    assert any("Not told" in words and "Yvv" in words for words in result.words())


def test_noise_that_is_not_the_stated_one_is_said():
    log = swum()[0]
    loud = replace(log, std={**log.std, "psi": 0.2 * log.std["psi"]})
    result = calibrate(wrong(), [loud], terms=("Nur",))
    assert any("psi" in words and "variance" in words for words in result.warnings)
    for row in found().records[0].channels.values():
        # Each mean square is over 300 samples or more: its own spread is below 0.09. Slip and ahead hold the change of
        # the water within a window besides.
        assert row["chi2"] == pytest.approx(1.0, abs=0.3)


def test_two_records_tell_more_than_one():
    both = calibrate(wrong(), swum())
    one = {m.name: m.std for m in found().moves}
    assert all(m.std < one[m.name] for m in both.moves)


def test_the_current_and_the_biases_of_a_record_are_found():
    told = smooth(hokie(), swum()[0])
    # The eddies are part of the mean over 300 s: 0.02 m/s over the root of 300 s / 40 s.
    assert told.mean_current[0] == pytest.approx(0.1, abs=4.0 * np.hypot(told.mean_current_std[0], 0.008))
    assert told.mean_current[1] == pytest.approx(-0.05, abs=4.0 * np.hypot(told.mean_current_std[1], 0.008))
    assert told.thrust == pytest.approx(1.0, abs=4.0 * told.thrust_std)
    assert set(told.bias) == {"psi", "theta", "phi", "z", "ahead"}
    held = np.isfinite(told.states[:, 0])
    assert held.sum() > 2990
    rest = told.states[held, 11] - swum()[0]["r"][held]
    # The smoothed rate differs from the measured one by the gyro's noise.
    assert rest.std() == pytest.approx(STD["r"], rel=0.1)


def test_a_hole_in_the_fins_parts_the_record_and_flagged_samples_take_no_part():
    log = swum()[0]
    hole = (log.time > 100.0) & (log.time < 110.0)
    cut = {n: np.where(hole, np.nan, v) if n.startswith("delta") else v for n, v in log.channels.items()}
    spoilt = np.where((log.time > 200.0) & (log.time < 201.0), 5.0, log["r"])
    flag = Flag("outlier", "r", 200.1, 200.9, 9, "far from its neighbours")
    bad = replace(log, channels={**cut, "r": spoilt}, flags=(flag,))
    it = windows_of(hokie(), bad, Settings())
    assert (~it.linked).sum() == 2
    assert it.left_out == 9
    result = calibrate(wrong(), [bad])
    truth = hokie().derivatives
    assert max(abs(m.value - truth[m.name]) / m.std for m in result.moves) < 4.0


def test_the_new_set_is_one_of_both_levels_and_the_same_after_the_disk(tmp_path):
    new = found().derivatives
    assert new.level == "semi-empirical + synthetic"
    assert list(new.provenance["inputs"]) == [f"synthetic {swum()[0].name}"]
    back = read_derivatives(write_derivatives(new, tmp_path / "calibrated.json"))
    np.testing.assert_array_equal(back.values, new.values)
    assert back.quality["calibration"]["moves"][0]["name"] == found().moves[0].name
    std = np.sqrt(np.diag(new.covariance))
    for move in found().moves:
        assert std[new.names.index(move.name)] == pytest.approx(move.std, rel=1e-6)
    # No direction has lost what it never had: a covariance, and below the prior's.
    size = np.sqrt(np.diag(found().prior.covariance))
    inside = size > 0.0
    both = [c[np.ix_(inside, inside)] / np.outer(size[inside], size[inside]) for c in
            (new.covariance, found().prior.covariance - new.covariance)]  # fmt: skip
    assert min(np.linalg.eigvalsh(c).min() for c in both) > -1e-9


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"logs": ()}, "no record"),
        ({"terms": ("Ypp",)}, "holds no Ypp"),
        ({"terms": ("Kup",)}, "has an uncertainty"),
        ({"logs": 2}, "same record"),
        ({"craft": "remus100"}, "of another's"),
    ],
)
def test_what_cannot_be_weighed_is_refused(change, said):
    log = replace(swum()[0], craft=change.get("craft", "hokie"))
    logs = [log] * change["logs"] if isinstance(change.get("logs"), int) else change.get("logs", [log])
    with pytest.raises(InputError, match=said):
        calibrate(wrong(), logs, terms=change.get("terms"))


def test_a_record_counts_once():
    with pytest.raises(InputError, match="in the prior already"):
        calibrate(hokie().with_derivatives(found().derivatives), swum()[:1])
