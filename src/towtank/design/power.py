"""From thrust to electrical power: the efficiency of propeller and drive, and where it comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.model.algebra import MATH, interpolate
from towtank.model.equations import Model
from towtank.model.thrust import shaft_speed

OVERALL = 0.5
"""Thrust power over electrical power of a craft without a propeller table (assumed: propeller 0.65, drive 0.77)."""
DRIVE = 0.77
"""Shaft power over electrical power of motor, gear and electronics (assumed)."""


@dataclass(frozen=True)
class Drive:
    """Efficiency of the way from electrical power to thrust.

    overall : thrust power over electrical power.   shaft : shaft power over it, where the propeller is known, else 0.
    origin : where the numbers come from.   assumed : whether one of them is an assumption.
    """

    overall: float
    shaft: float
    origin: str
    assumed: bool


def drive_of(model: Model, efficiency: float | None = None) -> Drive:
    """The drive of the craft of ``model``; ``efficiency`` [-], overall, goes before what is known or assumed.

    Source     Open-water efficiency J KT / (2 pi KQ) times (1 - t) / (1 - w), fossen2021; the drive is assumed.

    Raises
    ------
    InputError
        The efficiency is not between 0 and 1.
    """
    screw = model.constants.screw
    if efficiency is not None:
        if not 0.0 < efficiency <= 1.0:
            raise InputError(
                f"efficiency {efficiency:g}: thrust power over electrical power lies between 0 and 1. Give 0.5."
            )
        return Drive(efficiency, 0.0, "given", False)
    if screw is None or screw.balance is None:
        return Drive(OVERALL, 0.0, f"assumed: {OVERALL:g} overall, no propeller table in the craft file", True)
    J = screw.balance
    kt, kq = (float(interpolate(J, table, MATH)) for table in (screw.kt, screw.kq))
    open_water = J * kt / (2.0 * np.pi * kq)
    behind = open_water * (1.0 - float(screw.deduction)) / (1.0 - float(screw.wake))
    return Drive(
        DRIVE * behind, DRIVE, f"propeller {behind:.2f} from its table; motor and electronics {DRIVE:g} assumed", True
    )


def electrical_power(model: Model, drive: Drive, thrust: float, command: float, u: float) -> float:
    """Electrical power [W] for propulsion at the speed ``u`` [m/s].

    thrust : force on the craft [N].   command : as in ``Model.rates``: it fixes the shaft speed of a known propeller.

    Source     P = T u / eta; with a table P = 2 pi n Q / eta_drive (fossen2021).
    """
    screw = model.constants.screw
    if screw is None or drive.shaft <= 0.0:
        return thrust * u / drive.overall
    n = shaft_speed(screw, command)
    if n <= 0.0:
        return 0.0
    J = (1.0 - float(screw.wake)) * u / (n * float(screw.diameter))
    torque = float(screw.density) * n * n * float(screw.diameter) ** 5 * float(interpolate(J, screw.kq, MATH))
    return 2.0 * float(np.pi) * n * torque / drive.shaft
