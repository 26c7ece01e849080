"""Tables as text: STAR-CCM+ monitor exports and CSV files with any of the usual separators."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.imported.table import Doubt, Table, read_text, unit_of

COMMENTS = ("#", "%", "//", "!")
_MISSING = ("", "nan", "na", "n/a", "null", "none", "-")


def read_delimited(path: Path) -> Table:
    """Read a table of numbers with one line of headers.

    Comma, semicolon, tab or blanks separate; with semicolons or tabs a decimal comma is understood. Headers may be
    quoted and end with their unit in brackets: ``"Physical Time: Physical Time (s)"``, ``Fx [N]``. A commented line
    of headers counts. Without headers the columns are called #1, #2 and so on. Empty cells and NaN are kept.

    Raises
    ------
    InputError
        Missing, empty, no text, a cell that is no number, or a row of the wrong length; with file, line and column.
        A last row that was cut off is left out and told in ``Table.repairs``.
    """
    text = read_text(path)
    kept = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    comments = [line.lstrip("#%/! ") for _, line in kept if line.lstrip().startswith(COMMENTS)]
    rows = [(i, line) for i, line in kept if not line.lstrip().startswith(COMMENTS)]
    if not rows:
        raise InputError(f"{path}: only comments, no rows. Export the table again.")
    separator = _separator(rows[-1][1] if len(rows) == 1 else rows[1][1])
    headers = _split(rows[0][1], separator)
    if all(_is_number(cell) for cell in headers):
        above = _split(comments[-1], separator) if comments else []
        headers = above if len(above) == len(headers) else [f"#{i + 1}" for i in range(len(headers))]
    else:
        rows = rows[1:]
    if not rows:
        raise InputError(
            f"{path}: headers ({', '.join(headers[:6])}) and no rows. The run had not started; export again."
        )
    return _table(path, headers, rows, separator)


def _table(path: Path, headers: Sequence[str], rows: Sequence[tuple[int, str]], separator: str) -> Table:
    numbers = _at_once(rows, len(headers), separator)
    repairs: tuple[str, ...] = ()
    if numbers is None:
        numbers, lines, repairs = _cell_by_cell(path, headers, rows, separator)
    else:
        lines = [number for number, _ in rows]
    names = tuple(headers)
    return Table(
        names,
        tuple(unit_of(name) for name in names),
        numbers,
        np.array(lines, dtype=np.intp),
        np.full(len(lines), path.name),
        repairs,
    )


def _at_once(rows: Sequence[tuple[int, str]], columns: int, separator: str) -> Array | None:
    """Numbers of rows without a fault; None where a cell needs a closer look."""
    try:
        mark = None if separator == " " else separator
        values = np.loadtxt([line for _, line in rows], delimiter=mark, comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape[1] == columns else None


def _cell_by_cell(
    path: Path, headers: Sequence[str], rows: Sequence[tuple[int, str]], separator: str
) -> tuple[Array, list[int], tuple[str, ...]]:
    values: list[list[float]] = []
    lines: list[int] = []
    repairs: tuple[str, ...] = ()
    for number, line in rows:
        cells = _split(line, separator)
        if len(cells) == len(headers) + 1 and cells[-1] == "":
            cells = cells[:-1]
        if len(cells) != len(headers):
            if number == rows[-1][0] and values and len(cells) < len(headers):
                repairs = (Doubt(f"{path.name}, line {number}: the last row is cut off and was left out"),)
                continue
            commas = separator == "," and len(cells) == 2 * len(headers)
            raise InputError(
                f"{path}, line {number}: {len(cells)} cells, wanted {len(headers)} as in the headers. "
                + (
                    "Decimal commas between commas cannot be told apart; export with semicolons or with points."
                    if commas
                    else "The file is damaged there; export it again, or remove the line."
                )
            )
        values.append([_number(cell, path, number, headers[i]) for i, cell in enumerate(cells)])
        lines.append(number)
    return np.array(values, dtype=float), lines, repairs


def _separator(line: str) -> str:
    """What stands between the cells of a line of numbers; a blank stands for any number of blanks."""
    return next((mark for mark in ("\t", ";", ",") if mark in line), " ")


def _split(line: str, separator: str) -> list[str]:
    cells = next(csv.reader([line.strip()], delimiter=separator, skipinitialspace=True), [])
    cells = [cell.strip() for cell in cells]
    if separator == " ":
        return [cell for cell in cells if cell]
    return [cell.replace(",", ".") for cell in cells] if _decimal_commas(cells, separator) else cells


def _decimal_commas(cells: Sequence[str], separator: str) -> bool:
    """True when a line separated by semicolons or tabs holds numbers written with a comma."""
    filled = [cell for cell in cells if cell]
    return separator in (";", "\t") and bool(filled) and all(_is_number(cell.replace(",", ".", 1)) for cell in filled)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell.lower() in _MISSING and cell != ""
    return True


def _number(cell: str, path: Path, line: int, header: str) -> float:
    if cell.lower() in _MISSING:
        return float("nan")
    try:
        return float(cell)
    except ValueError:
        raise InputError(
            f"{path}, line {line}, column {header!r}: {cell!r} is not a number. Export the table with plain numbers."
        ) from None
