"""Fields of a mapping: lists, words and numbers, each fault with its place and remedy."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from towtank.errors import InputError
from towtank.quantity import si


def three(given: Any, unit: str, where: str) -> tuple[float, float, float]:
    """A list of three quantities, in the SI ``unit``."""
    if not isinstance(given, list) or len(given) != 3:
        raise InputError(f"{where}: {given!r} is not a list of three numbers.")
    x, y, z = (si(item, unit, where) for item in given)
    return x, y, z


def positive(table: Mapping[str, Any], key: str, unit: str, where: str) -> float:
    """A quantity above zero that must be there, in the SI ``unit``."""
    if key not in table:
        raise InputError(f"{where}: no {key}. Add {key}" + (f' = "... {unit}".' if unit else "."))
    value = si(table[key], unit, f"{where}, {key}")
    if value <= 0.0:
        raise InputError(f"{where}: {key} {value:g} is not above zero.")
    return value


def one_of(table: Mapping[str, Any], key: str, words: Sequence[str], where: str, default: str | None = None) -> str:
    """One of ``words``."""
    value = table.get(key, default)
    if not isinstance(value, str) or value not in words:
        said = "missing" if value is None else f"{value!r} is unknown"
        raise InputError(f"{where}: {key} {said}. Write one of {', '.join(repr(word) for word in words if word)}.")
    return value


def words_of(given: Any, words: Sequence[str], where: str) -> tuple[str, ...]:
    """A list of some of ``words``."""
    if not isinstance(given, list) or not all(item in words for item in given):
        raise InputError(f"{where}: {given!r} is not a list of {', '.join(words)}.")
    return tuple(given)


def flag(value: Any, where: str) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise InputError(f"{where}: {value!r} is neither true nor false.")
    return value


def table_of(value: Any, where: str) -> Mapping[str, Any]:
    """A table of keys and values."""
    if not isinstance(value, dict):
        raise InputError(f"{where}: {value!r} is not a table. Write {{ key = value }}.")
    return value


def known(entry: Mapping[str, Any], keys: Collection[str], where: str) -> None:
    """Refuse a key that is not among ``keys``."""
    for key in entry:
        if key not in keys:
            raise InputError(f"{where}: unknown key {key!r}. {closest(key, keys)}")


def closest(word: str, words: Collection[str]) -> str:
    """A hint at what was meant."""
    near = difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    return f"Did you mean {near[0]!r}?" if near else f"Known: {', '.join(words) or 'none'}."
