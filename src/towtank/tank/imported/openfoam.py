"""The ``forces`` function object of OpenFOAM, in each of its layouts, over several restarts.

One file with nested brackets, ``forces.dat``: time ((pressure) (viscous) (porous)) ((...)), where porous may be absent.
Two files, ``force.dat`` and ``moment.dat``, with columns total, pressure, viscous, with or without brackets.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.symbols import LOADS
from towtank.tank.imported.joining import joined
from towtank.tank.imported.table import Doubt, Table, read_text

_FILE = re.compile(r"^(?P<noun>forces?|moment)(?:_(?P<time>[0-9.eE+-]+))?\.dat$")
_CENTRE = re.compile(r"CofR\s*:\s*\(([^)]*)\)")
NAMES = ("time", *LOADS)
"""Columns of the table: X Y Z K M N are the loads along and about the file's axes."""

UNITS = ("s", "N", "N", "N", "N-m", "N-m", "N-m")


def read_forces(place: Path) -> Table:
    """Read the loads of one function object: X Y Z [N] and K M N [N m] against time [s].

    Parameters
    ----------
    place : a case, its ``postProcessing``, the folder of the function object, one of its time folders, or a file.
        Rows of restarts follow each other in the order of their start; overlaps are left in (``joining.ordered``
        lets the later one win).

    Raises
    ------
    InputError
        No such folder, several function objects, one of the two files missing, or a damaged line.
    """
    folders = _time_folders(place)
    if not folders:
        raise InputError(
            f"{place}: no forces.dat, and no force.dat with moment.dat, below it. Name the case, or the "
            "folder postProcessing/<name of the forces function object>."
        )
    owners = sorted({folder.parent.name for folder in folders})
    if len(owners) > 1:
        raise InputError(
            f"{place} holds {len(owners)} forces function objects ({', '.join(owners)}), which may count a patch "
            f"twice. Name one, for example {folders[0].parent.name}; with sum = true several named ones are added."
        )
    parts = [part for folder in folders for part in _parts(folder, place)]
    centres = {part.moment_point for part in parts if part.moment_point is not None}
    if len(centres) > 1:
        raise InputError(f"{place}: restarts with different CofR {sorted(centres)}. Import them as runs of their own.")
    return joined(parts, "time")


def forces_files(place: Path) -> list[Path]:
    """The files that ``read_forces`` reads, in the order of their folders."""
    if place.is_file():
        return sorted(path for path in place.parent.glob("*.dat") if _FILE.match(path.name))
    return [path for folder in _time_folders(place) for path in sorted(folder.glob("*.dat")) if _FILE.match(path.name)]


def _time_folders(place: Path) -> list[Path]:
    """Folders that hold files of forces, ordered by their start time."""
    if place.is_file():
        return [place.parent]
    if not place.exists():
        raise InputError(f"{place} does not exist. Name a case, or the folder of the forces function object.")
    found = {path.parent for path in place.rglob("*.dat") if _FILE.match(path.name)}
    return sorted(found, key=lambda folder: (_start(folder.name), folder.name))


def _start(name: str) -> float:
    try:
        return float(name)
    except ValueError:
        return 0.0


def _parts(folder: Path, place: Path) -> list[Table]:
    """Tables of one time folder: the file itself, then those written again after a restart (``force_0.5.dat``)."""
    files: dict[str, dict[str, Path]] = {}
    for path in sorted(folder.glob("*.dat")):
        if found := _FILE.match(path.name):
            files.setdefault(found["time"] or "", {})[found["noun"]] = path
    if place.is_file() and (named := _FILE.match(place.name)):
        files = {key: value for key, value in files.items() if key == (named["time"] or "")}
    out = []
    for key in sorted(files, key=lambda text: (text != "", _start(text))):
        nouns = files[key]
        if "forces" in nouns:
            out.append(_bracketed(nouns["forces"]))
        elif {"force", "moment"} <= set(nouns):
            out.append(_pair(nouns["force"], nouns["moment"]))
        else:
            there = next(iter(nouns.values()))
            wanted = "moment" if "force" in nouns else "force"
            raise InputError(
                f"{there} is there and {there.name.replace(next(iter(nouns)), wanted)} is not. Loads need both; copy "
                "the missing file from the case."
            )
    return out


def _lines(path: Path) -> tuple[list[str], list[tuple[int, str]]]:
    """Comment lines, and numbered lines of numbers."""
    text = read_text(path)
    numbered = [(i, line.strip()) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    heads = [line for _, line in numbered if line.startswith("#")]
    rows = [(i, line) for i, line in numbered if not line.startswith("#")]
    if not rows:
        raise InputError(f"{path}: headers and no rows. The solver had not written; check the case.")
    return heads, rows


def _centre(heads: Iterable[str], path: Path) -> tuple[float, float, float] | None:
    for line in heads:
        if found := _CENTRE.search(line):
            numbers = found[1].split()
            if len(numbers) != 3 or not all(_is_float(cell) for cell in numbers):
                raise InputError(f"{path}: CofR ({found[1]}) is not three numbers. Copy the file again from the case.")
            return float(numbers[0]), float(numbers[1]), float(numbers[2])
    return None


def _numbers(
    path: Path, rows: list[tuple[int, str]], counts: tuple[int, ...]
) -> tuple[Array, list[int], tuple[str, ...]]:
    """Numbers of each row, brackets taken off; a last row that was cut off is left out."""
    values: list[list[float]] = []
    lines: list[int] = []
    repairs: tuple[str, ...] = ()
    for number, line in rows:
        cells = line.replace("(", " ").replace(")", " ").split()
        whole = (
            len(cells) in counts and line.count("(") == line.count(")") and (not values or len(cells) == len(values[0]))
        )
        if not whole:
            if number == rows[-1][0] and values:
                repairs = (Doubt(f"{path.name}, line {number}: the last row is cut off and was left out"),)
                continue
            raise InputError(
                f"{path}, line {number}: {len(cells)} numbers or brackets that do not close, wanted "
                f"{' or '.join(str(count) for count in counts)} numbers. The file is damaged there; remove the line or "
                "copy the file again."
            )
        try:
            values.append([float(cell) for cell in cells])
        except ValueError:
            bad = next(cell for cell in cells if not _is_float(cell))
            raise InputError(f"{path}, line {number}: {bad!r} is not a number. Remove the line.") from None
        lines.append(number)
    return np.array(values), lines, repairs


def _is_float(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _bracketed(path: Path) -> Table:
    """The layout with both loads in one file: one to three triples of force, as many of moment, which add up."""
    heads, rows = _lines(path)
    values, lines, repairs = _numbers(path, rows, (7, 13, 19))
    shares = values[:, 1:].reshape(len(values), 2, -1, 3).sum(axis=2)
    return _made(path.name, np.column_stack([values[:, 0], shares[:, 0], shares[:, 1]]), lines, repairs,
                 _centre(heads, path))  # fmt: skip


def _pair(force: Path, moment: Path) -> Table:
    """The layout with a file for each: the columns named total are read."""
    f, m = _totals(force, LOADS[:3]), _totals(moment, LOADS[3:])
    if f.moment_point is not None and m.moment_point is not None and f.moment_point != m.moment_point:
        raise InputError(f"{force} and {moment.name} name different CofR. They are not of one run.")
    return joined([f, m], "time")


def _totals(path: Path, names: tuple[str, ...]) -> Table:
    heads, rows = _lines(path)
    wanted = [f"total_{axis}" for axis in "xyz"]
    headers = (line.lstrip("# ").replace("(", " ").replace(")", " ").split() for line in heads)
    columns = next((found for found in headers if set(wanted) <= set(found)), None)
    if columns is None:
        raise InputError(
            f"{path}: no header names {', '.join(wanted)}. Columns of this layout are known by their names only; keep "
            "the header."
        )
    values, lines, repairs = _numbers(path, rows, (len(columns),))
    at = [0, *(columns.index(name) for name in wanted)]
    return _made(path.name, values[:, at], lines, repairs, _centre(heads, path), ("time", *names))


def _made(
    name: str,
    values: Array,
    lines: list[int],
    repairs: tuple[str, ...],
    centre: tuple[float, float, float] | None,
    names: tuple[str, ...] = NAMES,
) -> Table:
    units = tuple(UNITS[NAMES.index(known)] for known in names)
    return Table(names, units, values, np.array(lines, dtype=np.intp), np.full(len(lines), name), repairs, centre)


def added(tables: list[Table]) -> Table:
    """Sum of several function objects over their common time steps.

    Raises
    ------
    InputError
        Different moment points, or different times.
    """
    first = tables[0]
    for other in tables[1:]:
        if other.moment_point != first.moment_point:
            raise InputError(
                f"{other.title}: CofR {other.moment_point} differs from {first.moment_point}. Moments about different "
                "points do not add; give one CofR in the case."
            )
        renamed = Table(
            ("time", *(f"{name}+" for name in LOADS)),
            other.units,
            other.values,
            other.lines,
            other.files,
            other.repairs,
        )
        both = joined([first, renamed], "time")
        values = np.column_stack([both.values[:, 0], both.values[:, 1:7] + both.values[:, 7:13]])
        first = Table(NAMES, UNITS, values, both.lines, both.files, both.repairs, first.moment_point)
    return first
