"""Page sections: sensitivity, limits, fitted constants, provenance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.symbols import TERMS

LIMITS = (
    "The body is deeply submerged in unbounded water at rest or in a uniform current; no waves, free surface, walls "
    "or bottom.",
    "The model has no terms with sway and yaw together (or heave and pitch) but the axial ones, unless third-order "
    "terms stand in the table of coefficients; no interaction of fin angle and drift beyond the straightening factors; "
    "and no memory of the flow. It holds ahead, within the angles and rates of the captive tests.",
    "The indices are those of the nominal coefficients unless a standard uncertainty is printed beside them.",
)
TANK_LIMITS = (
    "The fast tank is semi-empirical: potential flow, boundary layer, cross-flow and fin lift with the constants "
    "listed in this report. It is not CFD and not experiment. It knows no propeller, sail, antenna, lee vortex "
    "or laminar separation. The load of strakes is slender-body theory and was compared with two experiments only.",
)
HARMONIC = {"sway", "yaw", "heave", "pitch"}


def sensitivity(study: Study, book: Sketchbook) -> Section:
    """Which uncertainties dominate."""
    it = study.derivatives
    if it is None:
        return Section("sensitivity", "Sensitivity", (missing("There are no derivatives.", STAGES["derivatives"]),))
    total = np.sqrt(np.maximum(np.diag(it.covariance), 0.0))
    share = {name: 100.0 * total[i] / abs(it.values[i]) for i, name in enumerate(it.names) if it.values[i] != 0.0}
    worst = sorted(share, key=lambda name: -share[name])[:8]
    rows = tuple((name, TERMS[name].meaning, number(share[name], 3), _main_source(study, name)) for name in worst)
    words = "one standard uncertainty, all sources"
    blocks: list[Block] = [
        Table("Terms known least", ("Term", "Meaning", "std [%]", "Main source"), rows, stated(it.level, words)),
    ]
    return Section("sensitivity", "Sensitivity", tuple(blocks))


def _main_source(study: Study, name: str) -> str:
    it = study.derivatives
    assert it is not None
    i = it.names.index(name)
    sources = {
        "fit": it.covariance_fit[i, i],
        "mesh": it.covariance_mesh[i, i],
        "model form": it.covariance_model[i, i],
    }
    return max(sources, key=lambda key: float(sources[key])) if any(sources.values()) else "none stated"


def limits(study: Study, book: Sketchbook) -> Section:
    """Where the results hold, the levels met, and the validity flags of the runs with their counts."""
    blocks: list[Block] = [Text(words) for words in LIMITS]
    if "semi-empirical" in study.levels:
        blocks += [Text(words) for words in TANK_LIMITS]
    blocks += _presets(study)
    if len(study.levels) > 1:
        blocks.append(
            Text(
                f"This page holds several levels of evidence: {', '.join(study.levels)}. Each table names its own.",
                "bad",
            )
        )
    flags = Counter(flag for run in study.runs for flag in run.flags)
    if flags:
        rows = tuple((str(count), flag) for flag, count in flags.most_common(30))
        note = stated(" + ".join(dict.fromkeys(run.level for run in study.runs)), "not applicable", axes=False)
        blocks.append(Table("Validity flags of the runs", ("Runs", "Flag"), rows, note))
    elif study.runs:
        blocks.append(Text("No run carries a validity flag."))
    return Section("limits", "Limits and level of evidence", tuple(blocks))


def _presets(study: Study) -> list[Block]:
    """What each preset of the RANS tank was measured to miss; a table for every preset among the runs."""
    from towtank.tank.openfoam.errors import SOURCE, measured

    told = [run.provenance.get("model_form") for run in study.runs if run.level == "rans"]
    blocks: list[Block] = []
    for preset in dict.fromkeys(str(entry["preset"]) for entry in told if isinstance(entry, Mapping)):
        rows = [
            (
                "drift to" if e.family == "translation" else "turn",
                f"{e.up_to:g} deg" if e.family == "translation" else "-",
                "with fins" if e.fins else "bare",
                e.load,
                *(number(100.0 * value, 3) for value in (e.bias, e.scatter)),
                str(e.points),
            )
            for e in measured(preset)
        ]
        head = ("Motion", "Range", "Hull", "Load", "Bias [%]", "Scatter [%]", "Points")
        note = stated("rans", f"error against {SOURCE}; its size is the model form of every run of that kind")
        blocks.append(Table(f"Measured error of the preset {preset}", head, tuple(rows), note))
    if any(entry is None for entry in told):
        words = "Some RANS runs are of a set-up never compared with an experiment; their model form is not stated."
        blocks.append(Text(words, "missing"))
    return blocks


def constants(study: Study, book: Sketchbook) -> Section:
    """Every fitted constant of the fast tank and what it was fitted on, when the fast tank made the runs."""
    title = "Fitted constants"
    if study.runs and "semi-empirical" not in study.levels:
        return Section(
            "constants",
            title,
            (Text("No run comes from the fast tank, so no fitted constant is behind these results."),),
        )
    from towtank.tank.fast.constants import CONSTANTS, STRAKES

    rows = tuple(
        (
            c.name,
            number(c.value),
            f"{number(c.spread)}" + (" absolute" if c.additive else " relative"),
            c.meaning,
            c.fitted_on or "not fitted",
        )
        for c in (*CONSTANTS, *(STRAKES if study.craft and study.craft.strakes else ()))
    )
    head = ("Constant", "Value", "std in the ensemble", "Meaning", "Fitted on")
    words = "each constant is drawn from its distribution in the ensemble; that spread is the model-form uncertainty"
    blocks: tuple[Block, ...] = (
        Table("Constants of the fast tank", head, rows, stated("semi-empirical", words, axes=False)),
    )
    return Section("constants", title, blocks)


def provenance(study: Study, book: Sketchbook) -> Section:
    """Where each stage's numbers came from."""
    found: list[tuple[str, Mapping[str, Any]]] = []
    if study.runs:
        found.append(("captive tests", study.runs[0].provenance))
    if study.derivatives:
        found.append(("derivatives", study.derivatives.provenance))
    if study.trajectories:
        found.append(("trials", study.trajectories[0].provenance))
    if study.verdict:
        found.append(("verdict", study.verdict.provenance))
    rows = []
    for stage, block in found:
        for key in ("program", "version", "date", "platform", "tank"):
            if key in block:
                rows.append((stage, key, str(block[key])))
        settings = block.get("settings")
        if isinstance(settings, Mapping):
            rows += [(stage, f"setting {key}", _short(value)) for key, value in settings.items()]
        if isinstance(block.get("inputs"), Mapping) and block["inputs"]:
            rows.append((stage, "inputs", f"{len(block['inputs'])} recorded"))
    if not rows:
        return Section("provenance", "Provenance", (missing("No stage recorded where its numbers came from.", ""),))
    note = stated("", "not applicable", axes=False)
    return Section("provenance", "Provenance", (Table("Provenance", ("Stage", "Item", "Value"), tuple(rows), note),))


def _short(value: Any, most: int = 120) -> str:
    text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, Mapping) else str(value)
    return text if len(text) <= most else text[:most] + " ..."
