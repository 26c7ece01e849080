"""``towtank trial``: one free-running trial."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.pilots import PilotWord, flown_by, named_after
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.trials.trajectory import Trajectory


class Kind(StrEnum):
    """Trials on offer; the value is the word on the command line, the name that of the function."""

    STRAIGHT_RUN = "straight-run"
    TURNING_CIRCLE = "turning-circle"
    ZIGZAG = "zigzag"
    SPIRAL = "spiral"
    PULL_OUT = "pull-out"
    HEADING_STEP = "heading-step"
    DEPTH_STEP = "depth-step"
    LAWNMOWER = "lawnmower"


PARAMETERS: Mapping[Kind, Mapping[str, str]] = {
    Kind.STRAIGHT_RUN: {"speed": "speed", "lengths": "lengths"},
    Kind.TURNING_CIRCLE: {"angle": "rudder", "speed": "speed"},
    Kind.ZIGZAG: {"angle": "angle", "heading": "heading", "plane": "plane", "speed": "speed"},
    Kind.SPIRAL: {"angle": "largest", "speed": "speed"},
    Kind.PULL_OUT: {"angle": "rudder", "speed": "speed"},
    Kind.HEADING_STEP: {"heading": "change", "speed": "speed", "lengths": "lengths"},
    Kind.DEPTH_STEP: {"depth": "change", "speed": "speed", "lengths": "lengths"},
    Kind.LAWNMOWER: {
        "legs": "legs",
        "leg_length": "leg_length",
        "spacing": "spacing",
        "depth": "depth",
        "speed": "speed",
    },
}
"""Option -> parameter of the trial's function."""


def _option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, show_default=False)


KindArgument = Annotated[Kind, typer.Argument(help="Which trial.", show_default=False)]
Angle = Annotated[str | None, _option("ANGLE", 'Fin angle, such as "10 deg" (circle, zigzag, spiral, pull-out).')]
Heading = Annotated[str | None, _option("ANGLE", "Heading where a zigzag turns back, or the heading step.")]
Depth = Annotated[str | None, _option("DEPTH", 'Depth step, or depth of the mission, such as "5 m".')]
Plane = Annotated[str | None, _option("PLANE", "horizontal or vertical (zigzag).")]
Speed = Annotated[str | None, _option("SPEED", 'Such as "1 m/s" or "2 knot".')]
Lengths = Annotated[float | None, _option("N", "Distance in craft lengths (straight run, steps).")]
Legs = Annotated[int | None, _option("N", "Number of legs (lawnmower).")]
LegLength = Annotated[str | None, _option("LENGTH", 'Such as "200 m" (lawnmower).')]
Spacing = Annotated[str | None, _option("LENGTH", 'Between legs, such as "50 m" (lawnmower).')]


def trial(
    kind: KindArgument,
    craft: StudyArgument = None,
    angle: Angle = None,
    heading: Heading = None,
    depth: Depth = None,
    plane: Plane = None,
    speed: Speed = None,
    lengths: Lengths = None,
    legs: Legs = None,
    leg_length: LegLength = None,
    spacing: Spacing = None,
    pilot: PilotWord = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Carry out one free-running trial with the model.

    Example: towtank trial zigzag hokie --angle "20 deg" --heading "20 deg"
    """
    given = {
        "angle": angle, "heading": heading, "depth": depth, "plane": plane, "speed": speed,
        "lengths": lengths, "legs": legs, "leg_length": leg_length, "spacing": spacing,
    }  # fmt: skip
    with answering("trial", json, debug) as reply:
        import towtank

        chosen = _parameters(kind, {name: value for name, value in given.items() if value is not None})
        chain = open_chain(reply, craft, out).keep_speed()
        flown, model = getattr(towtank, kind.name.lower()), chain.model()
        chosen |= flown_by(flown, pilot, model, chosen)
        trajectory: Trajectory = named_after(flown(model, **chosen), pilot)
        chain.add_trial(trajectory)
        reply.file("trial", chain.study.trials / f"{trajectory.name}.nc")
        _tell(reply, trajectory)


def _tell(reply: Reply, trajectory: Trajectory) -> None:
    indices = {name: {"value": value, "unit": unit} for name, (value, unit) in trajectory.indices.items()}
    reply.summary |= {"name": trajectory.name, "loop": trajectory.loop, "level": trajectory.level}
    reply.summary |= {"ended": trajectory.status, "indices": indices}
    reply.say(f"{trajectory.kind}, {trajectory.loop} loop, {trajectory.level}: {trajectory.status}")
    for name, (value, unit) in trajectory.indices.items():
        reply.say(f"  {name:<28} {value:12.5g} {unit}")


def _parameters(kind: Kind, given: Mapping[str, Any]) -> dict[str, Any]:
    """What the trial's function is called with.

    Raises
    ------
    InputError
        An option that this trial does not take.
    """
    takes = PARAMETERS[kind]
    if foreign := [name for name in given if name not in takes]:
        words = ", ".join(f"--{name.replace('_', '-')}" for name in takes)
        raise InputError(f"a {kind} takes no --{foreign[0].replace('_', '-')}. Its options: {words}.")
    return {takes[name]: value for name, value in given.items()}
