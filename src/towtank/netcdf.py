"""netCDF-4 files as bytes.

A netCDF-4 file is an HDF5 file whose dimensions are dimension scales. It is written here through h5py's low-level
interface: h5netcdf needs 3 to 7 ms for each variable, and a captive campaign has some 6000 of them.

The data of a variable lie in one block at a known place. Files of the same layout (names, shapes, types and attributes
of the variables) are therefore made from one image, by overwriting those blocks and adding the attributes of the file.
A file carries the digest of its layout, so that a reader interprets dimensions and attributes once for many files.
"""

from __future__ import annotations

import functools
import hashlib
import io
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from towtank.frames import Array

_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable.%10d"
_HIDDEN = (b"DIMENSION_LIST", b"REFERENCE_LIST", b"CLASS", b"NAME", b"_Netcdf4Dimid", b"_Netcdf4Coordinates")

_LAYOUT = "layout"
_LAYOUTS_KEPT = 64
_COUNT = itertools.count()
_DESCRIBED: dict[str, dict[str, tuple[tuple[str, ...], dict[str, str]]]] = {}

_Layout = tuple[tuple[str, tuple[str, ...], tuple[int, ...], str, tuple[tuple[str, str], ...]], ...]


@dataclass(frozen=True)
class Variable:
    """One netCDF variable: dimension names, values, attributes (``units``, ``long_name``)."""

    dims: tuple[str, ...]
    values: Array
    attrs: Mapping[str, str] = field(default_factory=dict)


def encode(variables: Mapping[str, Variable], attrs: Mapping[str, str | int | float]) -> bytes:
    """The bytes of a netCDF-4 file with these variables and file attributes."""
    from h5py import h5f, h5g

    values = {name: np.asarray(variable.values, order="C") for name, variable in variables.items()}
    layout: _Layout = tuple(
        (name, variable.dims, values[name].shape, values[name].dtype.str, tuple(variable.attrs.items()))
        for name, variable in variables.items()
    )
    template, offsets = _template(layout)
    image = bytearray(template)
    for name, offset in offsets.items():
        block = values[name].tobytes()
        image[offset : offset + len(block)] = block
    file = _open(bytes(image), writable=True)
    root = h5g.open(file, b"/")
    for name, value in {**attrs, _LAYOUT: _digest(layout)}.items():
        _put(root, name, value)
    h5f.flush(file)
    return bytes(file.get_file_image())


def decode(content: bytes) -> tuple[dict[str, Variable], dict[str, Any]]:
    """Variables and file attributes of a netCDF-4 file.

    Raises
    ------
    OSError, KeyError, ValueError, RuntimeError
        The bytes are no whole netCDF-4 file.
    """
    from h5py import h5a, h5g

    root = h5g.open(_open(content, writable=False), b"/")
    try:
        return _decode_own(root) if h5a.exists(root, _LAYOUT.encode()) else _decode_foreign(content)
    except KeyError:  # ours once, copied by a program that arranges dimensions and text in its own way
        return _decode_foreign(content)


def _decode_own(root: Any) -> tuple[dict[str, Variable], dict[str, Any]]:
    """As ``decode``, for a file that ``encode`` wrote.

    Raises
    ------
    KeyError
        Dimensions or attributes are not stored as ``encode`` does.
    """
    from h5py import h5d, h5s

    sets = {name.decode(): h5d.open(root, name) for name in root}
    attrs = _attributes(root)
    layout = attrs.pop(_LAYOUT)
    described = _DESCRIBED.get(layout)
    if described is None or not set(described) <= set(sets):
        described = _describe(sets)
    if len(_DESCRIBED) < _LAYOUTS_KEPT:
        _DESCRIBED[layout] = described
    variables = {}
    for name, (dims, found) in described.items():
        values = np.empty(sets[name].shape, dtype=sets[name].dtype)
        sets[name].read(h5s.ALL, h5s.ALL, values)
        variables[name] = Variable(dims, values, found)
    return variables, attrs


def _decode_foreign(content: bytes) -> tuple[dict[str, Variable], dict[str, Any]]:
    """As ``decode``, for a file that another program wrote."""
    import h5netcdf

    with h5netcdf.File(io.BytesIO(content), "r") as file:
        variables = {
            name: Variable(tuple(item.dimensions), np.asarray(item[...]), {k: str(item.attrs[k]) for k in item.attrs})
            for name, item in file.variables.items()
        }
        return variables, {key: file.attrs[key] for key in file.attrs}


def _describe(sets: Mapping[str, Any]) -> dict[str, tuple[tuple[str, ...], dict[str, str]]]:
    """Dimensions and attributes of the variables among the datasets of a file."""
    own = {name: _attributes(item, only=(b"NAME", b"_Netcdf4Dimid")) for name, item in sets.items()}
    dims = {int(found["_Netcdf4Dimid"]): name for name, found in own.items() if "_Netcdf4Dimid" in found}
    return {
        name: (
            tuple(dims[int(number)] for number in _coordinates(item)),
            {key: str(value) for key, value in _attributes(item).items()},
        )
        for name, item in sets.items()
        if not str(own[name].get("NAME", "")).startswith(_NO_VARIABLE[:40])
    }


def _digest(layout: _Layout) -> str:
    return hashlib.sha256(repr(layout).encode()).hexdigest()[:16]


def _coordinates(item: Any) -> Array:
    """Numbers of the dimensions of a variable."""
    from h5py import h5a

    if item.shape == ():
        return np.zeros(0)
    for key in (b"_Netcdf4Coordinates", b"_Netcdf4Dimid"):
        if h5a.exists(item, key):
            attribute = h5a.open(item, key)
            values = np.empty(attribute.shape, dtype=attribute.dtype)
            attribute.read(values)
            return np.atleast_1d(values)
    raise KeyError("the dimensions of a variable")


def _open(content: bytes, *, writable: bool) -> Any:
    from h5py import h5f, h5p

    access = h5p.create(h5p.FILE_ACCESS)
    access.set_libver_bounds(h5f.LIBVER_V18, h5f.LIBVER_V18)
    access.set_fapl_core(1 << 16, False)
    access.set_file_image(content)
    return h5f.open(_name(), h5f.ACC_RDWR if writable else h5f.ACC_RDONLY, access)


def _name() -> bytes:
    """HDF5 knows an open file by its name, so each file in memory needs its own."""
    return f"towtank-{next(_COUNT)}.nc".encode()


@functools.lru_cache(maxsize=8)
def _template(layout: _Layout) -> tuple[bytes, dict[str, int]]:
    """A file of this layout with zeros as data, and the place of each variable's data in it."""
    from h5py import h5d, h5ds, h5f, h5p, h5s, h5t

    access = h5p.create(h5p.FILE_ACCESS)
    access.set_libver_bounds(h5f.LIBVER_V18, h5f.LIBVER_V18)
    access.set_fapl_core(1 << 16, False)
    create = h5p.create(h5p.FILE_CREATE)
    create.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    file = h5f.create(_name(), h5f.ACC_TRUNC, create, access)
    early = h5p.create(h5p.DATASET_CREATE)
    early.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    sets: dict[str, Any] = {}
    sizes: dict[str, int] = {}
    for name, dims, shape, dtype, attrs in layout:
        kind = h5t.py_create(np.dtype(dtype))
        sets[name] = h5d.create(file, name.encode(), kind, h5s.create_simple(shape), early)
        sizes.update(zip(dims, shape, strict=True))
        for key, value in attrs:
            _put(sets[name], key, value)
    scales = {}
    for number, (dim, size) in enumerate(sizes.items()):
        bare = dim not in sets
        scales[dim] = h5d.create(file, dim.encode(), h5t.IEEE_F32BE, h5s.create_simple((size,))) if bare else sets[dim]
        h5ds.set_scale(scales[dim], (_NO_VARIABLE % size if bare else dim).encode())
        _put(scales[dim], "_Netcdf4Dimid", np.int32(number))
    order = list(sizes)
    for name, dims, *_ in layout:
        if name in scales or not dims:
            continue
        _put(sets[name], "_Netcdf4Coordinates", np.array([order.index(dim) for dim in dims], dtype=np.int32))
        for axis, dim in enumerate(dims):
            h5ds.attach_scale(sets[name], scales[dim], axis)
    h5f.flush(file)
    return bytes(file.get_file_image()), {
        name: item.get_offset() for name, item in sets.items() if item.get_offset() is not None
    }


def _put(owner: Any, name: str, value: Any) -> None:
    """Attribute of a dataset or group: text of fixed length in UTF-8, or a number or array of numbers."""
    from h5py import h5a, h5s, h5t

    if isinstance(value, str):
        data = value.encode() or b"\0"
        kind = h5t.C_S1.copy()
        kind.set_size(len(data))
        kind.set_strpad(h5t.STR_NULLPAD)
        kind.set_cset(h5t.CSET_UTF8)
        text = np.array(data, dtype=f"S{len(data)}")
        h5a.create(owner, name.encode(), kind, h5s.create(h5s.SCALAR)).write(text, kind)
        return
    array = np.asarray(value)
    space = h5s.create_simple(array.shape) if array.ndim else h5s.create(h5s.SCALAR)
    h5a.create(owner, name.encode(), h5t.py_create(array.dtype), space).write(array)


def _attributes(owner: Any, only: tuple[bytes, ...] = ()) -> dict[str, Any]:
    """Attributes of a dataset or group, without those that only HDF5 and netCDF use unless asked for by name."""
    from h5py import h5a, h5t

    found: dict[str, Any] = {}
    for i in range(h5a.get_num_attrs(owner)):
        attribute = h5a.open(owner, index=i)
        name = attribute.name
        if (name not in only) if only else (name in _HIDDEN):
            continue
        kind = attribute.get_type()
        if isinstance(kind, h5t.TypeStringID) and kind.is_variable_str():
            raise KeyError(name.decode())
        values = np.empty(attribute.shape, dtype=kind.dtype)
        attribute.read(values, kind)
        text = isinstance(kind, h5t.TypeStringID)
        found[name.decode()] = values.item().decode() if text else values.item() if values.ndim == 0 else values
    return found
