"""verdict.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from towtank.artefact import read_json, write_json
from towtank.errors import ArtefactError
from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.fins import FinUse
from towtank.verdict.speeds import PlaneSpeeds, SpeedSweep
from towtank.verdict.table import Comparison, Criterion, Driver, Requirement, Verdict

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


def _number(value: float | str | None) -> float:
    """Null stands for what is no number, "inf" for a limit that is never reached."""
    return math.nan if value is None else float(value)


def _exact(entry: dict[str, Any]) -> dict[str, Any]:
    """Infinities as text, which JSON has no number for."""
    return {
        name: str(value) if isinstance(value, float) and math.isinf(value) else value for name, value in entry.items()
    }


_FIN_NUMBERS = tuple(item.name for item in fields(FinUse) if item.name not in ("trial", "kind", "loop"))


def _floats(entry: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: _number(value) if name in names else value for name, value in entry.items()}


def _requirement_in(r: Mapping[str, Any]) -> Requirement:
    numbers = ("value", "limit", "margin", "std", "probability")
    drivers = tuple(Driver(**_floats(d, ("effect", "step", "per_percent"))) for d in r.get("drivers", ()))
    return Requirement(**{**_floats(r, numbers), "met": bool(r["met"]), "drivers": drivers})


def _sweep_out(sweep: SpeedSweep) -> dict[str, Any]:
    def plane(of: PlaneSpeeds) -> dict[str, Any]:
        parts = {part: [[getattr(s, part) for s in row] for row in of.eigenvalues] for part in ("real", "imag")}
        return {**parts, "low": of.low, "high": of.high}

    return {"speed": sweep.speed, **{name: plane(of) for name, of in sweep.planes.items()}}


def _sweep_in(d: Mapping[str, Any]) -> SpeedSweep:
    def plane(of: Mapping[str, Any]) -> PlaneSpeeds:
        rows = zip(of["real"], of["imag"], strict=True)
        values = tuple(tuple(complex(a, b) for a, b in zip(*row, strict=True)) for row in rows)
        return PlaneSpeeds(values, tuple(map(_number, of["low"])), tuple(map(_number, of["high"])))

    return SpeedSweep(tuple(d["speed"]), {name: plane(of) for name, of in d.items() if name != "speed"})


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
            "requirements": [_exact(asdict(r)) for r in v.requirements],
            "together": v.together,
            "drawn": v.drawn,
            "criteria": [_exact(asdict(c)) for c in v.criteria],
            "against_speed": None if v.against_speed is None else _sweep_out(v.against_speed),
            "fins": [asdict(use) for use in v.fins],
            "comparison": [asdict(c) for c in v.comparison],
            "dominant": [{"term": name, "share": share} for name, share in v.dominant],
            "notes": list(v.notes),
            "words": v.words,
            "provenance": dict(v.provenance),
        },
    )


def read_verdict(path: Path | str) -> Verdict:
    """Read ``verdict.json``; what an older one does not hold stays empty.

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
            requirements=tuple(_requirement_in(r) for r in d["requirements"]),
            comparison=tuple(
                Comparison(c["quantity"], _number(c["open"]), _number(c["closed"]), c["unit"], c["note"])
                for c in d["comparison"]
            ),
            dominant=tuple((item["term"], float(item["share"])) for item in d["dominant"]),
            notes=tuple(d["notes"]),
            words=d["words"],
            provenance=d["provenance"],
            criteria=tuple(Criterion(**_floats(c, ("value", "low", "high"))) for c in d.get("criteria", ())),
            against_speed=_sweep_in(d["against_speed"]) if d.get("against_speed") else None,
            fins=tuple(FinUse(**_floats(use, _FIN_NUMBERS)) for use in d.get("fins", ())),
            together=_number(d.get("together")),
            drawn=d.get("drawn", ""),
        )
    except (KeyError, TypeError) as error:
        raise ArtefactError(f"{path} is not a whole verdict ({error}). Run `towtank assess` again.") from None
