"""The standard set of trials, open loop and under the pilot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import TrialError
from towtank.model.equations import Model
from towtank.parallel import each
from towtank.pilot.design import design_pilot
from towtank.pilot.law import Pilot
from towtank.progress import Progress, Silent
from towtank.trials.circle import turning_circle
from towtank.trials.mission import lawnmower
from towtank.trials.pullout import pull_out
from towtank.trials.spiral import spiral
from towtank.trials.start import ballasted, fin_limit, level_trim
from towtank.trials.steps import depth_step, heading_step
from towtank.trials.straight import straight_run
from towtank.trials.trajectory import Trajectory
from towtank.trials.zigzag import zigzag

Trial = Callable[[Model, Pilot | None], Trajectory]


def within(model: Model, degrees: float) -> str:
    """The angle of a standard trial, or what the fins reach where that is less, as text."""
    return f"{min(degrees, np.floor(10.0 * np.degrees(fin_limit(model))) / 10.0):.3g} deg"


OPEN_LOOP: dict[str, Trial] = {
    "straight run": lambda m, p: straight_run(m, pilot=p),
    "turning circle": lambda m, p: turning_circle(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
    "zigzag 10/10": lambda m, p: zigzag(m, within(m, 10.0), "10 deg", pilot=p, hold_depth=p is not None),
    "zigzag 20/20": lambda m, p: zigzag(m, within(m, 20.0), "20 deg", pilot=p, hold_depth=p is not None),
    "zigzag 10/5 vertical": lambda m, p: zigzag(
        m, within(m, 10.0), "5 deg", plane="vertical", pilot=p, hold_depth=p is not None
    ),
    "spiral": lambda m, p: spiral(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
    "pull-out": lambda m, p: pull_out(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
}
"""Trials with the rudder or elevator open loop. The pilot holds depth and damps roll where there is one."""

CLOSED_LOOP: dict[str, Trial] = {
    "heading step": lambda m, p: heading_step(m, "30 deg", pilot=p),
    "depth step": lambda m, p: depth_step(m, pilot=p),
    "lawnmower": lambda m, p: lawnmower(m, pilot=p),
}
"""Trials under the pilot."""


AS_LOADED = ("straight run",)
"""Trials run as the craft is loaded even when it cannot be flown level."""


LONGEST_FIRST = ("spiral", "lawnmower", "depth step")
"""Trials worth starting first when several processes share the work."""


@dataclass(frozen=True)
class _Setting:
    """What every standard trial of a craft shares."""

    loaded: Model
    neutral: Model
    pilot: Pilot | None
    notes: tuple[str, ...]


def standard_trials(model: Model, progress: Progress | None = None, workers: int = 1) -> tuple[Trajectory, ...]:
    """All standard trials of ``model`` at its craft's speed, with one pilot designed from it.

    A craft whose weight residual cannot be carried level at this speed is ballasted to neutral for its trials, as a
    crew would do; the straight run is made as loaded, so that the sinking is seen. A craft for which no pilot can be
    designed gets the open-loop trials only. A craft without fins gets the straight run. The trajectories' notes say so.

    workers : processes that share the trials (see ``towtank.parallel``).

    Raises
    ------
    InputError
        The craft's speed is not positive.
    """
    progress = progress or Silent()
    setting = _setting(model)
    names = list(OPEN_LOOP) if model.craft.fins else ["straight run"]
    if setting.pilot is not None:
        names += list(CLOSED_LOOP)
    progress.start("trials", len(names))
    made = {}
    queue = sorted(names, key=lambda name: name not in LONGEST_FIRST)
    for name, trajectory in zip(queue, each(_made, setting, queue, workers), strict=True):
        made[name] = trajectory
        progress.step("trials", name)
    progress.done("trials")
    return tuple(made[name] for name in names)


def _setting(model: Model) -> _Setting:
    trim = level_trim(model, model.craft.speed)
    neutral = model if trim.holds or not model.craft.fins else ballasted(model)
    notes = [] if neutral is model else [f"Ballasted to neutral for this trial: {trim.why}."]
    try:
        return _Setting(model, neutral, design_pilot(neutral), tuple(notes))
    except TrialError as error:
        return _Setting(model, neutral, None, (*notes, f"No pilot: {error}"))


def _made(setting: _Setting, name: str) -> Trajectory:
    trial = {**OPEN_LOOP, **CLOSED_LOOP}[name]
    if name in AS_LOADED:
        return trial(setting.loaded, setting.pilot)
    made = trial(setting.neutral, setting.pilot)
    merged = [*made.provenance.get("notes", []), *setting.notes]
    return replace(made, provenance={**made.provenance, "notes": merged})
