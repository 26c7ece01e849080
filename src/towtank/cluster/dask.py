"""The workers of a Dask cluster: one that runs already, or jobs of Slurm started for the work."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from towtank.cluster.crew import Perished
from towtank.errors import InputError, TowtankError
from towtank.provenance import VERSION

if TYPE_CHECKING:
    from towtank.cluster.work import Task

ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+")
PATIENCE = "20s"
"""How long a scheduler may take to answer."""
INSTALL = "Install it with: pip install towtank[cluster]"


class Lost(TowtankError):
    """The cluster cannot go on."""


def cluster_answers(
    task: Task, keyed: Sequence[tuple[str, Any]], where: str, workers: int, settings: Mapping[str, Any]
) -> Iterator[tuple[int, Any]]:
    """(number, answer) of every keyed item as the workers finish, ``Perished`` where they died on it.

    Raises
    ------
    InputError
        As ``each_once``.
    """
    if where != "slurm" and not ADDRESS.fullmatch(where):
        raise InputError(
            f'cluster {where!r}: write "tcp://host:port", the address of a running Dask scheduler, or "slurm".'
        )
    if not keyed:
        return
    with contextlib.ExitStack() as stack:
        address: Any = where
        if where == "slurm":
            address = stack.enter_context(slurm_cluster(workers, settings))
        client = stack.enter_context(_client(address, where))
        if where != "slurm":
            _manned(client, where)
        yield from _gathered(client, task, keyed)


def _gathered(client: Any, task: Task, keyed: Sequence[tuple[str, Any]]) -> Iterator[tuple[int, Any]]:
    """Answers of all items; those that went down with their workers are done again at the end, one at a time.

    Dask blames every item that waited on a dead worker. Alone on the cluster, only the guilty one fails again.
    """
    suspects = []
    for number, answer in _round(client, task, dict(enumerate(keyed))):
        if isinstance(answer, Perished):
            suspects.append(number)
        else:
            yield number, answer
    for number in suspects:
        yield from _round(client, task, {number: keyed[number]})


def _round(client: Any, task: Task, keyed: Mapping[int, tuple[str, Any]]) -> Iterator[tuple[int, Any]]:
    import distributed

    # The mark keeps apart what two clients with two ledgers ask of one scheduler.
    name = f"towtank-{task.ledger.mark[:12]}"
    futures = {client.submit(task, item, key=f"{name}-{item[0]}", pure=False): n for n, item in keyed.items()}
    completed: Any = distributed.as_completed
    for future in completed(list(futures), loop=client.loop):
        number = futures.pop(future)
        try:
            answer: Any = future.result()
        except distributed.KilledWorker as error:
            answer = Perished(f"the workers that worked on it died: {error}. Too little memory is the usual reason")
        except distributed.CancelledError:
            raise Lost(
                f"the Dask scheduler went away with {len(futures) + 1} items to do. What is finished is whole in "
                f"{task.ledger.root}; start a scheduler and ask again to go on."
            ) from None
        # A result that nobody holds is not worked out again when the worker that holds it dies.
        future.release()
        yield number, answer


def _client(address: Any, where: str) -> AbstractContextManager[Any]:
    distributed = _imported("distributed")
    try:
        client: AbstractContextManager[Any] = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError) as error:
        raise InputError(
            f"no Dask scheduler answers at {where} within {PATIENCE} ({error}). Start one with `dask scheduler`, "
            "workers with `dask worker ADDRESS`, and check host, port and firewall."
        ) from None
    return client


def _manned(client: Any, where: str) -> None:
    """See to it that a running scheduler has workers fit for the work; jobs of Slurm may wait long in their queue."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise InputError(
            f"the Dask scheduler at {where} has no workers. Start some with `dask worker {where}` and ask again."
        ) from None

    def version() -> str:  # a function inside a function travels whole: it runs where there is no towtank
        try:
            from towtank.provenance import VERSION
        except ImportError:
            return "none"
        return VERSION

    found = {**client.run(version), "the scheduler": client.run_on_scheduler(version)}
    for place, there in found.items():
        if there != VERSION:
            raise InputError(
                f"{place} of the Dask cluster at {where} has towtank {there}, this is {VERSION}. Results of two "
                "versions do not belong together, and a worker without the package ends. Install the same everywhere."
            )


def slurm_cluster(jobs: int, settings: Mapping[str, Any]) -> AbstractContextManager[Any]:
    """A Dask cluster of ``jobs`` Slurm jobs, ended with the context.

    settings : arguments of ``dask_jobqueue.SLURMCluster``; what is left out comes from Dask's own configuration
        (``jobqueue.slurm``), and one core with 2 GB where that says nothing.

    Raises
    ------
    InputError
        dask-jobqueue or Slurm's ``sbatch`` is not installed, or the settings are refused.
    """
    import shutil

    import dask

    jobqueue = _imported("dask_jobqueue")
    if shutil.which("sbatch") is None:
        raise InputError("cluster 'slurm': there is no `sbatch` here. Ask again on a machine that submits to Slurm.")
    fallback = {
        key: value
        for key, value in {"cores": 1, "processes": 1, "memory": "2GB"}.items()
        if dask.config.get(f"jobqueue.slurm.{key}", None) is None
    }
    try:
        cluster = jobqueue.SLURMCluster(**(fallback | dict(settings)))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"cluster 'slurm': {error}. The settings are arguments of dask_jobqueue.SLURMCluster, such as cores = 4, "
            'memory = "8GB", queue = "short", walltime = "01:00:00".'
        ) from None
    # Adaptive with equal bounds: a job that ends, by its time limit or by a fault, is submitted again.
    cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
    return cluster  # type: ignore[no-any-return]


def _imported(module: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"a cluster needs {module.replace('_', '-')}, which is not here ({error}). {INSTALL}"
        ) from None
