"""``towtank import``: runs made elsewhere."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.craft.craft import Craft
    from towtank.tank.imported.mapping import Spec
    from towtank.tank.run import Run

Mapping = Annotated[
    Path | None, typer.Argument(metavar="MAPPING", help="TOML file that says what the files hold.", show_default=False)
]
Files = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[FILES]...", help="Data files in place of those that the mapping names.", show_default=False
    ),
]
Template = Annotated[
    str | None,
    typer.Option(
        metavar="FORMAT", help="Print a mapping to edit: star, openfoam, csv, netcdf or mat.", show_default=False
    ),
]

LEFT = "run.replaced.nc"
"""What the file of a run is called when another import of the same name takes its place."""


def import_(
    mapping: Mapping = None,
    files: Files = None,
    template: Template = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Take in runs of STAR-CCM+, OpenFOAM, CSV, netCDF or MAT files.

    Axes, moment point, units, scale and half models are converted at once and told. Writes runs/<id>/run.nc, from
    which towtank derive goes on.

    Example: towtank import --template star > map.toml

    Example: towtank import map.toml --out study
    """
    with answering("import", json, debug) as reply:
        if template is not None:
            from towtank.tank.imported.template import template as written

            text = written(template)
            reply.summary["template"] = text
            reply.say(text.rstrip("\n"))
        elif mapping is None:
            raise InputError("no mapping is named. `towtank import --template star > map.toml` writes one to edit.")
        else:
            _import(reply, mapping, files or [], out)


def _import(reply: Reply, mapping: Path, files: Sequence[Path], out: Path | None) -> None:
    from towtank.tank.files import run_path, write_run
    from towtank.tank.imported.gate import refuse_twins
    from towtank.tank.imported.reading import read_mapping

    started = time.perf_counter()
    craft, source, specs = read_mapping(mapping, files)
    runs = _read(reply, craft, specs)
    refuse_twins(specs, runs)
    chain = open_chain(reply, source, out)
    _refuse_plan(chain)
    chain.prepare()
    replaced = _put_aside(chain, runs)
    for run in runs:
        write_run(run, run_path(chain.study.root, run.id))
    flags = Counter(flag for run in runs for flag in run.flags)
    told = {"runs": len(runs), "levels": sorted({run.level for run in runs}), "flags": dict(flags)}
    kept = told | {"imported": sorted(run.id for run in runs)}
    chain.study.record("tow", chain.inputs("tow"), _all_runs(chain), time.perf_counter() - started, kept)
    reply.file("runs", chain.study.runs)
    reply.summary |= told | {
        "replaced": replaced,
        "imported": {
            run.name: {"id": run.id, "flags": list(run.flags), "conversions": run.provenance["conversions"]}
            for run in runs
        },
    }
    _tell(reply, runs)
    reply.say(
        f"{len(runs)} run{'s' if len(runs) > 1 else ''} in {chain.study.runs}. Next: towtank derive {chain.study.root}"
    )


def _read(reply: Reply, craft: Craft, specs: Sequence[Spec]) -> list[Run]:
    from towtank.tank.imported.gate import import_run

    runs = []
    reply.progress.start("import", len(specs))
    for spec in specs:
        runs.append(import_run(craft, spec))
        reply.progress.step("import", spec.name)
    reply.progress.done("import")
    return runs


def _refuse_plan(chain: Chain) -> None:
    plan = chain.study.plan
    if plan.exists():
        raise InputError(
            f"{plan} is there: towtank derive would tow the tests of that plan and leave the imported runs aside. "
            "Choose a folder without a plan with --out DIR, or move the plan away."
        )


def _put_aside(chain: Chain, runs: Sequence[Run]) -> list[str]:
    """Take earlier imports of the same names out of the study, so that no run is fitted twice."""
    from towtank.tank.files import read_run

    own = {run.name: run.id for run in runs}
    replaced = []
    for path in sorted(chain.study.runs.glob("*/run.nc")):
        old = read_run(path)
        if old.name in own and old.id != own[old.name]:
            path.rename(path.with_name(LEFT))
            replaced.append(old.id)
            chain.reply.log(f"{old.id} was imported before from other files or keys; it is kept as {LEFT}")
    return replaced


def _all_runs(chain: Chain) -> list[Path]:
    return sorted(chain.study.runs.glob("*/run.nc"))


def _tell(reply: Reply, runs: Sequence[Run]) -> None:
    """What was done to every run once, then what differs from run to run."""
    common = [
        text
        for text in runs[0].provenance["conversions"]
        if len(runs) > 1 and all(text in run.provenance["conversions"] for run in runs)
    ]
    if common:
        reply.say("All runs:")
        for text in common:
            reply.say(f"  {text}")
    for run in runs:
        reply.say(f"{run.name} ({run.kind}, {run.level}) from {', '.join(run.provenance['inputs'])}")
        for text in run.provenance["conversions"]:
            if text not in common:
                reply.say(f"  {'! ' if text in run.flags else ''}{text}")
