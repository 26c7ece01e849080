"""Progress of long work, as a protocol: a rich bar, a web page and a test spy implement it."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Told of each step; never asked anything."""

    def start(self, task: str, total: int) -> None:
        """``task`` begins; it has ``total`` steps."""

    def step(self, task: str, note: str = "") -> None:
        """One step of ``task`` is done."""

    def done(self, task: str) -> None:
        """``task`` ended."""


class Silent:
    """Progress that says nothing."""

    def start(self, task: str, total: int) -> None:
        """Do nothing."""

    def step(self, task: str, note: str = "") -> None:
        """Do nothing."""

    def done(self, task: str) -> None:
        """Do nothing."""
