"""From the discretisation uncertainty of the loads to that of the derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from towtank.derive.expand import Expansion
from towtank.derive.identify import Solved
from towtank.derive.regress import solve
from towtank.frames import Array
from towtank.tank.run import Run


def mesh_covariance(runs: Sequence[Run], solved: Solved, expansion: Expansion, mesh: Array | None) -> Array:
    """Covariance (terms, terms) of the derivatives from the discretisation of the loads; zeros for None.

    mesh (R, 6) : standard discretisation uncertainty of each load of each run [N, N m].

    One mesh errs alike in all runs of a kind, so the error of a load is taken as one unknown factor per kind and load:
    its effect on the fit is the fit of that share of the loads alone. The factors of different kinds and loads are
    taken as independent.

    Source     jcgm100, ch. 5 (fully correlated inputs add before they are squared).
    Valid      Discretisation errors in proportion to the load.
    """
    system = solved.system
    terms = len(expansion.names)
    if mesh is None:
        return np.zeros((terms, terms))
    size = np.sqrt(system.power / system.count[:, None])
    share = np.divide(mesh, size, out=np.zeros_like(size), where=size > 0.0)
    kinds = sorted({run.kind for run in runs})
    kind = np.array([kinds.index(run.kind) for run in runs])
    group = kind[system.run] * 6 + system.load
    errors = np.zeros((len(system.rhs), len(kinds) * 6))
    errors[np.arange(len(errors)), group] = share[system.run, system.load] * system.rhs[:, 0]
    moved = expansion.matrix @ solve(replace(system, rhs=errors), solved.weight).unknowns
    return np.asarray(moved @ moved.T)
