"""What a pilot designed from any craft's linear model must do."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import synthetic_craft as synthetic
from towtank.craft.library import read_craft
from towtank.engine.form import System
from towtank.engine.loop import command, dynamics, observe
from towtank.engine.plan import Gauge, Leg, Stat
from towtank.engine.run import fly
from towtank.engine.start import at
from towtank.errors import ArtefactError, InputError, TrialError
from towtank.model.algebra import MATH, NUMPY
from towtank.model.linear import horizontal
from towtank.pilot.allocation import ELEVATOR_FIRST, ROUND_OFF, RUDDER_FIRST, YAW_AND_PITCH_FIRST, allocation, share
from towtank.pilot.design import design_pilot
from towtank.pilot.files import UNITS, read_pilot, write_pilot
from towtank.pilot.guidance import across, along, line, line_of_sight
from towtank.pilot.law import GAINS, NO_PILOT, Pilot, Seen, authority, steer, wrapped
from towtank.pilot.orders import ORDERS, Orders
from towtank.trials.mission import lawnmower
from towtank.trials.ready import Ready, fly_ready, readings
from towtank.trials.start import setting
from towtank.trials.steps import depth_step, heading_step

STEADY = np.radians(0.5)


@pytest.fixture(scope="module")
def unstable():
    return synthetic.model(synthetic.SUBOFF)


@given(
    Yuv=st.floats(0.4, 2.5), Nuv=st.floats(0.3, 1.6), Yur=st.floats(0.5, 1.5), Nur=st.floats(0.5, 2.0),
    fins=st.floats(0.6, 2.0), lag=st.floats(0.05, 0.6), speed=st.floats(1.1, 3.0),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_the_closed_loops_are_stable_for_any_plausible_craft(Yuv, Nuv, Yur, Nur, fins, lag, speed):
    factors = {"Yuv": Yuv, "Nuv": Nuv, "Yur": Yur, "Nur": Nur, "Yuudr": fins, "Nuudr": fins}
    primes = {name: value * factors.get(name, 1.0) for name, value in synthetic.SUBOFF.items()}
    pilot = design_pilot(synthetic.model(primes, lag=lag, speed=speed))
    for loop, eigenvalues in pilot.eigenvalues.items():
        assert max(s.real for s in eigenvalues) < 0.0, loop
    assert pilot.margins["heading"][2] > np.radians(20.0)


def test_a_craft_that_does_not_hold_its_course_holds_it_under_the_pilot(unstable):
    assert horizontal(unstable, 1.0).eigenvalues.real.max() > 0.0
    assert max(s.real for s in design_pilot(unstable).eigenvalues["heading"]) < 0.0


def test_eigenvalues_of_the_design_are_those_of_the_flying_law():
    # The loops are flown as code with limits and schedule; its slope at rest must be the designed closed loop. The CG
    # is put near the axis, because the loops are designed one by one and a low CG couples sway with roll.
    unstable = synthetic.model(synthetic.SUBOFF, zg=0.001)
    s = setting(unstable, 1.0)
    system = System(unstable.constants, s.pilot, s.thrust, (0.0, 0.0, 0.0), 0.25)
    orders, mixing = s.orders(steer=1.0, dive=1.0), allocation(unstable.craft)

    def rates(y):
        x, memory = list(y[:17]), list(y[17:])
        ordered = [getattr(orders, name) for name in ORDERS]
        out = command(system, observe(system, x, ordered, MATH), memory, ordered, MATH)
        return np.array([*dynamics(system, x, [*mixing.fins(out.granted), 1.0], MATH), *out.memory_rates])

    step, start = 1e-7, at(s.state, s.memory)
    slope = np.array([(rates(start + step * e) - rates(start - step * e)) / (2.0 * step) for e in np.eye(20)]).T
    found = np.linalg.eigvals(slope)
    for loop in ("heading", "depth", "roll"):
        for value in s.pilot.eigenvalues[loop]:
            assert np.abs(found - value).min() < 0.005 * abs(value), (loop, value)


@given(rudder=st.floats(-1.0, 1.0), elevator=st.floats(-1.0, 1.0), aileron=st.floats(-1.0, 1.0), first=st.booleans())
def test_no_fin_is_asked_beyond_its_limit_and_yaw_and_pitch_keep_their_ratio(rudder, elevator, aileron, first):
    fins = allocation(synthetic.craft())
    order = RUDDER_FIRST if first else YAW_AND_PITCH_FIRST
    granted = share((rudder, elevator, aileron), fins.rows, fins.limits, order, MATH)
    # A demand up to ROUND_OFF is granted on top of a full fin in each of the two later stages.
    assert max(abs(a) for a in fins.fins(granted)) <= np.radians(25.0) + 2.0 * ROUND_OFF + 4.0 * np.spacing(0.5)
    if not first:
        assert granted[0] * elevator == pytest.approx(granted[1] * rudder, abs=1e-12)
    else:
        assert abs(granted[0]) == pytest.approx(min(abs(rudder), np.radians(25.0)))
    assert all(
        got * want >= 0.0 and abs(got) <= abs(want) + 1e-15
        for got, want in zip(granted, (rudder, elevator, aileron), strict=True)
    )


@given(st.floats(-50.0, 50.0))
def test_heading_errors_take_the_short_way(angle):
    assert -np.pi <= wrapped(angle, MATH) <= np.pi
    assert np.cos(wrapped(angle, MATH)) == pytest.approx(np.cos(angle), abs=1e-9)


def test_fins_never_exceed_limit_nor_rate(unstable):
    quick = synthetic.model(synthetic.SUBOFF, rate=5.0, limit=15.0)
    trial = heading_step(quick, "120 deg", lengths=15.0)
    assert np.abs(trial.delta).max() <= np.radians(15.0) * (1.0 + 1e-12)
    swing = np.abs(np.diff(trial.delta, axis=0)) / np.diff(trial.time)[:, None]
    assert swing.max() <= np.radians(5.0) * 1.02
    assert trial.indices["fin_saturation"][0] > 1.0  # the step was large enough to try the limit


def test_heading_step_settles_without_error_in_a_current(unstable):
    trial = heading_step(unstable, "30 deg", current=(0.2, 0.3, 0.0), lengths=80.0)
    # The slowest eigenvalue is 0.01 1/s: 80 lengths are 6 time constants.
    assert abs(trial.indices["last_error"][0]) < 0.05
    assert trial.status == "done"


def test_a_uniform_current_does_not_change_the_motion_through_the_water(unstable):
    still, moving = (heading_step(unstable, current=c, lengths=15.0) for c in ((0.0, 0.0, 0.0), (0.3, -0.2, 0.0)))
    # Same equations in a moving frame.
    assert moving.attitude == pytest.approx(still.attitude, abs=1e-9)
    drift = moving.position - still.position
    assert drift[:, :2] == pytest.approx(np.outer(moving.time, [0.3, -0.2]), abs=1e-6)


def test_depth_step_with_net_weight_has_no_lasting_error():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.2, speed=2.0)
    trial = depth_step(heavy, "3 m", lengths=110.0)
    assert abs(trial.indices["last_error"][0]) < 0.02
    assert trial.setpoint["depth"][-1] == pytest.approx(3.0)


def test_the_integral_takes_out_a_weight_the_trim_does_not_know():
    heavy = synthetic.model(synthetic.SUBOFF, net_buoyancy=-0.2, speed=2.0)
    s = setting(heavy, None)
    leg = Leg("hold", s.orders(steer=1.0, dive=1.0), 110.0 * s.convective)
    forgotten, off = at(s.state), Gauge("z", absolute=True)
    assert s.memory[1] != 0.0
    flights = fly(heavy, forgotten, [leg], thrust=s.thrust, pilot=s.pilot, gauges=[off])
    assert flights.stat("hold", off, Stat.HIGH)[0] > 0.1
    assert abs(flights.at("hold", "z", event=False)[0]) < 0.02


def test_saturation_does_not_wind_up(unstable):
    # Fins at their limit for a large part of the turn; the integrators must not turn that into overshoot.
    trial = heading_step(unstable, "150 deg")
    assert trial.indices["fin_largest"][0] > 24.9
    assert trial.indices["overshoot_share"][0] < 5.0


def test_a_heading_step_to_port_mirrors_one_to_starboard(unstable):
    port, starboard = heading_step(unstable, "-40 deg", lengths=15.0), heading_step(unstable, "40 deg", lengths=15.0)
    assert port.position[:, 1] == pytest.approx(-starboard.position[:, 1], abs=1e-6)
    assert port.attitude[:, 2] == pytest.approx(-starboard.attitude[:, 2], abs=1e-6)


def test_the_lawnmower_keeps_its_legs(unstable):
    trial = lawnmower(unstable, legs=2, current=(0.0, 0.1, 0.0))
    assert trial.status == "done"
    # The lookahead is 10 lengths for this slow heading loop, so a leg of 25 is long enough to come within one.
    assert trial.indices["off_track_rms"][0] < 1.0 * unstable.craft.length
    assert trial.indices["depth_error_rms"][0] < 0.1


def test_effort_of_a_known_fin_motion():
    # A rudder of -25 deg, the limit, from rest, then of +10 deg; nothing limits the fins' rate. Each is 50 lags long,
    # so that a fin is where it is asked to be at the end of it. Over a lag T the square of a + b exp(-t/T) has the
    # integral a^2 t + 2 a b T + b^2 T / 2.
    craft = synthetic.model(synthetic.STABLE, rate=1e6)
    s, lag = setting(craft, None, piloted=False), 0.2
    first, then, lasting = 25.0, -10.0, 50.0 * lag
    legs = tuple(Leg(str(a), s.orders(rudder=-np.radians(a)), lasting) for a in (first, then))
    trial = Ready("effort", "effort", "open", s, legs, 1.0, read=lambda flights: {})
    flights = fly_ready(craft, trial)
    out = readings(craft, trial, flights)
    swing = first - then
    square = first**2 * (lasting - 1.5 * lag) + then**2 * lasting + 2.0 * then * swing * lag + swing**2 * lag / 2.0
    path = flights.over(Gauge("speed"), Stat.INTEGRAL)
    assert out["fin_rms"][0] == pytest.approx(np.sqrt(square / (2.0 * lasting)), rel=1e-3)
    assert out["fin_largest"][0] == pytest.approx(first, rel=1e-6)
    assert out["fin_travel"][0] == pytest.approx((first + swing) / path, rel=1e-6)
    # Within 0.5 % of the limit from ln(200) lags on until shortly after the swing back; known to a control period.
    full = lasting - lag * np.log(200.0) + lag * np.log(swing / (swing - 0.005 * first))
    assert out["fin_saturation"][0] == pytest.approx(100.0 * full / (2.0 * lasting), abs=100.0 * 0.1 / (2.0 * lasting))


def test_a_craft_that_cannot_be_steered_is_told_so(unstable):
    bare = replace(unstable, craft=replace(unstable.craft, fins=()))
    with pytest.raises(TrialError, match="no fins"):
        design_pilot(bare)
    with pytest.raises(TrialError, match="no gains stabilise heading"):
        design_pilot(unstable.with_values(Yuudr=0.0, Nuudr=0.0))
    with pytest.raises(InputError, match="forward speed"):
        design_pilot(unstable, 0.0)


def test_below_the_inversion_speed_the_pilot_says_so():
    slow = synthetic.model(synthetic.SUBOFF, speed=0.5)
    pilot = design_pilot(slow)
    assert any("inversion" in note for note in pilot.notes)
    assert max(s.real for s in pilot.eigenvalues["depth"]) < 0.0


FINS = allocation(synthetic.craft())
SWITCH = st.sampled_from([0.0, 1.0])
ANGLE = st.floats(-1.2, 1.2)
LIMITED = {"lookahead": st.floats(1.0, 40.0)} | dict.fromkeys(
    ("piloted", "steer", "track", "dive", "damp_roll", "turning", "pitching"), SWITCH
)
A_CASE = st.tuples(
    st.fixed_dictionaries({name: LIMITED.get(name, ANGLE) for name in ORDERS}),
    st.fixed_dictionaries({name: st.floats(0.1, 3.0) if name == "u" else ANGLE for name in Seen._fields}),
    st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)


@cache
def gained():
    return design_pilot(synthetic.model(synthetic.SUBOFF, speed=2.0))


def flown(pilot, orders, seen, memory, ops, fins=FINS):
    """The law's seven numbers."""
    out = steer(pilot, fins, orders, seen, memory, ops)
    return [*out.granted, *out.memory_rates, out.heading]


def in_lanes(dicts):
    return SimpleNamespace(**{name: np.array([d[name] for d in dicts]) for name in dicts[0]})


# Size of the terms each output is a sum of: angles and rates of about 1, a heading of up to half a turn.
SCALE = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, np.pi])


@given(st.lists(A_CASE, min_size=1, max_size=5))
@settings(max_examples=60, deadline=None)
def test_the_law_on_a_batch_is_the_law_on_each_lane(cases):
    orders, seen, memory = zip(*cases, strict=True)
    batch = flown(gained(), in_lanes(orders), in_lanes(seen), list(np.array(memory).T), NUMPY)
    for lane, (o, s, m) in enumerate(cases):
        alone = np.array(flown(gained(), Orders(**o), Seen(**s), m, MATH))
        together = np.array([np.broadcast_to(x, (len(cases),))[lane] for x in batch])
        # Round-off is relative to the terms of a sum. Sines of numpy and libm differ by an ulp.
        assert (np.abs(together - alone) <= 1e-14 * np.maximum(np.abs(alone), SCALE)).all(), (alone, together)


@given(st.lists(A_CASE, min_size=1, max_size=5))
@settings(max_examples=60, deadline=None)
def test_the_law_on_symbols_is_the_law_on_floats(law_of_symbols, cases):
    for o, s, m in cases:
        alone = np.array(flown(gained(), Orders(**o), Seen(**s), m, MATH))
        gains = [getattr(gained(), name) for name in GAINS]
        traced = law_of_symbols(gains, [o[name] for name in ORDERS], [s[name] for name in Seen._fields], m)
        assert (np.abs(np.array(traced).ravel() - alone) <= 1e-13 * np.maximum(np.abs(alone), SCALE)).all()


@pytest.fixture(scope="module")
def law_of_symbols():
    import casadi as ca

    ops = SimpleNamespace(
        sin=ca.sin, cos=ca.cos, fabs=ca.fabs, sqrt=ca.sqrt, fmin=ca.fmin, fmax=ca.fmax, atan2=ca.atan2,
        floor=ca.floor, positive=lambda x: x > 0,
    )  # fmt: skip

    def named(names):
        return SimpleNamespace(**{name: ca.SX.sym(name) for name in names})

    pilot, orders, seen, memory = named(GAINS), named(ORDERS), named(Seen._fields), ca.SX.sym("m", 3)
    out = flown(pilot, orders, seen, [memory[i] for i in range(3)], ops)
    packed = [ca.vertcat(*vars(x).values()) for x in (pilot, orders, seen)]
    return ca.Function("law", [*packed, memory], [ca.vertcat(*out)])


COMMANDS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
TAILS = st.sampled_from(["remus100", "suboff-x", "suboff-fins"]).map(lambda name: allocation(read_craft(name)))
PRIORITY = st.sampled_from([RUDDER_FIRST, ELEVATOR_FIRST, YAW_AND_PITCH_FIRST])


@given(COMMANDS, TAILS, PRIORITY)
def test_what_is_granted_stays_within_every_fin_and_keeps_its_direction(command, fins, first):
    granted = share(command, fins.rows, fins.limits, first, MATH)
    # A fin that its group hardly moves, by entries of the mixing such as 6e-17, does not count as limited, in either of
    # the two later stages; the sums add a few units in the last place.
    beyond = 2.0 * ROUND_OFF + 4.0 * np.spacing(1.0)
    assert all(abs(a) <= limit + beyond for a, limit in zip(fins.fins(granted), fins.limits, strict=True))
    assert all(got * want >= 0.0 and abs(got) <= abs(want) for got, want in zip(granted, command, strict=True))
    if first == YAW_AND_PITCH_FIRST:
        assert granted[0] * command[1] == pytest.approx(granted[1] * command[0], abs=1e-15)


@given(COMMANDS, TAILS, PRIORITY)
def test_a_command_that_fits_column_by_column_is_granted_to_the_bit(command, fins, first):
    size = max(
        sum(abs(a * c) for a, c in zip(row, command, strict=True)) / limit
        for row, limit in zip(fins.rows, fins.limits, strict=True)
    )
    command = tuple(c / max(1.0, size * (1.0 + 1e-9)) for c in command)
    assert tuple(share(command, fins.rows, fins.limits, first, MATH)) == command


@given(COMMANDS)
def test_roll_gets_all_that_yaw_and_pitch_leave(command):
    granted = share(command, FINS.rows, FINS.limits, YAW_AND_PITCH_FIRST, MATH)
    full = max(abs(a) - limit for a, limit in zip(FINS.fins(granted), FINS.limits, strict=True)) >= -1e-9
    assert full or granted[2] == command[2]


def test_a_fin_at_its_limit_does_not_hold_a_group_that_does_not_move_it():
    # A cross tail: the elevator's mixing has 3e-17 on the rudder's fins, which are full.
    fins = allocation(read_craft("remus100"))
    granted = share((1.0, 0.1, 0.0), fins.rows, fins.limits, RUDDER_FIRST, MATH)
    assert granted == [pytest.approx(fins.limits[1]), 0.1, 0.0]


def test_without_a_pilot_the_orders_are_the_command_and_the_memory_rests():
    seen = Seen(**dict.fromkeys(Seen._fields, 0.3))
    orders = Orders(rudder=0.1, elevator=-0.2, steer=1.0, heading=1.0, track=1.0, dive=1.0, depth=5.0)
    assert flown(NO_PILOT, orders, seen, [0.1, 0.1, 0.1], MATH) == [0.1, -0.2, 0.0, 0.0, 0.0, 0.0, 0.3]


def test_line_of_sight_points_at_the_lookahead_and_its_integral_rests_on_the_leg():
    orders = Orders(**line((10.0, 0.0), (10.0, 50.0), lookahead=5.0, drift=0.1, crab=0.05))
    assert along(orders, 13.0, 20.0, MATH) == pytest.approx(20.0)
    assert across(orders, 13.0, 20.0, MATH) == pytest.approx(-3.0)  # north of a leg to the east: to port
    heading, rate = line_of_sight(orders, 13.0, 20.0, 0.0, MATH)
    assert heading == pytest.approx(np.pi / 2.0 - 0.05 + np.arctan(3.0 / 5.0))
    assert rate == pytest.approx(0.1 * 25.0 * -3.0 / (25.0 + 9.0))
    assert line_of_sight(orders, 10.0, 20.0, 1.0, MATH)[1] == pytest.approx(0.0, abs=1e-15)


def test_depth_orders_fade_out_towards_the_inversion_speed():
    pilot = Pilot("some", 2.0, reversal=1.0)
    assert [authority(pilot, u, MATH) for u in (0.5, 1.0, 1.025, 1.05, 2.0)] == pytest.approx([0, 0, 0.5, 1, 1])
    assert [authority(NO_PILOT, u, MATH) for u in (-1.0, 0.0, 1e-3, 2.0)] == [1.0] * 4
    assert design_pilot(synthetic.model(synthetic.SUBOFF, speed=0.5)).reversal == 0.0
    assert 0.5 < gained().reversal < gained().speed


def test_a_pilot_comes_back_from_its_file_as_it_was(tmp_path):
    pilot = replace(gained(), notes=("one", "two"), margins={**gained().margins, "free": (np.inf, 0.0, np.inf)})
    assert read_pilot(write_pilot(pilot, tmp_path / "pilot.json")) == pilot
    assert list(tmp_path.iterdir()) == [tmp_path / "pilot.json"]


@pytest.mark.parametrize("change", [
    {"gains": {}}, {"gains": None}, {"margins": {"heading": {}}}, {"eigenvalues": {"heading": [1.0]}}, {"notes": None},
])  # fmt: skip
def test_a_pilot_file_with_a_part_missing_is_refused_with_its_name(tmp_path, change):
    path = write_pilot(gained(), tmp_path / "pilot.json")
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ArtefactError, match=r"pilot\.json is not a whole pilot"):
        read_pilot(path)


def test_a_pilot_file_with_no_speed_is_refused(tmp_path):
    with pytest.raises(ArtefactError, match="speed cannot be used"):
        read_pilot(write_pilot(replace(gained(), speed=0.0), tmp_path / "pilot.json"))


def test_the_numbers_of_the_law_are_named_in_order():
    assert (GAINS[0], GAINS[-1], len(GAINS)) == ("speed", "reversal", 21)
    assert ORDERS[0] == "piloted"
    assert all(isinstance(getattr(NO_PILOT, name), float) for name in GAINS)
    assert all(isinstance(getattr(Orders(), name), float) for name in ORDERS)
    assert set(UNITS) == set(GAINS)
