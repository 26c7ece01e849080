"""Closed-form criteria of many craft at once: what a requirement may be put on beside the indices of the trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from towtank.frames import Array
from towtank.verdict.criteria import growth, index, vertical_matrix
from towtank.verdict.many import Many, masses
from towtank.verdict.turns import many_turns


@dataclass(frozen=True)
class Measure:
    """One criterion. of : n craft -> (n,) in ``unit``; infinite where there is no such limit.   words : what it is.

    wide : rests on the wide fit, that trials fly on; otherwise on the slopes at the origin where there are any.
    """

    unit: str
    words: str
    of: Callable[[Many], Array]
    wide: bool = False


def stiffness(craft: Many) -> Array:
    """Righting moment over a small angle of roll or of pitch, g (m zG - b zB) (n,) [N m/rad].

    Source     perron, eq. 2.17, rows 4 and 5, for a level craft; fossen2021, ch. 4.
    """
    b = craft.body
    return np.broadcast_to(b.g * (b.m * b.zG - b.b * b.zB), (len(craft),))


def metacentric_height(craft: Many) -> Array:
    """BG = zG - zB (n,) [m], the metacentric height of a submerged body; positive is upright.

    Source     fossen2021, ch. 4.
    """
    return np.broadcast_to(craft.body.zG - craft.body.zB, (len(craft),)).astype(float)


def swing_period(craft: Many, axis: int) -> Array:
    """Period (n,) [s] of free roll (axis 3) or pitch (axis 4) at rest; infinite where the craft is not upright.

    T = 2 pi / sqrt(((M_RB - M_A)^-1 g)_axis), g the load for a small angle of the axis: righting moment, and what
    weight and buoyancy do sidewise and in yaw where they do not balance.

    Source     Row of the axis of (M_RB - M_A) nudot + G = 0; with sway, surge and the other motions free to follow.
    Valid      Small angles, no speed ahead, no damping.
    """
    b, count = craft.body, len(craft)
    gx, gy = b.g * (b.xG * b.m - b.xB * b.b), b.g * (b.yG * b.m - b.yB * b.b)
    weight, k = b.g * (b.m - b.b), stiffness(craft)
    none = np.zeros(count)
    # Rows of the restoring vector, slope to phi or theta at level flight.
    rows: list[Any] = [none, -weight, none, k, none, -gx] if axis == 3 else [weight, none, none, none, k, -gy]
    load = np.stack([np.broadcast_to(row, (count,)) for row in rows], axis=-1)
    square = np.linalg.solve(masses_of(craft), load[..., None])[:, axis, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(square > 0.0, 2.0 * np.pi / np.sqrt(np.maximum(square, 0.0)), np.inf)


def masses_of(craft: Many) -> Array:
    """M_RB - M_A (n, 6, 6) of ``craft``."""
    return masses(craft.model, craft.columns)


def reversal_speed(craft: Many) -> Array:
    """Speed (n,) [m/s] below which the elevator acts reversed on depth; 0 where it never does, NaN without fins.

    u_c^2 = -(m zG - b zB) g Zuude / (Zuw Muude - Muw Zuude).

    Source     As ``towtank.model.linear.elevator_reversal_speed``, for many craft.
    Valid      Small angles, a craft in balance without the elevator.
    """
    v = craft.v
    if not craft.model.craft.fins or "Zuude" not in v or "Muude" not in v:
        return np.full(len(craft), np.nan)
    below = v["Zuw"] * v["Muude"] - v["Muw"] * v["Zuude"]
    with np.errstate(divide="ignore", invalid="ignore"):
        square = -stiffness(craft) * v["Zuude"] / below
    return np.sqrt(np.where(square > 0.0, square, 0.0))


def munk_speed(craft: Many) -> Array:
    """Speed (n,) [m/s] above which the flow turns a pitched craft further, sqrt(g (m zG - b zB) / Muw).

    A craft that is carried along level with the pitch angle theta has the incidence w/u = theta. The flow then gives
    the moment Muw u^2 theta, the weight -g (m zG - b zB) theta. Infinite where Muw does not turn it further; 0 where
    the weight does not right it.

    Source     fossen2021, ch. 4 and 6: restoring moment and Munk moment; Muw holds the hull's Munk moment and the lift
               of the fins.
    Valid      Static: no pitch damping, depth held by other means, elevator amidships. What such a craft does when it
               is free to heave is ``critical_speed``.
    """
    k, moment = stiffness(craft), craft.v.get("Muw", np.zeros(len(craft)))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(k <= 0.0, 0.0, np.where(moment > 0.0, np.sqrt(np.abs(k / moment)), np.inf))


def critical_speed(craft: Many) -> Array:
    """Speed (n,) [m/s] above which the vertical plane is unstable with the elevator at rest; infinite for none.

    The matrix of (w, q, theta) is u D + e: D (2, 2) at 1 m/s, e = (e1, e2) the righting column. Its characteristic
    polynomial s^3 - u tr D s^2 + (u^2 det D - e2) s + u (D11 e2 - D21 e1) has a root on the imaginary axis where
    u^2 = (D21 e1 + D22 e2) / (tr D det D).

    Source     Routh's condition on ``vertical_matrix``; fossen2021, ch. 8.
    Valid      Small motions about level flight. 0 for a craft that is unstable, or not righted, at every speed.
    """
    A = vertical_matrix(craft.model, craft.v, 1.0, craft.body)
    D, e1, e2 = A[:, :2, :2], A[:, 0, 2], A[:, 1, 2]
    trace, det = D[:, 0, 0] + D[:, 1, 1], D[:, 0, 0] * D[:, 1, 1] - D[:, 0, 1] * D[:, 1, 0]
    righted = (trace < 0.0) & (D[:, 0, 0] * e2 - D[:, 1, 0] * e1 > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        square = (D[:, 1, 0] * e1 + D[:, 1, 1] * e2) / (trace * det)
    limited = np.sqrt(np.where(square > 0.0, square, 0.0))
    return np.where(~righted, 0.0, np.where(det < 0.0, limited, np.where(square > 0.0, 0.0, np.inf)))


def _loop(craft: Many, part: int) -> Array:
    """Width [deg] or height [deg/s] (n,) of the instability loop; NaN for a craft without fins."""
    if not craft.model.craft.fins:
        return np.full(len(craft), np.nan)
    return np.degrees(_loops(craft)[part])


@lru_cache(maxsize=2)
def _loops(craft: Many) -> tuple[Array, Array]:
    """Both numbers of the loop, which are found together."""
    return many_turns(craft, craft.model.craft.speed).loop()


def _index(craft: Many, plane: str) -> Array:
    return index(craft.model, craft.v, plane, craft.body)


def _growth(craft: Many, plane: str) -> Array:
    return growth(craft, plane, craft.model.craft.speed)


MEASURES: Mapping[str, Measure] = {
    "G_h": Measure("", "stability index, horizontal plane", partial(_index, plane="horizontal")),
    "G_v": Measure("", "stability index, vertical plane, without righting moment", partial(_index, plane="vertical")),
    "growth_horizontal": Measure(
        "1/s", "growth of the least damped mode, horizontal plane", partial(_growth, plane="horizontal")
    ),
    "growth_vertical": Measure(
        "1/s", "growth of the least damped mode, vertical plane, righted", partial(_growth, plane="vertical")
    ),
    "loop_width": Measure("deg", "width of the instability loop, in rudder", partial(_loop, part=0), True),
    "loop_height": Measure("deg/s", "height of the instability loop, in yaw rate", partial(_loop, part=1), True),
    "metacentric_height": Measure("m", "BG, centre of gravity below the centre of buoyancy", metacentric_height),
    "righting_moment": Measure("N m/deg", "righting moment in roll and in pitch", lambda c: np.radians(stiffness(c))),
    "roll_period": Measure("s", "period of free roll at rest", partial(swing_period, axis=3)),
    "pitch_period": Measure("s", "period of free pitch at rest", partial(swing_period, axis=4)),
    "munk_speed": Measure("m/s", "speed above which incidence outweighs the righting moment", munk_speed),
    "critical_speed": Measure("m/s", "speed above which the vertical plane is unstable, fins held", critical_speed),
    "elevator_reversal_speed": Measure("m/s", "speed below which the elevator acts reversed on depth", reversal_speed),
}  # fmt: skip
"""Criterion -> how it is found."""

SHARES: Mapping[str, str] = {"P_stable_horizontal": "growth_horizontal", "P_stable_vertical": "growth_vertical"}
"""Criterion that is a share of the drawn craft -> the measure that is below zero for them."""
