"""Shares of y+ and Courant number: what they weigh, what they leave out, and files that are damaged."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import towtank as tt
from openfoam_cases import QUICK, TINY
from towtank.errors import TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway
from towtank.tank.openfoam.case import write_case
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, Distribution, distribution, shares
from towtank.tank.openfoam.fields import read_field, read_mesh
from towtank.tank.openfoam.measure import courant_numbers, keep, kept
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors

CRAFT = tt.read_craft("suboff-bare")
U = 3.344
HEAD = "FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\ndimensions [0 0 0 0 0 0 0];\n"
positive = st.floats(1e-3, 1e3)


def field(values: dict[str, np.ndarray | float], inside: str = "uniform 0", kind: str = "volScalarField") -> str:
    """Text of a field with values on patches."""
    patches = "".join(f"    {name} {{ type calculated; value {_entry(v)}; }}\n" for name, v in values.items())
    return f"{HEAD.format(kind=kind, name='x')}internalField {inside};\nboundaryField\n{{\n{patches}}}\n"


def _entry(values: np.ndarray | float) -> str:
    if np.ndim(values) == 0:
        return f"uniform {values:g}"
    return f"nonuniform List<scalar> {len(values)}(" + " ".join(f"{v:.17g}" for v in values) + ")"


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    tests = {"drift": Drift(U, 0.1), "sway": Sway(U, 0.2, 2.0)}
    folder = tmp_path_factory.mktemp("cases")
    return {
        name: write_case(folder / name, CRAFT, CaptiveTest(name, U, motion, samples=16), TINY, QUICK)
        for name, motion in tests.items()
    }


@pytest.fixture(params=["drift", "sway"])
def solved(request, cases, tmp_path):
    """A case with fields of a last time that were written by hand: y+ 50 on the hull, and a flux of 1 m3/s."""
    case = cases[request.param]
    time = case.folder / "12"
    time.mkdir(exist_ok=True)
    (time / "yPlus").write_text(field({"hull": 50.0}))
    (time / "phi").write_text(field({"hull": 0.0, "farField": 1.0}, "uniform 1", "surfaceScalarField"))
    (case.folder / "distribution.json").unlink(missing_ok=True)
    return case


@given(st.lists(st.tuples(positive, positive), min_size=1, max_size=40))
def test_shares_sum_to_one_and_halved_faces_change_nothing(faces):
    values, areas = (np.array(column) for column in zip(*faces, strict=True))
    found = shares(values, areas, Y_PLUS)
    assert sum(found) == pytest.approx(1.0)
    assert min(found) >= 0.0
    halved = shares(np.repeat(values, 2), np.repeat(areas / 2.0, 2), Y_PLUS)
    assert halved == pytest.approx(found)
    assert shares(values, 7.0 * areas, Y_PLUS) == pytest.approx(found)


def test_weights_are_areas_and_a_value_on_an_edge_counts_above_it():
    found = shares(np.array([0.5, 1.0, 29.0, 30.0, 1e6]), np.array([1.0, 2.0, 3.0, 4.0, 10.0]), Y_PLUS)
    assert found == pytest.approx((0.05, 0.1, 0.0, 0.15, 0.2, 0.0, 0.5))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_no_numbers_have_no_shares(bad):
    with pytest.raises(TankError, match="not finite"):
        shares(np.array([1.0, bad]), np.ones(2), Y_PLUS)


def test_the_courant_number_is_the_flux_through_a_cell_in_a_step_over_its_volume(cases, tmp_path):
    mesh = read_mesh(cases["sway"].folder)
    velocity = np.array([-3.0, 1.0, 0.5])
    centres, area = face_vectors(mesh)
    flux = area @ velocity  # of a uniform stream
    patches = {patch.name: flux[patch.faces] for patch in mesh.patches}
    inside = _entry(flux[: len(mesh.neighbour)])
    (tmp_path / "phi").write_text(field(patches, inside, "surfaceScalarField"))
    found = courant_numbers(mesh, read_field(tmp_path / "phi"), 0.1)
    assert courant_numbers(mesh, read_field(tmp_path / "phi"), 0.2) == pytest.approx(2.0 * found)
    # What enters a cell leaves it: half of all that passes its faces is what leaves.
    leaving = np.bincount(mesh.owner, np.maximum(flux, 0.0), mesh.cells)
    leaving += np.bincount(mesh.neighbour, np.maximum(-flux[: len(mesh.neighbour)], 0.0), mesh.cells)
    assert found == pytest.approx(0.1 * leaving / cell_volumes(mesh, centres, area)[1])


def test_what_is_kept_sums_to_one_and_a_steady_case_has_no_courant_number(solved):
    keep(solved)
    found = distribution(kept(solved.folder))
    assert found.missing == ()
    assert found.y_plus["hull"] == pytest.approx((0, 0, 0, 0, 1, 0, 0))
    assert found.area["hull"] > 0.0
    assert found.walls() == found.y_plus["hull"]
    assert sum(found.courant) == pytest.approx(0.0 if solved.steady else 1.0)


@pytest.mark.parametrize("damage", [
    lambda text: text[: len(text) // 2],
    lambda text: text.replace("uniform 50", "uniform many"),
    lambda text: text.replace("uniform 50", "uniform nan"),
    lambda text: text.replace("uniform 50", "nonuniform List<scalar> 3(1 2 3)"),
    lambda text: text.replace("uniform 50", "nonuniform List<scalar> 9(1 2 3)"),
    lambda text: text.replace("uniform 50", "nonuniform List<vector> 1((1 2 3))"),
    lambda text: text.replace("hull", "keel"),
    lambda text: "",
    lambda text: text.replace("format ascii", "format binary"),
])  # fmt: skip
def test_a_damaged_field_is_told_and_the_solved_case_stands(solved, damage):
    path = solved.folder / "12" / "yPlus"
    changed = damage(path.read_text())
    path.write_text(changed)
    keep(solved)
    found = distribution(kept(solved.folder))
    whole = "format binary" in changed  # a uniform field is text in a binary file too
    assert bool(found.y_plus) == whole
    assert any("y+ is not known" in words for words in found.missing) != whole
    assert bool(found.courant) != solved.steady


def test_a_damaged_mesh_is_told_and_the_solved_case_stands(solved):
    path = solved.folder / "constant" / "polyMesh" / "faces"
    whole = path.read_bytes()
    try:
        for damage in (whole[:-200], b"", whole.replace(b"faceCompactList", b"otherFacesList "), None):
            path.unlink() if damage is None else path.write_bytes(damage)
            keep(solved)
            found = distribution(kept(solved.folder))
            assert (found.y_plus, found.courant) == ({}, ())
            assert "not known" in found.missing[0]
    finally:
        path.write_bytes(whole)


def test_what_was_kept_stays_when_the_fields_are_gone(solved):
    keep(solved)
    before = kept(solved.folder)
    for name in ("yPlus", "phi"):
        (solved.folder / "12" / name).unlink()
    keep(solved)
    assert kept(solved.folder) == before != {}


def test_a_case_that_kept_none_has_none(tmp_path):
    assert kept(tmp_path) == {}
    (tmp_path / "distribution.json").write_text("{")
    assert kept(tmp_path) == {}
    assert distribution({}) is None


def test_the_document_gives_the_distribution_back_and_other_bins_are_not_taken_for_these():
    one = Distribution({"hull": (0.1,) * 6 + (0.4,)}, {"hull": 2.0}, (1.0, 0, 0, 0, 0, 0, 0), ("none",))
    document = json.loads(json.dumps(one.document()))
    assert distribution(document) == one
    assert distribution({**document, "courant_edges": [*COURANT[:-1], 40.0]}) is None
    assert distribution({**document, "area": 3}) is None


def test_walls_together_weigh_by_their_areas():
    one = Distribution({"hull": (1.0, 0, 0, 0, 0, 0, 0), "fin1": (0, 0, 0, 0, 0, 0, 1.0)}, {"hull": 3.0, "fin1": 1.0})
    assert one.walls() == pytest.approx((0.75, 0, 0, 0, 0, 0, 0.25))
    assert one.walls(["fin1"]) == one.y_plus["fin1"]
    assert one.walls(["sail"]) == ()
