"""``towtank trial``: one free-running trial."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.cli.chain import open_chain
from towtank.cli.options import Debug, Json, Out, StudyArgument
from towtank.cli.pilots import PilotWord, flown_by, named_after
from towtank.cli.reply import Reply, answering
from towtank.errors import InputError

if TYPE_CHECKING:
    from towtank.model.equations import Model
    from towtank.trials.trajectory import Trajectory


class Kind(StrEnum):
    """Trials on offer; the value is the word on the command line, the name that of the function."""

    STRAIGHT_RUN = "straight-run"
    ACCELERATION = "acceleration"
    STOPPING = "stopping"
    TURNING_CIRCLE = "turning-circle"
    ZIGZAG = "zigzag"
    SPIRAL = "spiral"
    REVERSE_SPIRAL = "reverse-spiral"
    PULL_OUT = "pull-out"
    MEANDER = "meander"
    STEEP_DIVE = "steep-dive"
    HEADING_STEP = "heading-step"
    DEPTH_STEP = "depth-step"
    LAWNMOWER = "lawnmower"
    WAYPOINT_MISSION = "waypoint-mission"


PARAMETERS: Mapping[Kind, Mapping[str, str]] = {
    Kind.STRAIGHT_RUN: {"speed": "speed", "lengths": "lengths"},
    Kind.ACCELERATION: {"hold_course": "hold_course", "speed": "speed"},
    Kind.STOPPING: {"throttle": "throttle", "hold_course": "hold_course", "speed": "speed"},
    Kind.TURNING_CIRCLE: {"angle": "rudder", "speed": "speed"},
    Kind.ZIGZAG: {"angle": "angle", "heading": "heading", "plane": "plane", "speed": "speed"},
    Kind.SPIRAL: {"angle": "largest", "speed": "speed"},
    Kind.REVERSE_SPIRAL: {"angle": "largest", "speed": "speed"},
    Kind.PULL_OUT: {"angle": "rudder", "speed": "speed"},
    Kind.MEANDER: {"angle": "elevator", "pitch": "pitch", "speed": "speed"},
    Kind.STEEP_DIVE: {"pitch": "pitch", "depth": "depth", "angle": "elevator", "speed": "speed"},
    Kind.HEADING_STEP: {"heading": "change", "current": "current", "speed": "speed", "lengths": "lengths"},
    Kind.DEPTH_STEP: {"depth": "change", "current": "current", "speed": "speed", "lengths": "lengths"},
    Kind.LAWNMOWER: {
        "legs": "legs", "leg_length": "leg_length", "spacing": "spacing", "depth": "depth", "current": "current",
        "speed": "speed",
    },
    Kind.WAYPOINT_MISSION: {"waypoint": "waypoints", "current": "current", "speed": "speed"},
}  # fmt: skip
"""Option -> parameter of the trial's function."""


def _option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, show_default=False)


KindArgument = Annotated[
    str,
    typer.Argument(
        metavar="KIND|FILE.toml", help=f"{', '.join(Kind)}; or the file of a trial of your own.", show_default=False
    ),
]
Angle = Annotated[
    str | None,
    _option(
        "ANGLE", 'Fin angle, such as "10 deg" (circle, zigzag, spirals, pull-out, meander; steep dive, open loop).'
    ),
]
Heading = Annotated[str | None, _option("ANGLE", "Heading where a zigzag turns back, or the heading step.")]
Pitch = Annotated[str | None, _option("ANGLE", "Pitch where a meander is let go, or of a steep dive.")]
Depth = Annotated[str | None, _option("DEPTH", 'Depth step or dive, or depth of the lawnmower, such as "5 m".')]
Plane = Annotated[str | None, _option("PLANE", "horizontal or vertical (zigzag).")]
Speed = Annotated[str | None, _option("SPEED", 'Such as "1 m/s" or "2 knot".')]
Throttle = Annotated[float | None, _option("X", "Thrust by that ahead: -1 full astern, 0 none (stopping).")]
HoldCourse = Annotated[bool, typer.Option("--hold-course", help="The pilot steers (acceleration, stopping).")]
Ballasted = Annotated[
    bool, typer.Option("--ballasted", help="Ballast the craft to neutral first, as the standard trials do.")
]
Lengths = Annotated[float | None, _option("N", "Distance in craft lengths (straight run, steps).")]
Legs = Annotated[int | None, _option("N", "Number of legs (lawnmower).")]
LegLength = Annotated[str | None, _option("LENGTH", 'Such as "200 m" (lawnmower).')]
Spacing = Annotated[str | None, _option("LENGTH", 'Between legs, such as "50 m" (lawnmower).')]
Waypoints = Annotated[
    list[str] | None,
    _option("N,E[,DEPTH[,SPEED]]", 'A point to pass, such as "200 m, 50 m, 5 m, 1.2 m/s"; once for each (mission).'),
]
Current = Annotated[
    str | None, _option("N,E", 'Current to the north and east, such as "0.1 m/s, -0.2 m/s" (steps, missions).')
]


def trial(
    kind: KindArgument,
    craft: StudyArgument = None,
    angle: Angle = None,
    heading: Heading = None,
    pitch: Pitch = None,
    depth: Depth = None,
    plane: Plane = None,
    speed: Speed = None,
    throttle: Throttle = None,
    hold_course: HoldCourse = False,
    lengths: Lengths = None,
    legs: Legs = None,
    leg_length: LegLength = None,
    spacing: Spacing = None,
    waypoint: Waypoints = None,
    current: Current = None,
    ballasted: Ballasted = False,
    pilot: PilotWord = None,
    out: Out = None,
    json: Json = False,
    debug: Debug = False,
) -> None:
    """Carry out one free-running trial with the model.

    Example: towtank trial zigzag hokie --angle "20 deg" --heading "20 deg"
    """
    given = {
        "angle": angle, "heading": heading, "pitch": pitch, "depth": depth, "plane": plane, "speed": speed,
        "throttle": throttle, "hold_course": hold_course or None, "lengths": lengths, "legs": legs,
        "leg_length": leg_length, "spacing": spacing, "waypoint": waypoint or None, "current": current,
    }  # fmt: skip
    with answering("trial", json, debug) as reply:
        carry_out = _chosen(kind, {name: value for name, value in given.items() if value is not None}, pilot)
        chain = open_chain(reply, craft, out).keep_speed()
        trajectory = _ballasted(chain.model(), carry_out) if ballasted else carry_out(chain.model())
        trajectory = named_after(trajectory, pilot)
        chain.add_trial(trajectory)
        reply.file("trial", chain.study.trials / f"{trajectory.name}.nc")
        _tell(reply, trajectory)


def _chosen(word: str, given: Mapping[str, Any], pilot: str | None) -> Callable[[Model], Trajectory]:
    """What makes the trial: a function of the package with its parameters, or a file; ``pilot`` as for ``flown_by``.

    Raises
    ------
    InputError
        No trial of this name, or an option that it does not take.
    """
    import towtank

    if word.endswith(".toml"):
        if given:
            raise InputError(f"{word} says all of its trial; it takes no --{next(iter(given)).replace('_', '-')}.")
        from towtank.trials.schema import read_trial

        asked = {"speed": read_trial(word).speed} if pilot else {}
        return lambda model: towtank.trial_from_file(
            model, Path(word), **flown_by(towtank.trial_from_file, pilot, model, asked)
        )
    if word not in list(Kind):
        raise InputError(f"{word!r} is no trial. Those are: {', '.join(Kind)}; or a file that ends in .toml.")
    kind = Kind(word)
    chosen = _parameters(kind, given)
    if kind is Kind.WAYPOINT_MISSION and "waypoints" not in chosen:
        raise InputError('a waypoint-mission needs points: --waypoint "200 m, 50 m", once for each.')
    flown = getattr(towtank, kind.name.lower())
    return lambda model: flown(model, **chosen, **flown_by(flown, pilot, model, chosen))


def _ballasted(model: Model, carry_out: Callable[[Model], Trajectory]) -> Trajectory:
    from towtank.trials.standard import noted
    from towtank.trials.start import ballasted

    return noted(carry_out(ballasted(model)), ("Ballasted to neutral for this trial: asked for.",))


def _tell(reply: Reply, trajectory: Trajectory) -> None:
    indices = {name: {"value": value, "unit": unit} for name, (value, unit) in trajectory.indices.items()}
    reply.summary |= {"name": trajectory.name, "loop": trajectory.loop, "level": trajectory.level}
    reply.summary |= {"ended": trajectory.status, "indices": indices}
    reply.say(f"{trajectory.kind}, {trajectory.loop} loop, {trajectory.level}: {trajectory.status}")
    for name, (value, unit) in trajectory.indices.items():
        reply.say(f"  {name:<28} {value:12.5g} {unit}")
    for note in trajectory.provenance["notes"]:
        reply.log(f"  note: {note}")


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
    return {takes[name]: _READ.get(name, lambda value: value)(value) for name, value in given.items()}


def _points(texts: list[str]) -> list[list[str]]:
    return [[part.strip() for part in text.split(",")] for text in texts]


def _current(text: str) -> list[float]:
    from towtank.quantity import si

    parts = [si(part.strip(), "m/s", "--current") for part in text.split(",")]
    return [*parts, 0.0] if len(parts) == 2 else parts


_READ: Mapping[str, Callable[[Any], Any]] = {"waypoint": _points, "current": _current}
"""Options that are more than one number."""
