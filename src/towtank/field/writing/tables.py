"""Records as tables: CSV with units in the headers, and MAT."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from towtank.artefact import replace_file, write_text
from towtank.field.log import CHANNELS, SeaLog
from towtank.field.reading.note import WORDS, note_text
from towtank.field.reading.text import NOTE

CSV = "towtank/sea-log-csv/1"


def write_csv(log: SeaLog, path: Path) -> Path:
    """A record as CSV, every number in full; cells are empty where nothing was measured.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    names = list(log.channels)
    units = [CHANNELS[name][0] for name in names]
    lines = [f"# {CSV}", *([f"# {WORDS}"] if log.synthetic else []), f"# {NOTE} {note_text(log)}"]
    lines.append(",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))]))
    table = np.column_stack([log.time, *(log.channels[name] for name in names)])
    lines += [",".join("" if np.isnan(x) else repr(x) for x in row) for row in table.tolist()]
    return write_text(path, "\n".join(lines) + "\n")


def write_mat(log: SeaLog, path: Path) -> Path:
    """A record as a MAT file of version 7: time, one variable for each channel [SI], units, and the note.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    from scipy.io import savemat

    content = {
        "towtank": note_text(log),
        "units": {"time": "s", **{name: CHANNELS[name][0] for name in log.channels}},
        "time": log.time, **{name: np.asarray(values, dtype=float) for name, values in log.channels.items()},
    }  # fmt: skip

    def write(part: Path) -> None:
        with part.open("wb") as file:
            savemat(file, content, do_compression=True, oned_as="column")

    return replace_file(path, write)
