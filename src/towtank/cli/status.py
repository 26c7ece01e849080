"""``towtank status``: which stages of a study are done, and how far its campaign is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from towtank.cli import towing
from towtank.cli.chain import STAGES, Chain, open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import Reply, answering

if TYPE_CHECKING:
    from towtank.tank.openfoam.standing import Standing

SHOWN = 12
"""Runs listed in each state; the rest is counted."""


def status(craft: StudyArgument = None, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Say what is done in a study. Writes nothing.

    Of a campaign in OpenFOAM, which runs are done, under way, failed or to do, what they cost and what is to come.

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
            tests = len(towing.plan(chain).tests)
            done = sum(1 for path in chain.study.runs.glob("*/run.nc") if path.stat().st_size > 0)
            reply.summary |= {"tests": tests, "run_files": done}
            reply.say(f"{tests} captive tests planned, {done} run files in {chain.study.runs}")
            if towing.asked(chain)["tank"] == "openfoam":
                _campaign(reply, chain)


def _state(chain: Chain, stage: str, recorded: bool) -> str:
    if not recorded:
        return "not done"
    return "done" if chain.done(stage) else "out of date: its inputs or files changed"


def _campaign(reply: Reply, chain: Chain) -> None:
    """Say how far each run is."""
    from towtank.tank.account import duration

    found, jobs = towing.standings(chain), towing.jobs(chain)
    reply.summary["campaign"] = found.document() | {"jobs": jobs, "wall_left_s": found.wall(jobs)}
    for state in dict.fromkeys(run.state for run in found.runs):
        runs = [run for run in found.runs if run.state == state]
        reply.say(f"{state:<8} {len(runs)}")
        if state in ("done", "to do", "waiting"):
            continue
        for run in runs[:SHOWN]:
            reply.say(f"  {_line(run)}")
        if len(runs) > SHOWN:
            reply.say(f"  and {len(runs) - SHOWN} others; --json lists all")
    basis = f"the pace of {found.pace.measured} finished cases" if found.pace.measured else "the pace of other machines"
    reply.say(
        f"{duration(found.cpu)} of CPU so far; about {duration(found.left)} to come, {duration(found.wall(jobs))} with "
        f"{jobs} at a time, by {basis}"
    )


def _line(run: Standing) -> str:
    from towtank.tank.account import duration

    if run.state == "failed":
        return f"{run.name}: {run.why}"
    return f"{run.name}: step {run.step} of at most {run.total}, {duration(run.cpu)} of CPU so far"
