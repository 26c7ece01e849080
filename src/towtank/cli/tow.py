"""``towtank tow``: run the captive tests."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from towtank.cli import towing
from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering

SHOWN = 8
"""Remarks listed; the rest is counted."""

Slurm = Annotated[
    Path | None,
    typer.Option("--slurm", metavar="SETTINGS", help="TOML file of a cluster: run the tests as a job array there.",
                 show_default=False),
]  # fmt: skip
Cancel = Annotated[bool, typer.Option("--cancel", help="Cancel the runs that are in the queue of Slurm.")]


def tow(
    craft: StudyArgument = None,
    tank: towing.TankName = None,
    quality: towing.Quality = None,
    turbulence: towing.Turbulence = None,
    refinement: towing.Refinement = None,
    surface: towing.Surface = None,
    only: towing.Only = None,
    jobs: towing.Jobs = None,
    slurm: Slurm = None,
    cancel: Cancel = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Run the captive tests that are not done yet.

    Makes the standard plan when the study has none. The tank and what is asked of it are kept for the next time. A run
    that fails leaves the others to go on; asked again, the same command tries it alone. With --slurm the runs are tasks
    of a cluster; asked again, the same command follows those in the queue and submits only what is missing.

    Example: towtank tow hokie

    Example: towtank tow hokie --tank openfoam --only drift,sway --out hokie-rans

    Example: towtank tow hokie --tank openfoam --surface hull.stl --only drift,turn --out hokie-hull

    Example: towtank tow hokie --tank openfoam --quality fine --slurm cluster.toml --out hokie-fine
    """
    with answering("tow", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        if cancel:
            towing.cancel(chain)
            return
        towing.ask(chain, tank, quality, turbulence, refinement, only, jobs, surface=surface)
        chain.prepare()
        chain.make_plan()
        towing.elsewhere(chain, slurm)
        chain.tow()
        summary = chain.study.stages()["tow"]["summary"]
        reply.summary |= {**summary, "stages_s": chain.wall}
        reply.say(f"{summary['runs']} runs ({', '.join(summary['levels'])}) in {chain.study.runs}")
        flags = Counter(summary["flags"]).most_common()
        for flag, number in flags[:SHOWN]:
            reply.say(f"  {number:4d} x {flag}")
        if len(flags) > SHOWN:
            reply.say(f"  and {len(flags) - SHOWN} other remarks; --json lists all")
