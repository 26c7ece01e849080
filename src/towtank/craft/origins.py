"""Where the numbers of a craft file come from: sourced, assumed, or neither."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from towtank.craft.schema import Given, Section


def assumed_keys(section: Section) -> tuple[str, ...]:
    """Keys that ``section`` lists as assumed."""
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
        marked = assumed_keys(section)
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
        named = key in assumed_keys(section)
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
    assumed = inner.assumed or outer.assumed is True or key in assumed_keys(outer)
    return inner.model_copy(update={"source": inner.source or outer.source, "assumed": assumed})
