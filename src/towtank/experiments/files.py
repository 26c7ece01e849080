"""``optimal.json``: what an optimal plan was chosen for, what it leaves, what it saves."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.experiments.optimal import Optimal, Scored
from towtank.experiments.rehearsal import Rehearsal
from towtank.plan.files import write_plan
from towtank.provenance import provenance

SCHEMA = "towtank/optimal/1"


def write_optimal(
    optimal: Optimal,
    folder: Path,
    asked: Mapping[str, Any] | None = None,
    rehearsals: Mapping[str, Rehearsal] | None = None,
) -> tuple[Path, Path, Path]:
    """Write ``plan.toml``, ``plan.csv`` and ``optimal.json`` into ``folder``; their paths.

    asked : what the result depends on, kept so that the same question need not be answered twice.
    rehearsals : "chosen", "standard" -> campaigns carried out on known coefficients.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    folder = Path(folder)
    plan, table = write_plan(optimal.plan, folder)
    document = optimal_document(optimal) | {"rehearsal": {k: _rehearsed(r) for k, r in (rehearsals or {}).items()}}
    document |= {"asked": dict(asked or {}), "plan_hash": plan_hash(plan)}
    return plan, table, write_json(folder / "optimal.json", document)


def read_optimal(path: Path) -> dict[str, Any]:
    """The content of ``optimal.json`` at ``path``.

    Raises
    ------
    ArtefactError
        Missing, not whole, or of another schema.
    """
    return dict(read_json(Path(path), SCHEMA))


def plan_hash(path: Path) -> str:
    """First 16 hex digits of the SHA-256 of a plan on file; empty when there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.is_file() else ""


def own_plan(folder: Path) -> bool:
    """True when ``plan.toml`` in ``folder`` is as an optimal plan left it."""
    try:
        known = read_optimal(Path(folder) / "optimal.json").get("plan_hash", "")
    except ArtefactError:
        return False
    return bool(known) and known == plan_hash(Path(folder) / "plan.toml")


def optimal_document(optimal: Optimal) -> dict[str, Any]:
    """``optimal`` as JSON content. Costs are in mean runs of the standard plan, standard deviations in SI."""
    standard, bearing = optimal.standard, optimal.bearing
    return {
        "schema": SCHEMA,
        "craft": optimal.plan.craft.name,
        "speed": optimal.plan.speed,
        "aim": list(optimal.aim),
        "criterion": optimal.criterion,
        "budget": optimal.budget,
        "loads": optimal.source,
        "error_model": asdict(optimal.error),
        "cost_model": asdict(optimal.cost_model) | {"mean_standard_run": optimal.unit},
        "candidates": optimal.candidates,
        "values": dict(optimal.values),
        "chosen": plain(optimal.chosen),
        "standard": plain(standard),
        "standard_bearing": plain(bearing),
        "equal_cost": plain(optimal.equal)
        | {
            "size_ratio": optimal.equal.size / bearing.size,
            "std_ratio": {name: std / bearing.std[name] for name, std in optimal.equal.std.items()},
        },
        "least": None if optimal.least is None else plain(optimal.least),
        "least_size": None if optimal.least_size is None else plain(optimal.least_size),
        "saves": optimal.saves,
        "not_determined": list(optimal.open_terms),
        "provenance": provenance(),
    }


def saving(found: Mapping[str, Any]) -> str:
    """What the content of ``optimal.json`` saves, in words."""
    saves, least, size = found["saves"], found["least"], found["least_size"]
    ratio = found["equal_cost"]["size_ratio"]
    at_equal = (
        ""
        if ratio is None
        else f" At equal cost the uncertainty is {ratio:.2f} of the standard plan's (geometric mean)."
    )
    by_size = (
        "" if size is None else f" In the geometric mean, {size['number']} runs of cost {size['cost']:.1f} are enough."
    )
    if least is None:
        return f"No smaller plan was found that leaves every value as certain as the standard one.{by_size}{at_equal}"
    return (
        f"Saves {saves['runs']:g} runs of {saves['of_runs']:g} that bear on it in the standard plan, and "
        f"{saves['cost']:.1f} of {saves['of_cost']:.1f} in cost: {least['number']} runs leave every value as certain, "
        f"by prediction.{by_size}{at_equal}"
    )


def plain(scored: Scored) -> dict[str, Any]:
    """``scored`` as JSON content."""
    return {
        "number": len(scored.runs),
        "cost": scored.cost,
        "size": scored.size,
        "std": dict(scored.std),
        "runs": list(scored.runs),
    }


def _rehearsed(rehearsal: Rehearsal) -> dict[str, Any]:
    return {
        "campaigns": len(rehearsal.found),
        "std": dict(zip(rehearsal.names, rehearsal.std.tolist(), strict=True)),
        "predicted": dict(zip(rehearsal.names, rehearsal.predicted.tolist(), strict=True)),
    }
