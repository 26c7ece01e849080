"""Weighted linear regression, with a covariance from independent blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import stdtrit

from towtank.derive.system import System
from towtank.frames import Array

LEVERAGE = 0.99
"""A direction that owes more than this share of its information to one block has no residual to judge it by."""

POOLED = 0.5
"""Weight of the variance pooled over the steady runs of one kind, against that of the runs one by one."""


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


@dataclass(frozen=True)
class Units:
    """The independent units of the data, row by row. block (rows,) : the unit; load (rows,) : which of the six loads.

    pool (rows,) : number of the kind of a steady run, -1 for an oscillation. A steady run is a single condition, so
    the runs of one kind share half of an error covariance; an oscillation is judged by its own cycles.
    """

    block: NDArray[np.intp]
    load: NDArray[np.intp]
    pool: NDArray[np.intp]


def block_covariance(fit: Fit, units: Units, misfit: float) -> tuple[Array, int]:
    """Covariance (n, n) of the nominal unknowns and the number of independent blocks.

    misfit : weighted mean square residual of the whole fit, used where no residual is left to judge by.

    Oscillations: the block jackknife, the sum over blocks of the squared change of the result when that block is left
    out, times (G - 1) / G. Samples within a block may be correlated in any way. A direction that rests on one block
    alone has no such change; it gets ``misfit``, with the block counted as one observation. Steady runs: the mean of
    the jackknife over runs and of the residual covariance of their kind over its degrees of freedom.

    Source     bellmccaffrey2002 (their jackknife form, CR3); cameronmiller2015, section VI.
    Departure  Steady runs are half pooled by kind: the jackknife alone is erratic where a term rests on a few of them
               (Xvr on four turns), the pool alone is wrong where their errors grow with the load (fins).
    Valid      Blocks independent of each other. Few blocks: widened by Student's factor.
    """
    white = solve_triangular(fit.root, fit.weighted.T, trans="T").T
    total = _jackknife(white, fit.error, units.block, units.pool < 0, misfit)
    total += (1.0 - POOLED) * _jackknife(white, fit.error, units.block, units.pool >= 0, misfit)
    for pool in np.unique(units.pool[units.pool >= 0]):
        at = units.pool == pool
        total += POOLED * _pooled(white[at], fit.error[at], units.block[at], units.load[at], misfit)
    back = solve_triangular(fit.root, np.eye(len(fit.scale))) / fit.scale[:, None]
    widen = _student(back @ white.T, units.block)
    return back @ total @ back.T * np.outer(widen, widen), len(np.unique(units.block))


def _student(influence: Array, block: NDArray[np.intp]) -> Array:
    """Factor (n,) by which a standard deviation found from few blocks is widened, so that 1.96 of it hold 95 %.

    influence (n, rows) of each row on each unknown. Degrees of freedom: the effective number of blocks less one, at
    least 2.

    Source     jcgm100, annex G (Student factor); cameronmiller2015, section VI (effective number of clusters).
    """
    _, where = np.unique(block, return_inverse=True)
    share = np.zeros((where.max() + 1, len(influence)))
    np.add.at(share, where, influence.T**2)
    share /= np.maximum(share.sum(axis=0), 1e-300)
    freedom = np.maximum(1.0 / np.maximum((share**2).sum(axis=0), 1e-12) - 1.0, 2.0)
    return np.asarray(stdtrit(freedom, 0.975) / 1.959964)


def _jackknife(white: Array, error: Array, block: NDArray[np.intp], rows: NDArray[np.bool_], misfit: float) -> Array:
    """Covariance (n, n) of the whitened unknowns from the blocks of the oscillations."""
    n = white.shape[1]
    total = np.zeros((n, n))
    numbers = np.unique(block[rows])
    factor = max(len(numbers) - 1, 1) / max(len(numbers), 1)
    order = np.flatnonzero(rows)[np.argsort(block[rows], kind="stable")]
    edges = np.searchsorted(block[order], numbers)
    for at in np.split(order, edges[1:]) if len(numbers) else []:
        own = white[at]
        share, axes = np.linalg.eigh(own.T @ own)
        alone = share > LEVERAGE
        inflate = np.where(alone, 0.0, 1.0 / (1.0 - np.where(alone, 0.0, share)))
        change = axes @ (inflate * (axes.T @ (own.T @ error[at])))
        total += factor * np.outer(change, change)
        total += misfit * (axes[:, alone] * share[alone]) @ axes[:, alone].T
    return total


def _pooled(white: Array, error: Array, block: NDArray[np.intp], load: NDArray[np.intp], misfit: float) -> Array:
    """Covariance (n, n) of the whitened unknowns from the steady runs of one kind, six loads each."""
    numbers, run = np.unique(block, return_inverse=True)
    rows = np.zeros((len(numbers), 6, white.shape[1]))
    errors = np.zeros((len(numbers), 6))
    rows[run, load], errors[run, load] = white, error
    freedom = np.bincount(load, minlength=6) - np.bincount(load, weights=(white**2).sum(axis=1), minlength=6)
    judged = freedom > 0.5
    root = np.where(judged, 1.0 / np.sqrt(np.where(judged, freedom, 1.0)), 0.0)
    common = (errors.T @ errors) * np.outer(root, root)
    common[np.diag_indices(6)] += np.where(judged, 0.0, misfit)
    return np.asarray(np.einsum("bkn,kl,blm->nm", rows, common, rows, optimize=True))
