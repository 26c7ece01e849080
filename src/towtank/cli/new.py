"""``towtank new``: a craft file to start from."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from towtank.cli.options import Debug, Json
from towtank.cli.reply import answering
from towtank.errors import InputError

Name = Annotated[str, typer.Argument(metavar="NAME", help="Letters, digits, - and _.", show_default=False)]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write NAME.toml into.")]


def new(name: Name, out: Folder = Path(), json: Json = False, debug: Debug = False) -> None:
    """Write a commented craft file, NAME.toml. Never overwrites.

    Example: towtank new mycraft
    """
    with answering("new", json, debug) as reply:
        from towtank.artefact import write_text
        from towtank.craft.template import template

        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
            raise InputError(f"{name!r} cannot name a craft, because it names files. Use letters, digits, - and _.")
        path = out / f"{name}.toml"
        if path.exists():
            raise InputError(f"{path} exists and is left as it is. Choose another name, or remove it first.")
        write_text(path, template(name))
        reply.file("craft", path)
        reply.say(f"wrote {path}. Edit it, then: towtank check {path}")
