"""The compiled loop on several cores: threads, since the loop runs outside Python."""

from __future__ import annotations

import ctypes
import math
import threading
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towtank.engine.library import Library, Task
from towtank.engine.run import Arrays
from towtank.parallel import cores
from towtank.progress import Progress

PIECE = 64
"""Most packs handed to a thread at a time."""
SHARES = 4
"""Pieces for each thread, at least, where there are packs enough."""
ALONE = 1
"""Up to this many trajectories are run one by one, without packs."""


def run_threads(compiled: Library, arrays: Arrays, progress: Progress, threads: int | None) -> None:
    """Run every trajectory of ``arrays``; results are written into it.

    An interruption lets the packs under way end, keeps what is finished and returns.
    """
    count = arrays.count
    alone = count <= ALONE
    stop = ctypes.c_int32(0)
    if alone:
        compiled.run(_task(arrays, 0, count, stop), alone=True)
        return
    shared, lanes = threads or cores(), compiled.target.lanes
    # A small ensemble is cut finer: every thread has its part, and none waits long for the last.
    size = lanes * min(PIECE, max(1, math.ceil(count / (SHARES * shared * lanes))))
    pieces: SimpleQueue[tuple[int, int]] = SimpleQueue()
    for first in range(0, count, size):
        pieces.put((first, min(first + size, count)))
    total = pieces.qsize()
    done: SimpleQueue[int] = SimpleQueue()

    def work() -> None:
        while not stop.value:
            try:
                first, last = pieces.get_nowait()
            except Empty:
                return
            compiled.run(_task(arrays, first, last, stop), alone=False)
            done.put(last - first)

    workers = [threading.Thread(target=work, daemon=True) for _ in range(min(shared, total))]
    progress.start("trajectories", total)
    try:
        for worker in workers:
            worker.start()
        _watch(workers, done, progress)
    except KeyboardInterrupt:
        stop.value = 1
    for worker in workers:
        worker.join()
    progress.done("trajectories")


def _watch(workers: list[threading.Thread], done: SimpleQueue[int], progress: Progress) -> None:
    """Pass on progress until every worker is through."""
    while any(worker.is_alive() for worker in workers):
        try:
            progress.step("trajectories", f"{done.get(timeout=0.05)}")
        except Empty:
            continue
    while not done.empty():
        progress.step("trajectories", f"{done.get()}")


def _task(a: Arrays, first: int, last: int, stop: ctypes.c_int32) -> Task:
    def address(array: NDArray[Any]) -> int | None:
        return array.ctypes.data if array.size else None

    return Task(
        first=first, last=last, common=address(a.common), varying=len(a.which), which=address(a.which),
        varied=address(a.varied), start=address(a.start), start_stride=a.start.shape[-1] if a.start.ndim == 2 else 0,
        legs=a.plan.shape[-2], plan=address(a.plan),
        plan_stride=int(np.prod(a.plan.shape[1:])) if a.plan.ndim == 3 else 0,
        tick=a.clock.tick, steps=a.clock.steps, fastest=a.fastest, gauges=len(a.gauge), gauge=address(a.gauge),
        channels=len(a.channel), channel=address(a.channel), every=a.every, samples=a.log.shape[1], log=address(a.log),
        stats=address(a.stats), marks=address(a.marks), end=address(a.end), status=address(a.status),
        stop=ctypes.addressof(stop),
    )  # fmt: skip
