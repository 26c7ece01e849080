"""What towtank says of its own logs inside files of other formats: craft, zero of time, noise, and if made up."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from towtank.field.log import CHANNELS, SeaLog

MARK = "-synthetic"
"""End of the name of a file that holds a record made up."""
WORDS = "SYNTHETIC: made up by towtank, no record of a craft at sea"


def says_so(text: str) -> bool:
    """Whether a comment or a text says that the log is made up."""
    return text.strip().startswith(WORDS.partition(":")[0])


def note_of(log: SeaLog) -> dict[str, Any]:
    """The note of a record."""
    return {
        "towtank": WORDS if log.synthetic else "record written by towtank",
        "synthetic": log.synthetic, "name": log.name, "craft": log.craft, "epoch": log.epoch,
        "datum": list(log.datum) if log.datum else None, "std": dict(log.std), "bias": dict(log.bias),
        "assumed": list(log.assumed),
    }  # fmt: skip


def note_text(log: SeaLog) -> str:
    """The note on one line, without blanks after commas."""
    return json.dumps(note_of(log), separators=(",", ":"))


def numbers(note: Mapping[str, Any], key: str) -> dict[str, float]:
    """Channel -> number under ``key`` of a note; what is none is left out."""
    found = note.get(key)
    if not isinstance(found, dict):
        return {}
    return {name: float(value) for name, value in found.items() if name in CHANNELS and isinstance(value, int | float)}
