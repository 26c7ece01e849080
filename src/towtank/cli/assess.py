"""``towtank assess``: the stability verdict."""

from __future__ import annotations

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering


def assess(craft: StudyArgument = None, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Judge stability and margins of the model.

    Example: towtank assess hokie
    """
    with answering("assess", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        chain.judge()
        verdict = chain.verdict()
        reply.summary |= verdict
        reply.tell(verdict["words"])
