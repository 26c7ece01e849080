"""The solve, its covariances and the robust loss against statsmodels, on designs where the definitions coincide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import norm, t

from towtank.derive.regress import block_jackknife, cluster_sandwich, homoscedastic, solve
from towtank.derive.robust import TUNING, huber
from towtank.derive.system import System

# Both solve by orthogonal factorisation; a condition number of 10 leaves 1e-14, and 1e-9 is far from any other formula.
EXACT = 1e-9
UNKNOWNS = ("Yuv", "Yvv", "Yur", "Yrr")


def system(rows_of_run, seed=0, outliers=0):
    """A system whose rows are samples of one load: ``rows_of_run`` for each run, errors that grow from run to run."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(len(rows_of_run)), rows_of_run)
    matrix = rng.standard_normal((len(run), 4)) * np.array([1.0, 30.0, 0.2, 5.0])
    truth = np.array([-3.0, 0.2, 10.0, -1.0])
    error = rng.standard_normal(len(run)) * (0.5 + run / len(run)) + rng.standard_normal(len(rows_of_run))[run]
    error[np.isin(run, rng.permutation(len(rows_of_run))[:outliers])] += 40.0
    rhs = matrix @ truth + error
    runs = len(rows_of_run)
    power = np.zeros((runs, 6))
    np.add.at(power, (run, 1), rhs**2)
    return System(
        UNKNOWNS, matrix, rhs[:, None], run, np.ones(len(run), dtype=np.intp), np.zeros(len(run), dtype=np.intp),
        np.zeros((runs, 6)), power, np.array(rows_of_run, dtype=float), np.full((runs, 6), np.nan),
    )  # fmt: skip


def weights(made, seed=1):
    return np.random.default_rng(seed).uniform(0.2, 3.0, (len(made.count), 6))


def wls(made, weight):
    return sm.WLS(made.rhs[:, 0], made.matrix, weights=weight[made.run, made.load])


def test_values_and_plain_covariance_are_those_of_weighted_least_squares():
    made = system([12] * 9)
    weight = weights(made)
    fit, oracle = solve(made, weight), wls(made, weight).fit()
    np.testing.assert_allclose(fit.unknowns[:, 0], oracle.params, rtol=EXACT)
    np.testing.assert_allclose(homoscedastic(fit, made.run, 1.0), oracle.cov_params(), rtol=EXACT, atol=1e-15)
    assert fit.condition == pytest.approx(np.linalg.cond(fit.weighted), rel=EXACT)


def test_sandwich_with_one_row_in_a_block_is_hc0_and_hc1_but_for_its_correction():
    made = system([1] * 60)
    weight, n, k = weights(made), 60, 4
    found = cluster_sandwich(solve(made, weight), made.run, 1.0)
    oracle = wls(made, weight)
    correction = n / (n - 1) * (n - 1) / (n - k)
    np.testing.assert_allclose(found, correction * oracle.fit(cov_type="HC0").cov_params(), rtol=EXACT, atol=1e-15)
    np.testing.assert_allclose(found, oracle.fit(cov_type="HC1").cov_params(), rtol=EXACT, atol=1e-15)


def test_jackknife_with_one_row_in_a_block_is_hc3_and_bounds_hc2():
    made = system([1] * 60)
    weight, n = weights(made), 60
    fit, oracle = solve(made, weight), wls(made, weight)
    widen = _student_factor(fit, made.run)
    found = block_jackknife(fit, made.run, 1.0) / np.outer(widen, widen) * n / (n - 1)
    np.testing.assert_allclose(found, oracle.fit(cov_type="HC3").cov_params(), rtol=EXACT, atol=1e-15)
    assert (np.diag(found) > np.diag(oracle.fit(cov_type="HC2").cov_params())).all()


def test_sandwich_is_the_cluster_covariance_for_blocks_of_unlike_size():
    made = system([3, 20, 7, 11, 5, 9, 14, 4, 8, 16, 6, 10])
    weight = weights(made)
    found = cluster_sandwich(solve(made, weight), made.run, 1.0)
    oracle = wls(made, weight).fit(cov_type="cluster", cov_kwds={"groups": made.run, "use_correction": True})
    np.testing.assert_allclose(found, oracle.cov_params(), rtol=EXACT, atol=1e-15)


def test_jackknife_is_what_refitting_without_each_block_gives():
    """statsmodels has no jackknife by clusters; its fits to all blocks but one are the definition of it."""
    made = system([3, 20, 7, 11, 5, 9, 14, 4, 8, 16, 6, 10])
    weight, groups = weights(made), 12
    fit = solve(made, weight)
    each = weight[made.run, made.load]
    changes = []
    for g in range(groups):
        stay = made.run != g
        without = sm.WLS(made.rhs[stay, 0], made.matrix[stay], weights=each[stay]).fit().params
        changes.append(without - fit.unknowns[:, 0])
    expected = (groups - 1) / groups * np.einsum("gi,gj->ij", changes, changes)
    widen = _student_factor(fit, made.run)
    np.testing.assert_allclose(
        block_jackknife(fit, made.run, 1.0) / np.outer(widen, widen), expected, rtol=1e-8, atol=1e-15
    )


def test_covariances_agree_where_errors_are_alike_and_blocks_are_many():
    """Independent errors of one size: all estimate the same. 400 blocks give a variance to 7 %; four of those."""
    made = system([2] * 400)
    rng = np.random.default_rng(5)
    made = replace(made, rhs=made.matrix @ np.ones((4, 1)) + rng.standard_normal((800, 1)))
    fit = solve(made, np.ones((400, 6)))
    plain, jack, sandwich = (
        np.diag(estimate(fit, made.run, 1.0)) for estimate in (homoscedastic, block_jackknife, cluster_sandwich)
    )
    np.testing.assert_allclose(jack, plain, rtol=0.28)
    np.testing.assert_allclose(sandwich, plain, rtol=0.28)


def test_robust_loss_is_hubers_m_estimator_with_the_same_scale():
    made = system([1] * 80, outliers=8)
    factor = huber(made, np.ones((80, 6)))
    found = solve(made, factor).unknowns[:, 0]
    oracle = sm.RLM(made.rhs[:, 0], made.matrix, M=sm.robust.norms.HuberT(TUNING)).fit(tol=1e-12, maxiter=200)
    # Both iterate to 1e-8 in the weights.
    np.testing.assert_allclose(found, oracle.params, rtol=1e-6)
    np.testing.assert_allclose(factor[:, 1], oracle.weights, atol=1e-6)
    assert (factor[:, [0, 2, 3, 4, 5]] == 1.0).all()


def test_robust_loss_keeps_the_truth_where_least_squares_is_pulled_away():
    made = system([1] * 80, outliers=8)
    truth = np.array([-3.0, 0.2, 10.0, -1.0])
    ones = np.ones((80, 6))
    size = 1.0 / np.linalg.norm(made.matrix, axis=0)
    plain = np.abs(solve(made, ones).unknowns[:, 0] - truth) / size
    robust = np.abs(solve(made, huber(made, ones)).unknowns[:, 0] - truth) / size
    assert np.linalg.norm(robust) < 0.5 * np.linalg.norm(plain)


def test_a_run_of_many_samples_is_one_unit_of_the_robust_loss():
    """Repeating every sample of every run changes nothing."""
    made = system([3] * 30, outliers=3)
    twice = replace(
        made,
        matrix=np.repeat(made.matrix, 2, axis=0), rhs=np.repeat(made.rhs, 2, axis=0), run=np.repeat(made.run, 2),
        load=np.repeat(made.load, 2), period=np.repeat(made.period, 2), count=2.0 * made.count,
    )  # fmt: skip
    a, b = huber(made, np.ones((30, 6))), huber(twice, 0.5 * np.ones((30, 6)))
    np.testing.assert_allclose(a, b, atol=1e-6)
    assert a[:, 1].min() < 0.2


def _student_factor(fit, block):
    """Student's factor for 1 / sum(share^2) blocks, less one, by the pseudo-inverse and scipy's t."""
    inverse = np.linalg.pinv(fit.weighted)
    share = np.array([(inverse[:, block == g] ** 2).sum(axis=1) for g in np.unique(block)])
    share = share / share.sum(axis=0)
    freedom = np.maximum(1.0 / (share**2).sum(axis=0) - 1.0, 2.0)
    return t.ppf(0.975, freedom) / norm.ppf(0.975)
