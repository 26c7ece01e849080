"""Rigid body of a craft: displaced mass, centre of gravity, inertia about the origin."""

from __future__ import annotations

import numpy as np

from towtank.craft.craft import Profile
from towtank.craft.integrals import hull_integrals
from towtank.frames import Array
from towtank.water import GRAVITY

Matrix = tuple[tuple[float, float, float], ...]


def displaced_by_percent(mass: float, percent: float) -> float:
    """Displaced mass [kg] of a craft whose net buoyancy is ``percent`` of its weight; negative is heavy.

    Source     perron, table 3.1, "% buoyancy".
    Departure  The sign is undefined there; here b = m (1 + percent / 100).
    """
    return mass * (1.0 + percent / 100.0)


def displaced_by_force(buoyancy: float) -> float:
    """Displaced mass [kg] of a ``buoyancy`` [N]."""
    return buoyancy / GRAVITY


def move_inertia(inertia: Array, mass: float, cg: Array) -> Array:
    """Inertia (3, 3) [kg m2] about the origin of a body with ``inertia`` about its centre of gravity.

    Source     fossen2021, parallel-axes theorem: I_o = I_g + m (r.r I - r r^T).
    """
    cg = np.asarray(cg, dtype=float)
    return np.asarray(inertia + mass * (cg @ cg * np.eye(3) - np.outer(cg, cg)))


def uniform_inertia(profile: Profile, mass: float) -> Array:
    """Principal moments (3,) [kg m2] about its own centroid of a uniform body of ``mass`` [kg] that fills the hull.

    Source     fossen2021, inertia tensor as a volume integral.
    Valid      An estimate where no inertia is known. Fins and ballast are left out, so the roll moment is low for a
               craft with wide fins and high for one whose heavy parts lie near the axis.
    """
    hull = hull_integrals(profile)
    return mass * np.array([hull.roll_gyration2, hull.pitch_gyration2, hull.pitch_gyration2])


def as_rows(matrix: Array) -> Matrix:
    """A (3, 3) array as a hashable tuple of rows."""
    rows = np.asarray(matrix, dtype=float).tolist()
    return tuple((row[0], row[1], row[2]) for row in rows)
