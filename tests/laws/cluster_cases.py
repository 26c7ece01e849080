"""Work for the tests of ``towtank.cluster``: it writes a line to a log as it starts and as it ends."""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

from towtank.errors import TrialError

PAUSE = 0.1
"""How long an item takes [s]."""

HELD = 5
"""The item that ``held`` holds: in the middle of the list."""


def noted(log: Path, word: str, item: int) -> None:
    """Append one line: written in one call, so that processes do not mix theirs."""
    with log.open("ab", buffering=0) as file:
        file.write(f"{word} {item} {os.getpid()}\n".encode())


def square(log: Path, item: int) -> dict[str, Any]:
    """The square of an item; 13 is refused."""
    noted(log, "start", item)
    time.sleep(PAUSE)
    if item == 13:
        raise TrialError("13 cannot be carried out.")
    noted(log, "end", item)
    return {"item": item, "square": item * item, "nothing": float("nan")}


def held(log: Path, item: int) -> dict[str, Any]:
    """As ``square``, but ``HELD`` does not end the first time it is started: it waits to be killed."""
    if item == HELD and item not in counted(log)[0]:
        noted(log, "start", item)
        time.sleep(600.0)
    return square(log, item)


def deadly(log: Path, item: int) -> dict[str, Any]:
    """As ``square``, but item 2 ends its process."""
    if item == 2:
        noted(log, "start", item)
        os._exit(9)
    return square(log, item)


def lines(log: Path) -> list[tuple[str, int, int]]:
    """(word, item, process) of every line."""
    if not log.exists():
        return []
    return [(word, int(item), int(pid)) for word, item, pid in (line.split() for line in log.read_text().splitlines())]


def counted(log: Path) -> tuple[Counter[int], Counter[int]]:
    """How often each item was started, and ended."""
    found = lines(log)
    return (
        Counter(item for word, item, _ in found if word == "start"),
        Counter(item for word, item, _ in found if word == "end"),
    )
