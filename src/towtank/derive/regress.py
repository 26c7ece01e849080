"""Weighted linear regression, with a covariance from independent blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from towtank.derive.system import System
from towtank.frames import Array

LEVERAGE = 0.99
"""A direction that owes more than this share of its information to one block has no residual to judge it by."""


@dataclass(frozen=True)
class Fit:
    """unknowns (n, 1 + members), the nominal first; condition number of the column-scaled weighted matrix;
    root (n, n) : upper triangle R of its QR; scale (n,) : the column norms; weighted (rows, n), error (rows,).
    """

    unknowns: Array
    condition: float
    root: Array
    scale: Array
    weighted: Array
    error: Array


def solve(system: System, weight: Array) -> Fit:
    """theta = (A^T W A)^-1 A^T W b by QR of the column-scaled matrix, for all right-hand sides at once.

    weight : (R, 6), of each load of each run.

    Source     perron, section 2.3; THEORY section 4. It reduces to the Fourier formulae for single harmonics.
    """
    root_weight = np.sqrt(weight[system.run, system.load])[:, None]
    weighted = system.matrix * root_weight
    norm = np.linalg.norm(weighted, axis=0)
    scale = np.where(norm > 0.0, norm, 1.0)
    scaled = weighted / scale
    right = system.rhs * root_weight
    q, r = np.linalg.qr(scaled)
    singular = np.linalg.svd(r, compute_uv=False)
    solution = solve_triangular(r, q.T @ right)
    error = right[:, 0] - scaled @ solution[:, 0]
    condition = float(singular[0] / singular[-1]) if len(singular) else 1.0
    return Fit(solution / scale[:, None], condition, r, scale, scaled, error)


def block_covariance(fit: Fit, block: NDArray[np.intp], misfit: float) -> tuple[Array, int]:
    """Covariance (n, n) of the nominal unknowns and the number of blocks.

    Parameters
    ----------
    block : (rows,) number of the independent unit (run, or run and period) of each row.
    misfit : weighted mean square residual of the whole fit, used where a single block decides a direction.

    The block jackknife: the sum over blocks of the squared change of the result when that block is left out, times
    (G - 1) / G. Samples within a block may be correlated in any way. A direction that rests on one block alone has no
    such change; it gets the mean square residual of the whole fit, with the block counted as one observation.

    Source     bellmccaffrey2002 (their CR3 form); cameronmiller2015, section VI.
    Valid      Blocks independent of each other. Errs on the large side with few blocks.
    """
    numbers, where = np.unique(block, return_inverse=True)
    n, groups = len(fit.scale), len(numbers)
    white = solve_triangular(fit.root, fit.weighted.T, trans="T").T
    score = np.zeros((groups, n))
    np.add.at(score, where, white * fit.error[:, None])
    order = np.argsort(where, kind="stable")
    edges = np.searchsorted(where[order], np.arange(groups + 1))
    total = np.zeros((n, n))
    factor = max(groups - 1, 1) / groups
    for g in range(groups):
        own = white[order[edges[g] : edges[g + 1]]]
        share, axes = np.linalg.eigh(own.T @ own)
        alone = share > LEVERAGE
        change = axes @ (np.where(alone, 0.0, 1.0 / (1.0 - np.where(alone, 0.0, share))) * (axes.T @ score[g]))
        total += factor * np.outer(change, change)
        total += misfit * (axes[:, alone] * share[alone]) @ axes[:, alone].T
    back = solve_triangular(fit.root, np.eye(n)) / fit.scale[:, None]
    return back @ total @ back.T, groups
