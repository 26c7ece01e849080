"""A craft in a made-up sea swims as in its trial, and feels the water that was asked for."""

from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft
from published_models import remus_model
from towtank.engine.plan import Clock, Leg
from towtank.errors import InputError
from towtank.field.sea import swim, timed
from towtank.field.sea_survey import identification_legs, identification_ready
from towtank.field.sea_trials import trial_called, words_of
from towtank.field.sea_water import Environment, mean_current
from towtank.model.linear import linearise
from towtank.pilot.sensors import TYPICAL
from towtank.trials.ready import run_trial
from towtank.trials.start import setting

POSE = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")


@pytest.fixture(scope="module")
def remus():
    """Published REMUS 100: not stable in yaw."""
    return remus_model()


@pytest.fixture(scope="module")
def steady():
    """A craft of 8 m that is stable in yaw."""
    return synthetic_craft.model(synthetic_craft.STABLE)


def states(swum, one=0):
    return np.stack([swum.channels[name][one] for name in POSE], axis=-1)


PIECES = Environment(shear=(1e-30, 0.0))
"""Still water, but for the program: it is not uniform, so the trial is flown in pieces."""


def same_as_trial(model, ready, water=PIECES):
    """The trial and the swim at the samples of the trial."""
    flown, swum = run_trial(model, ready), swim(model, ready, water)
    at = np.searchsorted(swum.time, flown.time - 1e-6)
    np.testing.assert_allclose(swum.time[at], flown.time, atol=1e-9)
    wanted = np.concatenate([flown.position, flown.attitude, flown.nu], axis=-1)
    # Round-off of the pieces' ends; positions grow to 1 km and an unstable craft magnifies it.
    np.testing.assert_allclose(states(swum)[at], wanted, rtol=1e-9, atol=1e-9)
    # An event that falls on a sample to round-off may be seen in it or not.
    sure = np.abs(flown.time[:, None] - [*swum.marks, np.inf]).min(axis=1) > 1e-9
    command = np.stack([swum.channels[name][0, at] for name in ("rudder", "elevator", "aileron")], axis=-1)
    np.testing.assert_allclose(command[sure], flown.command[sure], atol=1e-9)
    for word, name in (("heading", "heading_order"), ("depth", "depth_order")):
        order = swum.channels.get(name, np.full((1, len(swum.time)), np.nan))[0, at]
        np.testing.assert_allclose(order[sure], flown.setpoint[word][sure], atol=1e-9)
    assert swum.end_time[0] == pytest.approx(flown.indices["duration"][0], abs=1e-8)
    assert len(swum.marks) == len(flown.provenance["marks"])
    return swum


def test_in_still_water_every_standard_trial_is_the_trial_itself(remus):
    for model, ready in words_of(remus).values():
        same_as_trial(model, ready)


def test_in_still_water_fins_with_a_dead_band_and_play_swim_the_trial_itself(steady):
    loose = tuple(replace(fin, dead_band=0.01, backlash=0.005) for fin in steady.craft.fins)
    model = replace(steady, craft=replace(steady.craft, fins=loose))
    for name in ("zigzag 10/10", "depth step"):
        same_as_trial(*words_of(model)[name], Environment())


def test_in_still_water_a_stable_craft_swims_the_trial_itself(steady):
    known = words_of(steady)
    for name in ("turning circle", "zigzag 10/10", "zigzag 10/5 vertical", "meander"):
        same_as_trial(*known[name])


def test_a_leg_that_waits_for_more_than_a_turn_ends_where_the_trial_does(remus, tmp_path):
    path = tmp_path / "turns.toml"
    path.write_text(
        'schema = "towtank/trial/1"\nname = "turns"\nloop = "open"\n[[command]]\nrudder = "-10 deg"\n'
        'until = "|heading| 500 deg"\n[[command]]\nrudder = "10 deg"\nuntil = "heading 100 deg"\n', "utf-8"
    )  # fmt: skip
    swum = same_as_trial(remus, trial_called(remus, str(path)).ready)
    assert np.abs(swum.channels["psi"]).max() > np.radians(500.0) - 1e-6


def test_a_steady_current_carries_the_craft_and_changes_nothing_else(remus):
    ready = trial_called(remus, "zigzag10").ready
    still, carried = swim(remus, ready), swim(remus, ready, Environment(current=(0.2, -0.3, 0.0)))
    assert len(still.time) == len(carried.time)
    drift = carried.time[:, None] * [0.2, -0.3, 0.0]
    # Galilean invariance. Round-off, which a craft that is not stable magnifies.
    np.testing.assert_allclose(states(carried)[:, :3] - drift, states(still)[:, :3], atol=1e-7)
    for name in ("phi", "theta", "psi", "ahead", "slip", "plunge", "p", "q", "r"):
        np.testing.assert_allclose(carried.channels[name], still.channels[name], atol=1e-7)


def test_many_craft_swim_as_each_would_alone(remus):
    legs = identification_legs(remus, 0.5, seed=3)
    ready = timed(remus, legs)
    scale = np.array([0.9, 1.0, 1.1])
    spread = {"Nur": remus.derivatives["Nur"] * scale, "Yvdot": remus.derivatives["Yvdot"] * scale}
    water = Environment(current=(0.1, 0.0, 0.0), turbulence=(0.03, 0.03, 0.01), seed=5)
    many = swim(remus, ready, water, count=3, parameters=spread)
    alone = swim(remus, ready, water, parameters={name: values[:1] for name, values in spread.items()})
    np.testing.assert_array_equal(many.current[0], alone.current[0])
    # Round-off: several craft share the registers of one loop.
    np.testing.assert_allclose(states(many), states(alone), atol=1e-9)
    # A yaw damping 10 % off and eddies of their own tell in seconds.
    assert np.abs(states(many, 1) - states(many, 2)).max() > 1e-3


def test_the_same_seed_makes_the_same_sea_and_another_seed_another(remus):
    ready = identification_ready(remus, 0.5, seed=3)
    water = [Environment(turbulence=(0.03, 0.03, 0.01), seed=seed) for seed in (1, 1, 2)]
    a, b, c = (swim(remus, ready, one) for one in water)
    np.testing.assert_array_equal(states(a), states(b))
    assert np.abs(a.current - c.current).max() > 0.01


def test_velocity_over_ground_less_the_current_is_the_velocity_through_the_water(remus):
    ready = identification_ready(remus, 0.5)
    swum = swim(remus, ready, Environment(current=(0.1, 0.2, 0.0), turbulence=(0.05, 0.05, 0.02), seed=9))
    from towtank.frames import rotation

    for k in range(0, len(swum.time), 50):
        flow = rotation(states(swum)[k, 3:6]).T @ swum.current[0, k]
        through = [swum.channels[name][0, k] for name in ("ahead", "slip", "plunge")]
        np.testing.assert_allclose(states(swum)[k, 6:9] - flow, through, atol=1e-9)


def test_the_current_jumps_at_the_ends_of_pieces_only_and_the_craft_does_not(remus):
    swum = swim(remus, identification_ready(remus, 0.5), Environment(turbulence=(0.05, 0.05, 0.05), seed=4))
    changes = np.flatnonzero(np.abs(np.diff(swum.current[0], axis=0)).max(axis=1))
    piece = round(0.5 / swum.clock.tick)
    assert ((changes + 1) % piece == 0).all()
    # Over ground a craft of this mass gains less than 1 m/s^2, so less than 0.04 m/s in a control period.
    assert np.abs(np.diff(states(swum)[:, 6:9], axis=0)).max() < 1.0 * swum.clock.tick


def test_shear_changes_the_current_with_the_depth_of_the_craft(remus):
    water = Environment(current=(0.1, 0.0, 0.0), shear=(0.02, -0.03), depth=4.0)
    swum = swim(remus, identification_ready(remus, 2.0), water)
    piece = round(0.5 / swum.clock.tick)
    begun, depth = swum.current[0, ::piece], swum.channels["z"][0, ::piece]
    np.testing.assert_allclose(begun[:-1, 0], 0.1 + 0.02 * (depth[:-1] - 4.0), atol=1e-12)
    np.testing.assert_allclose(begun[:-1, 1], -0.03 * (depth[:-1] - 4.0), atol=1e-12)
    assert np.ptp(depth) > 0.3
    np.testing.assert_allclose(mean_current(water, np.array([4.0, 14.0])), [[0.1, 0, 0], [0.3, -0.3, 0]], atol=1e-15)


def test_the_mission_moves_every_motion_and_both_ways_and_is_as_long_as_asked(steady, remus):
    for model, loop in ((remus, "closed"), (steady, "open")):
        chosen = trial_called(model, "survey", minutes=4.0, seed=2)
        swum = swim(chosen.model, chosen.ready)
        assert chosen.ready.loop == loop
        assert swum.end_time[0] == pytest.approx(240.0, abs=0.5)
        speed, length = model.craft.speed, model.craft.length
        scales = {"slip": speed, "plunge": speed, "r": speed / length, "q": speed / length, "p": speed / length}
        for name, scale in scales.items():
            values = swum.channels[name][0] / scale
            # A rms of 0.2 % of the scale is above the noise of the standard instruments over minutes; what the craft
            # does stays below half of the scale, where derivatives still hold.
            assert 0.002 < values.std() < 0.5, name
        ahead = swum.channels["ahead"][0]
        assert ahead.max() > 1.05 * speed
        assert ahead.min() < 0.9 * speed
        assert np.abs(swum.channels["theta"]).max() < np.radians(30.0)


def test_a_craft_is_steered_in_the_mission_only_where_it_is_unstable(steady, remus):
    for model in (steady, remus):
        growing = linearise(model, model.craft.speed).part(("v", "r"), ("rudder",)).eigenvalues.real.max() > 0.0
        legs = identification_legs(model, 1.0)
        assert any(leg.orders.steer for leg in legs) == growing
        assert all(leg.until is None for leg in legs)


def test_the_sines_of_the_mission_do_not_share_a_frequency(remus):
    legs = identification_legs(remus, 8.0 * 24.0 * remus.craft.length / remus.craft.speed / 60.0, seed=1)
    angles = np.array([[leg.orders.fin1, leg.orders.fin2, leg.orders.fin3, leg.orders.fin4] for leg in legs])
    virtual = angles @ np.linalg.pinv(remus.craft.mixing).T
    lines = np.abs(np.fft.rfft(virtual, axis=0)) ** 2
    shared = (lines / lines.sum(axis=0) > 0.01).sum(axis=1)
    # Whole periods up to the rounding of an order's time: a line carries less than 1 % of another control's power.
    assert shared.max() == 1


def test_what_cannot_be_swum_is_refused(remus):
    ready = trial_called(remus, "zigzag10").ready
    with pytest.raises(InputError, match="ends by an event"):
        swim(remus, ready, count=2)
    with pytest.raises(InputError, match="not below the craft's"):
        swim(remus, ready, Environment(current=(1.5, 0.5, 0.0)))
    with pytest.raises(InputError, match="takes no minutes"):
        trial_called(remus, "zigzag10", minutes=3.0)
    with pytest.raises(InputError, match="Did you mean"):
        trial_called(remus, "zigzgs20")
    with pytest.raises(InputError, match="minutes"):
        identification_legs(remus, -1.0)
    noisy = timed(remus, identification_legs(remus, 0.1))
    eyes = replace(noisy.setting, pilot=replace(noisy.setting.pilot, sensors=TYPICAL))
    with pytest.raises(InputError, match="pilot's sensors"):
        swim(remus, replace(noisy, setting=eyes), Environment(turbulence=(0.01, 0.0, 0.0)))
    # In a steady current it is one run of the engine, whose sensors keep their offsets.
    assert swim(remus, replace(noisy, setting=eyes), Environment(seed=2)).ended.tolist() == [0]


def test_a_craft_that_runs_away_leaves_a_record_up_to_there(remus):
    s = setting(remus, None)
    legs = [Leg(f"{i}", s.orders(), 1.0) for i in range(20)]
    # A surge damping of the wrong sign: the craft speeds up without end.
    drag = remus.derivatives["Xuu"] * np.array([1.0, -1e3])
    wild = swim(remus, timed(remus, legs), count=2, parameters={"Xuu": drag}, clock=Clock(0.05, 2))
    assert wild.ended.tolist()[0] == 0
    assert wild.ended[1] != 0
    assert np.isfinite(wild.channels["x"][0]).all()
    assert np.isnan(wild.channels["x"][1, -1])
    assert wild.end_time[1] < wild.end_time[0]
