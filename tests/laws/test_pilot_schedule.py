"""A table of pilots over speed: where it is exact, where it blends, where it must not."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import ArtefactError, InputError
from towtank.model.algebra import MATH
from towtank.model.linear import elevator_reversal_speed
from towtank.pilot.design import design_pilot
from towtank.pilot.files import read_pilot, read_schedule, write_pilot, write_schedule
from towtank.pilot.law import GAINS, schedule
from towtank.pilot.loops import whole_loop
from towtank.pilot.lqi import design_lqi
from towtank.pilot.scheduled import FINS, PilotSchedule, design_schedule
from towtank.trials.steps import depth_step, heading_step


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.SUBOFF, speed=1.0)


@pytest.fixture(scope="module")
def turn(craft):
    """The elevator's inversion speed."""
    return elevator_reversal_speed(craft, "wide")


@pytest.fixture(scope="module", params=[design_pilot, design_lqi])
def table(request, craft, turn):
    return design_schedule(craft, turn * np.array([0.45, 0.65, 1.3, 1.8, 2.6, 3.8]), request.param)


def test_at_its_speeds_the_table_is_the_design(craft, table):
    for pilot in table.pilots:
        assert table.at(pilot.speed) is pilot
    with_one = PilotSchedule(table.pilots[3:4])
    assert with_one.at(9.0).yaw_rate == table.pilots[3].yaw_rate


def test_the_loop_is_stable_and_held_at_every_speed_of_the_table(craft, table, turn):
    # Near the inversion speed no elevator commands depth: 1.05 times it is where the law begins to follow depth fully.
    for speed in np.concatenate([np.linspace(0.45, 0.8, 6), np.linspace(1.1, 3.8, 25)]) * turn:
        growth = whole_loop(craft, table.at(float(speed)), float(speed), delay=0.05).eigenvalues[0].real
        assert growth < -1e-3, speed


def test_a_single_pilot_fails_where_the_table_holds(craft, table, turn):
    single = table.at(1.3 * turn)
    slow, fast = 0.6 * turn, 3.6 * turn
    # Below the inversion speed a pilot for above it gives up depth; far above its own, its depth loop is not stable.
    assert depth_step(craft, "1 m", slow, pilot=single).indices["last_error"][0] == pytest.approx(-1.0, abs=0.05)
    assert whole_loop(craft, single, fast, delay=0.05).eigenvalues[0].real > 0.0
    for speed in (slow, fast):
        own = table.at(speed)
        assert abs(depth_step(craft, "1 m", speed, pilot=own, lengths=140.0).indices["last_error"][0]) < 0.05
        assert abs(heading_step(craft, "20 deg", speed, pilot=own).indices["last_error"][0]) < 0.5


def test_between_two_speeds_the_fins_do_what_the_law_would_blended(table, turn):
    low, high = table.pilots[3], table.pilots[4]
    speed = float(np.sqrt(low.speed * high.speed))
    between = table.at(speed)
    assert between.speed == speed
    for name in FINS:
        ends = [getattr(p, name) * schedule(p, speed, MATH) for p in (low, high)]
        assert getattr(between, name) == pytest.approx(0.5 * sum(ends))
    assert between.heading == pytest.approx(0.5 * (low.heading + high.heading))
    assert between.reversal == low.reversal == high.reversal
    # Continuous: just beside an entry it is that entry.
    beside = table.at(low.speed * (1.0 + 1e-9))
    assert all(getattr(beside, name) == pytest.approx(getattr(low, name), rel=1e-6) for name in GAINS)


def test_pilots_on_two_sides_of_the_inversion_speed_are_not_blended(table, turn):
    below, above = table.pilots[1], table.pilots[2]
    assert below.reversal == 0.0 < above.reversal
    assert np.sign(below.pitch_order * below.depth) != np.sign(above.pitch_order * above.depth)
    assert table.at(0.99 * turn) is below
    assert table.at(1.01 * turn) is above


def test_beyond_its_ends_the_nearest_flies_and_says_so(table):
    far = table.at(5.0 * table.speeds[-1])
    assert replace(far, notes=table.pilots[-1].notes) == table.pilots[-1]
    assert any("outside its table" in note for note in far.notes)


def test_a_table_goes_to_a_file_and_back(table, tmp_path):
    assert read_schedule(write_schedule(table, tmp_path / "pilot.json")) == table
    one = write_pilot(table.pilots[0], tmp_path / "one.json")
    assert read_schedule(one) == PilotSchedule(table.pilots[:1])
    with pytest.raises(ArtefactError, match="schema"):
        read_pilot(tmp_path / "pilot.json")
    document = json.loads((tmp_path / "pilot.json").read_text())
    document["pilots"][1]["gains"].pop("depth")
    (tmp_path / "pilot.json").write_text(json.dumps(document))
    with pytest.raises(ArtefactError, match="not a whole pilot"):
        read_schedule(tmp_path / "pilot.json")
    with pytest.raises(ArtefactError, match="does not exist"):
        read_schedule(tmp_path / "none.json")


def test_what_is_no_table_is_refused(craft, table):
    one = table.pilots[2]
    for bad in (
        (),
        (one, one),
        (one, replace(table.pilots[3], scheduled=0.0)),
        (one, replace(one, craft="x", speed=9.0)),
    ):
        with pytest.raises(InputError, match="pilot schedule"):
            PilotSchedule(bad)
    with pytest.raises(InputError, match="forward speed"):
        table.at(0.0)
    with pytest.raises(InputError, match="pilot schedule"):
        design_schedule(craft, ())
