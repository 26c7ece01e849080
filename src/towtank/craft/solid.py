"""Watertight solid of hull, fins and strakes, and its STL and GLB files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from towtank.artefact import replace_file
from towtank.craft.craft import Craft, Fin, Profile, Strake
from towtank.craft.integrals import stations
from towtank.craft.section import cosine_fractions, half_thickness
from towtank.errors import CraftError
from towtank.frames import Array

if TYPE_CHECKING:
    import trimesh

_AROUND = 144
"""Facets around the hull: inscribed sections lose 0.03 percent of area; a multiple of 4 keeps the symmetry."""
_ALONG = 240
_VIEW = (72, 120)
"""Facets around and along the hull in a GLB, which is for looking at."""
_CHORD_POINTS = 61
_GLTF_AXES = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Body axes to glTF axes: glTF has y up, z forward, x to port."""


def solid(craft: Craft, around: int = _AROUND, along: int = _ALONG) -> trimesh.Trimesh:
    """Closed triangle mesh of hull, fins and strakes [m], body axes (x forward, y starboard, z down) from the origin.

    Fins and strakes are carried into the hull and fused with it, so no facet lies inside the body. ``around`` and
    ``along`` are the facets around the hull and the stations along it.

    Raises
    ------
    CraftError
        The union is not one closed body.
    """
    import trimesh

    body = _hull(craft.profile, around, along)
    for fin in craft.fins:
        body = body + _fin(fin, craft.profile)
    for strake in craft.strakes:
        body = body + _strake(strake, craft.profile)
    if len(body.decompose()) != 1:
        raise CraftError(
            f"craft {craft.name!r}: hull and fins do not make one body, a fin stands clear of the hull. "
            "Check trailing_edge, root_radius and root_chord of the fins."
        )
    # Geometry was built x aft of the nose, y starboard, z down: a mirror image until x points forward.
    body = body.transform(np.array([[-1.0, 0, 0, craft.origin_from_nose], [0, 1.0, 0, 0], [0, 0, 1.0, 0]]))
    mesh = body.to_mesh64()
    surface = trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts), process=False)
    if not surface.is_watertight:
        raise CraftError(
            f"craft {craft.name!r}: the surface of hull and fins is not closed. Simplify the hull offsets."
        )
    return surface


def _hull(profile: Profile, around: int, along: int) -> Any:
    """Body of revolution, x aft of the nose."""
    from manifold3d import CrossSection, FillRule, Manifold

    x = stations(profile, along)
    r = profile.radius(x)
    outline = [(float(ri), float(xi)) for xi, ri in zip(x, r, strict=True) if ri > 1e-9]
    outline = [(0.0, 0.0), *outline, (0.0, profile.length)]
    lathe = Manifold.revolve(CrossSection([outline], FillRule.Positive), around)
    return lathe.transform(np.array([[0.0, 0, 1.0, 0], [1.0, 0, 0, 0], [0, 1.0, 0, 0]]))


def _fin(fin: Fin, profile: Profile) -> Any:
    """Fin from inside the hull to its tip, x aft of the nose. Sections are similar, trailing edge at zero."""
    from manifold3d import CrossSection, FillRule, Manifold

    inner = _inner_radius(fin, profile)
    xi = cosine_fractions(_CHORD_POINTS)
    half = half_thickness(fin.thickness, xi)
    upper = np.stack([xi - 1.0, half], axis=1)
    lower = np.stack([xi - 1.0, -half], axis=1)[-2:0:-1]
    inner_chord = float(fin.chord(inner))
    outline = inner_chord * np.concatenate([upper, lower])
    section = CrossSection([outline.tolist()], FillRule.NonZero)
    ratio = fin.tip_chord / inner_chord
    raised = Manifold.extrude(section, fin.tip_radius - inner, 0, 0.0, (ratio, ratio))
    lean = float(np.tan(fin.trailing_edge_sweep))
    y, z = fin.span_direction[1:]
    place = np.array(
        [
            [1.0, 0.0, lean, float(fin.trailing_edge_at(inner))],
            [0.0, -z, y, inner * y],
            [0.0, y, z, inner * z],
        ]
    )
    return raised.transform(place)


def _strake(strake: Strake, profile: Profile) -> Any:
    """Plate from inside the hull to its outer edge, x aft of the nose."""
    from manifold3d import CrossSection, FillRule, Manifold

    x = np.linspace(strake.start, strake.end, _CHORD_POINTS)
    r = profile.radius(x)
    outline = np.concatenate([np.stack([x, 0.5 * r], axis=1), np.stack([x, r + strake.height_at(x)], axis=1)[::-1]])
    plate = Manifold.extrude(CrossSection([outline.tolist()], FillRule.NonZero), strake.thickness)
    y, z = strake.span_direction[1:]
    half = 0.5 * strake.thickness
    return plate.transform(np.array([[1.0, 0.0, 0.0, 0.0], [0.0, y, -z, z * half], [0.0, z, y, -y * half]]))


def _inner_radius(fin: Fin, profile: Profile) -> float:
    """Radius [m] from which the fin is built: inside the hull over the whole root, as far out as that allows."""

    def sunk(y: float) -> bool:
        trailing = float(fin.trailing_edge_at(y))
        chord = float(fin.chord(y))
        xi = cosine_fractions(_CHORD_POINTS)
        hull = profile.radius(trailing - chord * (1.0 - xi))
        return bool(np.all(np.hypot(y, chord * half_thickness(fin.thickness, xi)) < 0.98 * hull))

    levels = [float(y) for y in np.linspace(fin.tip_radius, 0.0, 401) if fin.chord(y) > 0.0]
    return next((y for y in levels if sunk(y)), levels[-1])


def write_stl(craft: Craft, path: str | Path) -> Path:
    """Write the solid as binary STL [m], body axes from the origin. The file is whole or absent.

    Raises
    ------
    ArtefactError
        The file cannot be written.
    """
    return _write(solid(craft), Path(path), "stl")


def write_glb(craft: Craft, path: str | Path) -> Path:
    """Write the solid as GLB [m] for viewers, turned to glTF axes (y up, z forward). The file is whole or absent.

    Raises
    ------
    ArtefactError
        The file cannot be written.
    """
    mesh = solid(craft, *_VIEW)
    mesh.vertices = np.asarray(mesh.vertices) @ _GLTF_AXES.T
    return _write(mesh, Path(path), "glb")


def _write(mesh: trimesh.Trimesh, path: Path, kind: str) -> Path:
    content: Any = mesh.export(file_type=kind)
    return replace_file(path, lambda part: _write_bytes(part, content))


def _write_bytes(part: Path, content: bytes) -> None:
    part.write_bytes(content)


def enclosed(mesh: trimesh.Trimesh) -> tuple[float, Array, float]:
    """Volume [m3], centroid (3,) [m] and surface area [m2] of a closed mesh."""
    return float(mesh.volume), np.asarray(mesh.center_mass, dtype=float), float(mesh.area)
