"""The mean current of a record, from how the craft moved over ground and through the water."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.field.drive import Drive, bridged
from towtank.field.log import SeaLog
from towtank.field.robust import fitted
from towtank.frames import Array, rotation
from towtank.pilot.orders import FIN_ORDERS, ORDERS

Mask = NDArray[np.bool_]
Places = NDArray[np.int64]

GROUPS = 20
"""Parts of the record whose errors are taken as independent of each other."""
SHORTEST = 5.0
"""Shortest such part [s]."""
LEAST = 20.0
"""Shortest record [s] of positions from which a current is told."""
_NEWTON = 8
_THROTTLE = ORDERS.index("throttle")


@dataclass(frozen=True)
class Current:
    """flow (3,) [m/s, NED], std (3,) its standard error, words : where it comes from, or why it is zero.

    track (N + 1, 2) [m] : north and east on the ticks, between fixes too; None where there are none.   track_std
    (N + 1,) : its standard error.
    """

    flow: Array
    std: Array
    words: str
    track: Array | None = None
    track_std: Array | None = None


def no_current(why: str) -> Current:
    """None, because of ``why``."""
    return Current(np.zeros(3), np.zeros(3), why)


def mean_current(drive: Drive, log: SeaLog) -> Current:
    """The mean current of a record, and its track between fixes.

    The track is the way through the water and with the current, bent by straight lines in time to pass through the
    fixes; without a speed log it is straight between them. Its error grows with the time from the nearest fix by the
    scatter of the current over the record.

    Source     As ``_mean``.
    """
    found = _mean(drive, log)
    if not log.has("x", "y"):
        return found
    fixes = np.flatnonzero(np.isfinite(drive.seen["x"]) & np.isfinite(drive.seen["y"]))
    if len(fixes) < 2:
        return found
    way = np.zeros((len(drive.time), 2))
    if log.has("psi", "ahead"):
        way = _way(drive, *_through(drive, log)[:2]) + (drive.time - drive.time[0])[:, None] * found.flow[:2]
    seen = np.stack([drive.seen["x"], drive.seen["y"]], axis=1)
    ticks = np.arange(len(drive.time))
    bend = np.stack([np.interp(ticks, fixes, (seen - way)[fixes, i]) for i in range(2)], axis=1)
    after = np.clip(np.searchsorted(fixes, ticks), 1, len(fixes) - 1)
    apart = np.minimum(np.abs(ticks - fixes[after]), np.abs(ticks - fixes[after - 1])) * drive.clock.tick
    scatter = float(np.linalg.norm(found.std)) * np.sqrt(GROUPS)
    std = np.hypot(max(log.std.get("x", 0.0), log.std.get("y", 0.0)), scatter * apart)
    return replace(found, track=way + bend, track_std=std)


def _mean(drive: Drive, log: SeaLog) -> Current:
    """The mean horizontal current over the record; zero, and said so, where nothing tells it.

    Two ways, the one with the smaller error is taken: the distance made good less that through the water grows by the
    current times the time; or velocity over ground less that through the water, turned to NED, is the current. The
    sway through the water is as measured, else that at which the model has no sway acceleration.

    Source     fossen2021, ch. 10: nu_r = nu - J^T v_c.   Least squares as in ``towtank.field.robust``; parts of the
               record err independently of each other, and the stated bias of the speed log is added in quadrature.
    Valid      A uniform, steady current; what varies in the record is averaged. The vertical current is taken as zero.
    """
    if not log.has("psi", "ahead"):
        lacking = "psi" if not log.has("psi") else "ahead"
        return no_current(f"current: not told, the record has no {lacking}; taken as zero")
    water, J, good = _through(drive, log)
    found = [way for way in (_by_position(drive, log, water, J, good), _by_velocity(drive, log, water, J, good)) if way]
    if not found:
        return no_current("current: not told, the record has no position or velocity over ground; taken as zero")
    return min(found, key=lambda way: float(np.linalg.norm(way.std)))


def quasi_steady(drive: Drive, ticks: Places, nu: Array, attitude: Array) -> tuple[Array, Array]:
    """Sway and heave (n,) through the water at which the model has no acceleration along them.

    ticks (n,) : where the fins are taken from.   nu (n, 6) : through the water; sway and heave are where the search
    begins.   attitude (n, 3).   Where the search fails they are 0.

    Source     The model's own equations; Newton's method with slopes by differences.
    """
    at = np.clip(ticks, 0, len(drive.time) - 1)
    delta = list(np.nan_to_num(drive.delta[at]).T) if drive.measured else _ordered(drive, at)
    thrust = drive.thrust * drive.orders[np.minimum(at, len(drive.orders) - 1), _THROTTLE]
    angles, state = list(attitude.T), [column.copy() for column in nu.T]

    def rates(v: Array, w: Array) -> tuple[Array, Array]:
        nudot = drive.model.acceleration([state[0], v, w, *state[3:]], angles, delta, thrust)
        return np.asarray(nudot[1] + 0.0 * v), np.asarray(nudot[2] + 0.0 * w)

    v, w, step = state[1], state[2], 1e-5
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON):
            (a, b), (av, bv), (aw, bw) = rates(v, w), rates(v + step, w), rates(v, w + step)
            m00, m01, m10, m11 = (av - a) / step, (aw - a) / step, (bv - b) / step, (bw - b) / step
            det = m00 * m11 - m01 * m10
            v, w = v - (m11 * a - m01 * b) / det, w - (m00 * b - m10 * a) / det
    fine = np.isfinite(v) & np.isfinite(w) & (np.hypot(v, w) <= np.abs(state[0]) + 0.1)
    return np.where(fine, v, 0.0), np.where(fine, w, 0.0)


def _ordered(drive: Drive, at: Places) -> list[Array]:
    rows = np.minimum(at, len(drive.orders) - 1)
    return [drive.orders[rows, ORDERS.index(name)] for name in FIN_ORDERS[: len(drive.model.craft.fins)]]


def _through(drive: Drive, log: SeaLog) -> tuple[Array, Array, Mask]:
    """Velocity through the water (N, 3) on the ticks, body to NED (N, 3, 3), and where both are known (N,)."""
    time, n = drive.time, len(drive.time)

    def on(name: str) -> tuple[Array, Mask]:
        if not log.has(name):
            return np.zeros(n), np.ones(n, dtype=bool)
        return bridged(log.time, log[name], time)

    columns = {name: on(name) for name in ("phi", "theta", "psi", "ahead", "slip", "plunge", "p", "q", "r")}
    attitude = np.stack([columns[name][0] for name in ("phi", "theta", "psi")], axis=1)
    water = np.stack([columns[name][0] for name in ("ahead", "slip", "plunge")], axis=1)
    if not log.has("slip", "plunge"):
        rates = [columns[name][0] for name in ("p", "q")]
        turn = columns["r"][0] if log.has("r") else np.gradient(columns["psi"][0], time)
        nu = np.concatenate([water, np.stack([*rates, turn], axis=1)], axis=1)
        v, w = quasi_steady(drive, np.arange(n), nu, attitude)
        water[:, 1] = water[:, 1] if log.has("slip") else v
        water[:, 2] = water[:, 2] if log.has("plunge") else w
    good = columns["psi"][1] & columns["ahead"][1]
    return water, rotation(attitude), good


def _way(drive: Drive, water: Array, J: Array) -> Array:
    """Way (N, 2) [m] through the water to the north and east, by the trapezoid rule."""
    ned = np.einsum("nij,nj->ni", J, water)[:, :2]
    return np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * drive.clock.tick * (ned[1:] + ned[:-1]), axis=0)])


def _by_position(drive: Drive, log: SeaLog, water: Array, J: Array, good: Mask) -> Current | None:
    """From x and y: their distance to the way through the water, part by part of the record without a hole."""
    if not log.has("x", "y"):
        return None
    time, way = drive.time, _way(drive, water, J)
    part = np.cumsum(np.concatenate([[0], ~(good[1:] & good[:-1])]))
    held = good & np.isfinite(drive.seen["x"]) & np.isfinite(drive.seen["y"])
    count = np.bincount(part[held], minlength=int(part.max()) + 1) if held.any() else np.zeros(1)
    held &= count[np.minimum(part, len(count) - 1)] >= 4
    if held.sum() < 8 or np.ptp(time[held]) < LEAST:
        return None
    labels = np.unique(part[held])
    A = np.concatenate([time[held, None], (part[held, None] == labels[None, :]).astype(float)], axis=1)
    group = _groups(time[held])
    fits = [fitted(A, drive.seen[name][held] - way[held, i], group) for i, name in enumerate(("x", "y"))]
    flow = np.array([fits[0].unknowns[0], fits[1].unknowns[0], 0.0])
    std = np.array([*(np.sqrt(max(fit.covariance[0, 0], 0.0)) for fit in fits), 0.0])
    return _said(flow, std, log, ("ahead",), "position against the way through the water")


def _by_velocity(drive: Drive, log: SeaLog, water: Array, J: Array, good: Mask) -> Current | None:
    """From u and v over ground."""
    if not (log.has("u", "v") and log.has("slip")):
        return None
    held = good & np.isfinite(drive.seen["u"]) & np.isfinite(drive.seen["v"])
    if held.sum() < 8:
        return None
    heave = np.nan_to_num(drive.seen["w"]) - water[:, 2] if log.has("w", "plunge") else np.zeros(len(held))
    off = np.stack([drive.seen["u"] - water[:, 0], drive.seen["v"] - water[:, 1], heave], axis=1)
    ned = np.einsum("nij,nj->ni", J[held], off[held])
    group = _groups(drive.time[held])
    fits = [fitted(np.ones((int(held.sum()), 1)), ned[:, i], group) for i in range(2)]
    flow = np.array([fits[0].unknowns[0], fits[1].unknowns[0], 0.0])
    std = np.array([*(np.sqrt(max(fit.covariance[0, 0], 0.0)) for fit in fits), 0.0])
    return _said(flow, std, log, ("ahead", "u"), "velocity over ground against that through the water")


def _groups(time: Array) -> Places:
    span = max(float(np.ptp(time)) / GROUPS, SHORTEST)
    return np.asarray(np.floor((time - time[0]) / span), dtype=np.int64)


def _said(flow: Array, std: Array, log: SeaLog, biased: tuple[str, ...], how: str) -> Current:
    bias = np.sqrt(sum(log.bias.get(name, 0.0) ** 2 for name in biased))
    std = np.hypot(std, [bias, bias, 0.0])
    return Current(flow, std, (
        f"current: {flow[0]:.3g} +- {std[0]:.2g} m/s north, {flow[1]:.3g} +- {std[1]:.2g} m/s east, by {how}"
        + (" with the stated bias of the log" if bias else "") + "; none up or down is told"
    ))  # fmt: skip
