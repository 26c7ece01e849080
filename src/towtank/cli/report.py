"""``towtank report``: one page of everything the study holds."""

from __future__ import annotations

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering


def report(craft: StudyArgument = None, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Write report.html from what the study holds.

    Example: towtank report hokie
    """
    with answering("report", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        chain.publish()
        reply.say(str(chain.study.report))
