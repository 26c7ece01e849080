"""Craft are drawn alike wherever they are drawn."""

import numpy as np
import pytest

from towtank.derive.covariance import root_of

VALUES = np.ones(8)


def tied_covariance(seed: int = 3) -> np.ndarray:
    """Two planes with the same uncertainty, of very different units, one direction without any."""
    random = np.random.default_rng(seed)
    half = random.standard_normal((4, 3))
    plane = half @ half.T
    scale = np.array([1e-3, 1.0, 50.0, 2e4] * 2)
    return np.kron(np.eye(2), plane) * np.outer(scale, scale)


def test_root_gives_the_covariance_back():
    c = tied_covariance()
    root = root_of(c, VALUES)
    size = np.sqrt(np.diag(c))
    assert root @ root.T / np.outer(size, size) == pytest.approx(c / np.outer(size, size), abs=1e-12)


def test_round_off_in_the_covariance_moves_a_draw_by_round_off():
    # The eigenvalues come in pairs, so their eigenvectors are arbitrary; two of them are zero, whose roots would be
    # 1e-8 of a round-off of 1e-16.
    c = tied_covariance()
    z = np.random.default_rng(1).standard_normal(len(c))
    size = np.sqrt(np.diag(c))
    noise = np.random.default_rng(2).standard_normal(c.shape) * 1e-15 * np.outer(size, size)
    there = root_of(c + noise + noise.T, VALUES) @ z / size
    assert there == pytest.approx(root_of(c, VALUES) @ z / size, abs=1e-12)


def test_a_term_without_uncertainty_stays_put():
    c = tied_covariance()
    c[2], c[:, 2] = 0.0, 0.0
    assert np.all(root_of(c, VALUES)[2] == 0.0)


def test_an_uncertainty_that_is_round_off_has_no_correlations():
    # A term that exact data determine: its variance is the square of a round-off, and so is what it shares with others.
    c = tied_covariance()
    size = np.sqrt(np.diag(c))
    exact, shared = 1e-16, np.random.default_rng(4).uniform(-1.0, 1.0, len(c)) * 1e-16
    c[2], c[:, 2] = shared * size, shared * size
    c[2, 2] = exact**2
    root = root_of(c, VALUES)
    assert np.all(root[2] == 0.0)
    assert np.all(root[:, 2] == 0.0)
