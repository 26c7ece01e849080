"""A sound set passes every check; each planted fault is found by the check made for it, and by none that it leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from consistency_cases import BODY, REFERENCE, SOUND, a_set, correlated, found, sound, without
from hypothesis import given, settings
from hypothesis import strategies as st

from towtank.craft.library import read_craft
from towtank.derive.agreement import compare
from towtank.derive.check import FAIL, NOT_APPLICABLE, PASS, WARN
from towtank.derive.consistency import consistency
from towtank.derive.convert import about_point
from towtank.derive.magnitudes import lamb_surge
from towtank.derive.published import stated
from towtank.derive.table import Reference
from towtank.errors import DeriveError
from towtank.model.values import to_variant
from towtank.symbols import TERMS

ABOVE = {
    "one half of M_A turned": ({"Nvdot": -20.0, "Mwdot": 20.0, "Zqdot": 20.0}, {"symmetry of M_A": WARN}),
    "half of M_A about another point": ({"Yrdot": 200.0, "Zqdot": -200.0}, {"symmetry of M_A": FAIL}),
    "coupling beyond the diagonal": (
        {"Yrdot": 600.0, "Nvdot": 600.0, "Zqdot": -600.0, "Mwdot": -600.0},
        {"-M_A positive definite": FAIL},
    ),
    "sway added mass turned": (
        {"Yvdot": 600.0, "Zwdot": 600.0},
        {"-M_A positive definite": FAIL, "signs: Yvdot": FAIL, "signs: Zwdot": FAIL},
    ),
    "decimal point of Zww": ({"Zww": -68.0}, {"planes: Zww against Yvv": FAIL, "cross-flow arm: Mqq": WARN}),
    "Mqq doubled": ({"Mqq": -1360.0}, {"planes: Mqq against Nrr": FAIL}),
    "Muw turned": ({"Muw": -466.0}, {"planes: Muw against Nuv": FAIL, "signs: Muw": WARN}),
    "third order turned": ({"Yvvv": -300.0, "Zwww": 300.0}, {"planes: Zwww against Yvvv": FAIL}),
    "a fifth between the planes": ({"Zuw": -72.0}, {"planes: Zuw against Yuv": WARN}),
    "roll damping turned": ({"Kpp": 2.0, "Kup": 3.0}, {"signs: Kpp": FAIL, "signs: Kup": FAIL}),
    "rudder turned": ({"Yuudr": -40.0, "Zuude": 40.0}, {"signs: Yuudr": FAIL, "signs: Zuude": FAIL}),
    "fins ahead": ({"Nuudr": 76.0, "Muude": 76.0}, {"signs: Nuudr": WARN, "signs: Muude": WARN}),
    "Xvr lost": ({"Xvr": 100.0, "Xwq": -100.0}, {"lumped identity: Xvr": WARN, "lumped identity: Xwq": WARN}),
    "Xvr turned": ({"Xvr": -560.0, "Xwq": 560.0}, {"lumped identity: Xvr": FAIL, "lumped identity: Xwq": FAIL}),
    "Xrr far off": ({"Xrr": 3000.0, "Xqq": 3000.0}, {"lumped identity: Xrr": WARN, "lumped identity: Xqq": WARN}),
    "Yur turned": ({"Yur": -134.0, "Zuq": 134.0}, {"Galilean invariance: Yur": FAIL, "Galilean invariance: Zuq": FAIL}),
    "cross-flow tenfold": (
        {"Yvv": -6800.0, "Zww": -6800.0},
        {"cross-flow: Yvv": FAIL, "cross-flow: Zww": FAIL},
    ),
    "rotation tenfold": (
        {"Nrr": -6800.0, "Mqq": -6800.0},
        {"cross-flow: Nrr": FAIL, "cross-flow: Mqq": FAIL, "cross-flow arm: Nrr": WARN, "cross-flow arm: Mqq": WARN},
    ),
    "moment beyond the hull": (
        {"Nvv": 2000.0, "Mww": -2000.0},
        {"cross-flow arm: Nvv": FAIL, "cross-flow arm: Mww": FAIL},
    ),
    "surge of another body": ({"Xudot": -250.0}, {"added mass: Xudot": FAIL}),
}  # fmt: skip


def verdicts(d, craft=None):
    return {check.name: check.verdict for check in consistency(d, craft)}


def test_a_sound_set_passes_every_check():
    assert found(sound()) == set()
    assert found(sound(), NOT_APPLICABLE) == {"sway against steady drift"}


@pytest.mark.parametrize(("changes", "expected"), ABOVE.values(), ids=ABOVE)
def test_a_planted_fault_is_found(changes, expected):
    got = verdicts(sound(**changes))
    assert {name: got.get(name) for name in expected} == expected


@pytest.mark.parametrize("fault", ["decimal point of Zww", "roll damping turned", "rudder turned", "Xvr lost",
                                   "a fifth between the planes", "Yur turned", "Mqq doubled"])  # fmt: skip
def test_checks_that_a_fault_leaves_alone_do_not_speak(fault):
    changes, expected = ABOVE[fault]
    allowed = {"cross-flow: Zww", "cross-flow arm: Mqq", "cross-flow: Mqq"}
    assert found(sound(**changes)) - allowed <= set(expected)


def test_water_that_gives_energy_to_a_body_in_steady_motion_is_found():
    """Nuv with the Munk moment twice, less damping: the coupling of sway and yaw outweighs it."""
    changes = {"Nuv": -1046.0, "Muw": 1046.0, "Yvv": -70.0, "Zww": -70.0, "Yuv": -10.0, "Zuw": -10.0}
    got = verdicts(sound(**changes))
    assert got["energy"] == FAIL
    assert got["Munk moment: Nuv"] == WARN
    assert verdicts(sound())["energy"] == PASS


def test_energy_of_a_potential_body_with_drag_is_that_of_its_drag():
    """Potential flow does no work in steady motion: what is left of the power is the resistance, -u^3 in its units."""
    names = ("Xudot", "Yvdot", "Zwdot", "Mqdot", "Nrdot", "Yrdot", "Nvdot", "Zqdot", "Mwdot")
    values = {name: SOUND[name] for name in names} | {"Xuu": -9.0, "Xvr": 600.0, "Xrr": -20.0, "Xwq": -600.0,
              "Xqq": -20.0, "Yuv": 0.0, "Nuv": -580.0, "Yur": -20.0, "Nur": 20.0, "Zuw": 0.0, "Muw": 580.0,
              "Zuq": 20.0, "Muq": 20.0}  # fmt: skip
    energy = next(check for check in consistency(a_set(values)) if check.name == "energy")
    # the largest of -cos(beta)^3 over 20 deg of drift
    assert energy.value == pytest.approx(-(np.cos(np.radians(20.0)) ** 3), rel=1e-12)


def test_a_gap_within_two_standard_uncertainties_passes():
    gap = {"Zww": -400.0}
    assert "planes: Zww against Yvv" in found(sound(**gap))
    loose = a_set(SOUND | gap, std={"Zww": 150.0})
    assert "planes: Zww against Yvv" not in found(loose)
    assert "signs: Kpp" not in found(a_set(SOUND | {"Kpp": 0.2}, std={"Kpp": 0.15}))
    assert "cross-flow: Yvv" not in found(a_set(SOUND | {"Yvv": -2000.0, "Zww": -2000.0}, std={"Yvv": 400.0}))


def test_what_two_terms_share_does_not_excuse_their_gap():
    """An error common to both planes moves both: the uncertainty of the gap is zero, however large each of them is."""
    assert "planes: Zww against Yvv" in found(correlated(sound(Zww=-400.0), ("Zww", "Yvv"), 500.0))


def test_a_small_term_is_not_held_to_a_large_share():
    """Yrr changes the sway force of a lively turn by less than 2 %: its planes may differ by a half."""
    assert found(sound(Zqq=-25.0)) == set()


def test_verdicts_do_not_depend_on_units_or_on_the_point():
    """The same body in a model scale of 1:5, in other water, at another speed; and seen from another point."""
    scale, density = 0.2, 1.4
    here = sound()
    values = {}
    small = Reference(REFERENCE.length * scale, 0.7, REFERENCE.density * density, REFERENCE.origin_from_nose * scale)
    for name, value in SOUND.items():
        full = TERMS[name].prime_factor(REFERENCE.density, REFERENCE.length, REFERENCE.speed)
        values[name] = value / full * TERMS[name].prime_factor(small.density, small.length, small.speed)
    body = {"displaced_mass": BODY["displaced_mass"] * density * scale**3, "diameter": BODY["diameter"] * scale}
    there = stated("model", values, small, quality={"symmetry": "fourfold", "body": body})
    for one, other in zip(consistency(here), consistency(there), strict=True):
        assert (one.name, one.verdict) == (other.name, other.verdict)
        assert (one.value is None) == (other.value is None)
        if one.value is not None:
            assert one.value == pytest.approx(other.value, rel=1e-9, abs=1e-12)
    moved = about_point(here, 1.9 + 0.1)
    assert found(moved) == set()


def test_turn_and_drift_hold_one_lift_whatever_the_point():
    """Yur and Nuv both change by the arm times Yuv: their gap does not depend on the origin."""
    checks = [
        next(c for c in consistency(about_point(sound(), point)) if c.name == "Galilean invariance")
        for point in (1.9, 1.2, 2.6)
    ]
    assert [c.value for c in checks] == pytest.approx([checks[0].value] * 3, rel=1e-9)


def test_both_variants_have_the_same_verdicts():
    split = to_variant(sound(Yur=-134.0, Zuq=134.0), "split")
    assert verdicts(split) == verdicts(sound(Yur=-134.0, Zuq=134.0))
    assert verdicts(to_variant(sound(), "split")) == verdicts(sound())


def test_missing_terms_are_not_applicable_not_wrong():
    few = consistency(a_set({"Yuv": -60.0, "Nuv": -466.0}, symmetry="", body={}))
    assert {check.verdict for check in few} == {PASS, NOT_APPLICABLE}
    assert found(without("Xuu"), NOT_APPLICABLE) >= {"energy"}
    assert "Xuu" in next(c.words for c in consistency(without("Xuu")) if c.name == "energy")


def test_planes_of_a_craft_that_is_not_fourfold_may_differ():
    box = a_set(SOUND | {"Zww": -68.0}, symmetry="port-starboard")
    assert verdicts(box)["planes agree"] == NOT_APPLICABLE
    unknown = verdicts(a_set(SOUND | {"Zww": -68.0}, symmetry=""))
    assert unknown["planes: Zww against Yvv"] == WARN


def test_most_signs_turned_points_to_the_sense_of_the_file():
    left = a_set({name: -value for name, value in SOUND.items()})
    words = {c.name: c.words for c in consistency(left)}
    assert "left-hand side" in words["signs: Yuv"]


def test_a_craft_gives_sizes_and_symmetry():
    craft = read_craft("suboff-fins")
    reference = Reference(craft.length, 3.0, craft.water.density, craft.origin_from_nose)
    values = {"Yvdot": -640.0, "Nrdot": -420.0, "Xudot": -26.0, "Yvv": -690.0, "Nrr": -950.0, "Kpdot": -3.5}
    got = verdicts(stated("suboff-fins", values, reference), craft)
    assert got["added mass: Kpdot"] == WARN
    assert got["size of cross-flow drag"] == PASS
    assert verdicts(stated("suboff-fins", values, reference))["size of added masses"] == NOT_APPLICABLE
    with pytest.raises(DeriveError, match="about a point"):
        consistency(stated("suboff-fins", values, replace(reference, origin_from_nose=0.0)), craft)


@pytest.mark.parametrize(("ratio", "k1"), [(1.0000001, 0.5), (4.0, 0.0816), (6.0, 0.0454), (10.0, 0.0207)])
def test_surge_added_mass_is_lambs(ratio, k1):
    # table of lamb1932 art. 115: four digits; the sphere is reached within the round-off of 1 - e^2
    assert lamb_surge(ratio) == pytest.approx(k1, abs=6e-4)


def test_sway_that_remembers_is_told_apart_from_steady_drift():
    quality = {"sensitivity": {
        "Yuv": {"0": -120.0, "1": -60.0}, "Yvv": {"0": -680.0, "1": -680.0},
        "Nuv": {"0": -466.0, "1": -466.0}, "Nvv": {"0": 60.0, "1": 60.0},
    }}  # fmt: skip
    assert verdicts(a_set(SOUND, **quality))["sway against steady drift"] == WARN
    # Yuv and Yvv exchange a share without a change of the load at 10 deg
    quality["sensitivity"]["Yuv"]["0"] = -60.0 - 170.0 * np.tan(np.radians(10.0))
    quality["sensitivity"]["Yvv"]["0"] = -680.0 + 170.0
    assert verdicts(a_set(SOUND, **quality))["sway against steady drift"] == PASS


def test_recorded_gaps_are_judged_where_the_fit_averaged_the_halves():
    gaps = {"Yrdot - Nvdot": {"difference": 200.0, "std": 1.0}}
    assert verdicts(a_set(SOUND, symmetry_gaps=gaps))["symmetry of M_A"] == FAIL
    assert verdicts(a_set(SOUND, std={"Yrdot": 120.0}, symmetry_gaps=gaps))["symmetry of M_A"] == PASS


def test_sets_are_compared_in_combined_standard_uncertainties():
    one = a_set(SOUND, std={"Yuv": 3.0, "Nuv": 20.0, "Yur": 4.0})
    other = a_set(SOUND | {"Yuv": -74.0, "Nuv": -490.0, "Yur": 121.0}, std={"Yuv": 4.0, "Yur": 10.0})
    got = {c.name: c for c in compare(one, other)}
    assert got["agreement: Yuv"].verdict == WARN
    assert got["agreement: Yuv"].value == pytest.approx(14.0 / 5.0)
    assert got["agreement: Yur"].value == pytest.approx(27.0 / np.hypot(4.0, 10.0))
    rest = got["published against published: the others"]
    assert (rest.verdict, rest.value) == (PASS, pytest.approx(24.0 / 20.0))
    far = {c.name: c for c in compare(one, a_set({"Yuv": -90.0}))}
    assert far["agreement: Yuv"].verdict == FAIL


def test_comparison_converts_point_scale_and_variant():
    std = {name: 0.01 * abs(value) for name, value in SOUND.items()}
    here = a_set(SOUND, std=std)
    there = to_variant(about_point(here, 1.4), "split")
    assert {c.verdict for c in compare(here, there)} <= {PASS, NOT_APPLICABLE}
    with pytest.raises(DeriveError, match="no term in common"):
        compare(a_set({"Yuv": -1.0}), a_set({"Kpp": -1.0}))


def test_a_set_that_cannot_be_read_is_refused():
    with pytest.raises(DeriveError, match="not finite"):
        consistency(sound(Yuv=float("nan")))
    with pytest.raises(DeriveError, match="unknown terms banana"):
        consistency(replace(sound(), names=("banana", *sound().names[1:])))


def test_every_check_is_a_document_with_five_keys():
    for check in consistency(sound(Zww=-68.0)):
        content = check.document()
        assert list(content) == ["check", "verdict", "value", "limit", "words"]
        assert content["words"]


@given(
    # A coefficient is zero or not; one of 1e-308 overflows a ratio of two, and no craft has it.
    values=st.dictionaries(
        st.sampled_from(list(TERMS)),
        st.floats(-1e6, 1e6).map(lambda value: value if abs(value) > 1e-100 else 0.0),
        min_size=1,
    ),
    spread=st.sampled_from([0.0, 0.3]),
    symmetry=st.sampled_from(["", "fourfold", "mirror"]),
    body=st.sampled_from([{}, BODY, {"diameter": 9.0}]),
)
@settings(max_examples=60, deadline=None)
def test_any_set_has_verdicts_in_finite_numbers(values, spread, symmetry, body):
    std = {name: spread * abs(value) for name, value in values.items()}
    d = a_set(values, std=std, symmetry=symmetry, body=body)
    for check in (*consistency(d), *compare(d, d)):
        assert check.verdict in (PASS, WARN, FAIL, NOT_APPLICABLE)
        assert check.value is None or np.isfinite(check.value)
    assert all(check.verdict in (PASS, NOT_APPLICABLE) for check in compare(d, d))
