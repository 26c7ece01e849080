"""Every item of a list done once, by processes of this machine or by the workers of a Dask cluster."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank.cluster.crew import Perished, as_done
from towtank.cluster.ledger import Failed, Ledger, Result, checked_keys, open_ledger
from towtank.errors import TowtankError
from towtank.progress import Progress, Silent
from towtank.provenance import VERSION

TASK = "points"
"""Name of the work in the progress, unless another is given."""

Work = Callable[[Any, Any], Mapping[str, Any]]


class Stopped(TowtankError):
    """The work was interrupted."""


class Unfit(TowtankError):
    """A worker cannot do the work as it stands."""


@dataclass(frozen=True)
class Task:
    """What a worker needs: the work, what all items share, and the ledger. Called with a key and an item."""

    work: Work
    shared: Any
    ledger: Ledger
    version: str = VERSION

    def __call__(self, keyed: tuple[str, Any]) -> tuple[Result, bool]:
        """The result of one item, and whether it is on file. Looked up before it is worked out.

        Raises
        ------
        Unfit
            The worker's towtank is of another version.
        """
        key, item = keyed
        if self.version != VERSION:
            raise Unfit(
                f"the worker {platform.node()} has towtank {VERSION}, this is {self.version}. Results of two versions "
                "do not belong together; install the same one everywhere."
            )
        visible = self.ledger.visible
        if visible and (found := self.ledger.find(key)) is not None:
            return found, True
        started = time.perf_counter()
        try:
            result: Result = dict(self.work(self.shared, item))
        except TowtankError as error:
            result = Failed(str(error), type(error).__name__)
        if not visible:
            return result, False
        return self.ledger.keep(key, result, **_about(started)), True


def _about(started: float) -> dict[str, Any]:
    return {"wall_s": round(time.perf_counter() - started, 3), "host": platform.node()}


def each_once(
    work: Work,
    shared: Any,
    items: Sequence[Any],
    *,
    keys: Sequence[str],
    ledger: Path,
    where: str | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    settings: Mapping[str, Any] | None = None,
    task: str = TASK,
) -> Iterator[tuple[int, Result]]:
    """``work(shared, item)`` of every item that is not on file yet; (index, result) as they end.

    Parameters
    ----------
    work : a function of a module that returns JSON content.   shared, items : can be pickled.
    keys : one per item, a name of everything that decides its result.
    ledger : folder with ``<key>.json`` of every finished item. An item on file is read and not done again. A worker
        that sees this folder looks there before it starts, and writes the result itself as soon as it has it.
    where : None for processes of this machine, ``"tcp://host:port"`` for the workers of a running Dask scheduler,
        ``"slurm"`` for jobs of this user's Slurm, started for the work and ended with it.
    workers : processes here, or jobs of Slurm; a running scheduler has its own. 1 here starts no process.
    settings : what ``dask_jobqueue.SLURMCluster`` is made with, such as cores, memory, queue, walltime.
    progress : told of each item, under the name ``task``.

    Yields
    ------
    The index of an item and its result as it reads from the file, or a ``Failed`` where the work raised a
    ``TowtankError``: that is on file too and not tried again, until its file is removed. A worker that dies takes no
    finished item along; the item it was at is started again, by default three times, then it is a ``Failed`` that is
    not on file.

    Raises
    ------
    InputError
        Unknown ``where``, two items with one key, Dask not installed, no scheduler there, no Slurm.
    ArtefactError
        The ledger cannot be written.
    Stopped
        Interrupted. What is finished stays; the same call goes on from there.
    """
    told, names, book = progress or Silent(), checked_keys(keys), open_ledger(Path(ledger))
    done = 0
    told.start(task, len(items))
    try:
        open_items = []
        for index, key in enumerate(names):
            found = book.find(key)
            if found is None:
                open_items.append(index)
                continue
            done += 1
            told.step(task, f"{key}: on file")
            yield index, found
        keyed = [(names[index], items[index]) for index in open_items]
        for number, answer in _answers(Task(work, shared, book), keyed, where, workers, settings or {}):
            done += 1
            told.step(task, keyed[number][0])
            yield open_items[number], _kept(book, keyed[number][0], answer)
    except KeyboardInterrupt:
        raise Stopped(
            f"stopped after {done} of {len(items)}. What is finished is whole in {book.root}; ask again to go on."
        ) from None
    finally:
        told.done(task)


def _answers(
    task: Task, keyed: Sequence[tuple[str, Any]], where: str | None, workers: int, settings: Mapping[str, Any]
) -> Iterator[tuple[int, Any]]:
    if where is not None:
        from towtank.cluster.dask import cluster_answers

        return cluster_answers(task, keyed, where, workers, settings)
    if min(workers, len(keyed)) < 2:
        return ((number, task(item)) for number, item in enumerate(keyed))
    return as_done(_call, task, keyed, workers)


def _call(task: Task, item: tuple[str, Any]) -> tuple[Result, bool]:
    return task(item)


def _kept(ledger: Ledger, key: str, answer: tuple[Result, bool] | Perished) -> Result:
    """The result, written here when the worker could not. A death is not put on file: the next call tries again."""
    if isinstance(answer, Perished):
        return Failed(str(answer), "Perished")
    result, on_file = answer
    return result if on_file else ledger.keep(key, result)
