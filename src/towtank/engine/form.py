"""Which text of the equations a craft needs, and the names of the numbers it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from types import SimpleNamespace
from typing import Any

from towtank.model.equations import Constants, Model
from towtank.model.extra import ExtraLoad
from towtank.model.fins import Bend, FinSet
from towtank.model.options import ModelOptions
from towtank.model.rigid_body import Body
from towtank.model.thrust import Screw
from towtank.pilot.allocation import Allocation, Damage
from towtank.pilot.law import GAINS
from towtank.symbols import LOADS, OPTIONAL, RATES, STANDING, TERMS

SHIPPED_FINS = 4
"""Fins of the compiled forms; a craft with fewer gets fins without effect beside its own."""
SHIPPED_ROWS = 8
"""Rows of the propeller tables of the compiled forms; a shorter table is carried on with zero slopes."""

BODY = tuple(field.name for field in fields(Body))
ADDED = tuple(f"{load}{rate}dot" for load in LOADS for rate in RATES)
OPTIONALS = tuple(name for group in OPTIONAL.values() for name in group)
DAMPING = tuple(name for name in STANDING if not TERMS[name].is_added_mass)
BY_FIN = (
    "station", "max_angle", "max_rate", "time_constant", "dead_band", "backlash", "effect", "stuck", "stuck_angle",
)  # fmt: skip
"""Numbers of each fin."""
PLAY = ("dead_band", "backlash")
BEND = tuple(field.name for field in fields(Bend))
INFLOW = ("kappa_v", "kappa_r", "apart")
_SCREW = ("density", "diameter", "wake", "deduction", "torque", "force_per_square")


@dataclass(frozen=True)
class Form:
    """What decides the text of the equations; everything else is a parameter.

    fins : number of fins.   split : variant of the derivatives.   axisymmetric : option of the model.
    damaged : the pilot knows of faults of the fins and shares its command among those that are left.
    optional : terms of ``symbols.OPTIONAL`` take part.
    rows : knots of the propeller's table, 0 for constant thrust.   extra : a user's own load.
    """

    fins: int = SHIPPED_FINS
    split: bool = False
    axisymmetric: bool = False
    damaged: bool = False
    rows: int = 0
    extra: ExtraLoad | None = None
    optional: bool = False

    @property
    def damping(self) -> tuple[str, ...]:
        """Names of the damping and fin coefficients that take part."""
        return (*DAMPING, *OPTIONALS) if self.optional else DAMPING

    @property
    def shipped(self) -> bool:
        """True for the forms that are compiled at install."""
        return (
            self.fins == SHIPPED_FINS
            and self.rows in (0, SHIPPED_ROWS)
            and not (self.axisymmetric or self.extra or (self.damaged and (self.split or self.optional)))
            and not (self.optional and self.split)
        )

    @property
    def smooth(self) -> bool:
        """True where derivatives along a run are compiled too; sharing among damaged fins is a search that has none."""
        return not self.damaged

    @property
    def word(self) -> str:
        """Short name, for files."""
        parts = [
            "split" if self.split else "lumped",
            f"{self.fins}fins",
            f"screw{self.rows}" if self.rows else "",
            "axisymmetric" if self.axisymmetric else "",
            "damaged" if self.damaged else "",
            "optional" if self.optional else "",
            self.extra.name if self.extra else "",
        ]
        return "-".join(part for part in parts if part)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order; the last 36 are the inverse of the mass matrix, row by row."""
        n = range(self.fins)
        out = [*BODY, *self.damping, *ADDED, "thrust", "current_north", "current_east", "current_down"]
        out += [f"mixing{i}{j}" for i in n for j in range(3)] + [f"unmixing{j}{i}" for j in range(3) for i in n]
        out += [f"{word}{i}" for word in BY_FIN for i in n] + ["fin_share"]
        out += [*(f"lift{i}{j}" for i in n for j in range(2)), *(f"fin_{word}" for word in BEND), *INFLOW]
        if self.rows:
            out += [f"screw_{name}" for name in _SCREW] + [f"screw_knot{i}" for i in range(self.rows)]
            out += [f"screw_{c}{i}" for c in ("kt", "kq") for i in range(self.rows)]
        out += [f"extra_{name}" for name in (self.extra.values if self.extra else ())]
        out += [f"pilot_{name}" for name in GAINS]
        return (*out, *(f"inverse{i}{j}" for i in range(6) for j in range(6)))

    @cached_property
    def place(self) -> dict[str, int]:
        """Name -> place in the vector of parameters."""
        return {name: i for i, name in enumerate(self.names)}


SHIPPED = tuple(
    Form(split=split, rows=rows, optional=optional, damaged=damaged)
    for split, optional, damaged in (
        (False, False, False), (True, False, False), (False, True, False), (False, False, True),
    )
    for rows in (0, SHIPPED_ROWS)
)  # fmt: skip
"""The forms compiled at install."""


def form_of(model: Model) -> Form:
    """The form of ``model``; the shipped one where padding leads to it."""
    k = model.constants
    fins, rows = len(k.fins.station), len(k.screw.kt.knots) if k.screw else 0
    return Form(
        fins=max(fins, SHIPPED_FINS),
        split=k.split,
        axisymmetric=k.options.axisymmetric_crossflow,
        damaged=bool(k.options.faults and k.options.faults_known),
        rows=max(rows, SHIPPED_ROWS) if rows else 0,
        extra=k.extra,
        optional=k.optional,
    )


@dataclass(frozen=True)
class System:
    """The parameters of the closed loop in their places: numbers, arrays or symbols."""

    constants: Constants
    pilot: Any
    thrust: Any
    current: Sequence[Any]
    fin_share: Any
    damaged: bool = False

    @property
    def tail(self) -> Allocation:
        """The fins as the pilot knows them."""
        fins = self.constants.fins
        if not self.damaged:
            return Allocation(fins.mixing, fins.max_angle)
        columns = [[e * share for e, share in zip(row, fins.effect, strict=True)] for row in fins.unmixing]
        return Allocation(fins.mixing, fins.max_angle, Damage(columns, fins.stuck, fins.stuck_angle))


def system(form: Form, p: Sequence[Any]) -> System:
    """The parameters ``p`` (in the order of ``form.names``) where the equations want them."""
    at, n = form.place, range(form.fins)

    def one(name: str) -> Any:
        return p[at[name]]

    def row(word: str, count: int) -> tuple[Any, ...]:
        return tuple(one(f"{word}{i}") for i in range(count))

    fins = FinSet(
        mixing=[list(row(f"mixing{i}", 3)) for i in n],
        unmixing=[list(row(f"unmixing{j}", form.fins)) for j in range(3)],
        lift=[list(row(f"lift{i}", 2)) for i in n],
        **{word: row(word, form.fins) for word in BY_FIN},
        bend=Bend(*(one(f"fin_{word}") for word in BEND)),
        **{word: one(word) for word in INFLOW},
    )
    constants = Constants(
        body=Body(*(one(name) for name in BODY)),
        c=SimpleNamespace(**{name: one(name) for name in form.damping}),
        added=[[one(f"{load}{rate}dot") for rate in RATES] for load in LOADS],
        mass_inverse=[list(row(f"inverse{i}", 6)) for i in range(6)],
        fins=fins,
        screw=_screw(form, one, row) if form.rows else None,
        split=form.split,
        options=ModelOptions(axisymmetric_crossflow=form.axisymmetric),
        extra=form.extra and form.extra.with_values({name: one(f"extra_{name}") for name in form.extra.values}),
        optional=form.optional,
    )
    current = [one(f"current_{way}") for way in ("north", "east", "down")]
    pilot = SimpleNamespace(**{name: one(f"pilot_{name}") for name in GAINS})
    return System(constants, pilot, one("thrust"), current, one("fin_share"), form.damaged)


def _screw(form: Form, one: Any, row: Any) -> Screw:
    from towtank.model.algebra import Table

    knots = row("screw_knot", form.rows)
    tables: dict[str, Any] = {}
    for word in ("kt", "kq"):
        first, *slopes = row(f"screw_{word}", form.rows)
        tables[word] = Table(knots, first, tuple(slopes))
    numbers: dict[str, Any] = {name: one(f"screw_{name}") for name in _SCREW}
    return Screw(**numbers, **tables)
