"""verdict.json."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.table import Comparison, Requirement, Verdict

SCHEMA = "towtank/verdict/1"


def _plane_out(c: PlaneCriteria) -> dict[str, Any]:
    return {
        "eigenvalues": [{"real": s.real, "imag": s.imag} for s in c.eigenvalues],
        "G": {"value": c.index, "std": c.index_std, "low": c.index_range[0], "high": c.index_range[1]},
        "G_wide": c.index_wide,
        "slopes": c.slopes,
        "stable": c.stable,
        "P_stable": c.probability,
        "doubling": c.doubling,
    }


def _plane_in(plane: str, document: dict[str, Any]) -> PlaneCriteria:
    G = document["G"]
    return PlaneCriteria(
        plane=plane,
        slopes=str(document["slopes"]),
        eigenvalues=tuple(complex(s["real"], s["imag"]) for s in document["eigenvalues"]),
        index=_number(G["value"]),
        index_std=_number(G["std"]),
        index_range=(_number(G["low"]), _number(G["high"])),
        index_wide=_number(document["G_wide"]),
        stable=bool(document["stable"]),
        probability=float(document["P_stable"]),
        doubling=_number(document["doubling"]),
    )


def _number(value: float | None) -> float:
    """Null stands for a number that is not finite."""
    return math.nan if value is None else float(value)


def write_verdict(verdict: Verdict, path: Path | str) -> Path:
    """Write ``verdict.json``, schema ``towtank/verdict/1``.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    v = verdict
    return write_json(
        Path(path),
        {
            "schema": SCHEMA,
            "craft": v.craft,
            "level": v.level,
            "speed": v.speed,
            "horizontal": _plane_out(v.horizontal),
            "vertical": _plane_out(v.vertical),
            "elevator_reversal_speed": v.elevator_reversal_speed,
            "effectiveness": {name: {"value": x, "unit": unit} for name, (x, unit) in v.effectiveness.items()},
            "requirements": [asdict(r) for r in v.requirements],
            "comparison": [asdict(c) for c in v.comparison],
            "dominant": [{"term": name, "share": share} for name, share in v.dominant],
            "notes": list(v.notes),
            "words": v.words,
            "provenance": dict(v.provenance),
        },
    )


def read_verdict(path: Path | str) -> Verdict:
    """Read ``verdict.json``.

    Raises
    ------
    ArtefactError
        Missing, not a verdict, or a key is missing.
    """
    d = read_json(Path(path), SCHEMA)
    reversal = d.get("elevator_reversal_speed")
    try:
        return Verdict(
            craft=d["craft"],
            level=d["level"],
            speed=float(d["speed"]),
            horizontal=_plane_in("horizontal", d["horizontal"]),
            vertical=_plane_in("vertical", d["vertical"]),
            elevator_reversal_speed=None if reversal is None else float(reversal),
            effectiveness={name: (_number(x["value"]), x["unit"]) for name, x in d["effectiveness"].items()},
            requirements=tuple(
                Requirement(r["name"], _number(r["value"]), r["unit"], _number(r["limit"]), bool(r["met"]), r["note"])
                for r in d["requirements"]
            ),
            comparison=tuple(
                Comparison(c["quantity"], _number(c["open"]), _number(c["closed"]), c["unit"], c["note"])
                for c in d["comparison"]
            ),
            dominant=tuple((item["term"], float(item["share"])) for item in d["dominant"]),
            notes=tuple(d["notes"]),
            words=d["words"],
            provenance=d["provenance"],
        )
    except (KeyError, TypeError) as error:
        raise ArtefactError(f"{path} is not a whole verdict ({error}). Run `towtank assess` again.") from None
