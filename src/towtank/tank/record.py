"""Make a Run out of what a tank measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.frames import Array
from towtank.plan.history import History
from towtank.plan.kinds import CaptiveTest
from towtank.provenance import provenance
from towtank.tank.identity import run_id
from towtank.tank.run import Run
from towtank.tank.tank import Tank


def record(
    tank: Tank,
    craft: Craft,
    test: CaptiveTest,
    history: History,
    loads: Array,
    *,
    parts: Mapping[str, Array] | None = None,
    ensemble: Array | None = None,
    flags: tuple[str, ...] = (),
    **extra: Any,
) -> Run:
    """Run of ``test`` with the measured ``loads`` (N, 6) [N, N m] about the body origin.

    parts, ensemble, flags : as in ``Run``.   extra : goes into the provenance.
    """
    samples = len(history.time)
    fins = np.array(test.fins or (0.0,) * len(craft.fins), dtype=float)
    delta = np.tile(fins, (samples, 1))
    return Run(
        id=run_id(craft, test, tank),
        name=test.name,
        kind=test.kind,
        craft=craft.name,
        symmetry=craft.symmetry,
        level=tank.level,
        speed=test.speed,
        period=test.motion.period,
        periods=test.periods,
        density=craft.water.density,
        length=craft.length,
        origin_from_nose=craft.origin_from_nose,
        history=history,
        delta=delta,
        control=np.tile(craft.virtual(fins), (samples, 1)),
        loads=loads,
        parts=dict(parts or {}),
        ensemble=ensemble,
        flags=flags,
        exploratory=test.exploratory,
        diameter=craft.diameter,
        provenance=provenance(tank=type(tank).__name__, settings=tank.settings(), **extra),
    )
