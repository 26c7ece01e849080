"""Shared cases such as ``synthetic_craft`` are imported from this folder, which pytest puts on the path."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "validation" / "slurm_loopback.sh"

# A shell starts a job in the background with Ctrl-C ignored, and every process below inherits that. The tests of an
# interruption need it heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module")
def slurm() -> Iterator[Path]:
    """A real Slurm of one node, whose settings are in the environment."""
    absent = [name for name in ("slurmctld", "slurmd", "sbatch", "munged") if not shutil.which(name)]
    assert not absent, f"not installed: {absent}. apt-get install slurmctld slurmd slurm-client munge"
    assert os.geteuid() == 0, "the daemons of a one-node Slurm need root"
    # The daemons write a last line to their logs while they end.
    with (
        tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setenv("SLURM_CONF", f"{folder}/slurm.conf")
        try:
            subprocess.run(["sh", str(SCRIPT), "start", folder], check=True, timeout=60)
            yield Path(folder)
        finally:
            subprocess.run(["scancel", "--user=root"], check=False, timeout=20)
            time.sleep(2.0)
            subprocess.run(["sh", str(SCRIPT), "stop", folder], check=False, timeout=60)
