"""``towtank check-coefficients``: is a coefficient set sound."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.options import Debug, Json
from towtank.cli.reply import FAILED, WIDTH, answering

if TYPE_CHECKING:
    from towtank.derive.check import Check
    from towtank.derive.table import Derivatives

File = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", help="A coefficient file (TOML), derivatives.json, or a study folder.", show_default=False
    ),
]
CraftOption = Annotated[
    str | None,
    typer.Option(
        "--craft",
        metavar="CRAFT",
        help="The craft the set is of, for its symmetry and sizes: a name of the library or a craft.toml.",
        show_default=False,
    ),
]
Against = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Another set of the same craft: term by term.", show_default=False),
]

ORDER = ("fail", "warn", "pass", "not applicable")
"""Verdicts, worst first."""


def check_coefficients(
    file: File, craft: CraftOption = None, against: Against = None, json: Json = False, debug: Debug = False
) -> None:
    """Check a coefficient set: symmetry, signs, energy, size, and whether its planes agree.

    Exit code 3 when a check fails. docs/coefficients.md states the file and the limit of every check.

    Example: towtank check-coefficients remus.toml

    Example: towtank check-coefficients hokie --craft hokie
    """
    with answering("check-coefficients", json, debug) as reply:
        from towtank.craft.library import read_craft
        from towtank.derive.agreement import compare
        from towtank.derive.consistency import consistency
        from towtank.derive.published import read_set

        derivatives = read_set(file)
        checks = consistency(derivatives, None if craft is None else read_craft(craft))
        if against is not None:
            checks = (*checks, *compare(derivatives, read_set(against)))
        counts = Counter(check.verdict for check in checks)
        reply.summary |= {
            "craft": derivatives.craft,
            "level": derivatives.level,
            "verdicts": {verdict: counts[verdict] for verdict in ORDER},
            "checks": [check.document() for check in checks],
            "departures": list(derivatives.quality.get("departures", ())),
            "not_represented": derivatives.quality.get("not_represented", {}),
        }
        reply.say(_head(derivatives))
        reply.say(_table(checks))
        reply.say("\n" + ", ".join(f"{counts[verdict]} {verdict}" for verdict in ORDER) + ".")
        if counts["fail"]:
            names = "; ".join(check.name for check in checks if check.verdict == "fail")
            plural = "s" if counts["fail"] > 1 else ""
            reply.fail(FAILED, f"{counts['fail']} check{plural} failed in {file}: {names}.")


def _head(d: Derivatives) -> str:
    q, r = d.quality, d.reference
    words = [f"Coefficients of {d.craft}, level {d.level}, {len(d.names)} terms, variant {d.variant}"]
    if "formulation" in q:
        words.append(f"Formulation {q['formulation']}, source {q['source'] or 'not stated'}")
    words.append(f"L = {r.length:.5g} m, rho = {r.density:.5g} kg/m3, about {r.origin_from_nose:.4g} m aft of the nose")
    lines = ["\n".join(words)]
    departures: Sequence[str] = q.get("departures", ())
    if departures:
        lines.append("Read otherwise than printed:")
        lines += [_wrapped(text, "- ", "  ") for text in departures]
    return "\n".join(lines) + "\n"


def _table(checks: Sequence[Check]) -> str:
    lines = []
    for check in sorted(checks, key=lambda item: ORDER.index(item.verdict)):
        numbers = "" if check.value is None else f" [{_short(check.value)}; limit {check.limit:.3g}]"
        lines.append(_wrapped(f"{check.name}{numbers}: {check.words}", f"{check.verdict:<16}", " " * 16))
    return "\n".join(lines)


def _short(value: float) -> str:
    return "0" if abs(value) < 1e-12 else f"{value:.3g}"


def _wrapped(text: str, first: str, later: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=later, break_on_hyphens=False)
