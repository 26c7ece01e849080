"""From the text of a craft file to checked sections, and the list of everything that is wrong with them."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from towtank.craft.schema import HULLS, REQUIRED, SECTIONS, Given, Section
from towtank.errors import CraftError


@dataclass
class Sections:
    """Sections of one file that are sound by themselves, and the faults found (dotted path: what, limit, remedy)."""

    tables: dict[str, Section] = field(default_factory=dict)
    fins: list[tuple[str, Section]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


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
        if name == "fin" and isinstance(content, list):
            for number, item in enumerate(content, start=1):
                path = f"fin[{number}]"
                section = _section(path, SECTIONS["fin"], item, found.faults)
                if section:
                    found.fins.append((path, section))
        elif name in known:
            section = _one(name, content, found.faults)
            if section:
                found.tables[name] = section
    return found


def _one(name: str, content: Any, faults: list[str]) -> Section | None:
    if name == "fin":
        faults.append("fin: write each single fin as [[fin]], with double brackets; [fins] repeats one shape.")
        return None
    if name != "hull":
        return _section(name, SECTIONS[name], content, faults)
    kind = content.get("kind") if isinstance(content, Mapping) else None
    if kind not in HULLS:
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
    wrong = [key for key in _assumed_keys(section) if key not in model.model_fields]
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


def _assumed_keys(section: Section) -> tuple[str, ...]:
    return section.assumed if isinstance(section.assumed, tuple) else ()


def _numbers(section: Section) -> Iterator[tuple[str, str, Given]]:
    """(key, dotted name inside the section, number) of every number of ``section`` itself."""
    for key in type(section).model_fields:
        value = getattr(section, key)
        items = value if isinstance(value, list) else [value]
        for number, item in enumerate(items, start=1):
            if isinstance(item, Given):
                yield key, f"{key}[{number}]" if isinstance(value, list) else key, item


@dataclass
class Origins:
    """Where the numbers come from: dotted names, in the order of the file."""

    assumed: list[str] = field(default_factory=list)
    unsourced: list[str] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)

    def add(self, path: str, section: Section) -> None:
        """Sort the numbers of ``section`` into assumed, unsourced and sourced."""
        if section.source:
            self.sources[path] = section.source
        marked = _assumed_keys(section)
        for key, name, number in _numbers(section):
            if number.source:
                self.sources[f"{path}.{name}"] = number.source
            by_section = key in marked or (section.assumed is True and not number.source)
            if by_section if number.assumed is None else number.assumed:
                self.assumed.append(f"{path}.{name}")
            elif not number.source and not section.source:
                self.unsourced.append(f"{path}.{name}")
        for key in type(section).model_fields:
            value = getattr(section, key)
            if isinstance(value, Section):
                self.add(f"{path}.{key}", _inherit(section, key, value))
            elif key not in ("source", "assumed") and not isinstance(value, Given) and value is not None:
                self._add_other(path, section, key, value)

    def _add_other(self, path: str, section: Section, key: str, value: Any) -> None:
        """A key that is no quantity, such as a section name or a table of offsets."""
        named = key in _assumed_keys(section)
        table = isinstance(value, list) and value and isinstance(value[0], tuple)
        if named or (section.assumed is True and (table or key in ("section", "layout", "kind"))):
            self.assumed.append(f"{path}.{key}")
        elif table and not section.source:
            self.unsourced.append(f"{path}.{key}")

    def default(self, name: str, reason: str) -> None:
        """Record a number that the file leaves out and the program supplies."""
        self.assumed.append(name)
        self.sources[name] = reason


def _inherit(outer: Section, key: str, inner: Section) -> Section:
    """``inner`` with the source and mark of the section it lies in, where it has none of its own."""
    assumed = inner.assumed or outer.assumed is True or key in _assumed_keys(outer)
    return inner.model_copy(update={"source": inner.source or outer.source, "assumed": assumed})
