"""The covariance: independent units are runs and cycles, not samples; the model-form spread is that of the members."""

from dataclasses import replace

import numpy as np
import pytest
from derive_synthetic import SPEED, W0, campaign, fourfold_coefficients, loaded, make

from towtank.derive.cycles import settled
from towtank.derive.derive import derive
from towtank.plan.motion import Sway
from towtank.terms import columns


def _coloured(rng, shape, correlation=0.8):
    """First-order autoregressive noise along axis 0, variance one."""
    white = rng.standard_normal(shape)
    out = np.empty(shape)
    out[0] = white[0]
    for i in range(1, len(white)):
        out[i] = correlation * out[i - 1] + np.sqrt(1.0 - correlation**2) * white[i]
    return out


def test_blocked_covariance_covers_where_a_naive_one_does_not():
    values = fourfold_coefficients(seed=1)
    grid = [(v, w) for v in (0.1, 0.2, 0.3) for w in (0.8, 1.2, 1.6, 2.0)]
    base = loaded([make(f"sway-{v}-{w}", Sway(SPEED, v * SPEED / (w * W0), w * W0)) for v, w in grid], values)
    rng = np.random.default_rng(0)
    terms = ("Yvdot", "Yuv", "Yvv")
    blocked, naive = [], []
    for _ in range(25):
        runs = [
            replace(run, loads=run.loads + 0.02 * run.loads.std(axis=0) * _coloured(rng, run.loads.shape))
            for run in base
        ]
        found = derive(runs)
        std = np.sqrt(np.diag(found.covariance))
        error = np.array([found[n] - values[n] for n in terms])
        blocked += list(error / std[[found.names.index(n) for n in terms]])
        naive += list(error / _naive_std(runs, terms))
    # 95 % nominal. 75 pulls: the binomial spread of a true 95 % is 2.5 %, of which three are allowed.
    assert np.mean(np.abs(blocked) < 1.96) > 0.87
    assert np.mean(np.abs(naive) < 1.96) < 0.75


def _naive_std(runs, terms):
    """Ordinary least squares on every sample, taken as independent."""
    samples = settled(runs)
    matrix = columns(terms, samples.nu, samples.nudot, samples.control)[:, 1]
    load = samples.loads[0, :, 1]
    answer, *_ = np.linalg.lstsq(matrix, load, rcond=None)
    variance = np.sum((load - matrix @ answer) ** 2) / (len(load) - len(terms))
    return np.sqrt(variance * np.diag(np.linalg.inv(matrix.T @ matrix)))


def test_misfit_that_repeats_each_period_is_counted_once_per_run():
    """A load outside the model that repeats exactly: two periods say no more than one."""
    values = fourfold_coefficients(seed=1)
    runs = loaded(campaign(), values)

    def bend(run):
        fifth = np.cos(5 * 2 * np.pi / run.period * run.history.time)[:, None]
        return replace(run, loads=run.loads + 0.05 * fifth * np.abs(run.loads).max(axis=0))

    bent = [run if run.steady else bend(run) for run in runs]
    assert derive(bent).quality["blocks"]["unit"] == "run"
    assert derive(loaded(campaign(), values, noise=0.02)).quality["blocks"]["unit"] == "run and period"


def test_model_form_covariance_is_the_spread_of_the_members_about_the_nominal():
    """The fit is linear: members whose loads come from scaled coefficients come back scaled alike."""
    values = fourfold_coefficients(seed=1)
    runs = loaded(campaign(), values)
    factors = np.array([0.8, 1.1, 1.3, 0.9])
    found = derive([replace(run, ensemble=run.loads * factors[:, None, None]) for run in runs])
    exact = np.outer(found.values, found.values) * np.mean((factors - 1.0) ** 2)
    np.testing.assert_allclose(found.covariance_model, exact, rtol=1e-9, atol=1e-9 * np.abs(exact).max())
    assert not found.covariance_mesh.any()
    # The slopes at the origin carry the same relative spread.
    spread = np.sqrt(np.mean((factors - 1.0) ** 2))
    for name, value in found.origin.items():
        assert found.origin_std[name] > 0.99 * spread * abs(value)


def test_a_term_that_rests_on_one_run_still_has_an_uncertainty():
    values = fourfold_coefficients(seed=1)
    keep = [run for run in campaign() if run.kind != "fins"]
    rudder = next(run for run in campaign() if run.name == "rudder-15")
    found = derive(loaded([*keep, rudder], values, noise=0.02, seed=2))
    i = found.names.index("Yuudr")
    assert found.runs["Yuudr"] == ("rudder-15",)
    assert 1e-3 < np.sqrt(found.covariance[i, i]) / abs(found["Yuudr"]) < 0.2


def test_covariance_is_positive_semidefinite_and_symmetric():
    found = derive(loaded(campaign(), fourfold_coefficients(seed=1), noise=0.02))
    std = np.sqrt(np.diag(found.covariance))
    correlation = found.covariance / np.outer(std, std)
    assert correlation == pytest.approx(correlation.T, abs=1e-12)
    assert np.linalg.eigvalsh(0.5 * (correlation + correlation.T)).min() > -1e-9
