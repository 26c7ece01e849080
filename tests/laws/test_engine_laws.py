"""Laws of the engine: what legs, events, gauges and ensembles mean, whatever craft flies."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.craft.hull import Ellipsoid
from towtank.engine.plan import Clock, Ended, Gauge, Leg, Log, Stat, Until
from towtank.engine.run import Ensemble, fly
from towtank.engine.start import at
from towtank.errors import InputError
from towtank.model.files import write_model
from towtank.pilot.design import design_pilot
from towtank.pilot.orders import Orders

ROOT = Path(__file__).parents[2]
HELD = Orders(piloted=1.0, steer=1.0, dive=1.0)
LEGS = (
    Leg("straight", HELD, 7.03),
    Leg("turn", Orders(piloted=1.0, rudder=-0.15, dive=1.0), 300.0, Until("psi", 1.0)),
    Leg("check", Orders(piloted=1.0, rudder=0.15, dive=1.0), 300.0, Until("psi", 0.2)),
    Leg("home", replace(HELD, heading=-0.3, depth=1.0), 60.0),
)


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


@pytest.fixture(scope="module")
def pilot(craft):
    return design_pilot(craft)


@pytest.fixture(scope="module")
def go(craft, pilot):
    def run(legs=LEGS, start=None, model=craft, **options):
        state = [0.0] * 6 + [1.0] + [0.0] * 9 if start is None else start
        given = {"thrust": float(craft.thrust(1.0)), "pilot": pilot, **options}
        return fly(model, at(state), legs, **given)

    return run


def test_a_leg_ends_exactly_on_its_event_and_exactly_in_its_time(go):
    done = go()
    assert done.finished.all()
    assert done.when("straight", event=False)[0] == pytest.approx(7.03, abs=1e-9)
    assert done.at("turn", "psi")[0] == pytest.approx(1.0, abs=1e-10)
    assert done.at("check", "psi")[0] == pytest.approx(0.2, abs=1e-10)
    assert done.duration("home")[0] == pytest.approx(60.0, abs=1e-9)


def test_the_events_do_not_depend_on_where_the_ticks_fall(go):
    coarse, fine = go(clock=Clock(0.1, 2)), go(clock=Clock(0.01, 1))
    for leg in ("turn", "check"):
        # What differs is the pilot's holding of its depth and roll commands for 0.1 s instead of 0.01 s.
        assert coarse.when(leg)[0] == pytest.approx(fine.when(leg)[0], abs=2e-3)


def test_gauges_hold_what_the_record_shows(go):
    watched = (Gauge("r", 0.02), Gauge("phi", absolute=True), Gauge("z", 0.5))
    done = go(log=Log(), gauges=watched)
    for leg in range(len(LEGS)):
        begin, end = (done.mark_time[0, leg - 1] if leg else 0.0), done.mark_time[0, leg]
        inside = (done.time > begin) & (done.time < end)
        time = np.concatenate([[begin], done.time[inside], [end]])
        for g, gauge in enumerate(watched):
            place = done.names.index(gauge.channel)
            first = done.mark[0, leg - 1, place] if leg else done.log[0, 0, place]
            values = np.concatenate([[first], done.log[0, inside, place], [done.mark[0, leg, place]]])
            values = np.abs(values) if gauge.absolute else values
            stat = done.stats[0, leg, g]
            assert stat[Stat.LOW] == pytest.approx(values.min(), abs=1e-12)
            assert stat[Stat.HIGH] == pytest.approx(values.max(), abs=1e-12)
            assert stat[Stat.HIGH_TIME] == pytest.approx(time[np.argmax(values)], abs=1e-9)
            assert stat[Stat.INTEGRAL] == pytest.approx(np.trapezoid(values, time), abs=1e-9)
            assert stat[Stat.SQUARE] == pytest.approx(np.trapezoid(values**2, time), abs=1e-9)
            over = values > gauge.level
            crossings = np.flatnonzero(over[1:] != over[:-1])
            if len(crossings):
                i = crossings[0]
                when = np.interp(
                    gauge.level, *zip(*sorted([(values[i], time[i]), (values[i + 1], time[i + 1])]), strict=True)
                )
                assert stat[Stat.FIRST] == pytest.approx(when, abs=1e-9)
            else:
                assert np.isnan(stat[Stat.FIRST])


def test_each_trajectory_of_an_ensemble_is_the_one_flown_alone(go, craft):
    yuv, zg, north = np.array([-400.0, -500.0, -650.0]), np.array([0.02, 0.05, 0.08]), np.array([0.0, 0.1, -0.1])
    spread = {"Yuv": yuv, "zG": zg, "current_north": north}
    start = np.tile(at([0.0] * 6 + [1.0] + [0.0] * 9), (3, 1))
    start[:, 7] += [0.0, 0.05, -0.05]
    together = go(ensemble=Ensemble(3, spread, start, {"depth": np.array([0.0, 0.5, -0.5])}), log=Log(every=10))
    for i in range(3):
        mass = replace(craft.craft.mass, cg=(0.0, 0.0, zg[i]))
        model = replace(craft.with_values(Yuv=yuv[i]), craft=replace(craft.craft, mass=mass))
        legs = [replace(leg, orders=replace(leg.orders, depth=(0.0, 0.5, -0.5)[i])) for leg in LEGS]
        alone = go(legs, [0.0] * 6 + [start[i, 7]] + [0.0] * 9, model, current=(north[i], 0.0, 0.0), log=Log(every=10))
        assert together.mark_time[i] == pytest.approx(alone.mark_time[0], abs=1e-9)
        assert together.state[i] == pytest.approx(alone.state[0], abs=1e-9)
        size = min(together.log.shape[1], alone.log.shape[1])
        np.testing.assert_allclose(together.log[i, :size], alone.log[0, :size], atol=1e-9)


def test_port_mirrors_starboard(go):
    turn = [Leg("turn", Orders(piloted=1.0, rudder=0.2, dive=1.0), 60.0)]
    both = go(turn, ensemble=Ensemble(2, orders={"rudder": np.array([0.2, -0.2])}))
    odd = [both.names.index(name) for name in ("y", "phi", "psi", "v", "p", "r", "drift", "turn")]
    even = [both.names.index(name) for name in ("x", "z", "theta", "u", "w", "q", "speed", "fin_largest")]
    port, starboard = both.mark[:, 0]
    assert port[odd] == pytest.approx(-starboard[odd], abs=1e-10)
    assert port[even] == pytest.approx(starboard[even], abs=1e-10)


def test_a_steady_current_moves_the_path_and_nothing_else(go):
    turn = [Leg("turn", Orders(piloted=1.0, rudder=0.2, dive=1.0), 50.0)]
    calm = go(turn)
    flow = np.array([0.2, -0.1, 0.0])
    moved = go(turn, [0.0] * 6 + [1.2, -0.1] + [0.0] * 8, current=tuple(flow))
    same = [calm.names.index(name) for name in ("z", "phi", "theta", "psi", "p", "q", "r", "ahead", "delta1")]
    assert moved.mark[0, 0, same] == pytest.approx(calm.mark[0, 0, same], abs=1e-9)
    assert moved.mark[0, 0, :3] - calm.mark[0, 0, :3] == pytest.approx(50.0 * flow, abs=1e-8)


def test_a_required_event_that_does_not_come_ends_the_trajectory(go):
    never = [Leg("turn", HELD, 10.0, Until("psi", 1.0), required=True), Leg("after", HELD, 5.0)]
    done = go(never)
    assert done.ended[0] == Ended.LATE
    assert done.end_time[0] == pytest.approx(10.0, abs=1e-9)
    assert np.isnan(done.mark_time[0, 1])
    assert np.isnan(done.when("turn")[0])


def test_an_interruption_keeps_what_is_finished(go):
    class Interrupting:
        steps = 0

        def start(self, task, total):
            pass

        def step(self, task, note=""):
            self.steps += 1
            if self.steps == 2:
                raise KeyboardInterrupt

        def done(self, task):
            pass

    count = 20000
    done = go(
        [Leg("run", HELD, 60.0)], ensemble=Ensemble(count, {"Yuv": np.linspace(-600.0, -500.0, count)}),
        progress=Interrupting(),
    )  # fmt: skip
    kept = done.finished
    assert 0 < kept.sum() < count
    assert np.all(done.ended[~kept] == Ended.STOPPED)
    assert np.all(np.isfinite(done.state[kept]))
    assert np.all(np.isnan(done.mark_time[~kept]))


def test_heading_is_unwrapped_through_whole_turns(go):
    done = go([Leg("round", Orders(piloted=1.0, rudder=-0.3, dive=1.0), 3000.0, Until("psi", 13.0))])
    assert done.at("round", "psi")[0] == pytest.approx(13.0, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"legs": []}, "no leg"),
        ({"legs": [Leg("run", HELD, -1.0)]}, "positive, finite duration"),
        ({"legs": [Leg("run", replace(HELD, heading=np.nan), 1.0)]}, "not finite"),
        ({"legs": [Leg("run", HELD, 1.0, Until("yaw", 1.0))]}, "no channel 'yaw'"),
        ({"gauges": [Gauge("depth")]}, "no channel 'depth'"),
        ({"gauges": [Gauge("z")] * 40}, "room for 32"),
        ({"ensemble": Ensemble(2, {"Yuw": np.zeros(2)})}, "no parameter 'Yuw'"),
        ({"ensemble": Ensemble(2, {"Yuv": np.zeros(3)})}, "one number for each trajectory"),
        ({"ensemble": Ensemble(2, {"Yuv": np.zeros((2, 0))})}, "one number for each trajectory"),
        ({"ensemble": Ensemble(2, {"Yuv": np.zeros((2, 2))})}, "one number for each trajectory"),
        ({"ensemble": Ensemble(2, {"Yuv": np.float64(1.0)})}, "one number for each trajectory"),
        ({"ensemble": Ensemble(2, {"time_constant0": np.array([0.2, -1.0])})}, "positive"),
        ({"ensemble": Ensemble(2, {"time_constant0": np.array([0.2, 0.001])})}, "unstable"),
        ({"clock": Clock(0.6, 1)}, "unstable"),
        ({"ensemble": Ensemble(0)}, "one or more"),
        ({"threads": -1}, "one or more"),
        ({"thrust": np.nan}, "must be finite"),
        ({"current": (0.1, 0.2)}, "three"),
        ({"ensemble": Ensemble(2, start=np.zeros((3, 20)) + 1.0)}, "length 1"),
        ({"ensemble": Ensemble(2, start=np.tile(at([0.0] * 16), (3, 1)))}, "one row for each"),
        ({"ensemble": Ensemble(2, orders={"depth": np.array([np.nan, 1.0])})}, "finite numbers"),
        ({"ensemble": Ensemble(2, orders={"depth": np.zeros(3)})}, "one for each"),
        ({"ensemble": Ensemble(2, orders={"depth": np.zeros((2, 1))})}, "one for each"),
        ({"legs": [Leg("run", HELD, 1.0, Until("psi", np.nan))]}, "finite level"),
        ({"legs": [Leg("run", HELD, 1.0, Until("rudder", 0.1))]}, "kept by the steering"),
        ({"legs": [Leg("run", HELD, 1.0, Until("delta5", 0.1))]}, "no channel 'delta5'"),
        ({"gauges": [Gauge("z", np.inf)]}, "finite level"),
        ({"ensemble": Ensemble(2, {"Yuv": np.array([1.0, np.inf])})}, "not finite"),
        ({"ensemble": Ensemble(2, {"Yvdot": np.array([0.0, 1e6])})}, "not positive definite"),
        ({"ensemble": Ensemble(2, orders={"course made good": np.zeros(2)})}, "no order"),
    ],
)
def test_bad_input_is_refused_with_the_reason(go, options, words):
    with pytest.raises(InputError, match=words):
        go(**options)


def test_the_script_of_the_page_runs_as_printed(tmp_path):
    script = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "engine.md").read_text("utf-8"), flags=re.S)
    (tmp_path / "hokie").mkdir()
    model = synthetic.model(synthetic.STABLE)
    shaped = replace(model, craft=replace(model.craft, profile=Ellipsoid(8.15, 0.945)))
    write_model(shaped, tmp_path / "hokie" / "model.json")
    code = f"{script[1]}\nassert done.finished.all() and many.finished.all() and abs(many.state[0, 2] - 2.0) < 0.5"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_start_of_the_wrong_size_is_refused(craft):
    with pytest.raises(InputError, match="finite numbers"):
        fly(craft, np.zeros(5), LEGS, thrust=1.0)


@pytest.mark.parametrize("given", [(0.0, 1), (0.1, 0), (0.1, 2.0)])
def test_a_clock_that_cannot_run_is_refused(given):
    with pytest.raises(InputError, match="positive period"):
        Clock(*given)


@pytest.mark.parametrize("every", [0, -1, 2.0])
def test_a_log_that_cannot_be_kept_is_refused(every):
    with pytest.raises(InputError, match="whole number"):
        Log(every=every)


@pytest.mark.parametrize("level", [0.55, 0.60, 0.7])
def test_a_leg_that_begins_on_its_level_waits_for_the_next_passing(go, level):
    turn = Orders(piloted=1.0, rudder=-0.2, dive=1.0)
    done = go([Leg("there", turn, 300.0, Until("psi", level)), Leg("again", turn, 20.0, Until("psi", level))])
    assert done.by_event[0].tolist() == [True, False]
    assert done.duration("again")[0] == pytest.approx(20.0, abs=1e-9)


def test_fast_fins_get_the_steps_they_need(craft):
    quick = synthetic.model(synthetic.STABLE, lag=0.005, rate=300.0)
    turn = [Leg("turn", Orders(rudder=0.2), 20.0)]
    given = {"thrust": float(quick.thrust(1.0))}
    start = at([0.0] * 6 + [1.0] + [0.0] * 9)
    plain, fine = fly(quick, start, turn, **given), fly(quick, start, turn, clock=Clock(0.1, 400), **given)
    asked = quick.fin_angles(0.2, 0.0, 0.0)
    assert [float(plain.at("turn", f"delta{i + 1}", event=False)[0]) for i in range(4)] == pytest.approx(
        asked, abs=1e-9
    )
    assert plain.state[0] == pytest.approx(fine.state[0], abs=1e-6)


def test_what_stops_a_trajectory_is_its_own_speed(go):
    start = np.tile(at([0.0] * 6 + [1.0] + [0.0] * 9), (3, 1))
    start[1, 7] = 3.0
    run = [Leg("run", HELD, 10.0)]
    beside = go(run, thrust=5e4, ensemble=Ensemble(3, start=start))
    alone = go(run, thrust=5e4)
    assert beside.ended[0] == alone.ended[0] == Ended.TOO_FAST
    assert beside.end_time[[0, 2]] == pytest.approx(alone.end_time[0], abs=1e-9)
    assert beside.end_time[1] > alone.end_time[0]


def test_the_last_sample_does_not_depend_on_the_neighbours(go):
    legs = [Leg("on", HELD, 4.0, Until("x", 5.0), required=True), Leg("after", HELD, 4.0)]
    start = np.tile(at([0.0] * 6 + [1.0, 0.05] + [0.0] * 8), (2, 1))
    start[1, 0] = 4.0
    together = go(legs, ensemble=Ensemble(2, start=start), log=Log())
    alone = go(legs, start=[0.0] * 6 + [1.0, 0.05] + [0.0] * 8, log=Log())
    assert together.ended.tolist() == [Ended.LATE, Ended.DONE]
    assert together.end_time[1] > together.end_time[0]
    np.testing.assert_allclose(together.log[0], alone.log[0], atol=1e-12)


def test_an_interruption_keeps_the_ended_lanes_of_a_pack(go):
    # Interrupted while the pack is under way: lane 0 has ended long before the others.
    legs = [Leg("short", HELD, 1.0, Until("x", 0.0), required=True), Leg("long", HELD, 3e6)]
    start = np.tile(at([-0.5] + [0.0] * 5 + [1.0] + [0.0] * 9), (8, 1))
    start[0, 0] = -5.0
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    done = go(legs, ensemble=Ensemble(8, start=start))
    assert done.ended[0] == Ended.LATE
    assert np.all(np.isfinite(done.state[0]))
    assert np.all(done.ended[1:] == Ended.STOPPED)
    assert np.all(np.isnan(done.state[1:]))


def test_an_error_of_a_worker_is_raised_here(go, monkeypatch):
    from towtank.engine.library import Library

    def broken(*_, **__):
        raise RuntimeError("broken")

    monkeypatch.setattr(Library, "run", broken)
    with pytest.raises(RuntimeError, match="broken"):
        go([Leg("run", HELD, 1.0)], ensemble=Ensemble(4))


@pytest.mark.parametrize("path", ["numpy", ""])
@pytest.mark.parametrize(
    ("change", "thrust", "reason"),
    [({"Kpp": 1e13}, 20.0, Ended.NOT_FINITE), ({"Yuv": 1e200}, 20.0, Ended.NOT_FINITE), ({}, 5e4, Ended.TOO_FAST)],
)
def test_a_motion_out_of_bounds_stops_with_its_reason_on_every_path(craft, monkeypatch, path, change, thrust, reason):
    monkeypatch.setenv("TOWTANK_ENGINE", path)
    start = at([0.0] * 6 + [1.0, 0.1, 0.0, 1.0, 0.0, 0.0] + [0.0] * 4)
    done = fly(craft.with_values(**change), start, [Leg("run", Orders(), 20.0)], thrust=thrust)
    assert done.ended[0] == reason
    assert np.all(np.isfinite(done.state))
    assert done.end_time[0] < 20.0


def test_an_ordered_rate_of_turn_and_an_ordered_pitch_are_followed(go):
    turn = replace(HELD, turning=1.0, turn=0.01)
    lean = replace(HELD, pitching=1.0, pitch=-0.03)
    done = go([Leg("turn", turn, 1500.0), Leg("lean", lean, 200.0)])
    # r of a level craft; the roll in the turn makes the rate of heading differ by its cosine.
    assert done.at("turn", "r", event=False)[0] == pytest.approx(0.01, rel=0.01)
    assert done.at("turn", "psi", event=False)[0] > 1.5
    assert done.at("lean", "theta", event=False)[0] == pytest.approx(-0.03, rel=0.1)


def test_without_thrust_a_craft_slows_down_as_quadratic_drag_has_it(craft, go):
    # u' = -k u^2 with k = -Xuu / (m - Xudot), so that u0 / u - 1 = k u0 t.
    # A low CG pitches the craft a little while it slows down.
    done = go([Leg("coast", replace(HELD, throttle=0.0), 20.0), Leg("astern", replace(HELD, throttle=-1.0), 10.0)])
    k = -craft.derivatives["Xuu"] / craft.mass_matrix[0, 0]
    u = done.at("coast", "u", event=False)[0]
    assert u == pytest.approx(1.0 / (1.0 + 20.0 * k), rel=1e-5)
    assert done.at("astern", "u", event=False)[0] < 1.0 / (1.0 + 30.0 * k)


def test_feedback_of_sway_is_part_of_the_command(go, pilot):
    turn = [Leg("turn", replace(HELD, heading=1.0), 6.0)]
    plain, fed = go(turn), go(turn, pilot=replace(pilot, sway=5.0))
    assert fed.at("turn", "slip", event=False)[0] != 0.0
    assert abs(fed.at("turn", "psi", event=False)[0] - plain.at("turn", "psi", event=False)[0]) > 1e-3
