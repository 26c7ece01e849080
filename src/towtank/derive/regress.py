"""Weighted linear regression, with a covariance from independent blocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import ndtri, stdtrit

from towtank.derive.system import System
from towtank.frames import Array

LEVERAGE = 0.99
"""A direction that owes more than this share of its information to one block has no residual to judge it by."""


@dataclass(frozen=True)
class Fit:
    """A solved system.

    unknowns (n, 1 + members), the nominal first.   condition : number of the column-scaled weighted matrix.
    root (n, n) : upper triangle R of its QR; scale (n,) : the column norms; weighted (rows, n), error (rows,).
    """

    unknowns: Array
    condition: float
    root: Array
    scale: Array
    weighted: Array
    error: Array


Covariance = Callable[[Fit, NDArray[np.intp], float], Array]
"""An estimator of the covariance of a fit: its rows, the block of each row, the mean square misfit."""


def solve(system: System, weight: Array) -> Fit:
    """Solve theta = (A^T W A)^-1 A^T W b by QR of the column-scaled matrix, for all right-hand sides at once.

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


def block_jackknife(fit: Fit, block: NDArray[np.intp], misfit: float) -> Array:
    """Covariance (n, n) of the nominal unknowns from what each block changes when it is left out.

    The sum over blocks of the squared change of the result, times (G - 1) / G. Samples within a block may be
    correlated in any way, and the blocks may differ in size and in scatter. A direction that rests on one block alone
    has no such change; it gets ``misfit``, with the block counted as one observation.

    Parameters
    ----------
    block (rows,) : the independent unit of each row.
    misfit : weighted mean square residual of the whole fit, used where no residual is left to judge by.

    Source     bellmccaffrey2002 (their jackknife form, CR3); cameronmiller2015, section VI.
    Valid      Blocks independent of each other. Few blocks: widened by Student's factor.
    """
    white, back = _whitened(fit)
    total = np.zeros((len(back), len(back)))
    blocks = _rows_of(block)
    factor = max(len(blocks) - 1, 1) / len(blocks)
    for at in blocks:
        own = white[at]
        share, axes = np.linalg.eigh(own.T @ own)
        alone = share > LEVERAGE
        inflate = np.where(alone, 0.0, 1.0 / (1.0 - np.where(alone, 0.0, share)))
        change = axes @ (inflate * (axes.T @ (own.T @ fit.error[at])))
        total += factor * np.outer(change, change)
        total += misfit * (axes[:, alone] * share[alone]) @ axes[:, alone].T
    widen = _student(back @ white.T, block)
    return np.asarray(back @ total @ back.T * np.outer(widen, widen))


def cluster_sandwich(fit: Fit, block: NDArray[np.intp], misfit: float) -> Array:
    """Covariance (n, n) of the nominal unknowns from the score of each block, times G / (G - 1) (N - 1) / (N - n).

    What econometric programs call cluster-robust; with one row in a block it is HC0 times that factor. It knows nothing
    of leverage, so it is too small where a term rests on few blocks. ``misfit`` is not used.

    Source     cameronmiller2015, section II (the estimator and its correction).
    Valid      Many blocks, none with a large share of the information.
    """
    white, back = _whitened(fit)
    scores = np.array([white[at].T @ fit.error[at] for at in _rows_of(block)])
    groups, rows, n = len(scores), *white.shape
    factor = groups / max(groups - 1, 1) * (rows - 1) / max(rows - n, 1)
    return np.asarray(factor * back @ (scores.T @ scores) @ back.T)


def homoscedastic(fit: Fit, block: NDArray[np.intp], misfit: float) -> Array:
    """Covariance (n, n) of the nominal unknowns of plain weighted least squares: every row alike and independent.

    ``block`` and ``misfit`` are not used: the mean square of the rows themselves, over their degrees of freedom.

    Source     jcgm100, annex H.3 (least squares).
    Valid      Weights are right and rows are independent. For comparison.
    """
    rows, n = fit.weighted.shape
    _, back = _whitened(fit)
    return np.asarray(float(fit.error @ fit.error) / max(rows - n, 1) * back @ back.T)


def _whitened(fit: Fit) -> tuple[Array, Array]:
    """Rows (rows, n) with orthonormal columns, and the matrix (n, n) from whitened unknowns to those of the system."""
    white = solve_triangular(fit.root, fit.weighted.T, trans="T").T
    return white, solve_triangular(fit.root, np.eye(len(fit.scale))) / fit.scale[:, None]


def _rows_of(block: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Numbers of the rows of each block."""
    order = np.argsort(block, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(block[order])) + 1)


def _student(influence: Array, block: NDArray[np.intp]) -> Array:
    """Factor (n,) by which a standard deviation found from few blocks is widened, so that 1.96 of it hold 95 %.

    influence (n, rows) of each row on each unknown. Degrees of freedom: the effective number of blocks less one, at
    least 2.

    Source     jcgm100, annex G (Student factor); cameronmiller2015, section VI (effective number of clusters).
    """
    share = np.array([(influence[:, at] ** 2).sum(axis=1) for at in _rows_of(block)])
    share /= np.maximum(share.sum(axis=0), 1e-300)
    freedom = np.maximum(1.0 / np.maximum((share**2).sum(axis=0), 1e-12) - 1.0, 2.0)
    return np.asarray(stdtrit(freedom, 0.975) / ndtri(0.975))
