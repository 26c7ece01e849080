"""Logs of DUNE as Neptus exports them: a folder with one CSV file for each type of IMC message.

Layout as ``CSVExporter`` of Neptus writes it: ``EstimatedState.csv`` with the headers "timestamp (seconds since
01/01/1970), system, entity , lat (rad), ..."; cells stand between a comma and a blank.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from towtank.errors import InputError
from towtank.field.reading.mapping import Text
from towtank.field.reading.note import says_so
from towtank.field.reading.raw import Fault, Group, Raw
from towtank.field.reading.text import read_delimited_log, table_of_lines, text_lines

BOOK = "LogBookEntry"
"""Message whose text holds what towtank says of its own log."""


def read_imc(path: Path, wanted: frozenset[str]) -> Raw:
    """A folder of messages, or the file of one; those in ``wanted`` (message names) are read.

    Raises
    ------
    InputError
        No such folder, none of the messages in it, or one that cannot be read.
    """
    files = {path.stem: path} if path.is_file() else {file.stem: file for file in sorted(path.glob("*.csv"))}
    taken = {name: file for name, file in files.items() if name in wanted}
    if not taken:
        raise InputError(
            f"{path}: no file of the messages {', '.join(sorted(wanted))}. It has {', '.join(files) or 'no CSV file'}. "
            "Export the log in Neptus (MRA, Export to CSV), and give the folder mra/csv."
        )
    groups: dict[str, Group] = {}
    faults: list[Fault] = []
    for name, file in taken.items():
        raw = _message(file)
        groups[name] = raw.groups[""]
        faults += [Fault(fault.count, f"{file.name}: {fault.words}") for fault in raw.faults]
    return Raw(path.name, groups, None, _note(files.get(BOOK)), tuple(faults))


def _message(path: Path) -> Raw:
    lines, faults = text_lines(path)
    apart = ", " if lines and lines[0][1].count(", ") == lines[0][1].count(",") else ","
    if apart == ",":
        return read_delimited_log(path, Text(separator=","))
    group, spoilt = table_of_lines(path.name, lines, Text(separator=apart))
    return Raw(path.name, {"": group}, None, {}, (*faults, *spoilt))


def _note(path: Path | None) -> dict[str, Any]:
    if path is None:
        return {}
    note: dict[str, Any] = {}
    for _, line in text_lines(path)[0]:
        if any(says_so(cell) for cell in line.split(", ")):
            note["synthetic"] = True
        _, brace, rest = line.partition('{"towtank"')
        if brace:
            try:
                found = json.loads(brace + rest)
            except ValueError:
                continue
            note |= found if isinstance(found, dict) else {}
    return note
