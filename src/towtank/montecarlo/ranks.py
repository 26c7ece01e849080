"""What drives a number over the drawn craft."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from towtank.frames import Array

LEAST_RANK = 0.1
"""Rank correlation below which a derivative is not named, however many craft were drawn."""
SIGNIFICANT = 3.0
"""A rank correlation is named beyond this many of its own standard errors 1/sqrt(N)."""
RANKED = 5000
"""Craft the rank correlations rest on, and that are kept with their indices; more change a correlation by less than
0.015 and a probability by less than 0.7 %."""
TIED = 0.999
"""Rank correlation beyond which two parameters are one."""
ROUND_OFF = 1e-9
"""Range of an index below which its order is that of round-off."""
LEADING = 3
"""Derivatives named for each index."""


class Ranks:
    """Rank correlations of numbers with the drawn parameters; ranks of the parameters are taken once."""

    def __init__(self, columns: Mapping[str, Array]) -> None:
        """``columns`` : name -> (N,), without the best estimate.

        Parameters that do not vary are left out. Those tied by symmetry or definition are one, "Muq/Nur"; the sign of
        its correlation is that of the first.
        """
        names = [name for name, values in columns.items() if np.ptp(values[:RANKED]) > 0.0]
        table = np.array([columns[name][:RANKED] for name in names]).reshape(len(names), -1 if names else 0)
        each = _ranked(table) if names else table
        first = [int(np.argmax(np.abs(row) > TIED)) for row in each @ each.T]
        groups = [[name for name, f in zip(names, first, strict=True) if f == i] for i in range(len(names))]
        self.names = tuple("/".join(group) for group in groups if group)
        self._values = table[[i for i, group in enumerate(groups) if group]]
        self._known: dict[bytes, Array] = {}

    def drivers(self, values: Array) -> tuple[tuple[str, float], ...]:
        """The parameters that go most with ``values`` (N,): name and rank correlation, strongest first.

        Source     spearman1904, without a correction for ties.
        Valid      Relations that rise or fall throughout; correlated parameters share what one of them causes.
        """
        kept = values[: self._values.shape[1]]
        there = np.isfinite(kept)
        count = int(np.count_nonzero(there))
        if count < 10 or not self.names or float(np.ptp(kept[there])) <= ROUND_OFF:
            return ()
        mark = there.tobytes()
        if mark not in self._known:
            self._known[mark] = _ranked(self._values[:, there])
        with_each = self._known[mark] @ _ranked(kept[None, there])[0]
        least = max(LEAST_RANK, SIGNIFICANT / math.sqrt(count))
        order = np.argsort(-np.abs(with_each), kind="stable")[:LEADING]
        return tuple((self.names[i], float(with_each[i])) for i in order if abs(with_each[i]) >= least)


def _ranked(rows: Array) -> Array:
    """Ranks along each row, their mean taken off, of unit length."""
    ranks = np.argsort(np.argsort(rows, axis=1, kind="stable"), axis=1, kind="stable").astype(float)
    ranks -= ranks.mean(axis=1, keepdims=True)
    return np.asarray(ranks / np.linalg.norm(ranks, axis=1, keepdims=True))
