"""Page sections: summary, verdict, validation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from towtank.errors import TowtankError
from towtank.figures import poles
from towtank.figures.paper import level_words
from towtank.report import of_requirements
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated, with_std
from towtank.report.of_trials import headline, remarks
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from towtank.model.equations import Model
    from towtank.verdict.table import Verdict

PLANES = ("horizontal", "vertical")
SYMBOL = {"horizontal": "G_h", "vertical": "G_v"}


def summary(study: Study, book: Sketchbook) -> Section:
    """The verdict in words, a few numbers, what is missing."""
    blocks: list[Block] = []
    levels = ", ".join(level_words(level) for level in study.levels) or "no results"
    blocks.append(Text(f"Level of evidence: {levels}."))
    if study.verdict:
        blocks += _judgement(study.verdict)
    else:
        blocks.append(missing("There is no verdict.", STAGES["verdict"]))
    rows = [*_headline(study), *headline(study.trajectories, study.index)]
    if rows:
        note = stated(" + ".join(study.levels), "std is one standard uncertainty, - where it is not stated here")
        table = Table("Main numbers", ("Quantity", "Value", "std", "Unit"), tuple(rows), note)
        blocks.append(table)
    blocks += remarks(study.trajectories)
    blocks += [Text(f"{stage}: {message}", "bad") for stage, message in study.problems]
    gone = [stage for stage in study.absent if stage not in ("grid", "validation", "plan")]
    if gone:
        blocks.append(Text(f"Stages that left nothing: {', '.join(gone)}. Their sections say what to do.", "missing"))
    return Section("summary", "Summary", tuple(blocks))


def _judgement(it: Verdict) -> list[Block]:
    """The words of the verdict, paragraph by paragraph; the first carries the colour."""
    tone = "good" if it.horizontal.stable and it.vertical.stable and all(r.met for r in it.requirements) else "bad"
    lines = [line.strip() for line in it.words.split("\n\n") if line.strip()]
    return [Text(line, tone if i == 0 else "plain") for i, line in enumerate(lines)]


def _headline(study: Study) -> list[tuple[str, str, str, str]]:
    """Main numbers: words, value, standard uncertainty, unit."""
    rows: list[tuple[str, str, str, str]] = []
    if study.craft:
        rows += [("Length", number(study.craft.length), "-", "m"),
                 ("Largest diameter", number(study.craft.diameter), "-", "m"),
                 ("Mass", number(study.craft.mass.mass, 6), "-", "kg")]  # fmt: skip
    if study.runs:
        rows.append(("Captive tests", str(len(study.runs)), "-", ""))
    if it := study.verdict:
        for plane in (it.horizontal, it.vertical):
            rows.append((f"Stability index {SYMBOL[plane.plane]}", *with_std(plane.index, plane.index_std), ""))
            rows.append((f"Probability of being stable, {plane.plane} plane", number(plane.probability, 3), "-", ""))
        if it.elevator_reversal_speed is not None:
            rows.append(("Elevator reversal speed", number(it.elevator_reversal_speed, 3), "-", "m/s"))
    return rows


def verdict(study: Study, book: Sketchbook) -> Section:
    """Words, criteria, requirements, open against closed loop, and the poles against speed."""
    blocks: list[Block] = []
    if it := study.verdict:
        blocks += [*_judgement(it), _planes(it), *of_requirements.criteria(it), *of_requirements.asked(it, book)]
        if it.comparison:
            blocks.append(_comparison(it))
        blocks += of_requirements.fins(it)
        if it.effectiveness:
            blocks.append(_effectiveness(it))
    else:
        blocks.append(missing("There is no verdict.", STAGES["verdict"]))
    blocks += _pole_maps(study, book)
    return Section("verdict", "Stability verdict", tuple(blocks))


def _planes(it: Verdict) -> Table:
    rows: list[tuple[str, str, str]] = []
    for of in (it.horizontal, it.vertical):
        symbol = SYMBOL[of.plane]
        mean, std = with_std(of.index, of.index_std)
        low, high = of.index_range
        rows += [
            (of.plane, "stable, fins held", "yes" if of.stable else "no"),
            (of.plane, "probability of being stable", number(of.probability, 3)),
            (of.plane, f"{symbol}, {_SLOPES[of.slopes]}", f"{mean} ± {std}"),
            (of.plane, f"{symbol}, 5 to 95 %", f"{number(low, 3)} to {number(high, 3)}"),
            (of.plane, f"{symbol}, wide fit", number(of.index_wide, 3)),
            (of.plane, "eigenvalues [1/s]", ", ".join(_complex(value) for value in of.eigenvalues)),
            (of.plane, "least damped motion doubles in (negative: halves in) [s]", number(of.doubling, 3)),
        ]
    if it.elevator_reversal_speed is not None:
        rows.append(("vertical", "elevator reversal speed [m/s]", number(it.elevator_reversal_speed, 3)))
    words = (
        f"std and range over {it.drawn or 'samples of the derivatives'}; the probability is the share that is stable"
    )
    more = f"At {number(it.speed)} m/s. G above zero: straight-line stability with fins held"
    return Table("Stability", ("Plane", "Quantity", "Value"), tuple(rows), stated(it.level, words, more=more))


def _complex(value: complex) -> str:
    return number(value.real, 3) if abs(value.imag) < 1e-9 else f"{number(value.real, 3)} {value.imag:+.3g}i"


def _comparison(it: Verdict) -> Table:
    rows = tuple((c.quantity, number(c.open), number(c.closed), c.unit, c.note) for c in it.comparison)
    head = ("Quantity", "Open loop", "Autopilot", "Unit", "Trials")
    return Table("Open against closed loop", head, rows, stated(it.level, "none stated; nominal model"))


def _effectiveness(it: Verdict) -> Table:
    rows = tuple((name.replace("_", " "), number(value), unit) for name, (value, unit) in it.effectiveness.items())
    return Table(
        "What the fins do", ("Quantity", "Value", "Unit"), rows, stated(it.level, "none stated; nominal model")
    )


def _pole_maps(study: Study, book: Sketchbook) -> list[Block]:
    """Eigenvalues of both planes over speed, and G over the uncertainty, from the model in hand; none without one."""
    if study.model is None:
        return [missing("No pole map: there is no model.", "It needs the craft and its derivatives.")]
    slopes = "origin" if study.model.derivatives.origin else "wide"
    try:
        sweeps = _sweeps(study.model, study.verdict, slopes)
        calls = [*(partial(poles.pole_map, sweep) for sweep in sweeps), partial(poles.real_parts, sweeps)]
    except (TowtankError, np.linalg.LinAlgError) as error:
        return [Text(f"The poles against speed could not be found: {error}", "bad")]
    words = f"Eigenvalues of the linear model about straight flight, fins held, on the {_SLOPES[slopes]}."
    blocks: list[Block] = [book.panels(calls, words, (2.4,), 3)]
    if study.model.derivatives.covariance.any():
        drawn = [partial(_index_figure, study.model, plane, slopes) for plane in PLANES]
        words = "Stability indices over the uncertainty of the derivatives, fit and model form together."
        blocks.append(book.panels(drawn, words, (1.9,), 2))
    return blocks


_SLOPES = {"origin": "slopes at the origin", "wide": "wide fit"}


def _sweeps(model: Model, judged: Verdict | None, slopes: str) -> list[poles.PoleSweep]:
    """Both planes against speed: those of the verdict, or of craft drawn here for a report without one."""
    from towtank.model import linear
    from towtank.verdict.many import drawn
    from towtank.verdict.speeds import speed_sweep

    found = judged.against_speed if judged and judged.against_speed else speed_sweep(drawn(model).craft)
    kinds = ("wide", "origin") if slopes == "origin" else ("wide",)
    out = []
    for plane in PLANES:
        of = found.planes[plane]
        values = {kind: getattr(linear.stability_indices(model, kind), plane) for kind in kinds}
        indices = {f"{SYMBOL[plane]}, {_SLOPES[kind]}": float(value) for kind, value in values.items()}
        out.append(
            poles.PoleSweep(
                plane, model.derivatives.level, np.array(found.speed), np.array(of.eigenvalues), indices,
                np.array([of.low, of.high]),
            )
        )  # fmt: skip
    return out


def _index_figure(model: Model, plane: str, slopes: str, ax: Axes | None = None) -> Axes:
    from towtank.verdict import criteria

    values = criteria.index(model, criteria.samples(model, slopes=slopes), plane)
    return poles.stability_index(SYMBOL[plane], values[1:], float(values[0]), model.derivatives.level, ax)


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
