"""``towtank faults``: a mission with one fin jammed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.reply import Reply, answering

if TYPE_CHECKING:
    from towtank.trials.jammed import JammedFins

Angles = Annotated[int, typer.Option(metavar="N", help="Angles of each fin, from limit to limit.", min=2, max=201)]


def faults(
    craft: StudyArgument = None,
    angles: Angles = 9,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Fly the lawnmower with each fin jammed at several angles, and say where it is completed and why not elsewhere.

    The pilot knows of the jam and shares its command among the other fins. The craft needs its derivatives first.
    Results: faults.json, and a section of the report.

    Example: towtank faults hokie --angles 13
    """
    with answering("faults", json, debug) as reply:
        from towtank.trials.jammed_files import read_jammed

        chain = open_chain(reply, craft, out).keep_speed()
        jam(chain, angles)
        _tell(reply, read_jammed(chain.study.faults))


def jam(chain: Chain, angles: int | None = None) -> None:
    """Do the stage: ``angles`` asks for it anew, None takes what the study has or the usual number."""

    def work() -> Sequence[Path]:
        from towtank.trials.jammed import ANGLES, jammed_fins
        from towtank.trials.jammed_files import write_jammed

        return (write_jammed(jammed_fins(chain.model(), angles or ANGLES), chain.replacing(chain.study.faults)),)

    if angles is None:
        chain.do("faults", work)
    else:
        chain.study.record("faults", chain.inputs("faults"), work(), 0.0)
    chain.reply.file("faults", chain.study.faults)


def _tell(reply: Reply, found: JammedFins) -> None:
    import numpy as np

    degrees = np.degrees(found.angle)
    rows = [
        {"fin": fin, "angle_deg": float(degrees[i, j]), "completed": not found.why[i][j], "why": found.why[i][j]}
        for i, fin in enumerate(found.fins)
        for j in range(degrees.shape[1])
    ]
    reply.summary |= {"craft": found.craft, "level": found.level, "mission": found.mission, "jams": rows}
    reply.summary |= {"completed": found.share, "notes": list(found.notes)}
    done = int(found.completed.sum())
    reply.say(f"{found.mission} of {found.craft} at {found.speed:g} m/s, {found.level}: completed with {done} of "
              f"{len(rows)} jams")  # fmt: skip
    for note in found.notes:
        reply.say(f"  {note}")
    for i, fin in enumerate(found.fins):
        missed = [(angle, why) for angle, why in zip(degrees[i], found.why[i], strict=True) if why]
        if not missed:
            worst = float(np.nanmax(found.depth_error[i]))
            reply.say(f"  {fin}: completed at every angle, off the depth by at most {worst:.2g} m rms")
        for angle, why in missed:
            reply.say(f"  {fin} at {angle:+.1f} deg: not completed, {why}")
