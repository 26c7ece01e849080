"""Arguments and options that several commands share, worded once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CraftArgument = Annotated[
    str,
    typer.Argument(
        metavar="CRAFT", help="A craft of the library, a craft.toml, or a study folder.", show_default=False
    ),
]
StudyArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="CRAFT",
        help="A craft of the library, a craft.toml, or a study folder. Default: the folder of --out, or this one.",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Study folder. Default: ./<craft name>.", show_default=False),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout, remarks on stderr.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]
Speed = Annotated[
    str | None,
    typer.Option(metavar="SPEED", help='Such as "1 m/s" or "2 knot". Default: the craft\'s.', show_default=False),
]
