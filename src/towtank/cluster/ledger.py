"""A folder with one file per finished item. What is there is not done again."""

from __future__ import annotations

import contextlib
import json
import re
import uuid
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from towtank.artefact import json_text, read_json, write_json
from towtank.errors import ArtefactError, InputError
from towtank.provenance import provenance

SCHEMA, MARK = "towtank/result/1", "towtank/ledger/1"
_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


@dataclass(frozen=True)
class Failed:
    """An item that raised. ``message`` of the error, ``kind`` its class."""

    message: str
    kind: str = "TowtankError"


Result = dict[str, Any] | Failed
"""Plain JSON content, or why there is none."""


@dataclass(frozen=True)
class Ledger:
    """The folder ``root``, known by its ``mark``: a process elsewhere that finds the same mark sees the same folder."""

    root: Path
    mark: str

    @property
    def visible(self) -> bool:
        """True where this process sees the very folder that was opened."""
        try:
            return bool(read_json(self.root / ".ledger.json", MARK)["mark"] == self.mark)
        except ArtefactError:
            return False

    def path(self, key: str) -> Path:
        """File of one item."""
        return self.root / f"{key}.json"

    def find(self, key: str) -> Result | None:
        """What is on file; None for an item that is to be done, a broken file among them."""
        try:
            document = read_json(self.path(key), SCHEMA)
        except ArtefactError:
            return None
        if document.get("key") != key:
            return None
        if document.get("state") == "done" and isinstance(document.get("result"), dict):
            return dict(document["result"])
        error = document.get("error")
        return Failed(error["message"], error["kind"]) if document.get("state") == "failed" and error else None

    def keep(self, key: str, result: Result, **about: Any) -> Result:
        """Write the file of an item whole or not at all; the result as it reads from the file.

        Raises
        ------
        ArtefactError
            The folder cannot be written.
        """
        document: dict[str, Any] = {"schema": SCHEMA, "key": key, "state": "done", "result": result}
        if isinstance(result, Failed):
            document |= {"state": "failed", "result": None}
            document["error"] = {"message": result.message, "kind": result.kind}
        document["provenance"] = provenance(**about)
        # Processes of several machines may hold the same number, so the temporary name is drawn.
        part = self.root / f".{key}.{uuid.uuid4().hex}.part"
        try:
            part.write_text(json_text(document), encoding="utf-8")
            part.replace(self.path(key))
        except OSError as error:
            raise ArtefactError(
                f"cannot write {self.path(key)}: {error.strerror or error}. Choose a folder you may write to, or free "
                "some space; results already written are whole."
            ) from error
        finally:
            with contextlib.suppress(OSError):  # what keeps it from being removed has been told above
                part.unlink(missing_ok=True)
        return as_read(result)


def as_read(result: Result) -> Result:
    """``result`` as it comes back from a file: plain content, null for a number that is not finite."""
    return result if isinstance(result, Failed) else dict(json.loads(json_text(result)))


def open_ledger(root: Path) -> Ledger:
    """The ledger in the folder ``root``, which is made when it is not there.

    Raises
    ------
    ArtefactError
        The folder cannot be made or written.
    """
    root = Path(root).absolute()
    try:
        mark = str(read_json(root / ".ledger.json", MARK)["mark"])
    except (ArtefactError, KeyError):
        mark = uuid.uuid4().hex
        write_json(root / ".ledger.json", {"schema": MARK, "mark": mark, "provenance": provenance()})
    return Ledger(root, mark)


def checked_keys(keys: Sequence[str]) -> list[str]:
    """The keys, one file name each.

    Raises
    ------
    InputError
        Two items have the same key, or a key cannot be the name of a file.
    """
    for key, count in Counter(keys).items():
        if not _KEY.fullmatch(key) or len(key) > 120:
            raise InputError(f"key {key!r} cannot name a file. Use letters, digits, dot, hyphen, at most 120 of them.")
        if count > 1:
            raise InputError(
                f"{count} items have the key {key}. One would take the other's result; make their keys differ."
            )
    return list(keys)
