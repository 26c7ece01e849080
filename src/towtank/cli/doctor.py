"""``towtank doctor``: what is installed, and what to do about the rest."""

from __future__ import annotations

import os
import platform
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
        engine, cpu = _engine(), _cpu()
        found = [
            _python(),
            *(_library(name, _REINSTALL) for name in _LIBRARIES),
            _engine_item(engine),
            cpu,
            *_optional(),
        ]
        missing = [item["name"] for item in found if not item["installed"]]
        reply.summary |= {"items": found, "missing": missing, "engine": engine}
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


def _engine() -> dict[str, Any]:
    """How a craft of the usual form runs. ``from``: shipped, cache, first use (it is compiled then) or "" for numpy."""
    from towtank.engine.form import SHIPPED
    from towtank.engine.library import CHOICE, find
    from towtank.errors import InputError

    choice = os.environ.get(CHOICE, "")
    out = {"path": "numpy", "lanes": 1, "from": "", "library": "", "why": "", "choice": choice}
    try:
        found = find(SHIPPED[0])
    except InputError as error:
        return out | {"path": "none", "why": str(error)}
    if found.target:
        out |= {"path": found.target.name, "lanes": found.target.lanes}
        out["from"] = "first use" if found.pending else found.origin
    return out | {"why": found.why, "library": str(found.library.path) if found.library else ""}


_ORIGINS = {
    "shipped": "compiled when the package was installed",
    "cache": "compiled before, kept in the user's cache",
    "first use": "compiled at its first use, then kept in the user's cache",
}


def _engine_item(engine: dict[str, Any]) -> dict[str, Any]:
    if engine["choice"] == "numpy":
        return _item("engine", "numpy", False, f"the closed loop, not compiled: {engine['why']}", "")
    if not engine["from"]:
        state = "cannot run" if engine["path"] == "none" else "runs on numpy, some hundred times slower"
        return _item("engine", "", False, f"the closed loop {state}", engine["why"])
    item = _item("engine", f"{engine['path']}, {engine['lanes']} lanes", False, _ORIGINS[engine["from"]], "")
    return item | ({"use": f"{item['use']}; {engine['why']}"} if engine["why"] else {})


def _cpu() -> dict[str, Any]:
    from towtank.engine.library import able

    sets = " ".join(target.name for target in able())
    return _item("CPU", sets, False, "its instruction sets that the engine has code for, best first", "")


def _optional() -> list[dict[str, Any]]:
    from towtank.engine.build import compiler

    return [
        _item("casadi", _version_of("casadi"), False, "compiles other forms of the engine", "pip install casadi"),
        _item("control", _version_of("control"), False, "robust margins, tuning", 'pip install "towtank[control]"'),
        _item("C compiler", compiler() or "", False, "the same", "apt-get install gcc, or your system's compiler"),
        _openfoam(),
    ]


def _openfoam() -> dict[str, Any]:
    from towtank.tank.openfoam.find import REMEDY, find, missing, unfit

    found = find()
    if found is None:
        return _item("OpenFOAM", "", False, "captive tests by CFD", REMEDY)
    lacking, why = missing(found), unfit(found)
    if lacking or why:
        remedy = f"{why or 'it lacks ' + ', '.join(lacking) + '.'} {REMEDY}"
        return _item("OpenFOAM", "", False, f"captive tests by CFD; {found.version} in {found.project}", remedy)
    return _item("OpenFOAM", f"{found.version} ({found.kind})", False, f"captive tests by CFD; {found.project}", "")
