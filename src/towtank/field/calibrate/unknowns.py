"""The coefficients that a record may move: independent values, their prior, the engine's parameters they stand in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.derive.covariance import root_of
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.experiments.belief import Tied, believe
from towtank.frames import Array


@dataclass(frozen=True)
class Unknowns:
    """Coefficients as centre + root @ z, z of unit variance and independent.

    prior : the set.   terms, slopes : its independent values, as ties and symmetry leave them.
    chosen (c,) : places among ``terms.values`` of those that may move.   names : parameters that move, twins included.
    root (c + p, k) : of the chosen, then of the slopes at the origin, which no record sees: they move with the terms as
        far as the prior says how.   fixed : names asked for whose prior is exact.
    """

    prior: Derivatives
    terms: Tied
    slopes: Tied
    chosen: NDArray[np.intp]
    names: tuple[str, ...]
    root: Array
    fixed: tuple[str, ...]

    @property
    def size(self) -> int:
        """Length of z."""
        return int(self.root.shape[1])

    @property
    def columns(self) -> Array:
        """Change (n, k) of the parameters ``names`` per unit of z."""
        at = [self.terms.names.index(name) for name in self.names]
        place = {int(number): i for i, number in enumerate(self.chosen)}
        rows = [self.terms.sign[i] * self.root[place[int(self.terms.index[i])]] for i in at]
        return np.array(rows).reshape(len(self.names), self.size)

    def independent(self, z: Array) -> Array:
        """Independent values of all terms at z (k,)."""
        values = self.terms.values.copy()
        values[self.chosen] += self.root[: len(self.chosen)] @ z
        return values

    def values(self, z: Array) -> dict[str, float]:
        """The parameters ``names`` at z (k,)."""
        full = dict(zip(self.terms.names, self.terms.expand(self.independent(z)).tolist(), strict=True))
        return {name: full[name] for name in self.names}


def unknowns(prior: Derivatives, terms: Sequence[str] | None = None) -> Unknowns:
    """The unknowns of ``prior``: ``terms`` and their twins by symmetry, or all that its covariance leaves open.

    The terms that are not chosen stay, and count as known.

    Raises
    ------
    InputError
        A term that the set does not hold, or a set without any uncertainty.
    """
    held = believe(prior)
    tied = held.terms
    std = np.sqrt(np.maximum(np.diag(prior.covariance), 0.0))
    free = {name for name, one, value in zip(prior.names, std, prior.values, strict=True) if one > 1e-12 * abs(value)}
    if missing := [name for name in terms or () if name not in prior.names]:
        raise InputError(
            f"calibrate: the set of {prior.craft} holds no {', '.join(missing)}. It holds {', '.join(prior.names)}."
        )
    if terms is None and not free:
        raise InputError(
            f"calibrate: the set of {prior.craft} ({prior.level}) states no uncertainty, so a record cannot be weighed "
            "against it. Give it one (towtank derive from runs), or name no terms to estimate the motion alone."
        )
    wanted = [name for name in (prior.names if terms is None else terms) if name in free]
    chosen = np.array(sorted({int(tied.index[tied.names.index(name)]) for name in wanted}), dtype=np.intp)
    names = tuple(name for name, i in zip(tied.names, tied.index, strict=True) if i in chosen)
    k, p = len(tied.values), len(held.slopes.values)
    rows = [*chosen.tolist(), *range(k, k + p)] if len(chosen) else []
    total = (held.root @ held.root.T)[np.ix_(rows, rows)]
    root = root_of(total, np.concatenate([tied.values, held.slopes.values])[rows]) if rows else np.zeros((0, 0))
    fixed = tuple(name for name in (terms or ()) if name not in free)
    return Unknowns(prior, tied, held.slopes, chosen, names, root, fixed)


def with_errors(prior: Derivatives, shares: Mapping[str, float]) -> Derivatives:
    """``prior`` with the stated error of some terms widened: name -> standard deviation as a share of the value.

    What is added is independent from term to term, but for twins by symmetry, which are one value.
    """
    from dataclasses import replace

    tied = believe(prior).terms
    extra = np.zeros(len(tied.values))
    for name, share in shares.items():
        if name not in tied.names:
            raise InputError(f"calibrate: the set of {prior.craft} holds no {name}.")
        number = int(tied.index[tied.names.index(name)])
        extra[number] = max(extra[number], (share * tied.values[number]) ** 2)
    return replace(prior, covariance_fit=prior.covariance_fit + tied.spread(np.diag(extra)))
