"""``towtank grid``: is the mesh fine enough."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli import towing
from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json
from towtank.cli.reply import Remarks, Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.grid.study import GridStudy

Places = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="CRAFT | DIR DIR DIR ...",
        help="A craft or study folder; or three or more folders, each of the same runs on a mesh.",
        show_default=False,
    ),
]
Target = Annotated[str, typer.Option(metavar="SHARE", help="95 % bound that the chosen mesh keeps, of each load.")]
Resolutions = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Of the tank, such as 0.667,1,1.333: cells each way times that. Default: meshes that are alike.",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Study folder. Default: ./<craft name>; with folders of runs, this one.",
        show_default=False,
    ),
]


def grid(
    places: Places = None,
    target: Target = "2 %",
    resolutions: Resolutions = None,
    tank: towing.TankName = None,
    quality: towing.Quality = None,
    turbulence: towing.Turbulence = None,
    jobs: towing.Jobs = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Judge how far loads depend on the mesh, and choose one.

    With a craft, a few runs are made on meshes of one family: in the fast tank on four, in OpenFOAM on three
    (grid/<mesh>/runs). With folders, the runs in them are compared: the same names in each, and each run saying its
    mesh. Writes grid.json. Runs that are whole are not repeated; after Ctrl-C the same command resumes.

    Example: towtank grid hokie

    Example: towtank grid hokie --tank openfoam --out hokie-rans

    Example: towtank grid coarse medium fine --out study
    """
    with answering("grid", json, debug) as reply:
        from towtank.grid.files import FILE, write_grid
        from towtank.grid.show import table
        from towtank.grid.study import check_target
        from towtank.quantity import si

        share = si(target, "", "--target")
        check_target(share)
        wanted = None if resolutions is None else _numbers(resolutions)
        if len(places or []) > 1:
            given = {
                "resolutions": resolutions,
                "tank": tank,
                "quality": quality,
                "turbulence": turbulence,
                "jobs": jobs,
            }
            study, root = _of_folders(places or [], share, given), out or Path()
        else:
            chain = open_chain(reply, places[0] if places else None, out).keep_speed()
            towing.ask(chain, tank, quality, turbulence, jobs=jobs)
            study, root = _of_craft(chain, share, wanted), chain.study.root
            reply.file("runs", root / "grid")
        reply.file("grid", write_grid(study, root / FILE))
        _tell(reply, study)
        reply.say(table(study))
        reply.say("")
        reply.tell(study.words)
        if "refinement" in reply.summary:
            reply.say(f"Tow on it with --tank openfoam --refinement {reply.summary['refinement']:.4g}.")


def _of_folders(places: list[str], share: float, given: Mapping[str, object]) -> GridStudy:
    from towtank.grid.study import grid_study
    from towtank.tank.files import read_runs

    for name, value in given.items():
        if value is not None:
            raise InputError(f"--{name} is for runs to be made; the folders hold runs that are made. Leave it out.")
    return grid_study([read_runs(Path(place)) for place in places], target=share)


def _of_craft(chain: Chain, share: float, wanted: tuple[float, ...] | None) -> GridStudy:
    if towing.asked(chain)["tank"] == "openfoam":
        return _of_rans(chain, share, wanted)
    from towtank.grid.fast import RESOLUTIONS, fast_grid_study, tanks_of
    from towtank.tank.fast.tank import FastTank

    meshes = RESOLUTIONS if wanted is None else wanted
    tanks_of(meshes, FastTank(members=0))  # refused before anything is written
    chain.prepare()
    told, root = Remarks(chain.reply), chain.study.root
    return fast_grid_study(chain.craft, resolutions=meshes, target=share, out=root, progress=told)


def _of_rans(chain: Chain, share: float, wanted: tuple[float, ...] | None) -> GridStudy:
    """The study in OpenFOAM; what each mesh costs is told before the first solver starts."""
    from towtank.grid.rans import RESOLUTIONS, family, rans_on_meshes, rans_plan, unlike
    from towtank.grid.study import grid_study
    from towtank.tank.openfoam.schedule import cells_of

    reply, base, plan = chain.reply, towing.openfoam(chain), rans_plan(chain.craft)
    tanks = family(chain.craft, plan, RESOLUTIONS[base.quality] if wanted is None else wanted, base)
    chain.prepare()
    reply.kept = f"Finished runs are kept in {chain.study.root / 'grid'}."
    for tank in tanks:
        cells = cells_of(chain.craft, plan.tests[0], tank.mesh_settings)
        cost = sum(tank.schedule(chain.craft, plan.tests).costs)
        told = f"about {cells} cells, {len(plan.tests)} runs, {cost:.0f} s of CPU from their start"
        reply.log(f"grid     {tank.mesh_settings.label}: {told}")
    runs = rans_on_meshes(plan, tanks, chain.study.root, Remarks(reply), towing.jobs(chain))
    for name, steps in unlike(runs).items():
        told = ", ".join(map(str, steps))
        reply.log(f"  warning: {name} took {told} steps a period, coarse to fine; its changes are of the step too")
    study = grid_study(runs, target=share)
    chosen = next(tank for tank in tanks if tank.mesh_settings.label == study.chosen)
    reply.summary["refinement"] = chosen.refinement
    return study


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--resolutions {text!r} is not a list of numbers. Write them with commas: 0.667,1,1.333."
        ) from None


def _tell(reply: Reply, study: GridStudy) -> None:
    mesh = study.number(study.chosen)
    reply.summary |= {
        "craft": study.craft,
        "level": study.level,
        "meshes": {item.label: item.cells for item in study.meshes},
        "chosen": study.chosen,
        "met": study.met,
        "target": study.target,
        "words": study.words,
        "bounds": {item.name: round(item.share(mesh), 6) for item in study.quantities},
        "verdicts": {item.name: item.estimate.verdict for item in study.quantities},
    }
