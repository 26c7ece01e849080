"""``towtank grid``: is the mesh fine enough."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json
from towtank.cli.reply import Remarks, Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.grid.study import GridStudy

Places = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="CRAFT | DIR DIR DIR ...",
        help="A craft or study folder, for the fast tank; or three or more folders, each of the same runs on a mesh.",
        show_default=False,
    ),
]
Target = Annotated[str, typer.Option(metavar="SHARE", help="95 % bound that the chosen mesh keeps, of each load.")]
Resolutions = Annotated[
    str | None,
    typer.Option(
        metavar="LIST", help="Of the fast tank, such as 0.667,1,1.333; best multiples of 1/3.", show_default=False
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
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Judge how far loads depend on the mesh, and choose one.

    With a craft, a few runs are made in the fast tank on four meshes of panels (grid/<mesh>/runs). With folders, the
    runs in them are compared: the same names in each, and each run saying its mesh. Writes grid.json.

    Example: towtank grid hokie

    Example: towtank grid coarse medium fine --out study
    """
    with answering("grid", json, debug) as reply:
        from towtank.grid.files import FILE, write_grid
        from towtank.grid.show import table
        from towtank.grid.study import check_target
        from towtank.quantity import si

        share = si(target, "", "--target")
        check_target(share)
        if len(places or []) > 1:
            study, root = _of_folders(places or [], share, resolutions), out or Path()
        else:
            study, root = _of_craft(reply, places[0] if places else None, share, resolutions, out)
        reply.file("grid", write_grid(study, root / FILE))
        _tell(reply, study)
        reply.say(table(study))
        reply.say("")
        reply.tell(study.words)


def _of_folders(places: list[str], share: float, resolutions: str | None) -> GridStudy:
    from towtank.grid.study import grid_study
    from towtank.tank.files import read_runs

    if resolutions is not None:
        raise InputError("--resolutions is for the fast tank; the folders hold runs that are made. Leave it out.")
    return grid_study([read_runs(Path(place)) for place in places], target=share)


def _of_craft(
    reply: Reply, craft: str | None, share: float, resolutions: str | None, out: Path | None
) -> tuple[GridStudy, Path]:
    from towtank.grid.fast import RESOLUTIONS, fast_grid_study, tanks_of
    from towtank.tank.fast.tank import FastTank

    wanted = RESOLUTIONS if resolutions is None else _numbers(resolutions)
    tanks_of(wanted, FastTank(members=0))  # refused before anything is written
    chain = open_chain(reply, craft, out).keep_speed()
    chain.prepare()
    root = chain.study.root
    study = fast_grid_study(chain.craft, resolutions=wanted, target=share, out=root, progress=Remarks(reply))
    reply.file("runs", root / "grid")
    return study, root


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
