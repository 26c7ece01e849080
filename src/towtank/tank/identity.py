"""Identity of a run: a readable slug and a hash of everything that decides its loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from towtank.craft.craft import ACTUATOR, Craft
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.standard import slug
from towtank.provenance import digest
from towtank.tank.tank import Tank

_STATIONS = 401


def run_id(craft: Craft, test: CaptiveTest, tank: Tank) -> str:
    """``<test name>-<8 hex digits>``: the folder name of a run.

    The hash covers the wetted shape, the reference point, the water, the motion, the fin angles, the sampling, and
    the tank with its settings. Mass, fin limits, the test's name and its ``exploratory`` mark do not change a load and
    are left out, so that changing them repeats nothing.
    """
    return _joined(test, _context(craft, tank), len(craft.fins))


def run_ids(plan: Plan, tank: Tank) -> tuple[str, ...]:
    """``run_id`` of every test of a plan, in its order."""
    context = _context(plan.craft, tank)
    return tuple(_joined(test, context, len(plan.craft.fins)) for test in plan.tests)


def wetted_shape(craft: Craft) -> dict[str, Any]:
    """What the water feels of a craft: hull radii at fixed stations [rounded to 1e-9 L], fins, strakes, origin."""
    length = craft.length
    radii = craft.profile.radius(np.linspace(0.0, length, _STATIONS)) / length
    return {
        "name": craft.name,
        "profile": craft.profile.kind,
        "length": length,
        "radii": np.round(radii, 9) + 0.0,
        "fins": [{k: v for k, v in vars(fin).items() if k not in ACTUATOR} for fin in craft.fins],
        "origin": craft.origin_from_nose,
        "water": craft.water,
        **({"strakes": craft.strakes} if craft.strakes else {}),
    }


def _context(craft: Craft, tank: Tank) -> str:
    """Hash of craft and tank. Not kept: settings tell of files and programs that may change while a process lives."""
    return digest([wetted_shape(craft), type(tank).__name__, tank.level, tank.settings()], 16)


def _joined(test: CaptiveTest, context: str, n_fins: int) -> str:
    oscillating = test.motion.period > 0.0
    content = [
        context,
        test.speed,
        test.motion.kind,
        test.motion,
        test.fins or (0.0,) * n_fins,
        (test.periods, test.samples) if oscillating else (),
    ]
    return f"{slug(test.name)}-{digest(content)}"
