"""The test matrix of the source, scaled to a craft and a speed."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import PlanError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest, Motion, Plan
from towtank.plan.limits import FIN_WARNING, enforce_plan
from towtank.plan.motion import Drift, Heave, Incidence, Pitch, Roll, Surge, Sway, Turn, Yaw
from towtank.quantity import Quantity, si

FREQUENCIES: Mapping[str, tuple[float, ...]] = {
    "sway": (0.75, 1.25, 2.0), "heave": (0.75, 1.25, 2.0), "yaw": (1.0, 1.75, 3.0), "pitch": (1.0, 1.75, 3.0),
    "roll": (1.0, 2.0, 4.0), "surge": (0.75, 1.5, 3.0),
}  # fmt: skip
"""Frequencies w' = w L / U of each oscillation. Within the limits of ``plan.limits``; a cycle is 1.6 to 8 lengths."""

AMPLITUDES: Mapping[str, tuple[float, ...]] = {
    "sway": (0.12, 0.28), "heave": (0.12, 0.28), "yaw": (0.20, 0.45), "pitch": (0.20, 0.45),
    "roll": (math.radians(10.0), math.radians(20.0)), "surge": (0.10, 0.20),
}  # fmt: skip
"""Amplitudes: peak v/U (sway, heave), r L/U (yaw, pitch) and u/U (surge), and the roll angle [rad].

Two of each, because the linear and the quadratic damping of one amplitude cannot be told apart by the first harmonic.
"""

DRIFT_DEG = (0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20)
TURN_RATES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
TURN_WITH_DRIFT = ((0.2, 10), (0.2, -6), (0.4, 8), (0.4, -8))
"""r' and drift [deg] of the turns with drift: both signs of v r, which separates Xvr from Xvv and Xrr, at two turns and
several ratios of the two, which determine the mixed terms of third order. The stern stays within 20 deg."""

SINGLE_FIN_DEG = (10, 20, 30, 40)
VIRTUAL_FIN_DEG = (-10, -5, 5, 10, 15, 20, 25, 30, 35, 40)


def standard_plan(
    craft: Craft,
    speed: Quantity | None = None,
    *,
    frequencies: Mapping[str, Sequence[float]] | None = None,
    amplitudes: Mapping[str, Sequence[float]] | None = None,
    periods: int = 3,
    samples: int = 64,
) -> Plan:
    """Captive tests that determine every term of the model.

    Steady drift (and incidence) to 20 deg both ways, oscillations at several frequencies and amplitudes, steady
    turns, and deflected fins to 40 deg. A craft with 4-fold symmetry has one heave and one pitch run as a check of
    its ties; others have the full vertical plane.

    Parameters
    ----------
    craft : the craft.
    speed : reference speed [m/s] or text with a unit, ``"2 kn"``; the craft's own by default.
    frequencies, amplitudes : kind -> values that replace ``FREQUENCIES[kind]``, ``AMPLITUDES[kind]``.
    periods, samples : number of periods of an oscillation and samples in each.

    Raises
    ------
    PlanError
        An unknown kind, or a run that passes a limit of the method.

    Source     perron, section 2.3 (which tests), 3.5 (three periods, the last two analysed).
    Departure  The source prints no frequencies, amplitudes or turn rates; these keep w' and r' within ittc75020602 and
               the practice of roddy1990. Steady turns are added: they give the rotary derivatives at zero frequency.
    """
    U = craft.speed if speed is None else si(speed, "m/s", "speed")
    w, a = _merged(FREQUENCIES, frequencies, "frequencies"), _merged(AMPLITUDES, amplitudes, "amplitudes")
    fourfold = craft.symmetry == "fourfold"
    tests = (
        *_angles(craft, U, fourfold),
        *_oscillations(craft, U, fourfold, w, a, (periods, samples)),
        *_turns(craft, U),
        *_deflections(craft, U),
    )
    plan = Plan(craft, U, tests)
    notes = [
        f"{test.name}: {note}"
        for test, violence in zip(tests, enforce_plan(plan), strict=True)
        for note in violence.warnings
        if not test.exploratory
    ]
    if fourfold:
        notes.insert(0, "4-fold symmetry: incidence left out; one heave and one pitch run check the ties.")
    else:
        notes.insert(0, "no run combines heave and pitch: Xwq is not measured.")
    if not craft.fins:
        notes.insert(0, "no fins: no deflection runs.")
    return Plan(craft, U, tests, tuple(notes))


def slug(text: str) -> str:
    """``text`` as part of a file name: lower-case letters, digits, dot, hyphen."""
    return re.sub(r"[^a-z0-9.]+", "-", text.lower()).strip("-.") or "x"


def signed(value: float, digits: str) -> str:
    """``value`` in a file name: ``p04`` and ``m04`` for plus and minus, plain at zero."""
    return ("p" if value > 0 else "m" if value < 0 else "") + format(abs(value), digits)


def _merged(
    default: Mapping[str, tuple[float, ...]], given: Mapping[str, Sequence[float]] | None, where: str
) -> dict[str, tuple[float, ...]]:
    for kind in given or {}:
        if kind not in default:
            near = difflib.get_close_matches(kind, default, n=1)
            hint = f"Did you mean {near[0]!r}?" if near else f"Kinds: {', '.join(default)}."
            raise PlanError(f"{where}: {kind!r} is not an oscillation. {hint}")
    return {**default, **{kind: tuple(values) for kind, values in (given or {}).items()}}


def _angles(craft: Craft, U: float, fourfold: bool) -> Iterator[CaptiveTest]:
    for degrees in sorted({sign * angle for angle in DRIFT_DEG for sign in (-1, 1)}):
        yield CaptiveTest(f"drift-{signed(degrees, '02d')}", U, Drift(U, math.radians(degrees)))
    for degrees in sorted({sign * angle for angle in DRIFT_DEG if angle and not fourfold for sign in (-1, 1)}):
        yield CaptiveTest(f"incidence-{signed(degrees, '02d')}", U, Incidence(U, math.radians(degrees)))


def _oscillations(
    craft: Craft,
    U: float,
    fourfold: bool,
    frequencies: Mapping[str, Sequence[float]],
    amplitudes: Mapping[str, Sequence[float]],
    recorded: tuple[int, int],
) -> Iterator[CaptiveTest]:
    for kind in FREQUENCIES:
        pairs = list(itertools.product(amplitudes[kind], frequencies[kind]))
        if fourfold and kind in ("heave", "pitch"):
            pairs = [(amplitudes[kind][-1], frequencies[kind][len(frequencies[kind]) // 2])]
        for amplitude, frequency in pairs:
            motion, name = _oscillation(kind, amplitude, frequency, craft, U)
            yield CaptiveTest(name, U, motion, periods=recorded[0], samples=recorded[1])


def _oscillation(kind: str, amplitude: float, frequency: float, craft: Craft, U: float) -> tuple[Motion, str]:
    """The oscillation whose primed amplitude and frequency are given, and its name."""
    L, w = craft.length, frequency * U / craft.length
    tail = f"w{frequency:.3g}"
    match kind:
        case "sway" | "heave":
            make = Sway if kind == "sway" else Heave
            return make(U, amplitude * U / w, w), f"{kind}-v{amplitude:.3g}-{tail}"
        case "yaw" | "pitch":
            turner = Yaw if kind == "yaw" else Pitch
            return turner(U, amplitude * U / L * U / w**2, w), f"{kind}-r{amplitude:.3g}-{tail}"
        case "surge":
            return Surge(U, amplitude * U / w, w), f"surge-u{amplitude:.3g}-{tail}"
        case _:
            return Roll(U, amplitude, w), f"roll-a{math.degrees(amplitude):.3g}-{tail}"


def _turns(craft: Craft, U: float) -> Iterator[CaptiveTest]:
    cases = [(rate, 0) for rate in TURN_RATES] + list(TURN_WITH_DRIFT)
    for rate, drift in [*cases, *((-rate, -drift) for rate, drift in cases)]:
        name = f"turn-{signed(rate, '.2f')}" + (f"-drift-{signed(drift, '02d')}" if drift else "")
        yield CaptiveTest(name, U, Turn(U, rate * U / craft.length, math.radians(drift)))


def _deflections(craft: Craft, U: float) -> Iterator[CaptiveTest]:
    """Single fins, then the virtual rudder, elevator and aileron, whose largest fin angle is the one named.

    A virtual control without effect (a column of zeros in the mixing) has no runs.
    """

    def test(name: str, degrees: int, column: Array) -> CaptiveTest:
        # Rounded: a mixing matrix is exact to its last bits only, and nobody orders 10.000000000000002 deg.
        fins = tuple(math.radians(round(float(share) * degrees, 9)) for share in column)
        peak = max(abs(angle) for angle in fins)
        return CaptiveTest(
            f"{name}-{signed(degrees, '02d')}", U, Drift(U, 0.0), fins, exploratory=peak > FIN_WARNING * (1.0 + 1e-9)
        )

    for fin, column in zip(craft.fins, np.eye(len(craft.fins)), strict=True):
        yield from (test(f"fin-{slug(fin.name)}", degrees, column) for degrees in SINGLE_FIN_DEG)
    if craft.fins:
        for name, column in zip(("rudder", "elevator", "aileron"), craft.mixing.T, strict=True):
            if np.any(column):
                yield from (test(name, degrees, column) for degrees in VIRTUAL_FIN_DEG)
