"""Logs of MOOS: one posting a line, ``time VARIABLE source value``.

Layout as ``pLogger`` of MOOS-IvP writes it: comments begin with ``%%``, one of them says ``LOGSTART`` and the time of
the first zero in seconds since 1970; times count from there. A variable may carry ``NAME=1.2,DEPTH=3`` as text.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.field.reading.note import says_so
from towtank.field.reading.raw import Fault, Group, Raw, table_of
from towtank.field.reading.text import text_lines

NOTE = "TOWTANK_NOTE"
"""Variable that holds what towtank says of its own log."""
_START = re.compile(r"^%+\s*LOGSTART\s+(?P<at>[0-9.eE+-]+)")
_LINE = re.compile(r"^(?P<at>[0-9.eE+-]+)\s+(?P<name>\S+)\s+(?P<source>\S+)\s+(?P<value>.*)$")
_PAIR = re.compile(r"(?:^|,)\s*(?P<key>[A-Za-z_]\w*)\s*=\s*(?P<value>[^,=]*)")


def read_alog(path: Path) -> Raw:
    """A MOOS log: each variable is a group with the column of its name, and one for each ``KEY=number`` in its text.

    Raises
    ------
    InputError
        Missing, empty, not text, or with hardly a line that is a posting.
    """
    lines, faults = text_lines(path)
    start: float | None = None
    note: dict[str, Any] = {}
    postings: dict[str, list[tuple[float, str, int]]] = defaultdict(list)
    lost: list[int] = []
    for number, line in lines:
        if line.startswith("%"):
            if found := _START.match(line):
                start = _float(found["at"])
            if says_so(line.lstrip("% ")):
                note = {"synthetic": True, **note}
            continue
        found = _LINE.match(line.strip())
        at = _float(found["at"]) if found else None
        if found is None or at is None:
            lost.append(number)
        elif found["name"] == NOTE:
            note |= _note(found["value"])
        else:
            postings[found["name"]].append((at, found["value"].strip(), number))
    count = sum(len(rows) for rows in postings.values())
    if len(lost) > max(count, 1):
        raise InputError(
            f"{path}: {len(lost)} of {len(lost) + count} lines are no posting (time VARIABLE source value). Give the "
            ".alog of pLogger."
        )
    if lost:
        shown = ", ".join(str(i) for i in lost[:4]) + (" ..." if len(lost) > 4 else "")
        faults = (*faults, Fault(len(lost), f"line{'s' if len(lost) > 1 else ''} {shown}: no posting, left out"))
    return Raw(
        path.name,
        {name: _group(f"{path.name} {name}", name, rows) for name, rows in postings.items()},
        start,
        note,
        faults,
    )


def _group(title: str, name: str, rows: list[tuple[float, str, int]]) -> Group:
    columns = {name: np.array([_number(value) for _, value, _ in rows])}
    texts = {}
    spoilt = {}
    if np.isnan(columns[name]).any():
        texts[name] = tuple(value for _, value, _ in rows)
        bad = sum(
            np.isnan(x) and v.lower() not in ("nan", "") for x, (_, v, _) in zip(columns[name], rows, strict=True)
        )
        if bad:
            spoilt[name] = int(bad)
        for i, (_, value, _) in enumerate(rows):
            for pair in _PAIR.finditer(value):
                columns.setdefault(pair["key"], np.full(len(rows), np.nan))[i] = _number(pair["value"])
    names = tuple(columns)
    table = table_of(title, names, ("",) * len(names), np.column_stack([columns[key] for key in names]))
    lines = np.array([line for *_, line in rows], dtype=np.intp)
    from dataclasses import replace

    return Group(replace(table, lines=lines), texts, np.array([at for at, *_ in rows]), spoilt)


def _note(text: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _float(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _number(text: str) -> float:
    value = _float(text)
    return value if value is not None and np.isfinite(value) else float("nan")
