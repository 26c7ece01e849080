"""Blocks of the page on runs in OpenFOAM: y+ on the walls and Courant number, in figures and in a table."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

from towtank.figures import walls
from towtank.grid.study import GridStudy
from towtank.report.blocks import Block, Table, number, stated
from towtank.report.pictures import Sketchbook
from towtank.tank.openfoam.distribution import COURANT, Y_PLUS, Distribution, distribution_of
from towtank.tank.run import Run

HEAD = ("runs", "area y+ < 5 [%]", "5 to 30 [%]", "30 to 300 [%]", "> 300 [%]", "cells Co < 1 [%]", "1 to 10 [%]",
        "> 10 [%]")  # fmt: skip
MORE = (
    "y+ of the first cell, by wall area; Courant number of moving runs, by number of cells; both of the last fields of "
    "a run. Wall functions hold from 30 to 300; docs/openfoam.md"
)
CAPTION = (
    "How the mesh meets the wall, and how far the flow goes in a step. At the end of a moving run its speed is largest."
)


def resolution(runs: Sequence[Run], book: Sketchbook) -> list[Block]:
    """Figure and table of the runs that carry distributions; nothing where none does."""
    kinds: dict[str, list[Distribution]] = {}
    for run in runs:
        found = distribution_of(run)
        if found is not None and (found.y_plus or found.courant):
            kinds.setdefault(run.kind, []).append(found)
    if not kinds:
        return []
    level = " + ".join(dict.fromkeys(run.level for run in runs if distribution_of(run) is not None))
    calls = []
    if of_walls := walls.by_wall(runs):
        calls.append(partial(walls.y_plus, of_walls, level))
    if of_kinds := walls.by_kind(runs):
        calls.append(partial(walls.courant, of_kinds, level))
    return [
        book.panels(calls, CAPTION, (2.1,), 2),
        _table("Resolution of the runs in OpenFOAM", "Kind of test", kinds, level),
    ]


def resolution_of_meshes(study: GridStudy, book: Sketchbook) -> list[Block]:
    """The same of the meshes of a study."""
    meshes = walls.by_mesh(study)
    calls = []
    if any(item.y_plus for items in meshes.values() for item in items):
        calls.append(partial(walls.y_plus_of_meshes, study))
    if any(item.courant for items in meshes.values() for item in items):
        calls.append(partial(walls.courant_of_meshes, study))
    if not calls:
        return []
    return [
        book.panels(calls, CAPTION, (2.1,), 2),
        _table("Resolution of the meshes", "Mesh", meshes, study.level),
    ]


def _table(title: str, first: str, groups: dict[str, list[Distribution]], level: str) -> Table:
    rows = tuple((name, str(len(items)), *_shares(items)) for name, items in groups.items())
    note = stated(level, "least to largest of the runs", axes=False, more=MORE)
    return Table(title, (first, *HEAD), rows, note)


def _shares(items: Sequence[Distribution]) -> tuple[str, ...]:
    """Cells of the table: y+ in four ranges, Courant number in three."""
    on_walls = [row for item in items if (row := item.walls())]
    in_cells = [item.courant for item in items if item.courant]
    return (*_ranges(on_walls, Y_PLUS, (5.0, 30.0, 300.0)), *_ranges(in_cells, COURANT, (1.0, 10.0)))


def _ranges(rows: Sequence[tuple[float, ...]], edges: Sequence[float], at: Sequence[float]) -> list[str]:
    """Shares [%] below, between and above ``at``, least to largest of the rows; "-" where there is none."""
    cuts = [0, *(edges.index(edge) + 1 for edge in at), len(edges) + 1]
    out = []
    for low, high in pairwise(cuts):
        sums = [100.0 * sum(row[low:high]) for row in rows]
        ends = [number(value, 2) if value >= 0.05 else "0" for value in (min(sums), max(sums))] if sums else ["-", "-"]
        out.append(ends[0] if ends[0] == ends[1] else " to ".join(ends))
    return out
