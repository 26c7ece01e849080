"""``towtank assess``: the stability verdict, and whether the craft does what is asked of it."""

from __future__ import annotations

from typing import Annotated

import typer

from towtank.cli import judging
from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering

Requirements = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="Requirements (TOML), kept in the study; standard takes the set of the package again.",
        show_default=False,
    ),
]
Template = Annotated[bool, typer.Option("--template", help="Print the standard requirements, a file to edit.")]


def assess(
    craft: StudyArgument = None,
    requirements: Requirements = None,
    template: Template = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Judge stability and margins of the model, and requirements with margin, probability and what drives each.

    With --requirements the standard trials are flown first where they are not done, and those of drawn craft, from
    which the probabilities come. docs/verdict.md describes the file.

    Example: towtank assess hokie

    Example: towtank assess --template > mine.toml

    Example: towtank assess hokie --requirements mine.toml
    """
    with answering("assess", json, debug) as reply:
        if template:
            from towtank.verdict.needs import standard_text

            reply.summary["template"] = standard_text()
            reply.say(standard_text().rstrip("\n"))
            return
        chain = open_chain(reply, craft, out).keep_speed()
        if requirements is not None:
            chain.requirements = requirements
            judging.prepare(chain)
        chain.judge()
        judging.tell(chain)
