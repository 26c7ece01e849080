"""Reading and writing the files of a study.

A file is written under a temporary name and renamed, so it is either whole or absent. JSON for results, netCDF-4 for
series. Every document carries ``schema`` and ``provenance``.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import ArtefactError
from towtank.frames import Array
from towtank.netcdf import Variable as Variable
from towtank.netcdf import decode, encode


def replace_file(path: Path, write: Callable[[Path], None]) -> Path:
    """Let ``write`` fill a temporary file beside ``path``, then rename it. Nothing half-written stays.

    Raises
    ------
    ArtefactError
        The folder cannot be made or written, or the disk is full.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(part)
        part.replace(path)
    except OSError as error:
        raise ArtefactError(
            f"cannot write {path}: {error.strerror or error}. Choose a folder you may write to "
            "with --out DIR, or free some space; files already written are whole."
        ) from error
    finally:
        with contextlib.suppress(OSError):  # a parent that is a file or read-only has been told above
            part.unlink(missing_ok=True)
    return path


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` whole or not at all."""
    return replace_file(path, lambda part: _write(part, text))


def _write(part: Path, text: str) -> None:
    part.write_text(text, encoding="utf-8")


def write_json(path: Path, document: Mapping[str, Any]) -> Path:
    """Write a JSON document that has a ``schema`` key. NaN and infinity are written as null."""
    if "schema" not in document:
        raise ValueError("a document needs a schema")
    return write_text(path, json_text(document))


def json_text(document: Mapping[str, Any]) -> str:
    """``document`` as JSON text with a line end. NaN and infinity become null, arrays lists."""
    return json.dumps(_jsonable(document), indent=1, allow_nan=False) + "\n"


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _jsonable(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        return _jsonable(value.tolist())
    if isinstance(value, list | tuple):
        return [_jsonable(v) for v in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def read_json(path: Path, schema: str) -> dict[str, Any]:
    """Read a JSON document and check its ``schema`` (noun and major number).

    Raises
    ------
    ArtefactError
        Missing, not JSON, or another schema.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ArtefactError(f"{path} does not exist. Run the stage that writes it first.") from None
    except (OSError, ValueError) as error:
        raise ArtefactError(
            f"{path} is not a readable JSON file ({error}). Delete it and run its stage again."
        ) from None
    found = document.get("schema") if isinstance(document, dict) else None
    if found != schema:
        raise ArtefactError(
            f"{path} has schema {found!r}, wanted {schema!r}. It was written by another stage or version."
        )
    return dict(document)


def write_netcdf(path: Path, schema: str, variables: Mapping[str, Variable], attrs: Mapping[str, Any]) -> Path:
    """Write a netCDF-4 file. Attributes that are not text or numbers are stored as JSON text."""
    stored = {
        key: value if isinstance(value, str | int | float) else json.dumps(_jsonable(value))
        for key, value in attrs.items()
    }
    content = encode(variables, {"schema": schema, **stored})
    return replace_file(path, lambda part: _write_bytes(part, content))


def _write_bytes(part: Path, content: bytes) -> None:
    part.write_bytes(content)


def read_netcdf(path: Path, schema: str) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Read a netCDF-4 file written by ``write_netcdf``. JSON attributes come back as text.

    Raises
    ------
    ArtefactError
        Missing, empty, truncated, or another schema.
    """
    if not path.exists():
        raise ArtefactError(f"{path} does not exist. Run the stage that writes it first.")
    try:
        variables, attrs = decode(path.read_bytes())
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise ArtefactError(
            f"{path} is not a whole netCDF-4 file ({error}). Delete it; its stage will write it again."
        ) from None
    if attrs.get("schema") != schema:
        raise ArtefactError(f"{path} has schema {attrs.get('schema')!r}, wanted {schema!r}.")
    return variables, attrs


def series(
    names: Sequence[str], values: Array, dims: tuple[str, ...], attrs: Mapping[str, Mapping[str, str]]
) -> dict[str, Variable]:
    """Variables named ``names``, one for each last-axis column of ``values``."""
    return {
        name: Variable(dims, np.ascontiguousarray(values[..., i]), attrs.get(name, {})) for i, name in enumerate(names)
    }
