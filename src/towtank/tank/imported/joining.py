"""Rows in the order of time, and several files of one run made one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.imported.table import Doubt, Table

RESTARTS = 20
"""Most steps back in time that are taken for restarts; a clock that goes back more often is not a clock."""

SHARED = 0.5
"""Least share of common time steps of files that are joined: below it they are files of different runs."""


def ordered(table: Table, time: str) -> Table:
    """The table with strictly rising ``time``.

    Of rows with one time the last is kept: a solver writes one for each inner iteration. A step back in time is a
    restart, and what was written before it from that time on gives way. A record that runs backwards throughout is
    turned round. Each of these is told in ``repairs``.

    Raises
    ------
    InputError
        A time that is no number, or more steps back than ``RESTARTS``.
    """
    t = table.values[:, table.find(time)]
    if not np.isfinite(t).all():
        row = int(np.flatnonzero(~np.isfinite(t))[0])
        raise InputError(f"{table.place(row)}: the time ({time!r}) is not a number. Remove the row or export again.")
    if len(t) > 1 and (np.diff(t) <= 0.0).all() and t[-1] < t[0]:
        turned = Doubt(f"{table.title}: time runs backwards; the rows were turned round")
        table = table.take(np.arange(len(t))[::-1], turned)
        t = t[::-1]
    back = np.flatnonzero(np.diff(t) < 0.0) + 1
    if len(back) > RESTARTS:
        raise InputError(
            f"{table.place(int(back[0]))}: time goes back from {t[back[0] - 1]:g} to {t[back[0]]:g}, the first of "
            f"{len(back)} times. Up to {RESTARTS} are taken for restarts; sort the rows, or map the right column as "
            "time."
        )
    rows, said = _without_overtaken(t, back)
    table = table.take(rows, *(f"{table.title}: {words}" for words in said))
    t = t[rows]
    last = np.append(np.diff(t) > 0.0, True)
    if last.all():
        return table
    dropped = int((~last).sum())
    return table.take(
        np.flatnonzero(last),
        f"{table.title}: {dropped} rows have the time of the row after them; the last row of each time is kept",
    )


def _without_overtaken(t: Array, back: NDArray[np.intp]) -> tuple[NDArray[np.intp], list[str]]:
    """Rows that no later restart overtakes, and what was dropped."""
    keep = np.ones(len(t), dtype=bool)
    said = []
    for start in back:
        old = keep & (np.arange(len(t)) < start) & (t >= t[start])
        if old.any():
            said.append(
                f"a restart at {t[start]:g} overlaps what was written before; {int(old.sum())} earlier rows from "
                f"{t[old].min():g} to {t[old].max():g} give way to the later ones"
            )
        keep &= ~old
    return np.flatnonzero(keep), said


def joined(tables: Sequence[Table], time: str) -> Table:
    """One table in the order of ``time``: files with the same columns follow each other, others stand side by side.

    Files follow each other by their first time; of those that start together, the one named later is the later one.

    Raises
    ------
    InputError
        Files without the time column, with some columns in common and others not, or of different times.
    """
    chains: list[Table] = []
    for table in sorted(tables, key=lambda item: _start(item, time)):
        same = next((i for i, known in enumerate(chains) if known.names == table.names), None)
        if same is None:
            chains.append(table)
        else:
            chains[same] = _after(chains[same], table)
    chains = [ordered(table, time) for table in chains]
    whole = chains[0]
    for other in chains[1:]:
        whole = _beside(whole, other, time)
    return whole


def _start(table: Table, time: str) -> float:
    values = table.values[:, table.find(time)]
    return float(np.min(values, where=np.isfinite(values), initial=np.inf))


def _after(first: Table, then: Table) -> Table:
    return replace(
        first,
        values=np.concatenate([first.values, then.values]),
        lines=np.concatenate([first.lines, then.lines]),
        files=np.concatenate([first.files, then.files]),
        repairs=(*first.repairs, *then.repairs),
    )


def _beside(left: Table, right: Table, time: str) -> Table:
    a, b = left.find(time), right.find(time)
    others = [i for i in range(len(right.names)) if i != b]
    twice = {left.names[i] for i in range(len(left.names)) if i != a} & {right.names[i] for i in others}
    if twice:
        raise InputError(
            f"{left.title} and {right.title} share the columns {', '.join(sorted(twice))} and differ in others. Files "
            "of one run have either the same columns (restarts) or none in common but time (one file per monitor)."
        )
    span = float(max(np.ptp(left.values[:, a]), np.ptp(right.values[:, b]))) or 1.0
    _, here, there = np.intersect1d(
        _rounded(left.values[:, a], span), _rounded(right.values[:, b], span), return_indices=True
    )
    longest = max(len(left.values), len(right.values))
    if len(here) < SHARED * longest:
        raise InputError(
            f"{left.title} and {right.title} share {len(here)} of {longest} time steps. They are not of one run, or "
            "their time columns have different units. Name the files of one run."
        )
    lost = longest - len(here)
    said = (f"{right.title}: {lost} time steps are not in every file; only common ones are used",) if lost else ()
    kept = left.take(here)
    return replace(
        kept,
        names=(*left.names, *(right.names[i] for i in others)),
        units=(*left.units, *(right.units[i] for i in others)),
        values=np.concatenate([kept.values, right.values[there][:, others]], axis=1),
        files=np.array([f"{name} and {right.title}" for name in kept.files]),
        repairs=(*left.repairs, *right.repairs, *said),
    )


def _rounded(time: Array, span: float) -> Array:
    """Times to 1e-9 of their span: exporters print between 6 and 16 digits of the same step."""
    return np.asarray(np.round(time / span, 9))
