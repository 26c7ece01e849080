"""From a model and its trials to a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from towtank.errors import TowtankError
from towtank.model.equations import Model
from towtank.model.linear import elevator_reversal_speed, linearise
from towtank.pilot.design import design_pilot, elevator_authority
from towtank.pilot.law import Pilot
from towtank.provenance import provenance
from towtank.trials.circle import circle_ready
from towtank.trials.ready import Ready, run_trial
from towtank.trials.start import ballasted, fin_limit, level_trim, slowest_level_speed
from towtank.trials.trajectory import Trajectory
from towtank.verdict.compare import comparison, notes
from towtank.verdict.criteria import index, plane_criteria, samples
from towtank.verdict.evidence import Evidence
from towtank.verdict.fins import FinUse, fin_use
from towtank.verdict.judge import judge
from towtank.verdict.many import Population, drawn
from towtank.verdict.measures import MEASURES
from towtank.verdict.needs import Need, standard_requirements
from towtank.verdict.speeds import speed_sweep
from towtank.verdict.spread import nearest_quantiles
from towtank.verdict.table import Criterion, Requirement, Verdict
from towtank.verdict.words import sentences

__all__ = ["Verdict", "assess"]


def assess(
    model: Model,
    trajectories: Sequence[Trajectory] = (),
    requirements: Sequence[Need] | None = None,
    population: Population | None = None,
    ready: Sequence[tuple[Model, Ready]] | None = None,
) -> Verdict:
    """Stability of both planes, what the fins can do, what the pilot gains and costs, and what is met, at the speed.

    Parameters
    ----------
    trajectories : trials of this craft, for the comparison of open with closed loop; may be empty.
    requirements : from ``read_requirements``; the standard set when left out, as far as there are numbers for it. An
        empty sequence leaves out all that takes time: requirements, criteria, eigenvalues against speed, use of fins.
    population : the drawn craft, ``monte_carlo(model).population``. When left out, craft are drawn from the uncertainty
        of the derivatives; they fly nothing, so that requirements on trials get no probability.
    ready : the trials, ready to fly, for what drives their indices; the standard set when left out.

    Raises
    ------
    TowtankError
        A trajectory or the population is of another craft.
    InputError
        A requirement that cannot be put to this craft.
    """
    foreign = [t.name for t in trajectories if t.craft != model.craft.name]
    if foreign:
        raise TowtankError(
            f"assess {model.craft.name}: trial {foreign[0]} is of another craft. Give trials of this craft only."
        )
    speed, population = model.craft.speed, population or drawn(model)
    needs = standard_requirements() if requirements is None else requirements
    evidence = Evidence(model, population, trajectories, ready)
    pilot, checks = _checks(model, speed)
    judged, together = judge(needs, evidence)
    fins = _fins(model, trajectories, pilot) if needs else ()
    verdict = Verdict(
        craft=model.craft.name,
        level=model.derivatives.level,
        speed=speed,
        horizontal=plane_criteria(model, "horizontal", speed, population),
        vertical=plane_criteria(model, "vertical", speed, population),
        elevator_reversal_speed=elevator_reversal_speed(model, population.craft.slopes),
        effectiveness=effectiveness(model, speed),
        requirements=(*judged, *checks),
        comparison=comparison(trajectories, fins),
        dominant=dominant_terms(model),
        notes=notes(trajectories),
        provenance=provenance(trials=[t.name for t in trajectories], samples=population.count),
        criteria=_criteria(evidence) if needs else (),
        against_speed=speed_sweep(population.craft) if needs else None,
        fins=fins,
        together=together,
        drawn=f"{population.count} craft drawn from {population.words}",
    )
    return replace(verdict, words=sentences(verdict))


def effectiveness(model: Model, speed: float) -> dict[str, tuple[float, str]]:
    """What a degree of rudder, elevator and aileron does at ``speed`` [m/s]; SNAME signs.

    Source     The linear model; steady values with the other controls at rest.
    """
    if not model.craft.fins:
        return {}
    linear = linearise(model, speed)
    B, states = linear.B, linear.states
    out = {
        "yaw_acceleration_per_rudder": (float(B[states.index("r"), 0]), "1/s2"),
        "pitch_acceleration_per_elevator": (float(B[states.index("q"), 1]), "1/s2"),
        "roll_acceleration_per_aileron": (float(B[states.index("p"), 2]), "1/s2"),
        "depth_rate_per_elevator": (float(np.radians(elevator_authority(linear, speed))), "m/s per deg"),
    }
    plane = linear.part(("v", "r"), ("rudder",))
    if plane.eigenvalues.real.max() < 0.0:
        steady = -np.linalg.solve(plane.A, plane.B[:, 0])
        out["yaw_rate_per_rudder"] = (float(steady[1]), "1/s")
    return out


def dominant_terms(model: Model, count: int = 2) -> tuple[tuple[str, float], ...]:
    """The derivatives whose own uncertainty spreads the horizontal index most, with their share of its variance.

    Source     First-order sum of squares: each term moved by one standard uncertainty, correlations left out.
    """
    slopes = "origin" if model.derivatives.origin else "wide"
    varied = samples(model, slopes=slopes)
    best = {name: values[:1] for name, values in varied.items()}
    centre = float(index(model, best, "horizontal")[0])
    effect = {}
    for name in ("Yuv", "Nuv", "Yur", "Nur"):
        if name in varied:
            moved = {**best, name: best[name] + float(np.std(varied[name][1:]))}
            effect[name] = (float(index(model, moved, "horizontal")[0]) - centre) ** 2
    total = sum(effect.values())
    if not np.isfinite(total) or total <= 0.0:
        return ()
    ranked = sorted(effect.items(), key=lambda item: -item[1])
    return tuple((name, share / total) for name, share in ranked[:count])


def _criteria(evidence: Evidence) -> tuple[Criterion, ...]:
    """Every measure that this craft has, with its interval over the drawn craft."""
    out = []
    for name, of in MEASURES.items():
        values = evidence.measure(name)
        if not np.isnan(values).all():
            low, high = nearest_quantiles(values[1:])
            out.append(Criterion(name, float(values[0]), of.unit, low, high, of.words))
    return tuple(out)


def _fins(model: Model, trajectories: Sequence[Trajectory], pilot: Pilot | None) -> tuple[FinUse, ...]:
    """Use of the fins in each trial, and in a circle at the largest rudder; none without trials or fins."""
    if not trajectories or not model.craft.fins:
        return ()
    flown = list(trajectories)
    hardest = model if level_trim(model, model.craft.speed).holds else ballasted(model)
    circle = circle_ready(hardest, fin_limit(model), hold_depth=pilot is not None, pilot=pilot)
    if circle.name not in {t.name for t in flown}:
        flown.append(run_trial(hardest, circle))
    return tuple(fin_use(model, trial) for trial in flown)


def _checks(model: Model, speed: float) -> tuple[Pilot | None, tuple[Requirement, ...]]:
    """The pilot, if one can be designed, and what any craft with fins has to do before a limit means something."""
    if not model.craft.fins:
        return None, ()
    trim = level_trim(model, speed)
    slowest = None if trim.holds else slowest_level_speed(model)
    remedy = "" if trim.holds else (
        f"; it can from {slowest:.2f} m/s on, or when ballasted" if slowest else "; ballast it"
    )  # fmt: skip
    level = Requirement(
        "level flight", speed, "m/s", slowest or speed, trim.holds, f"{trim.why}{remedy}".lstrip("; ")
    )  # fmt: skip
    try:
        pilot = design_pilot(model if trim.holds else ballasted(model), speed)
    except TowtankError as error:
        return None, (level, Requirement("pilot stable", float("nan"), "1/s", 0.0, False, str(error)))
    growth = max(s.real for values in pilot.eigenvalues.values() for s in values)
    return pilot, (level, Requirement("pilot stable", growth, "1/s", 0.0, growth < 0.0, " ".join(pilot.notes)))
