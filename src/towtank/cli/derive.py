"""``towtank derive``: from runs to derivatives and model."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli import fitting
from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.cli.chain import Chain
    from towtank.derive.table import Derivatives

About = Annotated[
    str | None,
    typer.Option(metavar="FROM_NOSE", help='Print about a point this far aft of the nose, such as "2.013 m".'),
]
Length = Annotated[str | None, typer.Option(metavar="L", help='Reference length of the primes, such as "4.261 m".')]
With = Annotated[
    str | None,
    typer.Option(
        "--with", metavar="GROUPS", help='Optional terms to fit as well: "third-order", "Xuuvv", or "none".',
        show_default=False,
    ),
]  # fmt: skip
Steady = Annotated[
    str | None,
    typer.Option(
        metavar="SHARE", help="Weight lambda of steady drift against sway, 0 to 1. Default: by L/D.", show_default=False
    ),
]
Screening = Annotated[
    bool | None,
    typer.Option(
        "--screening/--no-screening", help="Test each run against the others. Default: yes.", show_default=False
    ),
]
Frequencies = Annotated[
    bool, typer.Option("--study", help="Also print how derivatives depend on frequency and amplitude.")
]


def derive(
    craft: StudyArgument = None,
    about: About = None,
    length: Length = None,
    optional: With = None,
    steady: Steady = None,
    screening: Screening = None,
    study: Frequencies = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Derive coefficients from runs and print them.

    Every run is judged, and named where it is weighed down or rejected. A grid.json in the study folder enters the
    weights and the uncertainty. derivatives.json and model.json always hold the values about the body origin; what
    --about and --length ask for is printed and saved beside them as derivatives-about.json. --with, --steady and
    --screening are kept for the next time. frequency.json holds the study of the oscillations.

    Example: towtank derive suboff-fins --about "2.013 m" --length "4.261 m"

    Example: towtank derive hokie --with third-order --study
    """
    with answering("derive", json, debug) as reply:
        from towtank.derive.files import document
        from towtank.derive.show import table
        from towtank.quantity import si

        point = None if about is None else si(about, "m", "--about")
        reference = None if length is None else si(length, "m", "--length")
        if reference is not None and reference <= 0.0:
            raise InputError(f"--length {length}: primes are divided by powers of it. Give a length above zero.")
        chain = open_chain(reply, craft, out).keep_speed()
        chain.fitting = _asked(chain, optional, steady, screening)
        chain.derive()
        derived = chain.derivatives()
        if point is not None or reference is not None:
            derived = _elsewhere(reply, chain.study.root, derived, point, reference)
        content = document(derived)
        reply.summary |= {key: content[key] for key in ("level", "variant", "reference", "terms", "rejected")}
        reply.say(table(derived))
        _tell_verdicts(reply, derived.quality)
        if study:
            _tell_frequencies(reply, chain)


def _asked(chain: Chain, optional: str | None, steady: str | None, screening: bool | None) -> dict[str, str]:
    """What is asked of the fit: what the study was asked before, with what the user says now.

    Raises
    ------
    InputError
        A group of terms that does not exist, or a share that is none.
    """
    from towtank.quantity import si
    from towtank.symbols import OPTIONAL

    wanted = fitting.asked(chain)
    if optional is not None:
        groups = [] if optional == "none" else [word.strip() for word in optional.split(",") if word.strip()]
        if stray := [word for word in groups if word not in OPTIONAL]:
            raise InputError(f"--with {optional}: no group {stray[0]!r}. Groups are {', '.join(OPTIONAL)}, or none.")
        wanted = wanted | {"optional": ",".join(groups)}
    if steady is not None:
        share = si(steady, "", "--steady")
        if not 0.0 <= share <= 1.0:
            raise InputError(f"--steady {steady}: a share lies between 0 (sway only) and 1 (steady drift only).")
        wanted = wanted | {"steady": f"{share:g}"}
    if screening is not None:
        wanted = wanted | {"screening": "yes" if screening else "no"}
    return wanted


def _elsewhere(
    reply: Reply, root: Path, derived: Derivatives, point: float | None, reference: float | None
) -> Derivatives:
    """The set about another point or of another length, written beside the one about the origin."""
    from towtank.derive.convert import about_point
    from towtank.derive.files import write_derivatives

    moved = about_point(derived, point, reference)
    path = root / "derivatives-about.json"
    write_derivatives(moved, path)
    reply.file("derivatives_about", path)
    return moved


def _tell_verdicts(reply: Reply, quality: Any) -> None:
    """Runs that are not plainly accepted, and checks of the set that are not passed."""
    found = quality.get("screening", {})
    counts = Counter(entry["verdict"] for entry in found.values())
    reply.summary["screening"] = dict(counts)
    reply.summary["consistency"] = dict(Counter(check["verdict"] for check in quality.get("consistency", ())))
    if counts:
        reply.say("\nRuns: " + ", ".join(f"{number} {verdict}" for verdict, number in counts.items()))
    for name, entry in found.items():
        if entry["verdict"] in ("rejected", "down-weighted"):
            share = f", trust {entry['trust']:.2f}" if entry["verdict"] == "down-weighted" else ""
            reply.tell(f"  {name}: {entry['verdict']}{share}. {entry['why']}")
    for check in quality.get("consistency", ()):
        if check["verdict"] in ("warn", "fail"):
            reply.tell(f"  {check['verdict']}: {check['check']}. {check['words']}")


def _tell_frequencies(reply: Reply, chain: Chain) -> None:
    from towtank.derive.study_files import read_frequencies, study_table

    if not chain.study.frequency.exists():
        raise InputError("--study: the runs hold no oscillation, so there is no frequency to study. Leave it out.")
    found = read_frequencies(chain.study.frequency)
    reply.file("frequency", chain.study.frequency)
    reply.summary["recommended"] = {
        advice.kind: {"frequencies": advice.frequencies, "amplitudes": advice.amplitudes} for advice in found.advice
    }
    reply.say("\n" + study_table(found))
