"""Laws of meshes about an imported surface: what is refused and why, and that layers are counted, not believed."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import towtank as tt
from openfoam_cases import TINY, stand_in
from towtank.craft.hull import Ellipsoid
from towtank.craft.solid import write_stl
from towtank.errors import InputError, TankError
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift
from towtank.progress import Silent
from towtank.tank.identity import run_id
from towtank.tank.openfoam.fields import read_mesh
from towtank.tank.openfoam.mesh import imported, snappy_run
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of
from towtank.tank.openfoam.mesh.imported import COVERED, measures_of, mesh_remarks
from towtank.tank.openfoam.mesh.layers import Columns, columns, layers_of
from towtank.tank.openfoam.mesh.poly import assemble, write_mesh
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors, quality
from towtank.tank.openfoam.mesh.snappy import SnappySettings, dictionaries
from towtank.tank.openfoam.mesh.spacing import first_cell
from towtank.tank.openfoam.mesh.stl import check_fit, load, read_surface
from towtank.tank.openfoam.numerics import Numerics
from towtank.tank.openfoam.tank import OpenFoamTank

CRAFT = tt.read_craft("suboff-bare")
FINNED = tt.read_craft("suboff-x")
AHEAD = CaptiveTest("ahead", 3.0, Drift(3.0, 0.0))


@pytest.fixture(scope="module")
def stl(tmp_path_factory) -> Path:
    return write_stl(CRAFT, tmp_path_factory.mktemp("stl") / "hull.stl")


def changed(stl: Path, folder: Path, how) -> Path:
    """The surface with its corners moved by ``how``."""
    mesh = load(stl)
    mesh.vertices = how(np.array(mesh.vertices))
    path = folder / "changed.stl"
    path.write_bytes(mesh.export(file_type="stl"))
    return path


def test_the_surface_of_the_craft_itself_fits_the_craft(stl):
    surface = read_surface(stl)
    check_fit(surface, CRAFT)
    assert surface.volume == pytest.approx(0.699, rel=1e-3)
    assert surface.edges == 0
    assert read_surface(write_stl(FINNED, stl.with_name("fins.stl"))).edges > 100


@pytest.mark.parametrize(
    ("how", "told"),
    [
        (lambda p: 1000.0 * p, "millimetres"),
        (lambda p: 39.37 * p, "inches"),
        (lambda p: p * [-1.0, -1.0, 1.0], "180 deg about z"),
        (lambda p: (p - [2.0, 0.0, 0.0]) * [-1.0, -1.0, 1.0], "then move it"),
        (lambda p: p + np.array([0.5, 0.0, 0.0]), "move it by -0.5 m"),
        (lambda p: p[:, [1, 0, 2]] * [1.0, 1.0, -1.0], "longest side lies along y"),
        (lambda p: 1.2 * p, "5.227 m long"),
        (lambda p: p + np.array([0.0, 0.3, 0.0]), "at y = 0.3"),
    ],
)
def test_a_surface_in_other_units_or_axes_is_refused_with_the_remedy(stl, tmp_path, how, told):
    surface = read_surface(changed(stl, tmp_path, how))
    with pytest.raises(InputError, match=r"3 % of the length.*metres, body axes") as refused:
        check_fit(surface, CRAFT)
    assert told in str(refused.value)


def test_a_surface_a_few_per_cent_off_passes(stl, tmp_path):
    check_fit(read_surface(changed(stl, tmp_path, lambda p: 1.01 * p + [0.02, 0.0, 0.03])), CRAFT)


def test_a_surface_with_a_hole_is_refused_and_the_hole_is_shown(stl, tmp_path):
    mesh = load(stl)
    mesh.update_faces(np.arange(len(mesh.faces)) != 5000)
    hole = tmp_path / "hole.stl"
    hole.write_bytes(mesh.export(file_type="stl"))
    with pytest.raises(InputError, match=r"not closed: 3 edges .* \("):
        read_surface(hole)


def test_facets_that_look_both_ways_are_refused(stl, tmp_path):
    mesh = load(stl)
    faces = np.array(mesh.faces)
    faces[:200] = faces[:200, ::-1]
    mesh.faces = faces
    path = tmp_path / "both.stl"
    path.write_bytes(mesh.export(file_type="stl"))
    with pytest.raises(InputError, match="opposite ways"):
        read_surface(path)


@pytest.mark.parametrize("content", [b"", b"solid nothing\nendsolid nothing\n", b"not a surface at all" * 20])
def test_what_is_no_surface_is_refused(tmp_path, content):
    path = tmp_path / "x.stl"
    path.write_bytes(content)
    with pytest.raises(InputError, match="surface"):
        read_surface(path)
    with pytest.raises(InputError, match="No such file"):
        read_surface(tmp_path / "none.stl")


def test_a_test_that_turns_fins_is_refused_before_anything_is_run(tmp_path):
    path = write_stl(FINNED, tmp_path / "fins.stl")
    tank = OpenFoamTank(surface=path)
    turned = CaptiveTest("rudder", 3.0, Drift(3.0, 0.0), fins=(0.1, 0.1, -0.1, -0.1))
    with pytest.raises(InputError, match=r"rudder.*fins\.stl are part of a surface.*--only drift"):
        tank.schedule(FINNED, [AHEAD, turned])
    with pytest.raises(InputError, match="1 tests turn fins"):
        tank.run(FINNED, turned, Silent())
    assert [tank.able(test) for test in (AHEAD, turned)] == [True, False]
    assert len(tank.schedule(FINNED, [AHEAD]).costs) == 1


def test_settings_that_contradict_each_other_or_cannot_be_are_refused(stl):
    with pytest.raises(InputError, match="Give one of them"):
        OpenFoamTank(surface=stl, mesh=TINY)
    with pytest.raises(InputError, match="none is given"):
        OpenFoamTank(snappy=SnappySettings())
    with pytest.raises(InputError, match="cells_across 3 is not in 6 to 400"):
        SnappySettings(cells_across=3)
    with pytest.raises(InputError, match="ask for fewer layers"):
        SnappySettings(layers=20).heights(CRAFT, 3.0)


def test_layers_end_at_half_the_width_of_the_cells_above_them():
    settings = SnappySettings()
    for craft in (CRAFT, tt.read_craft("hokie"), tt.read_craft("remus100")):
        heights = settings.heights(craft, craft.speed)
        width = settings.wall_cell(craft)
        assert heights[0] == pytest.approx(first_cell(60.0, craft.speed, craft.length, craft.water.kinematic_viscosity))
        assert heights[-1] <= 0.5 * width < heights[-1] * settings.expansion
        fewer = settings.heights(craft, craft.speed, sharp=True)
        assert 1 <= len(fewer) < len(heights)
        assert fewer[-1] <= max(0.25 * width, fewer[0])


def test_the_identity_of_a_run_follows_the_content_of_the_surface_and_not_its_name(stl, tmp_path):
    copy = tmp_path / "copy.stl"
    copy.write_bytes(stl.read_bytes())
    other = changed(stl, tmp_path, lambda p: 1.001 * p)
    own, same, moved, finer, bare = (
        run_id(CRAFT, AHEAD, tank)
        for tank in (OpenFoamTank(surface=stl), OpenFoamTank(surface=copy), OpenFoamTank(surface=other),
                     OpenFoamTank(surface=stl, refinement=1.5), OpenFoamTank())
    )  # fmt: skip
    assert own == same
    assert len({own, moved, finer, bare}) == 4


def test_the_base_mesh_is_cubes_about_the_surface_and_reaches_the_far_field(stl):
    settings = SnappySettings()
    values = dictionaries(read_surface(stl), CRAFT, settings, settings.heights(CRAFT, 3.0))
    cube = 16 * settings.wall_cell(CRAFT)
    for axis, sections in zip("xyz", values["grading"], strict=True):
        low, high = (float(v) for v in values[f"{axis}_ends"])
        assert high - low == pytest.approx(5.0 * CRAFT.length, rel=0.02)
        shares, cells, ratios = (np.array([float(s[i]) for s in sections]) for i in range(3))
        assert shares.sum() == pytest.approx(1.0)
        assert (high - low) * shares[1] / cells[1] == pytest.approx(cube)
        assert ratios[0] * ratios[2] == pytest.approx(1.0)
        assert sum(cells) == values["counts"]["xyz".index(axis)]
    assert np.prod(values["counts"]) < 50_000


def stacked(heights, tops, width=1.0):
    """A plate of unit squares with hexahedra of ``heights`` above it, and one of height ``tops`` on each stack."""
    levels = np.concatenate([[0.0], np.cumsum([*heights, tops])])
    n, m = 4, len(levels)
    x, y, z = np.meshgrid(width * np.arange(n + 1.0), width * np.arange(n + 1.0), levels, indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    label = np.arange(len(points)).reshape(n + 1, n + 1, m)
    low = [label[:-1, :-1], label[1:, :-1], label[1:, 1:], label[:-1, 1:]]
    hexes = np.stack([c[..., :-1] for c in low] + [c[..., 1:] for c in low], axis=-1).reshape(-1, 8)
    squares = np.stack([label[:-1, :-1, 0], label[1:, :-1, 0], label[1:, 1:, 0], label[:-1, 1:, 0]], axis=-1)
    lid = np.stack([label[:-1, :-1, -1], label[1:, :-1, -1], label[1:, 1:, -1], label[:-1, 1:, -1]], axis=-1)
    sides = [np.stack([s[:-1, :-1], s[1:, :-1], s[1:, 1:], s[:-1, 1:]], axis=-1).reshape(-1, 4)
             for s in (label[0], label[-1], label[:, 0], label[:, -1])]  # fmt: skip
    rest = np.concatenate([lid.reshape(-1, 4), *sides])
    return assemble(points, hexes, {"hull": ("wall", squares.reshape(-1, 4)), "farField": ("patch", rest)})


def test_layers_that_are_there_are_counted_and_cells_above_them_are_not():
    asked = 0.1 * 1.3 ** np.arange(5)
    found = columns(stacked(asked, 1.0), "hull", asked)
    assert set(found.count) == {5}
    assert found.thickness == pytest.approx(asked.sum())
    assert found.first == pytest.approx(asked[0])
    assert found.area == pytest.approx(1.0)


def test_layers_that_are_missing_thin_or_absent_are_told():
    asked = 0.1 * 1.3 ** np.arange(5)
    for heights, count, covered in ((asked[:3], 3, 0.0), (0.7 * asked, 5, 1.0), (0.3 * asked, 5, 0.0), ([], 0, 0.0)):
        stacks = columns(stacked(heights, 1.0), "hull", asked)
        layers = layers_of(stacks, asked, 60.0 / asked[0])
        assert (layers.obtained, layers.covered) == (count, covered)
        assert layers.thickness == pytest.approx(np.sum(heights) / asked.sum())
        assert layers.bare == (1.0 if count == 0 else 0.0)
    assert layers.y_plus == pytest.approx((600.0, 600.0, 600.0))  # the first centre is that of a cell of height 1


def test_fewer_layers_spread_over_the_same_thickness_are_layers_with_a_tall_first_cell():
    asked = 0.04 * 1.3 ** np.arange(6)
    spread = np.array([1.0, 1.3]) * asked.sum() / 2.3
    layers = layers_of(columns(stacked(spread, 1.0), "hull", asked), asked, 60.0 / asked[0])
    assert (layers.obtained, layers.covered, layers.bare) == (2, 0.0, 0.0)
    assert layers.thickness == pytest.approx(1.0)
    assert layers.y_plus[1] == pytest.approx(60.0 * spread[0] / asked[0])


def test_shares_are_of_area_and_not_of_faces():
    found = layers_of(Columns(np.array([3.0, 1.0]), np.array([0.1, 0.4]), np.array([2, 0]), np.array([0.3, 0.0])),
                      np.array([0.1, 0.2]), 1.0)  # fmt: skip
    assert (found.covered, found.bare, found.obtained) == (0.75, 0.25, 1.5)
    assert found.first == pytest.approx((0.1, 0.1, 0.4))


def test_layers_of_the_structured_mesh_are_those_it_was_made_with():
    """An O-grid has a stack of its own kind on every face: its first cells grow by one ratio."""
    craft = replace(CRAFT, profile=Ellipsoid(6.0, 1.0), origin_from_nose=3.0)
    settings = MeshSettings(along=32, around=12, out=16)
    mesh = mesh_of(craft, settings, half=True, speed=3.0)
    first = first_cell(60.0, 3.0, craft.length, craft.water.kinematic_viscosity)
    found = columns(mesh, "hull", np.array([first, 2.0 * first]))
    # At the poles the faces of a coarse mesh are chords of a round cap, and the centres of the cells lie 6 % nearer.
    assert found.first == pytest.approx(first, rel=0.06)
    assert np.median(found.first) == pytest.approx(first, rel=0.01)
    assert set(found.count) == {2}


@pytest.mark.parametrize("half", [True, False])
def test_a_mesh_on_file_is_read_as_it_was_written(tmp_path, half):
    mesh = mesh_of(CRAFT, TINY, half=half)
    write_mesh(mesh, tmp_path)
    back = read_mesh(tmp_path)
    assert back.patches == mesh.patches
    assert back.cells == mesh.cells
    for name in ("points", "faces", "owner", "neighbour"):
        assert np.array_equal(getattr(back, name), getattr(mesh, name)), name
    short = tmp_path / "constant" / "polyMesh" / "points"
    short.write_bytes(short.read_bytes()[:-2000])
    with pytest.raises(TankError, match="cut off"):
        read_mesh(tmp_path)


def widened(mesh):
    """The mesh with one more corner on an edge of each face."""
    cut = 0.5 * (mesh.points[mesh.faces[:, 0]] + mesh.points[mesh.faces[:, 1]])
    faces = np.column_stack([mesh.faces[:, 0], len(mesh.points) + np.arange(len(cut)), mesh.faces[:, 1:]])
    return replace(mesh, points=np.concatenate([mesh.points, cut]), faces=faces)


def test_a_mesh_in_ascii_with_faces_of_any_number_of_corners_is_read(tmp_path):
    mesh = stacked([0.5], 1.0)
    wide = widened(mesh)
    wide.faces[::2] = np.column_stack([mesh.faces[::2], np.full(len(mesh.faces[::2]), -1)])
    write_mesh(mesh, tmp_path)  # for its boundary, which is in ascii
    lists = {
        "points": [f"({x!r} {y!r} {z!r})" for x, y, z in wide.points.tolist()],
        "faces": [f"{sum(row >= 0)}({' '.join(map(str, row[row >= 0]))})" for row in wide.faces],
        "owner": map(str, wide.owner),
        "neighbour": map(str, wide.neighbour),
    }
    for name, rows in lists.items():
        head = f"FoamFile {{ format ascii; object {name}; }}\n{len(getattr(wide, name))}\n(\n"
        (tmp_path / "constant" / "polyMesh" / name).write_text(head + "\n".join(rows) + "\n)\n")
    back = read_mesh(tmp_path)
    assert (back.patches, back.cells) == (wide.patches, wide.cells)
    for name in ("points", "faces", "owner", "neighbour"):
        assert np.array_equal(getattr(back, name), getattr(wide, name)), name


def test_the_last_cell_counts_where_it_owns_no_face(tmp_path):
    """As renumbering leaves it: all faces of a cell within the others belong to cells of lower number."""
    mesh = stacked([1.0, 1.0], 1.0)
    within = np.setdiff1d(np.arange(mesh.cells), mesh.owner[len(mesh.neighbour) :])[0]
    number = np.argsort(np.argsort(np.where(np.arange(mesh.cells) == within, mesh.cells, np.arange(mesh.cells))))
    owner, neighbour = number[mesh.owner], number[mesh.neighbour]
    faces, turned = mesh.faces.copy(), np.flatnonzero(owner[: len(neighbour)] > neighbour)
    owner[turned], neighbour[turned], faces[turned] = neighbour[turned], owner[turned], faces[turned, ::-1]
    assert owner.max() < mesh.cells - 1
    write_mesh(replace(mesh, owner=owner, neighbour=neighbour, faces=faces), tmp_path)
    back = read_mesh(tmp_path)
    assert cell_volumes(back, *face_vectors(back))[1] == pytest.approx(np.ones(mesh.cells))


@pytest.mark.parametrize(("file", "old", "new", "told"), [
    ("boundary", b"type wall", b"kind wall", "patch hull lacks its type"),
    ("boundary", b"nFaces 16", b"nFaces 15", "do not fit each other"),
    ("boundary", b"startFace", b"startface", "patch hull lacks"),
    ("faces", b"faceCompactList", b"faceList", "class faceList"),
    ("owner", b"format binary", b"format ascii", "holds"),
])  # fmt: skip
def test_a_mesh_that_is_not_whole_is_refused_with_the_file(tmp_path, file, old, new, told):
    write_mesh(stacked([0.5], 1.0), tmp_path)
    path = tmp_path / "constant" / "polyMesh" / file
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))
    with pytest.raises(TankError, match=told):
        read_mesh(tmp_path)


def test_faces_of_more_corners_are_measured_like_the_same_ones_of_four():
    """Corners put on the edges of faces change neither volume nor centre."""
    mesh = stacked([0.5], 1.0)
    centres, area = face_vectors(mesh)
    wide = widened(mesh)
    for ours, theirs in zip(face_vectors(wide), (centres, area), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-12)
    assert cell_volumes(wide, *face_vectors(wide))[1].sum() == pytest.approx(24.0)
    assert quality(wide).max_non_orthogonality == pytest.approx(0.0, abs=1e-5)


def test_poor_layers_are_a_remark_with_the_limit_and_what_may_be_done(tmp_path):
    layers = {"covered": 0.55, "asked": 7, "y_plus": (60.0, 60.0, 533.0)}
    measures = {"verdict": [], "layers": layers, "parts": {"hull": {**layers, "covered": 0.95}, "appendages": layers},
                "area": 1.0, "told": {"layers": 3.9}, "layers_by_face": 3.85}  # fmt: skip
    (words,) = mesh_remarks(measures)
    assert "55 % of the appendages has the 7 layers asked for, limit 80 %; y+ reaches 533" in words
    assert "fewer layers" in words
    good = {**measures, "parts": {"hull": {**layers, "covered": COVERED}}}
    assert mesh_remarks(good) == ()
    assert "says 6.5 layers, 3.85 are there" in mesh_remarks({**good, "told": {"layers": 6.5}})[0]
    assert "area" in mesh_remarks({**good, "area": 0.9})[0]
    assert mesh_remarks(measures_of(tmp_path)) == ()


def test_a_mesh_is_made_once_and_again_when_a_template_of_it_is_edited(stl, tmp_path, monkeypatch):
    made = []

    def make(folder, *_):
        made.append(folder)
        write_mesh(stacked([0.5], 1.0), folder)

    monkeypatch.setattr(imported, "make", make)
    monkeypatch.setattr(imported, "measured", lambda *_: {"schema": imported.SCHEMA, "cells": 32})
    monkeypatch.setattr(imported, "require", lambda: stand_in(tmp_path))
    monkeypatch.setattr(snappy_run, "TEMPLATES", shutil.copytree(snappy_run.TEMPLATES, tmp_path / "templates"))
    mesh = OpenFoamTank(surface=stl, where=tmp_path).mesh_settings
    for case in ("first", "second"):
        mesh.write(tmp_path / case, CRAFT, AHEAD, AHEAD.speed)
    assert len(made) == 1
    edited = tmp_path / "templates" / "system" / "snappyHexMeshDict"
    edited.write_text(edited.read_text().replace("nSmoothPatch    3", "nSmoothPatch    4"))
    mesh.write(tmp_path / "third", CRAFT, AHEAD, AHEAD.speed)
    assert len(set(made)) == 2


def test_a_coarse_surface_is_meshed_and_its_layers_are_there(tmp_path, monkeypatch):
    """Real blockMesh, snappyHexMesh and 30 iterations on a spheroid of 6:1. Needs OpenFOAM."""
    monkeypatch.setattr("towtank.tank.openfoam.case.WRITE_EVERY", 30)
    craft = tt.read_craft("spheroid-6-1")
    path = write_stl(craft, tmp_path / "spheroid.stl")
    speed = 1.0
    settings = SnappySettings(cells_across=8, levels=3, buffer=2, fine=0, layers=3)
    tank = OpenFoamTank(surface=path, snappy=settings, numerics=Numerics(iterations=30, window=10), where=tmp_path)
    run = tank.run(craft, CaptiveTest("drift", speed, Drift(speed, 0.1)), Silent())
    mesh = run.provenance["mesh"]
    assert mesh["cells"] < 40_000
    assert mesh["verdict"] == []
    # 8 cells around half a circle of facets inscribed: chords of a tenth of a radian lose 0.2 % of area.
    assert mesh["area"] == pytest.approx(1.0, abs=0.01)
    layers = mesh["layers"]
    assert mesh["parts"] == {"hull": layers}
    assert layers["covered"] > 0.95
    assert layers["y_plus"] == pytest.approx((60.0, 60.0, 60.0), rel=0.05)
    # The mesher counts by face what is counted here by walking through the cells.
    assert mesh["told"]["layers"] == pytest.approx(mesh["layers_by_face"], abs=0.06)
    assert mesh["told"]["faces"] == layers["faces"]
    # The solver's own y+, on the flow that it found, is near that of the plate even after 30 iterations.
    assert run.provenance["health"]["y_plus"]["hull"][2] == pytest.approx(60.0, rel=0.4)
    assert abs(run.loads[0, 1]) > 5.0 * abs(run.loads[0, 2])
    # Asked again for another angle, the mesh is taken from where it is kept.
    again = tank.mesh_settings.write(tmp_path / "again", craft, AHEAD, speed)
    assert again[0] == mesh["cells"]
    assert len([place for place in (tmp_path / "meshes").iterdir() if place.is_dir()]) == 1
