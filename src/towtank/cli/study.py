"""The study folder: where each stage keeps its files, and what is already done.

``study.json`` holds, for each stage, the hashes of what went in and of the files that came out. A stage is done when
its inputs are the present ones and its files are still as written; anything else is done again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from towtank.errors import ArtefactError
from towtank.provenance import VERSION, provenance

SCHEMA = "towtank/study/1"


def file_hash(path: Path) -> str:
    """First 16 hex digits of the SHA-256 of a file; empty when it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    except OSError:
        return ""


@cache
def program_hash() -> str:
    """Version and hash of the package's source, so that results of another program are not taken for present ones."""
    source = hashlib.sha256()
    for path in sorted(Path(__file__).resolve().parents[1].rglob("*")):
        if path.suffix in (".py", ".c", ".h"):
            source.update(path.read_bytes())
    return f"{VERSION}+{source.hexdigest()[:8]}"


@dataclass(frozen=True)
class Study:
    """The folder ``root`` of one craft's study."""

    root: Path

    @property
    def craft(self) -> Path:
        """The craft file of the study."""
        return self.root / "craft.toml"

    @property
    def plan(self) -> Path:
        """The captive tests."""
        return self.root / "plan.toml"

    @property
    def runs(self) -> Path:
        """Folder of the runs."""
        return self.root / "runs"

    @property
    def derivatives(self) -> Path:
        """The derivatives."""
        return self.root / "derivatives.json"

    @property
    def frequency(self) -> Path:
        """How derivatives depend on frequency and amplitude."""
        return self.root / "frequency.json"

    @property
    def model(self) -> Path:
        """The self-contained model."""
        return self.root / "model.json"

    @property
    def trials(self) -> Path:
        """Folder of the trials."""
        return self.root / "trials"

    @property
    def mc(self) -> Path:
        """The Monte Carlo study."""
        return self.root / "mc.json"

    @property
    def faults(self) -> Path:
        """The mission with jammed fins."""
        return self.root / "faults.json"

    @property
    def verdict(self) -> Path:
        """The verdict."""
        return self.root / "verdict.json"

    @property
    def requirements(self) -> Path:
        """What the user asks of the craft; absent for the standard set."""
        return self.root / "requirements.toml"

    @property
    def report(self) -> Path:
        """The report."""
        return self.root / "report.html"

    def stages(self) -> dict[str, dict[str, Any]]:
        """Stage -> its record; empty when nothing was recorded or the ledger cannot be read."""
        from towtank.artefact import read_json

        try:
            return dict(read_json(self.root / "study.json", SCHEMA).get("stages", {}))
        except ArtefactError:
            return {}

    @property
    def ledger_broken(self) -> bool:
        """True when ``study.json`` exists and cannot be read."""
        return (self.root / "study.json").exists() and not self.stages()

    def written(self, path: Path) -> str:
        """Hash that ``path`` had when a stage wrote it; empty when no stage did."""
        name = path.relative_to(self.root).as_posix()
        return next((r["files"][name] for r in self.stages().values() if name in r.get("files", {})), "")

    def edited(self, path: Path) -> bool:
        """True when ``path`` holds something else than what a stage of this study wrote."""
        return path.exists() and path.stat().st_size > 0 and file_hash(path) != self.written(path)

    @property
    def imported(self) -> bool:
        """True when the runs were made elsewhere, without a plan of this study."""
        return not self.plan.exists() and "imported" in self.stages().get("tow", {}).get("summary", {})

    def current(self, stage: str, inputs: Mapping[str, str]) -> bool:
        """True when ``stage`` was done with these inputs and its files are as it left them."""
        record = self.stages().get(stage)
        if not record or record.get("inputs") != dict(inputs):
            return False
        return all(file_hash(self.root / name) == known for name, known in record["files"].items())

    def record(
        self,
        stage: str,
        inputs: Mapping[str, str],
        files: Iterable[Path],
        wall_s: float,
        summary: Mapping[str, Any] | None = None,
    ) -> None:
        """Note that ``stage`` is done. ``summary``: plain content that a command may want again without reading it."""
        from towtank.artefact import write_json

        hashes = {path.relative_to(self.root).as_posix(): file_hash(path) for path in files}
        entry = {"inputs": dict(inputs), "files": hashes, "wall_s": round(wall_s, 3), "summary": dict(summary or {})}
        stages = self.stages() | {stage: entry}
        write_json(
            self.root / "study.json",
            {"schema": SCHEMA, "stages": stages, "provenance": provenance({"program": program_hash()})},
        )

    def put_aside(self, path: Path) -> Path | None:
        """Move a file that somebody edited out of the way; the new name, or None when there was nothing to keep."""
        if not self.edited(path):
            return None
        for number in range(1, 1000):
            aside = path.with_name(f"{path.stem}.edited-{number}{path.suffix}")
            if not aside.exists():
                return path.rename(aside)
        raise ArtefactError(f"{path.parent} holds 999 edited copies of {path.name}. Remove some of them.")
