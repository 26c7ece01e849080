"""User-defined trials: what a file says is what is flown, in a current too, and what a bad file is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.engine.run import Ensemble
from towtank.errors import InputError
from towtank.report.build import report
from towtank.trials.circle import turning_circle
from towtank.trials.files import read_trajectory, write_index
from towtank.trials.ready import fly_ready, readings
from towtank.trials.schema import HELD, SEEN, read_trial
from towtank.trials.userdefined import OWN, ready_from_file, trial_from_file
from towtank.trials.vertical import meander
from towtank.trials.waypoints import waypoint_mission
from towtank.trials.zigzag import zigzag

S_TURN = Path(__file__).parents[1] / "data" / "trial_s_turn.toml"


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.STABLE)


@pytest.fixture
def written(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "trial.toml"
        path.write_text(text)
        return path

    return write


CIRCLE = """
name = "circle"
[[command]]
name = "quarter"
rudder = "-20 deg"
until = "|heading| 90 deg"
[[command]]
name = "half"
until = "heading 180 deg"
within = "80 L"
[index.advance]
of = "north"
at = "quarter"
[index.tactical_diameter]
of = "east"
at = "half"
[index.time_between]
of = "time"
at = "half"
since = "quarter"
[index.slowest]
of = "speed"
take = "smallest"
"""


def test_a_circle_written_as_commands_is_the_turning_circle(craft, written):
    mine, usual = trial_from_file(craft, written(CIRCLE)), turning_circle(craft, "-20 deg")
    # The one beside the other: orders of the pilot are the same, heading is not held while the rudder is ordered.
    assert mine.indices["advance"] == pytest.approx(usual.indices["advance"])
    assert mine.indices["tactical_diameter"] == pytest.approx(usual.indices["tactical_diameter"])
    between = usual.indices["time_to_180"][0] - usual.indices["time_to_90"][0]
    assert mine.indices["time_between"] == (pytest.approx(between, rel=1e-9), "s")
    assert (mine.kind, mine.loop, mine.status) == ("user-defined", "closed", "done")


ZIGZAG = """
name = "zigzag"
speed = "2 m/s"
[[command]]
name = "one"
rudder = "10 deg"
until = "heading -10 deg"
[[command]]
name = "over"
rudder = "-10 deg"
until = "heading 10 deg"
[index.first_overshoot]
of = "heading"
take = "smallest"
during = "over"
less = "-10 deg"
[index.half_way]
of = "heading"
crossing = "last"
level = "0 deg"
during = "over"
"""


def test_a_zigzag_written_as_commands_has_the_overshoot_of_the_zigzag(craft, written):
    mine, usual = trial_from_file(craft, written(ZIGZAG)), zigzag(craft, "10 deg", "10 deg", "2 m/s")
    assert -mine.indices["first_overshoot"][0] == pytest.approx(usual.indices["first_overshoot"][0], rel=1e-9)
    back = usual.indices["reach"][0] - usual.indices["initial_turning_time"][0]
    assert mine.indices["half_way"] == (pytest.approx(back, abs=0.01), "s")


MEANDER = """
name = "meander"
speed = "3 m/s"
[[command]]
name = "over"
heading = "0 deg"
elevator = "10 deg"
until = "pitch -5 deg"
[[command]]
name = "free"
elevator = "0 deg"
until = "pitch rate 0 deg/s"
[index.first_excursion]
of = "pitch"
at = "free"
[index.elevator_mean]
of = "elevator"
take = "mean"
during = "over"
"""


def test_a_meander_written_as_commands_is_the_meander(craft, written):
    mine, usual = trial_from_file(craft, written(MEANDER)), meander(craft, "10 deg", "5 deg", "3 m/s")
    assert -mine.indices["first_excursion"][0] == pytest.approx(usual.indices["first_excursion"][0], rel=1e-9)
    assert mine.indices["elevator_mean"] == (pytest.approx(10.0, rel=1e-9), "deg")


def test_a_mission_written_as_waypoints_is_the_mission(craft, written):
    text = """
        name = "survey"
        speed = "3 m/s"
        current = ["0.2 m/s", "-0.3 m/s"]
        [[waypoint]]
        north = "40 L"
        east = 0
        depth = "3 m"
        [[waypoint]]
        north = "40 L"
        east = "30 L"
        speed = "3.5 m/s"
    """
    mine = trial_from_file(craft, written(text))
    points = [("40 L", 0.0, "3 m"), ("40 L", "30 L", 0.0, "3.5 m/s")]
    usual = waypoint_mission(craft, points, "3 m/s", current=(0.2, -0.3, 0.0), name="survey")
    assert mine.indices == usual.indices
    assert (mine.name, mine.kind) == ("survey", "waypoint mission")


COURSES = """
name = "courses"
speed = "3 m/s"
{current}
[[command]]
heading = "40 deg"
depth = "2 m"
for = "20 L"
[[command]]
turn = "-1 deg/s"
for = "10 L"
[[command]]
heading = "-30 deg"
pitch = "5 deg"
throttle = 0.8
for = "5 L"
[[command]]
depth = "1 m"
rudder = "5 deg"
for = "12 s"
"""


def test_in_a_uniform_current_a_trial_is_the_one_in_still_water_seen_from_the_water(craft, written):
    still = trial_from_file(craft, written(COURSES.format(current="")))
    moved = trial_from_file(craft, written(COURSES.format(current='current = ["0.4 m/s", "-0.7 m/s"]')))
    drift = np.outer(still.time, [0.4, -0.7, 0.0])
    # Headings, rates, depths and pitches know no current: equal up to what 90 s of RK4 steps make of round-off.
    assert moved.position - drift == pytest.approx(still.position, abs=1e-6)
    assert moved.attitude == pytest.approx(still.attitude, abs=1e-8)
    assert moved.delta == pytest.approx(still.delta, abs=1e-7)


def test_an_order_stands_until_another_takes_its_place(craft, written):
    trial = trial_from_file(craft, written(COURSES.format(current="")))
    ends = [m["time"] for m in trial.provenance["marks"]]
    part = [(trial.time > a + 0.2) & (trial.time < b) for a, b in zip([0.0, *ends], ends, strict=False)]
    heading, depth, turn = (trial.setpoint[name] for name in ("heading", "depth", "turn"))
    assert np.degrees(heading[part[0]]) == pytest.approx(40.0)
    assert depth[part[0]] == pytest.approx(2.0)
    # A rate of turn takes the place of the heading; the depth stands.
    assert np.isnan(heading[part[1]]).all()
    assert np.degrees(turn[part[1]]) == pytest.approx(-1.0)
    assert depth[part[1]] == pytest.approx(2.0)
    # A pitch takes the place of the depth, a rudder that of the heading.
    assert np.isnan(depth[part[2]]).all()
    assert np.degrees(trial.setpoint["pitch"][part[2]]) == pytest.approx(5.0)
    assert np.isnan(heading[part[3]]).all()
    assert np.degrees(trial.command[part[3], 0]) == pytest.approx(5.0)
    assert depth[part[3]] == pytest.approx(1.0)
    throttle = trial.setpoint["throttle"]
    assert [float(throttle[rows][0]) for rows in part] == [1.0, 1.0, 0.8, 0.8]
    # 20, 10 and 5 lengths at 3 m/s, then 12 s.
    assert np.diff([0.0, *ends]) == pytest.approx([20 * 8.15 / 3, 10 * 8.15 / 3, 5 * 8.15 / 3, 12.0])


def test_a_pitch_is_ordered_from_level_whatever_the_trim(written):
    heavy = synthetic.model(synthetic.STABLE, net_buoyancy=-0.2)
    text = 'name = "nose"\nspeed = "2 m/s"\n[[command]]\npitch = "{} deg"\nfor = "20 L"\n'
    for wanted in (0.0, 5.0):
        trial = trial_from_file(heavy, written(text.format(wanted)))
        assert np.degrees(trial.setpoint["pitch"][-1]) == pytest.approx(wanted)
        # The elevator's trim is that of level flight; a tenth of the way from there is not made good.
        missing = 0.15 * abs(wanted - np.degrees(trial.provenance["trim"]["pitch"]))
        assert np.degrees(trial.attitude[-1, 1]) == pytest.approx(wanted, abs=missing)


def test_without_a_pilot_nothing_is_held(written):
    craft = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.02)
    text = 'name = "drift"\nloop = "open"\n[[command]]\nrudder = "2 deg"\nfor = "10 L"\n'
    trial = trial_from_file(craft, written(text))
    assert trial.loop == "open"
    assert np.isnan(trial.setpoint["depth"]).all()
    assert np.degrees(trial.command[:, 0]) == pytest.approx(2.0)
    assert np.ptp(trial.command[:, 1]) == 0.0


def test_the_example_is_flown_alone_and_by_many(craft):
    alone = trial_from_file(craft, S_TURN)
    assert alone.status == "done"
    assert alone.indices["heading_overshoot"][0] < 0.0
    marks = {m["leg"]: m["time"] for m in alone.provenance["marks"]}
    assert alone.indices["time_to_60"][0] == pytest.approx(marks["turn"] - marks["lead"], rel=1e-12)
    turning = (alone.time > marks["lead"]) & (alone.time < marks["turn"])
    rate = np.gradient(np.degrees(alone.attitude[:, 2]), alone.time)[turning]
    assert alone.indices["rate_in_turn"][0] == pytest.approx(np.abs(rate).max(), rel=0.02)
    trial = ready_from_file(craft, S_TURN)
    drawn = {n: craft.derivatives[n] * np.array([1.0, 0.8, 0.01]) for n in ("Nuudr", "Muude", "Yuudr", "Zuude")}
    many = readings(craft, trial, fly_ready(craft, trial, Ensemble(3, drawn)))
    for name, (values, _) in many.items():
        assert values[0] == pytest.approx(alone.indices[name][0], rel=1e-6, abs=1e-9, nan_ok=True), name
    # The last craft does not turn: what comes after is not there.
    assert np.isnan(many["time_to_60"][0][2])
    assert np.isnan(many["heading_overshoot"][0][2])


def test_a_condition_that_does_not_come_says_what_was_waited_for_and_where_it_stood(craft, written):
    text = 'name = "never"\n[[command]]\nname = "wait"\nuntil = "heading 20 deg"\nwithin = "5 L"\n'
    assert "'wait' waited 41 s for a heading of 20 deg; it stood at 0" in trial_from_file(craft, written(text)).status


def test_a_trial_of_a_file_is_stored_and_shown(craft, tmp_path):
    trial = trial_from_file(craft, S_TURN)
    write_index([trial], tmp_path)
    back = read_trajectory(tmp_path / "s-turn.nc")
    assert back.provenance["curves"]["file"]["text"] == S_TURN.read_text()
    assert back.setpoint.keys() == trial.setpoint.keys()
    page = report(tmp_path / "page.html", trial).read_text()
    assert "User-defined s-turn" in page
    assert "heading overshoot" in page


def test_every_word_that_is_seen_can_be_waited_for_and_read(craft, written):
    for word, seen in SEEN.items():
        unit = {"m": "m", "rad": "deg", "m/s": "m/s", "rad/s": "deg/s"}[seen.unit]
        text = f'name = "a"\n[[command]]\nname = "x"\nuntil = "{word} 999 {unit}"\nwithin = "1 L"\n'
        text += f'[index.i]\nof = "{word}"\nat = "x"\n[index.j]\nof = "{word}"\ntake = "rms"\n'
        trial = trial_from_file(craft, written(text))
        assert word in trial.status
        assert trial.indices["j"][1] == seen.shown
    held = "".join(f'[index.{w.replace(" ", "_")}]\nof = "{w}"\ntake = "largest size"\n' for w in HELD)
    trial = trial_from_file(craft, written('name = "a"\n[[command]]\nrudder = "5 deg"\nfor = "2 L"\n' + held))
    assert trial.indices["rudder"] == (pytest.approx(5.0), "deg")


def test_indices_of_every_trial_have_names_of_their_own(craft):
    common = set(turning_circle(craft, "10 deg").indices) & set(meander(craft, "10 deg", "2 deg").indices)
    assert set(OWN) == common - {"pitch_overshoot"}


X = 'name = "a"\n[[command]]\nname = "x"\nfor = "3 s"\n'
BAD = {
    "no TOML": ("name = a", "is not a TOML file.*line 1.*need quotes"),
    "nothing": ("", "name: this key is missing"),
    "no commands": ('name = "a"', r"needs commands, \[\[command\]\], or waypoints"),
    "both": (X + "[[waypoint]]\nnorth = 1\neast = 2\n", "and not both"),
    "name": ('name = "a b"\n' + X[11:], "no short name"),
    "another schema": ('schema = "towtank/plan/1"\n' + X, "schema.*is not one of 'towtank/trial/1'"),
    "unknown key": ("sped = 3\n" + X, "sped: unknown key. Did you mean speed"),
    "unknown order": (X + 'ruder = "3 deg"\n', r"command\[1\].ruder: unknown key. Did you mean rudder"),
    "single brackets": ('name = "a"\n[command]\nfor = "3 s"\n', r"Write \[\[command\]\]"),
    "two orders": (X + 'rudder = "3 deg"\nturn = "1 deg/s"\n', "rudder and turn are ordered together"),
    "two orders of depth": (X + 'elevator = "3 deg"\npitch = "1 deg"\n', "elevator and pitch are ordered together"),
    "no end": ('name = "a"\n[[command]]\nrudder = "3 deg"\n', "needs one end"),
    "two ends": (X + 'until = "heading 3 deg"\n', "needs one end"),
    "within without until": (X + 'within = "3 s"\n', "longest wait for an until"),
    "no condition": ('name = "a"\n[[command]]\nuntil = "heading"\n', "is no condition. Write what is seen"),
    "one bar": ('name = "a"\n[[command]]\nuntil = "|heading 3 deg"\n', "is no condition"),
    "unknown word": ('name = "a"\n[[command]]\nuntil = "hedding 3 deg"\n', "Did you mean heading"),
    "unit of a condition": ('name = "a"\n[[command]]\nuntil = "heading 3 m"\n', "until: '3 m' cannot be converted"),
    "bare angle": (X + "rudder = 10\n", "rudder: bare angle 10"),
    "beyond the fins": (X + 'rudder = "60 deg"\n', "60 deg is beyond 25 deg, the limit of the fins"),
    "steep": (X + 'pitch = "85 deg"\n', "beyond 80 deg"),
    "no time": ('name = "a"\n[[command]]\nfor = "0 s"\n', "is not positive"),
    "true": (X + "throttle = true\n", "throttle"),
    "pilot in open loop": ('loop = "open"\n' + X + 'depth = "3 m"\n', 'loop = "open" has none'),
    "loop": ('loop = "half"\n' + X, "'half' is not one of 'open' or 'closed'"),
    "name twice": (X + '[[command]]\nname = "x"\nfor = "3 s"\n', "another command is called 'x'"),
    "current": ("current = [1.0]\n" + X, "current"),
    "current too fast": ("current = [1.0, 1.0]\n" + X, "not below the craft"),
    "index name": (X + '[index.Bad]\nof = "north"\nat = "x"\n', "small letters, digits and underscore"),
    "index of every trial": (X + '[index.duration]\nof = "north"\nat = "x"\n', "every trial has an index of this name"),
    "no way": (X + '[index.i]\nof = "north"\n', "Give one of at, take, crossing"),
    "two ways": (X + '[index.i]\nof = "north"\nat = "x"\ntake = "mean"\n', "at and take given"),
    "misplaced key": (X + '[index.i]\nof = "north"\ntake = "mean"\nsince = "x"\n', "since does not go with take"),
    "unknown take": (X + '[index.i]\nof = "north"\ntake = "median"\n', "'median' is not one of 'largest'"),
    "unknown command": (X + '[index.i]\nof = "north"\nat = "y"\n', "no command is called 'y'. Known here: x"),
    "unknown quantity": (X + '[index.i]\nof = "nort"\nat = "x"\n', "Did you mean north"),
    "time taken": (X + '[index.i]\nof = "time"\ntake = "mean"\n', "read at the end of a command"),
    "no level": (X + '[index.i]\nof = "north"\ncrossing = "first"\nduring = "x"\n', "a crossing needs a level"),
    "indices of a mission": (
        'name = "a"\n[[waypoint]]\nnorth = 100\neast = 0\n[index.i]\nof = "north"\nat = "x"\n', "own indices"),
    "point": ('name = "a"\n[[waypoint]]\nnorth = "100 kg"\neast = 0\n', "waypoint 1, north"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_the_reason(craft, written, case):
    text, words = BAD[case]
    with pytest.raises(InputError, match=words):
        trial_from_file(craft, written(text))


def test_a_file_that_is_not_there_and_one_that_is_no_text_are_refused(craft, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        trial_from_file(craft, tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not a TOML file"):
        trial_from_file(craft, tmp_path / "bytes.toml")


def test_all_faults_of_a_file_are_named_at_once(written):
    text = 'name = "a b"\nspede = 1\n[[command]]\nrudder = "1 deg"\nheading = "1 deg"\n[index.i]\nof = "north"\n'
    with pytest.raises(InputError) as refused:
        read_trial(written(text))
    for part in ("name:", "spede:", "command[1]: rudder and heading", "index.i: none given"):
        assert part in str(refused.value)


def test_more_indices_than_there_are_gauges_are_refused(craft, written):
    text = X + "".join(
        f'[index.i{k}]\nof = "depth"\ncrossing = "first"\nlevel = "{k + 1} m"\nduring = "x"\n' for k in range(40)
    )
    with pytest.raises(InputError, match="40 gauges; a run has room for 26"):
        trial_from_file(craft, written(text))
