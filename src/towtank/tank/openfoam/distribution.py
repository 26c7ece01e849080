"""How y+ is spread over the walls of a run, and the Courant number over its cells: shares in fixed bins.

A mean hides a wall that is half too fine and half too coarse. The shares travel with the run; ``measure`` makes them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.errors import TankError
from towtank.frames import Array
from towtank.tank.run import Run

Y_PLUS = (1.0, 5.0, 11.0, 30.0, 100.0, 300.0)
"""Edges of the bins of y+: a resolved wall, the end of the sublayer, the crossing of sublayer and log law, where
the log law begins, its middle, the end of the range of wall functions."""

COURANT = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""Edges of the bins of the Courant number; the last is the limit of the verdict on a run."""


@dataclass(frozen=True)
class Distribution:
    """Shares without dimension, each row from below the first edge to above the last; a row sums to one.

    y_plus : wall patch -> share of its area in each bin of ``Y_PLUS``.   area : patch -> area as meshed [m2].
    courant : share of the cells in each bin of ``COURANT``; empty for a steady case, which has no time step.
    missing : why something is not known, a sentence each.
    """

    y_plus: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    area: Mapping[str, float] = field(default_factory=dict)
    courant: tuple[float, ...] = ()
    missing: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """For the provenance of the run: the edges with the shares."""
        return {
            "y_plus_edges": list(Y_PLUS),
            "y_plus": {patch: list(row) for patch, row in self.y_plus.items()},
            "area": dict(self.area),
            "courant_edges": list(COURANT),
            "courant": list(self.courant),
            "missing": list(self.missing),
        }

    def walls(self, patches: Iterable[str] | None = None) -> tuple[float, ...]:
        """Shares of y+ over several patches together, weighted by their areas; over all by default."""
        chosen = [patch for patch in (self.y_plus if patches is None else patches) if patch in self.y_plus]
        area = np.array([self.area[patch] for patch in chosen])
        if not chosen or not area.sum() > 0.0:
            return ()
        return tuple(float(v) for v in area @ np.array([self.y_plus[patch] for patch in chosen]) / area.sum())


def distribution(document: Mapping[str, Any]) -> Distribution | None:
    """Read what ``Distribution.document`` wrote; None where it is not there, not whole, or has other bins."""
    try:
        if tuple(document["y_plus_edges"]) != Y_PLUS or tuple(document["courant_edges"]) != COURANT:
            return None
        return Distribution(
            {str(patch): tuple(map(float, row)) for patch, row in document["y_plus"].items()},
            {str(patch): float(area) for patch, area in document["area"].items()},
            tuple(map(float, document["courant"])),
            tuple(map(str, document["missing"])),
        )
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def distribution_of(run: Run) -> Distribution | None:
    """What a run carries in ``provenance["health"]["distribution"]``; None where it carries none."""
    health = run.provenance.get("health")
    document = health.get("distribution") if isinstance(health, Mapping) else None
    return distribution(document) if document else None


def shares(values: Array, weights: Array, edges: Sequence[float]) -> tuple[float, ...]:
    """Share of the weight of ``values`` below, between and above ``edges``; a value on an edge counts above it.

    Raises
    ------
    TankError
        Values or weights are not finite, or the weights sum to nothing.
    """
    if not (np.isfinite(values).all() and np.isfinite(weights).all() and weights.sum() > 0.0):
        raise TankError("values or weights are not finite numbers")
    rows = np.bincount(np.digitize(values, edges), weights, len(edges) + 1)
    return tuple(float(share) for share in rows / rows.sum())
