"""Tables of text: CSV of any separator, with columns of words beside those of numbers and lines that are damaged."""

from __future__ import annotations

import contextlib
import csv
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.field.reading.mapping import Text
from towtank.field.reading.note import says_so
from towtank.field.reading.raw import Fault, Group, Raw
from towtank.frames import Array
from towtank.tank.imported.delimited import COMMENTS
from towtank.tank.imported.table import Table, read_bytes, unit_of

MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "inf", "-inf")
"""Cells that hold nothing."""
NOTE = "towtank:"
"""What a comment begins with that holds what towtank says of its own file."""
SPOILT_LINES = 0.5
"""Share of lines that cannot be read above which the file is taken for one of another layout. Judgement."""
CONTROL = 0.01
"""Share of control characters above which a file is taken for no text; damaged blocks of a log stay below it."""
_CONTROLS = frozenset(chr(code) for code in (*range(9), 11, 12, *range(14, 32)))
STATE = "Error State"
"""Column of an Iver log, which has no comments, that says whether it is made up."""
Lines = list[tuple[int, str]]


def read_delimited_log(path: Path, text: Text) -> Raw:
    """A log of one table, with one line of headers.

    Raises
    ------
    InputError
        Missing, empty, no text, no rows, or more lines that cannot be read than can.
    """
    kept, faults = text_lines(path)
    note = _note(kept)
    group, spoilt = table_of_lines(path.name, kept, text)
    if any(says_so(cell) for cell in group.texts.get(STATE, ())[:1]):
        note = {"synthetic": True, **note}
    return Raw(path.name, {"": group}, None, note, (*faults, *spoilt))


def text_lines(path: Path) -> tuple[Lines, tuple[Fault, ...]]:
    """Numbered lines that are text and hold something; and how many are not text.

    Raises
    ------
    InputError
        Missing, empty, or not text.
    """
    content = read_bytes(path)
    marked = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    found = content.decode("utf-16" if marked else "utf-8-sig", errors="replace")
    bad = sum(found.count(mark) for mark in _CONTROLS)
    odd = found.count("\ufffd")
    if bad > CONTROL * len(found) and not _mostly_text(found):
        raise InputError(
            f"{path} is not a text file ({bad} control characters of {len(found)}). Give the exported table, not the "
            "file of the program itself; a MAT, netCDF or bag file is known by its ending."
        )
    lines = [(i, line) for i, line in enumerate(found.splitlines(), start=1) if line.strip()]
    clean = [(i, line) for i, line in lines if not _CONTROLS & set(line) and not (odd and line.count("\ufffd") > 4)]
    if not clean:
        raise InputError(f"{path} holds no line of text. It is damaged, or of another format.")
    lost = [i for i, line in lines if _CONTROLS & set(line) or (odd and line.count("\ufffd") > 4)]
    said = [Fault(len(lost), f"{_places(lost)} not text: left out")] if lost else []
    if not found.endswith(("\n", "\r")):
        said.append(Fault(1, f"line {lines[-1][0]}, the last, has no end: it may be cut off"))
    return clean, tuple(said)


def _mostly_text(found: str) -> bool:
    """Whether the control characters stand in a few lines of an otherwise readable file."""
    lines = [line for line in found.splitlines() if line.strip()]
    spoilt = sum(bool(_CONTROLS & set(line)) for line in lines)
    return len(lines) > 3 and spoilt <= 0.1 * len(lines)


def _note(lines: Lines) -> Mapping[str, Any]:
    """What towtank wrote of its own file in a comment."""
    note: dict[str, Any] = {}
    for _, line in lines[:40]:
        if not line.lstrip().startswith(COMMENTS):
            continue
        bare = line.strip().lstrip("#%/ ").strip()
        if says_so(bare):
            note["synthetic"] = True
        if bare.startswith(NOTE):
            with contextlib.suppress(ValueError):
                found = json.loads(bare.removeprefix(NOTE))
                note |= found if isinstance(found, dict) else {}
    return note


def table_of_lines(title: str, lines: Lines, text: Text) -> tuple[Group, tuple[Fault, ...]]:
    """The one table among numbered ``lines``; and what of it cannot be read.

    Raises
    ------
    InputError
        No header, no rows, or rows of another layout than the header.
    """
    rows = [(i, line) for i, line in lines if i > text.skip and not line.lstrip().startswith(COMMENTS)]
    if not rows:
        raise InputError(f"{title}: only comments, no rows. Export the log again.")
    mark = text.separator or _separator([line for _, line in rows[:50]])
    headers = _cells(rows[0][1], mark)
    if sum(_is_number(cell) for cell in headers) > 0.5 * len(headers):
        headers = [f"#{i + 1}" for i in range(len(headers))]
    else:
        rows = rows[1:]
    while headers and headers[-1] == "":
        headers = headers[:-1]
    if not rows:
        raise InputError(
            f"{title}: headers ({', '.join(headers[:6])}) and no rows. The log holds no sample; export it again."
        )
    whole: list[list[str]] = []
    numbers: list[int] = []
    lost: list[int] = []
    for number, line in rows:
        cells = _cells(line, mark)
        while len(cells) > len(headers) and cells[-1] == "":
            cells.pop()
        if len(cells) == len(headers):
            whole.append(cells)
            numbers.append(number)
        else:
            lost.append(number)
    if len(lost) > SPOILT_LINES * len(rows):
        raise InputError(
            f"{title}: {len(lost)} of {len(rows)} lines do not have the {len(headers)} cells of the header "
            f"({', '.join(headers[:6])}), the first is line {lost[0]}. State what stands between cells: [text] "
            'separator = ";". Decimal commas between commas cannot be told apart.'
        )
    said = (Fault(len(lost), f"{_places(lost)} another number of cells than the header: left out"),) if lost else ()
    return _group(title, headers, whole, numbers, decimal=mark in (";", "\t")), said


def _places(lines: Sequence[int]) -> str:
    if len(lines) == 1:
        return f"line {lines[0]} is"
    return f"{len(lines)} lines ({', '.join(str(i) for i in lines[:4])}{' ...' if len(lines) > 4 else ''}) are"


def _group(title: str, headers: list[str], rows: list[list[str]], numbers: list[int], decimal: bool) -> Group:
    columns: list[Array] = []
    texts: dict[str, tuple[str, ...]] = {}
    spoilt: dict[str, int] = {}
    for name, cells in zip(headers, zip(*rows, strict=True), strict=True):
        values, bad = _numbers(cells, decimal)
        columns.append(values)
        if bad:
            texts[name], spoilt[name] = cells, bad
    table = Table(
        tuple(headers), tuple(unit_of(name) for name in headers), np.column_stack(columns),
        np.array(numbers, dtype=np.intp), np.array([title] * len(numbers)),
    )  # fmt: skip
    return Group(table, texts, None, spoilt)


def _numbers(cells: Sequence[str], decimal: bool) -> tuple[Array, int]:
    """Cells as numbers, NaN where a cell holds none; and how many of those hold something else."""
    with contextlib.suppress(ValueError):
        found = np.array(cells, dtype=float)
        return np.where(np.isfinite(found), found, np.nan), 0
    values, bad = np.full(len(cells), np.nan), 0
    for i, cell in enumerate(cells):
        if cell.lower() in MISSING:
            continue
        try:
            number = float(cell.replace(",", ".", 1) if decimal else cell)
            values[i] = number if np.isfinite(number) else np.nan
        except ValueError:
            bad += 1
    return values, bad


def _cells(line: str, mark: str) -> list[str]:
    if mark == " ":
        return line.split()
    if len(mark) > 1:
        return [cell.strip() for cell in line.split(mark)]
    cells = next(csv.reader([line.strip("\r\n")], delimiter=mark, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def _separator(lines: Sequence[str]) -> str:
    """What stands between cells: the mark that parts the most lines into equally many of them."""
    best, score = " ", (0, 0)
    for mark in ("\t", ";", ",", "|"):
        counts = Counter(len(_cells(line, mark)) for line in lines)
        cells, often = max(counts.items(), key=lambda item: (item[1], item[0]))
        if cells > 1 and (often, cells) > score:
            best, score = mark, (often, cells)
    return best


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", ".", 1))
    except ValueError:
        return False
    return True
