"""The command ``towtank`` and its sub-commands."""

from __future__ import annotations

from typing import Annotated

import typer

from towtank.cli.assess import assess
from towtank.cli.calibrate import calibrate
from towtank.cli.check import check
from towtank.cli.check_coefficients import check_coefficients
from towtank.cli.compare import compare
from towtank.cli.derive import derive
from towtank.cli.design import design
from towtank.cli.doctor import doctor
from towtank.cli.faults import faults
from towtank.cli.grid import grid
from towtank.cli.imports import import_
from towtank.cli.log import log
from towtank.cli.mc import mc
from towtank.cli.new import new
from towtank.cli.pilot import pilot
from towtank.cli.plan import plan
from towtank.cli.report import report
from towtank.cli.run import run
from towtank.cli.sea import sea
from towtank.cli.solve_case import solve_case
from towtank.cli.status import status
from towtank.cli.sweep import sweep
from towtank.cli.tow import tow
from towtank.cli.trial import trial
from towtank.cli.tune import tune
from towtank.provenance import VERSION

app = typer.Typer(
    name="towtank",
    help="From the shape of a slender underwater craft to a manoeuvring model. Start with: towtank run hokie",
    epilog="Exit codes: 0 done, 2 bad input, 3 a stage failed, 130 stopped by Ctrl-C.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"towtank {VERSION}")
        raise typer.Exit()


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the command; ``--version`` acts in its callback."""


for _command in (
    run,
    new,
    check,
    check_coefficients,
    plan,
    tow,
    import_,
    status,
    grid,
    derive,
    trial,
    pilot,
    tune,
    mc,
    faults,
    sea,
    assess,
    compare,
    sweep,
    design,
    calibrate,
    report,
    log,
    doctor,
):
    app.command(_command.__name__.strip("_").replace("_", "-"))(_command)
app.command("solve-case", hidden=True)(solve_case)
