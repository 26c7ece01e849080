"""Library crafts against the numbers of their sources."""

import numpy as np
import pytest

from towtank.craft.hydrostatics import check, hydrostatics
from towtank.craft.library import library_names, read_craft

LIBRARY = ("hokie", "remus100", "spheroid-6-1", "suboff-bare", "suboff-fins", "suboff-x")


def test_the_library_holds_these_crafts():
    assert library_names() == LIBRARY


@pytest.mark.parametrize("name", LIBRARY)
def test_every_number_of_the_library_has_a_source_or_is_marked_assumed(name):
    craft = read_craft(name)
    assert craft.unsourced == ()
    assert craft.name == name
    assert check(craft).sound


def test_hokie_is_the_craft_of_table_3_1():
    craft = read_craft("hokie")
    assert craft.length == pytest.approx(8.15)
    assert craft.diameter == pytest.approx(0.945)
    assert np.pi * craft.diameter**2 / 4.0 == pytest.approx(0.7014, abs=5e-5)
    assert craft.mass.mass == 4857.12
    assert craft.mass.cg == pytest.approx((0.0, 0.0, 0.0508))
    assert craft.water.reynolds(craft.speed, craft.length) == pytest.approx(9e6, rel=0.05)  # "about 9e6"
    assert craft.mass.displaced_mass / craft.mass.mass == pytest.approx(0.995)  # half a percent heavy


def test_hokie_hull_and_fins_displace_what_mass_and_buoyancy_ask_for():
    h = hydrostatics(read_craft("hokie"))
    assert h.balance_percent == pytest.approx(0.0, abs=0.01)
    assert h.restoring == pytest.approx(2419.7, rel=1e-4)  # m g zG, the roll and pitch stiffness


def test_hokie_shape_and_inertia_are_marked_assumed_and_its_mass_is_not():
    assumed = read_craft("hokie").assumed
    for name in ("hull.tail", "fins.tip_chord", "fins.section", "fins.max_angle", "mass.ixx", "mass.izz"):
        assert name in assumed
    for name in ("mass.mass", "mass.cg.z", "mass.net_buoyancy_percent", "hull.diameter"):
        assert name not in assumed


def test_hokie_fins_are_numbered_as_in_perron():
    craft = read_craft("hokie")
    assert [fin.name for fin in craft.fins] == ["top-port", "top-starboard", "bottom-port", "bottom-starboard"]
    sides = [(np.sign(fin.span_direction[1]), np.sign(fin.span_direction[2])) for fin in craft.fins]
    assert sides == [(-1, -1), (1, -1), (-1, 1), (1, 1)]  # y to starboard, z down


def test_hokie_fin_tips_lie_at_the_hull_radius():
    craft = read_craft("hokie")
    assert [fin.tip_radius for fin in craft.fins] == pytest.approx([0.5 * craft.diameter] * 4)


def test_remus_myring_form_has_the_volume_and_length_of_its_parameters():
    craft = read_craft("remus100")
    h = hydrostatics(craft)
    assert craft.length == pytest.approx(1.3327, abs=1e-4)
    assert h.hull_volume == pytest.approx(0.03164, rel=1e-3)  # strip sum of the transcribed form: 0.03164 m3
    assert h.cb_from_nose == pytest.approx(0.611, rel=0.005)  # prestero2001; hull and fins give 0.609


def test_remus_fins_have_the_area_span_and_taper_of_prestero():
    from towtank.craft.integrals import fin_integrals

    craft = read_craft("remus100")
    fin = craft.fins[0]
    trapezoid = 0.5 * (fin.root_chord + fin.tip_chord) * (fin.tip_radius - fin.root_radius)
    assert trapezoid == pytest.approx(0.00665, rel=2e-3)
    # The tapering tail covers a corner of the trapezoid, 2.6 percent of it.
    assert fin_integrals(fin, craft.profile).exposed_area == pytest.approx(0.00665, rel=0.03)
    assert fin.tip_radius - fin.root_radius == pytest.approx(0.0857, abs=1e-4)
    assert fin.tip_chord / fin.root_chord == pytest.approx(0.654, abs=1e-3)
    post = fin.trailing_edge - (1.0 - fin.hinge) * 0.5 * (fin.root_chord + fin.tip_chord)
    assert post == pytest.approx(0.611 + 0.638, abs=1e-3)


def test_remus_displacement_mismatch_is_told():
    findings = [f for f in check(read_craft("remus100")).findings if f.where == "mass"]
    assert [f.severity for f in findings] == ["warning"]
    assert "31.611 kg" in findings[0].message
    assert "The limit is 0.5 %" in findings[0].message


def test_remus_fins_outside_the_wake_are_told():
    notes = [f.message for f in check(read_craft("remus100")).findings if f.where == "fins"]
    assert len(notes) == 1
    assert "outside the wake" in notes[0]


def test_remus_inertia_is_that_of_prestero_about_the_centre_of_buoyancy():
    assert np.diag(read_craft("remus100").mass.inertia) == pytest.approx((0.177, 3.45, 3.45))
