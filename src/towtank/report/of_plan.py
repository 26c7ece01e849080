"""Part of a page section: a plan that was chosen for what it tells, and what that saves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from towtank.experiments.files import saving
from towtank.report.blocks import Block, Table, Text, number, stated

SETS = {
    "chosen": "this plan", "standard": "standard plan", "equal_cost": "best at equal cost", "least": "least as certain",
}  # fmt: skip
"""Sets of runs in optimal.json -> their names in the table."""


def chosen(found: Mapping[str, Any]) -> list[Block]:
    """What ``optimal.json`` says: the aim, the saving, and each standard deviation over that by the standard plan."""
    if not found:
        return []
    sets = {name: found[key] for key, name in SETS.items() if found[key]}
    base = found["standard"]["std"]
    rows = [
        ("runs", *(str(item["number"]) for item in sets.values())),
        ("cost", *(number(item["cost"], 3) for item in sets.values())),
        *((name, *(_share(item["std"][name], base[name]) for item in sets.values())) for name in found["aim"]),
    ]
    more = (
        "Cost in mean runs of the standard plan; below it the predicted standard deviation of each aim over that by "
        f"the standard plan. Loads from: {found['loads']}"
    )
    words = (
        f"The captive tests were chosen: {found['criterion']}-optimal for {_named(found['aim'])} among "
        f"{found['candidates']} candidates, {found['budget']} runs allowed. "
    )
    return [
        Text(words + saving(found)),
        Table("Captive tests chosen", ("", *sets), tuple(rows), stated("", "predicted, before any run", False, more)),
    ]


def _named(aim: list[str]) -> str:
    return ", ".join(aim) if len(aim) <= 6 else f"{len(aim)} derivatives"


def _share(std: float | None, base: float | None) -> str:
    return "-" if std is None or not base else number(std / base, 2)
