"""``faults.json``: a mission with jammed fins, written whole, read back equal."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.trials.jammed import JammedFins

SCHEMA = "towtank/faults/1"
_ARRAYS = ("angle", "off_track", "depth_error", "fin_rms", "left")


def write_jammed(found: JammedFins, path: Path | str) -> Path:
    """Write ``found`` as JSON, schema ``towtank/faults/1``; SI, radians, fin rms in degrees; null where not reached.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(Path(path), {"schema": SCHEMA, **asdict(found)})


def read_jammed(path: Path | str) -> JammedFins:
    """Read what ``write_jammed`` wrote.

    Raises
    ------
    ArtefactError
        Missing, another schema, or not whole.
    """
    document = read_json(Path(path), SCHEMA)
    try:
        known: dict[str, Any] = {field.name: document[field.name] for field in fields(JammedFins)}
        known |= {name: np.array(document[name], dtype=float) for name in _ARRAYS}
        known |= {
            "fins": tuple(known["fins"]), "notes": tuple(known["notes"]),
            "completed": np.array(known["completed"], dtype=bool),
            "why": tuple(tuple(row) for row in known["why"]),
            "sound": tuple(math.nan if x is None else float(x) for x in known["sound"]),
        }  # fmt: skip
        return JammedFins(**known)
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path} is not whole ({error}). Run `towtank faults` again.") from None
