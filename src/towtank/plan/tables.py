"""The motions of a plan as tables, for a solver or a towing carriage that follows a prescribed path."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from towtank.artefact import write_text
from towtank.plan.kinds import CaptiveTest, Plan
from towtank.plan.motion import sample_times

HEADERS = (
    "Time (s)", "x (m)", "y (m)", "z (m)", "phi (rad)", "theta (rad)", "psi (rad)",
    "u (m/s)", "v (m/s)", "w (m/s)", "p (rad/s)", "q (rad/s)", "r (rad/s)",
)  # fmt: skip
"""Columns of a table: place of the body origin in water at rest (north, east, down), attitude, body velocities."""


def motion_table(test: CaptiveTest) -> str:
    """The motion of ``test`` as CSV with one line of quoted headers and 12 significant digits.

    An oscillation has its samples per period over all of its periods, a steady motion two rows one second apart.
    """
    history = test.motion.history(sample_times(test))
    rows = np.column_stack([history.time, history.position, history.attitude, history.nu])
    lines = [",".join(f'"{head}"' for head in HEADERS)]
    lines += [",".join(f"{value + 0.0:.12g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def write_motion_tables(plan: Plan, folder: Path) -> tuple[Path, ...]:
    """Write ``<folder>/<name>.csv`` for every test of a plan; their paths.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return tuple(_written(plan.tests, Path(folder)))


def _written(tests: Iterable[CaptiveTest], folder: Path) -> Iterable[Path]:
    for test in tests:
        yield write_text(folder / f"{test.name}.csv", motion_table(test))
