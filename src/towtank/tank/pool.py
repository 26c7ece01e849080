"""Several runs side by side, and the order in which they are taken."""

from __future__ import annotations

import concurrent.futures
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

R = TypeVar("R")


@dataclass(frozen=True)
class Schedule:
    """Order of a campaign.

    chains : numbers of the tests; each run of a chain gains from the one before it. Every test is in one of them.
    costs : of each test, in any one unit.
    """

    chains: tuple[tuple[int, ...], ...]
    costs: tuple[float, ...]

    def only(self, numbers: Sequence[int]) -> Schedule:
        """The same order of some of the tests."""
        wanted = set(numbers)
        kept = (tuple(n for n in chain if n in wanted) for chain in self.chains)
        return Schedule(tuple(chain for chain in kept if chain), self.costs)

    def cost(self, numbers: Sequence[int]) -> float:
        """Sum of the costs of some of the tests."""
        return sum(self.costs[number] for number in numbers)


def in_turn(tests: int) -> Schedule:
    """One after the other in the order of the plan, all at one cost."""
    return Schedule(tuple((number,) for number in range(tests)), (1.0,) * tests)


def as_ended(work: Callable[[int], R], schedule: Schedule, jobs: int, stop: threading.Event) -> Iterator[tuple[int, R]]:
    """(number, ``work(number)``) of every test of ``schedule``, in the order in which they end.

    jobs : runs under way at a time, each in a thread; with 1 the work is done here. A thread that waits for a solver
    costs nothing, and the solver has a core of its own.
    stop : set when the iteration ends, for whatever reason. ``work`` has to end soon then: the iteration waits for it.
    What ``work`` raises is raised here.

    A chain is one run at a time; the chain with the most left to do comes first, so that no long run is left for the
    end. A job without a chain takes the far half of the longest one.
    """
    chains = sorted((deque(chain) for chain in schedule.chains), key=lambda chain: -schedule.cost(chain))
    if jobs == 1:
        yield from ((number, work(number)) for chain in chains for number in chain)
        return
    under_way: dict[concurrent.futures.Future[R], tuple[int, deque[int]]] = {}
    with concurrent.futures.ThreadPoolExecutor(jobs, "tow") as crew:
        try:
            while chains or under_way:
                while len(under_way) < jobs and (chain := _next(chains, under_way.values(), schedule)):
                    number = chain.popleft()
                    under_way[crew.submit(work, number)] = number, chain
                ended, _ = concurrent.futures.wait(under_way, return_when=concurrent.futures.FIRST_COMPLETED)
                for future in ended:
                    number, chain = under_way.pop(future)
                    if chain:
                        chains.append(chain)
                    yield number, future.result()
        finally:
            stop.set()


def _next(free: list[deque[int]], under_way: Iterable[tuple[int, deque[int]]], schedule: Schedule) -> deque[int] | None:
    """The chain to go on with: the longest free one, or the far half of the longest one under way."""
    if free:
        longest = max(free, key=schedule.cost)
        free.remove(longest)
        return longest
    rest = max((chain for _, chain in under_way), key=schedule.cost, default=None)
    if not rest:
        return None
    return deque(reversed([rest.pop() for _ in range((len(rest) + 1) // 2)]))
