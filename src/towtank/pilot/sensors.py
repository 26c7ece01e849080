"""What a pilot sees the craft through: how often, how well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import isfinite

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array

CHANNELS: Mapping[str, tuple[str, ...]] = {
    "position": ("x", "y"), "depth": ("z",), "depth_rate": ("sink",), "compass": ("psi",), "tilt": ("phi", "theta"),
    "gyro": ("p", "q", "r"), "log": ("u", "v", "w"),
}  # fmt: skip
"""What each sensor of ``Sensors`` measures, of ``Seen``."""


@dataclass(frozen=True)
class Reading:
    """A reading every ``period`` [s], 0 for every control period, held in between.

    std, bias : standard deviations of the noise of each reading, white, and of an offset drawn once a run; in the unit
    of what is measured.
    """

    period: float = 0.0
    std: float = 0.0
    bias: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no reading."""
        if not all(isfinite(x) and x >= 0.0 for x in (self.period, self.std, self.bias)):
            raise InputError(
                f"sensor: period {self.period:g} s, std {self.std:g}, bias {self.bias:g}. Give finite numbers of 0 or "
                "more; 0 is a sensor read in every control period, without noise or offset."
            )


@dataclass(frozen=True)
class Sensors:
    """The sensors of a craft; each is exact and read in every control period unless it is said otherwise.

    position [m], depth [m], depth_rate [m/s], compass [rad], tilt (roll and pitch) [rad], gyro [rad/s], log (speeds
    through the water) [m/s].
    """

    position: Reading = Reading()
    depth: Reading = Reading()
    depth_rate: Reading = Reading()
    compass: Reading = Reading()
    tilt: Reading = Reading()
    gyro: Reading = Reading()
    log: Reading = Reading()

    def table(self, channels: Sequence[str], tick: float) -> Array:
        """Rows (C, 3) of ``channels``, those of ``Seen``: periods of ``tick`` [s] between readings, std, bias."""
        of = {channel: getattr(self, name) for name, group in CHANNELS.items() for channel in group}
        rows = [[max(1.0, round(r.period / tick)), r.std, r.bias] for r in (of[name] for name in channels)]
        return np.array(rows)

    @property
    def exact(self) -> bool:
        """True when nothing is late or noisy."""
        return all(getattr(self, field.name) == Reading() for field in fields(self))


EXACT = Sensors()

TYPICAL = Sensors(
    position=Reading(1.0, 0.5, 0.0),
    depth=Reading(0.1, 0.005, 0.02),
    depth_rate=Reading(0.2, 0.01, 0.0),
    compass=Reading(0.1, np.radians(0.3), np.radians(1.0)),
    tilt=Reading(0.1, np.radians(0.1), np.radians(0.2)),
    gyro=Reading(0.0, np.radians(0.05), 0.0),
    log=Reading(0.2, 0.01, 0.005),
)
"""Assumed: the order of size of what small AUVs carry (compass with tilt sensor, MEMS gyro, depth cell, Doppler log);
no single product."""
