"""The captive tests that a plan may be chosen from: a fine grid over what the standard plan samples coarsely."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.limits import assess
from towtank.plan.motion import Drift, Incidence, Turn
from towtank.plan.standard import signed, standard_plan
from towtank.quantity import Quantity

FREQUENCIES: Mapping[str, tuple[float, ...]] = {
    "sway": (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0), "heave": (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0),
    "yaw": (0.75, 1.0, 1.25, 1.75, 2.25, 3.0, 4.0), "pitch": (0.75, 1.0, 1.25, 1.75, 2.25, 3.0, 4.0),
    "roll": (1.0, 2.0, 3.0, 4.0), "surge": (0.75, 1.5, 3.0),
}  # fmt: skip
"""Frequencies w' of the candidates: from a cycle of 12.6 lengths up to where ``plan.limits`` warns."""

AMPLITUDES: Mapping[str, tuple[float, ...]] = {
    "sway": (0.06, 0.12, 0.2, 0.28, 0.36), "heave": (0.06, 0.12, 0.2, 0.28, 0.36),
    "yaw": (0.1, 0.2, 0.3, 0.45, 0.6), "pitch": (0.1, 0.2, 0.3, 0.45, 0.6),
    "roll": tuple(math.radians(a) for a in (5.0, 10.0, 15.0, 20.0)), "surge": (0.05, 0.1, 0.2, 0.3),
}  # fmt: skip
"""Amplitudes of the candidates, as in ``plan.standard.AMPLITUDES``, up to where ``plan.limits`` warns."""

ANGLES_DEG = tuple(range(1, 21))
"""Drift and incidence, both signs."""

TURN_RATES = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)
"""r' of the turns without drift, both signs."""

MIXED_RATES, MIXED_DRIFT_DEG = (0.15, 0.3, 0.45, 0.6), (3, 6, 9, 12)
"""r' and drift of the turns with drift, all four signs."""

FIN_DEG = tuple(range(4, 21, 2))
"""Largest fin angle of a virtual rudder, elevator or aileron, both signs."""


def candidates(craft: Craft, speed: Quantity | None = None, *, violent: bool = False) -> Plan:
    """Captive tests to choose from: those of the standard plan that are fitted, and a finer grid around them.

    Parameters
    ----------
    craft, speed : as in ``plan.standard.standard_plan``.
    violent : keep the tests that ``plan.limits`` warns of; those it refuses are never kept.

    Returns
    -------
    A plan of about 290 tests of a craft with 4-fold symmetry, 400 of others. Each is named as in the standard plan.

    Raises
    ------
    PlanError
        The speed cannot be used.
    """
    base = standard_plan(craft, speed, frequencies=FREQUENCIES, amplitudes=AMPLITUDES)
    tests = {test.name: test for test in base.tests if not test.exploratory}
    tests |= {test.name: test for test in standard_plan(craft, speed).tests if not test.exploratory}
    for test in (*_steady(craft, base.speed), *_fins(craft, base.speed)):
        tests.setdefault(test.name, test)
    kept = []
    for test in tests.values():
        size = assess(test, craft)
        if not size.refusals and (violent or not size.warnings):
            kept.append(test)
    return Plan(craft, base.speed, tuple(kept))


def standard_within(pool: Plan, speed: Quantity | None = None) -> list[int]:
    """Numbers in ``pool`` of the tests of the standard plan that are fitted and that ``pool`` holds."""
    names = {test.name for test in standard_plan(pool.craft, speed).tests if not test.exploratory}
    return [i for i, test in enumerate(pool.tests) if test.name in names]


def _steady(craft: Craft, U: float) -> Iterator[CaptiveTest]:
    both = (1, -1)
    for degrees in (sign * angle for angle in ANGLES_DEG for sign in both):
        yield CaptiveTest(f"drift-{signed(degrees, '02d')}", U, Drift(U, math.radians(degrees)))
        if craft.symmetry != "fourfold":
            yield CaptiveTest(f"incidence-{signed(degrees, '02d')}", U, Incidence(U, math.radians(degrees)))
    mixed = [(rate, sign * drift) for rate in MIXED_RATES for drift in MIXED_DRIFT_DEG for sign in both]
    for rate, drift in [
        (sign * rate, drift) for rate, drift in [*((r, 0) for r in TURN_RATES), *mixed] for sign in both
    ]:
        name = f"turn-{signed(rate, '.2f')}" + (f"-drift-{signed(drift, '02d')}" if drift else "")
        yield CaptiveTest(name, U, Turn(U, rate * U / craft.length, math.radians(drift)))


def _fins(craft: Craft, U: float) -> Iterator[CaptiveTest]:
    for name, column in zip(("rudder", "elevator", "aileron"), craft.mixing.T if craft.fins else (), strict=False):
        for degrees in (sign * angle for angle in FIN_DEG for sign in (1, -1) if column.any()):
            # Rounded as in the standard plan: a mixing matrix is exact to its last bits only.
            fins = tuple(math.radians(round(float(share) * degrees, 9)) for share in column)
            yield CaptiveTest(f"{name}-{signed(degrees, '02d')}", U, Drift(U, 0.0), fins)
