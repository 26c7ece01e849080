"""``towtank trial``: one free-running trial."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, Speed, StudyArgument
from towtank.cli.reply import answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.trials.trajectory import Trajectory


class Kind(StrEnum):
    """Trials on offer; the value is the word on the command line."""

    STRAIGHT_RUN = "straight-run"
    TURNING_CIRCLE = "turning-circle"
    ZIGZAG = "zigzag"
    SPIRAL = "spiral"
    PULL_OUT = "pull-out"
    HEADING_STEP = "heading-step"
    DEPTH_STEP = "depth-step"
    LAWNMOWER = "lawnmower"


KindArgument = Annotated[Kind, typer.Argument(metavar="KIND", help="Which trial.", show_default=False)]


def _option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, show_default=False)


Angle = Annotated[str | None, _option("ANGLE", 'Fin angle, such as "10 deg" (circle, zigzag, spiral, pull-out).')]
Heading = Annotated[str | None, _option("ANGLE", "Heading at which a zigzag turns back, or the heading step.")]
Depth = Annotated[str | None, _option("DEPTH", 'Depth step, such as "5 m".')]
Plane = Annotated[str | None, _option("PLANE", "horizontal or vertical, for a zigzag.")]
Duration = Annotated[str | None, _option("TIME", 'How long, such as "120 s".')]


def trial(
    kind: KindArgument,
    craft: StudyArgument = None,
    angle: Angle = None,
    heading: Heading = None,
    depth: Depth = None,
    plane: Plane = None,
    speed: Speed = None,
    duration: Duration = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Carry out one free-running trial with the model.

    Example: towtank trial zigzag hokie --angle "20 deg" --heading "20 deg"
    """
    with answering("trial", json, debug) as reply:
        given = {
            "angle": angle,
            "heading": heading,
            "depth": depth,
            "plane": plane,
            "speed": speed,
            "duration": duration,
        }
        function = _function(kind)
        wanted = _accepted(function, kind, {name: value for name, value in given.items() if value is not None})
        chain = open_chain(reply, craft, out).keep_speed()
        trajectory: Trajectory = function(chain.model(), **wanted)
        chain.write_trials((trajectory,))
        reply.file("trial", chain.study.trials / f"{trajectory.name}.nc")
        indices = {name: {"value": value, "unit": unit} for name, (value, unit) in trajectory.indices.items()}
        reply.summary |= {"name": trajectory.name, "loop": trajectory.loop, "level": trajectory.level}
        reply.summary |= {"ended": trajectory.status, "indices": indices}
        reply.say(f"{trajectory.kind}, {trajectory.loop} loop, {trajectory.level}: {trajectory.status}")
        for name, (value, unit) in trajectory.indices.items():
            reply.say(f"  {name:<28} {value:12.5g} {unit}")


def _function(kind: Kind) -> Callable[..., Trajectory]:
    import towtank

    function: Callable[..., Trajectory] = getattr(towtank, kind.name.lower())
    return function


def _accepted(function: Callable[..., Trajectory], kind: Kind, given: dict[str, str]) -> dict[str, str]:
    """``given``, when the trial takes all of it."""
    takes = set(inspect.signature(function).parameters)
    if foreign := [name for name in given if name not in takes]:
        possible = ", ".join(
            f"--{name}" for name in ("angle", "heading", "depth", "plane", "speed", "duration") if name in takes
        )
        raise InputError(f"{kind} takes no --{foreign[0]}. It takes: {possible or 'no options'}.")
    return given
