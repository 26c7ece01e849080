"""Work on many processes: nothing lost, nothing done twice, whoever dies."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cluster_cases as cases
import pytest

import towtank.cluster.dask
from towtank.cluster.ledger import Failed, open_ledger
from towtank.cluster.work import Stopped, Task, each_once
from towtank.errors import ArtefactError, InputError, TowtankError
from towtank.progress import Silent

ITEMS = list(range(12))
KEYS = [f"item-{item}" for item in ITEMS]
PATIENCE = 60.0
"""Seconds that a loaded machine may take for what needs one."""


def run(folder: Path, work: Any = cases.square, items: list[int] = ITEMS, **options: Any) -> dict[int, Any]:
    keys = [f"item-{item}" for item in items]
    return dict(each_once(work, folder / "log", items, keys=keys, ledger=folder / "ledger", **options))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A real scheduler with two worker processes under nannies."""
    import distributed

    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options, silence_logs=50) as made:
        yield made


@pytest.fixture(params=["here", "crew", "dask"])
def how(request: pytest.FixtureRequest) -> dict[str, Any]:
    """One process, two processes, a Dask cluster."""
    if request.param == "dask":
        return {"where": request.getfixturevalue("cluster").scheduler_address}
    return {"workers": 1 if request.param == "here" else 2}


def test_every_item_is_done_once_and_the_second_call_starts_none(how: dict[str, Any], tmp_path: Path):
    first = run(tmp_path, **how)
    assert {i: r["square"] for i, r in first.items()} == {i: i * i for i in ITEMS}
    started, ended = cases.counted(tmp_path / "log")
    assert set(started.values()) == set(ended.values()) == {1}
    # and what was just worked out reads as what is on file, NaN included
    assert run(tmp_path, **how) == first
    assert first[3]["nothing"] is None
    assert cases.counted(tmp_path / "log") == (started, ended)


def test_a_refused_item_is_recorded_and_the_others_go_on(how: dict[str, Any], tmp_path: Path):
    items = [11, 12, 13, 14]
    for _ in range(2):
        found = run(tmp_path, items=items, **how)
        assert found[2] == Failed("13 cannot be carried out.", "TrialError")
        assert [found[i]["square"] for i in (0, 1, 3)] == [121, 144, 196]
    assert set(cases.counted(tmp_path / "log")[0].values()) == {1}
    assert json.loads((tmp_path / "ledger" / "item-13.json").read_text())["state"] == "failed"


def recorded(folder: Path) -> set[int]:
    """The items whose results are in the ledger."""
    return {int(path.stem.removeprefix("item-")) for path in (folder / "ledger").glob("item-*.json")}


def _killed_under_way(folder: Path) -> int:
    """Kill -9 the process of the item that does not end by itself, once it is under way."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        for _, item, process in cases.lines(folder / "log"):
            if item == cases.HELD:
                os.kill(process, signal.SIGKILL)
                return process
        time.sleep(0.02)
    raise AssertionError("the item was never seen under way")


@pytest.mark.parametrize("how", ["crew", "dask"], indirect=True)
def test_when_a_worker_is_killed_its_item_is_started_again_and_no_finished_one(how: dict[str, Any], tmp_path: Path):
    with ThreadPoolExecutor(1) as aside:
        victim = aside.submit(_killed_under_way, tmp_path)
        found = run(tmp_path, work=cases.held, **how)
        assert victim.result() > 0
    assert {i: r["square"] for i, r in found.items()} == {i: i * i for i in ITEMS}
    started, ended = cases.counted(tmp_path / "log")
    assert ended == dict.fromkeys(ITEMS, 1)
    assert sum(started.values()) == len(ITEMS) + 1
    assert sorted(path.stem for path in (tmp_path / "ledger").glob("*.json") if path.name[0] != ".") == sorted(KEYS)
    log = cases.lines(tmp_path / "log")
    for item in ITEMS:  # no start after an end
        words = [word for word, which, _ in log if which == item]
        assert words.index("end") == len(words) - 1
    run(tmp_path, **how)
    assert cases.lines(tmp_path / "log") == log


@pytest.mark.parametrize("how", ["crew", "dask"], indirect=True)
def test_an_item_that_kills_its_worker_every_time_fails_alone(how: dict[str, Any], tmp_path: Path):
    found = run(tmp_path, work=cases.deadly, items=[0, 1, 2, 3], **how)
    assert found[2].kind == "Perished"
    assert [found[i]["square"] for i in (0, 1, 3)] == [0, 1, 9]
    # a death says nothing about the item: the next call tries again
    assert not (tmp_path / "ledger" / "item-2.json").exists()
    assert run(tmp_path, items=[0, 1, 2, 3])[2]["square"] == 4


def test_workers_that_do_not_see_the_ledger_send_their_results(how: dict[str, Any], tmp_path: Path):
    """The mark of the ledger decides, not the path: without it the folder is taken for another one."""

    class Unmarking(Silent):
        def start(self, task: str, total: int) -> None:
            (tmp_path / "ledger" / ".ledger.json").unlink()

    first = run(tmp_path, items=[4, 5, 13], progress=Unmarking(), **how)
    assert (first[0]["square"], first[1]["square"]) == (16, 25)
    assert run(tmp_path, items=[4, 5, 13]) == first
    assert set(cases.counted(tmp_path / "log")[0].values()) == {1}


def test_an_interruption_keeps_what_is_finished_and_says_how_to_go_on(how: dict[str, Any], tmp_path: Path):
    class Interrupting:
        seen = 0

        def start(self, task: str, total: int) -> None:
            assert total == len(ITEMS)

        def step(self, task: str, note: str = "") -> None:
            self.seen += 1
            if self.seen == 5:
                raise KeyboardInterrupt

        def done(self, task: str) -> None:
            self.ended = True

    spy = Interrupting()
    with pytest.raises(Stopped, match=r"stopped after 5 of 12.*ask again") as caught:
        run(tmp_path, progress=spy, **how)
    assert isinstance(caught.value.__context__, KeyboardInterrupt)
    assert spy.ended
    finished = recorded(tmp_path)
    assert len(finished) >= 5
    run(tmp_path)
    assert {item: cases.counted(tmp_path / "log")[1][item] for item in finished} == dict.fromkeys(finished, 1)


def test_a_truncated_result_is_made_again(tmp_path: Path):
    first = run(tmp_path, items=[1, 2])
    (tmp_path / "ledger" / "item-2.json").write_text('{"schema"')
    assert run(tmp_path, items=[1, 2]) == first
    assert cases.counted(tmp_path / "log")[0] == {1: 1, 2: 2}


@pytest.mark.parametrize("where", ["nonsense", "tcp://nowhere", "http://host:1"])
def test_an_unknown_cluster_is_refused(tmp_path: Path, where: str):
    with pytest.raises(InputError, match=r"tcp://host:port.*slurm"):
        run(tmp_path, where=where)


def test_two_items_with_one_key_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="make their keys differ"):
        list(each_once(cases.square, tmp_path / "log", [1, 2], keys=["a", "a"], ledger=tmp_path))
    with pytest.raises(InputError, match="cannot name a file"):
        list(each_once(cases.square, tmp_path / "log", [1], keys=["../a"], ledger=tmp_path))


def test_a_folder_that_cannot_be_written_is_told_before_any_work(tmp_path: Path):
    (tmp_path / "ledger").write_text("a file")
    with pytest.raises(ArtefactError, match="cannot write"):
        run(tmp_path)
    assert cases.lines(tmp_path / "log") == []


def test_without_dask_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install towtank\[cluster\]"):
        run(tmp_path, where="tcp://127.0.0.1:8786")


def test_a_scheduler_that_does_not_answer_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("towtank.cluster.dask.PATIENCE", "1s")
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run(tmp_path, where="tcp://127.0.0.1:9")


def test_a_scheduler_without_workers_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import distributed

    connect = towtank.cluster.dask._client

    def connected(*where: Any) -> Any:
        """All patience for the scheduler, little for workers that never come."""
        client = connect(*where)
        monkeypatch.setattr("towtank.cluster.dask.PATIENCE", "1s")
        return client

    monkeypatch.setattr("towtank.cluster.dask._client", connected)
    empty = distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50)
    with empty, pytest.raises(InputError, match="has no workers"):
        run(tmp_path, where=empty.scheduler_address)


def test_a_cluster_with_another_version_is_refused_before_any_work(
    tmp_path: Path, cluster: Any, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("towtank.cluster.dask.VERSION", "9.9")
    with pytest.raises(InputError, match=r"has towtank 0\.\d.*this is 9\.9"):
        run(tmp_path, where=cluster.scheduler_address)
    assert cases.lines(tmp_path / "log") == []


def test_a_scheduler_that_goes_away_is_told_and_what_is_finished_stays(tmp_path: Path):
    import distributed

    short_lived = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50)
    answers = each_once(
        cases.square,
        tmp_path / "log",
        ITEMS,
        keys=KEYS,
        ledger=tmp_path / "ledger",
        where=short_lived.scheduler_address,
    )
    next(answers), next(answers)
    short_lived.close()
    with pytest.raises(TowtankError, match=r"went away.*ask again to go on"):
        list(answers)
    before = recorded(tmp_path)
    assert len(before) >= 2
    assert set(run(tmp_path)) == set(range(len(ITEMS)))
    assert all(cases.counted(tmp_path / "log")[1][item] == 1 for item in before)


def test_a_fault_of_the_work_is_raised(how: dict[str, Any], tmp_path: Path):
    with pytest.raises(TypeError):
        run(tmp_path, items=["x"], **how)


def test_another_version_on_a_worker_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("towtank.cluster.work.VERSION", "9.9")
    task = Task(cases.square, tmp_path / "log", open_ledger(tmp_path / "ledger"), "0.1.0")
    with pytest.raises(TowtankError, match=r"has towtank 9\.9"):
        task(("item-1", 1))
