"""``towtank derive``: from runs to derivatives and model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import answering
from towtank.errors import InputError

About = Annotated[
    str | None,
    typer.Option(metavar="FROM_NOSE", help='Print about a point this far aft of the nose, such as "2.013 m".'),
]
Length = Annotated[str | None, typer.Option(metavar="L", help='Reference length of the primes, such as "4.261 m".')]


def derive(
    craft: StudyArgument = None,
    about: About = None,
    length: Length = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Derive coefficients from runs and print them.

    derivatives.json and model.json always hold the values about the body origin; what --about and --length ask for is
    printed and saved beside them as derivatives-about.json.

    Example: towtank derive suboff-fins --about "2.013 m" --length "4.261 m"
    """
    with answering("derive", json, debug) as reply:
        from towtank.derive.convert import about_point
        from towtank.derive.files import document, write_derivatives
        from towtank.derive.show import table
        from towtank.quantity import si

        point = None if about is None else si(about, "m", "--about")
        reference = None if length is None else si(length, "m", "--length")
        if reference is not None and reference <= 0.0:
            raise InputError(f"--length {length}: primes are divided by powers of it. Give a length above zero.")
        chain = open_chain(reply, craft, out).keep_speed()
        chain.derive()
        derived = chain.derivatives()
        if point is not None or reference is not None:
            derived = about_point(derived, point, reference)
            path: Path = chain.study.root / "derivatives-about.json"
            write_derivatives(derived, path)
            reply.file("derivatives_about", path)
        content = document(derived)
        reply.summary |= {key: content[key] for key in ("level", "variant", "reference", "terms", "rejected")}
        reply.say(table(derived))
