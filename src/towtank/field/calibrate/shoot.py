"""All windows of a record flown on the compiled engine with their slopes, and gathered into normal equations."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from towtank.engine.form import form_of
from towtank.engine.library import Slope, library
from towtank.engine.loop import KINEMATIC, MEMORY, channels, states
from towtank.engine.parameters import parameters, varied
from towtank.errors import TowtankError
from towtank.field.calibrate.windows import SHARED, STATES, Windows
from towtank.frames import Array
from towtank.model.algebra import NUMPY
from towtank.model.kinematics import quaternion_of
from towtank.pilot.law import NO_PILOT

CHUNK = 48
"""Windows flown and gathered at a time: their slopes stay in the cache."""
QUATERNION = ("e0", "e1", "e2", "e3")
RATES = ("u", "v", "w", "p", "q", "r")
MOTION = 12
"""States of a window without those of the water."""


@dataclass(frozen=True)
class Point:
    """Where a record's equations are taken: starts of its windows (W, 15), and what lasts the record (m,)."""

    states: Array
    shared: Array


@dataclass(frozen=True)
class Piece:
    """Some windows about a point, to first order.

    The unknowns g of all windows are z, then those that last the record; s those of a window.
    ss (W, 15, 15), sg (W, 15, G), s (W, 15) : products of the whitened slopes of the measurements with each other and
    with what is left of them.   gg (G, G), g (G,) : the same, summed.   end (W, 12) : the motion at the end of each
    window.   end_s (W, 12, 15), end_g (W, 12, G) : its slopes.   square (C,) : sum of squares of what is left of each
    channel, in standard deviations.
    """

    ss: Array
    sg: Array
    s: Array
    gg: Array
    g: Array
    end: Array
    end_s: Array
    end_g: Array
    square: Array


class Engine:
    """The compiled engine of one record: its library, and the places of its numbers. Used by several threads."""

    def __init__(self, windows: Windows, names: tuple[str, ...]) -> None:
        drive = windows.drive
        self.windows, self.names, self.form = windows, names, form_of(drive.model)
        compiled = library(self.form) if self.form.smooth else None
        if compiled is None:
            raise TowtankError(
                "calibration needs the slopes of the compiled engine, and there is none for this craft here. `towtank "
                "doctor` tells why; install a C compiler and CasADi, or leave TOWTANK_ENGINE unset. A craft with "
                "damaged fins that the pilot knows of has no slopes: set faults_known=False."
            )
        self.handle = compiled.handle
        self.base = parameters(self.form, drive.model, NO_PILOT, drive.thrust)
        place, entries = self.form.place, (*states(self.form.fins), *MEMORY)
        free = place["inverse00"]
        self.params = len(names) + len(SHARED)
        self.direction = np.array(
            [place[name] for name in (*names, *SHARED)]
            + [free + entries.index(name) for name in (*QUATERNION, *RATES)],
            dtype=np.int64,
        )
        every = channels(self.form.fins)
        self.channel = np.array([every.index(name) for name in windows.channels], dtype=np.int64)
        self.row = np.arange(windows.measured.shape[1], dtype=np.int64)
        self.orders = np.ascontiguousarray(drive.orders)
        self.places = [place[name] for name in SHARED]

    def common(self, values: dict[str, float]) -> Array:
        """The vector of parameters with ``values`` in place of the model's; the inverse of the mass follows."""
        out = self.base.copy()
        if values:
            which, row = varied(self.form, self.base, {name: np.array([v]) for name, v in values.items()}, 1)
            out[which] = row[0]
        return out

    def fly(self, common: Array, point: Point, span: slice, slopes: bool) -> tuple[Array, Array]:
        """Channels (w, n, C) and their slopes (w, n, C, D) of the windows ``span``; D is 0 without slopes."""
        it, drive = self.windows, self.windows.drive
        s, ticks, first = point.states[span], it.ticks[span], it.first[span]
        count, n, wide = len(s), len(self.row), len(self.direction) if slopes else 0
        p = np.tile(common, (count, 1))
        p[:, self.places[0]] = drive.thrust * point.shared[0]
        p[:, self.places[1:]] = point.shared[1:4] + s[:, MOTION:]
        start = np.zeros((count, KINEMATIC + self.form.fins + len(MEMORY)))
        start[:, :3], start[:, 7:13] = s[:, :3], s[:, 6:12]
        start[:, 3:7] = np.stack(quaternion_of([s[:, 3], s[:, 4], s[:, 5]], NUMPY), axis=-1)
        start[:, KINEMATIC : KINEMATIC + it.delta.shape[1]] = it.delta[span]
        seen = np.zeros((count, n, len(self.channel)))
        tangent = np.zeros((count, n, len(self.channel), wide))
        task = Slope(
            steps=drive.clock.steps, tick=drive.clock.tick, channels=len(self.channel), directions=wide,
            row=self.row.ctypes.data, channel=self.channel.ctypes.data, direction=self.direction.ctypes.data,
        )  # fmt: skip
        bases = [(a.ctypes.data, a.strides[0]) for a in (p, start, seen, tangent)]
        orders, stride = self.orders.ctypes.data, self.orders.strides[0]
        for i in range(count):
            task.p, task.start, task.seen, task.tangent = (base + i * step for base, step in bases)
            task.ticks, task.orders = int(ticks[i]), orders + int(first[i]) * stride
            if self.handle.tangents(ctypes.byref(task)):
                raise TowtankError("calibration: there is no memory for the slopes of a window. Shorten the windows.")
        return seen, tangent

    def left(self, point: Point, seen: Array, span: slice) -> Array:
        """What is left (w, n, C) of the measurements, in standard deviations; heading and roll within half a turn."""
        it = self.windows
        rest = it.measured[span] - seen
        rest[..., it.biased] -= point.shared[len(SHARED) :]
        for name in ("phi", "psi"):
            rest[..., STATES.index(name)] = wrapped(rest[..., STATES.index(name)])
        return np.asarray(rest * it.weight[span])

    def ends(self, seen: Array, span: slice) -> Array:
        """The motion (w, 12) at the end of each window."""
        return np.asarray(seen[np.arange(len(seen)), self.windows.ticks[span] - 1, :MOTION])

    def gather(self, common: Array, point: Point, span: slice, columns: Array) -> Piece:
        """The windows ``span`` about ``point``. columns (names, k) : change of the parameters per unit of z."""
        it = self.windows
        seen, tangent = self.fly(common, point, span, slopes=True)
        rest = self.left(point, seen, span)
        count, n, c, wide = tangent.shape
        last = tangent[np.arange(count), it.ticks[span] - 1, :MOTION]
        weight = it.weight[span]
        tangent *= weight[..., None]
        a = tangent.reshape(count, n * c, wide)
        at = np.swapaxes(a, 1, 2)
        square, right = at @ a, (at @ rest.reshape(count, n * c, 1))[..., 0]
        # Sums over the ticks of each channel, for unknowns that add to a channel: its bias, and the start of x y z.
        plain = np.matmul(np.swapaxes(weight, 1, 2)[:, :, None, :], np.moveaxis(tangent, 2, 1))[:, :, 0]
        plain_square, plain_right = (weight**2).sum(axis=1), (weight * rest).sum(axis=1)
        turn = Turn(self, point, span, columns)
        finite = np.isfinite(square).all() and np.isfinite(right).all() and np.isfinite(last).all()
        if not finite:
            raise TowtankError(f"log {it.log.name}: the motion grows without bound in a window.")
        return turn.piece(square, right, plain, plain_square, plain_right, self.ends(seen, span), last,
                          (rest**2).sum(axis=(0, 1)))  # fmt: skip


@dataclass(frozen=True)
class Turn:
    """From the engine's directions to the unknowns of some windows: parameters to z, quaternion to angles."""

    engine: Engine
    point: Point
    span: slice
    columns: Array

    def piece(
        self, square: Array, right: Array, plain: Array, plain_square: Array, plain_right: Array, end: Array,
        last: Array, left: Array,
    ) -> Piece:  # fmt: skip
        """Normal equations in the unknowns. square (w, D, D), right (w, D), plain (w, C, D), last (w, 12, D)."""
        e, it = self.engine, self.engine.windows
        params, k, biased = e.params, self.columns.shape[1], it.biased
        m, count = len(SHARED) + len(biased), len(square)
        B, Q = self._parameters(), self._angles()
        inner = k + len(SHARED)
        gg, g = np.zeros((k + m, k + m)), np.zeros(k + m)
        gg[:inner, :inner] = B.T @ square[:, :params, :params].sum(axis=0) @ B
        gg[:inner, inner:] = (plain[:, biased, :params].sum(axis=0) @ B).T
        gg[inner:, :inner] = gg[:inner, inner:].T
        gg[inner:, inner:] = np.diag(plain_square[:, biased].sum(axis=0))
        g[:inner], g[inner:] = right[:, :params].sum(axis=0) @ B, plain_right[:, biased].sum(axis=0)
        # Q (w, D, 15): a direction's share of each state; the water's are those of the current, x y z are apart.
        half = np.swapaxes(Q, 1, 2) @ square
        ss, sg = half @ Q, np.zeros((count, len(STATES), k + m))
        sg[:, :, :inner] = half[:, :, :params] @ B
        sg[:, :, inner:] = np.swapaxes(plain[:, biased] @ Q, 1, 2)
        s = (right[:, None, :] @ Q)[:, 0]
        ss[:, :3] += plain[:, :3] @ Q
        ss[:, :, :3] += np.swapaxes(plain[:, :3] @ Q, 1, 2)
        sg[:, :3, :inner] += plain[:, :3, :params] @ B
        for i in range(3):
            ss[:, i, i] += plain_square[:, i]
            sg[:, i, inner:] += np.where(biased == i, plain_square[:, i : i + 1], 0.0)
        s[:, :3] += plain_right[:, :3]
        end_s, end_g = last @ Q, np.zeros((count, MOTION, k + m))
        end_s[:, range(3), range(3)] += 1.0
        end_g[:, :, :inner] = last[:, :, :params] @ B
        return Piece(ss, sg, s, gg, g, end, end_s, end_g, left)

    def rows(self, tangent: Array, weight: Array) -> tuple[Array, Array]:
        """Whitened slopes of all measurements: to the states (w, n, C, 15) and to g (w, n, C, G).

        tangent (w, n, C, D), weight (w, n, C) : as for the products.
        """
        e, biased = self.engine, self.engine.windows.biased
        B = self._parameters()
        s = tangent @ self._angles()[:, None]
        for i in range(3):
            s[:, :, i, i] += weight[:, :, i]
        g = np.zeros((*tangent.shape[:3], B.shape[1] + len(biased)))
        g[..., : B.shape[1]] = tangent[..., : e.params] @ B
        for i, place in enumerate(biased):
            g[:, :, place, B.shape[1] + i] = weight[:, :, place]
        return s, g

    def _parameters(self) -> Array:
        """Change (P, k + 4) of the engine's parameters per unit of z, of the thrust's factor and of the current."""
        e, k = self.engine, self.columns.shape[1]
        B = np.zeros((e.params, k + len(SHARED)))
        B[: len(e.names), :k] = self.columns
        B[len(e.names) :, k:] = np.diag([e.windows.drive.thrust, 1.0, 1.0, 1.0])
        return B

    def _angles(self) -> Array:
        """Change (w, D, 15) of the engine's directions per state of a window."""
        e, s = self.engine, self.point.states[self.span]
        out = np.zeros((len(s), len(e.direction), len(STATES)))
        out[:, e.params : e.params + 4, 3:6] = quaternion_slopes(s[:, 3:6])
        for i in range(6):
            out[:, e.params + 4 + i, 6 + i] = 1.0
        for i in range(3):
            out[:, len(e.names) + 1 + i, MOTION + i] = 1.0
        return out


def quaternion_slopes(angles: Array) -> Array:
    """Slopes (N, 4, 3) of the unit quaternion to phi, theta, psi (N, 3) [rad].

    Source     fossen2021, ch. 2: ``towtank.model.kinematics.quaternion_of``, differentiated.
    """
    half = 0.5 * angles
    (sf, st, sp), (cf, ct, cp) = np.sin(half).T, np.cos(half).T
    rows = [
        [-sf * ct * cp + cf * st * sp, -cf * st * cp + sf * ct * sp, -cf * ct * sp + sf * st * cp],
        [cf * ct * cp + sf * st * sp, -sf * st * cp - cf * ct * sp, -sf * ct * sp - cf * st * cp],
        [-sf * st * cp + cf * ct * sp, cf * ct * cp - sf * st * sp, -cf * st * sp + sf * ct * cp],
        [-sf * ct * sp - cf * st * cp, -cf * st * sp - sf * ct * cp, cf * ct * cp + sf * st * sp],
    ]
    return 0.5 * np.moveaxis(np.array(rows), -1, 0)


def wrapped(angle: Array) -> Array:
    """``angle`` within half a turn of 0 [rad]."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)
