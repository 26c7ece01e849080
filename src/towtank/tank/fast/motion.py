"""A motion as the fast tank sees it: samples with a lead-in, and memory by travelled distance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from towtank.frames import Array
from towtank.plan.history import History


@dataclass(frozen=True)
class MotionRecord:
    """Samples (N,) of which the first ``lead`` lie before the test begins; they feed the memory and are not reported.

    nu, nudot (N, 6); delta (N, n_fins) [rad].   memory : False makes every load quasi-steady.
    """

    time: Array
    nu: Array
    nudot: Array
    delta: Array
    lead: int = 0
    memory: bool = True

    @cached_property
    def travelled(self) -> Array:
        """Distance run through the water along x (N,) [m]."""
        return self.integral(np.abs(self.nu[:, 0]))

    @cached_property
    def remembers(self) -> bool:
        """Memory needs headway all along the record; without it the loads are quasi-steady."""
        u = self.nu[:, 0]
        return bool(self.memory and len(u) > 2 and u.min() > 1e-3 * max(np.abs(self.nu[:, :3]).max(), 1e-12))

    def integral(self, rate: Array) -> Array:
        """Running time integral (N,) of ``rate`` (N,) by the trapezoidal rule."""
        return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(self.time))])

    def delayed(self, signal: Array, distance: Array) -> Array:
        """``signal`` (N,) as it was ``distance`` (m,) [m] of travel ago, shape (m, N); its first value before that."""
        if not self.remembers:
            return np.broadcast_to(signal, (len(distance), len(signal)))
        s = self.travelled
        return np.interp(s[None, :] - distance[:, None], s, signal)


def slip(record: MotionRecord, x: Array, behind_bow: Array) -> tuple[Array, Array]:
    """Lateral displacement (N, k) [m], along y and z, of the hull section at ``x`` through the water slice it cuts.

    A slice is met by the bow and then passed by the sections in turn; the slip is what it has been displaced,
    relative to the hull, since. In steady drift it is tan(beta) times the distance behind the bow; in a steady turn
    the arm is the mean between where the slice was met and where it is.

    Parameters
    ----------
    x : body stations (k,) [m].   behind_bow : distance from the end that meets the water first (k,) [m].
    """
    u, v, w, _, q, r = record.nu.T
    if not record.remembers:
        spent = behind_bow / np.maximum(np.abs(u), 1e-9)[:, None]
        arm = x + 0.5 * np.where(u >= 0.0, 1.0, -1.0)[:, None] * behind_bow
        return (v[:, None] + arm * r[:, None]) * spent, (w[:, None] - arm * q[:, None]) * spent
    s = record.travelled
    met = s[:, None] - behind_bow

    missing = np.maximum(-met, 0.0)  # travel before the record began, taken as steady at its first sample

    def passed(rate: Array, before: Array) -> Array:
        running = record.integral(rate)
        return np.asarray(running[:, None] - np.interp(met, s, running) + before)

    def since(linear: Array, angular: Array, sign: float) -> Array:
        straight = passed(linear, missing * linear[0] / u[0])
        turned = passed(angular, missing * angular[0] / u[0])
        turned_along = passed(s * angular, -0.5 * missing**2 * angular[0] / u[0])
        return np.asarray(straight + sign * ((x + s[:, None]) * turned - turned_along))

    return since(v, r, 1.0), since(w, q, -1.0)


def record_of(history: History, lead: int, fins: Array, memory: bool = True) -> MotionRecord:
    """MotionRecord of a sampled history; ``fins`` (n_fins,) [rad] are held."""
    delta = np.broadcast_to(fins, (len(history.time), len(fins)))
    return MotionRecord(history.time, history.nu, history.nudot, delta, lead, memory)
