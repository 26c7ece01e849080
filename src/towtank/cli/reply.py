"""What a command answers: text for people or one JSON document, and an exit code.

Results go to stdout, remarks and errors to stderr. With ``--json`` stdout holds exactly one document.
"""

from __future__ import annotations

import textwrap
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer

from towtank.errors import TowtankError
from towtank.progress import Progress, Silent

DONE, BAD_INPUT, FAILED, STOPPED = 0, 2, 3, 130
"""Exit codes."""

WIDTH = 100


@dataclass
class Reply:
    """The answer of one command, filled while it works.

    files : noun -> path.   summary : plain content for the JSON document.   kept : what stays when stopped.
    resume : what the same command then does.
    """

    command: str
    json: bool = False
    debug: bool = False
    exit_code: int = DONE
    error: str = ""
    kept: str = "Files already written are whole."
    resume: str = " The same command resumes."
    files: dict[str, str] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    progress: Progress = field(default_factory=Silent)
    started: float = field(default_factory=time.perf_counter)

    def say(self, text: str) -> None:
        """A result for people, on stdout."""
        if not self.json:
            typer.echo(text)

    def tell(self, text: str) -> None:
        """Paragraphs for people, on stdout, broken to lines of ``WIDTH``."""
        self.say("\n\n".join(textwrap.fill(part, WIDTH) for part in text.split("\n\n")))

    def log(self, text: str) -> None:
        """A remark, on stderr."""
        typer.echo(text, err=True)

    def file(self, noun: str, path: Path) -> None:
        """Note a file that the command wrote or found done."""
        self.files[noun] = str(path)

    def fail(self, code: int, message: str) -> None:
        """End with ``code``; the message goes to stderr and into the document."""
        self.exit_code, self.error = code, message
        self.log(f"towtank {self.command}: {message}")
        if self.debug:
            self.log(traceback.format_exc())

    def document(self) -> dict[str, Any]:
        """The JSON document of ``--json``."""
        document: dict[str, Any] = {
            "schema": "towtank/reply/1",
            "command": self.command,
            "status": "ok" if self.exit_code == DONE else "failed",
            "files": self.files,
            "summary": self.summary,
            "wall_s": round(time.perf_counter() - self.started, 3),
        }
        return document | ({"error": self.error, "exit_code": self.exit_code} if self.exit_code else {})


@dataclass(frozen=True)
class Remarks:
    """Progress of a campaign: forwards to the bars, and says which runs had to be made again and which failed."""

    reply: Reply

    def start(self, task: str, total: int) -> None:
        """Forward."""
        self.reply.progress.start(task, total)

    def step(self, task: str, note: str = "") -> None:
        """Forward; a run that is made again, or failed, is told on its own line."""
        if ": run again, " in note or ": failed, " in note:
            self.reply.log(f"  {note}")
        self.reply.progress.step(task, note.partition(":")[0])

    def done(self, task: str) -> None:
        """Forward."""
        self.reply.progress.done(task)


@contextmanager
def answering(command: str, as_json: bool = False, debug: bool = False) -> Iterator[Reply]:
    """Run a command's body; turn what it raises into a message and an exit code.

    Raises
    ------
    typer.Exit
        With the exit code, when it is not 0.
    """
    from towtank.cli.bars import terminal_progress

    reply = Reply(command, as_json, debug)
    try:
        with terminal_progress() as reply.progress:
            yield reply
    except TowtankError as error:
        stopped = isinstance(error.__context__, KeyboardInterrupt)
        reply.fail(STOPPED if stopped else error.exit_code, f"{error}{reply.resume if stopped else ''}")
    except KeyboardInterrupt:
        reply.fail(STOPPED, f"stopped. {reply.kept}{reply.resume}")
    except BrokenPipeError:
        raise  # the reader of stdout went away (towtank ... | head); click ends quietly
    except Exception as error:  # the last gate before the user: every other kind is a fault of the program
        hint = "" if debug else " Add --debug for the traceback, and please report it."
        reply.fail(FAILED, f"unexpected {type(error).__name__}: {error}. {reply.kept}{hint}")
    if as_json:
        from towtank.artefact import json_text

        typer.echo(json_text(reply.document()), nl=False)
    if reply.exit_code:
        raise typer.Exit(reply.exit_code)
