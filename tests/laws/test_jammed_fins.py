"""A mission with one fin jammed: symmetry, what it costs, and why it is not completed where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import synthetic_craft as synthetic
from towtank.errors import ArtefactError, InputError
from towtank.report.build import page
from towtank.report.study import gather
from towtank.trials.jammed import HELD, jammed_fins
from towtank.trials.jammed_files import read_jammed, write_jammed


@pytest.fixture(scope="module")
def found():
    return jammed_fins(synthetic.model(synthetic.STABLE, speed=2.0), 7)


def test_a_fin_jammed_amidships_costs_little_and_the_more_it_is_turned_the_more(found):
    assert found.completed[:, 3].all()
    assert (found.off_track[:, 3] < 1.2 * found.sound[0]).all()
    assert (found.fin_rms[:, [0, 6]] > found.fin_rms[:, [3]]).all()


def test_the_image_of_a_jam_in_the_vertical_plane_of_symmetry_is_as_hard(found):
    # The upper fin to port at +a mirrors the one to starboard at -a; the pattern, which turns to starboard first,
    # is not mirrored.
    port, starboard = 0, 1
    assert found.left[port] == pytest.approx(found.left[starboard, ::-1] * [-1.0, 1.0, -1.0], abs=1e-9)
    assert found.completed[port].tolist() == found.completed[starboard, ::-1].tolist()


def test_three_sound_fins_of_an_x_take_back_what_a_fourth_does_up_to_their_limits(found):
    # A fin at a is a/4 of rudder, elevator and aileron each; the others reach it together, so that roll is left last.
    left = np.abs(found.left)
    assert left[..., :2].max() < HELD
    assert (left[:, 3] < 1e-12).all()


def test_a_craft_that_cannot_do_its_mission_says_why():
    weak = synthetic.model(synthetic.STABLE, speed=2.0)
    weak = weak.with_values(Nuudr=0.12 * weak.derivatives["Nuudr"], Yuudr=0.12 * weak.derivatives["Yuudr"])
    found = jammed_fins(weak, 3)
    words = [word for row in found.why for word in row if word]
    assert words
    assert found.share < 1.0
    assert all("track" in word or "depth" in word or "ran away" in word for word in words)


def test_what_was_found_comes_back_from_its_file_and_stands_in_the_report(found, tmp_path):
    path = write_jammed(found, tmp_path / "faults.json")
    again = read_jammed(path)
    for name in ("angle", "off_track", "depth_error", "fin_rms", "left", "completed"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    assert (again.why, again.fins, again.sound) == (found.why, found.fins, found.sound)
    text = page(gather([found]), "")
    assert "A jammed fin" in text
    assert f"completed with {int(found.completed.sum())} of 28 jams" in " ".join(text.split())
    document = path.read_text().replace('"off_track"', '"of_track"')
    path.write_text(document)
    with pytest.raises(ArtefactError, match="not whole"):
        read_jammed(path)


@pytest.mark.parametrize(("angles", "fins"), [(1, True), (9, False)])
def test_too_few_angles_or_no_fins_are_refused(angles, fins):
    model = synthetic.model(synthetic.STABLE)
    if not fins:
        model = replace(model, craft=replace(model.craft, fins=()))
    with pytest.raises(InputError, match="two angles or more"):
        jammed_fins(model, angles)
