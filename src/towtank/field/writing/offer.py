"""Records in the formats that craft write."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from towtank.errors import InputError
from towtank.field.files import write_log
from towtank.field.log import SeaLog
from towtank.field.reading.note import MARK
from towtank.field.writing.bags import write_ros1, write_ros2
from towtank.field.writing.tables import write_csv, write_mat
from towtank.field.writing.vehicles import write_alog, write_imc, write_iver

FORMATS: Mapping[str, tuple[str, Callable[[SeaLog, Path], Path]]] = {
    "netcdf": (".nc", write_log), "csv": (".csv", write_csv), "mat": (".mat", write_mat), "alog": (".alog", write_alog),
    "ros1": (".bag", write_ros1), "ros2": ("", write_ros2), "imc": ("", write_imc), "iver": (".log", write_iver),
}  # fmt: skip
"""Format -> ending of its file (none for a folder), and what writes it."""


def write_as(log: SeaLog, path: Path | str, format: str) -> Path:
    """Write ``log`` in a format that ``read_sea_log`` reads back without a mapping; returns the path written.

    A record that was made up is marked inside the file, and the name of the file ends in ``-synthetic``.

    Parameters
    ----------
    path : with or without the ending of the format.
    format : of ``FORMATS``.

    Raises
    ------
    InputError
        No such format, or a record that it cannot hold.
    ArtefactError
        The folder cannot be written.
    """
    if format not in FORMATS:
        raise InputError(f"format {format!r} is no format of a log. Choose from {', '.join(FORMATS)}.")
    ending, write = FORMATS[format]
    path = Path(path)
    stem = path.name.removesuffix(ending) if ending else path.name
    if log.synthetic and not stem.endswith(MARK):
        stem += MARK
    return write(log, path.with_name(stem + ending))
