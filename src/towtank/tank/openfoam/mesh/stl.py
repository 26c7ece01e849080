"""A surface from an STL file: is it closed, and is it this craft, in metres, body axes, about the body origin."""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.integrals import centre_of_buoyancy
from towtank.errors import InputError
from towtank.frames import Array

CONVENTION = "metres, body axes of the craft (x forward, y starboard, z down), origin at the body origin"
PLACE = 0.03
"""Judgement: share of the craft's length by which the ends and the centre of volume of the surface may be off. Loads
are made dimensionless by that length and taken about that origin: what is off there is off in every coefficient."""

BEND = 30.0
"""Edges at which facets turn by more [deg] are features that the mesh has to follow."""

UNITS = {1000.0: "millimetres", 100.0: "centimetres", 39.37: "inches", 3.2808: "feet"}


@dataclass(frozen=True)
class Surface:
    """A closed surface of one or more bodies.

    low, high, centre (3,) [m] : corners of its box, and centre of volume.   volume [m3], area [m2].
    edges : sharp ones, beyond ``BEND``.   facets : triangles.   digest : hash of the file.
    """

    path: Path
    digest: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    centre: tuple[float, ...]
    volume: float
    area: float
    edges: int
    facets: int


def file_digest(path: Path) -> str:
    """Hash of the content of the file at ``path``.

    Raises
    ------
    InputError
        It cannot be read.
    """
    try:
        status = path.stat()
        return _digest(path, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise InputError(f"surface {path}: {error.strerror or error}. Name an STL file: {CONVENTION}.") from None


@functools.lru_cache(maxsize=8)
def _digest(path: Path, _changed: int, _size: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def read_surface(path: Path) -> Surface:
    """The surface in the STL file ``path``, ascii or binary.

    Raises
    ------
    InputError
        It cannot be read, holds no triangles, or is not closed.
    """
    return _read(path, file_digest(path))


@functools.lru_cache(maxsize=4)
def _read(path: Path, digest: str) -> Surface:
    mesh = load(path)
    once = np.bincount(mesh.edges_unique_inverse, minlength=len(mesh.edges_unique)) != 2
    if once.any():
        x, y, z = mesh.vertices[mesh.edges_unique[once]].mean(axis=1)[0]
        raise InputError(
            f"surface {path} is not closed: {int(once.sum())} edges do not have a facet on either side, one of them at "
            f"({x:.4g} {y:.4g} {z:.4g}). Water would be meshed inside the hull. Join its parts into one solid where it "
            "was drawn, and export it again."
        )
    if not mesh.is_winding_consistent:
        raise InputError(
            f"surface {path}: neighbouring facets look opposite ways, so its inside is not told. Make the normals of "
            "all facets look outwards, and export it again."
        )
    low, high, centre = (tuple(float(v) for v in corner) for corner in (*mesh.bounds, mesh.center_mass))
    return Surface(
        path=path,
        digest=digest,
        low=low,
        high=high,
        centre=centre,
        volume=abs(float(mesh.volume)),
        area=float(mesh.area),
        edges=int(np.count_nonzero(np.degrees(mesh.face_adjacency_angles) > BEND)),
        facets=len(mesh.faces),
    )


def load(path: Path) -> Any:
    """Triangles of an STL file, corners that coincide joined."""
    import trimesh

    try:
        mesh = trimesh.load_mesh(path, file_type="stl")
    except (OSError, ValueError, KeyError, IndexError, AttributeError) as error:
        raise InputError(f"surface {path} is not an STL file that can be read ({error}). Export it as STL.") from None
    if not len(getattr(mesh, "faces", ())):
        raise InputError(f"surface {path} holds no triangles. Export the hull as STL.")
    return mesh


def check_fit(surface: Surface, craft: Craft) -> None:
    """See that ``surface`` is ``craft``, and stands as the craft does.

    Departure  Upside down cannot be told from upright on most hulls, nor port from starboard.

    Raises
    ------
    InputError
        Length, ends or centre of volume differ by more than ``PLACE`` of the length.
    """
    low, high, centre = (np.array(item) for item in (surface.low, surface.high, surface.centre))
    nose, tail = craft.origin_from_nose, craft.origin_from_nose - craft.length
    _, along, y, z = centre_of_buoyancy(craft.profile, craft.fins, craft.strakes)
    limit = PLACE * craft.length
    found = np.array([high[0], low[0], *centre])
    wanted = np.array([nose, tail, nose - along, y, z])
    off = np.abs(found - wanted)
    if not np.any(off > limit):
        return
    words = ("its foremost point at x", "its aftmost point at x", "its centre of volume at x", "at y", "at z")
    worst = int(off.argmax())
    raise InputError(
        f"surface {surface.path} is not where craft {craft.name!r} is: {words[worst]} = {found[worst]:.4g} m, the "
        f"craft's is {wanted[worst]:.4g} m, and {limit:.3g} m ({100 * PLACE:.0f} % of the length) may lie between "
        f"them. {_guess(high - low, found, wanted, limit)} An STL has to be in {CONVENTION}."
    )


def _guess(extent: Array, found: Array, wanted: Array, limit: float) -> str:
    """What probably is wrong, and the remedy."""
    length = wanted[0] - wanted[1]
    longest = int(extent.argmax())
    for factor, unit in UNITS.items():
        if abs(extent[longest] / length / factor - 1.0) < PLACE:
            return f"It seems to be in {unit}: divide its coordinates by {factor:g}."
    if longest:
        return f"Its longest side lies along {'xyz'[longest]}: turn it, so that the nose points to +x."
    if abs(extent[0] - length) > limit:
        return f"It is {extent[0]:.4g} m long and the craft {length:.4g} m: give the craft of this hull, or scale it."
    reversed_ = np.array([-found[1], -found[0], -found[2]])
    if np.all(np.abs(reversed_ - wanted[:3]) <= limit):
        return "Its nose points to -x: turn it by 180 deg about z."
    shift = found[:3] - wanted[:3]
    if np.ptp(shift) <= limit:
        return f"Its origin seems to be elsewhere: move it by {-shift.mean():.4g} m along x."
    turned = np.array([-found[1], -found[0], -found[2]]) - wanted[:3]
    if np.ptp(turned) <= limit:
        return f"Its nose points to -x: turn it by 180 deg about z, then move it by {-turned.mean():.4g} m along x."
    return "Compare its origin and its axes with the craft file."
