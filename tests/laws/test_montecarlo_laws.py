"""Laws of Monte Carlo: no uncertainty, no spread; small spreads scale; probabilities as in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist

import model_cases
import numpy as np
import pytest

from towtank.craft.library import read_craft
from towtank.derive.derive import derive
from towtank.engine.clock import clock_of
from towtank.engine.plan import Ended
from towtank.errors import InputError, TowtankError
from towtank.figures.montecarlo import channel_fan
from towtank.model.equations import Model
from towtank.montecarlo import study as study_module
from towtank.montecarlo.craft import read_population
from towtank.montecarlo.draw import Tolerances, draw, tolerances
from towtank.montecarlo.files import read_mc, std_of, write_mc, write_std
from towtank.montecarlo.fly import Piece, Study, drawn_clock, fly_drawn, fly_piece, gathered, pieces, record
from towtank.montecarlo.result import MonteCarlo
from towtank.montecarlo.study import monte_carlo, study_of
from towtank.plan.standard import standard_plan
from towtank.progress import Silent
from towtank.report.blocks import Picture, Table
from towtank.report.of_montecarlo import uncertainty
from towtank.report.pictures import Sketchbook
from towtank.report.study import gather
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.circle import circle_ready
from towtank.trials.files import write_index
from towtank.trials.ready import Ready, run_trial
from towtank.trials.start import ballasted
from towtank.trials.straight import straight_ready
from towtank.trials.zigzag import zigzag_ready
from towtank.verdict.criteria import plane_criteria
from towtank.verdict.flights import sound_readings
from towtank.verdict.spread import quantiles, spread_of, wilson


@pytest.fixture(scope="module")
def hokie() -> Model:
    craft = read_craft("hokie")
    return Model(craft, derive(tow(standard_plan(craft), FastTank())))


def with_covariance(model: Model, covariance: np.ndarray, **changes) -> Model:
    none = np.zeros_like(covariance)
    d = replace(
        model.derivatives, covariance_fit=covariance, covariance_mesh=none, covariance_model=none, **changes
    )  # fmt: skip
    return replace(model, derivatives=d)


def certain(model: Model) -> Model:
    return with_covariance(model, np.zeros_like(model.derivatives.covariance), origin_std={})


def one_uncertain(model: Model, name: str, std: float, **changes) -> Model:
    covariance = np.zeros_like(model.derivatives.covariance)
    i = model.derivatives.names.index(name)
    covariance[i, i] = std**2
    return with_covariance(model, covariance, **changes)


def nothing(model: Model) -> tuple[tuple[Model, Ready], ...]:
    """No trial: stability alone."""
    return ()


def circle(model: Model) -> tuple[tuple[Model, Ready], ...]:
    """An open-loop turning circle of the neutral craft, no fin moving but for the rudder order."""
    neutral = ballasted(model)
    return ((neutral, circle_ready(neutral, hold_depth=False)),)


def several(model: Model) -> tuple[tuple[Model, Ready], ...]:
    """Straight run as loaded, circle and zigzag of the neutral craft with the depth held."""
    neutral = ballasted(model)
    ready = (circle_ready(neutral), zigzag_ready(neutral, "10 deg", "10 deg"))
    return ((model, straight_ready(model)), *((neutral, trial) for trial in ready))


def values(it: MonteCarlo) -> dict[tuple[str, str], tuple[float, ...]]:
    return {
        (name, key): (s.best, s.mean, s.std, *s.quantiles, s.share)
        for name, trial in it.trials.items()
        for key, s in trial.indices.items()
    }


def test_without_uncertainty_every_craft_is_the_best_estimate_and_flies_as_it_does_alone(hokie: Model):
    sure = certain(hokie)
    found = monte_carlo(sure, 9, trials=several)
    for model, trial in several(sure):
        alone = run_trial(model, trial)
        for name, s in found.trials[trial.name].indices.items():
            value = alone.indices[name][0]
            # 1e-9: packs take their own sines, one trajectory the C library's; they differ in the last digits only.
            np.testing.assert_allclose(s.best, value, rtol=1e-9, atol=1e-9, err_msg=name)
            if s.share:
                # Drawn craft take longer steps: what that changes has a law of its own below.
                np.testing.assert_allclose([s.mean, *s.quantiles], value, rtol=2e-3, atol=2e-3, err_msg=name)
                assert s.std <= 1e-9 * max(abs(value), 1.0)
            assert s.drivers == ()
    for plane in found.planes.values():
        assert plane.probability == float(plane.growth.best < 0.0)


def test_longer_steps_of_drawn_craft_are_small_beside_the_spread(hokie: Model):
    drawn = draw(hokie, 40, seed=8)
    for model, trial in several(hokie):
        clock = drawn_clock(model, trial.setting.speed)
        assert clock.steps < clock_of(model, trial.setting.speed).steps
        few, all_ = (
            sound_readings(model, trial, fly_drawn(model, trial, drawn, kept=record(model, trial, False), clock=c))
            for c in (clock, None)
        )
        for name, (values, _) in all_.items():
            spread = np.nanstd(values[1:])
            if spread > 1e-5 * np.nanmax(np.abs(values)):  # else it is round-off, as the roll of a craft held upright
                error = np.abs(few[name][0] - values)
                np.testing.assert_array_equal(np.isnan(error), np.isnan(values))
                assert np.nanmax(error) < 0.05 * spread, name


def test_fins_without_a_slow_lag_keep_their_steps(hokie: Model):
    quick = replace(hokie.craft.fins[0], time_constant=0.04)
    craft = replace(hokie.craft, fins=(quick, *hokie.craft.fins[1:]))
    # A step of half a lag, 0.02 s of the period's 0.1 s.
    assert drawn_clock(replace(hokie, craft=craft), 1.0).steps == 5


def test_a_small_spread_scales_with_the_covariance(hokie: Model):
    covariance = hokie.derivatives.covariance
    one, two = (monte_carlo(with_covariance(hokie, s**2 * covariance), 64, trials=circle) for s in (0.01, 0.02))
    for name in ("advance", "tactical_diameter", "steady_diameter", "yaw_rate", "time_to_180", "speed_loss"):
        a, b = (it.trials["turning-15deg"].indices[name] for it in (one, two))
        # The same draws, twice as far out: what departs from 2 is the curvature of the index.
        assert b.std / a.std == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("plane", ["horizontal", "vertical"])
def test_stability_agrees_with_the_verdict(hokie: Model, plane: str):
    found, count = monte_carlo(hokie, 4000, trials=nothing).planes[plane], 4000
    known = plane_criteria(hokie, plane, hokie.craft.speed)
    p = known.probability
    # Four standard errors of the difference of two independent samples; the verdict draws 2000.
    assert found.probability == pytest.approx(p, abs=4.0 * math.sqrt(p * (1.0 - p) * (1 / count + 1 / 2000)) + 1e-3)
    assert found.index.best == pytest.approx(known.index, rel=1e-9)
    assert found.growth.best == pytest.approx(max(s.real for s in known.eigenvalues), rel=1e-9)
    assert found.index.quantiles[2] == pytest.approx(known.index, abs=0.1 * known.index_std)


def test_with_one_uncertain_slope_the_probability_is_that_of_a_normal():
    base = model_cases.model()
    d, body = base.derivatives, base.constants.body
    # Stable where Yuv (Nur - m xG) > Nuv (Yur - m); CG on the axis, so that roll does not enter.
    border = d["Yuv"] * (d["Nur"] - body.m * body.xG) / (d["Yur"] - body.m)
    std = 0.7 * abs(border - d["Nuv"])
    found = monte_carlo(one_uncertain(base, "Nuv", std), 40_000, trials=nothing, size=40_000).planes["horizontal"]
    below = NormalDist(d["Nuv"], std).cdf(border)
    expected = below if d["Yur"] - body.m > 0.0 else 1.0 - below
    assert 0.02 < expected < 0.98
    assert found.probability == pytest.approx(expected, abs=4.0 * math.sqrt(expected * (1.0 - expected) / 40_000))
    low, high = found.interval
    assert low < found.probability < high
    # G = 1 - Nuv (Yur - m) / (Yuv (Nur - m xG)) is monotonous in Nuv.
    sense = -np.sign((d["Yur"] - body.m) / (d["Yuv"] * (d["Nur"] - body.m * body.xG)))
    assert found.index.drivers == (("Nuv", pytest.approx(sense)),)


def test_a_current_carries_the_track_and_changes_no_motion_through_the_water(hokie: Model):
    sure = certain(hokie)
    ((model, trial),) = circle(sure)
    drawn = draw(sure, 6, Tolerances(current=0.2), seed=3)
    flights = fly_drawn(model, trial, drawn)
    assert (flights.ended == Ended.DONE).all()
    assert np.ptp(drawn.columns["current_north"]) > 0.1
    for leg in ("to 90 deg", "to 360 deg", "to 540 deg"):
        time = flights.when(leg)
        np.testing.assert_allclose(time, time[0], rtol=1e-9)
        for way, axis in (("current_north", "x"), ("current_east", "y")):
            drift = flights.at(leg, axis) - flights.at(leg, axis)[0]
            np.testing.assert_allclose(drift, drawn.columns[way] * time[0], atol=1e-6)
        for channel in ("p", "q", "r", "theta", "phi", "ahead"):
            np.testing.assert_allclose(flights.at(leg, channel), flights.at(leg, channel)[0], atol=1e-9)
    found = monte_carlo(sure, 6, given=Tolerances(current=0.2), seed=3, trials=circle).trials["turning-15deg"].indices
    for name in ("time_to_90", "time_to_360", "yaw_rate", "roll_in_turn", "duration", "largest_pitch"):
        assert found[name].std <= 1e-8 * max(abs(found[name].best), 1.0)
    assert found["advance"].std > 1.0
    assert {name for name, _ in found["advance"].drivers} <= {"current_north", "current_east"}


def test_a_heavier_craft_that_was_ballasted_stays_neutral(hokie: Model):
    sure, given = certain(hokie), Tolerances(mass=0.02)

    def straight(model: Model) -> tuple[tuple[Model, Ready], ...]:
        neutral = ballasted(model)
        return ((neutral, straight_ready(neutral, disturbance="0 deg")),)

    neutral = monte_carlo(sure, 8, given=given, trials=straight).trials["straight"].indices["depth_change"]
    loaded = monte_carlo(sure, 8, given=given, trials=lambda m: ((m, straight_ready(m)),)).trials["straight"]
    assert neutral.std < 1e-6
    assert loaded.indices["depth_change"].std > 0.1


def test_one_uncertain_derivative_is_named_as_what_drives_an_index(hokie: Model):
    std = 0.02 * abs(hokie.derivatives["Yuudr"])
    found = monte_carlo(one_uncertain(hokie, "Nuudr", std), 40, trials=circle).trials["turning-15deg"]
    assert [name for name, _ in found.indices["yaw_rate"].drivers] == ["Nuudr"]
    assert abs(found.indices["yaw_rate"].drivers[0][1]) > 0.99


def test_pieces_give_the_same_numbers_in_any_order(hokie: Model):
    study = study_of(hokie, Tolerances(0.01), 7, several, Silent())
    parts = pieces(20, 8)
    assert [part.count for part in parts] == [8, 8, 4]
    forth = gathered({i: fly_piece(study, parts[i]) for i in (0, 1, 2)})
    back = gathered({i: fly_piece(study, parts[i]) for i in (2, 1, 0)})
    for name, trial in forth["trials"].items():
        assert trial["ended"] == back["trials"][name]["ended"]
        for key, (array, _) in trial["indices"].items():
            np.testing.assert_array_equal(array, back["trials"][name]["indices"][key][0])
            assert len(array) == 21


def test_draws_do_not_depend_on_tolerances_that_are_zero_or_on_other_pieces(hokie: Model):
    plain, wide = (draw(hokie, 5, given, seed=1, piece=2).columns for given in (Tolerances(), Tolerances(0.05)))
    for name in hokie.derivatives.names:
        np.testing.assert_array_equal(plain[name], wide[name])
    assert np.ptp(plain["m"]) == 0.0
    assert np.ptp(wide["m"]) > 0.0
    other = draw(hokie, 5, Tolerances(), seed=1, piece=3).columns
    assert not np.isclose(plain["Yuv"], other["Yuv"]).any()


def test_a_ledger_and_processes_change_no_number_and_asking_again_flies_nothing(
    hokie: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    options = {"given": Tolerances(0.01), "trials": circle, "size": 8}
    here = monte_carlo(hokie, 20, **options)
    there = monte_carlo(hokie, 20, ledger=tmp_path, workers=2, **options)
    assert values(there) == values(here)
    stamps = {path: path.stat().st_mtime_ns for path in tmp_path.glob("hokie-*.json")}
    assert len(stamps) == 3
    monkeypatch.setattr(study_module, "fly_piece", None)  # anything started would raise
    again = monte_carlo(hokie, 20, ledger=tmp_path, **options)
    assert values(again) == values(here)
    assert str(again) == str(here)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("hokie-*.json")} == stamps


def test_workers_of_a_cluster_give_the_same_numbers(hokie: Model, tmp_path: Path):
    from distributed import LocalCluster

    options = {"trials": circle, "size": 8}
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        there = monte_carlo(hokie, 16, ledger=tmp_path, where=cluster.scheduler_address, **options)
    assert values(there) == values(monte_carlo(hokie, 16, **options))


def test_another_craft_pilot_or_program_has_other_pieces(hokie: Model):
    keys = {
        study_of(model, given, seed, recipe, Silent(), program).key
        for model, given, seed, recipe, program in (
            (hokie, Tolerances(), 1, circle, "a"), (hokie, Tolerances(), 1, circle, "b"),
            (hokie, Tolerances(), 2, circle, "a"), (hokie, Tolerances(0.01), 1, circle, "a"),
            (hokie, Tolerances(), 1, several, "a"), (certain(hokie), Tolerances(), 1, circle, "a"),
        )
    }  # fmt: skip
    assert len(keys) == 6


def test_an_interruption_keeps_the_finished_pieces(hokie: Model, monkeypatch: pytest.MonkeyPatch):
    def stopping(study: Study, piece: Piece) -> dict:
        if piece.number == 2:
            raise KeyboardInterrupt
        return fly_piece(study, piece)

    monkeypatch.setattr(study_module, "fly_piece", stopping)
    found = monte_carlo(hokie, 40, trials=circle, size=8)
    assert (found.done, found.samples, found.complete) == (16, 40, False)
    assert "stopped, 40 were asked for" in str(found)
    monkeypatch.setattr(study_module, "fly_piece", lambda study, piece: stopping(study, replace(piece, number=2)))
    with pytest.raises(TowtankError, match="stopped before the first of 5 pieces"):
        monte_carlo(hokie, 40, trials=circle, size=8)


def test_files_come_back_and_the_index_of_the_trials_gets_its_uncertainty(hokie: Model, tmp_path: Path):
    found = monte_carlo(hokie, 40, trials=circle)
    names = [path.name for path in write_mc(found, tmp_path)]
    assert names == ["mc.json", "turning-15deg.nc", "population.nc"]
    back = read_mc(tmp_path)
    craft = read_population(tmp_path, hokie)
    for name, column in found.population.craft.columns.items():
        if np.ptp(column) > 0.0:
            np.testing.assert_array_equal(craft.craft.columns[name], column)
    for name, (numbers, unit) in found.population.trials["turning-15deg"].indices.items():
        np.testing.assert_array_equal(craft.trials["turning-15deg"].indices[name][0], numbers)
        assert craft.trials["turning-15deg"].indices[name][1] == unit
    assert values(back) == values(found)
    assert str(back) == str(found)
    for channel, rows in found.bands["turning-15deg"].quantiles.items():
        np.testing.assert_allclose(back.bands["turning-15deg"].quantiles[channel], rows, rtol=1e-6)
    ((model, trial),) = circle(hokie)
    flown = run_trial(model, trial)
    write_index((flown,), tmp_path / "trials")
    written = (tmp_path / "trials" / "turning-15deg.nc").read_bytes()
    write_std(found, tmp_path / "trials")
    text = (tmp_path / "trials" / "index.json").read_text()
    assert f'"std": {found.trials["turning-15deg"].indices["advance"].std!r}' in text
    assert (tmp_path / "trials" / "turning-15deg.nc").read_bytes() == written
    assert std_of(found, {"turning-15deg": {"advance": 2.0 * flown.indices["advance"][0]}})["turning-15deg"] == {}


def test_bands_hold_the_best_estimate_and_end_while_most_are_under_way(hokie: Model):
    bands = monte_carlo(hokie, 60, trials=circle).bands["turning-15deg"]
    assert (bands.under_way > 0.9 - 1e-6).all()
    assert (np.diff(bands.quantiles["psi"], axis=0) >= 0.0).all()
    inside = (bands.quantiles["psi"][0] <= bands.best["psi"]) & (bands.best["psi"] <= bands.quantiles["psi"][-1])
    assert inside.mean() > 0.9
    assert bands.tracks["x"].shape == (40, len(bands.time))


def test_the_page_shows_the_bands_and_every_index(hokie: Model):
    found = monte_carlo(hokie, 40, trials=several)
    section = uncertainty(gather([hokie, found]), Sketchbook("t"))
    pictures = [block for block in section.blocks if isinstance(block, Picture)]
    tables = [block for block in section.blocks if isinstance(block, Table)]
    assert len(pictures) == 2
    shown = {(row[0], row[1].replace(" ", "_")) for row in tables[0].rows}
    own = {(t.name, n) for t in found.trials.values() for n in t.indices if n not in found.common}
    assert own - shown == {(t, n) for t, n in own if n.endswith("_lengths")}
    assert section.blocks[1].words.count(str(found.planes["horizontal"])) == 1
    ax = channel_fan(found, "zigzag-10-10", "psi")
    drawn = next(line for line in ax.lines if line.get_label() == "best estimate").get_ydata()
    np.testing.assert_allclose(drawn, np.degrees(found.bands["zigzag-10-10"].best["psi"]))
    empty = uncertainty(gather([hokie]), Sketchbook("u"))
    assert "towtank mc" in empty.blocks[0].words


def test_an_added_mass_that_may_be_negative_is_drawn_again_and_a_wild_one_refused(hokie: Model):
    d, body = hokie.derivatives, hokie.constants.body
    total = body.m - d["Yvdot"]
    drawn = draw(one_uncertain(hokie, "Yvdot", 0.6 * total), 400, seed=5).columns["Yvdot"]
    assert len(drawn) == 401
    assert (body.m - drawn > 0.0).all()
    with pytest.raises(InputError, match="no positive mass matrix"):
        draw(one_uncertain(hokie, "Yvdot", 5.0 * total), 400, seed=5)


def test_heavy_tails_are_told_and_their_width_is_that_of_the_middle():
    random = np.random.default_rng(4)
    normal = spread_of(np.concatenate([[0.0], random.normal(size=4000)]), "m")
    wild = spread_of(np.concatenate([[0.0], random.standard_cauchy(size=4000)]), "m")
    assert not normal.heavy
    assert normal.std == pytest.approx(1.0, abs=0.05)
    assert wild.heavy
    # Half the 16-84 % range of a Cauchy variable: tan(0.3413 pi).
    assert wild.std == pytest.approx(math.tan(0.3413 * math.pi), rel=0.1)


def test_an_index_that_few_craft_have_states_no_uncertainty():
    few = np.array([1.0, 1.0, 2.0, np.nan, np.nan, np.nan, np.nan])
    assert spread_of(few, "s").share == pytest.approx(1 / 3)
    assert spread_of(few, "s").uncertainty is None
    assert spread_of(np.full(5, np.nan), "s").uncertainty is None


def test_quantiles_are_those_of_what_is_there():
    random = np.random.default_rng(1)
    table = random.normal(size=(50, 7))
    table[random.random(table.shape) < 0.3] = np.nan
    np.testing.assert_allclose(quantiles(table), np.nanquantile(table, (0.05, 0.25, 0.5, 0.75, 0.95), axis=0))


def test_the_interval_of_a_probability_is_wilsons():
    # Newcombe 1998, table I: 81 of 263 gives 0.2553 to 0.3662, 0 of 20 gives 0 to 0.1611.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: monte_carlo(m, 0, trials=nothing), "whole number from 1"),
        (lambda m: monte_carlo(m, 10.5, trials=nothing), "whole number"),
        (lambda m: monte_carlo(m, 10, size=0, trials=nothing), "size 0"),
        (lambda m: monte_carlo(m, 10, seed=-1, trials=nothing), "seed -1"),
        (lambda m: monte_carlo(m, 10, where="slurm", trials=nothing), "Give ledger"),
        (lambda m: Tolerances(mass=-0.01), "zero or more"),
        (lambda m: Tolerances(cg=(0.0, math.nan, 0.0)), "tolerance of cg"),
        (lambda m: Tolerances(cg=(0.0, 0.0)), "Give three"),
        (lambda m: Tolerances(mass=0.5), "beyond 20 %"),
        (lambda m: tolerances("1 kg"), "mass tolerance"),
        (lambda m: draw(m, 0), "Ask for one or more"),
    ],
)
def test_senseless_studies_are_refused(hokie: Model, call, words: str):
    with pytest.raises(InputError, match=words):
        call(hokie)


def test_tolerances_are_read_with_units():
    given = tolerances("1 %", "5 mm", "0.1 knot")
    assert (given.mass, given.cg) == (0.01, (0.005, 0.005, 0.005))
    assert given.current == pytest.approx(0.1 * 1852.0 / 3600.0)
    assert str(tolerances("1 %", "5 mm")) == "derivatives, mass 1 %, CG 5 mm"
