"""``towtank run``: the whole chain."""

from __future__ import annotations

from towtank.cli import budget, towing
from towtank.cli.chain import open_chain
from towtank.cli.faults import jam
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import answering
from towtank.cli.scatter import compiled, scatter
from towtank.parallel import cores, prepare

PRELOADED = (
    "towtank.report.build",
    "matplotlib.figure",
    "matplotlib.backends.backend_svg",
)
"""What the processes of later stages need, imported while the first stages run."""
UNCOMPILED = (
    "without its compiled engine it takes many minutes. `towtank doctor` says why there is none; `towtank mc` does it "
    "all the same"
)


def run(
    craft: StudyArgument = None,
    speed: Speed = None,
    tank: towing.TankName = None,
    quality: towing.Quality = None,
    turbulence: towing.Turbulence = None,
    refinement: towing.Refinement = None,
    surface: towing.Surface = None,
    only: towing.Only = None,
    jobs: towing.Jobs = None,
    time: towing.Budget = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Do the whole chain, from craft file to report.

    Captive tests, derivatives, model, trials with their uncertainty, verdict and report go into the study folder.
    Stages that are done with the same inputs are not repeated; after Ctrl-C the same command resumes. The tank and what
    is asked of it are kept for the next time.

    Example: towtank run hokie

    Example: towtank run hokie --tank openfoam --out hokie-rans

    Example: towtank run hokie --tank openfoam --budget "20 min" --out hokie-both
    """
    with answering("run", json, debug) as reply:
        if cores() > 1:
            prepare(*PRELOADED)
        chain = open_chain(reply, craft, out, speed)
        spare = None if time is None else budget.seconds(time)
        towing.ask(chain, tank, quality, turbulence, refinement, only, jobs, spare, surface)
        chain.prepare()
        chain.make_plan()
        budget.choose_tests(chain)
        chain.tow()
        chain.derive()
        chain.try_out()
        if chain.done("mc") or compiled(chain):
            scatter(chain)
        else:
            reply.log(f"mc       left out: {UNCOMPILED}")
        if chain.craft.fins and (chain.done("faults") or compiled(chain)):
            jam(chain)
        chain.judge()
        chain.publish()
        verdict = chain.verdict()
        reply.summary |= {"craft": chain.craft.name, "stages_s": chain.wall, "verdict": verdict}
        reply.say("")
        reply.tell(f"{verdict['words']}\n\nReport: {chain.study.report}")
