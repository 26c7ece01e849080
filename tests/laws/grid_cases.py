"""Runs of known coefficients on several meshes, with an error of known order planted in their loads."""

from __future__ import annotations

from dataclasses import replace

from towtank import read_craft
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift, Sway, Yaw
from towtank.progress import Silent
from towtank.tank.lpm import LpmTank
from towtank.tank.run import Run

HOKIE = read_craft("hokie")
VALUES = {"Xudot": -1.0, "Yvdot": -40.0, "Nrdot": -60.0, "Yrdot": 3.0, "Nvdot": 3.0, "Xuu": -4.0, "Yuv": -30.0,
          "Yvv": -200.0, "Nuv": -20.0, "Yur": 15.0, "Nur": -35.0}  # fmt: skip


def made(order: float, resolutions: tuple[float, ...], amplitude: float = 0.05) -> list[list[Run]]:
    """Runs of known coefficients whose loads carry an error amplitude * h^order, h over that of the finest."""
    tests = (
        CaptiveTest("drift", 2.0, Drift(2.0, 0.15)),
        CaptiveTest("sway", 2.0, Sway(2.0, 0.3, 1.1)),
        CaptiveTest("yaw", 2.0, Yaw(2.0, 0.4, 1.3)),
    )
    tank = LpmTank(VALUES)
    runs = [tank.run(HOKIE, test, Silent()) for test in tests]
    return [
        [
            replace(
                run, loads=run.loads * (1.0 + amplitude * (resolutions[-1] / r) ** order),
                provenance={"mesh": {"label": f"m{r:g}", "cells": round(1e6 * r**3)}},
            )
            for run in runs
        ]
        for r in resolutions
    ]  # fmt: skip
