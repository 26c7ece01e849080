"""One point of a design study: a variant towed in the fast tank, its stability, its drag and what that costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.craft.hydrostatics import check, hydrostatics
from towtank.design.needs import needed
from towtank.design.power import drive_of, electrical_power
from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import elevator_reversal_speed
from towtank.plan.kinds import CaptiveTest
from towtank.plan.motion import Drift
from towtank.progress import Silent
from towtank.quantity import Quantity
from towtank.sweep.point import Numbers, evaluate, model_of
from towtank.sweep.vary import KINDS, vary
from towtank.tank.fast.tank import FastTank
from towtank.verdict.criteria import horizontal_matrix, index, samples, vertical_matrix
from towtank.verdict.needs import Need

TRIALS = ("turning_circle", "zigzag")
"""Trials of the points that the study names: the craft as given, and its candidates."""
SHOWN_OF_TRIALS = (
    "turning_circle.tactical_diameter_lengths", "zigzag.first_overshoot", "turning_circle.trimmed", "zigzag.trimmed",
)  # fmt: skip
Changes = tuple[tuple[str, float], ...]
"""Names of axes and values [SI], sorted by name; empty for the craft as given."""


@dataclass(frozen=True)
class Question:
    """What all points of a study share.

    target : probability of stability for the smooth columns.   members : of the tank's ensemble.
    efficiency : overall, None for what is known or assumed.   hotel : power of everything but propulsion [W].
    needs : requirements whose numbers are wanted.
    """

    craft: Craft
    target: float
    members: int = 48
    efficiency: float | None = None
    hotel: float = 0.0
    needs: tuple[Need, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what gives no probability.

        Raises
        ------
        InputError
            An ensemble of one, or of more than a thousand.
        """
        if self.members != 0 and not 2 <= self.members <= 1000:
            raise InputError(
                f"members {self.members}: an ensemble has 2 to 1000 members, or 0 for none; P(stable) then holds the "
                "uncertainty of the fit alone."
            )

    @property
    def tank(self) -> FastTank:
        """The tank of every point."""
        return FastTank(members=self.members)

    def craft_at(self, changes: Changes) -> Craft:
        """The variant.

        Raises
        ------
        InputError
            It cannot be built.
        """
        given: dict[str, Quantity] = {
            name: f"{value!r} rad" if KINDS[name].unit == "rad" else value for name, value in changes
        }
        return vary(self.craft, **given)


def work(question: Question, changes: Changes) -> dict[str, Any]:
    """The numbers of one point as plain content: values and units.

    Raises
    ------
    TowtankError
        The variant cannot be built, or a stage failed.
    """
    craft = question.craft_at(changes)
    model = model_of(craft, question.tank)
    numbers = {**_stability(model, question.target), **_costs(model, question), **_shape(craft)}
    return _content({**numbers, **needed(model, question.needs)})


def work_with_trials(question: Question, changes: Changes) -> dict[str, Any]:
    """Indices of a turning circle and a zigzag of one point, and what is to be remarked on its fins and strakes.

    Raises
    ------
    TowtankError
        As in ``work``.
    """
    found = evaluate(question.craft_at(changes), question.tank, TRIALS)
    listed: Numbers = {}
    for name, trial in found.trajectories.items():
        listed[f"{name}.trimmed"] = (float(bool(trial.provenance["trim"]["level"])), "")
        listed |= {f"{name}.{key}": (float(value), unit) for key, (value, unit) in trial.indices.items()}
    remarks = [f.message for f in check(found.model.craft).findings if f.where in ("fins", "strake")]
    return _content({key: listed[key] for key in SHOWN_OF_TRIALS if key in listed}, (*found.notes, *remarks))


def _content(numbers: Numbers, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        "values": {name: value for name, (value, _) in numbers.items()},
        "units": {name: unit for name, (_, unit) in numbers.items()},
        "notes": list(notes),
    }


def _stability(model: Model, target: float) -> Numbers:
    """P(stable), G, and the growth that the share ``target`` of the sampled derivatives stays below, in both planes."""
    slopes = "origin" if model.derivatives.origin else "wide"
    drawn, speed = samples(model, slopes=slopes), model.craft.speed
    out: Numbers = {}
    for letter, plane, matrix in (("h", "horizontal", horizontal_matrix), ("v", "vertical", vertical_matrix)):
        growth = np.linalg.eigvals(matrix(model, drawn, speed)).real.max(axis=1)
        G: Array = index(model, drawn, plane)
        out[f"P_stable_{letter}"] = (float(np.mean(growth[1:] < 0.0)), "")
        out[f"G_{letter}"] = (float(G[0]), "")
        out[f"growth_{letter}"] = (float(growth[0]), "1/s")
        # The next larger of the sample: its sign says the same as P >= target, and it moves without steps.
        out[f"growth_{letter}_quantile"] = (float(np.quantile(growth[1:], target, method="higher")), "1/s")
    out["P_stable"] = (min(out["P_stable_h"][0], out["P_stable_v"][0]), "")
    reversal = elevator_reversal_speed(model, slopes)
    out["elevator_reversal_speed"] = (float("nan") if reversal is None else reversal, "m/s")
    return out


def _costs(model: Model, question: Question) -> Numbers:
    """Resistance straight ahead with its parts, electrical power and energy per metre at the design speed."""
    craft = model.craft
    speed = craft.speed
    run = question.tank.run(craft, CaptiveTest("straight", speed, Drift(speed, 0.0)), Silent())
    drag, drive = -float(model.constants.c.Xuu) * speed * speed, drive_of(model, question.efficiency)
    power = electrical_power(model, drive, drag, float(model.thrust(speed)), speed)
    parts = {name: -float(load[0, 0]) for name, load in run.parts.items()}
    own = parts.get("fins", 0.0) + parts.get("strakes", 0.0)
    return {
        "drag": (drag, "N"),
        "drag_fins": (parts.get("fins", 0.0), "N"),
        "drag_strakes": (parts.get("strakes", 0.0), "N"),
        "drag_hull": (-float(run.loads[0, 0]) - own, "N"),
        "propulsion_power": (power, "W"),
        "energy_per_metre": ((power + question.hotel) / speed, "J/m"),
    }


def _shape(craft: Craft) -> Numbers:
    h = hydrostatics(craft)
    aspects = [2.0 * s.area / s.length**2 for s in craft.strakes]
    return {
        "reach": (craft.reach, "m"),
        "strake_aspect": (max(aspects, default=0.0), ""),
        "tilt_at_rest": (float(np.degrees(abs(h.trim))), "deg"),
    }
