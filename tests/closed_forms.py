"""Closed forms of free-running trials, written without the package: oracles for its trials.

Turns count positive: a craft with gain K > 0 turns by +K delta. Speeds in m/s, angles in rad, times in s.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cosh, exp, log, pi, sqrt, tanh

import numpy as np
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq


@dataclass(frozen=True)
class Nomoto:
    """T dr/dt + r = K delta, at constant speed and without drift."""

    K: float
    T: float

    def rate(self, t, delta, r0=0.0):
        return self.K * delta + (r0 - self.K * delta) * exp(-t / self.T)

    def heading(self, t, delta, r0=0.0):
        return self.K * delta * t + (r0 - self.K * delta) * self.T * (1.0 - exp(-t / self.T))

    def until(self, heading, delta, r0=0.0, after=0.0):
        """First time after ``after`` at which the heading has changed by ``heading``; it grows from there on."""
        late = after + abs(heading / (self.K * delta)) + 3.0 * self.T + abs(r0 / (self.K * delta)) * self.T
        return brentq(lambda t: self.heading(t, delta, r0) - heading, after, late, xtol=1e-13)

    def check(self, delta, r0):
        """Time in which the opposite rudder -delta stops the rate r0."""
        return self.T * log(1.0 + r0 / (self.K * delta))

    def overshoot(self, delta, r0):
        """Heading run on in that time: T r0 - K delta T ln(1 + r0 / (K delta))."""
        return self.T * r0 - self.K * delta * self.check(delta, r0)

    def turn(self, delta, speed):
        """Indices of the turning circle; the path is the quadrature of the heading."""
        quarter, half = self.until(pi / 2.0, delta), self.until(pi, delta)

        def along(function, end):
            return speed * quad(lambda t: function(self.heading(t, delta)), 0.0, end, epsabs=1e-11)[0]

        return {
            "advance": along(np.cos, quarter),
            "transfer": along(np.sin, quarter),
            "tactical_diameter": along(np.sin, half),
            "steady_diameter": 2.0 * speed / (self.K * delta),
            "yaw_rate": self.K * delta,
            "time_to_90": quarter,
            "time_to_180": half,
        }

    def zigzag(self, delta, execute):
        """Indices of the zigzag delta/execute, execute by execute."""
        begin = self.until(execute, delta)
        rates, times, passing = [self.rate(begin, delta)], [begin], []
        for _ in range(3):
            # Mirrored after every execute: the rate that is left, the heading at +execute, the rudder against both.
            r0, check = rates[-1], self.check(delta, rates[-1])
            passing.append(self.until(-execute, -delta, r0, check))
            leg = self.until(-2.0 * execute, -delta, r0, check)
            times.append(times[-1] + leg)
            rates.append(-self.rate(leg, -delta, r0))
        return {
            "initial_turning_time": begin,
            "first_overshoot": self.overshoot(delta, rates[0]),
            "second_overshoot": self.overshoot(delta, rates[1]),
            "time_to_check_first": self.check(delta, rates[0]),
            "time_to_check_second": self.check(delta, rates[1]),
            "reach": begin + passing[0],
            "period": times[3] - times[1],
        }


@dataclass(frozen=True)
class Linear:
    """ds/dt = A s + b delta with a held order: exact by matrix exponentials, whatever the number of states.

    A (n, n), b (n,).   heading, rate : places of the angle that swings and of its rate in s.
    """

    A: np.ndarray
    b: np.ndarray
    heading: int
    rate: int

    @cached_property
    def _grown(self):
        n = len(self.b)
        grown = np.zeros((n + 1, n + 1))
        grown[:n, :n], grown[:n, n] = self.A, self.b
        return grown

    def at(self, t, s, delta):
        """State (n,) after ``t`` from the state ``s`` under the order ``delta``."""
        return (expm(self._grown * t) @ np.append(s, delta))[:-1]

    def until(self, place, level, s, delta, stride):
        """Time and state when entry ``place`` first passes ``level``; ``stride`` is shorter than any swing."""
        t, here, grown, leap = 0.0, s[place] - level, np.append(s, delta), expm(self._grown * stride)
        while True:
            grown = leap @ grown
            there = grown[place] - level
            if t > 0.0 and here * there <= 0.0:
                break
            t, here = t + stride, there
        found = brentq(lambda t: self.at(t, s, delta)[place] - level, t, t + stride, xtol=1e-13)
        return found, self.at(found, s, delta)

    def zigzag(self, delta, execute, stride):
        """Indices as of ``Nomoto.zigzag``."""
        s, time, side = np.zeros(len(self.b)), 0.0, 1.0
        swings, overshoots, checks, reach = [], [], [], []
        for i in range(4):
            part, s = self.until(self.heading, side * execute, s, side * delta, stride)
            time += part
            swings.append(time)
            if i == 3:
                break
            check, top = self.until(self.rate, 0.0, s, -side * delta, stride)
            checks.append(check)
            overshoots.append(side * top[self.heading] - execute)
            after, _ = self.until(self.heading, 0.0, top, -side * delta, stride)
            reach.append(time + check + after)
            s, time, side = top, time + check, -side
        return {
            "initial_turning_time": swings[0],
            "first_overshoot": overshoots[0],
            "second_overshoot": overshoots[1],
            "time_to_check_first": checks[0],
            "time_to_check_second": checks[1],
            "reach": reach[0],
            "period": swings[3] - swings[1],
        }


@dataclass(frozen=True)
class Cubic:
    """Steady turns c delta = a r + b r^3 of an unstable craft (a < 0 < b; c > 0): Bech's reversed spiral."""

    a: float
    b: float
    c: float

    @property
    def loop_width(self):
        """Rudder between the folds, at r = -+sqrt(-a / 3 b)."""
        return 4.0 / 3.0 * -self.a * sqrt(-self.a / (3.0 * self.b)) / self.c

    @property
    def loop_height(self):
        """Rate between the two turns with the rudder amidships."""
        return 2.0 * sqrt(-self.a / self.b)

    def turning(self, delta, side):
        """Rate of the steady turn at ``delta`` on the branch of the outermost root of that ``side`` (+1 or -1)."""
        roots = np.roots([self.b, 0.0, self.a, -self.c * delta])
        real = roots[np.abs(roots.imag) < 1e-9].real
        return side * max(side * real)


@dataclass(frozen=True)
class Surge:
    """(m - Xudot) du/dt = T + Xuu u|u|, thrust T held; k = -Xuu / (m - Xudot) [1/m]."""

    k: float

    def coasting(self, t, start):
        """Speed and distance ``t`` after the thrust is cut at the speed ``start``."""
        grown = 1.0 + start * self.k * t
        return start / grown, log(grown) / self.k

    def slowed(self, start, end):
        """Time and distance from the speed ``start`` to ``end`` without thrust."""
        return (1.0 / end - 1.0 / start) / self.k, log(start / end) / self.k

    def from_rest(self, t, final):
        """Speed and distance ``t`` after the thrust of the steady speed ``final`` is put on at rest."""
        phase = self.k * final * t
        return final * tanh(phase), log(cosh(phase)) / self.k

    def sped_up(self, share, final):
        """Time and distance from rest to ``share`` of the speed ``final``."""
        phase = 0.5 * log((1.0 + share) / (1.0 - share))
        return phase / (self.k * final), log(cosh(phase)) / self.k

    def turned_astern(self, start, final):
        """Time and distance to standstill from ``start`` under the thrust -``final``^2 put on at once.

        Source     (m - Xudot) du/dt = Xuu (final^2 + u^2): the arc tangent.
        """
        return np.arctan(start / final) / (self.k * final), 0.5 * log(1.0 + (start / final) ** 2) / self.k
