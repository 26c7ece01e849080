"""Arrays as text that JSON holds: exact, and a tenth of the size and the time of numbers written out."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from towtank.errors import ArtefactError
from towtank.frames import Array

KINDS = {"f8": "<f8", "f4": "<f4"}
"""Name -> little-endian layout; f4 where seven digits are enough, as for a figure."""


def packed(values: Any, kind: str = "f8") -> dict[str, Any]:
    """``values`` as ``{"kind", "shape", "base64"}``."""
    array = np.ascontiguousarray(values, dtype=KINDS[kind])
    return {"kind": kind, "shape": list(array.shape), "base64": base64.b64encode(array.tobytes()).decode("ascii")}


def unpacked(entry: Mapping[str, Any]) -> Array:
    """The array that ``packed`` wrote, in double precision.

    Raises
    ------
    ArtefactError
        It is not whole.
    """
    try:
        values = np.frombuffer(base64.b64decode(entry["base64"], validate=True), dtype=KINDS[entry["kind"]])
        return np.asarray(values.reshape(entry["shape"]), dtype=float)
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"a packed array is not whole ({error}). Delete the piece's file and ask again.") from None
