"""From the text of a craft file to checked sections, and the list of everything that is wrong with them."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.craft.origins import Origins, assumed_keys
from towtank.craft.schema import HULLS, REQUIRED, SECTIONS, Given, Section
from towtank.errors import CraftError

REPEATED = {
    "fin": "each single fin as [[fin]], with double brackets; [fins] repeats one shape",
    "strake": "each set of strakes as [[strake]], with double brackets; azimuths or layout repeats one shape",
}
"""Sections that may stand several times, and how they are written."""


@dataclass
class Sections:
    """Sections of one file that are sound by themselves, and the faults found (dotted path: what, limit, remedy)."""

    tables: dict[str, Section] = field(default_factory=dict)
    fins: list[tuple[str, Section]] = field(default_factory=list)
    strakes: list[tuple[str, Section]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    origins: Origins = field(default_factory=Origins)


def read_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML text.

    Raises
    ------
    CraftError
        The text is not TOML; the message gives line and column.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CraftError(
            f"{where} is not a TOML file: {error}. Texts and quantities with units need quotes, "
            'for example mass = "30 kg".'
        ) from None


def read_sections(raw: Mapping[str, Any]) -> Sections:
    """Validate each section by itself, so that all faults of a file are found at once."""
    found = Sections()
    known = ["hull", *SECTIONS]
    for name in raw:
        if name not in known:
            found.faults.append(f"[{name}]: unknown section. {_closest(name, known)}")
    for name in REQUIRED:
        if name not in raw:
            found.faults.append(f"[{name}]: this section is missing. Add it; `towtank new NAME` shows a whole file.")
    for name, content in raw.items():
        if name in REPEATED and isinstance(content, list):
            for number, item in enumerate(content, start=1):
                path = f"{name}[{number}]"
                section = _section(path, SECTIONS[name], item, found.faults)
                if section:
                    (found.fins if name == "fin" else found.strakes).append((path, section))
        elif name in known:
            section = _one(name, content, found.faults)
            if section:
                found.tables[name] = section
    for path, section in [*found.tables.items(), *found.fins, *found.strakes]:
        found.origins.add(path, section)
    return found


def _one(name: str, content: Any, faults: list[str]) -> Section | None:
    if name in REPEATED:
        faults.append(f"{name}: write {REPEATED[name]}.")
        return None
    if name != "hull":
        return _section(name, SECTIONS[name], content, faults)
    kind = content.get("kind") if isinstance(content, Mapping) else None
    if not isinstance(kind, str) or kind not in HULLS:
        faults.append(f"hull.kind: {kind!r} is not a hull family. {_closest(str(kind), HULLS)}")
        return None
    return _section(name, HULLS[kind], content, faults)


def _section(path: str, model: type[Section], content: Any, faults: list[str]) -> Section | None:
    from pydantic import ValidationError

    try:
        section = model.model_validate(content)
    except ValidationError as error:
        faults.extend(_fault(path, model, item) for item in error.errors())
        return None
    wrong = [key for key in assumed_keys(section) if key not in model.model_fields]
    faults.extend(f"{path}.assumed: {key!r} is no key of it. {_closest(key, _keys(model))}" for key in wrong)
    return None if wrong else section


def _fault(path: str, model: type[Section], error: Any) -> str:
    location = list(error["loc"])
    for part in location:
        path += f"[{part + 1}]" if isinstance(part, int) else f".{part}"
    owner, key = _owner(model, location)
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return f"{path}: unknown key. {_closest(str(key), _keys(owner))}"
    if kind == "missing":
        info = owner.model_fields.get(str(key))
        return f"{path}: this key is missing ({info.description if info else key}). Add it."
    if kind == "literal_error":
        return f"{path}: {error['input']!r} is not one of {context['expected']}."
    if kind == "string_pattern_mismatch":
        return f"{path}: {error['input']!r} is no short name. Use letters, digits, dot, dash and underscore."
    if kind in ("model_type", "model_attributes_type"):
        return f"{path}: {error['input']!r} is not a table."
    if kind == "value_error":
        return f"{path}: {str(context['error']).rstrip('.')}."
    return f"{path}: {error['input']!r} {error['msg'].replace('Input should', 'should').lower()}."


def _owner(model: type[Section], location: list[Any]) -> tuple[type[Section], Any]:
    """The model whose key the fault is about, and that key."""
    for part in location[:-1]:
        inner = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(inner, type) and issubclass(inner, Section)):
            return model, part
        model = inner
    return model, location[-1] if location else ""


def _keys(model: type[Section]) -> list[str]:
    return list(model.model_fields)


def _closest(name: str, keys: Iterable[str]) -> str:
    keys = list(keys)
    near = difflib.get_close_matches(name, keys, n=1, cutoff=0.5)
    return f"Did you mean {near[0]}?" if near else f"Known here: {', '.join(keys)}."


def value(section: Any, key: str, default: float = 0.0) -> float:
    """SI value of a number of ``section``, or ``default`` where the file leaves it out."""
    given = getattr(section, key)
    return given.value if isinstance(given, Given) else default


def given_values(section: Section, keys: tuple[str, ...]) -> dict[str, float]:
    """SI values of those of ``keys`` that the file gives."""
    return {key: getattr(section, key).value for key in keys if isinstance(getattr(section, key), Given)}


def one_of(path: str, section: Section, keys: tuple[str, ...], faults: list[str]) -> list[str]:
    """Those of ``keys`` that the file gives; any number but one of them is a fault."""
    ways = [key for key in keys if getattr(section, key) is not None]
    if len(ways) != 1:
        some = f"{' and '.join(ways)} are given together" if ways else f"none of {', '.join(keys)} is given"
        faults.append(f"{path}: {some}. Give exactly one of {', '.join(keys)}.")
    return ways
