"""Are coefficients of the size that a slender body of this displacement and diameter has."""

from __future__ import annotations

import numpy as np

from towtank.derive.check import FAIL, PASS, SIGMAS, WARN, Check, Subject, gathered

SWAY, SWAY_WORST = (0.5, 1.5), (0.3, 2.0)
"""Added mass of sway over displaced mass: 0.5 for a sphere, 1 for a slender circular hull; fins add up to a half.
Second band: judgement, what no craft of this kind has."""

FLAT = 5.0
"""The same for a body without 4-fold symmetry: pi b/4h of a flat section. Judgement: a breadth of six heights."""

SURGE, SURGE_WORST = (0.3, 3.0), (0.1, 10.0)
"""Added mass of surge over that of Lamb's spheroid of the same length and diameter: blunt ends and fins up to double
it. Second band: judgement, a decimal point."""

YAW, YAW_WORST = (0.02, 0.12), (0.01, 0.25)
"""Added inertia of yaw over displaced mass times length squared: 0.05 for slender ellipsoids, 0.083 for cylinders; a
tail with fins adds up to a half, a full midbody takes away as much. Second band: judgement, twice as far."""

ROLL = (0.3, 3.0)
"""Added inertia of roll over the strip value of four fins. Judgement: strips leave out the hull and the gaps."""

CROSS_FLOW, CROSS_FLOW_WORST = (0.05, 1.6), (0.0, 3.2)
"""Cross-flow drag coefficient of the side view: 0.3 to 0.8 at small angles, 1.1 to 1.2 for a cylinder across the flow,
2.0 for a flat plate (hoerner1965). Judgement: 1.6 is a hull with large fins; nothing reaches 3.2."""

MUNK, MUNK_WORST = (0.1, 1.2), (-np.inf, 2.0)
"""Nuv over Yvdot - Xudot: 0.7 to 0.8 for hulls, less with fins. Judgement: potential flow and a fifth."""

ARM, ARM_WORST = 1.0, 1.25
"""Arms of the cross-flow force over the longest arm of the hull. Terms fitted at small angles also hold lift: 25 %,
judgement."""

PLANES = (
    ("Yvdot", "Nrdot", "Yvv", "Nvv", "Nrr", "Nuv", 1.0),
    ("Zwdot", "Mqdot", "Zww", "Mww", "Mqq", "Muw", -1.0),
)


def magnitudes(s: Subject) -> tuple[Check, ...]:
    """Checks of size; those that need the body do not apply without it.

    Source     lamb1932 (spheroids); hoerner1965 (cross-flow); THEORY section 9, items 1, 3 and 7.
    """
    unknown = "is not known. Give --craft, or [body] in the coefficient file."
    heavy = "no added mass is stated." if s.body.displaced_mass else f"the displaced mass {unknown}"
    wide = "no cross-flow term is stated." if s.body.planform else f"the diameter {unknown}"
    return (
        *gathered("size of added masses", _inertias(s), "of the size of the displaced water.", heavy),
        *gathered("size of cross-flow drag", _cross_flow(s), "drag coefficients that a section can have.", wide),
        *gathered(
            "arms of cross-flow",
            _arms(s),
            "rotation sees the cross-flow v + x r within the length of the hull.",
            "needs cross-flow terms of force and moment, such as Yvv and Nrr.",
        ),
        *gathered(
            "Munk moment",
            _munk(s),
            "what fins and boundary layer leave of the potential moment.",
            "needs Yvdot and Nuv, or Zwdot and Muw.",
        ),
    )


def lamb_surge(ratio: float) -> float:
    """Added mass of a prolate spheroid along its axis over its displaced mass; ``ratio`` length over diameter.

    Source     lamb1932, art. 114 and 373.
    Valid      ratio above 1.
    """
    e = np.sqrt(1.0 - 1.0 / ratio**2)
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * np.log((1.0 + e) / (1.0 - e)) - e)
    return float(alpha / (2.0 - alpha))


def _banded(
    name: str, value: float, band: tuple[float, float], worst: tuple[float, float], words: str, remedy: str,
    std: float = 0.0,
) -> Check:  # fmt: skip
    """Verdict of a ratio that should lie in ``band``; within 2 ``std`` of it counts."""
    off = max(band[0] - value, value - band[1], 0.0)
    far = max(worst[0] - value, value - worst[1], 0.0)
    verdict = PASS if off <= SIGMAS * std else WARN if far <= SIGMAS * std else FAIL
    limit = band[0] if value < band[0] else band[1]
    words += f" Expected {max(band[0], 0.0):g} to {band[1]:g}."
    return Check(name, verdict, value, limit, words if verdict == PASS else f"{words} {remedy}")


def _inertias(s: Subject) -> list[Check]:
    mass, body, length = s.body.displaced_mass, s.body, s.reference.length
    out: list[Check] = []
    if mass is None:
        return out
    flat = 1.0 if s.symmetry in ("fourfold", "") else FLAT / SWAY[1]
    inertia, square = mass * length**2, "displaced mass times length squared"
    for force, moment, *_ in PLANES:
        rows = ((force, mass, f"displaced mass ({mass:.4g} kg)", SWAY, SWAY_WORST, "and displaced mass"),
                (moment, inertia, square, YAW, YAW_WORST, "and the point the set is about"))  # fmt: skip
        for term, scale, what, band, worst, also in rows:
            if s.has(term):
                value = -s.values[term] / scale
                band, worst = (band[0], flat * band[1]), (worst[0], flat * worst[1])
                words, std = f"{term} is {value:.3g} times the {what}.", s.std({term: 1.0}) / scale
                remedy = f"Check units, reference length of the primes, {also}."
                out.append(_banded(f"added mass: {term}", value, band, worst, words, remedy, std))
    if s.has("Xudot") and body.diameter is not None and length > body.diameter:
        scale = mass * lamb_surge(length / body.diameter)
        words = f"Xudot is {-s.values['Xudot'] / scale:.3g} times that of Lamb's spheroid of this length and diameter."
        out.append(_banded("added mass: Xudot", -s.values["Xudot"] / scale, SURGE, SURGE_WORST, words,
                           "Check units and reference length.", s.std({"Xudot": 1.0}) / scale))  # fmt: skip
    if s.has("Kpdot") and body.roll:
        words = (
            f"Kpdot is {-s.values['Kpdot'] / body.roll:.3g} times the strip value of four fins, {-body.roll:.3g} kg m2."
        )
        out.append(_banded("added mass: Kpdot", -s.values["Kpdot"] / body.roll, ROLL, (-np.inf, np.inf), words,
                           "Strips are rough for it; compare with another source.",
                           s.std({"Kpdot": 1.0}) / body.roll))  # fmt: skip
    return out


def _cross_flow(s: Subject) -> list[Check]:
    density = s.reference.density
    out = []
    for _, _, force, _, moment, *_ in PLANES:
        for term, view, what in ((force, s.body.planform, "sideways"), (moment, s.body.third, "in rotation")):
            if not s.has(term) or not view:
                continue
            scale = 0.5 * density * view
            value = -s.values[term] / scale
            words = (
                f"drag coefficient {what} {value:.3g}; {term} = {s.values[term]:.4g}, strips with 1.1 give "
                f"{-1.1 * scale:.3g}."
            )
            remedy = "No section has such a drag: look for a misprint, or for a value tuned to something else."
            out.append(_banded(f"cross-flow: {term}", value, CROSS_FLOW, CROSS_FLOW_WORST, words, remedy,
                               s.std({term: 1.0}) / scale))  # fmt: skip
    return out


def _munk(s: Subject) -> list[Check]:
    out = []
    for force, _, _, _, _, moment, sign in PLANES:
        if not s.has(force, moment):
            continue
        potential = sign * (s.values[force] - s.values.get("Xudot", 0.0))
        if potential == 0.0:
            continue
        value = s.values[moment] / potential
        words = f"{moment} is {value:.3g} of the potential moment {potential:.4g} of {force}."
        remedy = "Check whether the variant is lumped, and about which point the moment is taken."
        out.append(_banded(f"Munk moment: {moment}", value, MUNK, MUNK_WORST, words, remedy,
                           s.std({moment: 1.0}) / abs(potential)))  # fmt: skip
    return out


def _arms(s: Subject) -> list[Check]:
    """A rotation is a cross-flow v + x r along the hull: cross-flow terms are moments of one distribution."""
    r = s.reference
    longest = max(r.origin_from_nose, r.length - r.origin_from_nose)
    out = []
    for _, _, force, moment, turn, *_ in PLANES:
        base = s.values.get(force, 0.0)
        if base >= 0.0:
            continue
        for term, power in ((moment, 1.0), (turn, 3.0)):
            if s.has(term):
                out.append(_arm(s, term, force, power, longest))
    return out


def _arm(s: Subject, term: str, force: str, power: float, longest: float) -> Check:
    ratio = abs(s.values[term] / s.values[force])
    value = ratio ** (1.0 / power) / longest
    excess = abs(s.values[term]) - longest**power * abs(s.values[force])
    direction = {term: float(np.sign(s.values[term])), force: longest**power}
    soft = excess <= SIGMAS * s.std(direction)
    verdict = PASS if value <= ARM or soft else WARN if value <= ARM_WORST else FAIL
    words = f"{term} over {force} asks for an arm of {value * longest:.3g} m; the hull reaches {longest:.3g} m."
    if verdict != PASS:
        words += f" {term} is too large for {force}, or {force} too small. Compare both with strips."
    return Check(f"cross-flow arm: {term}", verdict, value, ARM, words)
