"""Coefficient files: a published set in the words of its author, read as ``Derivatives`` of this project."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from towtank.derive.formulation import FORMULATIONS, RIGHT_HAND, SYMMETRIES, Entry, Formulation
from towtank.derive.table import Derivatives, Reference
from towtank.derive.variant import SHARES
from towtank.errors import InputError, TowtankError
from towtank.provenance import provenance
from towtank.quantity import si
from towtank.symbols import FOURFOLD_TIES, TERMS, Term

SCHEMA = "towtank/coefficients/1"

SENSES = ("body", "damping-left", "left")
"""body: loads on the body. damping-left: damping on the left-hand side. left: added mass and damping there."""

_TOP = ("schema", "craft", "formulation", "source", "sense", "units", "symmetry", "note")
_TABLES = ("reference", "terms", "std", "tested", "body")
_REFERENCE = {"length": "m", "speed": "m/s", "density": "kg/m^3", "origin_from_nose": "m"}
_BODY = {"displaced_mass": "kg", "diameter": "m"}
_SIDES = {"positive": 1.0, "negative": -1.0}


@dataclass
class _Page:
    """What was understood of a file, and every fault found."""

    where: str
    faults: list[str] = field(default_factory=list)

    def choice(self, raw: Mapping[str, Any], key: str, known: tuple[str, ...], default: str = "") -> str:
        value = raw.get(key, default)
        if value in known:
            return str(value)
        given = f"{key} is missing" if key not in raw else f"{key} = {value!r} is unknown"
        self.faults.append(f"{given}. Write one of: {', '.join(known)}.{_HELP.get(key, '')}")
        return known[0]

    def number(self, value: Any, unit: str, where: str) -> float:
        try:
            return si(value, unit, where)
        except TowtankError as error:
            self.faults.append(str(error))
            return 1.0

    def table(self, raw: Mapping[str, Any], key: str) -> dict[str, Any]:
        value = raw.get(key, {})
        if isinstance(value, dict):
            return value
        self.faults.append(f"{key} is not a table. Write [{key}] on a line of its own and its entries below.")
        return {}

    def known(self, given: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
        for key in given:
            if key not in known:
                near = difflib.get_close_matches(key, known, n=3, cutoff=0.5)
                hint = f"Nearest: {', '.join(near)}." if near else f"Known: {', '.join(known)}."
                self.faults.append(f"{where}{key}: unknown. {hint}")


_HELP = {
    "units": ' "SI": bare numbers are SI. "prime": load / (0.5 rho U^2 L^2), moment / (0.5 rho U^2 L^3).',
    "sense": ' "body": natural derivatives, damping negative. "damping-left": damping matrix on the left, positive. '
    '"left": added mass and damping on the left, both positive.',
    "formulation": " docs/coefficients.md lists their terms.",
    "symmetry": " It decides which terms must agree between the planes.",
}


def read_coefficients(path: Path | str) -> Derivatives:
    """A coefficient file as derivatives of level "published".

    Returns
    -------
    Derivatives in SI, natural, about the point of the file. ``quality`` holds "formulation", "source", "symmetry",
    "body", "departures" (sentences: what was read differently from how it was printed), "not_represented" (term ->
    value and reason) and "implied" (cross term -> stated value and the one that M_A gives).

    Raises
    ------
    InputError
        Not TOML, another schema, or faults, all of them listed with their remedy.
    """
    path = Path(path)
    return set_of(_parsed(path), path.name)


def read_set(path: Path | str) -> Derivatives:
    """A set of either kind: ``derivatives.json`` of this project (or its study folder), or a coefficient file.

    Raises
    ------
    InputError
        Neither of them, or with faults.
    """
    from towtank.derive.files import read_derivatives

    path = Path(path)
    path = path / "derivatives.json" if path.is_dir() else path
    return read_derivatives(path) if path.suffix == ".json" else read_coefficients(path)


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path} does not exist. Give a coefficient file (TOML) or derivatives.json of a study."
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read ({error}). Give a coefficient file in TOML.") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"{path.name} is not a TOML file: {error}. A term is a line such as Yuv = -28.6; texts and quantities "
            "with units need quotes. docs/coefficients.md shows a whole file."
        ) from None


def set_of(raw: Mapping[str, Any], where: str) -> Derivatives:
    """Derivatives of the content of a coefficient file. ``where`` names it in errors.

    Raises
    ------
    InputError
        Another schema, or faults, all of them listed.
    """
    if raw.get("schema") != SCHEMA:
        raise InputError(
            f"{where} has schema {raw.get('schema')!r}, wanted {SCHEMA!r}. Put schema = {SCHEMA!r} on the first line "
            "of a coefficient file; docs/coefficients.md shows a whole one."
        )
    page = _Page(where)
    page.known(raw, (*_TOP, *_TABLES), "")
    formulation = FORMULATIONS[page.choice(raw, "formulation", tuple(FORMULATIONS))]
    sense = page.choice(raw, "sense", SENSES)
    prime = page.choice(raw, "units", ("SI", "prime")) == "prime"
    symmetry = page.choice(raw, "symmetry", SYMMETRIES)
    reference = Reference(**_numbers(page, raw, "reference", _REFERENCE, required=True))
    for key in ("length", "speed", "density"):
        if not getattr(reference, key) > 0.0:
            page.faults.append(f"reference.{key} is not positive. Primes are divided by it.")
    body = _numbers(page, raw, "body", _BODY)
    page.faults += [
        f"body.{key} is not positive. Leave it out if it is not known." for key in body if not body[key] > 0.0
    ]
    read = _Reading(page, formulation, sense, prime, symmetry, reference, _sides(page, raw))
    read.all(page.table(raw, "terms"), page.table(raw, "std"))
    if page.faults:
        raise InputError(f"{where} cannot be read as a coefficient file:\n  " + "\n  ".join(page.faults))
    quality = {
        "formulation": formulation.name, "source": str(raw.get("source", "")), "note": str(raw.get("note", "")),
        "symmetry": symmetry, "body": body, "departures": read.departures, "not_represented": read.apart,
        "implied": read.implied(),
    }  # fmt: skip
    return stated(
        str(raw.get("craft", Path(where).stem)), read.values, reference, std=read.std, variant=formulation.variant,
        quality=quality,
    )  # fmt: skip


def stated(
    craft: str,
    values: Mapping[str, float],
    reference: Reference,
    *,
    std: Mapping[str, float] | None = None,
    variant: str = "lumped",
    quality: Mapping[str, Any] | None = None,
) -> Derivatives:
    """Stated numbers as a set of level "published".

    values : term -> value, SI, natural.   std : term -> standard uncertainty, taken as independent; none by default.
    quality : may hold "symmetry" (as ``Run.symmetry``) and "body" ("displaced_mass" [kg], "diameter" [m]), which the
        consistency checks read.
    """
    names = tuple(name for name in TERMS if name in values)
    none = np.zeros((len(names), len(names)))
    spread = np.diag([float((std or {}).get(name, 0.0)) ** 2 for name in names])
    numbers = np.array([float(values[name]) for name in names])
    return Derivatives(
        craft, "published", variant, reference, names, numbers, spread, none, none.copy(), quality=dict(quality or {}),
        provenance=provenance(),
    )  # fmt: skip


def _numbers(
    page: _Page, raw: Mapping[str, Any], table: str, units: Mapping[str, str], required: bool = False
) -> dict[str, float]:
    given = page.table(raw, table)
    page.known(given, tuple(units), f"{table}.")
    for key in units if required else ():
        if key not in given:
            page.faults.append(f'{table}.{key} is missing. Write for example {key} = "1.2 {units[key]}".')
    out = {key: page.number(given[key], unit, f"{table}.{key}") for key, unit in units.items() if key in given}
    return dict.fromkeys(units, 1.0) | out if required else out


def _sides(page: _Page, raw: Mapping[str, Any]) -> dict[str, float]:
    given = page.table(raw, "tested")
    page.known(given, ("v", "w", "r"), "tested.")
    return {rate: _SIDES[page.choice(given, rate, tuple(_SIDES))] for rate in ("v", "w", "r") if rate in given}


@dataclass
class _Reading:
    """Term by term from the words of an author to ours."""

    page: _Page
    formulation: Formulation
    sense: str
    prime: bool
    symmetry: str
    reference: Reference
    sides: Mapping[str, float]
    values: dict[str, float] = field(default_factory=dict)
    std: dict[str, float] = field(default_factory=dict)
    departures: list[str] = field(default_factory=list)
    apart: dict[str, Any] = field(default_factory=dict)
    cross: dict[str, float] = field(default_factory=dict)

    def all(self, terms: Mapping[str, Any], std: Mapping[str, Any]) -> None:
        """Read every term; faults go to the page."""
        if not terms:
            self.page.faults.append("[terms] is missing or empty. Write one line per term, such as Yuv = -28.6.")
        known = tuple(self.formulation.entries)
        self.page.known(terms, known, f"terms (formulation {self.formulation.name}): ")
        self.page.known(std, tuple(terms), "std: ")
        for name in known:
            if name in terms:
                self.term(name, terms[name], std.get(name))
        if self.sense != "body":
            which = "Added-mass and damping terms stand" if self.sense == "left" else "Damping terms stand"
            self.departures.append(f"{which} on the left-hand side of the file; their signs are turned here.")
        self.fill()

    def fill(self) -> None:
        """Add the terms that have no place in the formulation: from M_A, or from the other plane of a 4-fold craft."""
        for name in self.formulation.filled:
            ((source, factor),) = SHARES[name]
            twin, sign = FOURFOLD_TIES.get(name, ("", 0.0))
            if source not in self.values:
                continue
            if self.symmetry == "fourfold" and twin in self.values:
                source, factor = twin, sign
            self.values[name] = factor * self.values[source]
            self.departures.append(
                f"{name} = {self.values[name]:.4g} is added from {source}: the formulation has no place for it, and "
                "its added-mass bracket leaves it out. Without it a turn loses too little speed."
            )

    def term(self, name: str, given: Any, spread: Any) -> None:
        """Read one term and its standard uncertainty."""
        entry = self.formulation.entries[name]
        foreign = entry.foreign(name)
        value = self.turn(foreign) * self.si(foreign, given, f"terms.{name}")
        std = self.spread(foreign, spread, value)
        if name in self.formulation.implied:
            self.cross[name] = value
        elif not entry.term:
            rate = "".join(foreign.factors[-1:])
            why = entry.remark.format(name=name, value=value, product=_words(foreign), rate=rate)
            self.apart[name] = {"value": value, "why": why}
            self.departures.append(why)
        else:
            factor = self.factor(name, entry, foreign)
            self.values[entry.term], self.std[entry.term] = factor * value, abs(factor) * std

    def turn(self, foreign: Term) -> float:
        """-1 for a term that the file has on the left-hand side."""
        if self.sense == "body" or foreign.name in RIGHT_HAND:
            return 1.0
        inertial = foreign.is_added_mass or foreign.name in self.formulation.implied
        return 1.0 if inertial and self.sense == "damping-left" else -1.0

    def si(self, foreign: Term, given: Any, where: str) -> float:
        """Value in SI of a number in the units of the file, or of text with a unit."""
        a, b = foreign.powers
        unit = f"kg*m^{a - 3 + b}*s^{-b}"
        if not self.prime or (isinstance(given, str) and not _is_number(given)):
            return self.page.number(given, unit, where)
        r = self.reference
        return self.page.number(given, "", where) * foreign.prime_factor(r.density, r.length, r.speed)

    def spread(self, foreign: Term, given: Any, value: float) -> float:
        """Standard uncertainty; a text such as "5 %" is a share of the value."""
        if given is None:
            return 0.0
        where = f"std.{foreign.name}"
        if isinstance(given, str) and given.strip().endswith("%"):
            return abs(value) * abs(self.page.number(given, "", where))
        return abs(self.si(foreign, given, where))

    def factor(self, name: str, entry: Entry, foreign: Term) -> float:
        """Ours over theirs; a term of wrong parity takes the sign of the tested side."""
        power = -foreign.powers[1]
        factor = entry.factor * self.reference.speed**power
        if entry.side:
            if entry.side not in self.sides:
                self.page.faults.append(
                    f"terms.{name} multiplies {_words(foreign)}, odd in {entry.side}. Which side was tested decides "
                    f'its sign as an even term: write [tested] {entry.side} = "positive" or "negative" (drift angles '
                    "above zero have v < 0)."
                )
            factor *= self.sides.get(entry.side, 1.0)
        if entry.remark:
            speed = f" at U = {self.reference.speed:g} m/s" if power else ""
            words = entry.remark.format(
                name=name, product=_words(foreign), rate=entry.side, speed=speed, term=entry.term
            )
            self.departures.append(f"{words} Factor {factor:.4g}.")
        return factor

    def implied(self) -> dict[str, dict[str, Any]]:
        """Cross terms of the file beside what the added-mass bracket puts in their place; None without its entries."""
        out: dict[str, dict[str, Any]] = {}
        for name, value in self.cross.items():
            parts = self.formulation.implied[name]
            whole = all(term in self.values for term, _ in parts)
            total = sum(factor * self.values.get(term, 0.0) for term, factor in parts)
            out[name] = {"stated": value, "implied": total if whole else None, "of": [term for term, _ in parts]}
        return out


def _words(term: Term) -> str:
    return " ".join(term.factors)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
