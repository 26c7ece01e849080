"""``towtank tow``: run the captive tests."""

from __future__ import annotations

from collections import Counter

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering


def tow(craft: StudyArgument = None, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Run the captive tests that are not done yet.

    Makes the standard plan when the study has none.

    Example: towtank tow hokie
    """
    with answering("tow", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        chain.prepare()
        chain.make_plan()
        chain.tow()
        runs = chain.runs()
        flags = Counter(flag for run in runs for flag in run.flags)
        levels = sorted({run.level for run in runs})
        reply.summary |= {"runs": len(runs), "levels": levels, "flags": dict(flags), "stages_s": chain.wall}
        reply.say(f"{len(runs)} runs ({', '.join(levels)}) in {chain.study.runs}")
        for flag, number in flags.most_common():
            reply.say(f"  {number:4d} x {flag}")
