"""What a mapping says of one run: which columns, in which axes, about which point, of which motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from towtank.frames import Array
from towtank.plan.motion import KINDS
from towtank.symbols import LOADS, RATES

SCHEMA = "towtank/import/1"

FORMATS = ("star", "openfoam", "csv", "netcdf", "mat")
LEVELS = ("rans", "experiment", "published", "semi-empirical", "known coefficients")
FRAMES = ("body", "inertial")
FIXED = ("body", "carriage", "water")
"""What a moment point is fixed in."""

MEASURED = ("water on craft", "craft on balance", "balance on craft")
INCLUDES = ("weight", "buoyancy", "inertia")
PLACES = ("carriage", "water")
"""What positions in a file are relative to."""

STEADY = ("drift", "incidence", "turn")
"""Kinds of motion that hold one condition."""

MOTION_KINDS = (*KINDS, "free")
"""Kinds of motion; ``free`` is any other, given by columns."""

COLUMN_UNITS: dict[str, str] = {
    "time": "s",
    **{name: "N" if name in "XYZ" else "N*m" for name in LOADS},
    **{name: "m/s" if name in "uvw" else "rad/s" for name in RATES},
    **{f"{name}dot": "m/s^2" if name in "uvw" else "rad/s^2" for name in RATES},
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("phi", "theta", "psi"), "rad"),
}
"""What a mapping may name a column for -> SI unit. All along and about the axes of the file."""


@dataclass(frozen=True)
class Column:
    """Where a quantity stands in a file. ``unit`` is empty where the file says it; ``factor`` is for odd signs."""

    name: str
    unit: str = ""
    factor: float = 1.0


@dataclass(frozen=True)
class MomentPoint:
    """The point of the moments, in the scale of the file.

    about_origin : it is the body origin.
    from_nose [m], y, z [m] : on or off the axis, body axes.
    point, nose (3,) [m] : the point, and the nose of the craft at displacement zero, in coordinates of the file; the
        point is that of the file's header where it is None.
    fixed : what the point is fixed in: the body, the carriage, or the water.
    """

    about_origin: bool = False
    from_nose: float | None = None
    y: float = 0.0
    z: float = 0.0
    point: tuple[float, float, float] | None = None
    nose: tuple[float, float, float] | None = None
    fixed: str = "body"


@dataclass(frozen=True)
class Body:
    """Rigid body on the balance, in the scale of the file.

    mass, displaced_mass [kg]; cg, cb (3,) [m] from the body origin, body axes; inertia (3, 3) [kg m2] about the origin.
    """

    mass: float
    displaced_mass: float
    cg: tuple[float, ...]
    cb: tuple[float, ...]
    inertia: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Motion:
    """What the body did, in the scale of the file.

    kind : of MOTION_KINDS.   numbers : amplitude, frequency, angle, drift, rate, as in a plan [SI].
    phase [rad] : of the sinusoid at time zero of the file.   columns : the motion is taken from columns.
    place : what the positions in columns are relative to.
    """

    kind: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    phase: float = 0.0
    columns: bool = False
    place: str = "carriage"


@dataclass(frozen=True)
class Window:
    """Part of the record that is used: from start to end [s, or iterations]; last : share at its end."""

    start: float = -math.inf
    end: float = math.inf
    last: float | None = None


@dataclass(frozen=True)
class Scale:
    """The file is of a model ``length`` times smaller than the craft; loads are wanted at ``speed`` [m/s]."""

    length: float
    speed: float


@dataclass(frozen=True)
class Spec:
    """One run of a mapping.

    density [kg/m3] : of the water that the loads of the file were made with.   speed [m/s] : its reference speed.
    """

    name: str
    files: tuple[Path, ...]
    format: str
    level: str
    speed: float
    density: float
    motion: Motion
    moment: MomentPoint
    axes: tuple[str, str, str]
    columns: Mapping[str, Column] = field(default_factory=dict)
    frame: str = "body"
    measured: str = "water on craft"
    includes: tuple[str, ...] = ()
    body: Body | None = None
    half_model: str = ""
    absent: tuple[str, ...] = ()
    scale: Scale | None = None
    fins: tuple[float, ...] = ()
    window: Window = field(default_factory=Window)
    mesh: Mapping[str, str | int] = field(default_factory=dict)
    sum: bool = False
    exploratory: bool = False

    @property
    def steady(self) -> bool:
        """True when one condition is held."""
        return self.motion.kind in STEADY

    @property
    def delta(self) -> Array:
        """Fin angles (n_fins,) [rad]."""
        return np.array(self.fins, dtype=float)
