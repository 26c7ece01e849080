"""``towtank plan``: which captive tests."""

from __future__ import annotations

from collections import Counter

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import answering


def plan(
    craft: StudyArgument = None, speed: Speed = None, out: Out = None, json: Json = False, debug: Debug = False
) -> None:
    """Lay out the captive tests.

    Writes plan.toml to edit and plan.csv to read. An edited plan.toml is used as it is.

    Example: towtank plan hokie --speed "1 m/s"
    """
    with answering("plan", json, debug) as reply:
        chain = open_chain(reply, craft, out, speed)
        chain.prepare()
        chain.make_plan()
        made = chain.plan()
        kinds = Counter(test.kind for test in made.tests)
        reply.summary |= {
            "tests": len(made.tests),
            "kinds": dict(kinds),
            "speed": made.speed,
            "notes": list(made.notes),
        }
        reply.say(f"{len(made.tests)} captive tests at {made.speed:g} m/s")
        for kind, number in kinds.items():
            reply.say(f"  {kind:<10} {number:4d}")
        reply.say(f"{chain.study.plan}")
