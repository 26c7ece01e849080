"""``calibration.json``: the tables of a calibration; the set itself is a file of derivatives."""

from __future__ import annotations

from pathlib import Path

from towtank.artefact import write_json
from towtank.field.calibrate.result import Calibration

SCHEMA = "towtank/calibration/1"


def write_calibration(it: Calibration, path: Path | str) -> Path:
    """Write the tables of ``it`` as JSON.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    tables = it.derivatives.quality["calibration"]
    return write_json(
        Path(path), {"schema": SCHEMA, "craft": it.derivatives.craft, **tables, "provenance": it.derivatives.provenance}
    )
