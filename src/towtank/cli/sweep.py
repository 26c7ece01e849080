"""``towtank sweep``: a craft varied along one or more axes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import Reply, answering
from towtank.cli.study import program_hash
from towtank.errors import InputError
from towtank.parallel import cores, prepare

if TYPE_CHECKING:
    from towtank.sweep.sweep import Sweep
    from towtank.sweep.table import Row, SweepTable

SHOWN = ("G_h", "G_v", "P_stable_h", "turning_circle.tactical_diameter", "zigzag.first_overshoot")
"""Columns printed; sweep.csv has all."""
LINES = 40
"""Points printed; the rest is counted."""
JOBS = 4
"""Slurm jobs unless told otherwise."""

Vary = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=VALUES",
        help='An axis: a list "cg_x=-0.05,0,0.05" or first:last:number "fin_size=0.8:1.4:4". Give it once per axis. '
        "Names: fin_size, fin_area, fin_span, fin_chord, fin_angle, fin_position, strake_height, strake_length, "
        "strake_end, strake_taper, cg_x, cg_z, mass, ballast, speed.",
        show_default=False,
    ),
]
Members = Annotated[int, typer.Option(metavar="N", help="Size of the tank's model-form ensemble; 0 is fastest.")]
Trials = Annotated[
    str | None,
    typer.Option(metavar="LIST", help='Such as "zigzag" or "none". Default: turning-circle,zigzag,heading-step.'),
]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="WHERE", help='"tcp://host:port" of a Dask scheduler, or "slurm". Default: this machine.'),
]
Settings = Annotated[
    Path | None,
    typer.Option("--cluster-settings", metavar="FILE", help="TOML with the settings of the Slurm jobs: cores, memory."),
]
Workers = Annotated[
    int | None,
    typer.Option(metavar="N", help=f"Processes here (default: all cores), or Slurm jobs (default: {JOBS}).", min=1),
]


def sweep(
    craft: StudyArgument = None,
    vary: Vary = None,
    speed: Speed = None,
    trials: Trials = None,
    members: Members = 48,
    cluster: Cluster = None,
    cluster_settings: Settings = None,
    workers: Workers = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Vary a craft and take every variant through captive tests, derivatives, model and trials.

    All combinations of the axes are done, each once: finished points are kept in the study folder, and the same
    command, or one with more values, goes on from there. Results: sweep.json, sweep.csv, sweep.png.

    Example: towtank sweep hokie --vary "fin_size=0.8:1.4:4" --vary "speed=1 m/s,2 m/s"
    """
    with answering("sweep", json, debug) as reply:
        if not vary:
            raise InputError('nothing to vary. Name an axis and its values, such as --vary "fin_size=0.8:1.4:4".')
        settings = slurm_settings(cluster_settings, cluster)
        chain = open_chain(reply, craft, out, speed)
        asked = _asked(chain, vary, trials, members)
        if cluster is None and cores() > 1 and (workers or 2) > 1:
            prepare("towtank.sweep.point")
        chain.prepare()
        table = _carried_out(chain, asked, cluster, workers, settings)
        _publish(chain, table)
        _tell(reply, table)


def _asked(chain: Chain, vary: list[str], trials: str | None, members: int) -> Sweep:
    from towtank.sweep.sweep import TRIALS, Sweep, axis_of

    words = TRIALS if trials is None else tuple(w.strip().replace("-", "_") for w in trials.split(",") if w.strip())
    return Sweep(
        chain.craft,
        tuple(axis_of(chain.craft, text) for text in vary),
        members=members,
        trials=() if words == ("none",) else words,
    )


def slurm_settings(path: Path | None, cluster: str | None) -> dict[str, Any]:
    """Settings of the Slurm jobs from a TOML file."""
    import tomllib

    if path is None:
        return {}
    if cluster != "slurm":
        raise InputError("--cluster-settings describes jobs of Slurm. Add --cluster slurm, or leave it out.")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f'--cluster-settings {path}: {error}. It is TOML such as: cores = 4, memory = "8GB", one per line.'
        ) from None
    return dict(content.get("slurm", content))


def _carried_out(
    chain: Chain, asked: Sweep, cluster: str | None, workers: int | None, settings: dict[str, Any]
) -> SweepTable:
    from towtank.sweep.run import LEDGER, run_sweep

    chain.reply.kept = f"Finished points are kept in {chain.study.root / LEDGER}."
    return run_sweep(
        asked,
        chain.study.root,
        where=cluster,
        workers=workers or (JOBS if cluster == "slurm" else cores()),
        progress=chain.reply.progress,
        settings=settings,
        program=program_hash(),
    )


def _publish(chain: Chain, table: SweepTable) -> None:
    from towtank.artefact import replace_file
    from towtank.figures.sweep import sweep_sheet
    from towtank.sweep.files import write_sweep

    root = chain.study.root
    document, text = write_sweep(table, root)
    chain.reply.file("sweep", document)
    chain.reply.file("table", text)
    if len(table.failed) < len(table.rows):
        figure = sweep_sheet(table)
        path = replace_file(root / "sweep.png", lambda part: figure.savefig(part, format="png", dpi=160))
        chain.reply.file("figure", path)


def _tell(reply: Reply, table: SweepTable) -> None:
    shown = [name for name in SHOWN if name in table.columns]
    reply.summary |= {"craft": table.craft, "level": table.level, "points": len(table.rows)}
    reply.summary |= {"axes": {axis.name: list(axis.values) for axis in table.axes}, "columns": dict(table.columns)}
    reply.summary["failed"] = [{"at": list(row.at), "reason": row.failed} for row in table.failed]
    reply.summary["table"] = [
        {"at": list(row.at), **{name: row.values.get(name) for name in shown}} for row in table.rows
    ]
    reply.say(f"{len(table.rows)} points, {table.level}: {', '.join(axis.name for axis in table.axes)}")
    heads = [axis.label for axis in table.axes] + [name.rpartition(".")[2] for name in shown]
    reply.say("  " + "  ".join(f"{head:>12}" for head in heads))
    for row in table.rows[:LINES]:
        numbers = [*_shown(table, row), *(row.values.get(name, float("nan")) for name in shown)]
        reply.say("  " + "  ".join(f"{n:{max(len(h), 12)}.5g}" for n, h in zip(numbers, heads, strict=True)))
    if len(table.rows) > LINES:
        reply.say(f"  and {len(table.rows) - LINES} more in {reply.files['table']}")
    for row in table.failed[:LINES]:
        where = ", ".join(axis.words(value) for axis, value in zip(table.axes, row.at, strict=True))
        reply.log(f"  not done: {where}: {row.failed}")
    for note in dict.fromkeys(note for row in table.rows for note in row.notes if note.startswith("Not trimmed")):
        reply.log(f"  note: {note}")
    if len(table.failed) == len(table.rows):
        reply.fail(3, f"none of the {len(table.rows)} points could be carried out; the reasons are above and on file.")


def _shown(table: SweepTable, row: Row) -> list[float]:
    """Where a point lies, as printed."""
    return [axis.shown[0][axis.values.index(value)] for axis, value in zip(table.axes, row.at, strict=True)]
