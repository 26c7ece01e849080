"""towtank: from the shape of a slender underwater craft to a manoeuvring model, by captive tests in a virtual tank.

The public names are listed in ``__all__`` and loaded on first use, so that importing the package costs little.
"""

from __future__ import annotations

import importlib
from typing import Any

from towtank.provenance import VERSION as __version__

_PUBLIC = {
    "read_craft": "towtank.craft.library",
    "check": "towtank.craft.hydrostatics",
    "standard_plan": "towtank.plan.standard",
    "tow": "towtank.tank.campaign",
    "FastTank": "towtank.tank.fast.tank",
    "OpenFoamTank": "towtank.tank.openfoam.tank",
    "LpmTank": "towtank.tank.lpm",
    "import_runs": "towtank.tank.imported.gate",
    "Run": "towtank.tank.run",
    "Derivatives": "towtank.derive.table",
    "read_coefficients": "towtank.derive.published",
    "consistency": "towtank.derive.consistency",
    "Model": "towtank.model.equations",
    "ExtraLoad": "towtank.model.extra",
    "read_model": "towtank.model.files",
    "design_pilot": "towtank.pilot.design",
    "design_lqi": "towtank.pilot.lqi",
    "design_schedule": "towtank.pilot.scheduled",
    "load_pilot": "towtank.pilot.vehicles",
    "read_pilot": "towtank.pilot.files",
    "read_schedule": "towtank.pilot.files",
    "robust_margins": "towtank.tuning.margins",
    "tune": "towtank.tuning.tune",
    "Orders": "towtank.pilot.orders",
    "fly": "towtank.engine.run",
    "Ensemble": "towtank.engine.run",
    "Leg": "towtank.engine.plan",
    "Until": "towtank.engine.plan",
    "Gauge": "towtank.engine.plan",
    "Log": "towtank.engine.plan",
    "Clock": "towtank.engine.plan",
    "straight_run": "towtank.trials.straight",
    "acceleration": "towtank.trials.speed",
    "stopping": "towtank.trials.speed",
    "turning_circle": "towtank.trials.circle",
    "zigzag": "towtank.trials.zigzag",
    "spiral": "towtank.trials.spiral",
    "reverse_spiral": "towtank.trials.reverse",
    "pull_out": "towtank.trials.pullout",
    "meander": "towtank.trials.vertical",
    "steep_dive": "towtank.trials.vertical",
    "heading_step": "towtank.trials.steps",
    "depth_step": "towtank.trials.steps",
    "lawnmower": "towtank.trials.mission",
    "waypoint_mission": "towtank.trials.waypoints",
    "Waypoint": "towtank.trials.waypoints",
    "trial_from_file": "towtank.trials.userdefined",
    "assess": "towtank.verdict.assess",
    "read_requirements": "towtank.verdict.needs",
    "monte_carlo": "towtank.montecarlo.study",
    "Tolerances": "towtank.montecarlo.draw",
    "vary": "towtank.sweep.vary",
}

_STAGES = {"derive", "report"}
"""Packages that are called themselves."""

__all__ = ["__version__", *sorted(_STAGES | set(_PUBLIC))]


def __getattr__(name: str) -> Any:
    if name in _STAGES:
        return importlib.import_module(f"towtank.{name}")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'towtank' has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return __all__
