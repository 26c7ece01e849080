"""Processes of this machine that share a list of items; one that dies is replaced and its item started again."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from typing import Any

from towtank.errors import TowtankError

DEATHS = 3
"""Processes that may die on one item before it is given up."""

Work = Callable[[Any, Any], Any]


class Perished(TowtankError):
    """The processes that worked on an item died, ``DEATHS`` times over."""


@dataclass
class _Hand:
    """One process, its end of the pipe, and the number of the item it works on."""

    process: ForkServerProcess
    pipe: Connection
    number: int = -1


def as_done(work: Work, shared: Any, items: Sequence[Any], workers: int) -> Iterator[tuple[int, Any]]:
    """(number, ``work(shared, item)``) of every item, in the order in which they end.

    work : a function of a module.   shared, items, results : can be pickled.   workers : processes, at least one.
    An item whose process dies is started again in a new one, ``DEATHS`` times; then it yields a ``Perished``. What
    ``work`` raises is raised here. The processes end with the iteration, whatever the reason.
    """
    to_do, deaths = deque(range(len(items))), [0] * len(items)
    crew = [_hired(work, shared) for _ in range(min(workers, len(items)))]
    try:
        for hand in crew:
            _give(hand, to_do, items)
        while busy := {hand.pipe: hand for hand in crew if hand.number >= 0}:
            for pipe in wait(list(busy)):
                hand = busy[pipe]  # type: ignore[index]
                number, answer = hand.number, _answer(hand)
                if isinstance(answer, Perished):
                    crew[crew.index(hand)] = hand = _hired(work, shared)
                    deaths[number] += 1
                    if deaths[number] < DEATHS:
                        to_do.appendleft(number)
                _give(hand, to_do, items)
                if not isinstance(answer, Perished) or deaths[number] >= DEATHS:
                    yield number, answer
    finally:
        for hand in crew:
            hand.process.terminate()
        for hand in crew:
            hand.process.join()
            hand.pipe.close()


def _hired(work: Work, shared: Any) -> _Hand:
    context = multiprocessing.get_context("forkserver")
    here, there = context.Pipe()
    process = context.Process(target=_labour, args=(there, work, shared), daemon=True)
    process.start()
    there.close()  # so that the end of the process is the end of the pipe
    return _Hand(process, here)


def _give(hand: _Hand, to_do: deque[int], items: Sequence[Any]) -> None:
    hand.number = to_do.popleft() if to_do else -1
    if hand.number >= 0:
        try:
            hand.pipe.send(items[hand.number])
        except OSError:  # it died before it had anything to do; waiting for its answer will tell
            return


def _answer(hand: _Hand) -> Any:
    try:
        raised, answer = hand.pipe.recv()
    except (EOFError, OSError):
        hand.process.join()
        hand.pipe.close()
        return Perished(
            f"the process that worked on it ended {DEATHS} times (last exit code {hand.process.exitcode}). Too little "
            "memory is the usual reason: give fewer workers"
        )
    if raised:
        raise answer
    return answer


def _labour(pipe: Connection, work: Work, shared: Any) -> None:
    """Life of a process: an item in, an answer out, until the pipe ends. An interruption is the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            item = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (False, work(shared, item))
        except Exception as error:  # whatever it is, the parent raises it
            answer = (True, error)
        try:
            pipe.send(answer)
        except OSError:
            return
