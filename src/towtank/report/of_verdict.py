"""Page sections: summary, verdict, validation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from towtank.errors import TowtankError
from towtank.figures import poles
from towtank.figures.paper import level_words
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.of_trials import headline, remarks
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study

PLANES = ("horizontal", "vertical")
SPEEDS = (0.5, 1.5, 11)
"""Range of the pole map as shares of the reference speed, and number of speeds."""


def summary(study: Study, book: Sketchbook) -> Section:
    """The verdict in words, a few numbers, what is missing."""
    blocks: list[Block] = []
    levels = ", ".join(level_words(level) for level in study.levels) or "no results"
    blocks.append(Text(f"Level of evidence: {levels}."))
    if study.verdict:
        blocks += _judgement(study.verdict)
    else:
        blocks.append(missing("There is no verdict.", STAGES["verdict"]))
    rows = [*_headline(study), *headline(study.trajectories)]
    if rows:
        table = Table("Main numbers", ("Quantity", "Value", "Unit"), tuple(rows),
                      stated(" + ".join(study.levels), "with each number in its own section"))  # fmt: skip
        blocks.append(table)
    blocks += remarks(study.trajectories)
    blocks += [Text(f"{stage}: {message}", "bad") for stage, message in study.problems]
    gone = [stage for stage in study.absent if stage not in ("grid", "validation", "plan")]
    if gone:
        blocks.append(Text(f"Stages that left nothing: {', '.join(gone)}. Their sections say what to do.", "missing"))
    return Section("summary", "Summary", tuple(blocks))


def _judgement(verdict: Mapping[str, Any]) -> list[Block]:
    words = verdict.get("words") or ()
    lines = [words] if isinstance(words, str) else list(words)
    planes = [verdict[plane] for plane in PLANES if isinstance(verdict.get(plane), Mapping)]
    tone = "good" if planes and all(plane.get("stable") for plane in planes) else "bad"
    return [Text(str(line), tone) for line in lines]


def _headline(study: Study) -> list[tuple[str, str, str]]:
    rows: list[tuple[str, str, str]] = []
    if study.craft:
        rows += [("Length", number(study.craft.length), "m"), ("Largest diameter", number(study.craft.diameter), "m"),
                 ("Mass", number(study.craft.mass.mass, 6), "kg")]  # fmt: skip
    if study.runs:
        rows.append(("Captive tests", str(len(study.runs)), ""))
    for plane in PLANES:
        it = study.verdict.get(plane)
        if isinstance(it, Mapping):
            rows += [(f"{words}, {plane} plane", value, "") for words, value in _plane_numbers(it)]
    if reversal := study.verdict.get("elevator_reversal_speed"):
        value = reversal.get("value") if isinstance(reversal, Mapping) else reversal
        rows.append(("Elevator reversal speed", number(value), "m/s"))
    return rows


def _plane_numbers(it: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Stability index and probability of a plane; an index may be a number or a mapping of names to numbers."""
    rows = []
    for key in it:
        if key == "G" or key.startswith(("G_", "P_")):
            value = it[key]
            if isinstance(value, Mapping):
                rows += [(f"{key}, {name.replace('_', ' ')}", number(v, 3)) for name, v in value.items() if _real(v)]
            elif _real(value):
                rows.append((key, number(float(value), 3)))
    return rows


def _real(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def verdict(study: Study, book: Sketchbook) -> Section:
    """Criteria, eigenvalues, requirements, and the pole map against speed."""
    blocks: list[Block] = []
    if study.verdict:
        blocks += _judgement(study.verdict)
        blocks.append(_planes(study.verdict))
        blocks += _requirements(study.verdict)
    else:
        blocks.append(missing("There is no verdict.", STAGES["verdict"]))
    blocks += _pole_maps(study, book)
    return Section("verdict", "Stability verdict", tuple(blocks))


def _planes(it: Mapping[str, Any]) -> Table:
    rows = []
    for plane in PLANES:
        of = it.get(plane)
        if not isinstance(of, Mapping):
            continue
        rows.append((plane, "eigenvalues [1/s]", ", ".join(_complex(value) for value in of.get("eigenvalues", ()))))
        if "stable" in of:
            rows.append((plane, "stable", "yes" if of["stable"] else "no"))
        rows += [(plane, words, value) for words, value in _plane_numbers(of)]
    reversal = it.get("elevator_reversal_speed")
    if _real(reversal):
        rows.append(("vertical", "elevator reversal speed [m/s]", number(reversal)))
    words = "P is the share of samples of the derivatives' uncertainty that are stable"
    more = f"At {number(it.get('speed'))} m/s. G above zero: straight-line stability with fins held"
    return Table(
        "Stability", ("Plane", "Quantity", "Value"), tuple(rows), stated(str(it.get("level", "")), words, more=more)
    )


def _complex(value: Any) -> str:
    if isinstance(value, Mapping):
        value = complex(value.get("real", 0.0), value.get("imag", 0.0))
    elif isinstance(value, list | tuple):
        value = complex(*value[:2])
    value = complex(value)
    return number(value.real, 3) if abs(value.imag) < 1e-9 else f"{number(value.real, 3)} {value.imag:+.3g}i"


def _requirements(it: Mapping[str, Any]) -> list[Block]:
    found = [entry for entry in it.get("requirements", ()) if isinstance(entry, Mapping)]
    if not found:
        return []
    head = tuple(dict.fromkeys(key for entry in found for key in entry))
    rows = tuple(tuple(_entry(entry.get(key)) for key in head) for entry in found)
    note = stated(str(it.get("level", "")), "as stated in the column, where there is one")
    return [Table("Requirements", tuple(key.replace("_", " ") for key in head), rows, note)]


def _entry(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if _real(value):
        return number(float(value))
    if isinstance(value, list | tuple):
        return ", ".join(_entry(item) for item in value)
    return "-" if value is None else str(value)


def _pole_maps(study: Study, book: Sketchbook) -> list[Block]:
    """Eigenvalues of both planes over speed from the model in hand; none without one."""
    if study.model is None:
        return [missing("No pole map: there is no model.", "It needs the craft and its derivatives.")]
    try:
        sweeps = [_sweep(study, plane) for plane in PLANES]
    except (TowtankError, np.linalg.LinAlgError) as error:
        return [Text(f"The poles against speed could not be found: {error}", "bad")]
    calls = [*(partial(poles.pole_map, sweep) for sweep in sweeps), partial(poles.real_parts, sweeps)]
    return [book.panels(calls, "Eigenvalues of the linear model about straight flight, fins held.", (2.4,), 3)]


def _sweep(study: Study, plane: str) -> poles.PoleSweep:
    from towtank.model import linear

    assert study.model is not None
    low, high, count = SPEEDS
    speeds = study.model.craft.speed * np.linspace(low, high, count)
    linearise = linear.horizontal if plane == "horizontal" else linear.vertical
    eigenvalues = np.array([np.linalg.eigvals(linearise(study.model, float(speed)).A) for speed in speeds])
    of = study.verdict.get(plane)
    indices = dict(_plane_numbers(of)) if isinstance(of, Mapping) else {}
    named = {words: float(value) for words, value in indices.items() if words.startswith("G") and value != "-"}
    return poles.PoleSweep(plane, study.model.derivatives.level, speeds, eigenvalues, named)


def validation(study: Study, book: Sketchbook) -> Section:
    """The tank against published tests: what was fitted and what was predicted."""
    rows = study.validation.get("rows", ())
    if not rows:
        return Section("validation", "Validation", (missing("No validation table is at hand.", STAGES["validation"]),))
    predicted = [abs(float(r["error_percent"])) for r in rows if str(r["role"]).startswith("predicted")]
    inside = [r for r in rows if "low" in r and r["low"] <= r["measured"] <= r["high"]]
    words = (
        "The tank on a craft that was tested, not on the craft of this report. Rows marked fitted set a constant "
        "of the tank and prove nothing; rows marked predicted do."
    )
    blocks: list[Block] = [Text(words)]
    if predicted:
        largest, middle = number(max(predicted), 3), number(float(np.median(predicted)), 3)
        blocks.append(Text(f"Predicted quantities: {len(predicted)}. Median error {middle} %, largest {largest} %."))
    if inside:
        banded = sum("low" in r for r in rows)
        blocks.append(Text(f"{len(inside)} of {banded} measured values lie inside the tank's own 95 % band."))
    head = ("Quantity", "Tank", "95 % band", "Measured", "Error [%]", "Role", "Source")
    uncertainty = "band of the model-form ensemble; of the measurements as in their source; error is tank less measured"
    note = stated(
        str(study.validation.get("level", "semi-empirical")),
        uncertainty,
        more=str(study.validation.get("reference", "")),
    )
    blocks.append(Table("Fast tank against measurements", head, tuple(_validation_row(r) for r in rows), note))
    return Section("validation", "Validation", tuple(blocks))


def _validation_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    band = f"{number(row['low'], 3)} to {number(row['high'], 3)}" if "low" in row and "high" in row else "-"
    error = f"{float(row['error_percent']):+.1f}"
    return (
        str(row["quantity"]), number(row["predicted"]), band, number(row["measured"]), error, str(row["role"]),
        str(row["source"]),
    )  # fmt: skip
