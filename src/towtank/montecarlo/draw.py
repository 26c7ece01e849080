"""Craft drawn from the uncertainty of one: derivatives, mass, CG and current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array, rotation
from towtank.model.equations import Model
from towtank.quantity import Quantity, si

CG = ("xG", "yG", "zG")
CURRENT = ("current_north", "current_east")


@dataclass(frozen=True)
class Tolerances:
    """Standard uncertainties beside those of the derivatives; all normal, zero by default.

    mass : share of the mass [-].   cg (3,) : of the centre of gravity [m].   current : of the current's northerly and
    easterly component [m/s], steady within a trial and unknown to the pilot's orders.
    """

    mass: float = 0.0
    cg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    current: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("mass", self.mass), ("cg", min(self.cg)), ("current", self.current)):
            if not (value >= 0.0 and np.isfinite(value)):
                raise InputError(f"tolerance of {name}: {value:g}. A standard uncertainty is zero or more, and finite.")
        if self.mass > 0.2:
            raise InputError(
                f"tolerance of mass: {100.0 * self.mass:g} % is beyond 20 %, where a craft neither floats nor dives. It "
                'is a share of the mass; write "1 %" or 0.01.'
            )


def tolerances(mass: Quantity = 0.0, cg: Quantity = 0.0, current: Quantity = 0.0) -> Tolerances:
    """Tolerances from text such as ``"1 %"``, ``"5 mm"`` (the same in x, y and z) and ``"0.05 m/s"``."""
    share = si(mass, "", "mass tolerance")
    each = si(cg, "m", "cg tolerance")
    return Tolerances(share, (each, each, each), si(current, "m/s", "current tolerance"))


@dataclass(frozen=True)
class Drawn:
    """N craft: parameter name -> (N,), as the engine names them. The first of the first piece is the best estimate."""

    columns: Mapping[str, Array]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))


def draw(model: Model, count: int, given: Tolerances, seed: int, piece: int = 0) -> Drawn:
    """``count`` craft of piece ``piece``; the same numbers whoever draws them, wherever and in whatever order.

    Source     Normal distributions; the covariance is that of the derivatives (fit, mesh and model form together).
    Departure  A draw whose added mass leaves no positive mass is drawn again, with the share of such draws limited.

    Raises
    ------
    InputError
        No samples asked for.
    """
    if count < 1:
        raise InputError(f"Monte Carlo: {count} samples. Ask for one or more.")
    random = np.random.default_rng([seed, piece])
    d, body = model.derivatives, model.constants.body
    spread = random.multivariate_normal(
        np.zeros(len(d.names)), d.covariance, count, check_valid="ignore", method="eigh"
    )
    columns = {name: d.values[i] + spread[:, i] for i, name in enumerate(d.names)}
    # Each draw takes the same number of random values, so that a tolerance of zero changes no other draw.
    weight, place, water = random.normal(size=count), random.normal(size=(3, count)), random.normal(size=(2, count))
    columns["m"] = body.m * (1.0 + given.mass * weight)
    for i, name in enumerate(CG):
        columns[name] = getattr(body, name) + given.cg[i] * place[i]
    for i, name in enumerate(CURRENT):
        columns[name] = given.current * water[i]
    if piece == 0:
        best = {**d.as_dict(), "m": body.m, **{name: getattr(body, name) for name in CG}}
        for name, values in columns.items():
            values[0] = best.get(name, 0.0)
    return Drawn(columns)


def starts(start: Array, columns: Mapping[str, Array]) -> Array:
    """Start (N, 13 + n + 3) of craft at rest in their moving water: the ground speed holds the current.

    start (13 + n + 3,) as in ``towtank.engine.start.at``.
    """
    from towtank.model.kinematics import attitude_of

    water = np.zeros((len(next(iter(columns.values()))), 3))
    for i, name in enumerate(CURRENT):
        water[:, i] = columns.get(name, 0.0)
    J1 = np.asarray(rotation(np.array(attitude_of(start[3:7].tolist()))))
    out = np.tile(start, (len(water), 1))
    out[:, 7:10] += water @ J1
    return out
