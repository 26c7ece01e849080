"""Laws of what a pilot sees through: late, noisy and offset readings of a craft that moves as it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.library import CHOICE
from towtank.engine.noise import normal
from towtank.engine.plan import Leg, Log
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.errors import InputError
from towtank.pilot.design import design_pilot
from towtank.pilot.files import read_pilot, write_pilot
from towtank.pilot.orders import Orders
from towtank.pilot.sensors import EXACT, TYPICAL, Reading, Sensors

HELD = Orders(piloted=1.0, steer=1.0, dive=1.0)
START = at([0.0] * 6 + [1.0] + [0.0] * 9)


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


@pytest.fixture(scope="module")
def go(craft):
    pilot = design_pilot(craft)

    def run(sensors, lasting=60.0, orders=HELD, **options):
        given = {"thrust": float(craft.thrust(1.0)), "pilot": replace(pilot, sensors=sensors), "log": Log()}
        return fly(craft, START, [Leg("run", orders, lasting)], **(given | options))

    return run


def test_noise_is_normal_white_and_its_own_for_each_trajectory_sensor_and_reading():
    drawn = np.array([[normal(7, 400, sensor, reading) for reading in range(25)] for sensor in range(4)])
    assert drawn.mean() == pytest.approx(0.0, abs=4.0 / np.sqrt(drawn.size))
    assert drawn.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * drawn.size))
    assert (drawn**4).mean() == pytest.approx(3.0, abs=4.0 * np.sqrt(96.0 / drawn.size))
    flat = drawn.reshape(100, 400)
    among = np.corrcoef(flat) - np.eye(100)
    assert np.abs(among).max() < 5.0 / np.sqrt(400)
    assert np.abs(np.corrcoef(flat.T) - np.eye(400)).max() < 6.0 / np.sqrt(100)
    assert not np.array_equal(normal(7, 3, 0, 1), normal(8, 3, 0, 1))


def test_an_exact_pilot_and_one_read_in_every_period_without_noise_fly_alike(go):
    turn = replace(HELD, heading=0.5)
    plain = go(EXACT, orders=turn)
    same = go(Sensors(compass=Reading(1e-9), log=Reading(0.1)), orders=turn)
    np.testing.assert_array_equal(plain.log, same.log)


def test_an_offset_of_the_compass_is_the_heading_that_is_missed(go):
    offsets = []
    for seed in range(3):
        done = go(Sensors(compass=Reading(bias=0.05)), lasting=600.0, seed=seed)
        offsets.append(float(normal(seed, 1, 5, 0)[0]) * 0.05)  # psi is the sixth of what is seen
        assert done.series("psi")[0, -1] == pytest.approx(-offsets[-1], abs=2e-4)
    assert max(map(abs, offsets)) > 0.01


def test_noise_moves_the_fins_in_proportion_and_not_the_mean(go):
    small, large = (go(Sensors(gyro=Reading(std=std)), lasting=400.0) for std in (1e-4, 2e-4))
    rms = [float(np.std(done.series("rudder")[0, 100:])) for done in (small, large)]
    assert rms[0] > 0.0
    assert rms[1] == pytest.approx(2.0 * rms[0], rel=0.01)  # a linear loop: nothing is at a limit
    assert abs(np.mean(large.series("rudder")[0, 100:])) < 0.1 * rms[1]


def test_a_slow_compass_is_held_between_its_readings(go):
    done = go(Sensors(compass=Reading(1.0)), lasting=20.0, orders=replace(HELD, heading=0.1))
    # Feedback of the rate is fast; the part of the heading jumps once a second.
    assert np.isfinite(done.log).all()
    plain = go(EXACT, lasting=20.0, orders=replace(HELD, heading=0.1))
    assert np.abs(done.series("psi") - plain.series("psi")).max() > 1e-4


def test_the_noise_does_not_depend_on_packs_threads_or_the_way_it_is_computed(go, monkeypatch):
    same = Ensemble(5, {"Yuv": np.full(5, -300.0)})
    packs = go(TYPICAL, lasting=10.0, ensemble=same, seed=3)
    one = go(TYPICAL, lasting=10.0, ensemble=same, seed=3, threads=1)
    np.testing.assert_array_equal(packs.log, one.log)
    assert len({float(x) for x in packs.series("psi")[:, -1]}) == 5
    monkeypatch.setenv(CHOICE, "numpy")
    other = go(TYPICAL, lasting=10.0, ensemble=same, seed=3)
    # Logarithm and cosine of numpy and of the C library differ by an ulp.
    np.testing.assert_allclose(other.log, packs.log, rtol=1e-9, atol=1e-11)


def test_sensors_come_back_from_the_pilots_file(craft, tmp_path):
    pilot = replace(design_pilot(craft), sensors=TYPICAL)
    assert read_pilot(write_pilot(pilot, tmp_path / "pilot.json")) == pilot


@pytest.mark.parametrize("wrong", [{"period": -1.0}, {"std": np.nan}, {"bias": -0.1}])
def test_a_sensor_that_cannot_be_is_refused(wrong):
    with pytest.raises(InputError, match="finite numbers of 0 or more"):
        Reading(**wrong)
