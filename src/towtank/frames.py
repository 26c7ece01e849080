"""Frames and rotations.

Body axes x forward, y starboard, z down, origin at the centre of buoyancy unless a file says otherwise.
World axes north, east, down (NED). Attitude by Euler angles phi, theta, psi (roll, pitch, yaw), in the order
R1(phi) R2(theta) R3(psi) of ``perron`` eq. 2.3-2.7. Positions along the hull given "from the nose" run aft;
``body_x`` is the only place where they are turned into body axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def body_x(from_nose: Array | float, origin_from_nose: float) -> Array:
    """Body-axis x [m] of a station given by its distance aft of the nose [m]."""
    return np.asarray(origin_from_nose - np.asarray(from_nose, dtype=float))


def rotation(attitude: Array) -> Array:
    """Body-to-NED direction cosines, shape (..., 3, 3), for attitude (..., 3) = phi, theta, psi [rad].

    Source     perron, eq. 2.3-2.7.
    """
    phi, theta, psi = np.moveaxis(np.asarray(attitude, dtype=float), -1, 0)
    sf, cf, st, ct, sp, cp = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta), np.sin(psi), np.cos(psi)
    rows = [
        [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
        [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
        [-st, ct * sf, ct * cf],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def move_load(load: Array, shift: Array) -> Array:
    """Load (..., 6) about a point displaced by ``shift`` (3,) [m, body axes] from the present one.

    The force is unchanged; the moment becomes M - shift x F.
    """
    load = np.asarray(load, dtype=float)
    force, moment = load[..., :3], load[..., 3:]
    return np.concatenate([force, moment - np.cross(np.broadcast_to(shift, force.shape), force)], axis=-1)


def move_velocity(nu: Array, shift: Array) -> Array:
    """Body velocity (..., 6) of the point displaced by ``shift`` (3,) [m, body axes] from the present one."""
    nu = np.asarray(nu, dtype=float)
    v, w = nu[..., :3], nu[..., 3:]
    return np.concatenate([v + np.cross(w, np.broadcast_to(shift, v.shape)), w], axis=-1)


def drift_angle(nu: Array) -> Array:
    """Drift beta = atan2(-v, u) [rad] of velocities (..., 6) (SNAME; perron section 2.1)."""
    return np.arctan2(-nu[..., 1], nu[..., 0])


def incidence_angle(nu: Array) -> Array:
    """Incidence alpha = atan2(w, u) [rad] of velocities (..., 6)."""
    return np.arctan2(nu[..., 2], nu[..., 0])
