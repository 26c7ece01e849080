"""Laws of the meshes for OpenFOAM: they fill the water around the craft, follow its shape, and are cells."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from towtank.craft.hull import Ellipsoid, Offsets
from towtank.craft.integrals import fin_integrals, hull_integrals
from towtank.craft.library import library_names, read_craft
from towtank.errors import InputError, TankError
from towtank.tank.openfoam.mesh.cap import disc
from towtank.tank.openfoam.mesh.grid import MeshSettings, mesh_of, wall_cell
from towtank.tank.openfoam.mesh.poly import PolyMesh, assemble
from towtank.tank.openfoam.mesh.quality import cell_volumes, face_vectors, quality
from towtank.tank.openfoam.mesh.spacing import friction, geometric, two_sided

COARSE = MeshSettings(along=48, around=16, out=20)
BARE = read_craft("suboff-bare")
X = read_craft("suboff-x")


def patch_area(mesh: PolyMesh, name: str) -> float:
    patch = mesh.patch(name)
    _, area = face_vectors(mesh)
    return float(np.linalg.norm(area[patch.faces], axis=1).sum())


def enclosed(mesh: PolyMesh, name: str) -> float:
    """Volume inside a closed patch that looks away from the cells, or inside a half one cut at z = 0."""
    patch = mesh.patch(name)
    centre, area = face_vectors(mesh)
    here = patch.faces
    return float(np.einsum("fi,fi->", centre[here], area[here]) / 3.0)


def wall_points(mesh: PolyMesh, name: str) -> np.ndarray:
    patch = mesh.patch(name)
    return mesh.points[np.unique(mesh.faces[patch.faces])]


@pytest.fixture(scope="module")
def turned():
    return mesh_of(X, COARSE, half=False, fins=np.radians([20.0, -30.0, 0.0, 40.0]))


def test_the_water_is_the_outer_ellipsoid_less_the_hull_and_the_error_falls_with_the_square_of_the_cells():
    meshes = [mesh_of(BARE, replace(COARSE, out=8, refinement=r), half=True) for r in (1.0, 2.0)]
    for mesh in meshes:
        whole = enclosed(mesh, "farField") + enclosed(mesh, "hull")
        assert quality(mesh).volume == pytest.approx(whole, rel=1e-12)  # one divergence theorem, two sums
    hull = 0.5 * hull_integrals(BARE.profile).volume
    error = [1.0 + enclosed(mesh, "hull") / hull for mesh in meshes]
    # An inscribed polygon of n sides loses (2 pi / n)^2 / 6 of the area, 0.6 % for 32; chords along the hull lose more.
    assert 0.0 < error[0] < 0.02
    assert error[0] / error[1] == pytest.approx(4.0, rel=0.15)


def test_outer_boundary_is_the_confocal_ellipsoid():
    mesh = mesh_of(BARE, replace(COARSE, far=2.0), half=False)
    points = wall_points(mesh, "farField")
    radius = np.hypot(points[:, 1], points[:, 2])
    assert radius.max() == pytest.approx(2.0 * BARE.length, rel=0.01)  # no station need lie at the greatest radius
    middle = 0.5 * (points[:, 0].max() + points[:, 0].min())
    a, b = 0.5 * np.ptp(points[:, 0]), 2.0 * BARE.length
    # Lines reach it along nu = const: on the ellipse to the accuracy of the drawn lines.
    assert ((points[:, 0] - middle) / a) ** 2 + (radius / b) ** 2 == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("name", library_names())
def test_points_of_the_hull_lie_on_the_profile_and_its_area_is_that_of_the_craft(name):
    craft = read_craft(name)
    mesh = mesh_of(craft, MeshSettings(along=64, around=16, out=16), half=False)
    points = wall_points(mesh, "hull")
    x = np.clip(craft.origin_from_nose - points[:, 0], 0.0, craft.length)
    off = np.hypot(points[:, 1], points[:, 2]) - craft.profile.radius(x)
    on_disc = (x < 1e-9) | (x > craft.length - 1e-9)
    # Profiles are followed as 6000 chords; a vertical nose makes the radius sensitive to x there.
    assert np.abs(off[~on_disc]).max() < 2e-4 * craft.diameter
    # 32 facets lose 0.2 % of the girth, chords along the hull as much again.
    assert patch_area(mesh, "hull") == pytest.approx(hull_integrals(craft.profile).wetted_area, rel=0.01)


def test_wetted_area_of_fins_approaches_that_of_the_craft():
    exact = fin_integrals(X.fins[0], X.profile).wetted_area
    short = []
    for r in (1.0, 1.75):
        mesh = mesh_of(X, MeshSettings(along=64, around=16, out=24, refinement=r), half=True, fins=np.zeros(4))
        short.append(1.0 - patch_area(mesh, "fin3") / exact)
    # A square tip is 6 % of the area of this thick section; the mesh closes it to an edge, 4.5 % less in the limit.
    # The nose, drawn by few chords, costs what is left.
    assert 0.0 < short[1] < short[0] < 0.055


@pytest.mark.parametrize("name", ["suboff-bare", "suboff-fins", "suboff-x", "remus100"])
def test_half_a_mesh_and_its_mirror_image_are_the_full_one(name):
    craft = read_craft(name)
    full, half = (mesh_of(craft, COARSE, half=h, fins=np.zeros(len(craft.fins))) for h in (False, True))
    assert 2 * half.cells == full.cells
    volumes = [np.sort(cell_volumes(mesh, *face_vectors(mesh))[1]) for mesh in (full, half)]
    assert np.repeat(volumes[1], 2) == pytest.approx(volumes[0], rel=1e-6)
    symmetry = wall_points(half, "symmetry")
    assert np.all(symmetry[:, 2] == 0.0)
    assert np.all(half.points[:, 2] >= 0.0)
    assert 2.0 * patch_area(half, "hull") == pytest.approx(patch_area(full, "hull"), rel=1e-9)


def test_fins_in_the_plane_of_symmetry_are_half_slits():
    craft = read_craft("suboff-fins")
    half, full = (mesh_of(craft, COARSE, half=h, fins=np.zeros(4)) for h in (True, False))
    assert [p.name for p in half.patches] == ["hull", "fin1", "fin2", "fin3", "farField", "symmetry"]
    assert 2.0 * patch_area(half, "fin1") == pytest.approx(patch_area(full, "fin1"), rel=1e-9)
    assert patch_area(half, "fin2") == pytest.approx(patch_area(full, "fin2"), rel=1e-9)


def test_cells_are_closed_to_round_off(turned):
    measured = quality(turned)
    assert measured.openness < 1e-12
    assert measured.volume == pytest.approx(
        sum(enclosed(turned, name) for name in ("hull", "fin1", "fin2", "fin3", "fin4", "farField")), rel=1e-12
    )


def test_every_cell_is_a_hexahedron_and_faces_are_upper_triangular(turned):
    assert np.all(turned.faces >= 0)  # no triangle: no wedge is left at the poles
    faces = np.bincount(turned.owner, minlength=turned.cells) + np.bincount(turned.neighbour, minlength=turned.cells)
    assert np.all(faces == 6)
    inner = len(turned.neighbour)
    pairs = turned.owner[:inner] * turned.cells + turned.neighbour
    assert np.all(turned.owner[:inner] < turned.neighbour)
    assert np.all(np.diff(pairs) > 0)


@pytest.mark.parametrize("name", [n for n in library_names() if read_craft(n).fins])
@pytest.mark.parametrize("angles", [(0, 0, 0, 0), (40, 40, 40, 40), (40, -40, 40, -40), (-40, 25, 0, -10)])
def test_no_cell_folds_whatever_the_fins_do(name, angles):
    craft = read_craft(name)
    measured = quality(mesh_of(craft, replace(COARSE, along=64), half=False, fins=np.radians(angles)))
    assert (measured.negative, measured.open_cells, measured.wrong_faces) == (0, 0, 0)
    # The plane of a fin turns 40 deg against the mesh and its nose is blunt; beyond 80 deg diffusion is all correction.
    assert measured.max_non_orthogonality < 80.0
    assert measured.max_skewness < 4.0


@given(count=st.integers(2, 6), first=st.floats(0.0, 6.2), turn=st.floats(-25.0, 25.0))
@settings(max_examples=5, deadline=None)
def test_any_regular_number_of_fins_at_any_azimuth_has_a_mesh(count, first, turn):
    fins = tuple(replace(X.fins[0], name=str(k), azimuth=first + k * 2.0 * np.pi / count) for k in range(count))
    mesh = mesh_of(
        replace(X, fins=fins), replace(COARSE, along=64, around=20), half=False, fins=[np.radians(turn)] * count
    )
    assert not quality(mesh).negative
    areas = [patch_area(mesh, f"fin{k + 1}") for k in range(count)]
    assert areas == pytest.approx([areas[0]] * count, rel=0.02)  # sectors of the mesh differ by a cell


def test_fins_need_not_stand_at_even_azimuths():
    angles = np.radians([20.0, 80.0, 180.0, 300.0])
    fins = tuple(replace(X.fins[0], name=str(k), azimuth=float(a)) for k, a in enumerate(angles))
    mesh = mesh_of(replace(X, fins=fins), replace(COARSE, along=64), half=False, fins=np.radians([-20, 10, 30, 0]))
    assert not quality(mesh).negative
    for number, angle in enumerate(angles):
        points = wall_points(mesh, f"fin{number + 1}")
        middle = np.arctan2(points[:, 2].mean(), points[:, 1].mean())
        # A turned fin is not symmetric about its plane, for its stock is ahead of its middle.
        assert abs(np.angle(np.exp(1j * (middle - angle)))) < np.radians(8.0)


def test_tips_move_as_the_geometry_of_a_turned_fin_says(turned):
    for number, degrees in enumerate((20.0, -30.0, 0.0, 40.0)):
        fin, points = X.fins[number], wall_points(turned, f"fin{number + 1}")
        leading = fin.trailing_edge - fin.tip_chord
        tips = {}
        for edge in (leading, fin.trailing_edge):
            ahead = _stock(fin) - edge
            along = X.origin_from_nose - _stock(fin) + ahead * np.cos(np.radians(degrees))
            # A positive angle is right-handed about the span: what is ahead of the stock goes along span x e_x.
            aside = ahead * np.sin(np.radians(degrees)) * fin.lift_direction
            tips[edge] = np.array([along, 0.0, 0.0]) + fin.tip_radius * fin.span_direction + aside
        for tip in tips.values():
            assert np.linalg.norm(points - tip, axis=1).min() < 1e-4 * fin.tip_chord  # roots lie on 6000 chords


def _stock(fin):
    """Stock on the middle section of the exposed span, which begins on the hull half way between the root's edges."""
    edges = []
    for share in (1.0, 0.0):
        y = fin.root_radius
        for _ in range(100):
            x = float(fin.trailing_edge_at(y) - share * fin.chord(y))
            y = 0.5 * (y + float(X.profile.radius(np.array(x))))
        edges.append(x)
    middle = 0.5 * (float(X.profile.radius(np.array(np.mean(edges)))) + fin.tip_radius)
    return float(fin.trailing_edge_at(middle) - (1.0 - fin.hinge) * fin.chord(middle))


def test_a_fin_that_is_turned_displaces_no_other():
    still, one = (mesh_of(X, COARSE, half=False, fins=np.radians([angle, 0, 0, 0])) for angle in (0.0, 15.0))
    for name in ("fin2", "fin3", "fin4"):
        assert wall_points(one, name) == pytest.approx(wall_points(still, name), abs=1e-12)
    assert np.abs(wall_points(one, "fin1") - wall_points(still, "fin1")).max() > 0.01


def test_roots_stand_on_the_hull_at_any_angle(turned):
    hull = {tuple(p) for p in np.round(wall_points(turned, "hull"), 9)}
    for number in range(1, 5):
        shared = sum(tuple(p) in hull for p in np.round(wall_points(turned, f"fin{number}"), 9))
        patch = turned.patch(f"fin{number}")
        chord_cells = patch.count // (2 * round(0.43 * COARSE.out))
        assert shared == 2 * chord_cells  # both faces of every chord station, leading and trailing edge once


def test_the_first_cell_has_the_height_of_the_target():
    settings_ = replace(COARSE, y_plus=50.0)
    mesh = mesh_of(BARE, settings_, half=True, speed=3.0)
    nu = BARE.water.kinematic_viscosity
    height = wall_cell(settings_, 3.0, BARE.length, nu)
    shear = 3.0 * np.sqrt(0.5 * friction(3.0 * BARE.length / nu))
    assert 0.5 * height * shear / nu == pytest.approx(50.0, rel=1e-12)
    patch = mesh.patch("hull")
    centre, area = face_vectors(mesh)
    middle, _ = cell_volumes(mesh, centre, area)
    here = patch.faces
    normal = area[here] / np.linalg.norm(area[here], axis=1)[:, None]
    distance = np.einsum("fi,fi->f", normal, centre[here] - middle[mesh.owner[here]])
    # Lines leave at right angles but at the sharp tail; facets of a coarse mesh lie up to a tenth of a cell off.
    assert np.median(distance) == pytest.approx(0.5 * height, rel=0.02)
    assert distance.min() > 0.3 * height


def test_refinement_scales_all_counts_and_keeps_the_cell_of_a_wall_function():
    family = [mesh_of(BARE, MeshSettings(48, 16, 20, refinement=r), half=True).cells for r in (0.75, 1.0, 1.5)]
    assert np.array(family) / family[1] == pytest.approx(np.array([0.75, 1.0, 1.5]) ** 3, rel=0.08)  # caps round
    for y_plus, share in ((60.0, 1.0), (0.5, 0.5)):
        one, two = (wall_cell(MeshSettings(y_plus=y_plus, refinement=r), 1.0, 1.0, 1e-6) for r in (1.0, 2.0))
        assert two / one == pytest.approx(share)


def test_cells_at_the_poles_are_as_large_as_their_neighbours():
    mesh = mesh_of(replace(BARE, profile=Ellipsoid(6.0, 1.0)), MeshSettings(60, 24, 16), half=False)
    patch = mesh.patch("hull")
    centre, area = face_vectors(mesh)
    here = patch.faces
    size = np.sqrt(np.linalg.norm(area[here], axis=1))
    nose = centre[here, 0] > centre[here, 0].max() - 0.02 * 6.0
    # A fan of 48 wedges has cells of r d theta / 2 = 7 % of their length; the corners of the core are at half.
    assert size[nose].min() > 0.45 * size[nose].max()


@given(count=st.sampled_from([16, 24, 32, 48]), seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_a_cap_has_no_fold_whatever_the_spacing_of_its_rim(count, seed):
    steps = np.random.default_rng(seed).uniform(0.15, 1.0, count)
    rim = np.r_[0.0, np.cumsum(steps)[:-1]] * 2.0 * np.pi / steps.sum()
    face = disc(rim, half=False)
    points = np.concatenate([face.points, np.stack([np.cos(rim), np.sin(rim)], axis=1)])[face.quads]
    ahead, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    assert np.all(ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0] > 0.0)


@given(first=st.floats(1e-6, 0.01), count=st.integers(4, 80), total=st.floats(0.5, 50.0))
@settings(max_examples=60, deadline=None)
def test_spacing_ends_where_it_should_and_never_turns_back(first, count, total):
    grown = geometric(first, count, total)
    assume(first * count < 0.9 * total)  # else cells are even
    both = two_sided(first, 2.0 * first, count, total)
    for at in (grown, both):
        assert len(at) == count + 1
        assert (at[0], at[-1]) == (0.0, pytest.approx(total, rel=1e-9))
        assert np.all(np.diff(at) > 0.0)
    assert grown[1] == pytest.approx(first, rel=1e-6)
    ratio = np.diff(grown)[1:] / np.diff(grown)[:-1]
    assert ratio == pytest.approx(np.full(count - 1, ratio[0]), rel=1e-6)


@pytest.mark.parametrize(
    "profile",
    [
        Offsets((0.0, 0.2, 0.6, 1.0, 2.0, 3.0, 3.4, 3.8, 4.0), (0.0, 0.15, 0.22, 0.25, 0.25, 0.2, 0.08, 0.02, 0.0)),
        Offsets((0.0, 0.2, 1.0, 2.0, 3.0, 4.0), (0.1, 0.2, 0.25, 0.25, 0.25, 0.2)),
        Ellipsoid(1.0, 0.8),
        Ellipsoid(4.0, 0.2),
    ],
    ids=["cusped tail", "flat ends", "stout", "needle"],
)
def test_hulls_of_any_form_have_a_mesh(profile):
    measured = quality(mesh_of(replace(BARE, profile=profile, origin_from_nose=0.5), COARSE, half=True))
    assert (measured.negative, measured.wrong_faces, measured.open_cells) == (0, 0, 0)
    assert measured.max_non_orthogonality < 75.0  # at the hollow of a cusp


def test_collapsed_edges_leave_triangles_and_a_hole_or_an_overlap_is_refused():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
    wedge = np.array([[0, 1, 2, 0, 4, 5, 6, 4]])
    walls = np.array([[0, 1, 2, 0], [4, 5, 6, 4], [0, 1, 5, 4], [1, 2, 6, 5], [2, 0, 4, 6]])
    mesh = assemble(points, wedge, {"all": ("wall", walls)})
    assert np.count_nonzero(mesh.faces[:, 3] < 0) == 2
    assert len(mesh.points) == 6
    assert quality(mesh).volume == pytest.approx(0.5)
    with pytest.raises(TankError, match="belong to no side"):
        assemble(points, wedge, {"most": ("wall", walls[:-1])})
    with pytest.raises(TankError, match="more than two cells"):
        assemble(points, np.repeat(wedge, 3, axis=0), {"all": ("wall", walls)})


@pytest.mark.parametrize(
    ("change", "angles", "words"),
    [
        ({}, [0.0] * 3, "3 fin angles for the 4 fins"),
        ({}, np.radians([0, 0, 45, 0]), "follows a fin to 40 deg"),
        ({"tip_radius": 0.1}, [0.0] * 4, "lies inside the hull"),
        ({"trailing_edge": 4.4}, [0.0] * 4, "does not meet the hull"),
        ({"trailing_edge": 4.3}, [0.0] * 4, "chords from the cells of that end"),
        ({"azimuth": 0.7}, [0.0] * 4, "same azimuth|cells between them"),
    ],
)
def test_fins_that_do_not_fit_are_refused_with_a_remedy(change, angles, words):
    fins = tuple(replace(fin, **change) for fin in X.fins)
    with pytest.raises(InputError, match=words):
        mesh_of(replace(X, fins=fins), COARSE, half=False, fins=angles)


def test_half_a_domain_is_refused_when_fins_break_its_symmetry():
    with pytest.raises(InputError, match="no mirror image"):
        mesh_of(X, COARSE, half=True, fins=np.radians([10.0, 0, 0, 0]))
    # Top-port and bottom-port turned against each other are mirror images: a rudder angle.
    assert mesh_of(X, COARSE, half=True, fins=np.radians([10.0, 10, -10, -10])).cells


@pytest.mark.parametrize("few", [{"along": 12}, {"around": 2}, {"out": 3}, {"refinement": 0.0}, {"far": 0.2}])
def test_too_few_cells_are_refused(few):
    with pytest.raises(InputError, match="mesh"):
        mesh_of(BARE, replace(COARSE, **few), half=True)
