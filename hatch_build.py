"""Build hook: compiles the engine into src/towtank/engine/lib/, so that neither CasADi nor a compiler is needed to run.

A wheel gets every target of its platform; an editable installation the best one that this machine runs. Without CasADi
or a C compiler, or with TOWTANK_NO_ENGINE=1, the package is built without libraries and runs on numpy.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SKIP = "TOWTANK_NO_ENGINE"
NEEDS = ["casadi>=3.6", "numpy>=2"]


class EngineHook(BuildHookInterface[Any]):
    """Compile, then tag the wheel for its platform."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """What the build needs beside hatchling."""
        return [] if _skipped() else NEEDS

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile into the source tree; ``version`` is "editable" or "standard"."""
        made, remarks = _compiled(Path(self.root), best_only=version == "editable")
        for remark in remarks:
            self.app.display_warning(remark)
        self.app.display_info(f"towtank: {len(made)} libraries of the engine, {_size(made) / 1e6:.1f} MB")
        if version != "editable" and made:
            build_data["artifacts"] += [path.relative_to(self.root).as_posix() for path in made]
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{_platform()}"


def _skipped() -> bool:
    return os.environ.get(SKIP, "") not in ("", "0")


def _compiled(root: Path, *, best_only: bool) -> tuple[list[Path], list[str]]:
    """Libraries made, and what is to be told."""
    without = "towtank is installed without its compiled engine and runs on numpy, slower. `towtank doctor` says more."
    if _skipped():
        return [], [f"{SKIP} is set: {without}"]
    sys.path.insert(0, str(root / "src"))
    begin = time.perf_counter()
    try:
        from towtank.engine.build import SHIPPED_LIBRARIES, build, targets
        from towtank.engine.form import SHIPPED
        from towtank.engine.library import able
        from towtank.errors import TowtankError

        try:
            made, errors = build(SHIPPED, SHIPPED_LIBRARIES, able()[:1] if best_only else targets())
        except TowtankError as error:
            return [], [f"{error} {without}"]
    except ImportError as error:
        return [], [f"The engine is not compiled ({error}): {without}"]
    finally:
        sys.path.remove(str(root / "src"))
    return made, [*errors, f"towtank: engine compiled in {time.perf_counter() - begin:.0f} s"]


def _size(paths: list[Path]) -> int:
    return sum(path.stat().st_size for path in paths)


def _platform() -> str:
    """Platform tag of this machine's own wheels; no promise on the age of its C library (manylinux) is made."""
    from packaging.tags import platform_tags

    own = (tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux")))
    return next(own)
