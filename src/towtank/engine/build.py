"""From a form to a shared library: C text, compiler, and where libraries lie.

A library's file name holds a hash of every source it came from, so a library of an older text is never loaded.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from towtank.engine.form import Form
from towtank.errors import TowtankError

ROOT = Path(__file__).resolve().parents[1]
C_SOURCES = Path(__file__).resolve().parent / "c"
SHIPPED_LIBRARIES = Path(__file__).resolve().parent / "lib"
"""Libraries compiled at install."""

_TEXTS = ("model/*.py", "pilot/law.py", "pilot/orders.py", "pilot/allocation.py", "pilot/guidance.py", "symbols.py",
          "engine/form.py", "engine/loop.py", "engine/trace.py", "engine/emit.py", "engine/build.py", "engine/c/*")  # fmt: skip
"""What a library depends on, below the package's folder."""

_FLAGS = ("-O2", "-ftree-vectorize", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-Wno-psabi",
          "-std=gnu11", "-fPIC", "-fvisibility=hidden")  # fmt: skip
"""No -ffast-math and no -ffinite-math-only: a state that is not finite must be seen."""


@dataclass(frozen=True)
class Target:
    """An instruction set: lanes of its packs and the compiler's flags. ``needs``: flags of the CPU."""

    name: str
    lanes: int
    flags: tuple[str, ...] = ()
    needs: frozenset[str] = frozenset()


_V3 = frozenset("avx avx2 bmi1 bmi2 f16c fma movbe".split())
_V4 = _V3 | frozenset("avx512f avx512bw avx512cd avx512dq avx512vl".split())
X86 = (
    Target("avx512", 8, ("-march=x86-64-v4", "-mprefer-vector-width=512", "-ffp-contract=fast"), _V4),
    Target("avx2", 4, ("-march=x86-64-v3", "-ffp-contract=fast"), _V3),
    Target("sse2", 2, ("-march=x86-64",)),
)
"""Best first. Eight lanes on AVX2 lose a quarter to spills (ENGINE notes)."""
OTHER = (Target("generic", 2),)


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


def library_name(form: Form, target: Target) -> str:
    """File name of the library of a form without an extra load."""
    return f"{form.word}.{target.name}.{source_hash()}.so"


def cache_folder() -> Path:
    """Where libraries compiled on demand lie."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(home) / "towtank" / "engine"


def compiler() -> str | None:
    """The system's C compiler: $CC, else cc, gcc or clang; None when there is none."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    return next((found for name in names if name and (found := shutil.which(name))), None)


def c_text(form: Form) -> dict[str, str]:
    """File name -> C text of ``form``. The same form gives the same bytes in every process."""
    from towtank.engine.trace import model_header, slopes_header, traced

    trace = traced(form)
    return {"model.h": model_header(trace), "slopes.h": slopes_header(trace)}


def compile_library(texts: dict[str, str], target: Target, out: Path) -> Path:
    """Compile the C ``texts`` of a form for ``target`` into ``out``; the file appears whole or not at all.

    Raises
    ------
    TowtankError
        No compiler, or it fails.
    """
    cc = compiler()
    if cc is None:
        raise TowtankError(
            "engine: no C compiler (cc, gcc or clang) was found. Install one, or set CC; without it everything runs on "
            "numpy, slower."
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
        work = Path(folder)
        for name, text in texts.items():
            (work / name).write_text(text)
        flags = [cc, *_FLAGS, *target.flags, f"-I{work}", f"-I{C_SOURCES}"]
        objects, running = [], []
        for source, suffix, lanes in (("loop", "one", 1), ("loop", "pack", target.lanes), ("slopes", "one", 1)):
            made = work / f"{source}_{suffix}.o"
            macros = [f"-DLANES={lanes}", f"-DWIDE={target.lanes}", f"-DNAME(x)=x##_{suffix}"]
            command = [*flags, *macros, "-c", str(C_SOURCES / f"{source}.c"), "-o", str(made)]
            running.append((command, subprocess.Popen(command, stderr=subprocess.PIPE, text=True)))
            objects.append(str(made))
        for command, process in running:
            _checked(command, process)
        linked = work / "library.so"
        link = [cc, "-shared", *objects, "-lm", "-o", str(linked)]
        _checked(link, subprocess.Popen(link, stderr=subprocess.PIPE, text=True))
        linked.replace(out)
    return out


def _checked(command: list[str], process: subprocess.Popen[str]) -> None:
    error = process.communicate()[1]
    if process.returncode:
        raise TowtankError(
            f"engine: the C compiler failed ({' '.join(command[:1])}, status {process.returncode}): "
            f"{error.strip()[-2000:]}. Without a library everything runs on numpy, slower."
        )


def build(forms: Iterable[Form], folder: Path, only: Iterable[Target] | None = None) -> list[Path]:
    """Compile ``forms`` for every target into ``folder``; libraries of older texts are removed."""
    made = []
    for form in forms:
        texts = c_text(form)
        made += [compile_library(texts, target, folder / library_name(form, target)) for target in only or targets()]
    for old in folder.glob("*.so"):
        if old not in made:
            old.unlink()
    return made
