"""The tow stage of a study: what the user asked of the tank, which tests are wanted, how far a campaign is."""

from __future__ import annotations

import fnmatch
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.reply import Remarks
from towtank.errors import InputError
from towtank.parallel import cores
from towtank.provenance import digest

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.plan.kinds import CaptiveTest, Plan
    from towtank.tank.openfoam.standing import Standings
    from towtank.tank.openfoam.tank import OpenFoamTank
    from towtank.tank.tank import Tank

TANKS = ("fast", "openfoam")
TOWING = {"tank": "fast", "quality": "", "turbulence": "", "refinement": "", "surface": "", "only": "", "budget": ""}
"""What is asked of a tank that was asked for nothing else: the fast one, all tests. Empty: the tank's own choice."""

TankName = Annotated[
    str | None,
    typer.Option("--tank", metavar="fast|openfoam", help="Where the tests are run. Default: fast.", show_default=False),
]
Quality = Annotated[
    str | None,
    typer.Option(metavar="draft|standard|fine", help="Mesh and numerics of OpenFOAM. Default: draft.",
                 show_default=False),
]  # fmt: skip
Turbulence = Annotated[
    str | None,
    typer.Option(metavar="MODEL", help="Such as kOmegaSST, in place of that of --quality.", show_default=False),
]
Refinement = Annotated[
    float | None,
    typer.Option(metavar="R", help="Cells each way times R: meshes of one family. Default: 1.", show_default=False),
]
Surface = Annotated[
    str | None,
    typer.Option("--surface", metavar="FILE", show_default=False,
                 help="STL in place of hull and fins: metres, body axes of the craft. none: its own shape again."),
]  # fmt: skip
Only = Annotated[
    str | None,
    typer.Option(metavar="LIST", help='Kinds or names of tests: "drift,sway", "drift-p*", or "all".',
                 show_default=False),
]  # fmt: skip
Budget = Annotated[
    str | None,
    typer.Option("--budget", metavar="TIME", show_default=False,
                 help='With --tank openfoam: the tests worth this wall time, such as "1 h", correct the fast tank.'),
]  # fmt: skip
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", metavar="N", help="Cases of OpenFOAM side by side. Default: one a core.",
                 show_default=False),
]  # fmt: skip


def asked(chain: Chain) -> dict[str, str]:
    """What is asked of the tank: by the user now, by the record of the study, or ``TOWING``."""
    known = chain.study.stages().get("tank", {}).get("inputs", {})
    return chain.towing or {name: known.get(name, usual) for name, usual in TOWING.items()}


def ask(
    chain: Chain,
    tank: str | None = None,
    quality: str | None = None,
    turbulence: str | None = None,
    refinement: float | None = None,
    only: str | None = None,
    jobs: int | None = None,
    budget: float | None = None,
    surface: str | None = None,
) -> None:
    """Take what the user says now, on top of what the study was asked before.

    Raises
    ------
    InputError
        No such tank, a setting that it does not have, or a number it cannot use.
    """
    wanted = asked(chain)
    if tank is not None and tank not in TANKS:
        raise InputError(f"--tank {tank}: there is no such tank. Choose one of {', '.join(TANKS)}.")
    if tank is not None and tank != wanted["tank"]:
        wanted = TOWING | {"tank": tank, "only": wanted["only"]}
    shape = "" if refinement is None else f"{refinement:.12g}"
    given = {"quality": quality or "", "turbulence": turbulence or "", "refinement": shape, "surface": surface or ""}
    stray = [name for name, value in (given | {"jobs": "" if jobs is None else str(jobs)}).items() if value]
    if stray and wanted["tank"] == "fast":
        raise InputError(f"--{stray[0]} is for --tank openfoam; the fast tank has no such setting. Leave it out.")
    if surface is not None:
        own = surface.strip() == "none"
        given["surface"], wanted = "" if own else str(Path(surface).resolve()), wanted | {"surface": ""}
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: at least one case has to run. Leave it out for one a core.")
    if only is not None:
        given["only"] = "" if only.strip() == "all" else ",".join(w.strip() for w in only.split(",") if w.strip())
        wanted = wanted | {"only": ""}
        wanted = wanted | {"budget": ""}
    if budget is not None:
        if wanted["tank"] != "openfoam" or only is not None:
            raise InputError(
                "--budget chooses the tests of --tank openfoam by what they tell. Give that tank, and no --only."
            )
        wanted = wanted | ({} if wanted["budget"] == f"{budget:g}" else {"budget": f"{budget:g}", "only": ""})
    chain.towing, chain.jobs = wanted | {name: value for name, value in given.items() if value}, jobs
    _ = chain.tank()  # settings that it refuses are told before anything is written


def tank(chain: Chain) -> Tank:
    """The tank the campaign runs in."""
    wanted = asked(chain)
    if wanted["tank"] == "openfoam":
        return openfoam(chain)
    from towtank.tank.fast.tank import FastTank

    return FastTank()


def openfoam(chain: Chain) -> OpenFoamTank:
    """The OpenFOAM tank as it is asked for."""
    from towtank.tank.openfoam.mesh.grid import MeshSettings
    from towtank.tank.openfoam.tank import OpenFoamTank

    wanted = asked(chain)
    chosen: dict[str, Any] = {name: wanted[name] for name in ("quality", "turbulence", "surface") if wanted[name]}
    tank = OpenFoamTank(**chosen, refinement=float(wanted["refinement"] or 1.0))
    _, mesh = tank.solution, tank.mesh_settings
    if isinstance(mesh, MeshSettings):
        mesh.counts()
    return tank


def jobs(chain: Chain) -> int:
    """Runs under way at a time."""
    return (chain.jobs or cores()) if asked(chain)["tank"] == "openfoam" else 1


def inputs(chain: Chain) -> dict[str, str]:
    """Name -> hash or text of what the runs depend on beside craft and plan."""
    only = asked(chain)["only"]
    return {"tank": digest(chain.tank().settings(), 16)} | ({"only": only} if only else {})


def keep(chain: Chain) -> None:
    """Record what is asked of the tank, so that later commands, and a look while it runs, know it."""
    wanted = asked(chain)
    known = chain.study.stages().get("tank", {}).get("inputs", TOWING)
    if wanted != known:
        chain.study.record("tank", wanted, (), 0.0)


def plan(chain: Chain) -> Plan:
    """The captive tests of the study that are wanted.

    Raises
    ------
    InputError
        A word of --only that is neither a kind nor a name of the plan.
    """
    whole = chain.plan()
    words = [word for word in asked(chain)["only"].split(",") if word]
    if not words:
        return whole
    for word in words:
        if not any(_meant(word, test) for test in whole.tests):
            kinds = ", ".join(dict.fromkeys(test.kind for test in whole.tests))
            raise InputError(
                f"--only {word}: the plan has no such kind or name. Kinds are {kinds}; names stand in "
                f'{chain.study.plan} and may hold * as in "drift-p*". --only all takes every test.'
            )
    return replace(whole, tests=tuple(test for test in whole.tests if any(_meant(word, test) for word in words)))


def _meant(word: str, test: CaptiveTest) -> bool:
    return word == test.kind or fnmatch.fnmatchcase(test.name, word)


def standings(chain: Chain) -> Standings:
    """How far each run of a campaign in OpenFOAM is."""
    from towtank.tank.openfoam.slurm import queue
    from towtank.tank.openfoam.standing import standings as of_plan

    return of_plan(plan(chain), openfoam(chain), chain.study.root, queue(chain.study.root))


def elsewhere(chain: Chain, settings: Path | None) -> None:
    """Have the missing runs made by Slurm, as the file ``settings`` says; without one, see that Slurm has none.

    Raises
    ------
    InputError
        The tank is the fast one, the settings cannot be used, or runs are in the queue and it is not asked for.
    """
    from towtank.tank.openfoam.slurm import queue, read_settings

    root = chain.study.root
    if settings is None:
        if queued := queue(root):
            raise InputError(
                f"{len(queued)} runs of {root} are in the queue of Slurm. Follow them with --slurm SETTINGS, or end "
                "them with --cancel."
            )
        return
    if asked(chain)["tank"] != "openfoam":
        raise InputError("--slurm is for --tank openfoam; the fast tank takes seconds here. Leave it out.")
    from towtank.tank.openfoam.follow import follow

    read = read_settings(settings)
    keep(chain)
    chain.reply.kept = f"Finished runs are kept in {chain.study.runs}."
    for number in follow(plan(chain), openfoam(chain), root, read, Remarks(chain.reply)):
        chain.reply.log(f"tow      runs came from job array {number:03d} in {root / 'slurm'}")


def cancel(chain: Chain) -> None:
    """Cancel what Slurm has of the study, and say what it was."""
    from towtank.tank.openfoam.slurm import cancel as cancel_tasks

    found = cancel_tasks(chain.study.root)
    chain.reply.summary["cancelled"] = [task.run for task in found]
    chain.reply.say(f"{len(found)} runs cancelled. What is on file stays; the same command without --cancel goes on.")
