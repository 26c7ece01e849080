"""The Monte Carlo stage of a study: the trials of craft drawn from the uncertainty of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towtank.cli.study import program_hash

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.trials.trajectory import Trajectory

DRAWING = {"samples": "500", "mass": "0", "cg": "0", "current": "0", "seed": "20"}
"""What is asked of a study that was asked for nothing else: the uncertainty of the derivatives alone."""


def asked(chain: Chain) -> dict[str, str]:
    """What is asked of the Monte Carlo study: by the user now, by the record of the study, or ``DRAWING``."""
    known = chain.study.stages().get("mc", {}).get("inputs", {})
    return chain.drawing or {name: known.get(name, usual) for name, usual in DRAWING.items()}


def compiled(chain: Chain) -> bool:
    """True where the model flies on a compiled library, so that many craft cost little."""
    from towtank.engine.form import form_of
    from towtank.engine.library import library

    return library(form_of(chain.model())) is not None


def scatter(
    chain: Chain, where: str | None = None, workers: int = 1, settings: Mapping[str, Any] | None = None
) -> None:
    """Fly craft drawn from the uncertainty of the derivatives; see ``towtank.montecarlo``.

    A study of more samples that is out of date is done again with the usual number, unless it is asked for now.
    """
    if chain.drawing is None and not chain.done("mc"):
        samples = min(int(asked(chain)["samples"]), int(DRAWING["samples"]))
        chain.drawing = asked(chain) | {"samples": str(samples)}
    chain.do("mc", lambda: _scatter(chain, where, workers, settings or {}))
    chain.reply.file("mc", chain.study.mc)


def _scatter(chain: Chain, where: str | None, workers: int, settings: Mapping[str, Any]) -> Sequence[Path]:
    from towtank.montecarlo.draw import tolerances
    from towtank.montecarlo.files import FOLDER, write_mc, write_std
    from towtank.montecarlo.study import monte_carlo

    study, wanted = chain.study, asked(chain)
    pieces = study.root / FOLDER / "pieces"
    chain.reply.kept = f"Finished pieces are kept in {pieces}."
    found = monte_carlo(
        chain.model(), int(wanted["samples"]), given=tolerances(wanted["mass"], wanted["cg"], wanted["current"]),
        seed=int(wanted["seed"]), progress=chain.reply.progress, ledger=pieces, where=where, workers=workers,
        settings=settings, program=program_hash(),
    )  # fmt: skip
    files = write_mc(found, study.root)
    if chain.done("trials"):
        record = study.stages()["trials"]
        write_std(found, study.trials)
        kept = [study.root / name for name in record["files"]]
        study.record("trials", record["inputs"], kept, record["wall_s"], record["summary"])
    chain.reply.kept = f"What is done is kept in {study.root}."
    return files


def spread(chain: Chain, trajectories: Sequence[Trajectory]) -> dict[str, dict[str, float]] | None:
    """Standard uncertainties of the indices, where the Monte Carlo study is up to date."""
    from towtank.montecarlo.files import read_mc, std_of

    if not chain.done("mc"):
        return None
    values = {t.name: {name: value for name, (value, _) in t.indices.items()} for t in trajectories}
    return std_of(read_mc(chain.study.root), values)
