"""Where a file came from: version, inputs, platform, date. Every file of a study carries this block."""

from __future__ import annotations

import datetime
import hashlib
import json
import platform
from collections.abc import Mapping
from typing import Any

VERSION = "0.1.0"


def provenance(inputs: Mapping[str, str] | None = None, **extra: Any) -> dict[str, Any]:
    """Provenance block. ``inputs`` maps a name to the hash of what was read; ``extra`` is stored as given."""
    return {
        "program": "towtank",
        "version": VERSION,
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "platform": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "inputs": dict(inputs or {}),
        **extra,
    }


def digest(content: Any, length: int = 8) -> str:
    """First ``length`` hex digits of the SHA-256 of ``content`` written as canonical JSON.

    Floats are written with 12 significant digits, so that a last-bit difference is not another craft.
    """
    text = json.dumps(_plain(content), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:length]


def _plain(value: Any) -> Any:
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(v) for v in value]
    if hasattr(value, "__dataclass_fields__"):
        return {
            "": type(value).__name__,
            **{k: _plain(getattr(value, k)) for k in value.__dataclass_fields__},
        }
    raise TypeError(f"cannot digest {type(value).__name__}")
