"""Progress as rich bars on stderr, shown only on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from towtank.progress import Progress, Silent

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


class Bars:
    """One bar per task, with the time left and the note of the last step."""

    def __init__(self, screen: RichProgress) -> None:
        self._screen = screen
        self._tasks: dict[str, TaskID] = {}

    def start(self, task: str, total: int) -> None:
        """Show a bar of ``total`` steps."""
        self._tasks[task] = self._screen.add_task(task, total=total, note="")

    def step(self, task: str, note: str = "") -> None:
        """Advance the bar; a note replaces the last one."""
        if task not in self._tasks:
            self.start(task, 0)
        self._screen.update(self._tasks[task], advance=1, note=note)

    def done(self, task: str) -> None:
        """Take the bar away; the command says what came of the task."""
        if task in self._tasks:
            self._screen.remove_task(self._tasks.pop(task))


@contextmanager
def terminal_progress() -> Iterator[Progress]:
    """Bars when stderr is a terminal, else silence."""
    if not sys.stderr.isatty():
        yield Silent()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", style="dim"),
    )
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as screen:
        yield Bars(screen)
