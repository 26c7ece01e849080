"""Packages that are also the stage's function: ``towtank.derive(runs)``, ``towtank.report(path, ...)``.

A package and a function of one name cannot both be an attribute of ``towtank``: importing any module of the package
puts the package there. So the package itself is made callable.
"""

from __future__ import annotations

import importlib
import sys
import types
from typing import Any


class _Stage(types.ModuleType):
    def __call__(self, *args: Any, **options: Any) -> Any:
        module, _, name = self.__dict__["ENTRY"].partition(":")
        return getattr(importlib.import_module(module), name)(*args, **options)


def make_callable(package: str) -> None:
    """Let the package forward calls to the function its ``ENTRY`` names, as ``"module:function"``."""
    sys.modules[package].__class__ = _Stage
