"""The reduced equations against dense least squares, and a linear case against its closed form."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from calibrate_cases import hokie, records
from towtank.field.calibrate.fit import Crew, Search, case_of, onwards, shared_of
from towtank.field.calibrate.noise import Noise, learned
from towtank.field.calibrate.normal import spread
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.unknowns import unknowns
from towtank.field.calibrate.windows import windows_of
from towtank.field.sea_water import Environment


def searched():
    model, settings = hokie(), Settings(learn=False)
    logs = records(model, 12.0, Environment(turbulence=(0.02, 0.02, 0.01)), count=2)
    free = unknowns(model.derivatives)
    cases = [case_of(windows_of(model, log, settings), free.names, settings) for log in logs]
    return Search(cases, free, settings, Crew(1)), free


def dense(it):
    """The normal equations of a record in full: windows, then z and what lasts the record."""
    w, n, size = it.sg.shape
    out = np.zeros((w * n + size, w * n + size))
    for i in range(w):
        at = slice(i * n, i * n + n)
        out[at, at] = it.diagonal[i]
        if i + 1 < w:
            after = slice(i * n + n, i * n + 2 * n)
            out[at, after], out[after, at] = it.upper[i], it.upper[i].T
        out[at, w * n :], out[w * n :, at] = it.sg[i], it.sg[i].T
    out[w * n :, w * n :] = it.gg
    return out, np.concatenate([it.s.ravel(), it.g])


def test_the_reduced_step_and_covariances_are_those_of_the_dense_problem():
    search, free = searched()
    all_of = search.equations()
    dz, backs, _ = search.step(all_of)
    k = free.size
    # All records in one dense system: z first, then windows and what lasts each record.
    parts = [dense(it) for it in all_of]
    sizes = [len(it.s.ravel()) + len(it.g) - k for it in all_of]
    total = k + sum(sizes)
    a, b = np.zeros((total, total)), np.zeros(total)
    a[:k, :k], b[:k] = np.eye(k), -search.z
    start = k
    for (own, right), it, size in zip(parts, all_of, sizes, strict=True):
        n = it.s.size
        order = np.concatenate([np.arange(n, n + k), np.arange(n), np.arange(n + k, len(own))])
        places = np.concatenate([np.arange(k), np.arange(start, start + size)])
        a[np.ix_(places, places)] += own[np.ix_(order, order)]
        b[places] += right[order]
        start += size
    # Scaled to a diagonal of ones, so that round-off is that of numbers alike.
    scale = 1.0 / np.sqrt(np.diag(a))
    factor = cho_factor(a * np.outer(scale, scale))
    x = scale * cho_solve(factor, scale * b)
    np.testing.assert_allclose(dz, x[:k], rtol=1e-6, atol=1e-8)
    covariance = cho_solve(factor, np.eye(total)) * np.outer(scale, scale)
    own = np.linalg.inv(np.eye(k) + sum(it.told[0] for it in all_of))
    np.testing.assert_allclose(own, covariance[:k, :k], rtol=1e-6, atol=1e-10)
    case, it = search.cases[0], all_of[0]
    np.testing.assert_allclose(backs[0][1].ravel(), x[k : k + it.s.size], rtol=1e-5, atol=1e-8)
    found = spread(case.windows, case.links, search.pieces[0], it, shared_of(it, own))
    for i in range(len(it.s)):
        block = slice(k + 15 * i, k + 15 * i + 15)
        np.testing.assert_allclose(np.diag(found.states[i]), np.diag(covariance[block, block]), rtol=1e-5)
    # What the first link misses: its slopes to the two windows, to z and to what lasts the record.
    piece, m = search.pieces[0], len(it.g) - k
    row = np.zeros((12, total))
    row[:, :k], row[:, k : k + 15] = piece.end_g[0, :, :k], piece.end_s[0]
    row[:, k + 15 : k + 27] -= np.eye(12)
    row[:, k + it.s.size : k + it.s.size + m] = piece.end_g[0, :, k:]
    np.testing.assert_allclose(np.diag(found.link[0]), np.diag(row @ covariance @ row.T), rtol=1e-4)
    search.crew.close()


def test_the_variance_of_largest_evidence_of_plain_numbers_is_their_mean_square():
    # y = x + noise of variance 1, x of variance q: evidence is largest at q = mean y^2 - 1.
    y = np.random.default_rng(1).normal(0.0, np.sqrt(5.0), 4000)
    noise = Noise(1.0, 1.0, 1.0, 1.0)
    for _ in range(60):
        q = noise.scales
        x, left = y[:, None] * q / (q + 1.0), q / (q + 1.0)
        squares, free = (x**2).sum(axis=0) / q, len(y) * (1.0 - left / q)
        noise, moved = learned(noise, Noise(1.0, 1.0, 1.0, 1.0), squares, free)
    assert moved < 1e-6
    np.testing.assert_allclose(noise.scales, (y**2).mean() - 1.0, rtol=1e-6)


def test_steps_with_motions_open_sum_towards_the_whole_way_and_never_beyond():
    # With the motions fixed a coefficient looks better known (10) than it is (6): each step goes 0.6 of what is left.
    told, whole = np.diag([6.0, 9.0]), np.diag([10.0, 10.0])
    way = np.array([1.0, -2.0])
    first = np.linalg.solve(whole, told @ way)
    step, rest = onwards(first, told, whole)
    np.testing.assert_allclose(step, way * (1.0 - np.array([0.4, 0.1]) ** 4), rtol=1e-12)
    assert rest > 0.0


def test_draws_of_the_motion_have_the_covariance_of_the_fit():
    search, free = searched()
    (it, _) = search.equations()
    rng = np.random.default_rng(3)
    drawn = np.array([it.drawn(rng)[0][3] for _ in range(600)])
    # At a fixed z: what is shared is the record's own.
    a, k = it.reduced[0], free.size
    none = np.zeros_like(a)
    none[k:, k:] = np.linalg.inv(a[k:, k:])
    case = search.cases[0]
    found = spread(case.windows, case.links, search.pieces[0], it, none)
    # 600 draws know a standard deviation to 3 %; of 15 the worst is within 4 of these.
    np.testing.assert_allclose(drawn.std(axis=0), np.sqrt(np.diag(found.states[3])), rtol=0.12)
    search.crew.close()
