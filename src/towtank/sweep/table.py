"""What a sweep gives: a table of numbers, one row per point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.frames import Array
from towtank.sweep.sweep import Axis


@dataclass(frozen=True)
class Row:
    """One point: where it lies, its numbers, or why there are none."""

    at: tuple[float, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    failed: str = ""
    key: str = ""


@dataclass(frozen=True)
class SweepTable:
    """Rows of all points, the last axis running fastest. columns : name -> unit."""

    craft: str
    level: str
    axes: tuple[Axis, ...]
    columns: Mapping[str, str]
    rows: tuple[Row, ...]
    base: tuple[float, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def column(self, name: str) -> Array:
        """Numbers of one column on the grid of the axes; NaN where a point has none."""
        flat = [row.values.get(name, float("nan")) for row in self.rows]
        return np.array(flat).reshape([len(axis.values) for axis in self.axes])

    @property
    def failed(self) -> tuple[Row, ...]:
        """Points without a result."""
        return tuple(row for row in self.rows if row.failed)
