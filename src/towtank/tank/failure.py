"""Why a run failed, on file beside where it would lie: ``runs/<id>/failed.json``."""

from __future__ import annotations

import contextlib
from pathlib import Path

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.provenance import provenance

SCHEMA = "towtank/failure/1"
FILE = "failed.json"


def failure_path(out: Path, run_id: str) -> Path:
    """File of a failure in the study folder ``out``."""
    return Path(out) / "runs" / run_id / FILE


def note_failure(out: Path, run_id: str, name: str, error: Exception) -> None:
    """Write why the run of test ``name`` failed. A disk that is too full for it costs the note, not the campaign."""
    document = {"schema": SCHEMA, "name": name, "message": str(error), "kind": type(error).__name__}
    with contextlib.suppress(ArtefactError):
        write_json(failure_path(out, run_id), document | {"provenance": provenance()})


def failure_of(out: Path, run_id: str) -> str:
    """Why the run failed when it was last tried; empty when it did not."""
    try:
        return str(read_json(failure_path(out, run_id), SCHEMA)["message"])
    except (ArtefactError, KeyError):
        return ""


def forget_failure(out: Path, run_id: str) -> None:
    """Remove the note, since the run is tried again."""
    failure_path(out, run_id).unlink(missing_ok=True)
