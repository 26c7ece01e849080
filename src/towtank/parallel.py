"""Independent work on several cores, in processes.

Only programs ask for more than one worker. A script that imports the package stays one process: a new process would
run the script's own text again.
"""

from __future__ import annotations

import functools
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.context import ForkServerContext
from typing import Any, TypeVar

S = TypeVar("S")
I = TypeVar("I")
R = TypeVar("R")

_SHARED: list[Any] = []


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each(work: Callable[[S, I], R], shared: S, items: Sequence[I], workers: int = 1) -> Iterator[R]:
    """``work(shared, item)`` of every item, in the order of ``items``.

    work : a function of a module.   shared, items, results : can be pickled.   workers : processes; with 1, or a
    single item, the work is done here. Give the longest items first. An exception of one item is raised here, and an
    interruption ends the processes.
    """
    if min(workers, len(items)) < 2:
        yield from (work(shared, item) for item in items)
        return
    with _context().Pool(min(workers, len(items)), _hold, (shared,)) as pool:
        yield from pool.imap(functools.partial(_work, work), items)


def prepare(*modules: str) -> None:
    """Start the server that processes are forked from, with ``modules`` imported, while other work goes on."""
    from multiprocessing import forkserver

    context = _context()
    context.set_forkserver_preload(list(modules))
    forkserver.ensure_running()


def _context() -> ForkServerContext:
    return multiprocessing.get_context("forkserver")


def _hold(shared: Any) -> None:
    """Keep what every item needs; leave an interruption to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _SHARED[:] = [shared]


def _work(work: Callable[[Any, Any], R], item: Any) -> R:
    return work(_SHARED[0], item)
