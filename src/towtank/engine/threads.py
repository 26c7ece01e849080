"""The compiled loop on several cores: threads, since the loop runs outside Python."""

from __future__ import annotations

import contextlib
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
SHORT = 200_000
"""Steps of one trajectory up to which no thread is started: a tenth of a second."""


def run_threads(compiled: Library, arrays: Arrays, progress: Progress, threads: int | None) -> None:
    """Run every trajectory of ``arrays``; results are written into it.

    An interruption stops the trajectories under way at their next control period, keeps those that have ended and
    returns.
    """
    count, stop = arrays.count, ctypes.c_int32(0)
    spans = arrays.plan[..., 0].sum(axis=-1).max()
    if count == 1 and spans / arrays.clock.tick * arrays.clock.steps < SHORT:
        compiled.run(_task(arrays, 0, 1, stop), alone=True)
        return
    shared, lanes = threads or cores(), compiled.target.lanes
    # A small ensemble is cut finer: every thread has its part, and none waits long for the last.
    size = lanes * min(PIECE, max(1, math.ceil(count / (SHARES * shared * lanes))))
    firsts = range(0, count, size)
    tasks: SimpleQueue[Task] = SimpleQueue()
    for first in firsts:
        tasks.put(_task(arrays, first, min(first + size, count), stop))
    done: SimpleQueue[Exception | None] = SimpleQueue()

    def work() -> None:
        try:
            while not stop.value:
                compiled.run(tasks.get_nowait(), alone=count == 1)
                done.put(None)
        except Empty:
            return
        except Exception as error:  # handed on to the thread that waits
            done.put(error)

    workers = [threading.Thread(target=work, daemon=True) for _ in range(min(shared, len(firsts)))]
    progress.start("trajectories", len(firsts))
    try:
        with contextlib.suppress(KeyboardInterrupt):
            for worker in workers:
                worker.start()
            for _ in firsts:
                if error := done.get():
                    raise error
                progress.step("trajectories")
    finally:
        stop.value = 1
        for worker in workers:
            worker.join()
    progress.done("trajectories")


def _task(a: Arrays, first: int, last: int, stop: ctypes.c_int32) -> Task:
    def address(array: NDArray[Any]) -> int | None:
        return array.ctypes.data if array.size else None

    return Task(
        first=first, last=last, common=address(a.common), varying=len(a.which), which=address(a.which),
        varied=address(a.varied), start=address(a.start), start_stride=a.start.shape[-1] if a.start.ndim == 2 else 0,
        legs=a.plan.shape[-2], plan=address(a.plan),
        plan_stride=int(np.prod(a.plan.shape[1:])) if a.plan.ndim == 3 else 0,
        tick=a.clock.tick, steps=a.clock.steps, fastest=address(a.fastest), gauges=len(a.gauge), gauge=address(a.gauge),
        channels=len(a.channel), channel=address(a.channel), every=a.every, samples=a.log.shape[1], log=address(a.log),
        stats=address(a.stats), marks=address(a.marks), end=address(a.end), status=address(a.status),
        sensors=address(a.sensors), seed=a.seed, stop=ctypes.addressof(stop),
    )  # fmt: skip
