"""Find an installed OpenFOAM: Debian's package, openfoam.com, openfoam.org. Its bashrc is never read.

The programs need their folder of settings in ``WM_PROJECT_DIR``; outside Debian also the paths of their libraries.
"""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from towtank.errors import TankError

PROGRAMS = ("simpleFoam", "pimpleFoam", "topoSet", "checkMesh", "decomposePar", "reconstructPar")
"""What the cases call; the last two only on several cores."""

OLDEST = 1912
"""Least version of openfoam.com: the cases were run with it, and older ones are not known to read them."""

REMEDY = "On Debian or Ubuntu: make openfoam, or as root: apt-get install --no-install-recommends openfoam"
DEBIAN = Path("/usr/share/openfoam")
ROOTS = ("/usr/lib/openfoam", "/opt")
"""Folders below which openfoam.com and openfoam.org install folders named openfoam<version> or OpenFOAM-<version>."""

_BANNER = re.compile(r"Using: OpenFOAM-\S*\s*\(?(?P<version>v?\d+|[^)\s]+)\)?.*openfoam\.(?P<line>com|org)")


@dataclass(frozen=True)
class Installation:
    """An OpenFOAM that was found.

    project : its folder of settings.   version : such as "1912".   kind : debian, esi (openfoam.com) or foundation.
    bin : folder of the programs; None when they are on the PATH.   environment : variables they need.
    """

    project: Path
    version: str
    kind: str
    bin: Path | None
    environment: Mapping[str, str] = field(default_factory=dict, hash=False)

    def program(self, name: str) -> str | None:
        """Path of a program, None where it is not there."""
        return shutil.which(name, path=None if self.bin is None else str(self.bin))

    def surroundings(self) -> dict[str, str]:
        """Environment of a program, with Open MPI told that it may be run by root, as in a container."""
        allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        return {**os.environ, **allowed, **self.environment}


def find(environ: Mapping[str, str] | None = None) -> Installation | None:
    """The first installation that has its settings and simpleFoam.

    Looked for in this order: ``WM_PROJECT_DIR``, Debian's package, the folders of ``ROOTS`` with the newest first.
    """
    given = os.environ if environ is None else environ
    named = given.get("WM_PROJECT_DIR", "")
    for project in (*([Path(named)] if named else ()), DEBIAN, *_installed()):
        if (project / "etc" / "controlDict").is_file() and (found := _installation(project)) is not None:
            return found
    return None


def require() -> Installation:
    """The installation that the tank runs.

    Raises
    ------
    TankError
        None is there, a program is missing, or its version is not one the cases are written for.
    """
    found = find()
    if found is None:
        raise TankError(f"OpenFOAM is not installed: no simpleFoam with its settings was found. {REMEDY}.")
    if lacking := missing(found):
        raise TankError(f"OpenFOAM {found.version} in {found.project} lacks {', '.join(lacking)}. {REMEDY}.")
    if why := unfit(found):
        raise TankError(f"{why} {REMEDY}; WM_PROJECT_DIR chooses among several.")
    return found


def missing(installation: Installation) -> tuple[str, ...]:
    """Programs the cases call that are not there."""
    return tuple(name for name in PROGRAMS if installation.program(name) is None)


def unfit(installation: Installation) -> str:
    """Why the cases cannot be run with this version; empty when they can."""
    where = f"OpenFOAM {installation.version} in {installation.project}"
    if installation.kind == "foundation":
        return (
            f"{where} is of openfoam.org. The cases are written for openfoam.com and Debian, whose dictionaries of "
            "moving meshes and of function objects differ."
        )
    digits = re.sub(r"\D", "", installation.version)
    if digits and int(digits) < OLDEST:
        return f"{where} is older than v{OLDEST}, the first one the cases are written for."
    return ""


def _installed() -> Iterator[Path]:
    """Folders of installations below ``ROOTS``, the newest version first."""
    found = [path for root in ROOTS for path in Path(root).glob("[oO]pen[fF][oO][aA][mM]*") if path.is_dir()]
    return iter(sorted(found, key=lambda path: re.sub(r"\D", "", path.name).zfill(6), reverse=True))


def _installation(project: Path) -> Installation | None:
    built = sorted(project.glob("platforms/*/bin/simpleFoam"))
    if built:
        binaries = built[0].parent
        libraries = _library_path(binaries.parent / "lib")
        environment = {"WM_PROJECT_DIR": str(project), "LD_LIBRARY_PATH": libraries}
        environment["PATH"] = f"{binaries}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
        version, line = _version_of_folder(project)
        return Installation(project, version, "foundation" if line == "org" else "esi", binaries, environment)
    program = shutil.which("simpleFoam")
    if program is None:
        return None
    version, line = _version_said(program, str(project))
    kind = "debian" if project == DEBIAN else "foundation" if line == "org" else "esi"
    return Installation(project, version, kind, None, {"WM_PROJECT_DIR": str(project)})


def _library_path(lib: Path) -> str:
    """Search path of the libraries: their folder, that of the MPI built with, and what was set before."""
    mpi = sorted(path for path in lib.glob("*mpi*") if path.is_dir())
    before = os.environ.get("LD_LIBRARY_PATH", "")
    return os.pathsep.join([*map(str, mpi), str(lib), str(lib / "dummy"), *([before] if before else [])])


def _version_of_folder(project: Path) -> tuple[str, str]:
    """Version and line (com, org) of a folder such as openfoam2312, OpenFOAM-v2112 or openfoam10."""
    told = project / "META-INFO" / "api-info"
    if told.is_file() and (api := re.search(r"api=(\d+)", told.read_text(encoding="utf-8", errors="replace"))):
        return api[1], "com"
    version = re.sub(r"^[oO]pen[fF][oO][aA][mM]-?v?", "", project.name)
    # openfoam.com numbers by year and month, four digits; openfoam.org counts 8, 9, 10 ...
    return version, "com" if len(re.sub(r"\D", "", version)) == 4 else "org"


@functools.lru_cache(maxsize=8)
def _version_said(program: str, project: str) -> tuple[str, str]:
    """Version and line (com, org) that ``program -help`` states; empty texts where it states none."""
    try:
        done = subprocess.run(
            [program, "-help"],
            env={**os.environ, "WM_PROJECT_DIR": project},
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return "", ""
    said = _BANNER.search(done.stdout)
    return (said["version"], said["line"]) if said else ("", "")
