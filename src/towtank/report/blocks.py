"""What a page is made of: sections of text, tables and pictures. No HTML here; the template writes it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from towtank.figures.paper import level_words

AXES = "Axes: SNAME, x forward, y starboard, z down; loads act on the body"
_NUMBER = re.compile(r"^[-+\u2212]?[\d.]+(e[-+]?\d+)?( to [-+]?[\d.e+-]+)?( \S{1,8})?( ?± ?[\d.e+-]+)?( %)?$")


@dataclass(frozen=True)
class Text:
    """One paragraph. ``tone``: "plain", "good", "bad" or "missing"."""

    words: str
    tone: str = "plain"


@dataclass(frozen=True)
class Table:
    """A table with its statement on level, uncertainty and axes in ``note``. Cells are text."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Columns in which most filled cells are numbers."""
        columns = zip(*self.rows, strict=True) if self.rows else ((),) * len(self.head)
        return tuple(_mostly_numbers(column) for column in columns)


def _mostly_numbers(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell not in ("", "-")]
    return bool(filled) and 2 * sum(bool(_NUMBER.match(cell)) for cell in filled) > len(filled)


@dataclass(frozen=True)
class Picture:
    """A drawn figure as SVG text, with its caption. ``share``: of the width of the page [%]."""

    svg: str
    caption: str
    share: float = 100.0


@dataclass(frozen=True)
class View:
    """The 3-D view: GLB and still picture (PNG), both base64."""

    glb: str
    still: str
    caption: str


Block = Text | Table | Picture | View


@dataclass(frozen=True)
class Section:
    """One numbered part of the page."""

    key: str
    title: str
    blocks: tuple[Block, ...] = field(default_factory=tuple)


def stated(level: str, uncertainty: str, axes: bool = True, more: str = "") -> str:
    """The line under a table: level of evidence, what is said about uncertainty, axes and signs."""
    parts = [f"Level: {level_words(level)}" if level else "", f"Uncertainty: {uncertainty}", AXES if axes else "", more]
    return ". ".join(part for part in parts if part) + "."


def number(value: float | None, digits: int = 4) -> str:
    """``value`` with ``digits`` significant digits; "-" when there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if -4 <= size < 7:
        return f"{value:.{max(digits - 1 - size, 0)}f}"
    return f"{value:.{digits - 1}e}"


def with_std(value: float, std: float | None) -> tuple[str, str]:
    """Value and standard uncertainty with matching decimals: two significant digits of the uncertainty."""
    if not math.isfinite(value):
        return "-", "-"
    if std is None or not math.isfinite(std) or std <= 0.0:
        return number(value), "-" if std is None or not math.isfinite(std) else "0"
    place = math.floor(math.log10(std)) - 1
    if place < -9 or (value != 0.0 and math.log10(abs(value)) - place > 9.0):
        return number(value), number(std, 2)
    decimals = max(-place, 0)
    return f"{round(value, -place):.{decimals}f}", f"{round(std, -place):.{decimals}f}"


def percent(part: float, whole: float) -> str:
    """``part`` as per cent of ``whole``; "-" when the whole is zero."""
    return "-" if whole == 0.0 or not math.isfinite(part) else f"{100.0 * abs(part / whole):.1f}"


def missing(stage: str, remedy: str) -> Text:
    """The words that stand where a stage has left nothing."""
    return Text(f"{stage} {remedy}", "missing")
