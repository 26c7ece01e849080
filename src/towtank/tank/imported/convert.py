"""From the axes, points, scales and balances of others to loads on the body about its origin. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array, move_load, rotation
from towtank.symbols import LOADS
from towtank.water import GRAVITY

AXES = {f"{sign}{name}": float(f"{sign}1") * np.eye(3)[i] for sign in ("", "-", "+") for i, name in enumerate("xyz")}
"""Signed axis -> unit vector (3,)."""

DOUBLED = {"xz": "XZM", "xy": "XYN"}
"""Plane a half model is cut at -> loads that the other half doubles; it cancels the others."""


def axis_matrix(axes: Sequence[str]) -> Array:
    """Matrix (3, 3) that turns components along the file's axes into body axes.

    axes : for each body axis, forward, starboard, down, the file's axis that points there: ("-x", "y", "-z") for a
        file with x aft and z up.

    Raises
    ------
    InputError
        No three signed axes, one used twice, or a left-handed set.
    """
    if len(axes) != 3 or any(axis not in AXES for axis in axes):
        raise InputError(
            f'axes {list(axes)}: write three of x, y, z with signs, such as ["-x", "y", "-z"] for x aft, z up.'
        )
    matrix = np.stack([AXES[axis] for axis in axes])
    determinant = float(np.linalg.det(matrix))
    if abs(determinant) < 0.5:
        raise InputError(f"axes {list(axes)}: an axis of the file is used twice. Use each of x, y, z once.")
    if determinant < 0.0:
        raise InputError(
            f"axes {list(axes)} turn a right-handed frame into a left-handed one, where moments change their sense. "
            "Correct one sign; a single column with a sign of its own takes factor = -1."
        )
    return matrix


def turned(vectors: Array, matrix: Array) -> Array:
    """Pairs of vectors (N, 6), such as loads or velocities, turned by ``matrix`` (3, 3) or (N, 3, 3)."""
    pairs = np.asarray(vectors, dtype=float).reshape(-1, 2, 3)
    return np.asarray(np.einsum("...ij,...kj->...ki", matrix, pairs).reshape(-1, 6))


def into_body(loads: Array, attitude: Array) -> Array:
    """Loads (N, 6) along world axes turned into body axes by the ``attitude`` (N, 3) phi, theta, psi [rad].

    Source     perron, eq. 2.3-2.7.
    """
    return turned(loads, np.swapaxes(rotation(attitude), -1, -2))


def turned_attitude(attitude: Array, matrix: Array) -> Array:
    """Attitude (N, 3) of a body whose Euler angles were taken about the file's axes, for both frames turned."""
    return euler(matrix @ rotation(attitude) @ matrix.T)


def euler(cosines: Array) -> Array:
    """Roll, pitch, heading (N, 3) [rad] of body-to-world cosines (N, 3, 3); heading without jumps."""
    theta = -np.arcsin(np.clip(cosines[..., 2, 0], -1.0, 1.0))
    phi = np.arctan2(cosines[..., 2, 1], cosines[..., 2, 2])
    psi = np.unwrap(np.arctan2(cosines[..., 1, 0], cosines[..., 0, 0]))
    return np.stack([phi, theta, psi], axis=-1)


def about_origin(loads: Array, point: Array) -> Array:
    """Loads (N, 6) about ``point`` moved to the origin.

    point : (3,) or (N, 3) [m], body axes, from the origin to the point of the moments.
    """
    return move_load(loads, -np.asarray(point, dtype=float))


def point_in_body(point: Array, attitude: Array, position: Array) -> Array:
    """Where a point fixed in space lies in body axes, (N, 3) [m].

    point (3,) : from the place of the origin at displacement zero, world axes.   position (N, 3) : displacement of the
    origin.   attitude (N, 3) [rad].
    """
    return np.asarray(np.einsum("nji,nj->ni", rotation(attitude), np.asarray(point) - position))


def static_load(attitude: Array, weight: float, cg: Array, buoyancy: float, cb: Array) -> Array:
    """Weight and buoyancy (N, 6) [N, N m] in body axes about the origin.

    weight, buoyancy [N]; cg, cb (3,) [m] from the origin; attitude (N, 3) [rad].

    Source     fossen2021, ch. 4: restoring forces of a submerged body.
    """
    down = rotation(attitude)[..., 2, :]
    force = (weight - buoyancy) * down
    moment = np.cross(weight * np.asarray(cg) - buoyancy * np.asarray(cb), down)
    return np.concatenate([force, moment], axis=-1)


def inertia_load(nu: Array, nudot: Array, mass: float, cg: Array, inertia: Array) -> Array:
    """Load (N, 6) [N, N m] that moves the rigid body: M_RB nudot + C_RB nu about the origin.

    nu, nudot (N, 6); mass [kg]; cg (3,) [m] from the origin; inertia (3, 3) [kg m2] about the origin.

    Source     perron, eq. 2.12 and 2.14; fossen2021, ch. 3.
    """
    v, w, vdot, wdot = nu[:, :3], nu[:, 3:], nudot[:, :3], nudot[:, 3:]
    g = np.broadcast_to(np.asarray(cg, dtype=float), v.shape)
    acceleration = vdot + np.cross(w, v)
    force = mass * (acceleration + np.cross(wdot, g) + np.cross(w, np.cross(w, g)))
    spin = w @ np.asarray(inertia).T
    moment = wdot @ np.asarray(inertia).T + np.cross(w, spin) + mass * np.cross(g, acceleration)
    return np.concatenate([force, moment], axis=-1)


def weight_of(mass: float) -> float:
    """Weight [N] of a mass [kg] under standard gravity."""
    return mass * GRAVITY


def whole_of_half(loads: Array, plane: str) -> Array:
    """Loads (N, 6) of a whole craft from those of one half, cut at the body plane ``plane``: "xz" or "xy".

    Valid      A flow that is symmetric about the plane; ``refuse_half`` checks the motion.
    """
    factor = np.array([2.0 if name in DOUBLED[plane] else 0.0 for name in LOADS])
    return np.asarray(loads * factor)


def refuse_half(plane: str, nu: Array, control: Array, where: str) -> None:
    """Refuse to double a half model whose flow is not symmetric about ``plane``.

    nu (N, 6); control (N, 4), virtual rudder, elevator, aileron, sum of squares.

    Raises
    ------
    InputError
        The motion or a fin breaks the symmetry.
    """
    across = {"v": nu[:, 1], "p": nu[:, 3], "r": nu[:, 5], "rudder": control[:, 0], "aileron": control[:, 2]}
    if plane == "xy":
        across = {"w": nu[:, 2], "p": nu[:, 3], "q": nu[:, 4], "elevator": control[:, 1], "aileron": control[:, 2]}
    broken = [name for name, values in across.items() if np.abs(values).max() > 1e-9]
    if broken:
        raise InputError(
            f"{where}: a model cut at the {plane} plane cannot move with {', '.join(broken)}: the flow past its other "
            f"half is another one, so the loads do not double. Give a run of the whole model, or correct half_model."
        )


def vanishing(nu: Array, control: Array, symmetry: str) -> str:
    """Loads, as letters, that symmetry makes zero in a motion ``nu`` (N, 6) with ``control`` (N, 4)."""
    quiet = {name: np.abs(nu[:, i]).max() <= 1e-9 for i, name in enumerate("uvwpqr")}
    rudder, elevator, aileron = (np.abs(control[:, i]).max() <= 1e-9 for i in range(3))
    out = ""
    if symmetry in ("fourfold", "mirror", "port-starboard") and all(quiet[n] for n in "vpr") and rudder and aileron:
        out += "YKN"
    if symmetry in ("fourfold", "mirror") and all(quiet[n] for n in "wpq") and elevator and aileron:
        out += "ZKM"
    return "".join(name for name in LOADS if name in out)


def load_scale(length_ratio: float, speed_ratio: float, density_ratio: float) -> Array:
    """Factors (6,) on loads for another length, speed and density at equal coefficients.

    Source     sname1950; force / (0.5 rho U2 L2), moment / (0.5 rho U2 L3).
    Departure  Viscous scale effect is left out: the coefficient is taken as that of the model's Reynolds number.
    """
    force = density_ratio * speed_ratio**2 * length_ratio**2
    return np.array([force] * 3 + [force * length_ratio] * 3)


def motion_scale(length_ratio: float, speed_ratio: float) -> tuple[float, Array, Array]:
    """Factors on time, on velocities (6,) and on accelerations (6,) at equal prime values.

    Source     sname1950, prime system.
    """
    time = length_ratio / speed_ratio
    velocity = np.array([speed_ratio] * 3 + [1.0 / time] * 3)
    return time, velocity, velocity / time
