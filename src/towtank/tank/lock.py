"""One campaign at a time in a study folder."""

from __future__ import annotations

import contextlib
import datetime
import fcntl
import json
import os
import platform
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from towtank.errors import ArtefactError, TankError

FILE = ".campaign.lock"
"""In the folder ``runs``: process, host and start of the campaign that runs there."""


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the campaign of the study ``folder``, whose ``runs`` exists.

    The system gives the lock up with the process that holds it, however that ends, so the file of a killed campaign
    stops nobody on the same host.

    Raises
    ------
    TankError
        Another campaign runs there, or one of another host has left its file.
    ArtefactError
        The file system cannot lock.
    """
    path = folder / "runs" / FILE
    with _taken(path):
        try:
            yield
        finally:
            path.unlink(missing_ok=True)  # before it is let go, so that it is nobody else's


def _taken(path: Path) -> IO[str]:
    while True:
        try:
            handle = path.open("a+", encoding="utf-8")
        except OSError as error:
            raise ArtefactError(
                f"cannot write {path}: {error.strerror or error}. Choose a folder you may write to with --out DIR."
            ) from error
        try:
            if _held(handle, path):
                return handle
        except BaseException:
            handle.close()
            raise
        handle.close()


def _held(handle: IO[str], path: Path) -> bool:
    """True when the lock is ours; false when its file was removed meanwhile by the campaign that ended."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise TankError(_busy(path, _said(handle))) from None
    except OSError as error:
        raise ArtefactError(
            f"cannot lock {path}: {error.strerror or error}. Two campaigns in one folder destroy each other's cases; "
            "choose a folder on a file system that has locks, with --out DIR."
        ) from error
    if not path.exists() or path.stat().st_ino != os.fstat(handle.fileno()).st_ino:
        return False
    before = _said(handle)
    if before.get("host", platform.node()) != platform.node():
        # Not every shared file system carries a lock from host to host.
        raise TankError(_busy(path, before) + f" If it has ended, remove {path}.")
    handle.truncate(0)
    since = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
    try:
        handle.write(json.dumps({"pid": os.getpid(), "host": platform.node(), "since": since}) + "\n")
        handle.flush()
    except OSError as error:
        path.unlink(missing_ok=True)
        raise ArtefactError(f"cannot write {path}: {error.strerror or error}. Free some space.") from error
    return True


def _said(handle: IO[str]) -> dict[str, Any]:
    """What the holder wrote; empty while it has not."""
    handle.seek(0)
    try:
        found = json.loads(handle.read())
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _busy(path: Path, holder: dict[str, Any]) -> str:
    who = "another process"
    if holder:
        who = f"process {holder.get('pid')} on {holder.get('host')}, since {holder.get('since')}"
    return (
        f"a campaign runs in {path.parent.parent} already: {who}. Two of them would run the same cases. Wait for it or "
        "end it, then ask again; or choose another folder with --out DIR."
    )
