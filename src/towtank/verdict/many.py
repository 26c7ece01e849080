"""Craft side by side that differ from one model in derivatives, mass or CG, such as those that are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.derive.covariance import root_of
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.rigid_body import Body, mass_matrix
from towtank.model.values import shares, to_variant
from towtank.symbols import LOADS, RATES

SAMPLES = 2000
SEED = 20
BODY = ("m", "xG", "yG", "zG")
"""Parameters of the rigid body that may differ."""


@dataclass(frozen=True, eq=False)
class Many:
    """n craft. columns : parameter, as the engine names it -> (n,); what is not there is that of ``model``."""

    model: Model
    columns: Mapping[str, Array]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def slopes(self) -> str:
        """The slopes that stability rests on: "origin" where the derivatives hold them, else "wide"."""
        return "origin" if self.model.derivatives.origin else "wide"

    @cached_property
    def v(self) -> dict[str, Array]:
        """Derivatives (n,) in the lumped variant, linear terms on ``slopes``."""
        return lumped(self.model, self.columns, self.slopes)

    @cached_property
    def body(self) -> Body:
        """The rigid body; entries that differ are (n,). A craft that was ballasted to neutral stays so."""
        made = body_of(self.model, self.columns)
        return replace(made, b=made.m) if neutral(self.model) else made


@dataclass(frozen=True)
class TrialValues:
    """One trial of n craft: kind, loop, and index -> (values (n,), unit); NaN where a craft has no such number."""

    kind: str
    loop: str
    indices: Mapping[str, tuple[Array, str]]


@dataclass(frozen=True)
class Population:
    """The best estimate, then N craft drawn from the uncertainty: what differs, and what their trials gave.

    trials : trial -> its numbers, (1 + N,); empty where none was flown.   words : what was drawn.
    """

    craft: Many
    trials: Mapping[str, TrialValues] = field(default_factory=dict)
    words: str = "derivatives"

    @property
    def count(self) -> int:
        """Number of drawn craft, N."""
        return len(self.craft) - 1


def drawn(model: Model, count: int = SAMPLES, seed: int = SEED) -> Population:
    """``count`` craft drawn from the uncertainty of the derivatives alone; they have flown nothing.

    Source     Normal distributions; the covariance is that of the derivatives (fit, mesh and model form together).
    """
    d = model.derivatives
    spread = np.random.default_rng(seed).standard_normal((count, len(d.names))) @ root_of(d.covariance, d.values).T
    table = d.values + np.vstack([np.zeros(len(d.names)), spread])
    return Population(Many(model, {name: table[:, i] for i, name in enumerate(d.names)}))


def lumped(model: Model, columns: Mapping[str, Array], slopes: str = "origin") -> dict[str, Array]:
    """Derivatives (term -> (n,)) of many craft in the lumped variant; "origin": linear terms at the origin, if any.

    Each craft's slope at the origin is moved by as many standard uncertainties as its wide fit was; where there is no
    uncertainty, by as much.
    """
    d = model.derivatives
    total = to_variant(d, "lumped")
    count = len(next(iter(columns.values())))
    moves = {name: columns[name] - d[name] for name in d.names if name in columns}
    # Both variants differ by sums of added masses: a linear map, so deviations go through it as they are.
    moved = {name: _deviation(name, moves, d.variant, count) for name in total.names}
    out = {name: total[name] + moved[name] for name in total.names}
    std = dict(zip(total.names, np.sqrt(np.maximum(np.diag(total.covariance), 0.0)), strict=True))
    for name, value in (total.origin if slopes == "origin" else {}).items():
        size = float(std.get(name, 0.0))
        scale = total.origin_std.get(name, size) / size if size > 0.0 else 1.0
        out[name] = value + scale * moved.get(name, np.zeros(count))
    return out


def _deviation(name: str, moves: Mapping[str, Array], variant: str, count: int) -> Array:
    own = moves.get(name, np.zeros(count))
    if variant == "lumped":
        return own
    return np.asarray(sum((factor * moves[mass] for mass, factor in shares(name) if mass in moves), own))


def neutral(model: Model) -> bool:
    """True for a craft whose displaced mass is its mass: it was ballasted, and those beside it are too."""
    return bool(model.constants.body.b == model.constants.body.m)


def body_of(model: Model, columns: Mapping[str, Array]) -> Body:
    """The rigid body with the mass and CG of ``columns``: entries (n,) among floats."""
    differing: dict[str, Any] = {name: columns[name] for name in BODY if name in columns}
    return replace(model.constants.body, **differing)


def masses(model: Model, columns: Mapping[str, Array]) -> Array:
    """M_RB - M_A (n, 6, 6) [kg, kg m, kg m2] of many craft."""
    return total_mass(
        body_of(model, columns), {**model.derivatives.as_dict(), **columns}, len(next(iter(columns.values())))
    )


def total_mass(body: Body, v: Mapping[str, Any], count: int) -> Array:
    """M_RB - M_A (n, 6, 6) of ``body`` and the derivatives ``v``; entries are floats or (n,).

    Source     fossen2021, ch. 6.
    """
    M = np.array([[np.broadcast_to(a, (count,)) for a in row] for row in mass_matrix(body)], dtype=float)
    for i, load in enumerate(LOADS):
        for j, rate in enumerate(RATES):
            M[i, j] -= v.get(f"{load}{rate}dot", 0.0)
    return np.moveaxis(M, -1, 0)


def sound(model: Model, columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """True (n,) where the mass matrix M_RB - M_A is positive definite."""
    M = masses(model, columns)
    return np.asarray(np.linalg.eigvalsh(0.5 * (M + M.transpose(0, 2, 1)))[:, 0] > 0.0)


def same_craft(model: Model, population: Population) -> None:
    """Refuse a population that was drawn from another craft.

    Raises
    ------
    InputError
        The best estimate of ``population`` is not ``model``.
    """
    d, columns = model.derivatives, population.craft.columns
    known = {name: float(columns[name][0]) for name in d.names if name in columns}
    if any(not np.isclose(value, d[name], rtol=1e-9, atol=0.0) for name, value in known.items()):
        raise InputError(
            f"assess {model.craft.name}: the drawn craft are not those of this model, their best estimate is another "
            "one. Draw them from the same derivatives: monte_carlo(model), or `towtank mc` again."
        )
