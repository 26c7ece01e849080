"""Faults of a craft file: each is told once, with its dotted path, its limit and a remedy."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.craft.build import build
from towtank.craft.hydrostatics import check
from towtank.craft.library import craft_text, read_craft, write_craft_copy
from towtank.craft.reading import read_toml
from towtank.craft.template import template
from towtank.errors import ArtefactError, CraftError

NAME = "probe"


def write(tmp_path, *changes, text=None):
    """Template with lines changed: each change is (pattern, replacement) and must hit."""
    text = text or template(NAME)
    for pattern, replacement in changes:
        text, hits = re.subn(pattern, replacement, text, count=1, flags=re.MULTILINE)
        assert hits == 1, pattern
    path = tmp_path / "craft.toml"
    path.write_text(text, encoding="utf-8")
    return path


def fault(tmp_path, *changes, text=None):
    with pytest.raises(CraftError) as caught:
        read_craft(write(tmp_path, *changes, text=text))
    message = str(caught.value)
    for leak in ("pydantic", "Traceback", "validation error", "type=", "input_value"):
        assert leak not in message
    assert caught.value.exit_code == 2
    return message


def test_template_loads_as_it_is_and_passes_the_check(tmp_path):
    craft = read_craft(write(tmp_path))
    assert craft.name == NAME
    result = check(craft)
    assert result.sound
    assert [f.severity for f in result.findings] == ["note"]  # its numbers are all assumed, and it says so
    assert craft.unsourced == ()


def test_template_refuses_a_name_that_is_no_folder():
    with pytest.raises(CraftError, match="letters, digits"):
        template("../oops")


def test_negative_mass(tmp_path):
    message = fault(tmp_path, ('"53.84 kg"', '"-53.84 kg"'))
    assert "one fault" in message
    assert "mass.mass: -53.84 kg is not positive" in message


def test_zero_density(tmp_path):
    assert "conditions.density: 0 is not positive" in fault(tmp_path, ('"1026 kg/m\\^3"', "0"))


def test_cg_outside_the_hull_sideways(tmp_path):
    message = fault(tmp_path, ('z = "0.01 m"', 'z = "0.3 m"'))
    assert "mass.cg: the centre of gravity lies 0.3 m off the axis, outside the hull, whose radius is 0.1 m" in message


def test_cg_outside_the_hull_lengthwise(tmp_path):
    message = fault(tmp_path, ('x = "cb"', 'x = "2 m"'))
    assert "mass.cg: the centre of gravity lies -1.075 m aft of the nose, off the hull, which is 2 m long" in message


def test_fin_behind_the_tail(tmp_path):
    message = fault(tmp_path, ('"1.88 m"', '"2.1 m"'))
    assert "fins.trailing_edge: the root trailing edge lies 2.1 m aft of the nose, behind the tail at 2 m" in message
    assert "Move the fin forward by 0.1 m" in message
    assert "one fault" in message  # told once for the four fins of the shape


def test_fin_ahead_of_the_nose(tmp_path):
    message = fault(tmp_path, ('"1.88 m"', '"0.02 m"'))
    assert "fins.trailing_edge: the root leading edge lies" in message
    assert "ahead of the nose" in message


def test_fin_tip_inside_the_hull(tmp_path):
    message = fault(tmp_path, ('"1.88 m"', '"1.2 m"'), ('tip_radius    = "0.10 m"', 'tip_radius = "0.09 m"'))
    assert "fins.tip_radius: 0.09 m lies inside the hull, whose radius is 0.1 m there" in message


def test_fin_tip_inside_its_root(tmp_path):
    message = fault(tmp_path, ('tip_radius    = "0.10 m"', 'tip_radius = "0.04 m"'))
    assert "fins.tip_radius: 0.04 m is not beyond root_radius 0.05 m" in message


def test_duplicate_fin_names(tmp_path):
    message = fault(tmp_path, ('layout        = "x"', 'layout = "x"\nnames = ["a", "b", "a", "c"]'))
    assert "fins: 2 fins are named 'a'. Give each fin a name of its own." in message


def test_unknown_key_names_the_closest_one(tmp_path):
    message = fault(tmp_path, ("tip_chord     =", "tip_cord ="))
    assert "fins.tip_cord: unknown key. Did you mean tip_chord?" in message
    assert "fins.tip_chord: this key is missing (chord at the tip)" in message


def test_unknown_key_unlike_any_lists_them(tmp_path):
    message = fault(tmp_path, ("exponent   = 2 ", "exponent = 2\nzzz = 1 #"))
    assert "hull.zzz: unknown key. Known here: source, assumed, kind, nose" in message


def test_unknown_key_in_the_centre_of_gravity(tmp_path):
    assert "mass.cg.zz: unknown key. Did you mean z?" in fault(tmp_path, ("y = 0,", "y = 0, zz = 1,"))


def test_unknown_section(tmp_path):
    message = fault(tmp_path, (r"^# \[propeller\]", "[propellor]\n#"))
    assert "[propellor]: unknown section. Did you mean propeller?" in message


def test_missing_section(tmp_path):
    message = fault(tmp_path, text='[craft]\nname = "a"\n')
    for name in ("conditions", "hull", "mass"):
        assert f"[{name}]: this section is missing" in message


def test_bare_angle(tmp_path):
    message = fault(tmp_path, ('max_angle     = "25 deg"', "max_angle = 25"))
    assert "fins.max_angle: bare angle 25" in message
    assert '"25 deg"' in message


def test_bare_rate_of_turn(tmp_path):
    assert "fins.max_rate: bare angle 60" in fault(tmp_path, ('max_rate      = "60 deg/s"', "max_rate = 60"))


def test_bare_azimuth_says_which(tmp_path):
    message = fault(tmp_path, ('layout        = "x"', 'azimuths = ["0 deg", 120]'))
    assert "fins.azimuths[2]: bare angle 120" in message


@pytest.mark.parametrize("bad", ["nan", '"nan kg"', "inf"])
def test_nan_and_infinity(tmp_path, bad):
    message = fault(tmp_path, ('mass     = "53.84 kg"', f"mass = {bad}"))
    assert "mass.mass:" in message
    assert "is not finite" in message


def test_wrong_dimension(tmp_path):
    message = fault(tmp_path, ('nose       = "0.25 m"', 'nose = "0.25 kg"'))
    assert "hull.nose: '0.25 kg' cannot be converted to m" in message


def test_text_that_is_no_quantity(tmp_path):
    assert "hull.nose: 'long'" in fault(tmp_path, ('nose       = "0.25 m"', 'nose = "long"'))


def test_truth_value_is_no_number(tmp_path):
    assert "hull.nose: True is not a number" in fault(tmp_path, ('nose       = "0.25 m"', "nose = true"))


def test_length_in_a_wrong_unit(tmp_path):
    message = fault(tmp_path, ('nose       = "0.25 m"', 'nose = "250 km"'))
    assert "hull.nose: 250 km is no length of a craft: the limits are 1 micrometre and 10 km" in message


def test_hull_family_that_is_no_text(tmp_path):
    assert "hull.kind: ['myring'] is not a hull family" in fault(tmp_path, ('"myring" *$', '["myring"]'))


def test_unknown_hull_family(tmp_path):
    assert "hull.kind: 'mirring' is not a hull family. Did you mean myring?" in fault(
        tmp_path, ('"myring" *$', '"mirring"')
    )


def test_myring_tail_that_bulges(tmp_path):
    message = fault(tmp_path, ('"20 deg" ', '"60 deg" '))
    assert "hull.tail_angle: 60 deg makes the tail bulge" in message
    assert "below 31 deg" in message


def test_myring_cut_longer_than_the_tail(tmp_path):
    message = fault(tmp_path, ('tail       = "0.50 m"', 'tail = "0.50 m"\ntail_offset = "0.6 m"'))
    assert "hull.tail_offset: 0.6 m cuts away the whole tail of 0.5 m" in message


HULL = r"(?s)^kind       = .*?^exponent[^\n]*"


def test_offsets_out_of_order(tmp_path):
    table = 'kind = "offsets"\noffsets = [[0, 0], [1, 0.1], [0.5, 0.1], [2, 0]]'
    assert "hull.offsets: distances must be finite, start at 0 and rise" in fault(tmp_path, (HULL, table))


def test_offsets_with_a_hole(tmp_path):
    table = 'kind = "offsets"\noffsets = [[0, 0], [0.5, 0.1], [1, 0], [2, 0]]'
    assert "hull.offsets: a radius between the ends is not positive" in fault(tmp_path, (HULL, table))


def test_offsets_in_a_unit_that_is_no_length(tmp_path):
    table = 'kind = "offsets"\nunit = "kg"\noffsets = [[0, 0], [0.5, 0.1], [1, 0.1], [2, 0]]'
    assert "hull.unit: '1 kg' cannot be converted to m" in fault(tmp_path, (HULL, table))


def test_two_ways_to_state_buoyancy(tmp_path):
    message = fault(tmp_path, ("net_buoyancy_percent = 0.5", 'net_buoyancy_percent = 0.5\nbuoyancy = "neutral"'))
    assert "mass: net_buoyancy_percent and buoyancy are given together. Give exactly one" in message


def test_no_way_to_state_buoyancy(tmp_path):
    assert "mass: none of net_buoyancy_percent, buoyancy, volume is given" in fault(
        tmp_path, ("^net_buoyancy_percent = 0.5", "")
    )


def test_two_ways_to_place_fins(tmp_path):
    message = fault(tmp_path, ('layout        = "x"', 'layout = "x"\ncount = 3'))
    assert "fins: layout and count are given together. Give exactly one of layout, azimuths, count" in message


def test_signs_of_another_number_of_fins(tmp_path):
    assert "fins.signs: 2 given for 4 fins" in fault(tmp_path, (r"^# signs = \[1, 1, 1, 1\]", "signs = [1, -1]"))


def test_inertia_given_without_saying_about_what(tmp_path):
    assert "mass.inertia_about: this key is missing" in fault(
        tmp_path, ('inertia  = "uniform"', 'inertia = "uniform"\nixx = 1')
    )


def test_inertia_that_no_body_has(tmp_path):
    given = 'inertia_about = "cg"\nixx = 1\niyy = 1\nizz = 100'
    assert "mass: no body has these moments of inertia" in fault(tmp_path, ('inertia  = "uniform"', given))


def test_inertia_half_given(tmp_path):
    message = fault(tmp_path, ('inertia  = "uniform"', 'inertia_about = "cg"\nixx = 1'))
    assert 'mass: iyy, izz missing. Give them, or write inertia = "uniform"' in message


def test_section_with_camber(tmp_path):
    assert "fins.section: '2412' is not a symmetric NACA four-digit section" in fault(tmp_path, ('"0015" ', '"2412" '))


def test_assumed_key_that_does_not_exist(tmp_path):
    message = fault(tmp_path, (r"(layout .*\n)assumed       = true", r'\1assumed = ["hinje"]'))
    assert "fins.assumed: 'hinje' is no key of it. Did you mean hinge?" in message


def test_inline_table_with_a_wrong_key(tmp_path):
    message = fault(tmp_path, ('mass     = "53.84 kg"', "mass = { value = 50, sauce = 'x' }"))
    assert "mass.mass: an inline table holds value, source and assumed" in message


def test_propeller_table_out_of_order(tmp_path):
    bad = '[propeller]\ndiameter = "0.1 m"\ntable = [[0.5, 0.3, 0.05], [0.0, 0.4, 0.06]]\n#'
    assert "propeller.table: rows [J, KT, KQ] must be finite" in fault(tmp_path, (r"^# \[propeller\]", bad))


def test_origin_off_the_hull(tmp_path):
    bad = '[reference]\norigin_from_nose = "5 m"\n#'
    message = fault(tmp_path, (r"^# \[reference\]", bad), ('x = "cb"', "x = 3.9"))
    assert "reference.origin_from_nose: 5 m is off the hull" in message


def test_single_brackets_for_a_single_fin(tmp_path):
    assert "fin: write each single fin as [[fin]]" in fault(tmp_path, (r"^\[mass\]", '[fin]\nname = "a"\n[mass]'))


def test_fault_of_a_repeated_fin_names_its_number(tmp_path):
    fins = '[[fin]]\nname = "a"\nazimuth = "0 deg"\nroot_radius = 0.05\nroot_chord = 0.1\ntip_radius = 0.1\n'
    fins += 'tip_chord = 0.07\ntrailing_edge = 1.88\n[[fin]]\nname = "b"\n'
    message = fault(tmp_path, (r"^\[mass\]", fins + "[mass]"))
    assert "fin[2].azimuth: this key is missing" in message
    assert "fin[1]" not in message


def test_all_faults_are_told_at_once(tmp_path):
    message = fault(
        tmp_path,
        ('"53.84 kg"', '"-53.84 kg"'),
        ('max_angle     = "25 deg"', "max_angle = 25"),
        ('nose       = "0.25 m"', 'nos = "0.25 m"'),
    )
    assert "4 faults" in message
    for path in ("mass.mass:", "fins.max_angle:", "hull.nos:", "hull.nose:"):
        assert path in message


def test_faults_of_fins_are_told_beside_those_of_other_sections(tmp_path):
    message = fault(tmp_path, ('"53.84 kg"', '"-53.84 kg"'), ('"1.88 m"', '"2.1 m"'))
    assert "mass.mass:" in message
    assert "fins.trailing_edge:" in message


def test_fault_of_the_centre_of_gravity_is_told_beside_that_of_the_fins(tmp_path):
    message = fault(tmp_path, ('z = "0.01 m"', 'z = "0.3 m"'), ('"1.88 m"', '"2.1 m"'))
    assert "2 faults" in message
    assert "mass.cg:" in message
    assert "fins.trailing_edge:" in message


def test_file_that_is_not_toml(tmp_path):
    message = fault(tmp_path, text="[craft]\nname = hokie\n")
    assert "is not a TOML file" in message
    assert "line 2" in message


def test_empty_file(tmp_path):
    path = tmp_path / "craft.toml"
    path.write_bytes(b"")
    with pytest.raises(CraftError, match=r"\[craft\]: this section is missing"):
        read_craft(path)


def test_file_that_is_not_text(tmp_path):
    path = tmp_path / "craft.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CraftError, match="UTF-8"):
        read_craft(path)


def test_unknown_craft_names_the_closest_one():
    with pytest.raises(CraftError, match="Did you mean hokie") as caught:
        read_craft("hoki")
    assert "suboff-fins" in str(caught.value)


def test_copy_of_a_craft_file_is_verbatim_and_the_folder_reads_as_the_craft(tmp_path):
    path = write_craft_copy("hokie", tmp_path / "study")
    assert path.read_text(encoding="utf-8") == craft_text("hokie")
    assert read_craft(tmp_path / "study") == read_craft("hokie")


def test_copy_into_a_file_is_refused(tmp_path):
    blocked = tmp_path / "blocked"
    blocked.write_text("a file, not a folder")
    with pytest.raises(ArtefactError, match="cannot write"):
        write_craft_copy("hokie", blocked)


JUNK = [[], {}, "", 0, -1, 1e300, True, [[1]], "x y", "5 m", "30 deg", {"value": [1]}, ["a"], "{}", "%s", "1e400 m"]


@given(st.sampled_from(["template", "remus100", "suboff-fins"]), st.data())
@settings(max_examples=60, deadline=None)
def test_any_value_in_place_of_any_other_is_either_a_craft_or_a_taught_error(base, data):
    raw = read_toml(template(NAME) if base == "template" else craft_text(base), base)
    section = data.draw(st.sampled_from(sorted(raw)))
    key = data.draw(st.sampled_from(sorted(raw[section])))
    raw[section][key] = data.draw(st.sampled_from(JUNK))
    told = ""
    try:
        check(build(raw, base))
    except CraftError as error:
        told = str(error)
    assert not told or re.match(r"\S+ has (one fault|\d+ faults):\n  \S", told)
    assert "pydantic" not in told
