"""The derive stage of a study: what the user asked of the fit, the mesh study it takes up, the frequency study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from towtank.cli import budget, towing
from towtank.cli.study import file_hash

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.derive.table import Derivatives
    from towtank.grid.study import GridStudy

FITTING = {"optional": "", "steady": "", "screening": "yes"}
"""What is asked of a fit that was asked for nothing else: no optional terms, lambda by slenderness, screening."""


def asked(chain: Chain) -> dict[str, str]:
    """What is asked of the fit: by the user now, by the record of the study, or ``FITTING``."""
    known = chain.study.stages().get("derive", {}).get("inputs", {})
    return chain.fitting or {name: known.get(name, usual) for name, usual in FITTING.items()}


def inputs(chain: Chain) -> dict[str, str]:
    """Name -> hash or text of what the fit depends on beside craft and runs."""
    return asked(chain) | {"grid": file_hash(_grid_file(chain)), "budget": towing.asked(chain)["budget"]}


def fit(chain: Chain) -> Derivatives:
    """Derivatives of the runs of the study, with the straightening factors, checked against the sizes of the craft.

    Within a budget: those of the fast tank, corrected by the runs.
    """
    from towtank.derive.consistency import consistency
    from towtank.derive.straightening import with_straightening

    derived = budget.corrected(chain) if towing.asked(chain)["budget"] else _of_runs(chain)
    derived = with_straightening(derived, chain.craft)
    checks = [check.document() for check in consistency(derived, chain.craft)]
    return replace(derived, quality={**derived.quality, "consistency": checks})


def _of_runs(chain: Chain) -> Derivatives:
    from towtank.derive.derive import derive

    wanted = asked(chain)
    return derive(
        chain.runs(),
        weight_steady=float(wanted["steady"]) if wanted["steady"] else None,
        screening=wanted["screening"] == "yes",
        grid=mesh_study(chain),
        optional=tuple(wanted["optional"].split(",")) if wanted["optional"] else (),
    )


def write(chain: Chain) -> Sequence[Path]:
    """Fit, and write derivatives, model, and the study of frequency and amplitude where there are oscillations."""
    from towtank.derive.files import write_derivatives
    from towtank.derive.study import frequency_study
    from towtank.derive.study_files import write_frequencies

    derived = fit(chain)
    write_derivatives(derived, chain.replacing(chain.study.derivatives))
    files = [chain.study.derivatives, chain.write_model()]
    if any(not run.steady for run in chain.runs()) and not towing.asked(chain)["budget"]:
        files.append(write_frequencies(frequency_study(chain.runs(), derived), chain.study.frequency))
    return files


def _grid_file(chain: Chain) -> Path:
    return chain.study.root / "grid.json"


def mesh_study(chain: Chain) -> GridStudy | None:
    """The mesh study of the study folder, when there is one."""
    from towtank.grid.files import read_grid

    path = _grid_file(chain)
    if not path.exists():
        return None
    chain.reply.log(f"derive   mesh uncertainty from {path}")
    return read_grid(path)
