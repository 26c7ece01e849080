"""``towtank pilot``: a pilot or a schedule of pilots for a craft, with its margins over speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from towtank.cli.chain import Chain, open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.pilots import Noisy, PilotWord, afloat, designs_of, in_words, margins_of, pilot_of, seeing, speeds_of
from towtank.cli.reply import Reply, answering
from towtank.cli.study import file_hash
from towtank.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from towtank.frames import Array
    from towtank.model.equations import Model
    from towtank.pilot.law import Pilot
    from towtank.pilot.scheduled import PilotSchedule

GRID = 60
"""Speeds of the figure."""

Speeds = Annotated[
    str | None,
    typer.Option(
        metavar="LIST", show_default=False,
        help='Design speeds; two or more make a schedule: "0.5 m/s,1 m/s,1.5 m/s". Default: the craft\'s own.',
    ),
]  # fmt: skip


def pilot(
    craft: StudyArgument = None,
    pilot: PilotWord = None,
    speeds: Speeds = None,
    noisy: Noisy = False,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Design a pilot, or one for each of several speeds, and say where its loop is stable and by how much.

    The craft needs its derivatives first. Margins need python-control (towtank[control]). Results: pilot.json, for
    towtank trial --pilot, which picks the pilot of its speed; pilot.png, the whole loop over speed.

    Example: towtank pilot hokie --pilot lqi --speeds "0.5 m/s,1 m/s,1.5 m/s,2.2 m/s"
    """
    with answering("pilot", json, debug) as reply:
        chain = open_chain(reply, craft, out).keep_speed()
        asked = speeds_of(speeds) or (chain.craft.speed,)
        model = afloat(chain.model(), asked, reply)
        designed = _table(pilot or "cascade", model, asked)
        table = replace(designed, pilots=tuple(seeing(one, noisy) for one in designed.pilots))
        _publish(chain, model, table)
        _tell(reply, model, table, asked)


def _table(word: str, model: Model, speeds: Sequence[float]) -> PilotSchedule:
    from towtank.pilot.files import read_schedule
    from towtank.pilot.scheduled import PilotSchedule, design_schedule

    if Path(word).is_file():
        return read_schedule(word)
    if word in designs_of():
        return design_schedule(model, speeds, designs_of()[word])
    if len(speeds) > 1:
        raise InputError(
            f"--pilot {word} with {len(speeds)} speeds: a vehicle's gains are constant over speed. Give one speed, "
            "or a design: cascade, lqi."
        )
    return PilotSchedule((pilot_of(word, model, speeds[0]),))


def _publish(chain: Chain, model: Model, table: PilotSchedule) -> None:
    from towtank.artefact import replace_file
    from towtank.pilot.files import write_pilot, write_schedule

    inputs, path = {"derivatives": file_hash(chain.study.derivatives)}, chain.study.root / "pilot.json"
    one = len(table.pilots) == 1
    chain.reply.file(
        "pilot", write_pilot(table.pilots[0], path, inputs) if one else write_schedule(table, path, inputs)
    )
    figure = _figure(model, table)
    drawn = chain.study.root / "pilot.png"
    chain.reply.file("figure", replace_file(drawn, lambda part: figure.savefig(part, dpi=150, format="png")))


def _figure(model: Model, table: PilotSchedule) -> Figure:
    import numpy as np

    from towtank.figures.pilots import LoopOverSpeed, loops_over_speed
    from towtank.model.linear import elevator_reversal_speed
    from towtank.pilot.loops import whole_loop

    wide = (0.5, 2.0) if len(table.pilots) == 1 else (1.0, 1.0)
    low, high = wide[0] * table.speeds[0], wide[1] * table.speeds[-1]
    grid = np.linspace(low, high, GRID)
    own = min(table.pilots, key=lambda one: abs(one.speed - model.craft.speed))
    shown: dict[str, Callable[[float], Pilot]] = {f"one pilot, {own.speed:.3g} m/s": lambda speed: own}
    if len(table.pilots) > 1:
        shown = {"the schedule": table.at} | shown

    def growth(at: Callable[[float], Pilot]) -> Array:
        return np.array([whole_loop(model, at(u), u).eigenvalues[0].real for u in grid.tolist()])

    curves = [LoopOverSpeed(label, grid, growth(at)) for label, at in shown.items()]
    turn = elevator_reversal_speed(model, "wide") or 0.0
    inside = turn if low < turn < high else 0.0
    ax = loops_over_speed(curves, model.derivatives.level, table.speeds, inside)
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure


def _tell(reply: Reply, model: Model, table: PilotSchedule, speeds: Sequence[float]) -> None:
    from towtank.pilot.loops import whole_loop

    asked = speeds if len(speeds) > 1 else table.speeds
    rows = []
    for speed in asked:
        one = table.at(speed)
        growth = float(whole_loop(model, one, speed).eigenvalues[0].real)
        words = in_words(margins_of(reply, model, one, speed))
        reply.say(f"{speed:6.3g} m/s: slowest mode {growth:+.3g} 1/s, {words}")
        rows.append({"speed": speed, "growth": growth, "margins": words, "notes": list(one.notes)})
    for note in dict.fromkeys(note for one in table.pilots for note in one.notes):
        reply.tell(note)
    reply.summary |= {"craft": table.pilots[0].craft, "speeds": rows}
