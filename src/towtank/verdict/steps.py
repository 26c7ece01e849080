"""The best estimate beside craft with one coefficient moved: what drives a number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from towtank.frames import Array
from towtank.model.equations import Model
from towtank.symbols import FOURFOLD_TIES
from towtank.verdict.many import BODY, Many, Population, sound

SHARE = 0.05
"""Step of a coefficient without a standard uncertainty, as a share of it."""
TIED = 0.999
"""Correlation beyond which two coefficients are one, tied by a symmetry of the craft."""
HALVINGS = 8
"""Times a step is halved that leaves no positive mass matrix; beyond, the coefficient is not stepped."""

Move = Mapping[str, float]
"""Parameter -> its step [SI]: one, or several that are tied."""


@dataclass(frozen=True)
class Steps:
    """The best estimate, then two craft for each of K moves: a step up and a step down of the first parameter.

    craft : 1 + 2 K.   moves (K) : what is moved.
    """

    craft: Many
    moves: tuple[Move, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names (K) of what is moved, such as "Nuv", or "Nuv/Muw" for two that are tied."""
        return tuple("/".join(move) for move in self.moves)

    def share(self, wide: bool = True) -> Array:
        """Steps up (K,) as shares of their coefficients, negative for a negative one; infinite for one that is zero.

        Of the ``wide`` fit, or of the slope at the origin where there is one.
        """
        d, best = self.craft.model.derivatives, _values(self.craft.model)
        std, out = _std(self.craft.model), []
        for move in self.moves:
            name, step = next(iter(move.items()))
            value = best[name]
            if not wide and name in d.origin:
                step *= d.origin_std.get(name, std[name]) / std[name] if std.get(name, 0.0) > 0.0 else 1.0
                value = d.origin[name]
            out.append(step / value if value else np.inf)
        return np.array(out)

    def effect(self, values: Array) -> Array:
        """Change (K,) of a number for one step up, from its ``values`` (1 + 2 K,): half of up less down.

        One side alone counts where the other has no number; NaN where neither has.

        Source     Central difference, so a secant over two steps.
        """
        best, up, down = values[0], values[1::2], values[2::2]
        with np.errstate(invalid="ignore"):  # of two that are infinite
            both, one = 0.5 * (up - down), np.where(np.isfinite(up), up - best, best - down)
        return np.where(np.isfinite(up) & np.isfinite(down), both, one)


def stepped(model: Model, population: Population | None = None) -> Steps:
    """Every coefficient of ``model`` by itself moved up and down by one standard uncertainty, or by ``SHARE``.

    Coefficients that a symmetry ties move together, each by its own step and sign. Mass and CG are stepped where
    ``population`` draws them, by their standard deviation in it. A step that leaves no positive mass matrix is halved
    until it does.

    Departure  Other correlations between coefficients are left out.
    """
    moves = _tied(model)
    for name, column in (population.craft.columns if population else {}).items():
        if name in BODY and np.ptp(column) > 0.0:
            moves.append({name: float(np.std(column[1:]))})
    for _ in range(HALVINGS):
        craft = _side_by_side(model, moves)
        fine = sound(model, craft.columns).reshape(-1)
        bad = [not fine[1 + 2 * i : 3 + 2 * i].all() for i in range(len(moves))]
        if not any(bad):
            return Steps(craft, tuple(moves))
        halves = [{name: 0.5 * step for name, step in move.items()} for move in moves]
        moves = [half if out else move for half, move, out in zip(halves, moves, bad, strict=True)]
    moves = [move for move, out in zip(moves, bad, strict=True) if not out]
    return Steps(_side_by_side(model, moves), tuple(moves))


def _tied(model: Model) -> list[Move]:
    """Steps of the derivatives, those of one tie together."""
    d, std = model.derivatives, _std(model)
    size = {n: float(std[n] if std[n] > 0.0 else SHARE * abs(x)) for n, x in zip(d.names, d.values, strict=True)}
    out: list[Move] = []
    left = [name for name in d.names if size[name] > 0.0]
    while left:
        first = left[0]
        signs = {name: _tie(model, std, first, name) for name in left}
        # The horizontal plane gives the name and the sign.
        tied = sorted((name for name in left if signs[name]), key=lambda name: name in FOURFOLD_TIES)
        out.append({name: signs[tied[0]] * signs[name] * size[name] for name in tied})
        left = [name for name in left if not signs[name]]
    return out


def _tie(model: Model, std: Mapping[str, float], first: str, name: str) -> float:
    """Sign with which ``name`` goes with ``first``; 0 where they are not tied."""
    d = model.derivatives
    if name == first:
        return 1.0
    if std[first] > 0.0 and std[name] > 0.0:
        i, j = d.names.index(first), d.names.index(name)
        together = float(d.covariance[i, j]) / (std[first] * std[name])
        return float(np.sign(together)) if abs(together) > TIED else 0.0
    if std[first] == std[name] == 0.0:
        twin, sign = FOURFOLD_TIES.get(name, FOURFOLD_TIES.get(first, ("", 0.0)))
        same = twin in (first, name) and np.isclose(d[name], sign * d[first], rtol=1e-9, atol=0.0)
        return float(sign) if same else 0.0
    return 0.0


def _values(model: Model) -> dict[str, float]:
    return {**model.derivatives.as_dict(), **{name: float(getattr(model.constants.body, name)) for name in BODY}}


def _std(model: Model) -> dict[str, float]:
    d = model.derivatives
    return dict(zip(d.names, np.sqrt(np.maximum(np.diag(d.covariance), 0.0)).tolist(), strict=True))


def _side_by_side(model: Model, moves: list[Move]) -> Many:
    value, count = _values(model), 1 + 2 * len(moves)
    names = dict.fromkeys([*model.derivatives.names, *(name for move in moves for name in move)])
    columns = {name: np.full(count, value[name]) for name in names}
    for i, move in enumerate(moves):
        for name, step in move.items():
            columns[name][1 + 2 * i : 3 + 2 * i] += np.array([step, -step])
    return Many(model, columns)
