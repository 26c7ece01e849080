"""One point of a sweep: a variant taken through tests, derivatives, model and trials to its verdict, as numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from towtank.craft.craft import Craft, Mass
from towtank.derive.derive import derive
from towtank.derive.show import origin_primes, primes
from towtank.derive.straightening import with_straightening
from towtank.derive.table import Derivatives
from towtank.errors import TrialError
from towtank.model.equations import Model
from towtank.plan.standard import standard_plan
from towtank.sweep.sweep import TRIALS, Sweep
from towtank.tank.campaign import tow
from towtank.tank.fast.tank import FastTank
from towtank.trials.circle import turning_circle
from towtank.trials.standard import within
from towtank.trials.start import ballasted, level_trim
from towtank.trials.steps import heading_step
from towtank.trials.trajectory import Trajectory
from towtank.trials.zigzag import zigzag
from towtank.verdict.assess import assess
from towtank.verdict.criteria import PlaneCriteria
from towtank.verdict.table import Verdict

SLOPES = ("Yuv", "Nuv", "Yur", "Nur", "Zuw", "Muw", "Zuq", "Muq")
DERIVATIVES = (*SLOPES, "Yvdot", "Nrdot", "Zwdot", "Mqdot", "Yuudr", "Nuudr", "Zuude", "Muude", "Xuu", "Kup")
"""Derivatives that a point lists, primed; the slopes at the origin as well, under ``<name>'.origin``."""

_WEIGHTLESS = Mass(1.0, 1.0, (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
"""Stands for the mass of a craft in the tank, which measures hydrodynamic loads only."""

Numbers = dict[str, tuple[float, str]]
"""Name -> (value, unit)."""

_RUN: Mapping[str, Callable[[Model, bool], Trajectory]] = {
    "turning_circle": lambda m, held: turning_circle(m, within(m, 15.0), hold_depth=held),
    "zigzag": lambda m, held: zigzag(m, within(m, 10.0), "10 deg", hold_depth=held),
    "heading_step": lambda m, _: heading_step(m, "30 deg"),
}
"""Trial -> how it is carried out, as in the standard set."""


@dataclass(frozen=True)
class Evaluated:
    """A craft at the end of the chain."""

    model: Model
    trajectories: Mapping[str, Trajectory]
    verdict: Verdict
    notes: tuple[str, ...]


def evaluate(craft: Craft, tank: FastTank | None = None, trials: Sequence[str] = TRIALS) -> Evaluated:
    """Standard plan, captive tests, derivatives, model, ``trials``, verdict.

    A craft that cannot be flown level is ballasted to neutral for its trials, as in ``standard_trials``. One for which
    no pilot can be designed makes its open-loop trials without one. The notes say so.

    Raises
    ------
    TowtankError
        A stage before the trials failed.
    """
    model = model_of(craft, tank)
    made: dict[str, Trajectory] = {}
    notes: list[str] = []
    if trials and craft.fins:
        trim = level_trim(model, craft.speed)
        neutral = model if trim.holds else ballasted(model)
        if not trim.holds:
            notes.append(f"Ballasted to neutral for its trials: {trim.why}.")
        for name in trials:
            trial, remarks = _carried_out(neutral, name)
            notes += remarks
            if trial is not None:
                made[name] = trial
                notes += [note for note in trial.provenance.get("notes", []) if note.startswith("Not trimmed")]
    return Evaluated(model, made, assess(model, tuple(made.values()), requirements=()), tuple(dict.fromkeys(notes)))


def model_of(craft: Craft, tank: FastTank | None = None) -> Model:
    """Model of ``craft`` from its standard plan towed in the fast tank. Variants of mass and CG share their tests.

    Raises
    ------
    TowtankError
        The tests or the fit failed.
    """
    return Model(craft, _derived(replace(craft, mass=_WEIGHTLESS), tank or FastTank()))


@lru_cache(maxsize=8)
def _derived(craft: Craft, tank: FastTank) -> Derivatives:
    """Derivatives of a craft. The water does not feel where the weight is: variants of mass and CG share them."""
    return with_straightening(derive(tow(standard_plan(craft), tank)), craft, tank)


def _carried_out(model: Model, name: str) -> tuple[Trajectory | None, list[str]]:
    """The trial, if it can be done, and what is to be said about it."""
    notes = []
    try:
        made = _RUN[name](model, True)
    except TrialError as error:
        notes.append(f"No pilot: {error}")
        if name == "heading_step":
            return None, notes
        try:
            made = _RUN[name](model, False)
        except TrialError as other:
            return None, [*notes, f"{name}: {other}"]
    if made.status != "done":
        notes.append(f"Trial {made.name} {made.status}.")
    return made, notes


def numbers(found: Evaluated) -> Numbers:
    """What a sweep lists of a craft: stability, the indices of its trials, its derivatives.

    ``<trial>.trimmed`` is 1 where the trial began in level trimmed flight, else 0: its indices then mix the manoeuvre
    with a change of pitch and depth.
    """
    verdict, model = found.verdict, found.model
    out: Numbers = {**_plane("h", verdict.horizontal), **_plane("v", verdict.vertical)}
    reversal = verdict.elevator_reversal_speed
    out["elevator_reversal_speed"] = (float("nan") if reversal is None else reversal, "m/s")
    for name, trial in found.trajectories.items():
        out[f"{name}.trimmed"] = (float(bool(trial.provenance["trim"]["level"])), "")
        out |= {f"{name}.{index}": (float(value), unit) for index, (value, unit) in trial.indices.items()}
    wide, slopes = primes(model.derivatives), origin_primes(model.derivatives)
    out |= {f"{name}'": (wide.get(name, 0.0), "") for name in DERIVATIVES}
    out |= {f"{name}'.origin": (slopes[name], "") for name in SLOPES if name in slopes}
    body = model.constants.body
    return out | {"mass": (body.m, "kg"), "cg_x": (body.xG, "m"), "cg_z": (body.zG, "m"), "buoyancy": (body.b, "kg")}


def _plane(letter: str, c: PlaneCriteria) -> Numbers:
    """Index G with its standard uncertainty and 5 and 95 % quantiles, growth of the least damped mode, P(stable)."""
    return {
        f"G_{letter}": (c.index, ""),
        f"G_{letter}_std": (c.index_std, ""),
        f"G_{letter}_low": (c.index_range[0], ""),
        f"G_{letter}_high": (c.index_range[1], ""),
        f"growth_{letter}": (max(s.real for s in c.eigenvalues), "1/s"),
        f"P_stable_{letter}": (c.probability, ""),
    }


def work(sweep: Sweep, point: tuple[float, ...]) -> dict[str, Any]:
    """The result of one point as plain content: values, units, notes.

    Raises
    ------
    TowtankError
        The variant cannot be built, or a stage failed.
    """
    found = evaluate(sweep.craft_at(point), sweep.tank, sweep.trials)
    listed = numbers(found)
    return {
        "values": {name: value for name, (value, _) in listed.items()},
        "units": {name: unit for name, (_, unit) in listed.items()},
        "notes": list(found.notes),
    }
