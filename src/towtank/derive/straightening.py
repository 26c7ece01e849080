"""Straightening factors: what a fin adds per angle of the flow, in drift and in turning, over its own deflection."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives
from towtank.frames import Array, body_x
from towtank.plan.kinds import CaptiveTest, Motion
from towtank.plan.motion import Drift, Turn
from towtank.progress import Silent
from towtank.symbols import LOADS
from towtank.tank.fast.tank import FastTank

DRIFT, TURN, RUDDER = np.radians(2.0), 0.06, np.radians(2.0)
"""Drift [rad], turning rate r L / U and rudder [rad] of the runs to both sides: within the linear range of all three,
and the turn brings the fins about the angle of the drift."""

ARMS = 0.07
"""Relative standard uncertainty added to both factors: half the gap between kappa_r from side force and from yawing
moment of SUBOFF (roddy1990), 1.70 and 1.48. The tank's interference theory gives both loads the same factor."""


@dataclass(frozen=True)
class Straightening:
    """kappa_v, kappa_r with standard uncertainties; station of the stocks aft of the nose [m], level and source.

    by_load : (kappa_v, kappa_r) from side force alone and from yawing moment alone, (2, 2).
    """

    kappa_v: float
    kappa_r: float
    std: tuple[float, float]
    station_from_nose: float
    level: str
    source: str
    by_load: tuple[tuple[float, float], tuple[float, float]]


def factors(added: Array, deflected: Array) -> tuple[Array, Array]:
    """Factor of the added loads of fins over those of their deflection.

    Parameters
    ----------
    added : side force and yawing moment (2, ...) that the fins add, per angle that the flow makes at the stocks: -v/u
        in drift, -x r/u in turning.   deflected : the same loads per angle of rudder. Moment over a length, or both
        primed.

    Returns
    -------
    The factor that fits both loads best (...), and those of each load by itself (2, ...).

    Source     THEORY section 5: hull and fins less the bare hull, drift, turning and deflection apart.
    Departure  One factor for force and moment; they differ where the load carried over acts ahead of the fins.
    """
    both = (added * deflected).sum(axis=0) / (deflected * deflected).sum(axis=0)
    return np.asarray(both), np.asarray(added / deflected)


def straightening(craft: Craft, tank: FastTank | None = None) -> Straightening | None:
    """Both factors of the fins of ``craft``, None for one without a rudder.

    Captive tests of the craft and of its bare hull: steady drift and steady turn to both sides, and the rudder.

    Parameters
    ----------
    craft : the craft.   tank : the fast tank, by default as in a campaign; the bare hull is towed in the same.

    Source     THEORY section 5; perron, section 3.7.1 for the use of the factors.
    Departure  Small angles only: what stall and the wake of the hull change at large drift is not in two factors.
    Valid      Ahead. Level of the tank; for SUBOFF see tests/papers/test_straightening_of_suboff.py.
    """
    mixing = craft.mixing
    if not craft.fins or not np.any(mixing[:, 0]):
        return None
    tank = FastTank() if tank is None else tank
    rudder = np.linalg.pinv(mixing)[0]
    side = np.array([fin.lift_direction[1] for fin in craft.fins])
    stock = np.array([_stock(craft, number) for number in range(len(craft.fins))])
    x = body_x(stock, craft.origin_from_nose)
    drifted, turned = float(rudder @ side), float(rudder @ (side * x))
    if abs(drifted) < 1e-9 or abs(turned) < 1e-9 * craft.length:
        return None
    speed, length = craft.speed, craft.length
    bare = replace(craft, fins=())
    still: tuple[float, ...] = ()
    drift = _slope(craft, tank, Drift(speed, DRIFT), Drift(speed, -DRIFT), still) - _slope(
        bare, tank, Drift(speed, DRIFT), Drift(speed, -DRIFT), still
    )
    rate = TURN * speed / length
    turn = _slope(craft, tank, Turn(speed, rate), Turn(speed, -rate), still) - _slope(
        bare, tank, Turn(speed, rate), Turn(speed, -rate), still
    )
    ahead = Drift(speed, 0.0)
    helm = _slope(craft, tank, ahead, ahead, tuple((mixing[:, 0] * RUDDER).tolist())) / RUDDER
    kv, kv_each = factors(drift / (np.tan(DRIFT) * drifted), helm)
    kr, kr_each = factors(turn / (-rate / speed * turned), helm)
    return Straightening(
        kappa_v=float(kv[0]),
        kappa_r=float(kr[0]),
        std=(_std(kv, kv_each), _std(kr, kr_each)),
        station_from_nose=float((np.abs(rudder * side) * stock).sum() / np.abs(rudder * side).sum()),
        level=tank.level,
        source="drift, turn and rudder in the fast tank: craft less its bare hull",
        by_load=((float(kv_each[0, 0]), float(kv_each[1, 0])), (float(kr_each[0, 0]), float(kr_each[1, 0]))),
    )


def with_straightening(derivatives: Derivatives, craft: Craft, tank: FastTank | None = None) -> Derivatives:
    """``derivatives`` with the factors of ``craft`` in their fin curve; as they are where there is no curve."""
    if derivatives.fin_curve is None:
        return derivatives
    found = straightening(craft, tank)
    if found is None:
        return derivatives
    curve = replace(
        derivatives.fin_curve,
        kappa_v=found.kappa_v,
        kappa_r=found.kappa_r,
        kappa_std=found.std,
        station_from_nose=found.station_from_nose,
        kappa_level=found.level,
        kappa_source=found.source,
    )
    shift = craft.origin_from_nose - derivatives.reference.origin_from_nose
    return replace(derivatives, fin_curve=curve.about(craft.origin_from_nose, shift))


def _stock(craft: Craft, number: int) -> float:
    """Stock of a fin aft of the nose [m], as in ``towtank.model.fins``."""
    fin = craft.fins[number]
    y = 0.5 * (fin.root_radius + fin.tip_radius)
    return float(fin.trailing_edge_at(y)) - (1.0 - fin.hinge) * float(fin.chord(y))


def _slope(craft: Craft, tank: FastTank, plus: Motion, minus: Motion, fins: tuple[float, ...]) -> Array:
    """Half the difference of side force and yawing moment over the length (2, 1 + members), plus less minus."""
    back = tuple(-angle for angle in fins)
    loads = [
        _loads(craft, tank, CaptiveTest(name, craft.speed, motion, fins=angles))
        for name, motion, angles in (("plus", plus, fins), ("minus", minus, back))
    ]
    return np.asarray(0.5 * (loads[0] - loads[1]))


def _loads(craft: Craft, tank: FastTank, test: CaptiveTest) -> Array:
    run = tank.run(craft, test, Silent())
    members = run.loads[None, 0] if run.ensemble is None else np.vstack([run.loads[None, 0], run.ensemble[:, 0]])
    return np.stack([members[:, LOADS.index("Y")], members[:, LOADS.index("N")] / craft.length])


def _std(both: Array, each: Array) -> float:
    """Spread of the ensemble, half the gap between force and moment, and ``ARMS``, added in squares."""
    spread = float(((both[1:] - both[0]) ** 2).mean()) if len(both) > 1 else 0.0
    return float(np.sqrt(spread + 0.25 * (each[0, 0] - each[1, 0]) ** 2 + (ARMS * both[0]) ** 2))
