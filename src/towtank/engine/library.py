"""The compiled loop: which library this machine can run, loaded by ctypes."""

from __future__ import annotations

import ctypes
import functools
import os
import struct
import warnings
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from towtank.engine import build
from towtank.engine.build import Target, c_text, cache_folder, compile_library, compiler, library_name, targets
from towtank.engine.form import Form
from towtank.errors import InputError, TowtankError

CHOICE = "TOWTANK_ENGINE"
"""Environment variable: ``numpy``, or the name of a target, instead of the best this machine can run."""

_INTEGER, _REAL = ctypes.c_int64, ctypes.c_double
_REALS, _INTEGERS = ctypes.c_void_p, ctypes.c_void_p


class Task(ctypes.Structure):
    """The struct of ``c/task.h``: same fields, same order. It keeps no array alive; the caller does."""

    _fields_ = (
        ("first", _INTEGER), ("last", _INTEGER), ("common", _REALS), ("varying", _INTEGER), ("which", _INTEGERS),
        ("varied", _REALS), ("start", _REALS), ("start_stride", _INTEGER), ("legs", _INTEGER), ("plan", _REALS),
        ("plan_stride", _INTEGER), ("tick", _REAL), ("steps", _INTEGER), ("fastest", _REALS), ("gauges", _INTEGER),
        ("gauge", _REALS), ("channels", _INTEGER), ("channel", _INTEGERS), ("every", _INTEGER), ("samples", _INTEGER),
        ("log", _REALS), ("stats", _REALS), ("marks", _REALS), ("end", _REALS), ("status", _REALS),
        ("sensors", _REALS), ("seed", _INTEGER), ("stop", ctypes.c_void_p),
    )  # fmt: skip


class Slope(ctypes.Structure):
    """The struct of ``c/slopes.c``: same fields, same order. It keeps no array alive; the caller does."""

    _fields_ = (
        ("p", _REALS), ("start", _REALS), ("ticks", _INTEGER), ("steps", _INTEGER), ("tick", _REAL), ("orders", _REALS),
        ("row", _INTEGERS), ("channels", _INTEGER), ("channel", _INTEGERS), ("seen", _REALS), ("measured", _REALS),
        ("weight", _REALS), ("misfit", _REALS), ("gradient", _REALS), ("start_gradient", _REALS),
        ("directions", _INTEGER), ("direction", _INTEGERS), ("tangent", _REALS),
    )  # fmt: skip


class EngineWarning(UserWarning):
    """The compiled loop is not used although it was wanted; results are the same, later."""


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


@dataclass(frozen=True)
class Found:
    """Where a form runs. ``origin``: shipped, cache, "" for numpy.   ``why``: why not compiled, and the remedy.

    target : the one that is used, or would be when it is ``pending``, that is compiled at its first use.
    """

    library: Library | None = None
    origin: str = ""
    why: str = ""
    target: Target | None = None
    pending: bool = False


def able() -> tuple[Target, ...]:
    """Targets this machine can run, best first."""
    flags = cpu_flags()
    return tuple(target for target in targets() if target.needs <= flags)


def wanted() -> tuple[Target, ...]:
    """Targets this machine can run, best first, or the one that the environment asks for; empty for numpy.

    Raises
    ------
    InputError
        The environment names a target that does not exist, or that this CPU cannot run.
    """
    choice = os.environ.get(CHOICE, "")
    if not choice:
        return able()
    if choice == "numpy":
        return ()
    named = tuple(target for target in targets() if target.name == choice)
    if not named:
        raise InputError(
            f"{CHOICE}={choice}: choose numpy or one of {', '.join(t.name for t in targets())}, or unset it."
        )
    lacking = named[0].needs - cpu_flags()
    if lacking:
        raise InputError(
            f"{CHOICE}={choice}: this CPU lacks {', '.join(sorted(lacking))}, so the program would be ended by the "
            f"system. Choose numpy or one of {', '.join(t.name for t in able())}, or unset it."
        )
    return named


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
    are there, and kept in the user's cache. What goes wrong on the way is warned of once.
    """
    return _kept(_nameless(form), wanted(), _surroundings()).library


def find(form: Form) -> Found:
    """Where ``form`` would run now, without compiling anything."""
    return _search(_nameless(form), wanted())


def can_compile() -> bool:
    """True where CasADi and a C compiler are there."""
    return not _lacking()


def _lacking() -> str:
    """What compiling lacks, with the remedy; "" for nothing."""
    if compiler() is None:
        return "no C compiler (cc, gcc or clang) was found. Install one, or set CC to one"
    return _no_casadi()


def _no_casadi() -> str:
    from importlib.util import find_spec

    return "" if find_spec("casadi") else "CasADi is not installed. Install it: pip install casadi"


def _surroundings() -> tuple[str, ...]:
    """What a search depends on beside the form and the targets."""
    names = ("CC", "PATH", "XDG_CACHE_HOME", "HOME")
    return (str(build.SHIPPED_LIBRARIES), *(os.environ.get(name, "") for name in names))


def _nameless(form: Form) -> Form:
    """The form without the numbers of its extra load, which are parameters: one text serves them all."""
    if form.extra is None:
        return form
    return replace(form, extra=form.extra.with_values(dict.fromkeys(form.extra.values, 0.0)))


@functools.cache
def _kept(form: Form, able: tuple[Target, ...], surroundings: tuple[str, ...]) -> Found:
    """``_search`` once per process and surroundings; compiles what is pending and warns of what went wrong."""
    found = _search(form, able)
    if found.library and found.origin == "cache":
        with suppress(OSError):
            os.utime(found.library.path)  # the cache drops what was not used for longest
    if found.pending:
        found = replace(done := _compiled(form, able), why=done.why or found.why)
    if found.why and able:
        instead = (
            f"{form.word} runs on {found.library.target.name} instead ({found.origin})."
            if found.library
            else f"{form.word} runs on numpy, some hundred times slower, with the same results; "
            f"{CHOICE}=numpy chooses that without a warning."
        )
        warnings.warn(f"engine: {found.why}. {instead}", EngineWarning, stacklevel=4)
    return found


def _search(form: Form, able: tuple[Target, ...]) -> Found:
    """The best library that is shipped; else the best that was compiled before, or can be."""
    if not able:
        return Found(why=f"{CHOICE}=numpy")
    try:
        names = {target: _name(form, target) for target in able}
    except TowtankError as error:
        return Found(why=_bare(str(error)))
    bad = ""
    for target in able if form.extra is None else ():
        path = build.SHIPPED_LIBRARIES / names[target]
        if _there(path):
            try:
                return Found(_loaded(path, target, form.smooth), "shipped", bad, target)
            except (OSError, AttributeError) as error:
                bad = bad or f"{path} cannot be loaded ({error}). Install towtank again"
    lacking = _lacking()
    for target in able:
        path = cache_folder() / names[target]
        if _there(path):
            try:
                return Found(_loaded(path, target, form.smooth), "cache", bad, target)
            except (OSError, AttributeError) as error:
                return Found(why=f"{path} cannot be loaded ({error}). Remove it, so that it is compiled again")
        if not lacking:
            return Found(why=bad, target=target, pending=True)
    return Found(why=bad or lacking)


def _compiled(form: Form, able: tuple[Target, ...]) -> Found:
    """Compile ``form`` into the cache: for the best target, or for the next one that the compiler knows."""
    why = _bare(build.unwritable(cache_folder()))
    if why:
        return Found(why=why)
    try:
        texts = _texts(form)
        for target in able:
            path = cache_folder() / _name(form, target)
            try:
                made = path if _there(path) else compile_library(texts, target, path)
                found = Found(_loaded(made, target, form.smooth), "cache")
            except (TowtankError, OSError, AttributeError) as error:
                why = why or _bare(str(error))
                continue
            build.prune(cache_folder())
            return replace(found, target=target, why=why)
    except TowtankError as error:
        why = _bare(str(error))
    return Found(why=why)


def _bare(text: str) -> str:
    return text.removeprefix("engine: ").rstrip(".")


def _name(form: Form, target: Target) -> str:
    return library_name(form, target, "".join(_texts(form).values()) if form.extra else "")


@functools.cache
def _texts(form: Form) -> dict[str, str]:
    """C text of ``form``, traced once per process.

    Raises
    ------
    TowtankError
        No CasADi, or the extra load does not run on symbols.
    """
    lacking = _no_casadi()
    if lacking:
        raise TowtankError(f"engine: {lacking}.")
    try:
        return c_text(form)
    except TowtankError:
        raise
    except Exception as error:
        if form.extra is None:
            raise
        raise TowtankError(
            f"engine: the extra load {form.extra.name!r} does not run on symbols ({type(error).__name__}: "
            f"{str(error)[:300]}). Use +, -, *, / and the functions of ops, and no if or math on its arguments."
        ) from error


def _there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:
        return False


@functools.cache
def _loaded(path: Path, target: Target, smooth: bool) -> Library:
    """Load a library, of a form that is ``smooth`` or not.

    Raises
    ------
    OSError, AttributeError
        Not a whole library of this machine, or not one of the engine.
    """
    _check_whole(path)
    handle = ctypes.CDLL(str(path))
    for name in ("run_one", "run_pack"):
        getattr(handle, name).restype = _INTEGER
        getattr(handle, name).argtypes = [ctypes.POINTER(Task)]
    for name in ("misfit", "tangents") if smooth else ():
        getattr(handle, name).restype = ctypes.c_int
        getattr(handle, name).argtypes = [ctypes.POINTER(Slope)]
    if smooth:
        handle.jacobians.restype = None
        handle.jacobians.argtypes = [_INTEGER, _REALS, _INTEGER, *[_REALS] * 6]
    return Library(path, target, handle)


def _check_whole(path: Path) -> None:
    """Refuse a file that ends before the segments its header lists: the system would end the program on loading it.

    Only 64-bit ELF is looked into; other formats are left to the system's loader.

    Raises
    ------
    OSError
        The file is cut off.
    """
    with path.open("rb") as file:
        head = file.read(4096)
    if head[:4] != b"\x7fELF" or len(head) < 64 or head[4] != 2:
        return
    order = "<" if head[5] == 1 else ">"
    (first,) = struct.unpack_from(order + "Q", head, 32)
    size, count = struct.unpack_from(order + "2H", head, 54)
    for at in range(first, first + size * count, size):
        if at + size > len(head):
            raise OSError("its header is cut off")
        begin, _, _, length = struct.unpack_from(order + "4Q", head, at + 8)
        if begin + length > path.stat().st_size:
            raise OSError("it is cut off")
