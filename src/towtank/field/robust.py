"""Least squares that outliers do not pull, with errors that hold when neighbours err alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.frames import Array

TUNING = 1.345
"""Residual, in standard deviations, up to which the loss is quadratic: 95 % efficient on normal errors."""
ROUNDS = 30
_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
_EXACT = 1e-12
"""Residuals below this share of the values are round-off."""


@dataclass(frozen=True)
class Fit:
    """unknowns (k,), their covariance (k, k), weights (n,) from 0 to 1."""

    unknowns: Array
    covariance: Array
    weights: Array


def fitted(design: Array, values: Array, groups: NDArray[np.int64] | None = None) -> Fit:
    """``values`` (n,) by ``design`` (n, k), reweighted until outliers do not pull.

    groups (n,) : samples of one number err alike; the covariance is then the larger, unknown by unknown, of that of
    independent samples and that of groups left out one at a time.

    Source     huber1964; bellmccaffrey2002 for the jackknife of groups, which a few groups and their leverage do not
               make too small.
    Valid      Fewer than half of the samples are wrong; more groups than unknowns, else all samples are independent.
    """
    weights = np.ones(len(values))
    scale = np.maximum(np.abs(design).max(axis=0), 1e-300)
    A = design / scale
    x = np.zeros(A.shape[1])
    for _ in range(ROUNDS):
        root = np.sqrt(weights)
        x = np.linalg.lstsq(A * root[:, None], values * root, rcond=None)[0]
        off = np.abs(values - A @ x)
        size = max(float(np.median(off)) / _NORMAL, _EXACT * float(np.abs(values).max(initial=0.0)), 1e-300)
        former, weights = weights, np.minimum(1.0, TUNING * size / np.maximum(off, 1e-300))
        if np.abs(weights - former).max() < 1e-6:
            break
    off = values - A @ x
    normal = A.T @ (A * weights[:, None])
    n, k = A.shape
    covariance = float((weights * off**2).sum() / max(n - k, 1)) * np.linalg.pinv(normal)
    if groups is not None and len(np.unique(groups)) > k:
        covariance = _larger(covariance, _left_out(A, weights, off, normal, groups))
    return Fit(x / scale, covariance / np.outer(scale, scale), weights)


def _left_out(A: Array, weights: Array, off: Array, normal: Array, groups: NDArray[np.int64]) -> Array:
    """Covariance (k, k) from the fits without one group each."""
    labels = np.unique(groups)
    moves = []
    for label in labels:
        own = groups == label
        part = A[own] * weights[own, None]
        moves.append(np.linalg.pinv(normal - part.T @ A[own]) @ (part.T @ off[own]))
    each = np.array(moves)
    return np.asarray((len(labels) - 1) / len(labels) * each.T @ each)


def _larger(a: Array, b: Array) -> Array:
    """``a`` or ``b``, grown so that no variance is below that of the other."""
    ratio = np.sqrt(np.maximum(np.diag(a) / np.maximum(np.diag(b), 1e-300), 1.0))
    return np.asarray(b * np.outer(ratio, ratio))


@dataclass(frozen=True)
class Local:
    """A channel at one moment: value, slope [1/s] and their standard errors."""

    value: float
    slope: float
    std: float
    slope_std: float


def parabola(time: Array, values: Array) -> Local:
    """Value and slope at time 0 of a parabola through ``values`` (n,) at ``time`` (n,) [s], n of 4 or more.

    Source     huber1964, by ``fitted``; the errors are those of ordinary least squares on the weighted residuals.
    """
    A = np.stack([np.ones_like(time), time, time**2], axis=1)
    fit = fitted(A, values)
    off = values - A @ fit.unknowns
    spread = float((fit.weights * off**2).sum() / max(fit.weights.sum() - 3.0, 1.0))
    inverse = np.linalg.pinv(A.T @ (A * fit.weights[:, None]))
    errors = np.sqrt(np.maximum(spread * np.diag(inverse), 0.0))
    return Local(float(fit.unknowns[0]), float(fit.unknowns[1]), float(errors[0]), float(errors[1]))
