"""The square root of a covariance, from which craft are drawn."""

from __future__ import annotations

import numpy as np

from towtank.frames import Array

NULL = 1e-12
"""Share of the largest eigenvalue of the correlation below which a direction is one that ties or symmetry leave out."""

ROUND_OFF = 1e-12
"""Share of a value below which its standard uncertainty is round-off, whose correlations mean nothing."""


def root_of(covariance: Array, values: Array) -> Array:
    """A matrix R (n, n) with R @ R.T equal to ``covariance`` (n, n) of ``values`` (n,).

    It is D S: D the standard deviations, S the symmetric root of the correlation. S does not depend on which
    eigenvectors are chosen where several share an eigenvalue, as in the two planes of a 4-fold craft; and directions
    without variance stay without: the root of a round-off of 1e-16 would be 1e-8. So two machines draw alike.
    """
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    size = np.where(size > ROUND_OFF * np.abs(values), size, 0.0)
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    spectrum, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T) * np.outer(inverse, inverse))
    kept = np.where(spectrum > NULL * max(float(spectrum[-1]), 0.0), spectrum, 0.0) if len(spectrum) else spectrum
    return np.asarray(size[:, None] * ((vectors * np.sqrt(kept)) @ vectors.T))
