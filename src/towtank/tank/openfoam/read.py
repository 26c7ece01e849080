"""From a solved case to a Run: loads about the body origin, in body axes, at the plan's samples."""

from __future__ import annotations

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import TankError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import sampled
from towtank.tank.openfoam.case import Case
from towtank.tank.openfoam.health import health_of, remarks
from towtank.tank.openfoam.mesh.imported import measures_of, mesh_remarks
from towtank.tank.openfoam.motion import inertial_to_body, pose
from towtank.tank.openfoam.runner import Outcome, measured
from towtank.tank.record import record
from towtank.tank.run import Run
from towtank.tank.tank import Tank

VOLUME = 3
"""Dimensions of the mesh."""


def run_of(case: Case, craft: Craft, test: CaptiveTest, tank: Tank, outcome: Outcome) -> Run:
    """The run that a solved case measured, with its verdict and its mesh in the provenance.

    Raises
    ------
    TankError
        Loads of some steps are missing.
    """
    loads = case_loads(case)
    health = health_of(case, outcome, loads)
    history = sampled(test)
    measures = measures_of(case.folder)
    parts: dict[str, Array] = {}
    if len(case.walls) > 1:
        hull = case_loads(case, "forcesHull")
        parts = {"hull": _held(case, hull, len(history.time)), "fins": _held(case, loads - hull, len(history.time))}
    return record(
        tank,
        craft,
        test,
        history,
        _held(case, loads, len(history.time)),
        parts=parts,
        flags=(*remarks(case, health), *mesh_remarks(measures)),
        mesh={"label": case.label, "cells": case.cells, "dimensions": VOLUME, **measures},
        health=health.document(),
        case={
            "formulation": case.formulation.word,
            "half": case.domain.half,
            "turned": case.domain.turned,
            "turbulence": case.numerics.turbulence,
            "steps_per_period": case.line.per_period if case.line else 0,
        },
    )


def _held(case: Case, loads: Array, samples: int) -> Array:
    return np.tile(loads.mean(axis=0), (samples, 1)) if case.held else loads


def case_loads(case: Case, name: str = "forces") -> Array:
    """Loads [N, N m] on the whole craft about the body origin, in body axes.

    Steady: the last window of iterations (window, 6). Unsteady: the last half of the steps. Moving: at each sample of
    the plan (N, 6).
    """
    values = measured(case, name)
    if values is None:
        raise TankError(f"{case.folder}: no load is on file. Remove the folder to have the case run again.")
    if case.line is None:
        return case.domain.loads_to_body(values[-case.numerics.window :, 1:])
    wanted = case.line.samples()
    steps = np.rint(values[:, 0] / case.line.step).astype(np.intp)
    known = dict(zip(steps.tolist(), range(len(steps)), strict=True))
    lacking = [int(step) for step in wanted if int(step) not in known]
    if lacking:
        raise TankError(
            f"{case.folder}: loads of {len(lacking)} samples are missing, the first at step {lacking[0]} of "
            f"{case.line.steps}. Remove the folder to have the case run again."
        )
    rows = values[[known[int(step)] for step in wanted], 1:]
    if case.held:
        return case.domain.loads_to_body(rows)
    numbers, position, turn = pose(case.test, case.domain, case.formulation, case.line)
    at = wanted - numbers[0]
    return case.domain.loads_to_body(inertial_to_body(rows, position[at], turn[at]))
