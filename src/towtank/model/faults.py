"""Fins that do not do what they are asked: jammed, lost, limited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.errors import InputError


@dataclass(frozen=True)
class Jammed:
    """A fin, by name, that stands at ``angle`` [rad] whatever it is asked."""

    fin: str
    angle: float


@dataclass(frozen=True)
class Lost:
    """A fin, by name, that is gone: it gives no load, and the hull misses what it gave at rest."""

    fin: str


@dataclass(frozen=True)
class Limited:
    """A fin, by name, that reaches ``angle`` [rad] to either side only."""

    fin: str
    angle: float


Fault = Jammed | Lost | Limited
_KINDS: Mapping[str, type[Any]] = {"jammed": Jammed, "lost": Lost, "limited": Limited}


def check_faults(craft: Craft, faults: Sequence[Fault]) -> None:
    """Refuse faults that ``craft`` cannot have.

    Raises
    ------
    InputError
        No fin of this name, two faults of one fin, an angle that is not finite or beyond what the fin reaches.
    """
    limits = {fin.name: float(fin.max_angle) for fin in craft.fins}
    for fault in faults:
        if fault.fin not in limits:
            raise InputError(f"craft {craft.name} has no fin {fault.fin!r}. Its fins: {', '.join(limits) or 'none'}.")
        if isinstance(fault, Lost):
            continue
        angle, limit = fault.angle, limits[fault.fin]
        low = 0.0 if isinstance(fault, Limited) else -limit
        if not low - 1e-12 <= angle <= limit + 1e-12:
            raise InputError(
                f"fin {fault.fin}: {np.degrees(angle):.4g} deg is outside {np.degrees(low):.4g} to "
                f"{np.degrees(limit):.4g} deg, what this fin reaches. Give an angle within."
            )
    named = [fault.fin for fault in faults]
    for name in named:
        if named.count(name) > 1:
            raise InputError(f"fin {name} has {named.count(name)} faults. Give it one.")


def faults_document(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """``faults`` as plain content of a file."""
    return [{"kind": type(fault).__name__.lower(), **asdict(fault)} for fault in faults]


def faults_of(content: Sequence[Mapping[str, Any]]) -> tuple[Fault, ...]:
    """The faults of the content that ``faults_document`` gives. KeyError or TypeError when it is not whole."""
    return tuple(
        _KINDS[item["kind"]](**{key: value for key, value in item.items() if key != "kind"}) for item in content
    )
