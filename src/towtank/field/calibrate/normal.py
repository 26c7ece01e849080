"""The normal equations of a record: its windows eliminated, band by band, down to what lasts the record and to z."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.linalg.lapack import dtbtrs

from towtank.field.calibrate.noise import ANGULAR, LINEAR, MOTION, WATER, Links, Noise
from towtank.field.calibrate.settings import Settings
from towtank.field.calibrate.shoot import Piece, Point, wrapped
from towtank.field.calibrate.windows import STATES, Windows
from towtank.frames import Array

N = len(STATES)
VAGUE = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 1.0, 1.0, 1.0])
"""Standard deviations of the motion about the guess where a stretch of the record begins [m, rad, m/s, rad/s]: so wide
that a measurement of any use replaces them. A position that nobody measures is one of the datum, known to a metre."""
WIDE = 30.0
"""The same for a measured position, in standard deviations of its sensor."""


def vague(windows: Windows) -> Array:
    """Standard deviations (12,) of the motion where a stretch begins, about the guess."""
    out = VAGUE.copy()
    for i, name in enumerate("xyz"):
        out[i] = max(out[i], WIDE * windows.std.get(name, 0.0))
    return out


@dataclass(frozen=True)
class Prior:
    """What is known of a record before it is read: of what lasts it, centre and std (m,)."""

    centre: Array
    std: Array


def prior_of(windows: Windows, settings: Settings) -> Prior:
    """Thrust about 1, the current about 0, biases about 0."""
    std = [settings.thrust, settings.current, settings.current, settings.upwelling, *windows.bias]
    return Prior(np.array([1.0, *[0.0] * (len(std) - 1)]), np.array(std))


@dataclass(frozen=True)
class Missed:
    """What the links miss. motion (W, 12), water (W, 3) : at the end of each window that goes on, 0 elsewhere."""

    motion: Array
    water: Array


def missed(windows: Windows, links: Links, point: Point, end: Array) -> Missed:
    """What is missed at ``point`` whose windows end in the motion ``end`` (W, 12)."""
    after = np.roll(point.states, -1, axis=0)
    motion = end - after[:, :MOTION]
    motion[:, 3], motion[:, 5] = wrapped(motion[:, 3]), wrapped(motion[:, 5])
    water = links.keep[:, None] * point.states[:, WATER] - after[:, WATER]
    on = windows.linked[:, None]
    return Missed(np.where(on, motion, 0.0), np.where(on, water, 0.0))


def expected(windows: Windows, links: Links, gone: Missed, piece: Piece, states: Array, g: Array) -> Missed:
    """What is expected to be missed after steps of the windows ``states`` (W, 15) and of ``g`` (G,), to first order."""
    after = np.roll(states, -1, axis=0)
    motion = (piece.end_s @ states[..., None])[..., 0] + piece.end_g @ g - after[:, :MOTION]
    water = links.keep[:, None] * states[:, WATER] - after[:, WATER]
    on = windows.linked[:, None]
    return Missed(gone.motion + np.where(on, motion, 0.0), gone.water + np.where(on, water, 0.0))


def begins(windows: Windows) -> Array:
    """1 for the windows (W,) in which a stretch begins."""
    return np.concatenate([[1.0], 1.0 - windows.linked[:-1]])


def cost(windows: Windows, links: Links, noise: Noise, prior: Prior, point: Point, end: Array, square: Array) -> float:
    """Sum of squares in standard deviations: measurements ``square`` (C,), links, and what was known of the record."""
    gone = missed(windows, links, point, end)
    first = begins(windows)[:, None]
    total = float(square.sum()) + float((((point.shared - prior.centre) / prior.std) ** 2).sum())
    total += float(np.einsum("wi,wij,wj->", gone.motion, links.motion(noise), gone.motion))
    total += float((links.water(noise) * gone.water**2).sum())
    total += float((first * point.states[:, WATER] ** 2 / noise.water).sum())
    return total + float((first * ((point.states[:, :MOTION] - windows.guess[:, :MOTION]) / vague(windows)) ** 2).sum())


@dataclass(frozen=True)
class Equations:
    """Normal equations of a record about a point.

    diagonal, upper (W, 15, 15) : blocks of its windows.   sg (W, 15, G), gg (G, G), s (W, 15), g (G,) : with what is
    shared, and right sides.   k : length of z, the first of the G.
    """

    diagonal: Array
    upper: Array
    sg: Array
    gg: Array
    s: Array
    g: Array
    k: int

    @cached_property
    def factor(self) -> Array:
        """Lower factor of the windows' equations, by bands (30, 15 W)."""
        band = np.zeros((2 * N, N * len(self.s)))
        for r in range(N):
            for c in range(N):
                if r >= c:
                    band[r - c, c::N] = self.diagonal[:, r, c]
                band[N + r - c, c:-N:N] = self.upper[:-1, c, r]
        return np.asarray(cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False))

    @cached_property
    def gains(self) -> Array:
        """Inverse of the windows' equations times sg (W, 15, G)."""
        w, _, size = self.sg.shape
        out = cho_solve_banded((self.factor, True), self.sg.reshape(N * w, size), check_finite=False)
        return np.asarray(out.reshape(w, N, size))

    @cached_property
    def alone(self) -> Array:
        """Step (W, 15) of the windows if nothing else moved."""
        return np.asarray(cho_solve_banded((self.factor, True), self.s.ravel(), check_finite=False).reshape(-1, N))

    def drawn(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """A draw of the windows (W, 15) and of what lasts the record (m,) about the most likely ones, at a fixed z."""
        k, (a, _) = self.k, self.reduced
        free, info = dtbtrs(self.factor, rng.standard_normal((self.s.size, 1)), uplo="L", trans="T")
        if info:
            raise np.linalg.LinAlgError("the factor of a record is singular")
        shared = np.linalg.solve(np.linalg.cholesky(a[k:, k:]).T, rng.standard_normal(len(a) - k))
        return free.reshape(-1, N) - self.gains[..., k:] @ shared, np.asarray(shared)

    @cached_property
    def reduced(self) -> tuple[Array, Array]:
        """Equations (G, G) and right side (G,) of z and of what lasts the record."""
        y, s = self.gains, self.alone
        a = self.gg - np.einsum("wig,wih->gh", self.sg, y, optimize=True)
        return 0.5 * (a + a.T), np.asarray(self.g - np.einsum("wig,wi->g", self.sg, s, optimize=True))

    @cached_property
    def told(self) -> tuple[Array, Array]:
        """What the record says of z: information (k, k) and right side (k,)."""
        a, b = self.reduced
        k = self.k
        gain = np.asarray(np.linalg.solve(a[k:, k:], np.column_stack([a[k:, :k], b[k:]])))
        told = a[:k, :k] - a[:k, k:] @ gain[:, :k]
        return np.asarray(0.5 * (told + told.T)), np.asarray(b[:k] - a[:k, k:] @ gain[:, k])

    def back(self, step: Array) -> tuple[Array, Array]:
        """Steps of what lasts the record (m,) and of the windows (W, 15), of the step of z (k,)."""
        a, b = self.reduced
        k = self.k
        shared = np.asarray(np.linalg.solve(a[k:, k:], b[k:] - a[k:, :k] @ step))
        y, s = self.gains, self.alone
        return shared, np.asarray(s - y @ np.concatenate([step, shared]))


def equations(
    windows: Windows, links: Links, noise: Noise, prior: Prior, point: Point, piece: Piece, k: int
) -> Equations:
    """The equations of the measurements ``piece``, of the links and of what was known."""
    on = windows.linked
    Qi, water = np.where(on[:, None, None], links.motion(noise), 0.0), np.where(on[:, None], links.water(noise), 0.0)
    half = np.swapaxes(piece.end_s, 1, 2) @ Qi
    diagonal, sg = piece.ss + half @ piece.end_s, piece.sg + half @ piece.end_g
    upper = np.zeros_like(diagonal)
    upper[:, :, :MOTION] = -half
    g_half = np.swapaxes(piece.end_g, 1, 2) @ Qi
    gg = piece.gg + (g_half @ piece.end_g).sum(axis=0)
    diagonal[1:, :MOTION, :MOTION] += Qi[:-1]
    sg[1:, :MOTION] -= np.swapaxes(g_half, 1, 2)[:-1]
    for i in range(MOTION, N):
        weight = water[:, i - MOTION]
        diagonal[:, i, i] += links.keep**2 * weight
        diagonal[1:, i, i] += weight[:-1]
        upper[:, i, i] -= links.keep * weight
    diagonal[:, range(N), range(N)] += _beginning(windows, noise)
    at = np.arange(k, k + len(prior.std))
    gg[at, at] += 1.0 / prior.std**2
    return Equations(diagonal, upper, sg, gg, *right_sides(windows, links, noise, prior, point, piece, k), k)


def right_sides(
    windows: Windows, links: Links, noise: Noise, prior: Prior, point: Point, piece: Piece, k: int
) -> tuple[Array, Array]:
    """Right sides (W, 15) of the windows and (G,) of what they share: half of the slopes of the cost, downhill."""
    gone = missed(windows, links, point, piece.end)
    pulled = (links.motion(noise) @ gone.motion[..., None])[..., 0]
    s = piece.s - (np.swapaxes(piece.end_s, 1, 2) @ pulled[..., None])[..., 0]
    g = piece.g - (np.swapaxes(piece.end_g, 1, 2) @ pulled[..., None]).sum(axis=0)[:, 0]
    s[1:, :MOTION] += pulled[:-1]
    change = links.water(noise) * gone.water
    s[:, WATER] -= links.keep[:, None] * change
    s[1:, WATER] += change[:-1]
    centre = windows.guess.copy()
    centre[:, WATER] = 0.0
    s -= _beginning(windows, noise) * (point.states - centre)
    g[k:] -= (point.shared - prior.centre) / prior.std**2
    return s, g


def _beginning(windows: Windows, noise: Noise) -> Array:
    """Inverse variances (W, 15) of what is known of a window because a stretch begins there."""
    return np.asarray(begins(windows)[:, None] * np.concatenate([1.0 / vague(windows) ** 2, 1.0 / noise.water]))


@dataclass(frozen=True)
class Spread:
    """Covariances after the fit.

    states (W, 15, 15) : of each window.   link (W, 12, 12), water (W, 3) : of what its link misses.
    """

    states: Array
    link: Array
    water: Array


def spread(windows: Windows, links: Links, piece: Piece, it: Equations, shared: Array) -> Spread:
    """Covariances of the windows, with that of g (G, G), ``shared``.

    Source     rauch1965: the smoother's covariance, here by blocks of the factor of the normal equations.
    """
    w = len(it.diagonal)
    inverse, gain = np.zeros_like(it.diagonal), np.zeros_like(it.diagonal)
    block = it.diagonal[0]
    for i in range(w):
        inverse[i] = np.linalg.inv(block)
        if i + 1 < w:
            gain[i] = inverse[i] @ it.upper[i]
            block = it.diagonal[i + 1] - it.upper[i].T @ gain[i]
    states, pair = inverse, np.zeros_like(inverse)
    for i in range(w - 2, -1, -1):
        if windows.linked[i]:
            pair[i] = -gain[i] @ states[i + 1]
            states[i] = states[i] - pair[i] @ gain[i].T
    y = it.gains
    after, y_after = np.roll(states, -1, axis=0), np.roll(y, -1, axis=0)
    F = piece.end_s
    own = F @ states @ np.swapaxes(F, 1, 2) + after[:, :MOTION, :MOTION]
    cross = F @ pair[:, :, :MOTION]
    through = piece.end_g - F @ y + y_after[:, :MOTION]
    link = own - cross - np.swapaxes(cross, 1, 2) + through @ shared @ np.swapaxes(through, 1, 2)
    moved = -links.keep[:, None, None] * y[:, WATER] + y_after[:, WATER]
    at = np.arange(MOTION, N)
    water = (links.keep**2)[:, None] * states[:, at, at] + after[:, at, at]
    water += -2.0 * links.keep[:, None] * pair[:, at, at] + np.einsum("wig,gh,wih->wi", moved, shared, moved)
    return Spread(states + y @ shared @ np.swapaxes(y, 1, 2), link, water)


def counted(
    windows: Windows, links: Links, noise: Noise, gone: Missed, states: Array, found: Spread
) -> tuple[Array, Array]:
    """Of each kind of link, as ``Noise.scales``: squares (4,) of what is missed, and how many are free (4,).

    states (W, 15) : where ``gone`` is missed.
    """
    on = windows.linked
    squares, free = np.zeros(4), np.zeros(4)
    for kind, (places, inverse, scale) in enumerate(
        ((LINEAR, links.linear, noise.push), (ANGULAR, links.angular, noise.twist))
    ):
        e = gone.motion[:, places]
        squares[kind] = np.einsum("wi,wij,wj->", e[on], inverse[on], e[on]) / scale
        part = found.link[on][:, np.array(places)[:, None], places]
        free[kind] = len(places) * on.sum() - np.einsum("wij,wji->", inverse[on], part) / scale
    first, at = begins(windows) > 0.0, np.arange(MOTION, N)
    start, inverse = states[first][:, WATER], links.water(noise)
    missing = (inverse * gone.water**2)[on].sum(axis=0) + (start**2 / noise.water).sum(axis=0)
    fitted = (inverse * found.water)[on].sum(axis=0)
    fitted += (found.states[first][:, at, at] / noise.water).sum(axis=0)
    left = float(on.sum() + first.sum()) - fitted
    squares[2:], free[2:] = (missing[:2].sum(), missing[2]), (left[:2].sum(), left[2])
    return squares, free
