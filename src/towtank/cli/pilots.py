"""``--pilot``: a design, the gains of a vehicle, or a pilot.json."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from towtank.errors import InputError, TowtankError

if TYPE_CHECKING:
    from towtank.cli.reply import Reply
    from towtank.model.equations import Model
    from towtank.pilot.law import Pilot
    from towtank.trials.trajectory import Trajectory
    from towtank.tuning.margins import RobustMargins

PilotWord = Annotated[
    str | None,
    typer.Option(
        "--pilot", metavar="NAME|FILE", show_default=False,
        help="Who steers: cascade (default), lqi, a vehicle's gains such as lauv-marie-2026, or a pilot.json.",
    ),
]  # fmt: skip

Noisy = Annotated[bool, typer.Option("--noisy", help="The pilot sees through typical sensors, their values assumed.")]


def seeing(pilot: Pilot, noisy: bool) -> Pilot:
    """``pilot``, with typical sensors when ``noisy``."""
    from towtank.pilot.sensors import TYPICAL

    return replace(pilot, sensors=TYPICAL) if noisy else pilot


def pilot_of(word: str, model: Model, speed: float) -> Pilot:
    """The pilot called ``word`` for ``model`` at ``speed`` [m/s].

    Raises
    ------
    InputError
        Neither a file nor a name.
    """
    from towtank.pilot.files import read_schedule
    from towtank.pilot.vehicles import load_pilot, vehicles

    designs = designs_of()
    if Path(word).is_file():
        return read_schedule(word).at(speed)
    if word in designs:
        return designs[word](model, speed)
    shelf = vehicles()
    if word in shelf:
        return load_pilot(word, model, speed)
    raise InputError(
        f"--pilot {word}: neither a file nor a name. Give cascade, lqi, {', '.join(shelf)}, or a pilot.json."
    )


def designs_of() -> dict[str, Callable[[Model, float], Pilot]]:
    """Word -> design of a pilot for a model and a speed."""
    from towtank.pilot.design import design_pilot
    from towtank.pilot.lqi import design_lqi

    return {"cascade": design_pilot, "lqi": design_lqi}


def flown_by(trial: Callable[..., Any], word: str | None, model: Model, given: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of ``trial`` that let the pilot called ``word`` fly it, none without a word.

    With a pilot, the rudder or elevator of a trial in open loop is as ordered and the pilot holds the rest.

    given : what the trial's function is called with.

    Raises
    ------
    InputError
        A trial that no pilot flies, or no such pilot.
    """
    from towtank.quantity import si

    if word is None:
        return {}
    takes = inspect.signature(trial).parameters
    if "pilot" not in takes:
        raise InputError("--pilot: this trial is flown without a pilot. Leave it out.")
    speed = model.craft.speed if given.get("speed") is None else si(given["speed"], "m/s", "--speed")
    return {"pilot": pilot_of(word, model, speed)} | ({"hold_depth": True} if "hold_depth" in takes else {})


def named_after(trajectory: Trajectory, word: str | None) -> Trajectory:
    """``trajectory`` with the pilot in its name, so that trials of several pilots stand side by side in a study."""
    return replace(trajectory, name=f"{trajectory.name}-{Path(word).stem}") if word else trajectory


def speeds_of(text: str | None) -> tuple[float, ...]:
    """Speeds [m/s] of a list such as ``"1 m/s,2 m/s"``; none of no text.

    Raises
    ------
    InputError
        Not a list of speeds above zero.
    """
    from towtank.quantity import si

    speeds = tuple(si(part.strip(), "m/s", "--speeds") for part in (text or "").split(",") if part.strip())
    if text is not None and not (speeds and min(speeds) > 0.0):
        raise InputError(f'--speeds {text}: give one speed or more, above zero, such as "1 m/s,1.5 m/s".')
    return tuple(sorted(speeds))


def afloat(model: Model, speeds: Sequence[float], reply: Reply) -> Model:
    """``model``, ballasted to neutral where it cannot be flown level at all of ``speeds`` [m/s], as in its trials."""
    from towtank.trials.start import ballasted, level_trim

    trims = [level_trim(model, speed) for speed in speeds]
    if all(trim.holds for trim in trims) or not model.craft.fins:
        return model
    reply.log(f"ballasted to neutral: {next(trim.why for trim in trims if not trim.holds)}")
    return ballasted(model)


def in_words(margins: RobustMargins | str | None) -> str:
    """Margins in a line; None is a loop that is not stable."""
    from math import degrees

    if margins is None or isinstance(margins, str):
        return margins or "not stable"
    disk = margins.together.alpha
    return f"gain x{margins.gain:.2f}, phase {degrees(margins.phase):.0f} deg, disk of all loops {disk:.2f}"


def margins_of(reply: Reply, model: Model, pilot: Pilot, speed: float) -> RobustMargins | str | None:
    """Margins at ``speed`` [m/s]; None where the loop is not stable, words where python-control is missing."""
    from towtank.errors import TrialError
    from towtank.tuning.margins import robust_margins

    try:
        return robust_margins(model, pilot, speed)
    except TrialError:
        return None
    except TowtankError as error:
        reply.log(str(error))
        return "margins not known"
