"""Page section: mathematical model and derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from towtank.derive.table import Derivatives
from towtank.figures import coefficients
from towtank.report.blocks import Block, Section, Table, Text, missing, number, stated, with_std
from towtank.report.pictures import Sketchbook
from towtank.report.study import STAGES, Study
from towtank.symbols import LOADS, TERMS

EQUATIONS = (
    "Six degrees of freedom, lumped parameters: (M_RB - M_A) nudot + (C_RB - C_A) nu - D nu + G = tau. Derivatives are "
    "natural: each term is a load on the body, so damping and added-mass derivatives are mostly negative."
)
VARIANTS = {
    "lumped": "Variant lumped: the damping terms hold the total measured load, and the added-mass matrix C_A leaves "
    "out the products they already carry.",
    "split": "Variant split: the full added-mass matrix C_A stands, and the damping terms hold only the remainder.",
}


def model(study: Study, book: Sketchbook) -> Section:
    """Equations in words, the derivatives dimensional and primed with their uncertainty, and the quality of the fit."""
    title = "Mathematical model and derivatives"
    it = study.derivatives
    if it is None:
        return Section("model", title, (Text(EQUATIONS), missing("There are no derivatives.", STAGES["derivatives"])))
    blocks: list[Block] = [
        Text(EQUATIONS),
        Text(VARIANTS.get(it.variant, f"Variant {it.variant}.")),
        _reference(it),
        _table(it),
    ]
    names = [(title, [n for n in group if n in it.names]) for title, group in coefficients.GROUPS.items()]
    for words, group in names:
        if group:
            caption = f"Primed derivatives, {words}. Intervals of two standard uncertainties, fit and model form apart."
            blocks.append(book.draw(coefficients.derivative_bars, it, group, words.capitalize(), caption=caption))
    blocks += _quality(study, it)
    return Section("model", title, tuple(blocks))


def _reference(it: Derivatives) -> Table:
    at = it.reference
    rows = (
        ("Length", number(at.length, 5), "m"), ("Speed", number(at.speed), "m/s"),
        ("Density", number(at.density, 5), "kg/m3"),
        ("Point of moments, aft of the nose", number(at.origin_from_nose, 5), "m"),
    )  # fmt: skip
    more = "Primes: SNAME Bulletin 1-5, force over 0.5 rho U2 L2, moment over 0.5 rho U2 L3, and what follows from them"
    return Table(
        "Reference of the derivatives",
        ("Quantity", "Value", "Unit"),
        rows,
        stated(it.level, "fixed by choice", more=more),
    )


def _table(it: Derivatives) -> Table:
    total = np.sqrt(np.maximum(np.diag(it.covariance), 0.0))
    order = sorted(range(len(it.names)), key=lambda i: LOADS.index(TERMS[it.names[i]].load))
    rows = []
    for i in order:
        name, value = it.names[i], float(it.values[i])
        term = TERMS[name]
        unit = term.prime_factor(it.reference.density, it.reference.length, it.reference.speed) / 1000.0
        mean, std = with_std(value, float(total[i]))
        mean_p, std_p = with_std(value / unit, float(total[i]) / unit)
        rows.append((
            name, term.meaning, mean, std, term.unit, mean_p, std_p, str(len(it.runs.get(name, ()))),
        ))  # fmt: skip
    head = ("Term", "Meaning", "Value", "std", "Unit", "Prime x 1000", "std", "Runs")
    words = "std is one standard uncertainty, all sources; the section after this one takes it apart"
    return Table("Derivatives", head, tuple(rows), stated(it.level, words))


def _quality(study: Study, it: Derivatives) -> list[Block]:
    """Numbers of the fit, symmetric halves against each other, terms left out, and classical results beside the fit."""
    quality = it.quality
    plain = [(_words(key), _cell(value)) for key, value in quality.items() if isinstance(value, str | int | float)]
    if isinstance(change := quality.get("period_change"), Mapping) and change:
        plain.append(("largest change of loads between settled periods", _cell(max(change.values()))))
    blocks: list[Block] = []
    if plain:
        note = stated("", "these numbers describe the fit itself", axes=False)
        blocks.append(Table("Quality of the fit", ("Quantity", "Value"), tuple(plain), note))
    blocks += _gaps(quality, it.level)
    left = {
        **_reasons(quality.get("not_excited")),
        **_reasons(quality.get("gated")),
        **_reasons(quality.get("by_reciprocity")),
    }
    if left:
        note = stated(it.level, "not applicable", axes=False)
        blocks.append(Table("Terms left out of the fit", ("Term", "Reason"), tuple(left.items()), note))
    found = quality.get("fourier")
    if isinstance(found, Mapping):
        blocks += _classical(study, it, found)
    return blocks


def _reasons(found: Any) -> dict[str, str]:
    if not isinstance(found, Mapping):
        return {}
    return {name: str(item.get("why", "")) if isinstance(item, Mapping) else str(item) for name, item in found.items()}


def _gaps(quality: Mapping[str, Any], level: str) -> list[Block]:
    """Added-mass halves that should be equal, and vertical terms found without the ties of 4-fold symmetry."""
    rows = []
    for name, gap in (quality.get("symmetry_gaps") or {}).items():
        halves = [value for key, value in gap.items() if key not in ("difference", "std")]
        rows.append(
            (name, *(number(value) for value in halves[:2]), number(gap.get("difference")), number(gap.get("std"), 2))
        )
    for name, gap in (quality.get("tie_gaps") or {}).items():
        values = (gap.get("untied"), gap.get("tied"), gap.get("difference"))
        rows.append((f"{name}: own runs, tied", *(number(value) for value in values), "-"))
    if not rows:
        return []
    head = ("Halves", "First", "Second", "Difference", "std")
    return [
        Table(
            "Halves that symmetry makes equal",
            head,
            tuple(rows),
            stated(level, "std of the difference, where it was found"),
        )
    ]


def _classical(study: Study, it: Derivatives, found: Mapping[str, Any]) -> list[Block]:
    """In-phase and quadrature results of each oscillation beside the regression, a table for each kind of test."""
    blocks: list[Block] = []
    kinds = {run.name: run.kind for run in study.runs}
    for kind in dict.fromkeys(kinds.get(name, "") for name in found):
        of = {name: values for name, values in found.items() if kinds.get(name, "") == kind}
        terms = [
            t for t in dict.fromkeys(key for values in of.values() for key in values) if t in it.names and it[t] != 0.0
        ]
        if not kind or not terms:
            continue
        rows = [(name, *(number(values.get(term)) for term in terms)) for name, values in of.items()]
        rows.append(("regression", *(number(it[term]) for term in terms)))
        more = (
            "Small-angle formulae, one run at a time; a trend with frequency or amplitude is what the model leaves out"
        )
        note = stated(it.level, "none stated for a single run", more=more)
        head = ("Run", *(f"{term} [{TERMS[term].unit}]" for term in terms))
        blocks.append(Table(f"Classical harmonic results, {kind}", head, tuple(rows), note))
    return blocks


def _cell(value: Any) -> str:
    return (
        ("yes" if value else "no")
        if isinstance(value, bool)
        else number(value, 4)
        if isinstance(value, int | float)
        else str(value)
    )


def _words(key: str) -> str:
    return str(key).replace("_", " ")
