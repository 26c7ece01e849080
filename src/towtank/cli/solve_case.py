"""``towtank solve-case``: one run of a study, as a task of a cluster calls it. Hidden: `towtank tow` runs them all."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from towtank.cli import towing
from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out
from towtank.cli.reply import answering

Identity = Annotated[str, typer.Argument(metavar="RUN", help="Folder name of the run, below runs.")]
Cores = Annotated[int, typer.Option("--cores", metavar="N", help="Processes of the case.")]


def solve_case(run: Identity, cores: Cores = 1, out: Out = None, json: Json = False, debug: Debug = False) -> None:
    """Run one captive test of a study in OpenFOAM, by its identity.

    Example: towtank solve-case drift-p04-122717b6 --out hokie-rans
    """
    with answering("solve-case", json, debug) as reply:
        from towtank.tank.campaign import tow_one

        chain = open_chain(reply, None, out).keep_speed()
        reply.kept = f"Its case in {chain.study.runs} goes on from there."
        tank = replace(towing.openfoam(chain), cores=cores)
        done = tow_one(towing.plan(chain), run, tank, chain.study.root, reply.progress)
        reply.file("run", chain.study.runs / run)
        reply.summary |= {"run": run, "flags": list(done.flags)}
        reply.say(f"{run} is whole")
