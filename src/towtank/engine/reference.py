"""The loop on numpy: the same text as ``c/loop.c``, for machines without a library and as a check on it.

One trajectory runs on floats; several run side by side as arrays (N,).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.engine.form import Form, System, system
from towtank.engine.loop import SEEN, channels, command, dynamics, observe, observed, states
from towtank.engine.noise import normal
from towtank.engine.plan import Ended, Stat
from towtank.engine.run import Arrays
from towtank.frames import Array
from towtank.model.algebra import MATH, NUMPY, Ops
from towtank.pilot.law import Seen, wrapped
from towtank.pilot.orders import ORDERS
from towtank.progress import Progress

EPS, SEARCH = 1e-9, 12
BY_EVENT, BY_TIME = 1.0, 2.0
HEAD = 5
THROTTLE = ORDERS.index("throttle")
TO, SHARE = (0.5, 0.5, 1.0, 0.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)


def run_numpy(form: Form, arrays: Arrays, progress: Progress) -> None:
    """Run every trajectory of ``arrays`` together; results are written into it."""
    lanes = _Lanes(form, arrays)
    ticks = 0
    progress.start("ticks", 0)
    try:
        # A craft gone wild overflows before it is stopped; the loop sees it by itself.
        with np.errstate(all="ignore"):
            lanes.load()
            while lanes.any(lanes.live):
                lanes.record(ticks)
                ticks += 1
                lanes.tick(arrays.clock.tick * ticks)
                if lanes.any(lanes.live):
                    lanes.sense(ticks)
                    lanes.order(lanes.live)
            lanes.record(ticks)
    except KeyboardInterrupt:
        return
    finally:
        lanes.unload()
        progress.done("ticks")


def _side(e: Array) -> Array:
    """Side of its level an event stands on (N,); round-off of the search that ended the leg before is on the level."""
    return np.asarray(np.where(np.abs(e) > EPS, np.sign(e), 0.0))


@dataclass
class _Tools:
    """Selections for floats or for arrays."""

    ops: Ops
    pick: Callable[[Any, Any, Any], Any]
    any: Callable[[Any], bool]


def _float_pick(c: float, a: float, b: float) -> float:
    return a if c else b


_FLOATS = _Tools(MATH, _float_pick, bool)
_ARRAYS = _Tools(NUMPY, lambda c, a, b: np.where(c != 0.0, a, b), lambda c: bool(np.any(c)))


class _Lanes:
    """The state of all trajectories; the methods are those of the C loop, name by name."""

    def __init__(self, form: Form, a: Arrays) -> None:
        self.a, self.count = a, a.count
        self.tools = _FLOATS if self.count == 1 else _ARRAYS
        self.any, self.pick = self.tools.any, self.tools.pick
        self.fins, names = form.fins, channels(form.fins)
        self.kept, self.psi, self.speed = observed(form.fins), names.index("psi"), names.index("speed")
        self.delta, self.travel = names.index("delta1"), names.index("fin_travel")
        p: list[Any] = list(np.repeat(a.common[:, None], self.count, axis=1))
        for place, column in zip(a.which, a.varied.T, strict=True):
            p[place] = column
        self.p: System = system(form, [self._value(x) for x in p])
        nx = len(states(form.fins))
        start = np.broadcast_to(a.start, (self.count, nx + 3)).T
        self.x = [self._value(row) for row in start[:nx]]
        self.m = [self._value(row) for row in start[nx:]]
        self.y: list[Any] = [self._value(np.zeros(self.count))] * len(names)
        self.granted, self.asked, self.rates = [0.0] * 3, [0.0] * (form.fins + 1), [0.0] * 3
        self.answered: list[Any] = [0.0] * form.fins
        self.names, self.held = names, dict[int, Any]()
        zero = self._value(np.zeros(self.count))
        self.t, self.end, self.live = zero, zero, zero + 1.0
        self.leg = np.zeros(self.count, dtype=int)
        self.head = np.zeros((self.count, HEAD))
        self.orders = np.zeros((self.count, a.plan.shape[-1] - HEAD))
        self.side = np.zeros(self.count)
        self.stat = np.full((self.count, len(a.gauge), len(Stat)), np.nan)

    def _value(self, row: Array) -> Any:
        return float(row[0]) if self.count == 1 else np.array(row, dtype=float)

    def _row(self, value: Any) -> Array:
        return np.broadcast_to(np.asarray(value, dtype=float), (self.count,))

    def _ref(self) -> list[Any]:
        return [self._value(column) for column in self.orders.T]

    def advance(self, x: list[Any], h: Any) -> list[Any]:
        """RK4 over ``h`` with the command held."""
        dt = h * (1.0 / self.a.clock.steps)
        for _ in range(self.a.clock.steps):
            y, total = x, x
            for on, share in zip(TO, SHARE, strict=True):
                rate = dynamics(self.p, y, self.asked, self.tools.ops)
                total = [s + dt * share * k for s, k in zip(total, rate, strict=True)]
                y = [a + dt * on * k for a, k in zip(x, rate, strict=True)]
            x = total
        return x

    def moved(self, x: list[Any], before: list[Any], h: Any) -> tuple[list[Any], list[Any]]:
        """State and channels after ``h``; NaN where floats refuse a motion that is no longer finite."""
        try:
            x = self.advance(x, h)
            return x, self.look(x, before)
        except (ValueError, OverflowError, ZeroDivisionError):
            return [math.nan] * len(x), [math.nan] * len(before)

    def look(self, x: list[Any], before: list[Any]) -> list[Any]:
        """Channels of ``x``; heading unwrapped from and fin travel added to those ``before``."""
        y = [*observe(self.p, x, self.ref, self.tools.ops), *before[self.kept :]]
        y[self.psi] = before[self.psi] + wrapped(y[self.psi] - before[self.psi], self.tools.ops)
        swept = sum(abs(y[self.delta + i] - before[self.delta + i]) for i in range(self.fins))
        y[self.travel] = before[self.travel] + swept * self.p.fin_share
        return y

    def keep(self, y: list[Any]) -> list[Any]:
        """``y`` with the command and the memory in their channels."""
        k = self.kept
        return [*y[:k], *self.granted, y[k + 3], *self.m, *y[k + 7 :]]

    def order(self, c: Any) -> None:
        """New command for the lanes in ``c``."""
        seen = list(self.y)
        for channel, value in self.held.items():
            seen[channel] = value
        s = command(self.p, seen, self.m, self.ref, self.tools.ops)
        asked = [*self.played(s.fins, c), self.ref[THROTTLE]]
        self.granted = [self.pick(c, a, b) for a, b in zip(s.granted, self.granted, strict=True)]
        self.asked = [self.pick(c, a, b) for a, b in zip(asked, self.asked, strict=True)]
        self.rates = [self.pick(c, a, b) for a, b in zip(s.memory_rates, self.rates, strict=True)]
        self.y[self.kept + 3] = self.pick(c, s.heading, self.y[self.kept + 3])
        self.y = [self.pick(c, a, b) for a, b in zip(self.keep(self.y), self.y, strict=True)]

    def sense(self, n: int) -> None:
        """The readings that are due in tick ``n``."""
        for sensor, (name, (every, std, bias)) in enumerate(zip(Seen._fields, self.a.sensors, strict=False)):
            if (every, std, bias) == (1.0, 0.0, 0.0) or n % int(every):
                continue
            channel, reading = self.names.index(SEEN.get(name, name)), n // int(every) + 1
            off = std * normal(self.a.seed, self.count, sensor, reading) + bias * normal(
                self.a.seed, self.count, sensor, 0
            )
            self.held[channel] = self._value(self._row(self.y[channel]) + off)

    def played(self, wanted: list[Any], c: Any) -> list[Any]:
        """Fin angles the actuators go for: a change below the dead band is not answered, then the play is taken up."""
        fins, ops, out = self.p.constants.fins, self.tools.ops, []
        for i, (want, band, play) in enumerate(zip(wanted, fins.dead_band, fins.backlash, strict=True)):
            still = self.answered[i]
            want = self.pick(ops.positive(ops.fabs(want - still) - band), want, still)
            self.answered[i] = self.pick(c, want, still)
            out.append(ops.fmax(want - play, ops.fmin(want + play, self.asked[i])))
        return out

    def event(self, y: list[Any]) -> Array:
        """Distance (N,) of the event channel from its level."""
        table = np.stack([self._row(v) for v in y])
        value = table[np.maximum(self.head[:, 1], 0.0).astype(int), np.arange(self.count)]
        return np.asarray(np.where(self.head[:, 2] != 0.0, np.abs(value), value) - self.head[:, 3])

    def begin(self, lane: int) -> None:
        """Begin the leg the lane stands at, or end the lane when there is none."""
        if self.leg[lane] >= self.a.plan.shape[-2]:
            self.put("live", lane, 0.0)
            return
        plan = self.a.plan if self.a.plan.ndim == 2 else self.a.plan[lane]
        row = plan[self.leg[lane]]
        self.head[lane], self.orders[lane] = row[:HEAD], row[HEAD:]
        self.put("end", lane, float(self._row(self.t)[lane]) + row[0])
        self.ref = self._ref()

    def fresh(self, lane: int) -> None:
        """Gauges and the side of the event at the start of a leg."""
        self.side[lane] = _side(self.event(self.y))[lane]
        t = float(self._row(self.t)[lane])
        for g, (channel, absolute, _) in enumerate(self.a.gauge):
            v = float(self._row(self.y[int(channel)])[lane])
            v = abs(v) if absolute else v
            self.stat[lane, g] = [v, t, v, t, 0.0, 0.0, 0.0, math.nan, math.nan]

    def put(self, name: str, lane: int, value: float) -> None:
        """Set one lane of ``t``, ``end`` or ``live``."""
        row = np.array(self._row(getattr(self, name)))
        row[lane] = value
        setattr(self, name, self._value(row))

    def load(self) -> None:
        """First orders, channels and command."""
        for lane in range(self.count):
            self.begin(lane)
        before = [v * 0.0 for v in self.y]
        for i in range(self.fins):
            before[self.delta + i] = self.asked[i] = self.answered[i] = self.x[len(self.x) - self.fins + i]
        self.y = self.look(self.x, before)
        self.sense(0)
        self.order(self.live)
        for lane in range(self.count):
            self.fresh(lane)

    def finish(self, lane: int, how: float) -> None:
        """The mark and the gauges of a leg that ends."""
        leg, a = self.leg[lane], self.a
        values = [float(self._row(v)[lane]) for v in self.y]
        a.marks[lane, leg] = [float(self._row(self.t)[lane]), how, *values]
        a.stats[lane, leg] = self.stat[lane]
        self.leg[lane] += 1

    def close(self, lane: int, code: Ended) -> None:
        """End of a trajectory."""
        self.a.status[lane] = [float(code), float(self._row(self.t)[lane])]
        self.put("live", lane, 0.0)

    def measure(self, y0: list[Any], y1: list[Any], h: Any) -> None:
        """Gauges over a substep of length ``h``."""
        dt, t = self._row(h), self._row(self.t)
        moved, half, end = dt > 0.0, 0.5 * dt, t + dt
        for g, (channel, absolute, level) in enumerate(self.a.gauge):
            v0, v1 = self._row(y0[int(channel)]), self._row(y1[int(channel)])
            if absolute:
                v0, v1 = np.abs(v0), np.abs(v1)
            s = self.stat[:, g].T
            low, high = (v1 < s[Stat.LOW]) & moved, (v1 > s[Stat.HIGH]) & moved
            s[Stat.LOW], s[Stat.LOW_TIME] = np.where(low, v1, s[Stat.LOW]), np.where(low, end, s[Stat.LOW_TIME])
            s[Stat.HIGH], s[Stat.HIGH_TIME] = np.where(high, v1, s[Stat.HIGH]), np.where(high, end, s[Stat.HIGH_TIME])
            s[Stat.INTEGRAL] += half * (v0 + v1)
            s[Stat.SQUARE] += half * (v0 * v0 + v1 * v1)
            e0, e1 = v0 - level, v1 - level
            over, under = e0 > 0.0, e1 > 0.0
            s[Stat.ABOVE] += half * (over.astype(float) + under)
            crossed = (over != under) & moved
            when = t + dt * (e0 / np.where(e0 == e1, 1.0, e0 - e1))
            s[Stat.FIRST] = np.where(crossed & np.isnan(s[Stat.FIRST]), when, s[Stat.FIRST])
            s[Stat.LAST] = np.where(crossed, when, s[Stat.LAST])

    def land(
        self, x0: list[Any], y0: list[Any], h: Any, c: Any, e0: Array, e1: Array
    ) -> tuple[list[Any], list[Any], Any]:
        """Shorten ``h`` of the lanes in ``c`` to their event: regula falsi (Illinois) on whole integrations."""
        triggered, whole = self._row(c) != 0.0, self._row(h)
        low, high, at_low, at_high, last = np.zeros(self.count), whole, e0, e1, np.zeros(self.count)
        x, y, tau = x0, y0, h
        for _ in range(SEARCH):
            span = at_high - at_low
            step = np.where(triggered, high - at_high * (high - low) / np.where(span == 0.0, 1.0, span), whole)
            tau = self._value(step)
            x, y = self.moved(x0, y0, tau)
            e = self.event(y)
            if not np.any(triggered & (np.abs(e) > 1e-12)):
                break
            same = e * at_high >= 0.0
            was = last == np.where(same, 1.0, -1.0)
            at_low = np.where(same & was, 0.5 * at_low, np.where(same, at_low, e))
            at_high = np.where(~same & was, 0.5 * at_high, np.where(same, e, at_high))
            high, low = np.where(same, step, high), np.where(same, low, step)
            last = np.where(same, 1.0, -1.0)
        return x, y, tau

    def turn_over(self, c: Any) -> None:
        """Lanes at the end of a leg: mark, next leg, new command."""
        changed = np.zeros(self.count)
        live, t, end = self._row(self.live), self._row(self.t), self._row(self.end)
        for lane in np.flatnonzero((live != 0.0) & ((self._row(c) != 0.0) | (t >= end - EPS))).tolist():
            by_event = bool(self._row(c)[lane])
            required = self.head[lane, 4] != 0.0
            self.finish(lane, BY_EVENT if by_event else BY_TIME)
            if not by_event and required:
                self.close(lane, Ended.LATE)
                continue
            self.begin(lane)
            if self._row(self.live)[lane] == 0.0:
                self.close(lane, Ended.DONE)
                continue
            changed[lane] = 1.0
        if changed.any():
            mask = self._value(changed)
            y = self.look(self.x, self.y)
            self.y = [self.pick(mask, a, b) for a, b in zip(y, self.y, strict=True)]
            self.order(mask)
            for lane in np.flatnonzero(changed).tolist():
                self.fresh(lane)

    def tick(self, until: float) -> None:
        """All lanes to the time ``until``."""
        ops, pick = self.tools.ops, self.pick
        while True:
            h = ops.fmax(ops.fmin(self.end, until) - self.t, 0.0) * self.live
            x0, y0 = self.x, self.y
            x1, y1 = self.moved(x0, y0, h)
            c = self.live * 0.0
            if np.any(self.head[:, 1] >= 0.0):
                e0, e1 = self.event(y0), self.event(y1)
                watched = (self.head[:, 1] >= 0.0) & (self._row(h) > 0.0)
                hit = watched & (e1 * self.side < 0.0)
                c = self._value(hit.astype(float))
                if hit.any():
                    x1, y1, h = self.land(x0, y0, h, c, e0, e1)
                self.side = np.where((self.side == 0.0) & watched, _side(e1), self.side)
            self.x = x1
            y1, h, c = self._lost(x0, y0, y1, h, c)
            self.m = [m + h * rate for m, rate in zip(self.m, self.rates, strict=True)]
            y1 = self.keep(y1)
            y1[self.kept + 3] = y0[self.kept + 3]
            if len(self.a.gauge):
                self.measure(y0, y1, h)
            self.t = self.t + h
            self.y = y1
            ended = pick(c, 1.0, ops.positive(self.t - self.end + EPS)) * self.live
            if self.any(ended):
                self.turn_over(c)
            if not self.any(self.live * ops.positive(until - EPS - self.t)):
                return

    def _lost(self, x0: list[Any], y0: list[Any], y1: list[Any], h: Any, c: Any) -> tuple[list[Any], Any, Any]:
        """Put lanes that are no longer finite, or too fast, back to where they still were, and close them."""
        speed, psi, z = (self._row(y1[i]) for i in (self.speed, self.psi, 2))
        sound = (speed < self.a.fastest) & ~np.isnan(psi) & ~np.isnan(z)
        lost = ~sound & (self._row(self.live) != 0.0)
        if not lost.any():
            return y1, h, c
        for lane in np.flatnonzero(lost).tolist():
            self.close(lane, Ended.TOO_FAST if self.a.fastest[lane] <= speed[lane] < 1e300 else Ended.NOT_FINITE)
        mask = self._value(lost.astype(float))
        self.x = [self.pick(mask, a, b) for a, b in zip(x0, self.x, strict=True)]
        y1 = [self.pick(mask, a, b) for a, b in zip(y0, y1, strict=True)]
        return y1, self.pick(mask, h * 0.0, h), self.pick(mask, c * 0.0, c)

    def record(self, n: int) -> None:
        """Sample ``n`` of the lanes that are at its time."""
        sample = n // self.a.every
        if n % self.a.every or sample >= self.a.log.shape[1]:
            return
        here = self._row(self.t) >= self.a.clock.tick * n - EPS
        values = np.stack([self._row(self.y[i]) for i in self.a.channel], axis=-1)
        self.a.log[here, sample] = values[here]

    def unload(self) -> None:
        """Last state and memory."""
        done = self.a.status[:, 0] != Ended.STOPPED
        self.a.end[done] = np.stack([self._row(v) for v in (*self.x, *self.m)], axis=-1)[done]
