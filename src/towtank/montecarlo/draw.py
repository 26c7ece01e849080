"""Craft drawn from the uncertainty of one: derivatives, mass, CG and current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.derive.covariance import root_of
from towtank.errors import InputError
from towtank.frames import Array, rotation
from towtank.model.equations import Model
from towtank.model.kinematics import attitude_of
from towtank.quantity import Quantity, si
from towtank.verdict.many import Many, sound

CG = ("xG", "yG", "zG")
CURRENT = ("current_north", "current_east")
MOST_LOST = 0.2
"""Share of draws without a positive mass matrix beyond which the uncertainty is no longer one of a craft."""
TRIES = 30
"""Times a craft is drawn again; with a fifth of the draws lost, one in 10^21 needs more."""


@dataclass(frozen=True)
class Tolerances:
    """Standard uncertainties beside those of the derivatives; all normal, zero by default.

    mass : share of the mass [-].   cg (3,) : of the centre of gravity [m].   current : of the current's northerly and
    easterly component [m/s], steady within a trial and unknown to the pilot.
    """

    mass: float = 0.0
    cg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    current: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no standard uncertainty.

        Raises
        ------
        InputError
            Negative, not finite, not three numbers for the CG, or a mass beyond 20 %.
        """
        if len(self.cg) != 3:
            raise InputError(f"tolerance of cg: {len(self.cg)} numbers. Give three, for x, y and z [m].")
        for name, value in (("mass", self.mass), *(("cg", each) for each in self.cg), ("current", self.current)):
            if not (value >= 0.0 and np.isfinite(value)):
                raise InputError(f"tolerance of {name}: {value:g}. A standard uncertainty is zero or more, and finite.")
        if self.mass > 0.2:
            raise InputError(
                f"tolerance of mass: {100.0 * self.mass:g} % is beyond 20 %, where a craft neither floats nor dives. "
                'It is a share of the mass; write "1 %" or 0.01.'
            )

    def __str__(self) -> str:
        """In words."""
        cg = max(self.cg)
        words = [f"mass {100.0 * self.mass:g} %"] if self.mass else []
        words += [f"CG {1e3 * cg:g} mm"] if cg else []
        words += [f"current {self.current:g} m/s"] if self.current else []
        return ", ".join(("derivatives", *words))


NONE = Tolerances()


def tolerances(mass: Quantity = 0.0, cg: Quantity = 0.0, current: Quantity = 0.0) -> Tolerances:
    """Tolerances from text such as ``"1 %"``, ``"5 mm"`` (the same in x, y and z) and ``"0.05 m/s"``."""
    share = si(mass, "", "mass tolerance")
    each = si(cg, "m", "cg tolerance")
    return Tolerances(share, (each, each, each), si(current, "m/s", "current tolerance"))


def draw(
    model: Model, count: int, given: Tolerances = NONE, seed: int = 0, piece: int = 0, root: Array | None = None
) -> Many:
    """``count`` craft of piece ``piece``; the same numbers whoever draws them, wherever and in whatever order.

    The first piece holds the best estimate before its ``count`` craft.

    root : ``root_of`` the derivatives' covariance, where it is known already.

    Source     Normal distributions; the covariance is that of the derivatives (fit, mesh and model form together).
    Departure  A draw whose mass matrix is not positive definite is drawn again.

    Raises
    ------
    InputError
        No samples asked for, or more than a fifth of the draws have no positive mass matrix.
    """
    if count < 1:
        raise InputError(f"Monte Carlo: {count} samples. Ask for one or more.")
    factor = root_of(model.derivatives.covariance, model.derivatives.values) if root is None else root
    columns = _once(model, count, given, factor, (seed, piece))
    bad = ~sound(model, columns)
    if bad.mean() > MOST_LOST and count >= 10:
        raise InputError(
            f"Monte Carlo of {model.craft.name}: {100.0 * bad.mean():.0f} % of the drawn craft have no positive mass "
            f"matrix, {100.0 * MOST_LOST:.0f} % is the limit. The uncertainty of the added masses, the mass or the CG "
            "is as large as they are: narrow it."
        )
    for again in range(1, TRIES + 1):
        if not bad.any():
            break
        others = _once(model, count, given, factor, (seed, piece, again))
        columns = {name: np.where(bad, others[name], values) for name, values in columns.items()}
        bad = ~sound(model, columns)
    else:
        raise InputError(
            f"Monte Carlo of {model.craft.name}: no craft with a positive mass matrix was drawn in {TRIES} tries. "
            "Narrow the uncertainty of the added masses, the mass or the CG."
        )
    if piece == 0:
        best = _best(model)
        columns = {name: np.concatenate([[best.get(name, 0.0)], values]) for name, values in columns.items()}
    return Many(model, columns)


def _best(model: Model) -> dict[str, float]:
    body = model.constants.body
    return {**model.derivatives.as_dict(), "m": body.m, **{name: getattr(body, name) for name in CG}}


def _once(model: Model, count: int, given: Tolerances, root: Array, stream: tuple[int, ...]) -> dict[str, Array]:
    """Each draw takes the same random numbers, so that a tolerance of zero changes no other draw."""
    random = np.random.default_rng(stream)
    d, best = model.derivatives, _best(model)
    spread = random.normal(size=(count, len(d.names))) @ root.T
    weight, place, water = random.normal(size=count), random.normal(size=(3, count)), random.normal(size=(2, count))
    columns = {name: d.values[i] + spread[:, i] for i, name in enumerate(d.names)}
    columns["m"] = best["m"] * (1.0 + given.mass * weight)
    columns |= {name: best[name] + given.cg[i] * place[i] for i, name in enumerate(CG)}
    return columns | {name: given.current * water[i] for i, name in enumerate(CURRENT)}


def starts(start: Array, columns: Mapping[str, Array]) -> Array:
    """Start (N, 13 + n + 3) of craft at rest in their moving water: the ground speed holds the current.

    start (13 + n + 3,) as in ``towtank.engine.start.at``.
    """
    water = np.zeros((len(next(iter(columns.values()))), 3))
    for i, name in enumerate(CURRENT):
        water[:, i] = columns.get(name, 0.0)
    J1 = np.asarray(rotation(np.array(attitude_of(start[3:7].tolist()))))
    out = np.tile(start, (len(water), 1))
    out[:, 7:10] += water @ J1
    return out
