"""Laws of the engine: what legs, events, gauges and ensembles mean, whatever craft flies."""

from __future__ import annotations

import re
import subprocess
import sys
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
        ({"ensemble": Ensemble(2, {"Yuv": np.zeros(3)})}, "one row for each"),
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


def test_a_clock_that_cannot_run_is_refused():
    with pytest.raises(InputError, match="positive period"):
        Clock(0.0, 1)
