"""From a form to a shared library: C text, compiler, and where libraries lie.

A library's file name holds a hash of every source it came from, so a library of an older text is never loaded.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shutil
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from towtank.engine.form import Form
from towtank.errors import TowtankError

ROOT = Path(__file__).resolve().parents[1]
C_SOURCES = Path(__file__).resolve().parent / "c"
SHIPPED_LIBRARIES = Path(__file__).resolve().parent / "lib"
"""Libraries compiled at install."""

_TEXTS = (
    "model/*.py", "pilot/law.py", "pilot/orders.py", "pilot/allocation.py", "pilot/guidance.py", "symbols.py",
    "engine/form.py", "engine/loop.py", "engine/trace.py", "engine/emit.py", "engine/build.py", "engine/c/*.[ch]",
)  # fmt: skip
"""What a library depends on, below the package's folder."""

_FLAGS = ("-O2", "-ftree-vectorize", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-Wno-psabi",
          "-std=gnu11", "-fPIC", "-fvisibility=hidden")  # fmt: skip
"""No -ffast-math and no -ffinite-math-only: a state that is not finite must be seen."""

KEPT = 64
"""Libraries kept in the cache; the ones not used for longest go first."""


@dataclass(frozen=True)
class Target:
    """An instruction set: lanes of its packs and the compiler's flags. ``needs``: flags of the CPU."""

    name: str
    lanes: int
    flags: tuple[str, ...] = ()
    needs: frozenset[str] = frozenset()


_V3 = frozenset(("avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"))
_V4 = _V3 | frozenset(("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"))
X86 = (
    Target("avx512", 8, ("-march=x86-64-v4", "-mprefer-vector-width=512", "-ffp-contract=fast"), _V4),
    Target("avx2", 4, ("-march=x86-64-v3", "-ffp-contract=fast"), _V3),
    Target("sse2", 2, ("-march=x86-64",)),
)
"""Best first. Eight lanes on AVX2 lose a quarter to spills (ENGINE notes)."""
OTHER = (Target("generic", 2),)


@dataclass(frozen=True)
class Job:
    """One library to be compiled: file name -> C text of a form, the target, the file that appears."""

    texts: dict[str, str]
    target: Target
    out: Path


def targets() -> tuple[Target, ...]:
    """Targets of this kind of machine, best first."""
    return X86 if platform.machine() in ("x86_64", "AMD64") else OTHER


@functools.cache
def source_hash() -> str:
    """Hash of every text the libraries depend on."""
    digest = hashlib.sha256()
    for pattern in _TEXTS:
        for path in sorted(ROOT.glob(pattern)):
            digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def library_name(form: Form, target: Target, text: str = "") -> str:
    """File name of the library of a form. ``text``: the C text, where the sources do not decide it (an extra load)."""
    key = hashlib.sha256((source_hash() + text).encode()).hexdigest()[:16] if text else source_hash()
    return f"{form.word}.{target.name}.{key}.so"


def cache_folder() -> Path:
    """Where libraries compiled on demand lie."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path("~").expanduser() / ".cache")
    return Path(home) / "towtank" / "engine"


def compiler() -> str | None:
    """The system's C compiler: $CC, else cc, gcc or clang; None when there is none."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    return next((found for name in names if name and (found := shutil.which(name))), None)


def c_text(form: Form) -> dict[str, str]:
    """File name -> C text of ``form``, with ``slopes.h`` if it is smooth; the same bytes everywhere."""
    from towtank.engine.trace import model_header, slopes_header, traced

    trace = traced(form)
    return {"model.h": model_header(trace)} | ({"slopes.h": slopes_header(trace)} if form.smooth else {})


def compile_library(texts: dict[str, str], target: Target, out: Path) -> Path:
    """Compile the C ``texts`` of a form for ``target`` into ``out``; the file appears whole or not at all.

    Raises
    ------
    TowtankError
        No compiler, it fails, or ``out`` cannot be written.
    """
    error = compile_all([Job(texts, target, out)])[0]
    if error:
        raise TowtankError(error)
    return out


def compile_all(jobs: Sequence[Job]) -> list[str]:
    """Compile every job, sharing the cores. Returns for each what went wrong, "" for nothing.

    Raises
    ------
    TowtankError
        No compiler, no temporary folder, or a folder that cannot be written.
    """
    import tempfile
    from concurrent.futures import ThreadPoolExecutor

    from towtank.parallel import cores

    for job in jobs:
        if unwritable(job.out.parent):
            raise TowtankError(unwritable(job.out.parent))
    cc = compiler()
    if cc is None:
        raise TowtankError(
            "engine: no C compiler (cc, gcc or clang) was found. Install one, or set CC; without it everything runs on "
            "numpy, slower."
        )
    with ExitStack() as stack, ThreadPoolExecutor(cores()) as pool:
        try:
            folders = [Path(stack.enter_context(tempfile.TemporaryDirectory())) for _ in jobs]
        except OSError as error:
            raise TowtankError(f"engine: no temporary folder to compile in ({error}). Set TMPDIR to one.") from error
        parts = [
            [pool.submit(_failure, command) for command in _commands(cc, job, work)]
            for job, work in zip(jobs, folders, strict=True)
        ]
        errors = ["".join(part.result() for part in some) for some in parts]
        return [
            error or _linked(cc, work, job.out) for error, work, job in zip(errors, folders, jobs, strict=True)
        ]  # fmt: skip


def _commands(cc: str, job: Job, work: Path) -> list[list[str]]:
    """Write the texts of ``job`` into ``work``; the commands that make its objects there."""
    for name, text in job.texts.items():
        (work / name).write_text(text, "utf-8")
    wide = job.target.lanes
    return [
        [cc, *_FLAGS, *job.target.flags, f"-I{work}", f"-I{C_SOURCES}", f"-DLANES={lanes}", f"-DWIDE={wide}",
         f"-DNAME(x)=x##_{suffix}", "-c", str(C_SOURCES / f"{source}.c"), "-o", str(work / f"{source}_{suffix}.o")]
        for source, suffix, lanes in (("slopes", "one", 1), ("loop", "pack", wide), ("loop", "one", 1))
        if source == "loop" or "slopes.h" in job.texts
    ]  # fmt: skip


def _linked(cc: str, work: Path, out: Path) -> str:
    """Link the objects in ``work`` into ``out``; what went wrong, "" for nothing."""
    made = work / "library.so"
    error = _failure([cc, "-shared", *map(str, sorted(work.glob("*.o"))), "-lm", "-o", str(made)])
    if error:
        return error
    part = out.with_name(f".{out.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(made.read_bytes())
            file.flush()
            os.fsync(file.fileno())
        part.replace(out)
    except OSError as problem:
        part.unlink(missing_ok=True)
        return _unwritten(out.parent, problem.strerror)
    return ""


def unwritable(folder: Path) -> str:
    """Make ``folder`` where it is missing; why nothing can be written there, "" when it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        return _unwritten(folder, problem.strerror)
    return "" if os.access(folder, os.W_OK | os.X_OK) else _unwritten(folder, "no permission")


def _unwritten(folder: Path, reason: str | None) -> str:
    return (
        f"engine: {folder} cannot be written ({reason}). Set XDG_CACHE_HOME to a folder that can, so that compiled "
        "libraries are kept."
    )


def _failure(command: list[str]) -> str:
    """Run ``command``; what went wrong, "" for nothing."""
    import subprocess

    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False
        )
    except OSError as error:
        return f"engine: the C compiler {command[0]} cannot be started ({error}). Set CC to one that works."
    if not done.returncode:
        return ""
    words = done.stderr.decode(errors="replace").strip()[-2000:]
    return f"engine: the C compiler {command[0]} failed (status {done.returncode}): {words or 'it said nothing'}."


def build(forms: Iterable[Form], folder: Path, only: Iterable[Target] | None = None) -> tuple[list[Path], list[str]]:
    """Compile ``forms`` for every target into ``folder``; libraries of older texts are removed.

    Returns the libraries made and what went wrong with the others.
    """
    wanted = tuple(only or targets())
    jobs = []
    for form in forms:
        texts = c_text(form)
        jobs += [Job(texts, target, folder / library_name(form, target)) for target in wanted]
    errors = compile_all(jobs)
    made = [job.out for job, error in zip(jobs, errors, strict=True) if not error]
    for old in folder.glob("*.so"):
        if old not in made:
            old.unlink()
    return made, [error for error in errors if error]


def prune(folder: Path, keep: int = KEPT) -> None:
    """Remove the libraries of ``folder`` beyond ``keep``, those not used for longest."""
    used = []
    for path in folder.glob("*.so"):
        try:
            used.append((path.stat().st_mtime, path))
        except OSError:
            continue  # another process removed it
    for _, path in sorted(used, reverse=True)[keep:]:
        path.unlink(missing_ok=True)
