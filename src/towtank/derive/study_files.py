"""``frequency.json``, and the frequency study as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

from towtank.artefact import read_json, write_json
from towtank.derive.show import LEVELS
from towtank.derive.study import Advice, FrequencyStudy, Gain, Loop, Point, Trend
from towtank.errors import ArtefactError

SCHEMA = "towtank/frequency/1"
Row = TypeVar("Row", Point, Trend, Loop, Advice, Gain)

WORTH = 0.01
"""Least fall of the missed share of a load for which a group of optional terms is named: the floor of the weights."""


def write_frequencies(study: FrequencyStudy, path: Path) -> Path:
    """Write ``study`` as JSON; values in SI, frequencies and amplitudes primed.

    Raises
    ------
    ArtefactError
        The folder cannot be written.
    """
    return write_json(path, {"schema": SCHEMA, **asdict(study), "provenance": dict(study.provenance)})


def read_frequencies(path: Path) -> FrequencyStudy:
    """Read what ``write_frequencies`` wrote.

    Raises
    ------
    ArtefactError
        Missing, not JSON, of another schema, or not whole.
    """
    content = read_json(path, SCHEMA)
    try:
        return FrequencyStudy(
            craft=str(content["craft"]),
            level=str(content["level"]),
            points=_rows(Point, content["points"]),
            trends=_rows(Trend, content["trends"]),
            loops=_rows(Loop, content["loops"]),
            advice=_rows(Advice, content["advice"]),
            gains=_rows(Gain, content["gains"]),
            provenance=content["provenance"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(
            f"{path} is not a whole frequency study ({type(error).__name__}: {error}). Make it again: "
            "towtank derive --study."
        ) from None


def _rows(kind: type[Row], content: Sequence[dict[str, Any]]) -> tuple[Row, ...]:
    """Rows from their documents; null stands for NaN."""
    types = {field.name: str(field.type) for field in fields(kind)}
    return tuple(kind(**{name: _value(entry[name], kind_of) for name, kind_of in types.items()}) for entry in content)


def _value(value: Any, kind: str) -> Any:
    if kind == "float":
        return float("nan") if value is None else float(value)
    return tuple(float(x) for x in value) if kind.startswith("tuple") else value


def study_table(study: FrequencyStudy) -> str:
    """The study as plain text: trends, recommended motions, what optional terms would buy."""
    levels = "; ".join(LEVELS.get(level, level) for level in study.level.split(" + "))
    lines = [
        f"Derivatives of {study.craft} against frequency and amplitude. Level: {levels}",
        "Limit at w' -> 0 and small amplitude, 95 % interval, and the wide fit of all runs; SI",
        f"  {'kind':<7}{'term':<7}{'limit':>12}{'from':>12}{'to':>12}{'fit':>12}{'runs':>6}",
    ]
    lines += [
        f"  {t.kind:<7}{t.term:<7}{t.limit:12.5g}{_number(t.low)}{_number(t.high)}{_number(t.fit)}{t.points:6d}"
        for t in study.trends
        if t.points > 1
    ]
    lines += ["", "Recommended oscillations: w' = w L / U; amplitude of v / U, r L / U, p L / U or u / U"]
    lines += [
        f"  {a.kind:<7}w' {', '.join(f'{x:g}' for x in a.frequencies)}; amplitude "
        f"{', '.join(f'{x:g}' for x in a.amplitudes)} ({a.words})"
        for a in study.advice
    ]
    gains = [gain for gain in study.gains if gain.without - gain.within > WORTH]
    if gains:
        lines += ["", "Share of the loads that the fit misses, without and with optional terms (--with GROUP)"]
        lines += [f"  {g.group:<12}{g.kind:<14}{100 * g.without:6.1f} % {100 * g.within:6.1f} %" for g in gains]
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:12.5g}" if math.isfinite(value) else f"{'-':>12}"
