"""A log as it stands in a file, whatever its format: tables of columns, each with a clock of its own or none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.imported.table import Table

Wanted = Mapping[str, tuple[str, ...]]
"""Group -> columns that are asked for; "" is the group of a file with one table."""


@dataclass(frozen=True)
class Group:
    """One table of a log.

    table : its columns as numbers, NaN where a cell holds none.   texts : columns that are no numbers, cell by cell.
    time (N,) [s] : of its rows from the file's own zero, or None where columns hold it.   spoilt : column -> cells that
    hold neither a number nor nothing.
    """

    table: Table
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    time: Array | None = None
    spoilt: Mapping[str, int] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.table.lines)

    def cells(self, name: str) -> tuple[str, ...]:
        """A column as text."""
        if name in self.texts:
            return self.texts[name]
        column = self.table.names[self.table.find(name)]
        if column in self.texts:
            return self.texts[column]
        return tuple(f"{value:.12g}" for value in self.table.values[:, self.table.find(name)])


@dataclass(frozen=True)
class Fault:
    """What could not be read: how many pieces, in words."""

    count: int
    words: str


@dataclass(frozen=True)
class Raw:
    """A file as it stands.

    groups : name -> table; "" where there is one.   epoch [s, UTC] : zero of the groups' times, None when not known.
    note : what the file says of itself in towtank's words.   faults : parts that could not be read.
    """

    title: str
    groups: Mapping[str, Group]
    epoch: float | None = None
    note: Mapping[str, Any] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()

    def split(self, column: str) -> tuple[str, str]:
        """Group and column of "GROUP:COLUMN", or of a bare column in a file of one table."""
        if "" in self.groups:
            return "", column
        group, _, name = column.partition(":")
        return group, name or group

    def has(self, column: str) -> bool:
        """Whether the file holds this column."""
        group, name = self.split(column)
        return group in self.groups and (name in self.groups[group].texts or self.groups[group].table.holds(name))

    def group(self, column: str) -> Group:
        """The table that holds ``column``.

        Raises
        ------
        InputError
            No such table in the file.
        """
        group, _ = self.split(column)
        if group not in self.groups:
            import difflib

            near = difflib.get_close_matches(group, list(self.groups), n=1, cutoff=0.5)
            hint = f"Did you mean {near[0]!r}? " if near else ""
            shown = ", ".join(list(self.groups)[:24])
            raise InputError(f"{self.title}: nothing called {group!r}. {hint}The file has {shown}.")
        return self.groups[group]


def table_of(title: str, names: tuple[str, ...], units: tuple[str, ...], values: Array, first: int = 1) -> Table:
    """A table from columns; ``first`` is the number of its first row, for messages."""
    count = len(values)
    return Table(
        names, units, values, np.arange(first, first + count, dtype=np.intp),
        np.array([title] * count, dtype=str) if count else np.array([], dtype=str),
    )  # fmt: skip


Rows = NDArray[np.intp]
