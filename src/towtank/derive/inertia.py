"""What potential flow demands of a set: M_A symmetric and positive, and the terms that follow from it."""

from __future__ import annotations

from typing import Any

import numpy as np

from towtank.derive.check import FAIL, PASS, SIGMAS, Check, Subject, absent, added_mass, gathered, judge
from towtank.symbols import LOADS, RATES

SYMMETRY_LIMIT, SYMMETRY_WORST = 0.07, 0.20
"""Gap of the halves of M_A over the geometric mean of their diagonals. 7 % is the 95 % uncertainty of measured added
masses in roddy1990. The second is judgement: three times that is no scatter but a wrong sign or another point."""

IDENTITY_LIMIT = 0.30
"""Xvr against -Yvdot. Judgement: the boundary layer takes 20 to 30 % of the Munk moment, and so about as much of it."""

IDENTITY_SHARE, IDENTITY_WORST = 0.10, 0.50
"""Xrr against -Yrdot, as a share of the axial load. Judgement: the viscous part is a change of the resistance, and half
of the axial load is more than any change of it."""

PRINT_LIMIT, PRINT_WORST = 0.005, 0.10
"""Cross terms printed beside M_A: three digits agree to half a per cent. Judgement: a tenth is no rounding."""


def symmetry(s: Subject) -> Check:
    """Halves of M_A against each other."""
    name = "symmetry of M_A"
    gaps = _halves(s)
    if not gaps:
        copied = s.quality.get("by_reciprocity")
        why = "one half was copied from the other" if copied else "no pair such as Yrdot, Nvdot is stated"
        return absent(name, f"{why}, so there is nothing to compare.")
    pair, (value, gap, std) = max(gaps.items(), key=lambda item: item[1][0])
    found = judge(value, SYMMETRY_LIMIT, SYMMETRY_WORST, gap, std)
    words = f"largest gap {pair} = {gap:.3g}, {100 * value:.2g} % of the geometric mean of the diagonal entries."
    if found.verdict != PASS:
        words += (
            " In potential flow M_A is symmetric. Look for a wrong sign, or for a moment about another point than the "
            "origin of the set."
        )
    return Check(name, found.verdict, found.value, found.limit, words + found.words)


def _halves(s: Subject) -> dict[str, tuple[float, float, float]]:
    """Pair -> (gap over the mean of the diagonal, gap, its standard uncertainty).

    Where the fit averaged the halves, the uncertainty of the average counts beside that of their gap: it holds mesh and
    model form, of which each half has its share.
    """
    recorded = s.quality.get("symmetry_gaps", {})
    out = {}
    for i, load in enumerate(LOADS):
        for j in range(i):
            a, b = f"{LOADS[j]}{RATES[i]}dot", f"{load}{RATES[j]}dot"
            found = recorded.get(f"{a} - {b}")
            if found is None and not s.has(a, b):
                continue
            gap = s.values[a] - s.values[b] if found is None else float(found["difference"])
            std = s.std({a: 1.0, b: -1.0}) if found is None else float(np.hypot(found["std"], s.std({a: 1.0})))
            own = [s.values.get(f"{LOADS[k]}{RATES[k]}dot", 0.0) for k in (i, j)]
            scale = float(np.sqrt(abs(own[0] * own[1]))) or max(abs(s.values.get(n, 0.0)) for n in (a, b))
            out[f"{a} - {b}"] = (abs(gap) / scale if scale else 0.0, gap, std)
    return out


def positive(s: Subject) -> Check:
    """Kinetic energy of the water, 0.5 nu^T (-M_A) nu, above zero for every motion."""
    name = "-M_A positive definite"
    matrix, there = added_mass(s.values)
    matrix = -0.5 * (np.where(there, matrix, matrix.T) + np.where(there.T, matrix.T, matrix))
    kept = [i for i in range(6) if there[i, i] and np.any(matrix[i] != 0.0)]
    if not kept:
        return absent(name, "no entry of the diagonal of M_A is stated.")
    block = matrix[np.ix_(kept, kept)]
    diagonal = np.abs(np.diag(block))
    unit = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(block / np.outer(unit, unit))
    least, v = float(values[0]), vectors[:, 0] / unit
    std = s.std({
        f"{LOADS[i]}{RATES[j]}dot": -float(v[a] * v[b]) for a, i in enumerate(kept) for b, j in enumerate(kept)
    })  # fmt: skip
    verdict = PASS if least > 0.0 or (std > 0.0 and -least <= SIGMAS * std) else FAIL
    motions = ", ".join(RATES[i] for i in kept)
    words = f"smallest eigenvalue of the matrix scaled to a unit diagonal, motions {motions}."
    if verdict == FAIL:
        main = RATES[kept[int(np.argmax(np.abs(vectors[:, 0])))]]
        words += (
            f" A motion mostly in {main} would have negative kinetic energy: the model would run away. An entry has "
            "the wrong sign, or a coupling is too large for its diagonal."
        )
    return Check(name, verdict, least, 0.0, words)


def identities(s: Subject) -> tuple[Check, ...]:
    """Axial terms that potential flow ties to M_A in the lumped form (THEORY section 2)."""
    found = []
    for term, source, sign in (("Xvr", "Yvdot", -1.0), ("Xwq", "Zwdot", 1.0), ("Xqq", "Zqdot", 1.0),
                               ("Xrr", "Yrdot", -1.0)):  # fmt: skip
        if not s.has(term, source):
            continue
        gap, expected = s.value({term: 1.0, source: -sign}), sign * s.values[source]
        first = term in ("Xvr", "Xwq")
        value = abs(gap / expected) if first and expected else s.share(term, gap)
        limit, worst = (IDENTITY_LIMIT, 1.0) if first else (IDENTITY_SHARE, IDENTITY_WORST)
        seen = judge(value, limit, worst, gap, s.std({term: 1.0, source: -sign}))
        words = f"{term} = {s.values[term]:.4g}, potential flow gives {expected:.4g}."
        if seen.verdict != PASS:
            words += " The speed lost in a turn follows from it. Check its sign, the variant and the source."
        found.append(Check(f"lumped identity: {term}", seen.verdict, seen.value, seen.limit, words + seen.words))
    words = "Xvr = -Yvdot, Xwq = Zwdot, Xqq = Zqdot, Xrr = -Yrdot within what viscosity changes."
    return gathered("lumped identities", found, words, "no axial term is stated beside its added mass.")


def cross_terms(s: Subject) -> tuple[Check, ...]:
    """Added-mass cross terms written out in a file against those of its M_A."""
    stated: dict[str, dict[str, Any]] = s.quality.get("implied", {})
    found = []
    for term, item in stated.items():
        if item["implied"] is None:
            continue
        gap = float(item["stated"]) - float(item["implied"])
        value = abs(gap) / max(abs(float(item["stated"])), abs(float(item["implied"])), 1e-300)
        verdict = judge(value, PRINT_LIMIT, PRINT_WORST).verdict
        words = f"{term} = {item['stated']:.4g}, M_A gives {item['implied']:.4g}."
        if verdict != PASS:
            words += f" One of {term}, {', '.join(item['of'])} is misprinted. The model uses M_A."
        found.append(Check(f"cross term: {term}", verdict, value, PRINT_LIMIT, words))
    words = "cross terms are those of M_A; the added-mass bracket stands in their place."
    return gathered("cross terms", found, words, "the set writes out no added-mass cross terms.") if stated else ()
