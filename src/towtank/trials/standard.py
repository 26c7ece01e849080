"""The standard set of trials, open loop and under the pilot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from towtank.errors import TrialError
from towtank.model.equations import Model
from towtank.model.linear import linearise
from towtank.pilot.design import design_pilot
from towtank.pilot.law import Pilot
from towtank.progress import Progress, Silent
from towtank.trials.circle import circle_ready
from towtank.trials.mission import lawnmower_ready
from towtank.trials.pullout import pull_out_ready
from towtank.trials.ready import Ready, run_trial
from towtank.trials.reverse import reverse_spiral_ready
from towtank.trials.speed import stopping_ready
from towtank.trials.spiral import spiral_ready
from towtank.trials.start import ballasted, fin_limit, level_trim
from towtank.trials.steps import depth_step_ready, heading_step_ready
from towtank.trials.straight import straight_ready
from towtank.trials.trajectory import Trajectory
from towtank.trials.vertical import meander_ready, steep_dive_ready
from towtank.trials.zigzag import zigzag_ready

Trial = Callable[[Model, Pilot | None], Ready]


def within(model: Model, degrees: float) -> str:
    """The angle of a standard trial, or what the fins reach where that is less, as text."""
    return f"{min(degrees, np.floor(10.0 * np.degrees(fin_limit(model))) / 10.0):.3g} deg"


def pitch_within(model: Model, elevator: float, degrees: float) -> str:
    """The pitch of a standard trial, or half of what ``elevator`` [deg] makes in steady flight where that is less.

    Source     Steady solution of w, q, theta in the linear model; left out where the vertical plane is not stable.
    """
    part = linearise(model, model.craft.speed).part(("w", "q", "theta"), ("elevator",))
    if part.eigenvalues.real.max() < 0.0:
        steady = np.linalg.solve(part.A, -part.B[:, 0])[2] * elevator
        degrees = min(degrees, max(np.floor(5.0 * abs(steady)) / 10.0, 0.1))
    return f"{degrees:.3g} deg"


def _limit(model: Model) -> float:
    return float(np.degrees(fin_limit(model)))


OPEN_LOOP: dict[str, Trial] = {
    "straight run": lambda m, p: straight_ready(m, pilot=p),
    "turning circle": lambda m, p: circle_ready(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
    "zigzag 10/10": lambda m, p: zigzag_ready(m, within(m, 10.0), "10 deg", pilot=p, hold_depth=p is not None),
    "zigzag 20/20": lambda m, p: zigzag_ready(m, within(m, 20.0), "20 deg", pilot=p, hold_depth=p is not None),
    "zigzag 10/5 vertical": lambda m, p: zigzag_ready(
        m, within(m, 10.0), "5 deg", plane="vertical", pilot=p, hold_depth=p is not None
    ),
    "spiral": lambda m, p: spiral_ready(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
    "pull-out": lambda m, p: pull_out_ready(m, within(m, 15.0), pilot=p, hold_depth=p is not None),
    "crash stop": lambda m, p: stopping_ready(m, pilot=p, hold_depth=p is not None),
    "meander": lambda m, p: meander_ready(
        m, within(m, 10.0), pitch_within(m, min(10.0, _limit(m)), 5.0), pilot=p, hold_course=p is not None
    ),
}
"""Trials with the rudder or elevator open loop. The pilot holds depth and damps roll where there is one."""

CLOSED_LOOP: dict[str, Trial] = {
    "reverse spiral": lambda m, p: reverse_spiral_ready(m, within(m, 15.0), pilot=p),
    "steep dive": lambda m, p: steep_dive_ready(m, pitch_within(m, 0.5 * _limit(m), 30.0), pilot=p),
    "heading step": lambda m, p: heading_step_ready(m, "30 deg", pilot=p),
    "depth step": lambda m, p: depth_step_ready(m, pilot=p),
    "lawnmower": lambda m, p: lawnmower_ready(m, pilot=p),
}
"""Trials under the pilot."""


AS_LOADED = ("straight run",)
"""Trials run as the craft is loaded even when it cannot be flown level."""


@dataclass(frozen=True)
class _Setting:
    """What every standard trial of a craft shares."""

    loaded: Model
    neutral: Model
    pilot: Pilot | None
    notes: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Trials that this craft can make."""
        flown = tuple(OPEN_LOOP) if self.loaded.craft.fins else AS_LOADED
        return flown if self.pilot is None else (*flown, *CLOSED_LOOP)

    def model(self, name: str) -> Model:
        """The model that the trial called ``name`` is flown with."""
        return self.loaded if name in AS_LOADED else self.neutral

    def ready(self, name: str) -> Ready:
        """The trial called ``name``."""
        return {**OPEN_LOOP, **CLOSED_LOOP}[name](self.model(name), self.pilot)


def standard_trials(model: Model, progress: Progress | None = None) -> tuple[Trajectory, ...]:
    """All standard trials of ``model`` at its craft's speed, with one pilot designed from it.

    A craft whose weight residual cannot be carried level at this speed is ballasted to neutral for its trials, as a
    crew would do; the straight run is made as loaded, so that the sinking is seen. A craft for which no pilot can be
    designed gets the open-loop trials only. A craft without fins gets the straight run. The trajectories' notes say so.

    Raises
    ------
    InputError
        The craft's speed is not positive.
    """
    progress, setting = progress or Silent(), _setting(model)
    progress.start("trials", len(setting.names))
    made = []
    for name in setting.names:
        trajectory = run_trial(setting.model(name), setting.ready(name))
        made.append(trajectory if name in AS_LOADED else noted(trajectory, setting.notes))
        progress.step("trials", name)
    progress.done("trials")
    return tuple(made)


def standard_ready(model: Model) -> tuple[tuple[Model, Ready], ...]:
    """The trials of ``standard_trials``, ready to fly, each with the model it is flown with: loaded or ballasted.

    Raises
    ------
    InputError
        The craft's speed is not positive.
    """
    setting = _setting(model)
    return tuple((setting.model(name), setting.ready(name)) for name in setting.names)


def _setting(model: Model) -> _Setting:
    trim = level_trim(model, model.craft.speed)
    neutral = model if trim.holds or not model.craft.fins else ballasted(model)
    notes = [] if neutral is model else [f"Ballasted to neutral for this trial: {trim.why}."]
    try:
        return _Setting(model, neutral, design_pilot(neutral), tuple(notes))
    except TrialError as error:
        return _Setting(model, neutral, None, (*notes, f"No pilot: {error}"))


def noted(made: Trajectory, notes: tuple[str, ...]) -> Trajectory:
    """``made`` with what has to be said of all trials."""
    merged = [*made.provenance.get("notes", []), *notes]
    return replace(made, provenance={**made.provenance, "notes": merged})
