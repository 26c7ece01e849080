"""Carry out a sweep: every point once, on this machine or a cluster."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from towtank.cluster.ledger import Failed, Result
from towtank.cluster.work import each_once
from towtank.errors import TowtankError
from towtank.progress import Progress
from towtank.provenance import VERSION, digest, provenance
from towtank.sweep.point import work
from towtank.sweep.sweep import Sweep
from towtank.sweep.table import Row, SweepTable
from towtank.sweep.vary import KINDS

LEDGER = "sweep"
"""Folder of the finished points in the study folder."""


def run_sweep(
    sweep: Sweep,
    out: Path | str,
    *,
    where: str | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    settings: Mapping[str, Any] | None = None,
    program: str = VERSION,
) -> SweepTable:
    """Every point of ``sweep`` that is not done yet; the table of all.

    Parameters
    ----------
    out : study folder. A finished point is a file ``sweep/<key>.json`` at once, and not done again.
    where, workers, settings : see ``towtank.cluster.work.each_once``.   progress : told of each point.
    program : identity of the program; results of another one are not taken.

    Raises
    ------
    TowtankError
        Interrupted, or the cluster cannot be used. Finished points stay. A point that cannot be carried out is no
        error: the table says why.
    """
    points, keys = sweep.points(), point_keys(sweep, program)
    found: dict[int, Result] = dict(
        each_once(
            work, sweep, points, keys=keys, ledger=Path(out) / LEDGER, where=where, workers=workers,
            progress=progress, settings=settings, task="sweep",
        )
    )  # fmt: skip
    columns: dict[str, str] = {}
    for index in range(len(points)):
        result = found[index]
        columns |= {} if isinstance(result, Failed) else {n: u for n, u in result["units"].items() if n not in columns}
    return SweepTable(
        craft=sweep.craft.name,
        level=sweep.level,
        axes=sweep.axes,
        columns=columns,
        rows=tuple(_row(at, keys[i], found[i]) for i, at in enumerate(points)),
        base=tuple(_base(sweep, axis.name) for axis in sweep.axes),
        provenance=provenance(
            {"craft": digest(sweep.craft, 16)}, tank=sweep.tank.settings(), trials=list(sweep.trials), source=program
        ),
    )


def point_keys(sweep: Sweep, program: str = VERSION) -> list[str]:
    """A name for every point that covers all that decides its numbers."""
    common = digest([sweep.craft, sweep.level, sweep.tank.settings(), sweep.trials, program], 16)
    return [f"{sweep.craft.name[:60]}-{digest([common, sweep.changes(at)], 16)}" for at in sweep.points()]


def _row(at: tuple[float, ...], key: str, result: Result) -> Row:
    if isinstance(result, Failed):
        return Row(at, failed=result.message, key=key)
    values = {name: math.nan if value is None else float(value) for name, value in result["values"].items()}
    return Row(at, values, tuple(result["notes"]), key=key)


def _base(sweep: Sweep, name: str) -> float:
    """Value of the craft as given; NaN where it has none, such as the X angle of a cruciform."""
    try:
        return KINDS[name].base(sweep.craft)
    except TowtankError:
        return math.nan
