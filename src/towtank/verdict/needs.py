"""Requirements file: TOML to ``Need``, every fault with its place and remedy."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationError

from towtank.craft.craft import Craft
from towtank.errors import InputError
from towtank.quantity import Quantity, si
from towtank.verdict.measures import MEASURES, SHARES

SCHEMA = "towtank/requirements/1"
SENSES = ("at_most", "at_least")
OWN_UNITS = {"m": "L", "m/s": "U", "s": "L/U"}
"""Unit of a number -> the craft's own unit for it: length, speed, time of one length."""


@dataclass(frozen=True)
class Need:
    """One requirement as asked, before it is known which craft it is put to.

    criterion : of ``MEASURES`` or ``SHARES``, or empty for an ``index`` of a ``trial``.   sense : "at_most" or
    "at_least".   limit : as written.   share : of the drawn craft that has to meet it, or None where the best estimate
    decides.   magnitude : the sign of the number does not count.   source, assumed : of the limit.
    optional : left out without a word where the craft has no such number.   where : in which file and item.
    """

    name: str
    sense: str
    limit: Quantity
    criterion: str = ""
    trial: str = ""
    index: str = ""
    share: float | None = None
    magnitude: bool = False
    source: str = ""
    assumed: bool = False
    optional: bool = False
    where: str = "requirement"

    @property
    def of(self) -> str:
        """What the limit is on, in words."""
        return self.criterion or f"{self.index} of {self.trial}"

    def bound(self, unit: str, craft: Craft) -> float:
        """The limit in ``unit`` for ``craft``; ``"5 L"``, ``"0.9 U"`` and ``"3 L/U"`` in its length and speed.

        Raises
        ------
        InputError
            Not a quantity of that unit, a bare angle, or a bare percentage.
        """
        return bound(self.limit, unit, f"{self.where}.{self.sense}", craft.length, craft.speed)


def bound(limit: Quantity, unit: str, where: str, length: float = 1.0, speed: float = 1.0) -> float:
    """``limit`` as written, in ``unit``, for a craft of ``length`` [m] and ``speed`` [m/s]; see ``Need.bound``."""
    own = OWN_UNITS.get(unit)
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(L/U|L|U)\s*", limit) if isinstance(limit, str) else None
    if found:
        if found[2] != own:
            raise InputError(
                f"{where}: {limit!r} is a multiple of the craft's {_OWN_WORDS[found[2]]}, but the number is in "
                f'{unit or "no unit"}. Write for example "{_example(unit)}".'
            )
        size = {"L": length, "U": speed, "L/U": length / speed}[found[2]]
        return si(found[1], "", where) * size
    bare = _is_bare(limit)
    if bare and unit == "%":
        raise InputError(f'{where}: {limit!r} may be a share or per cent. Write for example "5 %".')
    if bare and "deg" in unit and si(limit, "", where) != 0.0:
        raise InputError(
            f"{where}: bare angle {limit!r}. Degrees and radians cannot be told apart; name the unit, for example "
            f'"{str(limit).strip()} {unit}".'
        )
    return 100.0 * si(limit, "", where) if unit == "%" else si(limit, unit, where)


_OWN_WORDS = {"L": "length", "U": "speed", "L/U": "length over speed"}


def _example(unit: str) -> str:
    return {"": "0.9", "%": "5 %"}.get(unit, f"5 {unit}")


def _is_bare(limit: Quantity) -> bool:
    if not isinstance(limit, str):
        return True
    try:
        float(limit)
    except ValueError:
        return False
    return True


def read_requirements(path: Path | str) -> tuple[Need, ...]:
    """Read a requirements file, schema ``towtank/requirements/1``; ``docs/verdict.md`` describes every key.

    Raises
    ------
    InputError
        Missing, not TOML, another schema; or all that is wrong with its requirements, each with its place.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"requirements {path} cannot be read ({error}). `towtank assess --template > mine.toml` writes one to edit."
        ) from None
    return requirements_of(text, path.name)


def standard_requirements() -> tuple[Need, ...]:
    """The set that ships with the package; what a craft has no number for is left out of it."""
    return tuple(replace(need, optional=True) for need in requirements_of(standard_text(), "standard requirements"))


def standard_text() -> str:
    """The file of ``standard_requirements``."""
    return (resources.files("towtank.verdict") / "requirements.toml").read_text(encoding="utf-8")


def requirements_of(text: str, where: str) -> tuple[Need, ...]:
    """Requirements of a file's ``text``; see ``read_requirements``."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f'{where} is not a TOML file: {error}. Texts and quantities with units need quotes, as in at_most = "5 L".'
        ) from None
    faults: list[str] = []
    if document.get("schema") != SCHEMA:
        faults.append(f'schema: {document.get("schema")!r}. The first line of the file is schema = "{SCHEMA}".')
    faults += [f"{key}: unknown key. {_near(key, _HEAD)}" for key in document if key not in _HEAD]
    items = document.get("requirement", [])
    if not isinstance(items, list) or not items or not all(isinstance(item, dict) for item in items):
        faults.append("requirement: there is none. Head each one with [[requirement]], in double brackets.")
        items = []
    needs = [_need(item, f"requirement[{i}]", where, faults) for i, item in enumerate(items, start=1)]
    made = [need for need in needs if need]
    for i, need in enumerate(made):
        if need.name in [other.name for other in made[:i]]:
            faults.append(f"{need.where.split(': ', 1)[1]}.name: {need.name!r} is there twice. Give each its own name.")
    if faults:
        raise InputError(f"{where}: " + "\n  ".join(["", *faults] if len(faults) > 1 else faults))
    return tuple(made)


_HEAD = ("schema", "title", "requirement")


def _need(item: Mapping[str, Any], place: str, where: str, faults: list[str]) -> Need | None:
    try:
        given = _Item.model_validate(item)
    except ValidationError as error:
        faults += [_fault(place, one) for one in error.errors()]
        return None
    content = {key: value for key, value in given.model_dump().items() if value is not None}
    before = len(faults)
    faults += [f"{place}{fault}" for fault in _contradictions(content)]
    if len(faults) > before:
        return None
    sense = next(key for key in SENSES if key in content)
    limit = content.pop(sense)
    return Need(sense=sense, limit=limit, where=f"{where}: {place}", **content)


def _read_limit(value: Any) -> Quantity:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f'{value!r} is no limit. Write a number or text with a unit, such as "5 L" or "15 deg"')
    if not isinstance(value, str) and not math.isfinite(value):
        raise ValueError(f"{value!r} is not finite. Give a finite limit")
    return value


def _read_share(value: Any) -> float:
    try:
        share = si(value, "", "@")
    except InputError as error:
        raise ValueError(str(error).removeprefix("@: ").rstrip(".")) from None
    if not 0.0 < share < 1.0:
        raise ValueError(
            f'{value!r} is no share of the drawn craft. Give a number between 0 and 1, such as 0.9 or "90 %". All of '
            "them cannot be asked of a normal distribution"
        )
    return share


class _Item(BaseModel):
    """One [[requirement]]."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str
    criterion: str | None = None
    trial: str | None = None
    index: str | None = None
    at_most: Annotated[Any, PlainValidator(_read_limit)] = None
    at_least: Annotated[Any, PlainValidator(_read_limit)] = None
    share: Annotated[Any, PlainValidator(_read_share)] = None
    magnitude: bool = False
    source: str = ""
    assumed: bool = False


def _contradictions(content: Mapping[str, Any]) -> Iterable[str]:
    """What is wrong with a requirement whose keys are sound by themselves."""
    ways = [key for key in SENSES if key in content]
    if len(ways) != 1:
        some = "at_most and at_least are given together" if ways else "neither at_most nor at_least is given"
        yield f": {some}. Give one of them; two limits are two requirements."
    criterion, trial = content.get("criterion"), "trial" in content or "index" in content
    if (criterion is not None) == trial or (trial and not {"trial", "index"} <= set(content)):
        yield ": give a criterion, or a trial and its index. See docs/verdict.md for both lists."
    known = [*MEASURES, *SHARES]
    if criterion is not None and criterion not in known:
        yield f".criterion: unknown criterion {criterion!r}. {_near(criterion, known)}"
    elif criterion in SHARES:
        if "share" in content:
            yield f".share: {criterion} is a share of the drawn craft itself. Put the limit into at_least."
        if ways and not _is_probability(content[ways[0]]):
            yield f".{ways[0]}: {content[ways[0]]!r} is no probability. Give a number from 0 to 1, such as 0.9."
    elif criterion is not None and ways:
        try:
            bound(content[ways[0]], MEASURES[criterion].unit, f".{ways[0]}")
        except InputError as error:
            yield str(error)


def _is_probability(limit: Quantity) -> bool:
    try:
        return 0.0 <= si(limit, "", "limit") <= 1.0
    except InputError:
        return False


def _fault(place: str, error: Any) -> str:
    """One fault that pydantic found."""
    key = str(error["loc"][0]) if error["loc"] else ""
    if error["type"] == "extra_forbidden":
        return f"{place}.{key}: unknown key. {_near(key, _Item.model_fields)}"
    if error["type"] == "missing":
        return f"{place}.{key}: this key is missing. Give each requirement a name of its own."
    if error["type"] == "value_error":
        return f"{place}.{key}: {str(error['ctx']['error']).rstrip('.')}."
    words = {"string_type": 'a text in quotes, such as "turning circle"', "bool_type": "true or false"}
    return f"{place}.{key}: {error['input']!r} is not {words.get(error['type'], error['msg'])}."


def _near(name: str, known: Iterable[str]) -> str:
    known = list(known)
    found = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"Did you mean {found[0]}?" if found else f"Known here: {', '.join(known)}."
