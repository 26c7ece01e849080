"""Columns of a record as they stand in a file: names, units, values, and where each row came from."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.quantity import si

_UNIT_AT_END = re.compile(r"^(?P<name>.*\S)\s*[(\[](?P<unit>[^()\[\]]*)[)\]]\s*$")


class Doubt(str):
    """A sentence on what was found or done that goes into ``Run.flags``; a plain text is only recorded."""

    __slots__ = ()


@dataclass(frozen=True)
class Table:
    """N rows of C columns.

    names, units : of the columns; a unit is empty where the file names none.
    values (N, C) : as in the file.   lines (N,) : line (text) or row number of each row, counted from 1.
    files (N,) : name of the file each row came from.
    repairs : what was done to a damaged file, a sentence each.
    moment_point : point of the moments that the file itself names, in its coordinates [m], or None.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    lines: NDArray[np.intp]
    files: NDArray[np.str_]
    repairs: tuple[str, ...] = ()
    moment_point: tuple[float, float, float] | None = None

    @cached_property
    def title(self) -> str:
        """Names of the files, for messages."""
        return ", ".join(dict.fromkeys(self.files.tolist()))

    def place(self, row: int) -> str:
        """File and line of a row, for messages."""
        return f"{self.files[row]}, line {self.lines[row]}"

    def take(self, rows: NDArray[np.intp], *repairs: str) -> Table:
        """The table with only ``rows``, in that order."""
        return replace(
            self,
            values=self.values[rows],
            lines=self.lines[rows],
            files=self.files[rows],
            repairs=(*self.repairs, *repairs),
        )

    def find(self, wanted: str) -> int:
        """Number of the column called ``wanted``.

        A header "Force X Monitor: Force (N)" answers to the whole of it, to it without the unit, to
        "Force X Monitor" and to "Force X"; upper and lower case count only where that makes a difference.

        Raises
        ------
        InputError
            No such column, or more than one.
        """
        for match in (str, str.casefold):
            for level in range(4):
                hits = [i for i, name in enumerate(self.names) if match(_aliases(name)[level]) == match(wanted)]
                if len(hits) > 1:
                    raise InputError(
                        f"{self.title}: {len(hits)} columns are called {wanted!r} "
                        f"({', '.join(repr(self.names[i]) for i in hits)}). Give the whole header of the one meant."
                    )
                if hits:
                    return hits[0]
        shown = ", ".join(repr(name) for name in self.names[:24])
        known = [alias for name in self.names for alias in _aliases(name)]
        near = difflib.get_close_matches(wanted, known, n=1, cutoff=0.6)
        hint = f"Did you mean {near[0]!r}? " if near else ""
        raise InputError(f"{self.title}: no column {wanted!r}. {hint}The file has {shown}.")

    def holds(self, wanted: str) -> bool:
        """True when exactly one column is called ``wanted``."""
        try:
            return self.find(wanted) >= 0
        except InputError:
            return False

    def column(self, wanted: str, unit: str, given: str = "") -> Array:
        """Values (N,) of a column in the SI ``unit``.

        given : unit that the mapping states. The file's own unit is used where it states one; both must agree.

        Raises
        ------
        InputError
            No such column, no unit of this dimension, or two units that differ.
        """
        at = self.find(wanted)
        where = f"{self.title}, column {self.names[at]!r}"
        return self.values[:, at] * _factor(self.units[at], given, unit, where)


def _aliases(header: str) -> tuple[str, str, str, str]:
    """The header, without its unit, before the colon, and without the word Monitor."""
    found = _UNIT_AT_END.match(header)
    bare = found["name"] if found else header
    first = bare.partition(":")[0].strip()
    return header, bare, first, first.removesuffix(" Monitor")


def unit_of(header: str) -> str:
    """Unit in brackets at the end of a header; empty when there is none."""
    found = _UNIT_AT_END.match(header)
    return found["unit"].strip() if found else ""


def _factor(stated: str, given: str, unit: str, where: str) -> float:
    """What values are multiplied by to be in ``unit``."""
    own = _value_of(stated, unit, where) if stated else None
    if not given:
        if stated and isinstance(own, InputError):
            raise own
        if own is None and unit in ("rad", "rad/s", "rad/s^2"):
            raise InputError(
                f'{where}: no unit. Degrees and radians cannot be told apart; state unit = "deg" or "rad".'
            )
        return 1.0 if own is None or isinstance(own, InputError) else own
    mapped = _value_of(given, unit, where)
    if isinstance(mapped, InputError):
        raise mapped
    if isinstance(own, float) and not np.isclose(own, mapped, rtol=1e-9):
        raise InputError(
            f"{where}: the file says {stated!r} and the mapping {given!r}. One of them is wrong by a factor "
            f"{mapped / own:.6g}; remove the unit of the mapping, or correct it."
        )
    return mapped


def _value_of(text: str, unit: str, where: str) -> float | InputError:
    """One ``text`` in the SI ``unit``. "N-m" and "Nm" are products, "s2" is a square: so they stand in headers."""
    plain = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", text.replace("radian", "rad").replace("·", "*"))
    plain = re.sub(r"(?<=[A-Za-z])([234])\b", r"^\1", re.sub(r"\b([kM]?N)m\b", r"\1*m", plain))
    if unit == "" and plain in ("", "1", "-"):
        return 1.0
    try:
        return si(f"1 {plain}", unit.replace("rad/s^2", "1/s^2"), where)
    except InputError:
        return InputError(
            f"{where}: the unit {text!r} is no unit of {unit or 'a pure number'}. Map another column, or correct the "
            "unit."
        )


def read_bytes(path: Path) -> bytes:
    """Content of a file.

    Raises
    ------
    InputError
        Missing, unreadable or empty.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{path} does not exist. Name the file as it lies beside the mapping, or on the command."
        ) from None
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}.") from None
    if not content.strip():
        raise InputError(
            f"{path} is empty. The export failed or the solver was stopped before it wrote; export it again."
        )
    return content


def read_text(path: Path) -> str:
    """Text of a file: UTF-8, UTF-16 with a mark, or Latin-1.

    Raises
    ------
    InputError
        Missing, empty, or not text.
    """
    content = read_bytes(path)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = content.decode("utf-16", errors="replace")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("latin-1")
    control = sum(text.count(chr(code)) for code in (*range(9), *range(14, 32)))
    if control:
        raise InputError(
            f"{path} is not a text file ({control} control characters). Give the exported table, not the file of the "
            'program itself; a MAT or netCDF file needs format = "mat" or "netcdf".'
        )
    return text
