"""Page sections: test matrix, and the forces that were measured."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import radians

import numpy as np

from towtank.derive.show import fin_words
from towtank.figures import forces, series
from towtank.frames import drift_angle, incidence_angle
from towtank.plan.kinds import Plan
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.of_plan import chosen
from towtank.report.of_rans import resolution
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.tank.run import Run


def matrix(study: Study, book: Sketchbook) -> Section:
    """Captive tests by kind, and what the plan remarked."""
    blocks: list[Block] = []
    if study.runs:
        blocks.append(_by_kind(study.runs, _level(study.runs)))
        blocks += resolution(study.runs, book)
    elif study.plan is not None:
        blocks += [missing("No run has been made yet.", STAGES["runs"]), _planned(study.plan)]
    else:
        blocks.append(missing("No captive test was given.", STAGES["runs"]))
    if study.plan is not None and study.runs:
        left = {test.name for test in study.plan.tests} - {run.name for run in study.runs}
        if left:
            blocks.append(
                Text(f"{len(left)} of {len(study.plan.tests)} planned tests have no run: {_some(sorted(left))}.", "bad")
            )
    if study.plan is not None:
        blocks += [Text(f"Plan: {note}") for note in study.plan.notes[:12]]
    blocks += chosen(study.optimal)
    return Section("tests", "Test matrix", tuple(blocks))


def forces_section(study: Study, book: Sketchbook) -> Section:
    """Figures of the runs: steady loads with fit and residual, fins, oscillations, ensemble, residual of every run."""
    runs, fitted = study.runs, study.derivatives
    if not runs:
        return Section("forces", "Forces and moments", (missing("No run was given.", STAGES["runs"]),))
    blocks: list[Block] = []
    for kind, loads in (("drift", "XYN"), ("incidence", "XZM")):
        if len(forces.sweep(runs, loads[1], kind).runs) < 3:
            continue
        calls = [partial(forces.load_against_angle, runs, load, kind, fitted) for load in loads]
        heights = [2.3]
        if fitted is not None:
            calls += [partial(forces.residual_against_angle, runs, fitted, load, kind) for load in loads]
            heights.append(1.1)
        words = f"Loads against {forces.WORDS[kind]} at {number(runs[0].speed)} m/s, about the body origin."
        blocks.append(book.panels(calls, words, heights))
    blocks += _shares(runs, book)
    blocks += _fin_figures(study, book)
    blocks += _oscillations(study, book)
    if fitted is not None:
        words = "Misfit of every run. A kind of test that stands out is a kind the model does not hold."
        blocks.append(book.draw(series.residual_per_run, runs, fitted, caption=words))
    else:
        blocks.append(missing("No fit is drawn in the figures.", STAGES["derivatives"]))
    return Section("forces", "Forces and moments", tuple(blocks))


def appendix(study: Study, book: Sketchbook) -> Section:
    """Every run with its conditions, use and flags."""
    if not study.runs:
        return Section("runs", "Appendix: every run", (missing("No run was given.", STAGES["runs"]),))
    rejected = dict(study.derivatives.rejected) if study.derivatives else {}
    rows = []
    for run in study.runs:
        why = rejected.get(run.name, rejected.get(run.id, ""))
        fitted = "not derived" if study.derivatives is None else "no" if why or run.exploratory else "yes"
        peak = _peaks(run)
        rows.append((
            run.name, run.kind, number(run.speed, 3), number(peak["angle"], 3), number(peak["r"], 3),
            number(peak["w"], 3),
            "/".join(number(float(np.degrees(d)), 3) for d in run.delta[0]) if run.delta.any() else "0",
            fitted, "; ".join(filter(None, [why, *run.flags])),
        ))  # fmt: skip
    head = (
        "Run",
        "Kind",
        "U [m/s]",
        "largest angle to flow [deg]",
        "largest |rate| L/U",
        "w L/U",
        "fins [deg]",
        "fitted",
        "remarks",
    )
    note = stated(_level(study.runs), "of each load: see the figures of section Forces and moments")
    return Section("runs", "Appendix: every run", (Table("Runs", head, tuple(rows), note),))


def _level(runs: Sequence[Run]) -> str:
    return " + ".join(dict.fromkeys(run.level for run in runs))


def _some(names: Sequence[str], most: int = 6) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _peaks(run: Run) -> dict[str, float]:
    """Largest angle to the flow [deg], rate L/U [-] and frequency w L/U [-] of a run."""
    nu = run.history.nu[run.settled]
    angle = np.degrees(np.hypot(drift_angle(nu), incidence_angle(nu))).max()
    scale = run.length / run.speed if run.speed > 0.0 else 0.0
    rate = np.abs(nu[:, 3:]).max() * scale
    return {"angle": float(angle), "r": float(rate), "w": 2.0 * np.pi / run.period * scale if run.period else 0.0}


def _range(values: Sequence[float], digits: int = 3) -> str:
    low, high = min(values), max(values)
    return number(low, digits) if np.isclose(low, high) else f"{number(low, digits)} to {number(high, digits)}"


def _by_kind(runs: Sequence[Run], level: str) -> Table:
    rows = []
    for kind in dict.fromkeys(run.kind for run in runs):
        of = [run for run in runs if run.kind == kind]
        peak = [_peaks(run) for run in of]
        deflection = [float(np.degrees(np.abs(run.delta).max())) if run.delta.size else 0.0 for run in of]
        rows.append((
            kind, str(len(of)), _range([run.speed for run in of]), _range([p["angle"] for p in peak]),
            _range([p["r"] for p in peak]), _range([p["w"] for p in peak]), _range(deflection),
            str(sum(run.exploratory for run in of)), str(sum(bool(run.flags) for run in of)),
        ))  # fmt: skip
    head = ("Kind of test", "Runs", "U [m/s]", "largest angle to flow [deg]", "largest |rate| L/U", "w L/U",
            "largest fin angle [deg]", "exploratory", "flagged")  # fmt: skip
    more = "The first period of every oscillation is dropped in the analysis"
    return Table("Captive tests by kind", head, tuple(rows), stated(level, "motions are prescribed exactly", more=more))


def _planned(plan: Plan) -> Table:
    kinds = dict.fromkeys(test.kind for test in plan.tests)
    rows = tuple((kind, str(sum(test.kind == kind for test in plan.tests))) for kind in kinds)
    return Table("Planned captive tests", ("Kind of test", "Tests"), rows, stated("", "motions are prescribed exactly"))


def _shares(runs: Sequence[Run], book: Sketchbook) -> list[Block]:
    if not any(run.parts for run in runs):
        return [Text("The tank kept no parts of the loads, so their shares are not shown.")]
    calls = [partial(forces.shares, runs, load, "drift") for load in "YN"]
    return [book.panels(calls, "Where the load comes from, by part of the tank's model.", (2.5,), 2)]


def _fin_figures(study: Study, book: Sketchbook) -> list[Block]:
    linear_to = study.derivatives.quality.get("fins_range_deg") if study.derivatives else None
    calls = []
    for control, load in (("rudder", "Y"), ("rudder", "N"), ("elevator", "Z"), ("aileron", "K")):
        if len(forces.sweep(study.runs, load, control).runs) > 2:
            calls.append(
                partial(forces.fin_load, study.runs, load, control, study.derivatives, linear_to and radians(linear_to))
            )
    if not calls:
        return (
            [Text("No run has a deflected virtual rudder, elevator or aileron.")]
            if study.craft and study.craft.fins
            else []
        )
    words = (
        "Fin loads against the virtual angle. The derivative is fitted in the shaded range, the fin curve to all runs."
    )
    if study.derivatives is None or study.derivatives.fin_curve is None:
        words = (
            "Fin loads against the virtual angle. The derivative holds in the shaded range; the rest is recorded only."
        )
    stated_words = [Text(line) for line in fin_words(study.derivatives)] if study.derivatives else []
    return [book.panels(calls[:3], words, (2.3,), len(calls[:3])), *stated_words]


def _oscillations(study: Study, book: Sketchbook) -> list[Block]:
    harmonic = [run for run in study.runs if not run.steady and not run.exploratory]
    if not harmonic:
        return [Text("No oscillating run was given.")]
    blocks: list[Block] = []
    chosen = [[run for run in harmonic if run.kind == kind] for kind in ("sway", "yaw", "heave", "pitch")]
    chosen = [of for of in chosen if of][:2]
    if chosen:
        calls = [partial(series.time_series, of[-1], "", study.derivatives) for of in chosen]
        words = "Oscillations: the grey first period is dropped, the shaded cycles are fitted."
        blocks.append(book.panels(calls, words, (2.0,), len(calls)))
        rate = {"sway": "v", "yaw": "r", "heave": "w", "pitch": "q"}
        loops = [
            partial(series.hysteresis, of[-1], rate[of[0].kind] + dot, "", study.derivatives)
            for of in chosen
            for dot in ("", "dot")
        ]
        words = "Hysteresis: load against rate and against acceleration over the settled cycles, measured and modelled."
        blocks.append(book.panels(loops, words, (1.9,), len(loops)))
        if chosen[0][-1].ensemble is not None:
            words = "The tank's constants drawn from their distributions: what the model form leaves open."
            blocks.append(book.panels([partial(series.ensemble, of[-1]) for of in chosen], words, (2.0,), len(chosen)))
    return blocks
