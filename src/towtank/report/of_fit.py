"""Page section: what was done to the runs, and what the derivatives are worth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from towtank.derive.check import Check
from towtank.derive.consistency import consistency
from towtank.derive.fourier import DRIVEN
from towtank.derive.show import std_parts
from towtank.derive.table import Derivatives
from towtank.derive.verdicts import LIMITS, Tested
from towtank.errors import DeriveError
from towtank.figures import coefficients, series
from towtank.report.blocks import Block, Section, Table, Text, missing, number, percent, stated, with_std
from towtank.report.of_frequency import frequencies
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.symbols import TERMS

VERDICTS = ("rejected", "down-weighted", "exploratory", "accepted")
"""Verdicts of the screening, worst first."""


def fit(study: Study, book: Sketchbook) -> Section:
    """Screening of the runs, both fits, budget of the uncertainty, consistency, frequency study."""
    title = "Screening, uncertainty and consistency"
    it = study.derivatives
    if it is None:
        return Section("fit", title, (missing("There are no derivatives.", STAGES["derivatives"]),))
    blocks = [*_screening(study, it, book), *_ranges(study, it), *_lambda(it), *_budget(it, book)]
    return Section("fit", title, (*blocks, *_consistency(study, it), *frequencies(study, book)))


def _screening(study: Study, it: Derivatives, book: Sketchbook) -> list[Block]:
    """Runs by verdict, the tests, every run that failed one, and the loops of the oscillation that is trusted least."""
    found = it.quality.get("screening") or {}
    doubtful = {name: e for name, e in found.items() if e["verdict"] in VERDICTS[:2] and e["tests"]}
    blocks: list[Block] = []
    if found:
        counts = Counter(str(entry["verdict"]) for entry in found.values())
        words = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
        blocks += [Text(f"Every run was judged by stated tests: {words}."), _tests(found, it.level)]
    else:
        blocks.append(
            missing("The runs behind these derivatives were not screened.", "Run `towtank derive --screening`.")
        )
    if doubtful:
        blocks.append(_doubtful(doubtful, it.level))
    if left := [(name, why) for name, why in it.rejected if name not in doubtful]:
        blocks.append(_left_out(left, it.level))
    return blocks + _loops(study, it, doubtful, book)


def _tests(found: Mapping[str, Any], level: str) -> Table:
    """Each test with its limits, the number of runs, and the run that comes nearest to its limit or passes it most."""
    rows = []
    for name, limit in LIMITS.items():
        excess = {run: _tested(e["tests"][name]).excess for run, e in found.items() if name in e["tests"]}
        size = 100.0 if limit.unit == "%" else 1.0
        largest = max(excess.values(), default=0.0)
        worst = next((run for run, value in excess.items() if value == largest > 0.0), "-")
        failed = sum(not e["tests"][name]["passed"] for e in found.values() if name in e["tests"])
        rows.append((
            name, str(len(excess)), str(failed), number(size * largest, 3), worst, f"{size * limit.weigh:g}",
            f"{size * limit.reject:g}", limit.unit, limit.why,
        ))  # fmt: skip
    head = ("Test", "Runs", "failed", "Largest", "in run", "Limit", "rejects above", "Unit", "Why")
    more = "Above the limit a run is weighed down, docs/study.md"
    note = stated(level, "what noise alone may show is taken off each value", axes=False, more=more)
    return Table("Tests of the runs", head, tuple(rows), note)


def _tested(entry: Mapping[str, Any]) -> Tested:
    return Tested(float(entry["value"]), float(entry["noise"]))


def _doubtful(found: Mapping[str, Any], level: str) -> Table:
    order = sorted(found, key=lambda name: (VERDICTS.index(found[name]["verdict"]), found[name]["trust"]))
    rows = tuple(
        (name, str(found[name]["verdict"]), number(found[name]["trust"], 2), str(found[name]["why"]),
         "; ".join(_result(test, entry) for test, entry in found[name]["tests"].items()))
        for name in order
    )  # fmt: skip
    note = stated(level, "trust multiplies the weight of the run in the fit", axes=False)
    head = ("Run", "Verdict", "Trust", "Why", "All tests: value (limit)")
    return Table("Runs rejected or down-weighted", head, rows, note)


def _result(name: str, entry: Mapping[str, Any]) -> str:
    """``lack of fit 21.1 % (10)``."""
    unit = LIMITS[name].unit
    size = 100.0 if unit == "%" else 1.0
    return f"{name} {number(size * _tested(entry).excess, 3)} {unit} ({size * float(entry['limit']):g})"


def _left_out(left: list[tuple[str, str]], level: str) -> Table:
    """Runs beyond the range of the model or meant for the record only, by reason."""
    reasons: dict[str, list[str]] = {}
    for name, why in left:
        reasons.setdefault(why, []).append(name)
    rows = tuple((str(len(names)), ", ".join(names), why) for why, names in reasons.items())
    note = stated(level, "not applicable", axes=False)
    return Table("Runs that were not fitted", ("Number", "Runs", "Reason"), rows, note)


def _loops(study: Study, it: Derivatives, doubtful: Mapping[str, Any], book: Sketchbook) -> list[Block]:
    runs = [run for run in study.runs if run.name in doubtful and run.kind in DRIVEN and not run.steady]
    if not runs:
        return []
    run = min(runs, key=lambda run: float(doubtful[run.name]["trust"]))
    calls = [partial(series.hysteresis, run, DRIVEN[run.kind] + dot, "", it) for dot in ("", "dot")]
    return [book.panels(calls, "The oscillation that is trusted least, measured and modelled.", (2.3,), 2)]


def _ranges(study: Study, it: Derivatives) -> list[Block]:
    """The wide fit and the slopes at the origin side by side, each with the range it holds in."""
    if not it.origin:
        return []
    total = dict(zip(it.names, np.sqrt(np.maximum(np.diag(it.covariance), 0.0)), strict=True))
    method = it.quality.get("origin", {}).get("method", {})
    rows = []
    for name, slope in it.origin.items():
        wide, wide_std = with_std(it[name], float(total[name]))
        mean, std = with_std(float(slope), it.origin_std.get(name))
        change = "-" if it[name] == 0.0 else f"{100.0 * (slope / it[name] - 1.0):+.1f}"
        rows.append((
            f"{name} [{TERMS[name].unit}]", wide, wide_std, _wide_range(study, it, name),
            mean, std, method.get(name, "-"), change,
        ))  # fmt: skip
    head = ("Term", "Wide fit", "std", "over", "Slope at the origin", "std", "over", "Difference [%]")
    more = "The model and the turns use the wide fit; the stability indices use the slope at the origin as well"
    note = stated(it.level, "std is one standard uncertainty, all sources", more=more)
    return [Table("Wide fit against slope at the origin", head, tuple(rows), note)]


def _wide_range(study: Study, it: Derivatives, name: str) -> str:
    """``drift and incidence to 20 deg``, or ``r L/U to 0.45`` of the runs that were fitted."""
    if name[-1] in "vw":
        limit = it.quality.get("range_deg")
        return f"drift and incidence to {limit:g} deg" if limit else "-"
    out = {run for run, _ in it.rejected}
    rate = [
        float(np.abs(run.history.nu[:, 4:]).max()) * run.length / run.speed
        for run in study.runs
        if run.name not in out and not run.exploratory and run.speed > 0.0
    ]
    return f"r L/U and q L/U to {number(max(rate), 2)}" if rate else "-"


def _lambda(it: Derivatives) -> list[Block]:
    """Key terms for several weights of steady runs against oscillations, and the change beside the uncertainty."""
    found = {name: values for name, values in (it.quality.get("sensitivity") or {}).items() if name in it.names}
    if not found:
        return []
    weights = list(dict.fromkeys(weight for values in found.values() for weight in values))
    rows = []
    for name, values in found.items():
        i = it.names.index(name)
        std, held = float(np.sqrt(it.covariance[i, i])), [float(value) for value in values.values()]
        change = f"{(max(held) - min(held)) / std:.2f}" if std > 0.0 else "-"
        rows.append((name, *(number(values.get(weight)) for weight in weights), change, TERMS[name].unit))
    head = ("Term", *(f"lambda = {weight}" for weight in weights), "Change over std", "Unit")
    used = it.quality.get("weight_steady")
    more = f"The fit uses lambda = {used:g}" if used is not None else ""
    note = stated(it.level, "std is that of the term, all sources", more=more)
    return [Table("Weight of steady runs against oscillations", head, tuple(rows), note)]


def _budget(it: Derivatives, book: Sketchbook) -> list[Block]:
    """Bars and table of what each standard uncertainty is made of."""
    parts = std_parts(it)
    total = np.sqrt(np.maximum(np.diag(it.covariance), 0.0))
    rows = []
    for i, name in enumerate(it.names):
        value, own = float(it.values[i]), {part: float(std[i]) for part, std in parts.items()}
        shares = [percent(own[part], value) if parts[part].any() else "-" for part in parts]
        largest = max(own, key=lambda part: own[part]) if total[i] > 0.0 else "-"
        rows.append((name, *shares, percent(float(total[i]), value), largest))
    head = ("Term", "fit [%]", "mesh [%]", "model form [%]", "total [%]", "Largest")
    note = stated(it.level, "one standard uncertainty in per cent of the value; - is not stated; sources add in square")
    words = "Standard uncertainty of every term and its sources."
    return [
        book.draw(coefficients.uncertainty_shares, it, caption=words),
        Table("Uncertainty budget", head, tuple(rows), note),
    ]


def _consistency(study: Study, it: Derivatives) -> list[Block]:
    found = _checks(study, it)
    counts = Counter(check.verdict for check in found)
    words = ", ".join(f"{counts[verdict]} {verdict}" for verdict in ("fail", "warn", "pass", "not applicable"))
    rows = tuple(
        (check.name, check.verdict, number(check.value, 3), number(check.limit, 3), check.words) for check in found
    )
    note = stated(it.level, "a gap within two standard uncertainties passes", more="Limits: docs/coefficients.md")
    tone = "bad" if counts["fail"] else "plain" if counts["warn"] else "good"
    head = ("Check", "Verdict", "Value", "Limit", "In words")
    return [Text(f"Consistency of the set: {words}.", tone), Table("Consistency", head, rows, note)]


def _checks(study: Study, it: Derivatives) -> tuple[Check, ...]:
    """With the sizes of the craft; without them when the set is about another point than the craft's."""
    try:
        return consistency(it, study.craft)
    except DeriveError:
        return consistency(it)
