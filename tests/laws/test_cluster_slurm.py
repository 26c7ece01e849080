"""Jobs of a real Slurm of one node. Needs root and Debian's slurmctld, slurmd, slurm-client, munge."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import cluster_cases as cases
import pytest

from towtank.cluster.work import each_once
from towtank.errors import InputError

ITEMS = list(range(40))
KEYS = [f"item-{item}" for item in ITEMS]


def _settings(folder: Path) -> dict[str, Any]:
    """Two jobs of one core, which find the tests' own modules as this process does."""
    return {
        "cores": 1,
        "processes": 1,
        "memory": "500MB",
        "queue": "short",
        "walltime": "00:10:00",
        "local_directory": str(folder),
        "log_directory": str(folder / "logs"),
        "job_script_prologue": [f"export PYTHONPATH={Path(__file__).parent}"],
        "python": sys.executable,
    }


def _jobs() -> list[str]:
    return subprocess.run(["squeue", "-h", "-o", "%i"], capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.slurm
def test_jobs_of_slurm_share_the_work_and_cancelled_jobs_are_replaced(slurm: Path, tmp_path: Path):
    found: dict[int, Any] = {}
    options: dict[str, Any] = {
        "keys": KEYS, "ledger": tmp_path / "ledger", "where": "slurm", "workers": 2, "settings": _settings(tmp_path),
    }  # fmt: skip
    cancelled: list[str] = []
    for index, result in each_once(cases.square, tmp_path / "log", ITEMS, **options):
        found[index] = result
        if len(found) == 12:
            cancelled = _jobs()
            assert cancelled
            subprocess.run(["scancel", "--signal=KILL", "--full", *cancelled], check=True)
    assert {i: r["square"] for i, r in found.items() if i != 13} == {i: i * i for i in ITEMS if i != 13}
    assert found[13].message == "13 cannot be carried out."
    started, ended = cases.counted(tmp_path / "log")
    assert ended == {i: 1 for i in ITEMS if i != 13}
    # at most the item under way in each cancelled job was started again
    assert len(ITEMS) <= sum(started.values()) <= len(ITEMS) + len(cancelled)
    # asking again needs no job at all
    assert dict(each_once(cases.square, tmp_path / "log", ITEMS, **options)) == found
    assert cases.counted(tmp_path / "log") == (started, ended)
    deadline = time.monotonic() + 20.0
    while _jobs() and time.monotonic() < deadline:
        time.sleep(0.5)
    assert _jobs() == [], "the jobs outlive the work"


@pytest.mark.slurm
def test_settings_that_slurm_does_not_take_are_refused(slurm: Path, tmp_path: Path):
    with pytest.raises(InputError, match=r"arguments of dask_jobqueue\.SLURMCluster"):
        list(
            each_once(
                cases.square, tmp_path / "log", [1], keys=["a"], ledger=tmp_path / "ledger", where="slurm",
                settings={"nonsense": 1},
            )
        )  # fmt: skip
