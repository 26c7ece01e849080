"""Is a captive test too violent to be fitted? Checked before any solver is started."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import PlanError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest, Plan

SAMPLES_PER_PERIOD = 16
"""Least samples per period: five for each cycle of the third harmonic, which carries the cross-flow terms."""

FIN_WARNING = math.radians(20.0)
"""Fin angle [rad] above which stall is expected; runs beyond it find the stall and are not fitted."""


@dataclass(frozen=True)
class Violence:
    """How violent a captive test is, in numbers without dimension; U is the reference speed, L the length.

    v, w : max |v| / U and max |w| / U.   p, q, r : max |p|, |q|, |r| times L / U.
    cross_flow : largest tangent of the angle between the axis and the flow at the origin.
    slowing : largest loss of u in a cycle over U.   helix : max |p| times the fin-tip radius / U.
    fin : largest fin angle [rad].   frequency : w' = frequency times L / U; 0 when steady.
    cycle : lengths travelled per cycle; infinite when steady.
    warnings : limits of the fitted range that are passed, a sentence each.
    refusals : limits of the method that are passed, with the remedy.
    """

    v: float
    w: float
    p: float
    q: float
    r: float
    cross_flow: float
    slowing: float
    helix: float
    fin: float
    frequency: float
    cycle: float
    warnings: tuple[str, ...] = ()
    refusals: tuple[str, ...] = ()


class Limit(NamedTuple):
    """Values of a measure of ``Violence`` above which a run is warned of or refused, each with the reason.

    amplitude, frequency : the powers of the motion's amplitude and frequency in the measure.
    """

    measure: str
    symbol: str
    warn: float
    refuse: float
    why_warn: str
    why_refuse: str
    amplitude: int
    frequency: int


_STALL, _TURN = math.tan(math.radians(20.0)), "the stern meets a cross-flow of 17 deg from the turn alone"
_CYCLE = "the cycle is shorter than the hull, which then moves in the water it stirred a cycle before"

LIMITS = (
    Limit("cross_flow", "v/U", _STALL, 0.7, "beyond a drift of 20 deg derivatives depend on the motion",
          "the drift is beyond 35 deg, where the lee vortices shed unsteadily and derivatives mean nothing", 1, 1),
    Limit("r", "r L/U", 0.6, 1.2, _TURN, "the stern meets a cross-flow beyond 30 deg from the turn alone", 1, 2),
    Limit("q", "q L/U", 0.6, 1.2, _TURN, "the stern meets a cross-flow beyond 30 deg from the turn alone", 1, 2),
    Limit("helix", "p R/U at the fin tips", _STALL, 0.7, "the fin tips meet a flow beyond 20 deg and begin to stall",
          "the fins are stalled over most of the cycle", 1, 1),
    Limit("slowing", "loss of speed/U", 0.5, 0.95, "the resistance falls to a quarter within a cycle",
          "the flow along the hull nearly stops or reverses", 1, 1),
    Limit("frequency", "frequency L/U", math.nan, 2.0 * math.pi, "unsteady lift reaches the derivatives", _CYCLE, 0, 1),
    Limit("fin", "fin angle [rad]", FIN_WARNING, math.radians(45.0), "the fins begin to stall",
          "a stalled fin is a plate across the flow, which no fin coefficient represents", 0, 0),
)  # fmt: skip
"""Limits of the measures.

Source     perron, chapter 1 (runs of high frequency and amplitude dropped) and section 2.2 (drift to 20 deg, fins
           to 30-40 deg); roddy1990 (tables to 18 deg, fins linear to 15 deg).
Departure  The source gives no limits in numbers. Those here are the angles at which the flow at the origin, at the
           stern or at the fins leaves the range in which a load is linear plus quadratic in its cause.
Valid      Slender torpedo-like craft with stern fins, moving ahead.
"""

FREQUENCY_WARNING = {"sway": 2.0, "heave": 2.0}
"""w' of pure sway and heave above which unsteady lift reaches the derivatives; ``FREQUENCY_WARNING_ELSE`` otherwise.

Source     Practice of the field (sway below 1-2, yaw below 2-3), ascribed to ittc75020602 in THEORY section 4 and not
           checked against its text; roddy1990 (yaw and pitch run at 2.8-4.1).
"""

FREQUENCY_WARNING_ELSE = 4.0
"""w' of the other oscillations above which unsteady lift reaches the derivatives."""


def assess(test: CaptiveTest, craft: Craft) -> Violence:
    """Measure ``test`` and compare it with ``LIMITS``. A violent test is reported, not raised; see ``enforce``."""
    measured = _measure(test, craft)
    warnings: list[str] = []
    refusals: list[str] = []
    for limit in LIMITS:
        if limit.measure == "frequency":
            limit = limit._replace(warn=FREQUENCY_WARNING.get(test.kind, FREQUENCY_WARNING_ELSE))
        elif limit.measure == "cross_flow" and measured.w > measured.v:
            limit = limit._replace(symbol="w/U")
        value = getattr(measured, limit.measure)
        # 1e-9: a drift of 20 deg is inside a limit of tan 20 deg, whatever the last bit.
        if value > limit.refuse * (1.0 + 1e-9):
            refusals.append(
                f"peaks at {limit.symbol} = {value:.3g}. Above {limit.refuse:.3g} {limit.why_refuse}. "
                f"{_remedy(test, craft, limit, value)}"
            )
        elif value > limit.warn * (1.0 + 1e-9):
            warnings.append(f"{limit.symbol} = {value:.3g} is above {limit.warn:.3g}: {limit.why_warn}")
    if test.motion.period and test.periods < 2:
        warnings.append("one period only: the transient of the start cannot be dropped")
    return replace(measured, warnings=tuple(warnings), refusals=tuple(refusals))


def enforce(test: CaptiveTest, craft: Craft) -> Violence:
    """``assess``, and refuse what the method cannot represent.

    Raises
    ------
    PlanError
        The test cannot be recorded as written, or passes a limit of the method and is not exploratory.
    """
    _refuse_unrecordable(test, craft)
    violence = assess(test, craft)
    if violence.refusals and not test.exploratory:
        raise PlanError(
            f"run {test.name} ({described(test)}) {'. It also '.join(violence.refusals)}, or mark the run "
            "exploratory = true to record it without fitting."
        )
    return violence


def enforce_plan(plan: Plan) -> tuple[Violence, ...]:
    """``enforce`` every test of a plan, and that no two share a name.

    Raises
    ------
    PlanError
        Of the first test that is refused.
    """
    names: set[str] = set()
    for test in plan.tests:
        if test.name in names:
            raise PlanError(f"two runs are called {test.name}. A run is found by its name; rename one of them.")
        names.add(test.name)
    return tuple(enforce(test, plan.craft) for test in plan.tests)


def described(test: CaptiveTest) -> str:
    """Words for the motion of a test: ``amplitude 0.6 m, frequency 0.8 rad/s, speed 1 m/s``."""
    motion, parts = test.motion, []
    for name, unit in (
        ("amplitude", "m"),
        ("frequency", "rad/s"),
        ("angle", "deg"),
        ("rate", "rad/s"),
        ("drift", "deg"),
    ):
        if (value := getattr(motion, name, 0.0)) != 0.0:
            unit = "deg" if motion.kind == "roll" and name == "amplitude" else unit
            parts.append(f"{name} {math.degrees(value) if unit == 'deg' else value:.3g} {unit}")
    if any(test.fins):
        parts.append("fins " + " ".join(f"{math.degrees(angle):.3g}" for angle in test.fins) + " deg")
    return ", ".join([*parts, f"speed {test.speed:.3g} m/s"])


def _measure(test: CaptiveTest, craft: Craft) -> Violence:
    U, L, period = test.speed, craft.length, test.motion.period
    # 128 intervals: a multiple of four holds the extremes of sines and cosines exactly.
    u, v, w, p, q, r = test.motion.history(np.linspace(0.0, period, 129)).nu.T
    radius = craft.reach
    frequency = 2.0 * math.pi / period * L / U if period else 0.0

    def peak(values: Array) -> float:
        return float(np.abs(values).max())

    cross = np.hypot(v, w)
    tangent = np.divide(cross, u, out=np.where(cross > 0.0, np.inf, 0.0), where=u > 0.0)
    return Violence(
        v=peak(v) / U,
        w=peak(w) / U,
        p=peak(p) * L / U,
        q=peak(q) * L / U,
        r=peak(r) * L / U,
        cross_flow=peak(tangent),
        slowing=max(1.0 - float(u.min()) / U, 0.0) if period else 0.0,
        helix=peak(p) * radius / U,
        fin=max((abs(delta) for delta in test.fins), default=0.0),
        frequency=frequency,
        cycle=2.0 * math.pi / frequency if frequency else math.inf,
    )


def _remedy(test: CaptiveTest, craft: Craft, limit: Limit, value: float) -> str:
    """What would be allowed: ends without a full stop, because ``enforce`` goes on with the alternative."""
    motion, share = test.motion, limit.refuse / value
    if limit.measure == "fin":
        return f"Keep the fins within {math.degrees(limit.refuse):.3g} deg"
    if limit.measure == "cross_flow" and motion.period == 0.0:
        angle = "drift" if motion.kind == "turn" else "angle"
        return f"Keep the {angle} within {math.degrees(math.atan(limit.refuse)):.3g} deg"
    if motion.period == 0.0:
        return f"Keep the rate below {limit.refuse * test.speed / craft.length:.3g} rad/s"
    frequency = 2.0 * math.pi / motion.period * share ** (1.0 / max(limit.frequency, 1))
    if not limit.amplitude:
        return f"Keep the frequency below {frequency:.3g} rad/s"
    amplitude = abs(getattr(motion, "amplitude", math.nan)) * share
    size = f"{math.degrees(amplitude):.3g} deg" if motion.kind == "roll" else f"{amplitude:.3g} m"
    return f"Keep the amplitude below {size} or the frequency below {frequency:.3g} rad/s"


def _refuse_unrecordable(test: CaptiveTest, craft: Craft) -> None:
    if test.fins and len(test.fins) != len(craft.fins):
        raise PlanError(
            f"run {test.name} gives {len(test.fins)} fin angles; {craft.name} has {len(craft.fins)} fins. "
            "Give one angle for each fin, in the order of the craft file."
        )
    if not all(math.isfinite(delta) for delta in test.fins):
        raise PlanError(f"run {test.name}: a fin angle is not finite. Give finite angles.")
    if not test.speed > 0.0:
        raise PlanError(f"run {test.name}: speed {test.speed:g} m/s is not positive. Give the speed ahead.")
    if getattr(test.motion, "speed", test.speed) != test.speed:
        raise PlanError(
            f"run {test.name}: the motion's speed is not that of the test, {test.speed:g} m/s. Give one speed."
        )
    if test.motion.period and test.periods < 1:
        raise PlanError(f"run {test.name}: {test.periods} periods. Run 3: the first is dropped, two are analysed.")
    if test.motion.period and test.samples < SAMPLES_PER_PERIOD:
        raise PlanError(
            f"run {test.name}: {test.samples} samples per period. Below {SAMPLES_PER_PERIOD} the third harmonic, "
            "which carries the cross-flow terms, is not resolved. Give 64."
        )
