"""The compiled loop: which library this machine can run, loaded by ctypes."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank.engine.build import (
    SHIPPED_LIBRARIES,
    Target,
    c_text,
    cache_folder,
    compile_library,
    compiler,
    library_name,
    targets,
)
from towtank.engine.form import Form
from towtank.errors import InputError

CHOICE = "TOWTANK_ENGINE"
"""Environment variable: ``numpy``, or the name of a target, instead of the best this machine can run."""

_INTEGER, _REAL = ctypes.c_int64, ctypes.c_double
_REALS, _INTEGERS = ctypes.c_void_p, ctypes.c_void_p


class Task(ctypes.Structure):
    """The struct of ``c/task.h``: same fields, same order. It keeps no array alive; the caller does."""

    _fields_ = (
        ("first", _INTEGER), ("last", _INTEGER), ("common", _REALS), ("varying", _INTEGER), ("which", _INTEGERS),
        ("varied", _REALS), ("start", _REALS), ("start_stride", _INTEGER), ("legs", _INTEGER), ("plan", _REALS),
        ("plan_stride", _INTEGER), ("tick", _REAL), ("steps", _INTEGER), ("fastest", _REAL), ("gauges", _INTEGER),
        ("gauge", _REALS), ("channels", _INTEGER), ("channel", _INTEGERS), ("every", _INTEGER), ("samples", _INTEGER),
        ("log", _REALS), ("stats", _REALS), ("marks", _REALS), ("end", _REALS), ("status", _REALS),
        ("stop", ctypes.c_void_p),
    )  # fmt: skip


class Slope(ctypes.Structure):
    """The struct of ``c/slopes.c``: same fields, same order. It keeps no array alive; the caller does."""

    _fields_ = (
        ("p", _REALS), ("start", _REALS), ("ticks", _INTEGER), ("steps", _INTEGER), ("tick", _REAL), ("orders", _REALS),
        ("row", _INTEGERS), ("channels", _INTEGER), ("channel", _INTEGERS), ("seen", _REALS), ("measured", _REALS),
        ("weight", _REALS), ("misfit", _REALS), ("gradient", _REALS), ("start_gradient", _REALS),
        ("directions", _INTEGER), ("direction", _INTEGERS), ("tangent", _REALS),
    )  # fmt: skip


@dataclass(frozen=True)
class Library:
    """A loaded library: the path it came from, its target, and the compiled functions."""

    path: Path
    target: Target
    handle: Any

    def run(self, task: Task, *, alone: bool) -> int:
        """Run the trajectories of ``task``; returns how many were finished."""
        function = self.handle.run_one if alone else self.handle.run_pack
        return int(function(ctypes.byref(task)))


def wanted() -> tuple[Target, ...]:
    """Targets this machine can run, best first, or the one that the environment asks for; empty for numpy.

    Raises
    ------
    InputError
        The environment names a target that does not exist.
    """
    choice = os.environ.get(CHOICE, "")
    if choice == "numpy":
        return ()
    if choice:
        named = tuple(target for target in targets() if target.name == choice)
        if not named:
            raise InputError(
                f"{CHOICE}={choice}: choose numpy or one of {', '.join(t.name for t in targets())}, or unset it."
            )
        return named
    flags = cpu_flags()
    return tuple(target for target in targets() if target.needs <= flags)


@functools.cache
def cpu_flags() -> frozenset[str]:
    """Feature flags of the first CPU; empty where the system does not list them."""
    try:
        with Path("/proc/cpuinfo").open("rb", buffering=0) as file:
            text = file.read(8192).decode("ascii", "replace")
    except OSError:
        return frozenset()
    line = next((line for line in text.splitlines() if line.startswith("flags")), "")
    return frozenset(line.partition(":")[2].split())


def library(form: Form) -> Library | None:
    """The library of ``form``: shipped, compiled before, or compiled now; None where only numpy is left.

    A form that is not shipped, or whose shipped library is of an older text, is compiled when CasADi and a C compiler
    are there, and kept in the user's cache.
    """
    for target in wanted():
        name = _name(form, target)
        for folder in (SHIPPED_LIBRARIES, cache_folder()):
            path = folder / name
            if path.exists():
                return _loaded(path, target)
    able = wanted()
    if able and can_compile():
        return _loaded(compile_library(c_text(form), able[0], cache_folder() / _name(form, able[0])), able[0])
    return None


def can_compile() -> bool:
    """True where CasADi and a C compiler are there."""
    from importlib.util import find_spec

    return compiler() is not None and find_spec("casadi") is not None


def _name(form: Form, target: Target) -> str:
    if form.extra is None:
        return library_name(form, target)
    if not can_compile():
        return ""
    text = hashlib.sha256(_extra_text(form).encode()).hexdigest()[:16]
    return f"{form.word}.{target.name}.{text}.so"


@functools.cache
def _extra_text(form: Form) -> str:
    return "".join(c_text(form).values())


@functools.cache
def _loaded(path: Path, target: Target) -> Library:
    handle = ctypes.CDLL(str(path))
    for name in ("run_one", "run_pack"):
        getattr(handle, name).restype = _INTEGER
        getattr(handle, name).argtypes = [ctypes.POINTER(Task)]
    for name in ("misfit", "tangents"):
        getattr(handle, name).restype = ctypes.c_int
        getattr(handle, name).argtypes = [ctypes.POINTER(Slope)]
    handle.jacobians.restype = None
    handle.jacobians.argtypes = [_INTEGER, _REALS, _INTEGER, *[_REALS] * 6]
    return Library(path, target, handle)
