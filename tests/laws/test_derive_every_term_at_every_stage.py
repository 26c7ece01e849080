"""Every term of the model, for every symmetry of a craft: put into the tank of known values, found after each stage.

Plan, tank, files on disk, fit, another reference point and back, ``derivatives.json`` and back. The standard plan
excites one motion at a time; runs that combine all six velocities give what only products excite, such as Xwq.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from towtank.craft.library import read_craft
from towtank.derive.convert import about_point
from towtank.derive.derive import derive
from towtank.derive.files import read_derivatives, write_derivatives
from towtank.derive.robust import huber
from towtank.derive.select import GATED, allowed
from towtank.plan.history import History
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Sway
from towtank.plan.standard import standard_plan
from towtank.symbols import FOURFOLD_TIES, LOADS, RATES, TERMS
from towtank.tank.campaign import tow
from towtank.tank.files import read_run, run_path
from towtank.tank.lpm import LpmTank

PLUS = read_craft("suboff-fins")
SYMMETRIES = ("fourfold", "mirror", "port-starboard", "none")
SAMPLES = 16
"""Samples in a period, the least that the method takes."""

# Round-off of 4000 samples through a QR of condition 100 stays below 1e-11 of the largest terms; small ones stand
# beside loads a thousand times their own.
EXACT = 1e-8


@dataclass(frozen=True)
class Combined:
    """All six velocities at once, each with two harmonics of its own phase. Path and attitude stay at zero."""

    speed: float
    length: float
    seed: int = 0
    kind = "combined"

    @property
    def period(self) -> float:
        return 2.0 * math.pi * self.length / (1.2 * self.speed)

    def history(self, time):
        rng = np.random.default_rng(self.seed)
        size = np.array([0.1, 0.12, 0.12, 0.2, 0.2, 0.2]) * self.speed
        size[3:] /= self.length
        nu, nudot = np.zeros((len(time), 6)), np.zeros((len(time), 6))
        for harmonic in (1, 2):
            w, phase = harmonic * 2.0 * math.pi / self.period, rng.uniform(0.0, 2.0 * math.pi, 6)
            nu += size * np.sin(np.outer(w * time, np.ones(6)) + phase)
            nudot += size * w * np.cos(np.outer(w * time, np.ones(6)) + phase)
        nu[:, 0] += self.speed
        return History(time, np.zeros((len(time), 3)), np.zeros((len(time), 3)), nu, nudot)


def craft_of(symmetry):
    """SUBOFF with fins changed until no more than ``symmetry`` is left."""
    level, port, upper = 0, 2, 3
    larger = {"fourfold": (), "mirror": (level, port), "port-starboard": (upper,), "none": (upper, port)}[symmetry]
    fins = tuple(replace(f, tip_radius=1.2 * f.tip_radius) if i in larger else f for i, f in enumerate(PLUS.fins))
    craft = replace(PLUS, fins=fins)
    assert craft.symmetry == symmetry
    return craft


def known_set(craft, seed):
    """Primes of 0.3 to 1 % with either sign, M_A symmetric, and the ties of the craft's symmetry."""
    rng = np.random.default_rng(seed)
    names = [n for n in allowed(craft.symmetry) if n not in GATED or craft.symmetry in ("port-starboard", "none")]
    unit = {n: TERMS[n].prime_factor(craft.water.density, craft.length, craft.speed) for n in names}
    values = {n: float(unit[n] * rng.uniform(3e-3, 1e-2) * rng.choice([-1.0, 1.0])) for n in names}
    for i, load in enumerate(LOADS):
        for j, rate in enumerate(RATES[:i]):
            a, b = f"{load}{rate}dot", f"{LOADS[j]}{RATES[i]}dot"
            if a in values:
                values[a] = values[b]
    ties = FOURFOLD_TIES if craft.symmetry == "fourfold" else {}
    return values | {name: sign * values[base] for name, (base, sign) in ties.items()}


def plan_of(craft):
    plan = standard_plan(craft, samples=SAMPLES)
    extra = tuple(
        CaptiveTest(f"combined-{seed}", plan.speed, Combined(plan.speed, craft.length, seed), samples=SAMPLES)
        for seed in (0, 1)
    )
    return replace(plan, tests=(*(test for test in plan.tests if not test.exploratory), *extra))


def assert_same(found, values, rel=EXACT):
    assert set(found.names) == set(values)
    for name, value in values.items():
        assert found[name] == pytest.approx(value, rel=rel), name


@pytest.fixture(scope="module", params=SYMMETRIES)
def case(request, tmp_path_factory):
    """Craft, its true values, and what the files of its runs give."""
    craft, folder = craft_of(request.param), tmp_path_factory.mktemp(request.param)
    values = known_set(craft, seed=SYMMETRIES.index(request.param))
    runs = tow(plan_of(craft), LpmTank(values), out=folder)
    return craft, values, derive([read_run(run_path(folder, run.id)) for run in runs])


def test_every_term_comes_back_from_the_files_of_the_runs(case):
    craft, values, found = case
    assert_same(found, values)
    assert not found.rejected
    assert not found.quality["not_excited"]
    # 36 entries of M_A without symmetry, 18 with port and starboard alike, 10 with both planes.
    entries = {"fourfold": 10, "mirror": 10, "port-starboard": 18, "none": 36}[craft.symmetry]
    assert sum(TERMS[name].is_added_mass for name in found.names) == entries


def test_another_point_and_back_leaves_every_term_as_it_was(case):
    craft, values, found = case
    there = about_point(found, from_nose=0.3 * craft.length, length=1.1 * craft.length)
    assert abs(there["Nuv"] / found["Nuv"] - 1.0) > 0.01
    back = about_point(there, from_nose=found.reference.origin_from_nose, length=craft.length)
    zeros = {name: 0.0 for name in set(back.names) - set(values)}
    for name, value in (values | zeros).items():
        size = TERMS[name].prime_factor(craft.water.density, craft.length, craft.speed) * 1e-2
        assert back[name] == pytest.approx(value, rel=EXACT, abs=EXACT * size), name


def test_every_term_and_its_covariance_come_back_from_the_file_of_derivatives(case, tmp_path):
    _, values, found = case
    again = read_derivatives(write_derivatives(found, tmp_path / "derivatives.json"))
    assert again.names == found.names
    np.testing.assert_array_equal(again.values, found.values)
    np.testing.assert_array_equal(again.covariance, found.covariance)
    assert again.runs == found.runs
    assert_same(again, values)


def test_noise_moves_every_term_by_no_more_than_its_interval_allows(case):
    craft, values, _ = case
    found = derive(tow(plan_of(craft), LpmTank(values, noise=0.02, seed=1)))
    # A roll term within its noise is left out, as the gate says; all others are there.
    assert set(values) - set(found.names) <= set(GATED)
    std = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    pulls = np.array([(found[n] - values[n]) / std[n] for n in found.names])
    # 25 to 79 pulls: one beyond 4 has a chance of 1 in 200, and 87 % within 1.96 is four binomial spreads off at most.
    assert np.abs(pulls).max() < 4.0
    assert np.mean(np.abs(pulls) < 1.96) > 0.87


def violent(run, strength=0.6):
    """The loads of another law: a cross-flow of half a length ago, as strong as ``strength`` of the load."""
    lag = 0.5 * run.length / run.speed
    step = run.history.time[1] - run.history.time[0]
    v = np.roll(run.history.nu[:, 1], round(lag / step))
    extra = np.zeros_like(run.loads)
    for load, sign in ((1, -1.0), (5, 1.0)):
        extra[:, load] = sign * strength * np.abs(run.loads[:, load]).max() * v * np.abs(v) / np.abs(v).max() ** 2
    return replace(run, loads=run.loads + extra)


@pytest.mark.parametrize("symmetry", ["fourfold", "none"])
def test_a_violent_run_is_found_and_named_and_does_not_move_the_answer(symmetry):
    craft = craft_of(symmetry)
    values = known_set(craft, seed=0)
    runs = tow(plan_of(craft), LpmTank(values, noise=0.02, seed=5))
    name = next(run.name for run in runs if run.kind == "sway" and "v0.28-w2" in run.name)
    planted = [violent(run) if run.name == name else run for run in runs]
    found, clean, blind = derive(planted), derive(runs), derive(planted, screening=False)
    assert [run for run, _ in found.rejected] == [name]
    assert "lack of fit" in dict(found.rejected)[name]
    assert found.quality["screening"][name]["verdict"] == "rejected"
    others = {run: item["verdict"] for run, item in found.quality["screening"].items() if run != name}
    assert "rejected" not in others.values()
    for term in ("Yvv", "Nvv"):
        std = math.sqrt(clean.covariance[clean.names.index(term), clean.names.index(term)])
        assert abs(found[term] - values[term]) < 4.0 * std
    assert name not in {run for rests in found.runs.values() for run in rests}
    assert name in {run for rests in blind.runs.values() for run in rests}


def test_a_robust_loss_lowers_the_weight_of_a_violent_run_that_is_not_screened():
    """Runs that a different law made: their residual in the robust fit is theirs alone, not shared by their kind."""
    craft = craft_of("fourfold")
    values = known_set(craft, seed=0)
    runs = tow(plan_of(craft), LpmTank(values, noise=0.02, seed=5))
    planted = [replace(run, loads=1.5 * run.loads) if run.name == "drift-p18" else run for run in runs]
    plain = derive(planted, screening=False)
    robust = derive(planted, screening=False, loss=huber)
    std = dict(zip(robust.names, np.sqrt(np.diag(robust.covariance)), strict=True))
    for term in ("Yvv", "Nvv"):
        assert abs(robust[term] - values[term]) < 0.5 * abs(plain[term] - values[term]), term
        assert abs(robust[term] - values[term]) < 4.0 * std[term], term


def test_a_run_beyond_the_range_is_named_too():
    craft = craft_of("fourfold")
    values = known_set(craft, seed=0)
    plan = plan_of(craft)
    w = 1.5 * plan.speed / craft.length
    wide = CaptiveTest("sway-wide", plan.speed, Sway(plan.speed, 0.5 * plan.speed / w, w), samples=SAMPLES)
    found = derive([violent(run) if run.name == wide.name else run for run in tow(
        replace(plan, tests=(*plan.tests, wide)), LpmTank(values))])  # fmt: skip
    assert [run for run, _ in found.rejected] == ["sway-wide"]
    assert "26.6 deg" in found.rejected[0][1]  # atan(0.5)
    assert_same(found, values)
