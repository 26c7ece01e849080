"""What a craft file means: the same craft written in different ways, and where its numbers come from."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.craft.build import build
from towtank.craft.hydrostatics import check, hydrostatics
from towtank.craft.reading import read_toml
from towtank.craft.schema import HULLS, SECTIONS
from towtank.craft.template import template
from towtank.water import GRAVITY


def craft(*changes):
    text = template("probe")
    for pattern, replacement in changes:
        text, hits = re.subn(pattern, replacement, text, count=1, flags=re.MULTILINE)
        assert hits == 1, pattern
    return build(read_toml(text, "probe"), "probe")


def azimuths(c):
    return sorted(round(float(np.degrees(fin.azimuth)), 9) for fin in c.fins)


def test_layout_count_and_azimuths_say_the_same():
    layout = 'layout        = "x"'
    expected = [45.0, 135.0, 225.0, 315.0]
    assert azimuths(craft()) == expected
    assert azimuths(craft((layout, 'count = 4\nfirst_azimuth = "45 deg"'))) == expected
    assert azimuths(craft((layout, 'azimuths = ["-45 deg", "45 deg", "0.75 turn / 2", "225 deg"]'))) == expected
    assert azimuths(craft((layout, 'layout = "plus"'))) == [0.0, 90.0, 180.0, 270.0]
    assert azimuths(craft((layout, "count = 3"))) == [0.0, 120.0, 240.0]


def test_single_fins_say_the_same_as_one_repeated_shape():
    shape = re.search(r"^root_radius.*?^time_constant[^\n]*", template("a"), re.S | re.M).group()
    single = "".join(
        f'[[fin]]\nassumed = true\nname = "fin-{n}"\nazimuth = "{a} deg"\n{shape}\n' for n, a in ((1, 0), (2, 120))
    )
    one = craft((r"(?s)^\[fins\].*?^\[mass\]", single + "[mass]"))
    other = craft(('layout        = "x"', 'azimuths = ["0 deg", "120 deg"]'))
    assert one.fins == other.fins
    assert one.mass == other.mass


def test_signs_are_kept_with_their_fins():
    c = craft((r"^# signs = \[1, 1, 1, 1\]", "signs = [1, -1, 1, -1]"))
    assert [fin.sign for fin in c.fins] == [1.0, -1.0, 1.0, -1.0]


@given(percent=st.floats(-20.0, 20.0))
@settings(max_examples=10, deadline=None)
def test_buoyancy_as_percent_force_and_volume_is_one_number(percent):
    displaced = 53.84 * (1.0 + percent / 100.0)
    line = r"^net_buoyancy_percent = 0.5"
    by_percent = craft((line, f"net_buoyancy_percent = {percent!r}"))
    by_force = craft((line, f"buoyancy = '{displaced * GRAVITY!r} N'"))
    by_volume = craft((line, f"volume = {displaced / 1026.0!r}"))
    for c in (by_percent, by_force, by_volume):
        assert c.mass.displaced_mass == pytest.approx(displaced, rel=1e-12)


def test_heavy_craft_has_negative_net_buoyancy():
    c = craft((r"^net_buoyancy_percent = 0.5", "net_buoyancy_percent = -0.5"))
    assert c.mass.displaced_mass < c.mass.mass
    assert hydrostatics(c).net_buoyancy_percent == pytest.approx(-0.5)


def test_inertia_about_cg_and_about_the_origin_differ_by_the_parallel_axes():
    cg = 'cg       = { x = 0.02, y = 0, z = "0.01 m" }'
    line = (r"^cg .*$", cg)
    numbers = "ixx = 0.3\niyy = 16\nizz = 16\nixz = 0.05"
    about_cg = np.array(craft(line, ('inertia  = "uniform"', f'inertia_about = "cg"\n{numbers}')).mass.inertia)
    about_origin = np.array(craft(line, ('inertia  = "uniform"', f'inertia_about = "origin"\n{numbers}')).mass.inertia)
    r = np.array([0.02, 0.0, 0.01])
    assert about_cg - about_origin == pytest.approx(53.84 * (r @ r * np.eye(3) - np.outer(r, r)), abs=1e-12)
    assert about_origin[0, 2] == about_origin[2, 0] == -0.05  # the tensor holds minus the product


def test_craft_trimmed_level_has_its_centre_of_gravity_under_that_of_buoyancy():
    c = craft((r"^# \[reference\]", '[reference]\norigin_from_nose = "0.9 m"\n#'))
    assert c.mass.cg[0] == pytest.approx(hydrostatics(c).cb[0])
    assert c.mass.cg[0] == pytest.approx(0.9 - hydrostatics(c).cb_from_nose)
    assert hydrostatics(c).trim == 0.0


def test_odd_fins_move_the_centre_of_buoyancy_off_the_axis_to_their_side():
    c = craft(('layout        = "x"', 'azimuths = ["0 deg"]'))
    assert hydrostatics(c).cb[1] > 0.0
    assert hydrostatics(c).cb[2] == pytest.approx(0.0, abs=1e-12)
    assert c.symmetry == "none"


def test_centre_of_gravity_above_that_of_buoyancy_is_an_error_of_the_check():
    result = check(craft(('z = "0.01 m"', 'z = "-0.01 m"')))
    errors = [f for f in result.findings if f.severity == "error"]
    assert [f.where for f in errors] == ["mass.cg"]
    assert "the craft turns over at rest" in errors[0].message
    assert not result.sound


def test_mass_far_from_the_displacement_is_an_error_of_the_check():
    result = check(craft(('"53.84 kg"', '"60 kg"')))
    assert (result.findings[0].severity, result.findings[0].where) == ("error", "mass")
    assert "The limit is 5 %" in result.findings[0].message


def test_bow_heavy_craft_is_told_its_trim():
    result = check(craft(('x = "cb"', "x = 0.01")))
    messages = [f.message for f in result.findings if f.severity == "warning"]
    assert len(messages) == 1
    assert "45.0 deg bow down" in messages[0]  # CG 10 mm ahead and 10 mm below


def test_stubby_hull_is_outside_the_range_of_the_fast_tank():
    hull = (r"(?s)^kind       = .*?^exponent[^\n]*", 'kind = "ellipsoid"\nassumed = true\nlength = 2\ndiameter = 0.5')
    result = check(craft(hull, ('"1.88 m"', '"1.5 m"'), ('tip_radius    = "0.10 m"', 'tip_radius = "0.25 m"')))
    assert any("length over diameter is 4" in f.message for f in result.findings)


def test_slow_small_craft_is_told_its_reynolds_number():
    assert any(f.where == "conditions.speed" for f in check(craft(('"1.5 m/s"', '"0.1 m/s"'))).findings)


def test_numbers_are_sorted_into_assumed_sourced_and_unsourced():
    c = craft(
        (r"(\[mass\]\n(#.*\n)*)assumed  = true", r"\1source = 'scales'"),
        ('mass     = "53.84 kg"', 'mass = { value = "53.84 kg", source = "crane" }'),
        ("net_buoyancy_percent = 0.5", "net_buoyancy_percent = { value = 0.5, assumed = true }"),
        (r'"1.5 m/s" ', '{ value = "1.5 m/s", assumed = false }'),
        (r"(\[hull\]\n(#.*\n)*kind .*\n)assumed    = true", r"\1assumed = ['nose']"),
    )
    assert "mass.net_buoyancy_percent" in c.assumed
    assert "mass.mass" not in c.assumed
    assert dict(c.sources)["mass.mass"] == "crane"
    assert dict(c.sources)["mass"] == "scales"
    assert "mass.ixx" in c.assumed  # estimated, so assumed whatever the section says
    assert "hull.nose" in c.assumed
    assert {"hull.middle", "hull.tail", "hull.diameter", "conditions.speed"} <= set(c.unsourced)
    assert not any(name.startswith("mass") for name in c.unsourced)
    told = [f.message for f in check(c).findings if "without source" in f.message]
    assert len(told) == 1
    assert "hull.diameter" in told[0]


def test_what_the_file_leaves_out_is_recorded_as_assumed():
    c = craft((r"^hinge .*$", ""), (r"^density .*$", ""))
    assert {"fins.hinge", "conditions.density"} <= set(c.assumed)
    assert "fresh water at 25 C" in dict(c.sources)["conditions.density"]


def test_offsets_may_be_in_feet():
    hull = r"(?s)^kind       = .*?^exponent[^\n]*"
    rows = "[[0, 0], [1, 0.25], [3, 0.33], [5, 0.25], [6.6, 0.05]]"
    c = craft((hull, f'kind = "offsets"\nunit = "ft"\nassumed = true\noffsets = {rows}'))
    assert c.length == pytest.approx(6.6 * 0.3048)
    assert float(c.profile.radius(3 * 0.3048)) == pytest.approx(0.33 * 0.3048)
    assert "hull.offsets" in c.assumed


def test_propeller_table_is_read():
    c = craft((r"^# \[propeller\]", '[propeller]\ndiameter = "0.12 m"\ntable = [[0, 0.4, 0.06], [0.7, 0.1, 0.03]]\n#'))
    assert c.propeller.table == ((0.0, 0.4, 0.06), (0.7, 0.1, 0.03))
    assert c.propeller.position == pytest.approx(c.length)


def test_every_key_of_the_schema_is_in_the_reference_page():
    from pathlib import Path

    page = Path(__file__).parents[2].joinpath("docs", "craft.md").read_text(encoding="utf-8")
    models = [*SECTIONS.values(), *HULLS.values()]
    for model in models:
        for key in model.model_fields:
            assert f"`{key}`" in page, f"{model.__doc__} {key}"
