"""Bars on a terminal, silence elsewhere, nothing on stdout."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, TextColumn

from towtank.cli.bars import Bars
from towtank.cli.reply import Remarks, Reply


def test_bars_count_steps_and_show_the_last_note():
    screen = Progress(
        TextColumn("{task.description} {task.completed}/{task.total} {task.fields[note]}"),
        console=Console(file=io.StringIO(), force_terminal=True, width=60),
        auto_refresh=False,
    )
    bars = Bars(screen)
    with screen:
        bars.start("tow", 3)
        bars.step("tow", "sway-01")
        bars.step("tow", "sway-02")
        (task,) = screen.tasks
        assert (task.completed, task.total, task.fields["note"]) == (2, 3, "sway-02")
        bars.done("tow")
        assert screen.tasks == []


def test_a_step_of_an_unknown_task_does_no_harm():
    screen = Progress(console=Console(file=io.StringIO()), auto_refresh=False)
    bars = Bars(screen)
    bars.step("never started")
    bars.done("neither")
    assert [task.completed for task in screen.tasks] == [1]


class Spy:
    """Progress that remembers."""

    def __init__(self) -> None:
        self.seen: list[tuple[str, ...]] = []

    def start(self, task: str, total: int) -> None:
        self.seen.append(("start", task, str(total)))

    def step(self, task: str, note: str = "") -> None:
        self.seen.append(("step", task, note))

    def done(self, task: str) -> None:
        self.seen.append(("done", task))


def test_remarks_pass_on_every_step_and_tell_repeated_runs(capsys):
    spy = Spy()
    remarks = Remarks(Reply("tow", progress=spy))
    remarks.start("tow", 2)
    remarks.step("tow", "sway-01: on file")
    remarks.step("tow", "sway-02: run again, x/run.nc is not a whole netCDF-4 file")
    remarks.done("tow")
    assert spy.seen == [("start", "tow", "2"), ("step", "tow", "sway-01"), ("step", "tow", "sway-02"), ("done", "tow")]
    captured = capsys.readouterr()
    assert "sway-02: run again" in captured.err
    assert "sway-01" not in captured.err
    assert captured.out == ""


def test_a_terminal_sees_a_bar_while_stdout_stays_json(tmp_path: Path):
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "towtank", "tow", "spheroid-6-1", "--out", str(tmp_path / "study"), "--json"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=slave, env=environment, text=True)
    os.close(slave)
    seen = bytearray()
    while True:
        try:
            block = os.read(master, 65536)
        except OSError:  # the other end is closed
            break
        if not block:
            break
        seen += block
    os.close(master)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0, seen.decode()
    assert out.startswith("{")
    assert out.endswith("}\n")
    assert "━".encode() in seen
    assert b"tow" in seen
