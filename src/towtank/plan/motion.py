"""Motions of captive tests in closed form: position, attitude, body velocities and accelerations.

Finite angles throughout. Positions are those of the body origin in NED; accelerations are time derivatives of the
body-axis velocities. The oscillations start at the mid-point of their path, moving in the positive direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from towtank.errors import PlanError
from towtank.frames import Array
from towtank.plan.history import History
from towtank.plan.kinds import CaptiveTest


def _history(time: Array, **columns: Array | float) -> History:
    """History with the named columns filled and zeros elsewhere.

    Names: x y z, phi theta psi, u v w p q r, udot ... rdot.
    """
    groups = (("x", "y", "z"), ("phi", "theta", "psi"), tuple("uvwpqr"), tuple(f"{rate}dot" for rate in "uvwpqr"))
    time = np.asarray(time, dtype=float)
    arrays = []
    for names in groups:
        array = np.zeros((len(time), len(names)))
        for i, name in enumerate(names):
            array[:, i] = columns.get(name, 0.0)
        arrays.append(array)
    return History(time, *arrays)


@dataclass(frozen=True)
class SteadyMotion:
    """A condition held: nothing changes in body axes. ``speed`` [m/s] is the resultant speed."""

    speed: float

    kind = "steady"

    def __post_init__(self) -> None:
        _refuse_impossible(self)

    @property
    def period(self) -> float:
        """Zero: a steady motion has no period."""
        return 0.0


@dataclass(frozen=True)
class Drift(SteadyMotion):
    """Straight path at the drift angle ``angle`` [rad] = atan2(-v, u), positive with the bow to starboard.

    Source     sname1950; perron, section 2.1 (beta).
    """

    angle: float = 0.0

    kind = "drift"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        U, beta = self.speed, self.angle
        return _history(time, x=U * time, psi=beta, u=U * math.cos(beta), v=-U * math.sin(beta))


@dataclass(frozen=True)
class Incidence(SteadyMotion):
    """Straight path at the incidence ``angle`` [rad] = atan2(w, u), positive with the bow up.

    Source     sname1950; perron, section 2.1 (alpha).
    """

    angle: float = 0.0

    kind = "incidence"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        U, alpha = self.speed, self.angle
        return _history(time, x=U * time, theta=alpha, u=U * math.cos(alpha), w=U * math.sin(alpha))


@dataclass(frozen=True)
class Turn(SteadyMotion):
    """Circular path of a rotating arm: yaw rate ``rate`` [rad/s] and drift angle ``drift`` [rad] held.

    The radius is speed / rate; a rate of zero is the straight path.
    """

    rate: float = 0.0
    drift: float = 0.0

    kind = "turn"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        U, r, beta = self.speed, self.rate, self.drift
        course = r * np.asarray(time, dtype=float)
        half = np.sinc(0.5 * course / np.pi)
        return _history(
            time,
            x=U * time * np.sinc(course / np.pi),
            y=U * time * np.sin(0.5 * course) * half,
            psi=course + beta,
            u=U * math.cos(beta),
            v=-U * math.sin(beta),
            r=r,
        )


@dataclass(frozen=True)
class Oscillation:
    """A sinusoid of ``amplitude`` [m, or rad in roll] and circular ``frequency`` [rad/s] on a towed path.

    ``speed`` [m/s] is the carriage speed.
    """

    speed: float
    amplitude: float
    frequency: float

    kind = "oscillation"

    def __post_init__(self) -> None:
        _refuse_impossible(self)
        if self.frequency <= 0.0:
            raise PlanError(
                f"{self.kind}: frequency {self.frequency:g} rad/s is not positive. An oscillation needs a period; "
                "give a positive frequency, or use a steady test."
            )

    @property
    def period(self) -> float:
        """Period [s]."""
        return 2.0 * math.pi / self.frequency

    def _wave(self, time: Array) -> tuple[Array, Array, Array, Array]:
        """The sinusoid a sin(w t) and its first three time derivatives."""
        a, w = self.amplitude, self.frequency
        s, c = np.sin(w * np.asarray(time, dtype=float)), np.cos(w * np.asarray(time, dtype=float))
        return a * s, a * w * c, -a * w * w * s, -a * w**3 * c


@dataclass(frozen=True)
class Surge(Oscillation):
    """Pure surge: x = U t + a sin wt, so u = U + a w cos wt.

    Source     fossen2021; the amplitude of u in perron's practice is a w.
    """

    kind = "surge"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        s, sdot, sddot, _ = self._wave(time)
        return _history(time, x=self.speed * time + s, u=self.speed + sdot, udot=sddot)


@dataclass(frozen=True)
class Sway(Oscillation):
    """Pure sway: y = a sin wt with the heading along the carriage.

    Source     perron, section 3.6 (VPMM sway); ittc75020602.
    """

    kind = "sway"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        y, ydot, yddot, _ = self._wave(time)
        return _history(time, x=self.speed * time, y=y, u=self.speed, v=ydot, vdot=yddot)


@dataclass(frozen=True)
class Heave(Oscillation):
    """Pure heave: z = a sin wt with level trim.

    Source     perron, section 3.6 (VPMM heave); ittc75020602.
    """

    kind = "heave"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        z, zdot, zddot, _ = self._wave(time)
        return _history(time, x=self.speed * time, z=z, u=self.speed, w=zdot, wdot=zddot)


@dataclass(frozen=True)
class Yaw(Oscillation):
    """Pure yaw: path y = a sin wt with the heading along the path, psi = atan(ydot / U), so v = 0 exactly.

    Source     perron, section 3.6 (VPMM yaw); ittc75020602.
    Departure  psi, u = U / cos psi and r are taken at finite angle, not as small-angle sinusoids.
    """

    kind = "yaw"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        y, *rates = self._wave(time)
        psi, u, r, udot, rdot = _tangent(self.speed, *rates)
        return _history(time, x=self.speed * time, y=y, psi=psi, u=u, r=r, udot=udot, rdot=rdot)


@dataclass(frozen=True)
class Pitch(Oscillation):
    """Pure pitch: path z = a sin wt with the axis along the path, theta = -atan(zdot / U), so w = 0 exactly.

    Source     perron, section 3.6 (VPMM pitch); ittc75020602.
    Departure  theta, u = U / cos theta and q are taken at finite angle, not as small-angle sinusoids.
    """

    kind = "pitch"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        z, *rates = self._wave(time)
        slope, u, q, udot, qdot = _tangent(self.speed, *rates)
        return _history(time, x=self.speed * time, z=z, theta=-slope, u=u, q=-q, udot=udot, qdot=-qdot)


@dataclass(frozen=True)
class Roll(Oscillation):
    """Pure roll: phi = a sin wt about the x axis through the body origin; ``amplitude`` in rad.

    Source     perron, section 3.6 (VPMM roll).
    """

    kind = "roll"

    def history(self, time: Array) -> History:
        """Sample at ``time`` (N,) [s]."""
        phi, p, pdot, _ = self._wave(time)
        return _history(time, x=self.speed * time, phi=phi, u=self.speed, p=p, pdot=pdot)


KINDS: dict[str, type[SteadyMotion] | type[Oscillation]] = {
    motion.kind: motion for motion in (Drift, Incidence, Turn, Sway, Yaw, Heave, Pitch, Roll, Surge)
}
"""Kind -> class of the motion."""


def _tangent(U: float, ydot: Array, yddot: Array, ydddot: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Slope angle, speed along the path, rate of turn, and the time derivatives of the last two.

    The path has carriage speed ``U`` and transverse velocity ``ydot``; angle = atan(ydot / U).
    """
    square = U * U + ydot * ydot
    speed = np.sqrt(square)
    turn = U * yddot / square
    return (
        np.arctan2(ydot, U),
        speed,
        turn,
        ydot * yddot / speed,
        U * ydddot / square - 2.0 * turn * ydot * yddot / square,
    )


def sample_times(test: CaptiveTest) -> Array:
    """Times [s] at which a captive test is recorded.

    A steady test has 2 samples one second apart; an oscillation has ``periods * samples + 1``, both ends included.
    """
    if test.motion.period == 0.0:
        return np.array([0.0, 1.0])
    return np.asarray(np.arange(test.periods * test.samples + 1) * (test.motion.period / test.samples))


def sampled(test: CaptiveTest) -> History:
    """The motion of a captive test at its ``sample_times``."""
    return test.motion.history(sample_times(test))


def _refuse_impossible(motion: SteadyMotion | Oscillation) -> None:
    for item in fields(motion):
        value = getattr(motion, item.name)
        if not math.isfinite(value):
            raise PlanError(f"{motion.kind}: {item.name} is {value}. Give a finite number.")
    if motion.speed <= 0.0:
        raise PlanError(
            f"{motion.kind}: speed {motion.speed:g} m/s is not positive. Coefficients are referred to the speed ahead; "
            "give a positive speed."
        )
