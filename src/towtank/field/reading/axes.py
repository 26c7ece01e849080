"""From the axes of a log to ours: body x forward, y starboard, z down; world north, east, down."""

from __future__ import annotations

from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.field.reading.mapping import Axes
from towtank.frames import Array, rotation
from towtank.tank.imported.convert import axis_matrix, euler

BODY = (("u", "v", "w"), ("ahead", "slip", "plunge"), ("p", "q", "r"))
"""Components along body axes; a rate is about one."""
WORLD = (("x", "y", "z"), ("vn", "ve", "vd"))
ANGLES = ("phi", "theta", "psi")
QUATERNION = ("qw", "qx", "qy", "qz")
Columns = dict[str, Array]
_PLAIN = ("x", "y", "z")


def turned(columns: Columns, axes: tuple[Axes, Axes], said: list[str]) -> Columns:
    """Channels (N,) along our axes from those along the file's.

    Raises
    ------
    InputError
        Axes that are no right-handed set, or some Euler angles of three in axes that need all.
    """
    body, world = axis_matrix(axes[0]), axis_matrix(axes[1])
    out = dict(columns)
    for names in BODY:
        _permuted(columns, out, names, body)
    for names in WORLD:
        _permuted(columns, out, names, world)
    _attitude(columns, out, body, world, said)
    if axes != (_PLAIN, _PLAIN):
        said.append(
            f"axes of the file: forward {axes[0][0]}, starboard {axes[0][1]}, down {axes[0][2]}; "
            f"north {axes[1][0]}, east {axes[1][1]}, down {axes[1][2]}"
        )
    return out


def _permuted(columns: Columns, out: Columns, names: tuple[str, ...], matrix: Array) -> None:
    for name in names:
        out.pop(name, None)
    for i, name in enumerate(names):
        j = int(np.argmax(np.abs(matrix[i])))
        if names[j] in columns:
            out[name] = matrix[i, j] * columns[names[j]]


def _attitude(columns: Columns, out: Columns, body: Array, world: Array, said: list[str]) -> None:
    """Euler angles along our axes, from a quaternion or from those about the file's axes."""
    if all(name in columns for name in QUATERNION):
        for name in QUATERNION:
            out.pop(name)
        whole = np.stack([columns[name] for name in QUATERNION], axis=-1)
        cosines, lost = _cosines(whole)
        _put(out, world @ cosines @ body.T, np.isfinite(cosines).all(axis=(-1, -2)))
        said.append("attitude from a quaternion" + (f"; {lost} whose length is not 1 are left out" if lost else ""))
        return
    held = [name for name in ANGLES if name in columns]
    if not held or (np.array_equal(body, np.eye(3)) and np.array_equal(world, np.eye(3))):
        return
    if np.array_equal(body, np.diag([1.0, -1.0, -1.0])) and world[2, 2] == -1.0:
        # The same half turn about x on both sides: each angle by itself (frames.rotation, multiplied out).
        turn = float(np.arctan2(world[1, 0], world[0, 0]))
        for name, value in (("theta", 0.0), ("psi", turn)):
            if name in columns:
                out[name] = value - columns[name]
        return
    if len(held) < 3:
        raise InputError(
            f"axes: {', '.join(held)} of phi, theta, psi are mapped, and turning the attitude of these axes needs all "
            "three. Map them, or state axes in which each angle stands by itself and a factor for its sign."
        )
    angles = np.stack([columns[name] for name in ANGLES], axis=-1)
    _put(out, world @ rotation(angles) @ body.T, np.isfinite(angles).all(axis=-1))


def _put(out: Columns, cosines: Array, known: Any) -> None:
    angles = np.full((len(cosines), 3), np.nan)
    kept = np.asarray(known, dtype=bool)
    if kept.any():
        angles[kept] = euler(cosines[kept])
    for i, name in enumerate(ANGLES):
        out[name] = angles[:, i]


def _cosines(quaternion: Array) -> tuple[Array, int]:
    """Body-to-world cosines (N, 3, 3) of quaternions (N, 4), scalar part first; NaN where the length is not 1.

    Source     fossen2021, ch. 2: rotation matrix of a unit quaternion.
    """
    length = np.linalg.norm(quaternion, axis=-1)
    good = np.abs(length - 1.0) < 0.01
    w, x, y, z = np.moveaxis(quaternion / np.where(good, length, np.nan)[..., None], -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    lost = int((np.isfinite(length) & ~good).sum())
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2), lost


def body_velocity(columns: Columns, attitude: Array) -> tuple[Array, Array, Array]:
    """Velocities u, v, w (N,) over ground from vn, ve, vd (N,) by the ``attitude`` (N, 3) [rad]."""
    ground = np.stack([columns[name] for name in WORLD[1]], axis=-1)
    along = np.einsum("nji,nj->ni", rotation(attitude), ground)
    return along[:, 0], along[:, 1], along[:, 2]
