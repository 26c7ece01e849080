"""What a pilot is asked to do during one leg: numbers only, so that a leg is a row of floats to the engine."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Orders:
    """Orders of one leg. The defaults are "nothing ordered, no pilot". Switches are 0.0 or 1.0, used as factors.

    piloted : 1 when a pilot flies; at 0 every other switch is without effect.
    rudder, elevator [rad] : virtual angles used where the pilot has no order.
    steer : 1 when a heading is followed.   heading [rad].
    track : 1 when the line of sight to a leg gives the heading; it steers whether ``steer`` is set or not.
    north, east [m] : start of the leg.   course [rad].   lookahead [m] : distance ahead at which the craft aims, > 0.
    drift [1/s] : gain of the guidance integral.   crab [rad] : angle between course and heading in a known current.
    dive : 1 when a depth is followed.   depth [m].   damp_roll : 1 when the pilot damps roll.
    turning : 1 when a rate of turn is followed instead of a heading; ``steer`` must be set.   turn [rad/s].
    pitching : 1 when a pitch is followed instead of a depth; ``dive`` must be set.   pitch [rad].
    throttle : thrust as a multiple of the run's own; 0 when the propeller stops, below 0 astern.
    fin1 ... fin4 [rad] : added to the angle asked of one fin, such as the angles of a record that is replayed.
    """

    piloted: float = 0.0
    rudder: float = 0.0
    elevator: float = 0.0
    steer: float = 0.0
    heading: float = 0.0
    track: float = 0.0
    north: float = 0.0
    east: float = 0.0
    course: float = 0.0
    lookahead: float = 1.0
    drift: float = 0.0
    crab: float = 0.0
    dive: float = 0.0
    depth: float = 0.0
    damp_roll: float = 1.0
    turning: float = 0.0
    turn: float = 0.0
    pitching: float = 0.0
    pitch: float = 0.0
    throttle: float = 1.0
    fin1: float = 0.0
    fin2: float = 0.0
    fin3: float = 0.0
    fin4: float = 0.0


ORDERS: tuple[str, ...] = tuple(field.name for field in fields(Orders))
"""Names of the orders, in the order in which they are packed."""
FIN_ORDERS: tuple[str, ...] = tuple(name for name in ORDERS if name.startswith("fin"))
"""Orders of single fins."""
