"""A check of a coefficient set: its verdict in words, and what every check reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives, Reference
from towtank.derive.variant import SHARES
from towtank.errors import DeriveError
from towtank.frames import Array
from towtank.symbols import LOADS, TERMS, Term

PASS, WARN, FAIL, NOT_APPLICABLE = "pass", "warn", "fail", "not applicable"
"""Verdicts. A check that fails says that the set is wrong; one that warns says what to look at before it is used."""

SIGMAS = 2.0
"""A gap within two standard uncertainties passes: by chance alone it is larger once in twenty times."""

PRIME_STATE = {
    "u": 1.0, "v": 0.2, "w": 0.2, "p": 1.0, "q": 0.3, "r": 0.3,
    "udot": 0.1, "vdot": 0.2, "wdot": 0.2, "pdot": 1.0, "qdot": 0.3, "rdot": 0.3,
    "dr": 0.2, "de": 0.2, "da": 0.2, "dd": 0.16, "1/V": 1.0, "1/V2": 1.0,
}  # fmt: skip
"""Primed sizes of a lively manoeuvre: 11 deg of drift, a turn of 3.3 lengths radius, a radian of roll per length
travelled, fins at 11 deg. Judgement: within the range that runs are fitted over."""


@dataclass(frozen=True)
class Check:
    """One check.

    verdict : pass, warn, fail or not applicable.   value, limit : numbers compared, None where there is none.
    words : what was found, the limit and its reason, and what to do.
    """

    name: str
    verdict: str
    value: float | None
    limit: float | None
    words: str

    def document(self) -> dict[str, Any]:
        """Plain JSON content."""
        return {
            "check": self.name,
            "verdict": self.verdict,
            "value": self.value,
            "limit": self.limit,
            "words": self.words,
        }


@dataclass(frozen=True)
class Body:
    """Sizes that coefficients are held against.

    displaced_mass [kg].   diameter [m].   planform [m2] : area of the side view, hull and fins.
    third [m5] : integral of |x|^3 over that view, x from the body origin.
    roll [kg m2] : added inertia of four fins in roll by strips.
    """

    displaced_mass: float | None = None
    diameter: float | None = None
    planform: float | None = None
    third: float | None = None
    roll: float | None = None


@dataclass(frozen=True)
class Subject:
    """A set as the checks read it: variant "lumped", with what is known of the body.

    symmetry : as in ``Run.symmetry``; "" when nobody said.
    """

    derivatives: Derivatives
    symmetry: str
    body: Body

    @property
    def reference(self) -> Reference:
        """Length, speed, density and origin of the set."""
        return self.derivatives.reference

    @property
    def quality(self) -> Mapping[str, Any]:
        """What the fit or the file says beside the values."""
        return self.derivatives.quality

    @cached_property
    def values(self) -> dict[str, float]:
        """Term -> value."""
        return self.derivatives.as_dict()

    def has(self, *names: str) -> bool:
        """True when the set states all of ``names``."""
        return all(name in self.values for name in names)

    def missing(self, *names: str) -> str:
        """Names out of ``names`` that the set lacks, as text."""
        return ", ".join(name for name in names if name not in self.values)

    def value(self, combination: Mapping[str, float]) -> float:
        """Sum of factor * term."""
        return sum(factor * self.values.get(name, 0.0) for name, factor in combination.items())

    def std(self, combination: Mapping[str, float]) -> float:
        """Standard uncertainty of a sum of factor * term."""
        names = self.derivatives.names
        c = np.array([combination.get(name, 0.0) for name in names])
        return float(np.sqrt(max(float(c @ self.derivatives.covariance @ c), 0.0)))

    def prime(self, name: str, value: float | None = None) -> float:
        """Primed ``value`` of a term, its own by default."""
        r = self.reference
        return (self.values[name] if value is None else value) / TERMS[name].prime_factor(r.density, r.length, r.speed)

    def share(self, name: str, value: float) -> float:
        """Size of ``value`` in the place of a term, as a share of its load in a lively manoeuvre."""
        load = sum(size(TERMS[n]) * abs(self.prime(n)) for n in self.values if TERMS[n].load == TERMS[name].load)
        return size(TERMS[name]) * abs(self.prime(name, value)) / load if load > 0.0 else 0.0


def size(term: Term) -> float:
    """Product of the factors of a term in ``PRIME_STATE``."""
    return float(np.prod([PRIME_STATE[factor.strip("|")] for factor in term.factors]))


def subject(derivatives: Derivatives, craft: Craft | None = None) -> Subject:
    """The set in the variant "lumped", with the symmetry and sizes of ``craft`` or of the file.

    Raises
    ------
    DeriveError
        The set is empty, holds unknown terms or numbers that are not finite, or is about another point than the craft.
    """
    unknown = [name for name in derivatives.names if name not in TERMS]
    if unknown or not derivatives.names or not np.isfinite(derivatives.values).all():
        raise DeriveError(
            f"the set of {derivatives.craft} cannot be checked: "
            + (
                f"unknown terms {', '.join(unknown)}. "
                if unknown
                else "it is empty or holds a value that is not finite. "
            )
            + "docs/nomenclature.md lists the terms."
        )
    lumped = _lumped(derivatives)
    stated = derivatives.quality.get("body", {})
    if craft is None:
        body = Body(stated.get("displaced_mass") or None, stated.get("diameter") or None)
        return Subject(lumped, str(derivatives.quality.get("symmetry", "")), _filled(body, derivatives.reference))
    gap = abs(craft.origin_from_nose - derivatives.reference.origin_from_nose)
    if gap > 0.02 * craft.length:
        raise DeriveError(
            f"the set of {derivatives.craft} is about a point {derivatives.reference.origin_from_nose:.4g} m aft of "
            f"the nose, the origin of {craft.name} is at {craft.origin_from_nose:.4g} m: more than 2 % of the length "
            "apart, moments would not compare. Convert the set with about_point, or give the craft this origin."
        )
    return Subject(lumped, craft.symmetry, body_of(craft))


def body_of(craft: Craft) -> Body:
    """Sizes of a craft; a fin or strake shows the part of its span that lies across the flow.

    Source     THEORY section 9, item 1: roll inertia of four fins 2/pi rho int s^4 dx, the body neglected.
    """
    from towtank.craft.hydrostatics import hydrostatics
    from towtank.craft.integrals import fin_integrals

    s = np.linspace(0.0, craft.length, 2001)
    width, x = 2.0 * craft.profile.radius(s), np.abs(craft.origin_from_nose - s)
    area, third = float(np.trapezoid(width, s)), float(np.trapezoid(width * x**3, s))
    for fin in craft.fins:
        seen = fin_integrals(fin, craft.profile).exposed_area * abs(float(np.sin(fin.azimuth)))
        arm = abs(craft.origin_from_nose - fin.trailing_edge + 0.5 * fin.root_chord)
        area, third = area + seen, third + seen * arm**3
    for strake in craft.strakes:
        seen = strake.area * abs(float(np.sin(strake.azimuth)))
        arm = abs(craft.origin_from_nose - 0.5 * (strake.start + strake.end))
        area, third = area + seen, third + seen * arm**3
    roll = None
    if len(craft.fins) == 4 and not craft.strakes:
        mean = [0.5 * (fin.root_chord + fin.tip_chord) * fin.tip_radius**4 for fin in craft.fins]
        roll = 2.0 / np.pi * craft.water.density * float(np.mean(mean))
    return Body(hydrostatics(craft).displaced_mass, craft.diameter, area, third, roll)


FULLNESS = 0.85
"""Side view of a slender hull over length times diameter: 0.79 for an ellipsoid, 0.9 for long parallel bodies."""


def _filled(body: Body, r: Reference) -> Body:
    """Side view of a hull of which only length and diameter are known, its width spread evenly."""
    if body.diameter is None:
        return body
    fore, aft = r.origin_from_nose, r.length - r.origin_from_nose
    width = FULLNESS * body.diameter
    return replace(body, planform=width * r.length, third=width * (fore**4 + aft**4) / 4.0)


def _lumped(d: Derivatives) -> Derivatives:
    if d.variant == "lumped":
        return d
    if d.variant != "split":
        raise DeriveError(f"the set of {d.craft} is of variant {d.variant!r}; known are 'lumped' and 'split'.")
    names = (*d.names, *(term for term in SHARES if term not in d.names))
    matrix = np.eye(len(names))[:, : len(d.names)]
    for term, parts in SHARES.items():
        for name, factor in parts:
            if name in d.names:
                matrix[names.index(term), names.index(name)] += factor
    moved: Callable[[Array], Array] = lambda covariance: np.asarray(matrix @ covariance @ matrix.T)  # noqa: E731
    return replace(
        d, variant="lumped", names=names, values=matrix @ d.values, covariance_fit=moved(d.covariance_fit),
        covariance_mesh=moved(d.covariance_mesh), covariance_model=moved(d.covariance_model),
    )  # fmt: skip


def absent(name: str, words: str) -> Check:
    """A check that does not apply, and why."""
    return Check(name, NOT_APPLICABLE, None, None, words)


@dataclass(frozen=True)
class Judged:
    """A verdict with the two numbers that decided it. ``words`` says why a gap beyond its limit still passes."""

    verdict: str
    value: float
    limit: float
    words: str = ""


def judge(value: float, limit: float, worst: float, gap: float = 0.0, std: float = 0.0) -> Judged:
    """Pass up to ``limit``, warn up to ``worst``, else fail; a ``gap`` within two ``std`` passes."""
    if value <= limit:
        return Judged(PASS, value, limit)
    if std > 0.0 and abs(gap) <= SIGMAS * std:
        return Judged(PASS, abs(gap) / std, SIGMAS, f" The gap is {abs(gap) / std:.2g} standard uncertainties.")
    return Judged(WARN if value <= worst else FAIL, value, limit)


def gathered(name: str, found: Sequence[Check], words: str, missing: str) -> tuple[Check, ...]:
    """Checks of one kind: each that does not pass by itself, the others in one line ``name``."""
    bad = tuple(check for check in found if check.verdict != PASS)
    good = [check for check in found if check.verdict == PASS]
    if not found:
        return (absent(name, missing),)
    if not good:
        return bad
    text = f"{len(good)} of {len(found)}: {words}"
    title = f"{name}: the others" if bad else name
    numbers = [(abs(c.value / c.limit), i) for i, c in enumerate(good) if c.limit and c.value is not None]
    if not numbers or max(numbers)[0] == 0.0:
        return (*bad, Check(title, PASS, 0.0 if numbers else None, good[0].limit if numbers else None, text))
    nearest = good[max(numbers)[1]]
    return (*bad, Check(title, PASS, nearest.value, nearest.limit, f"{text} Nearest to its limit: {nearest.words}"))


def added_mass(values: Mapping[str, float]) -> tuple[Array, Array]:
    """M_A (6, 6) of natural derivatives, and which of its entries the set states."""
    rates = "uvwpqr"
    names = [[f"{load}{rate}dot" for rate in rates] for load in LOADS]
    matrix = np.array([[values.get(name, 0.0) for name in row] for row in names])
    return matrix, np.array([[name in values for name in row] for row in names])
