"""Tables of the validation scripts as CSV, with a head that says where they come from."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from towtank.provenance import provenance


def write_table(path: Path, made_by: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write ``rows`` below a comment line with date, version and ``made_by``."""
    origin = provenance()
    lines = [list(row) for row in rows]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {path.stem}: {made_by}; towtank {origin['version']}, {origin['date']}, {origin['platform']}\n")
        csv.writer(file, lineterminator="\n").writerows([head, *lines])


def read_table(path: Path) -> list[dict[str, str]]:
    """Rows of a table that ``write_table`` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))
