"""Reading and writing the files of a study.

A file is written under a temporary name and renamed, so it is either whole or absent. JSON for results, netCDF-4 for
series. Every document carries ``schema`` and ``provenance``.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import ArtefactError
from towtank.frames import Array


@dataclass(frozen=True)
class Variable:
    """One netCDF variable: dimension names, values, attributes (``units``, ``long_name``)."""

    dims: tuple[str, ...]
    values: Array
    attrs: Mapping[str, str] = field(default_factory=dict)


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
        part.unlink(missing_ok=True) if os.access(path.parent, os.W_OK) else None
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
    import h5netcdf

    def write(part: Path) -> None:
        with h5netcdf.File(part, "w") as file:
            file.attrs["schema"] = schema
            for key, value in attrs.items():
                file.attrs[key] = value if isinstance(value, str | int | float) else json.dumps(_jsonable(value))
            for name, variable in variables.items():
                values = np.asarray(variable.values)
                for dim, size in zip(variable.dims, values.shape, strict=True):
                    if dim not in file.dimensions:
                        file.dimensions[dim] = size
                stored = file.create_variable(name, variable.dims, values.dtype, data=values)
                stored.attrs.update(dict(variable.attrs))

    return replace_file(path, write)


def read_netcdf(path: Path, schema: str) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Read a netCDF-4 file written by ``write_netcdf``. JSON attributes come back as text.

    Raises
    ------
    ArtefactError
        Missing, empty, truncated, or another schema.
    """
    import h5netcdf

    if not path.exists():
        raise ArtefactError(f"{path} does not exist. Run the stage that writes it first.")
    try:
        with h5netcdf.File(path, "r") as file:
            attrs = {key: file.attrs[key] for key in file.attrs}
            variables = {
                name: Variable(
                    tuple(item.dimensions), np.asarray(item[...]), {k: str(item.attrs[k]) for k in item.attrs}
                )
                for name, item in file.variables.items()
            }
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
