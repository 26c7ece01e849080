"""``towtank doctor``: what is installed, and what to do about the rest."""

from __future__ import annotations

import os
import platform
import shutil
from importlib import metadata
from typing import Any

from towtank.cli.options import Debug, Json
from towtank.cli.reply import Reply, answering

_LIBRARIES = (
    "numpy", "scipy", "xarray", "h5netcdf", "h5py", "pydantic", "pint", "typer", "rich", "matplotlib", "jinja2",
    "trimesh", "manifold3d",
)  # fmt: skip
_REINSTALL = "reinstall with: pip install towtank"


def doctor(json: Json = False, debug: Debug = False) -> None:
    """Say what is installed and what to do about what is not. Always exits 0.

    Example: towtank doctor --json
    """
    with answering("doctor", json, debug) as reply:
        found = [_python(), *(_library(name, _REINSTALL) for name in _LIBRARIES), *_optional()]
        reply.summary |= {"items": found, "missing": [item["name"] for item in found if not item["installed"]]}
        _print(reply, found)


def _print(reply: Reply, found: list[dict[str, Any]]) -> None:
    for item in found:
        state = item["version"] if item["installed"] else "missing"
        need = "needed" if item["needed"] else "optional"
        reply.say(f"{item['name']:<14} {state:<22} {need:<9} {item['use']}")
        if not item["installed"]:
            reply.say(f"{'':<14} -> {item['remedy']}")


def _item(name: str, version: str, needed: bool, use: str, remedy: str) -> dict[str, Any]:
    return {
        "name": name,
        "installed": bool(version),
        "version": version,
        "needed": needed,
        "use": use,
        "remedy": "" if version else remedy,
    }


def _python() -> dict[str, Any]:
    return _item("python", platform.python_version(), True, f"the interpreter, {platform.machine()}", "")


def _version_of(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _library(name: str, remedy: str) -> dict[str, Any]:
    return _item(name, _version_of(name), True, "core library", remedy)


def _optional() -> list[dict[str, Any]]:
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), "")
    return [
        _item("casadi", _version_of("casadi"), False, "optimal control and code generation", "pip install casadi"),
        _item("C compiler", compiler, False, "code generation", "apt-get install gcc, or your system's compiler"),
        _item(
            "OpenFOAM",
            os.environ.get("WM_PROJECT_VERSION", "") or shutil.which("simpleFoam") or "",
            False,
            "captive tests by CFD",
            "install OpenFOAM and source its etc/bashrc before calling towtank",
        ),
    ]
