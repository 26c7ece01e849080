"""Tables in netCDF and MATLAB files."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.tank.imported.table import Table, read_bytes

_COLUMN = re.compile(r"^(?P<name>.+)\(:,\s*(?P<column>\d+)\)$")
_STEP = re.compile(r"^(?P<name>[^()]*)(?:\((?P<index>\d+)\))?$")
Find = Callable[[str], tuple[Any, str]]
"""Name of a variable -> its values and its unit."""


def read_netcdf_columns(path: Path, wanted: Sequence[str]) -> Table:
    """Variables ``wanted`` of a netCDF file, with the units of their attribute ``units``.

    Raises
    ------
    InputError
        Missing, empty, no netCDF-4 file, no such variable, or variables of different lengths.
    """
    from towtank.netcdf import decode

    try:
        variables, _ = decode(read_bytes(path))
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise InputError(
            f"{path} is not a whole netCDF-4 file ({error}). An older netCDF-3 file is turned by nccopy -k 4."
        ) from None

    def find(name: str) -> tuple[Any, str]:
        if name not in variables:
            raise InputError(f"{path}: no variable {name!r}. The file has {', '.join(variables)}.")
        return variables[name].values, str(variables[name].attrs.get("units", ""))

    return _table(path, wanted, find)


def read_mat_columns(path: Path, wanted: Sequence[str]) -> Table:
    """Variables ``wanted`` of a MAT file of any version; structures by dots, their elements by numbers from 1.

    ``run.Fx`` is a field, ``runs(2).Fx`` that of the second element of a structure array, ``run.fins(:,3)`` the third
    column of a matrix.

    Raises
    ------
    InputError
        Missing, empty, no MAT file, no such variable, or variables of different lengths.
    """
    content = read_bytes(path)
    if b"MATLAB 7.3" in content[:128] or content[:8] == b"\x89HDF\r\n\x1a\n":
        import h5py

        try:
            with h5py.File(io.BytesIO(content), "r") as file:
                return _table(
                    path,
                    wanted,
                    lambda name: (_of_matrix(name, path, lambda whole: np.transpose(_of_hdf(file, whole, path))), ""),
                )
        except (OSError, RuntimeError, KeyError, ValueError, MemoryError) as error:
            raise InputError(f"{path} is not a whole MAT file ({error}). Save it again.") from None
    from scipy.io import loadmat

    try:
        found = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=True)
    except Exception as error:  # scipy raises many kinds on damaged files
        raise InputError(f"{path} is not a whole MAT file ({error}). Save it again.") from None
    return _table(
        path, wanted, lambda name: (_of_matrix(name, path, lambda whole: _of_structure(found, whole, path)), "")
    )


def _of_matrix(name: str, path: Path, find: Callable[[str], Any]) -> Any:
    """A variable, or one column of it."""
    found = _COLUMN.match(name)
    if found is None:
        return find(name)
    values = np.asarray(find(found["name"]))
    columns = values.shape[1] if values.ndim == 2 else 0
    if not 1 <= int(found["column"]) <= columns:
        raise InputError(f"{path}: {name!r} asks for a column of {columns}; they are counted from 1.")
    return values[:, int(found["column"]) - 1]


def _of_structure(found: dict[str, Any], name: str, path: Path) -> Any:
    value: Any = found
    for step in name.split("."):
        word, index = _step(step, name, path)
        fields = value if isinstance(value, dict) else {k: getattr(value, k) for k in getattr(value, "_fieldnames", ())}
        if word not in fields:
            known = ", ".join(k for k in fields if not k.startswith("__"))
            raise InputError(f"{path}: no variable {name!r}; at {word!r} the file has {known or 'no fields'}.")
        value = fields[word]
        if index is not None:
            elements = np.atleast_1d(np.asarray(value, dtype=object)).ravel()
            value = elements[_within(index, len(elements), name, path)]
    return value


def _of_hdf(file: Any, name: str, path: Path) -> Any:
    import h5py

    value: Any = file
    chosen: int | None = None
    for step in name.split("."):
        word, index = _step(step, name, path)
        if not isinstance(value, h5py.Group) or word not in value:
            known = ", ".join(k for k in value if k != "#refs#") if isinstance(value, h5py.Group) else "no fields"
            raise InputError(f"{path}: no variable {name!r}; at {word!r} the file has {known}.")
        value, chosen = value[word], index if index is not None else chosen
        if isinstance(value, h5py.Dataset) and value.dtype == h5py.ref_dtype:
            references = np.ravel(value[()], order="F")
            if chosen is None and len(references) > 1:
                raise InputError(
                    f"{path}: {name!r} lies in an array of {len(references)} structures or cells. Choose one by its "
                    f"number, for example {word}(1)."
                )
            value, chosen = file[references[_within(chosen or 1, len(references), name, path)]], None
    if isinstance(value, h5py.Group):
        raise InputError(f"{path}: {name!r} is a structure with the fields {', '.join(value)}. Name one of them.")
    return value[()]


def _step(step: str, name: str, path: Path) -> tuple[str, int | None]:
    found = _STEP.match(step)
    if found is None:
        raise InputError(f"{path}: {name!r} is no name of a variable. Write for example run.Fx or runs(2).Fx.")
    return found["name"], None if found["index"] is None else int(found["index"])


def _within(index: int, count: int, name: str, path: Path) -> int:
    if not 1 <= index <= count:
        raise InputError(f"{path}: {name!r} asks for element {index} of {count}; they are counted from 1.")
    return index - 1


def _table(path: Path, wanted: Sequence[str], find: Find) -> Table:
    arrays: list[Array] = []
    units = []
    for name in wanted:
        values, unit = find(name)
        arrays.append(_vector(values, name, path))
        units.append(unit)
    lengths = {len(values) for values in arrays}
    if len(lengths) > 1:
        said = ", ".join(f"{name} {len(values)}" for name, values in zip(wanted, arrays, strict=True))
        raise InputError(f"{path}: variables of different lengths ({said}). Columns of one run are equally long.")
    count = lengths.pop()
    if count == 0:
        raise InputError(f"{path}: the variables are empty. Save the file again after the run.")
    return Table(
        tuple(wanted), tuple(units), np.column_stack(arrays), np.arange(1, count + 1, dtype=np.intp),
        np.full(count, path.name),
    )  # fmt: skip


def _vector(values: Any, name: str, path: Path) -> Array:
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise InputError(f"{path}: {name!r} holds no numbers ({array.dtype}). Map a variable of real numbers.")
    if sum(size > 1 for size in array.shape) > 1:
        raise InputError(f"{path}: {name!r} has the shape {array.shape}. Map a variable with one value for each time.")
    return np.atleast_1d(array.astype(float).squeeze())
