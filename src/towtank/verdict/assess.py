"""From a model and its trials to a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from towtank.errors import TowtankError
from towtank.model.equations import Model
from towtank.model.linear import elevator_reversal_speed, linearise
from towtank.pilot.design import design_pilot, elevator_authority
from towtank.provenance import provenance
from towtank.trials.start import ballasted, level_trim, slowest_level_speed
from towtank.trials.trajectory import Trajectory
from towtank.verdict.criteria import SAMPLES, PlaneCriteria, index, plane_criteria, samples
from towtank.verdict.table import Comparison, Requirement, Verdict
from towtank.verdict.words import sentences

__all__ = ["Verdict", "assess"]


def assess(model: Model, trajectories: Sequence[Trajectory] = ()) -> Verdict:
    """Stability of both planes, what the fins can do, and what the pilot gains and costs, at the craft's speed.

    Parameters
    ----------
    trajectories : trials of this craft, for the comparison of open with closed loop; may be empty.

    Raises
    ------
    TowtankError
        A trajectory is of another craft.
    """
    foreign = [t.name for t in trajectories if t.craft != model.craft.name]
    if foreign:
        raise TowtankError(
            f"assess {model.craft.name}: trial {foreign[0]} is of another craft. Give trials of this craft only."
        )
    speed = model.craft.speed
    slopes = "origin" if model.derivatives.origin else "wide"
    horizontal = plane_criteria(model, "horizontal", speed)
    vertical = plane_criteria(model, "vertical", speed)
    reversal = elevator_reversal_speed(model, slopes)
    verdict = Verdict(
        craft=model.craft.name,
        level=model.derivatives.level,
        speed=speed,
        horizontal=horizontal,
        vertical=vertical,
        elevator_reversal_speed=reversal,
        effectiveness=effectiveness(model, speed),
        requirements=_requirements(model, speed, horizontal, vertical, reversal),
        comparison=comparison(trajectories),
        dominant=dominant_terms(model),
        notes=_notes(trajectories),
        provenance=provenance(trials=[t.name for t in trajectories], samples=SAMPLES),
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


def comparison(trajectories: Sequence[Trajectory]) -> tuple[Comparison, ...]:
    """Open- against closed-loop numbers of the trials at hand: course, overshoot, depth, effort of the fins."""
    straight, zigzag = _first(trajectories, "straight run"), _first(trajectories, "zigzag, horizontal")
    heading, mission = _first(trajectories, "heading step"), _first(trajectories, "lawnmower")
    depth, survey = _first(trajectories, "depth step"), mission or heading
    rows = []
    if straight and heading:
        rows.append(_row("course held", straight, "heading_change", heading, "last_error", "deg"))
    if zigzag and heading:
        rows.append(_row("overshoot", zigzag, "first_overshoot", heading, "overshoot", "deg"))
    if straight and depth:
        rows.append(_row("depth held", straight, "depth_change", depth, "last_error", "m"))
    if survey:
        base = zigzag or straight
        for name, key, unit in (
            ("fin effort", "fin_rms", "deg"),
            ("fin travel", "fin_travel", "deg/m"),
            ("fin saturation", "fin_saturation", "%"),
        ):
            rows.append(_row(name, base, key, survey, key, unit))
    return tuple(rows)


def dominant_terms(model: Model, count: int = 2) -> tuple[tuple[str, float], ...]:
    """The derivatives whose own uncertainty spreads the horizontal index most, with their share of its variance.

    Source     First-order sum of squares: each term moved by one standard uncertainty, correlations left out.
    """
    slopes = "origin" if model.derivatives.origin else "wide"
    drawn = samples(model, slopes=slopes)
    best = {name: values[:1] for name, values in drawn.items()}
    centre = float(index(model, best, "horizontal")[0])
    effect = {}
    for name in ("Yuv", "Nuv", "Yur", "Nur"):
        if name in drawn:
            moved = {**best, name: best[name] + float(np.std(drawn[name][1:]))}
            effect[name] = (float(index(model, moved, "horizontal")[0]) - centre) ** 2
    total = sum(effect.values())
    if not np.isfinite(total) or total <= 0.0:
        return ()
    ranked = sorted(effect.items(), key=lambda item: -item[1])
    return tuple((name, share / total) for name, share in ranked[:count])


def _requirements(
    model: Model, speed: float, horizontal: PlaneCriteria, vertical: PlaneCriteria, reversal: float | None
) -> tuple[Requirement, ...]:
    out = [
        Requirement(
            f"{c.plane} plane stable, fins fixed", max(s.real for s in c.eigenvalues), "1/s", 0.0, c.stable,
            f"probability {100.0 * c.probability:.0f} % within the uncertainty of the derivatives",
        )
        for c in (horizontal, vertical)
    ]  # fmt: skip
    if not model.craft.fins:
        return tuple(out)
    if reversal is not None:
        out.append(
            Requirement(
                "speed above elevator reversal", speed / reversal, "", 1.1, speed > 1.1 * reversal,
                "a margin of 10 % for the speed lost in a turn",
            )
        )  # fmt: skip
    trim = level_trim(model, speed)
    slowest = None if trim.holds else slowest_level_speed(model)
    remedy = "" if trim.holds else (
        f"; it can from {slowest:.2f} m/s on, or when ballasted" if slowest else "; ballast it"
    )  # fmt: skip
    out.append(
        Requirement("level flight", speed, "m/s", slowest or speed, trim.holds, f"{trim.why}{remedy}".lstrip("; "))
    )
    try:
        pilot = design_pilot(model if trim.holds else ballasted(model), speed)
        growth = max(s.real for values in pilot.eigenvalues.values() for s in values)
        out.append(Requirement("pilot stable", growth, "1/s", 0.0, growth < 0.0, " ".join(pilot.notes)))
    except TowtankError as error:
        out.append(Requirement("pilot stable", float("nan"), "1/s", 0.0, False, str(error)))
    return tuple(out)


def _first(trajectories: Sequence[Trajectory], kind: str) -> Trajectory | None:
    return next((t for t in trajectories if t.kind == kind), None)


def _row(name: str, open_: Trajectory | None, key: str, closed: Trajectory, other: str, unit: str) -> Comparison:
    left = open_.indices.get(key, (float("nan"), unit))[0] if open_ else float("nan")
    right = closed.indices.get(other, (float("nan"), unit))[0]
    return Comparison(name, left, right, unit, f"{open_.name if open_ else 'no open-loop trial'} against {closed.name}")


def _notes(trajectories: Sequence[Trajectory]) -> tuple[str, ...]:
    """Trials that ended early, and what their notes repeat."""
    early = [f"Trial {t.name} {t.status}." for t in trajectories if t.status != "done"]
    shared = {note for t in trajectories for note in t.provenance.get("notes", []) if note.startswith("Ballasted")}
    moved = [note.replace("for this trial", "for its manoeuvring trials") for note in sorted(shared)]
    return (*early, *moved)
