"""Orders tick by tick, for derivatives along a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from towtank.engine.parameters import Places
from towtank.engine.plan import Clock, Leg
from towtank.errors import InputError
from towtank.frames import Array
from towtank.pilot.orders import ORDERS

WHOLE = 1e-6
"""Largest fraction of a tick by which a leg's duration may miss a whole number of ticks."""


@dataclass(frozen=True)
class Record:
    """Orders tick by tick: tick k is flown under ``orders[row[k]]``.

    orders (rows, len(ORDERS)).   row (ticks,) integers.   clock : control period and steps.

    Raises
    ------
    InputError
        Orders of another width or not finite, no tick, or a row that is not there.
    """

    orders: Array
    row: Places
    clock: Clock

    def __post_init__(self) -> None:
        orders, row = np.asarray(self.orders, dtype=float), np.asarray(self.row, dtype=np.int64)
        if orders.ndim != 2 or orders.shape[1] != len(ORDERS) or not np.isfinite(orders).all():
            raise InputError(
                f"record: orders have the shape {orders.shape} or hold a number that is not finite. Give finite rows "
                f"of {len(ORDERS)}: {', '.join(ORDERS)}."
            )
        if row.ndim != 1 or not row.size or row.min() < 0 or row.max() >= len(orders):
            raise InputError(
                f"record: row has the shape {row.shape} or names a row outside the {len(orders)} of orders. Give the "
                "number of a row, from 0, for each tick, and one tick or more."
            )
        object.__setattr__(self, "orders", np.ascontiguousarray(orders))
        object.__setattr__(self, "row", np.ascontiguousarray(row))

    @property
    def time(self) -> Array:
        """Ends of the ticks (ticks,) [s]: when the channels are seen."""
        return np.asarray(self.clock.tick * np.arange(1, len(self.row) + 1))


def record_of(legs: Sequence[Leg], clock: Clock) -> Record:
    """The record of ``legs`` that end by time.

    Raises
    ------
    InputError
        No legs, a leg that may end by an event, or one whose duration is not a whole number of ticks.
    """
    row: list[int] = []
    for i, leg in enumerate(legs):
        if leg.until is not None:
            raise InputError(
                f"leg {leg.name}: it ends by an event of {leg.until.channel}, and the slope of a run with a moving end "
                "is not taken here. Run it once with fly, and give the time at which it ended as within."
            )
        ticks = leg.within / clock.tick
        if not (np.isfinite(ticks) and round(ticks) >= 1 and abs(ticks - round(ticks)) <= WHOLE):
            raise InputError(
                f"leg {leg.name}: within {leg.within:g} s is {ticks:g} ticks of {clock.tick:g} s, and derivatives are "
                "taken over whole ticks. Change within, or choose a clock whose tick divides it."
            )
        row += [i] * round(ticks)
    orders = np.array([[float(x) for x in astuple(leg.orders)] for leg in legs]).reshape(-1, len(ORDERS))
    return Record(orders, np.array(row, dtype=np.int64), clock)
