"""Run blockMesh and snappyHexMesh in a folder of their own."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from towtank.artefact import write_text
from towtank.errors import TankError
from towtank.tank.openfoam.find import Installation

TEMPLATES = Path(__file__).parents[1] / "templates" / "snappy"
LOOK = 0.2
"""Seconds between two looks at whether the making is to end."""

_FINISHED = re.compile(r"Finished meshing in = (\S+) s")


def templates() -> dict[str, str]:
    """Text of each template of the mesh, by the name of its file in ``system``."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted((TEMPLATES / "system").iterdir())}


def make(
    folder: Path,
    surface: Path,
    values: Mapping[str, Any],
    installation: Installation,
    stop: threading.Event | None = None,
) -> None:
    """Make ``constant/polyMesh`` in the fresh ``folder`` about the STL file ``surface``; ``values`` : of the templates.

    Raises
    ------
    TankError
        A program is missing or fails, or ``stop`` was set.
    """
    import jinja2

    engine = jinja2.Environment(undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    for name, text in templates().items():
        write_text(folder / "system" / name, engine.from_string(text).render(values))
    (folder / "constant" / "triSurface").mkdir(parents=True)
    shutil.copyfile(surface, folder / "constant" / "triSurface" / "hull.stl")
    programs = ["blockMesh", *(["surfaceFeatureExtract"] if values["edges"] else []), "snappyHexMesh", "renumberMesh"]
    for name in programs:
        options = ["-overwrite"] if name in ("snappyHexMesh", "renumberMesh") else []
        _run(folder, installation, name, options, stop)


def _run(folder: Path, installation: Installation, name: str, options: list[str], stop: threading.Event | None) -> None:
    program = installation.program(name)
    if program is None:
        raise TankError(f"OpenFOAM in {installation.project} has no {name}. Install the whole package.")
    tie = shutil.which("setpriv")
    command = [*([tie, "--pdeathsig", "KILL"] if tie else []), program, "-case", str(folder), *options]
    log = folder / f"log.{name}"
    with (
        log.open("w") as out,
        subprocess.Popen(
            command, env=installation.surroundings(), stdout=out, stderr=subprocess.STDOUT, start_new_session=True
        ) as process,
    ):
        try:
            code = _waited(process, stop)
        finally:
            with contextlib.suppress(ProcessLookupError):
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
    if code is None:
        raise TankError(f"{name} was stopped. Ask again; the mesh is begun afresh.")
    if code:
        raise TankError(
            f"{name} failed with code {code}: {_reason(log)}. See that the surface is closed and free of facets that "
            "cross each other, or change cells_across and layers."
        )


def _waited(process: subprocess.Popen[bytes], stop: threading.Event | None) -> int | None:
    """Exit code of the process; None when it was to be stopped."""
    while True:
        try:
            return process.wait(LOOK)
        except subprocess.TimeoutExpired:
            if stop is not None and stop.is_set():
                return None


def _reason(log: Path) -> str:
    lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    starts = [i for i, line in enumerate(lines) if "FATAL" in line]
    return " ".join(lines[starts[-1] + 1 : starts[-1] + 4] if starts else lines[-2:]) or "it said nothing"


def meshing_time(log: Path) -> float:
    """CPU seconds that snappyHexMesh took, by its log."""
    found = _FINISHED.search(log.read_text(encoding="utf-8", errors="replace"))
    return float(found[1]) if found else 0.0
