"""Six degrees of freedom and trials for equations that others published: an oracle, nothing of the package.

State (14,): u v w p q r, x y z (north, east, down), phi theta psi, rudder, stern plane. SI and radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

PSI, RUDDER, PLANE = 11, 12, 13


@dataclass(frozen=True)
class Motion:
    """acceleration(nu, phi, theta, dr, ds) -> (6,) of a vehicle; lag [s] and limit [rad] of its rudder and planes."""

    acceleration: Callable
    lag: float
    limit: float

    def rates(self, s, order):
        """Rates (14,) under the orders (rudder, stern plane)."""
        phi, theta, psi = s[9:12].tolist()
        dr, ds = np.clip(s[12:], -self.limit, self.limit).tolist()
        nudot = self.acceleration(s[:6].tolist(), phi, theta, dr, ds)
        turn, trim = axes(phi, theta, psi)
        return np.concatenate([nudot, turn @ s[:3], trim @ s[3:6], (np.asarray(order) - s[12:]) / self.lag])

    def held(self, law, seconds, start, step=0.1, hold=0.5):
        """Rows (N, 14) every ``hold`` s: RK4 with the orders of ``law(t, state)`` held."""
        rows = [np.asarray(start, dtype=float)]
        for i in range(round(seconds / hold)):
            s, order = rows[-1], law(i * hold, rows[-1])
            for _ in range(round(hold / step)):
                k1 = self.rates(s, order)
                k2 = self.rates(s + 0.5 * step * k1, order)
                k3 = self.rates(s + 0.5 * step * k2, order)
                s = s + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + self.rates(s + step * k3, order))
            rows.append(s)
        return np.array(rows)

    def leg(self, s, order, seconds, place=None, level=0.0, size=False):
        """Dense solution to the first passage of entry ``place`` (its ``size``) through ``level``, or to the end."""

        def passed(_, y):
            return (abs(y[place]) if size else y[place]) - level

        passed.terminal = True
        out = solve_ivp(
            lambda _, y: self.rates(y, order), (0.0, seconds), s, events=None if place is None else passed,
            method="DOP853", rtol=1e-9, atol=1e-10, dense_output=True,
        )  # fmt: skip
        assert out.success
        assert place is None or out.status == 1, "the level was not reached"
        return out

    def turning_circle(self, speed, rudder, longest=400.0):
        """Indices of the turn with ``rudder`` held from straight flight; means over the last quarter of 540 deg."""
        s, time, at = straight(speed), 0.0, {}
        for turn in (90, 180, 450, 540):
            out = self.leg(s, (rudder, 0.0), longest, PSI, math.radians(turn), size=True)
            s, time = out.y[:, -1], time + out.t[-1]
            at[turn] = (time, s)
        side = math.copysign(1.0, s[PSI])
        fine = np.linspace(0.0, out.t[-1], 2001)
        y = out.sol(fine)

        def mean(values):
            return float(np.trapezoid(values, fine) / out.t[-1])

        return {
            "advance": at[90][1][6],
            "transfer": side * at[90][1][7],
            "tactical_diameter": side * at[180][1][7],
            "time_to_90": at[90][0],
            "yaw_rate": (at[540][1][PSI] - at[450][1][PSI]) / (at[540][0] - at[450][0]),
            "drift_angle": mean(np.arctan2(-y[1], y[0])),
            "speed": mean(np.sqrt((y[:3] ** 2).sum(axis=0))),
            "roll_in_turn": mean(y[9]),
            "depth_change": s[8],
        }

    def zigzag(self, speed, rudder, execute, longest=400.0):
        """Indices of the zigzag; ``rudder`` is that of the first execute, ``execute`` positive."""
        s, time, side = straight(speed), 0.0, -math.copysign(1.0, rudder)
        swings, overshoots, reach = [], [], 0.0
        for _ in range(4):
            out = self.leg(s, (rudder, 0.0), longest, PSI, side * execute)
            s, time = out.y[:, -1], time + out.t[-1]
            swings.append(time)
            rudder = -rudder
            out = self.leg(s, (rudder, 0.0), longest, PSI, 0.0)
            fine = np.linspace(0.0, out.t[-1], 4001)
            overshoots.append((side * out.sol(fine)[PSI]).max() - execute)
            s, time, side = out.y[:, -1], time + out.t[-1], -side
            reach = reach or time
        return {
            "initial_turning_time": swings[0],
            "first_overshoot": overshoots[0],
            "second_overshoot": overshoots[1],
            "reach": reach,
            "period": swings[3] - swings[1],
        }


def straight(speed):
    """Level and straight at ``speed`` on a northerly course, fins amidships."""
    s = np.zeros(14)
    s[0] = speed
    return s


def axes(phi, theta, psi):
    """Body to north-east-down (3, 3), and body rates to rates of phi, theta, psi (3, 3)."""
    (sf, cf), (st, ct), (sp, cp) = ((math.sin(a), math.cos(a)) for a in (phi, theta, psi))
    turn = [
        [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
        [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
        [-st, ct * sf, ct * cf],
    ]
    return np.array(turn), np.array([[1.0, sf * st / ct, cf * st / ct], [0.0, cf, -sf], [0.0, sf / ct, cf / ct]])
