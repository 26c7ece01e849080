"""Start states of the engine from attitudes in degrees of freedom that people name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from towtank.frames import Array
from towtank.model.kinematics import quaternion_of


def at(state: Sequence[float] | Array, memory: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """Start (13 + n + 3,) of the engine from a state (12 + n,) of the model and the steering's memory (3,).

    state : x y z [m], phi theta psi [rad], u v w p q r, fin angles [rad], as in ``towtank.model.equations.STATE``.
    """
    values = np.asarray(state, dtype=float)
    e = quaternion_of(values[3:6].tolist())
    return np.concatenate([values[:3], e, values[6:], np.asarray(memory, dtype=float)])
