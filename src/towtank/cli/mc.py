"""``towtank mc``: the trials of many craft drawn from the uncertainty of one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import Reply, answering
from towtank.cli.scatter import scatter
from towtank.cli.sweep import JOBS, Cluster, Settings, slurm_settings

if TYPE_CHECKING:
    from towtank.montecarlo.result import MonteCarlo

WIDEST = 5
"""Indices printed; mc.json has all."""

Samples = Annotated[int, typer.Option(metavar="N", help="Craft drawn.")]
Mass = Annotated[str, typer.Option(metavar="SHARE", help='Standard uncertainty of the mass, such as "1 %".')]
Cg = Annotated[str, typer.Option(metavar="LENGTH", help='Of each coordinate of the CG, such as "5 mm".')]
Current = Annotated[str, typer.Option(metavar="SPEED", help='Of each component of the current, such as "0.05 m/s".')]
Seed = Annotated[int, typer.Option(metavar="N", help="Of the draws; the same seed gives the same numbers.")]
Workers = Annotated[int | None, typer.Option(metavar="N", help=f"Slurm jobs (default: {JOBS}).", min=1)]


def mc(
    craft: StudyArgument = None,
    samples: Samples = 1000,
    mass: Mass = "0",
    cg: Cg = "0",
    current: Current = "0",
    seed: Seed = 20,
    cluster: Cluster = None,
    cluster_settings: Settings = None,
    workers: Workers = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Fly the standard trials with many craft drawn from the uncertainty of the derivatives.

    Gives bands for every trial and index, and the probability of course stability. Tolerances of mass, CG and current
    are normal and zero unless given. The craft need their derivatives first. Finished pieces are kept: after Ctrl-C the
    same command resumes. Results: mc.json, mc/<trial>.nc, and the std in trials/index.json.

    Example: towtank mc hokie --samples 2000 --mass "1 %" --cg "5 mm" --current "0.05 m/s"
    """
    with answering("mc", json, debug) as reply:
        settings = slurm_settings(cluster_settings, cluster)
        chain = open_chain(reply, craft, out).keep_speed()
        chain.drawing = {
            "samples": str(samples), "mass": mass, "cg": cg, "current": current, "seed": str(seed)
        }  # fmt: skip
        scatter(chain, cluster, workers or (JOBS if cluster == "slurm" else 1), settings)
        from towtank.montecarlo.files import read_mc

        _tell(reply, read_mc(chain.study.root))


def _tell(reply: Reply, found: MonteCarlo) -> None:
    from towtank.montecarlo.result import driven, headline

    planes = {
        plane.plane: {
            "probability_stable": plane.probability,
            "interval": list(plane.interval),
            "index": {"best": plane.index.best, "std": plane.index.std, "band": list(plane.index.band)},
        }
        for plane in found.planes.values()
    }
    widest = [(trial, name, found.trials[trial].indices[name]) for trial, name in found.widest(WIDEST)]
    reply.summary |= {"craft": found.craft, "level": found.level, "samples": found.done, "seed": found.seed}
    reply.summary |= {"stability": planes, "finished": {name: trial.finished for name, trial in found.trials.items()}}
    reply.summary["widest"] = [
        {"trial": trial, "index": name, "best": s.best, "std": s.std, "band": list(s.band), "unit": s.unit}
        for trial, name, s in widest
    ]
    reply.say(headline(found))
    for plane in found.planes.values():
        reply.say(f"  course stable, {plane.plane} plane: {plane}")
    reply.say("Widest indices (best estimate, 5 to 95 %):")
    for trial, name, s in widest:
        low, high = s.band
        band = f"{s.best:10.4g}  {low:10.4g} to {high:<10.4g} {s.unit:<6}"
        reply.say(f"  {trial + ', ' + name.replace('_', ' '):<44} {band} driven by {driven(s) or 'no single one'}")
