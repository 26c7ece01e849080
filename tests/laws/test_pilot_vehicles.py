"""Published gains of vehicles as pilots of a craft: what is kept exactly, and what is said to be missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import InputError, TrialError
from towtank.model.algebra import MATH
from towtank.pilot.allocation import allocation
from towtank.pilot.design import design_pilot
from towtank.pilot.files import read_pilot, write_pilot
from towtank.pilot.law import Seen, steer
from towtank.pilot.loops import judged
from towtank.pilot.orders import Orders
from towtank.pilot.vehicles import TorqueCascade, load_pilot, vehicles
from towtank.trials.steps import heading_step


@pytest.fixture(scope="module")
def craft():
    return synthetic.model(synthetic.SUBOFF, speed=2.0)


def asked(pilot, model, orders, memory=(0.0, 0.0, 0.0), **seen):
    fins = allocation(model.craft)
    eyes = Seen(**{name: seen.get(name, 1.7 if name == "u" else 0.0) for name in Seen._fields})
    return steer(pilot, fins, orders, eyes, memory, MATH)


TORQUES = sorted(name for name, scheme in vehicles().items() if isinstance(scheme, TorqueCascade))
SMALL = {"psi": 0.01, "r": 0.004, "q": 0.003, "theta": 0.02, "z": -0.01, "sink": 0.01, "phi": 0.01, "p": -0.02}
"""A small departure, so that no limit acts; roll is small enough that sin(phi) is phi."""


@pytest.mark.parametrize("name", TORQUES)
def test_the_fins_make_the_torques_that_the_vehicle_asks_for(craft, name):
    # The torques written out as the vehicle computes them; angle = torque / (effect of one fin x fins that make it),
    # positive yaw by rudder to starboard, which is negative here, positive pitch by elevator bow up, likewise.
    v, s = vehicles()[name], SMALL
    turn = v.heading[0] * -s["psi"] - v.heading[2] * s["r"]
    yaw = v.heading_rate[0] * (turn - s["r"])
    pitch_wanted = -(v.depth[0] * (0.0 - s["z"]) + v.depth[2] * -s["sink"])
    pitch = v.pitch[0] * (pitch_wanted - s["theta"]) - v.pitch[2] * s["q"]
    roll = -v.roll[0] * s["phi"] - v.roll[2] * s["p"]
    angles = [t / (e * n) for t, e, n in zip((roll, pitch, yaw), v.effect, v.moving, strict=True)]
    got = asked(load_pilot(name, craft), craft, Orders(piloted=1.0, steer=1.0, dive=1.0), **s).granted
    assert got == pytest.approx([-angles[2], -angles[1], angles[0]], rel=1e-3)


def test_the_depth_integral_moves_the_pitch_asked_for_as_on_the_vehicle(craft):
    # A standing error of 0.1 m: the vehicle's pitch reference falls at I e; the elevator follows by its pitch gain.
    v = vehicles()["lauv-marie-2026"]
    rates = asked(load_pilot("lauv-marie-2026", craft), craft, Orders(piloted=1.0, dive=1.0, depth=0.1)).memory_rates
    pitch_rate_wanted = -v.depth[1] * 0.1
    assert rates[1] == pytest.approx(-v.pitch[0] * pitch_rate_wanted / (v.effect[1] * v.moving[1]))


def test_the_rudder_of_the_pole_placement_is_its_formula(craft):
    s, pilot = vehicles()["mss-remus100"], load_pilot("mss-remus100", craft)
    e, r = 0.01, 0.004  # heading beyond the order, rate of turn; starboard positive
    sigma = r + 2.0 * s.turn_pole * e
    wanted, rate_wanted = -2.0 * s.turn_pole * e, -2.0 * s.turn_pole * r - s.turn_pole**2 * e
    starboard = (s.nomoto_time * rate_wanted + wanted - s.turn_gain * sigma) / s.nomoto_gain
    out = asked(pilot, craft, Orders(piloted=1.0, steer=1.0), psi=e, r=r)
    assert out.granted[0] == pytest.approx(-starboard, rel=1e-9)
    integral = s.turn_pole**2 * (1.0 + s.turn_gain) / s.nomoto_gain * e
    assert out.memory_rates[0] == pytest.approx(integral, rel=1e-9)
    # Pitch: a craft without damping and fins whose moment is M55 per radian would swing with the given w and zeta.
    M55 = np.linalg.inv(np.array(craft.constants.mass_inverse))[4, 4]
    assert -pilot.pitch == pytest.approx(M55 * 0.8**2)
    assert -pilot.pitch_rate == pytest.approx(2.0 * 0.8 * 0.8 * M55)


@pytest.mark.parametrize("name", vehicles())
def test_gains_of_vehicles_are_constant_over_speed_and_say_what_is_missing(craft, name, tmp_path):
    pilot = load_pilot(name, craft)
    order = Orders(piloted=1.0, steer=1.0)
    slow, fast = (asked(pilot, craft, order, psi=1e-3, u=u).granted[0] for u in (0.8, 3.0))
    assert slow == fast != 0.0
    assert any("Not as on the vehicle" in note for note in pilot.notes)
    assert vehicles()[name].source in pilot.notes[0]
    assert read_pilot(write_pilot(pilot, tmp_path / "pilot.json")) == pilot


def test_what_the_source_does_not_give_is_named(craft):
    assert any("Assumed" in note and "heading" in note for note in load_pilot("lauv-xplore-1", craft).notes)
    assert any("no integral of pitch (0.09)" in note for note in load_pilot("lauv-noptilus-1", craft).notes)
    assert not any("Assumed" in note for note in load_pilot("lauv-default", craft).notes)


def test_gains_that_do_not_stabilise_another_craft_are_flown_and_told(craft):
    # Reference gains of a craft of 32 kg on one of 4.9 t.
    pilot = load_pilot("mss-remus100", craft)
    unstable = [loop for loop, values in pilot.eigenvalues.items() if values[0].real >= 0.0]
    assert unstable
    for loop in unstable:
        assert any("Not stable" in note and loop in note for note in pilot.notes)
    assert heading_step(craft, "30 deg", pilot=pilot, lengths=10.0).provenance["notes"] == list(pilot.notes)


def test_judged_loops_are_those_of_the_design(craft):
    pilot = design_pilot(craft)
    again = judged(craft, replace(pilot, eigenvalues={}, margins={}))
    for loop, values in pilot.eigenvalues.items():
        assert np.sort_complex(again.eigenvalues[loop]) == pytest.approx(np.sort_complex(values), rel=1e-6)
        assert again.margins[loop] == pytest.approx(pilot.margins[loop], rel=1e-6)
    assert again.notes == pilot.notes


def test_a_name_that_is_not_there_and_a_craft_without_fins(craft):
    with pytest.raises(InputError, match="Did you mean lauv-marie-2026"):
        load_pilot("lauv-marie", craft)
    with pytest.raises(TrialError, match="no fins"):
        load_pilot("lauv-default", replace(craft, craft=replace(craft.craft, fins=())))
    with pytest.raises(InputError, match="no fins"):
        judged(replace(craft, craft=replace(craft.craft, fins=())), design_pilot(craft))
