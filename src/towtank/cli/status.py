"""``towtank status``: which stages of a study are done."""

from __future__ import annotations

from towtank.cli.chain import STAGES, Chain, open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering


def status(craft: StudyArgument = None, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Say what is done in a study. Writes nothing.

    Example: towtank status hokie
    """
    with answering("status", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        recorded = chain.study.stages()
        states = {stage: _state(chain, stage, stage in recorded) for stage in STAGES}
        reply.summary |= {"stages": states}
        for stage, state in states.items():
            reply.say(f"{stage:<8} {state}")
        if chain.study.plan.exists():
            tests = len(chain.plan().tests)
            done = sum(1 for path in chain.study.runs.glob("*/run.nc") if path.stat().st_size > 0)
            reply.summary |= {"tests": tests, "run_files": done}
            reply.say(f"{tests} captive tests planned, {done} run files in {chain.study.runs}")


def _state(chain: Chain, stage: str, recorded: bool) -> str:
    if not recorded:
        return "not done"
    return "done" if chain.done(stage) else "out of date: its inputs or files changed"
