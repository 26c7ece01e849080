"""The craft: hull, fins, strakes, mass, propeller. Frozen data in SI.

Geometry runs from the nose aft; everything else is in body axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from towtank.frames import Array
from towtank.water import FRESH_25C, Water


class Profile(Protocol):
    """Meridian of a body of revolution."""

    @property
    def length(self) -> float:
        """Overall length [m]."""

    @property
    def kind(self) -> str:
        """Name of the family: myring, suboff, ellipsoid, offsets."""

    def radius(self, x: Array) -> Array:
        """Radius [m] at the distances ``x`` [m] aft of the nose, any shape; zero outside 0..length."""

    def __hash__(self) -> int:
        """Profiles are frozen data: integrals over them are kept by value."""


ACTUATOR = ("max_angle", "max_rate", "time_constant", "dead_band", "backlash")
"""Fields of a fin that are its actuator's: the water does not feel them."""


class Radial:
    """What stands out from the hull in a plane through its axis, at ``azimuth`` [rad]."""

    azimuth: float

    @property
    def span_direction(self) -> Array:
        """Outward unit vector (3,) in body axes."""
        return np.array([0.0, np.cos(self.azimuth), np.sin(self.azimuth)])

    @property
    def lift_direction(self) -> Array:
        """Unit vector (3,) normal to it, span x e_x: the sense of the lift of a positive deflection."""
        return np.array([0.0, np.sin(self.azimuth), -np.cos(self.azimuth)])


@dataclass(frozen=True)
class Fin(Radial):
    """One all-moving fin with a trapezoidal planform.

    The planform is given at two radii from the hull axis and extended linearly; what lies inside the hull does not
    count. ``azimuth`` [rad]: span direction (0, cos, sin): 0 starboard, 90 deg keel, 180 deg port, 270 deg deck.
    A positive deflection is right-handed about the outward span, so lift acts along span x e_x. ``sign`` is what
    turns the vehicle's own fin angle into that sense (+1 or -1).
    """

    name: str
    azimuth: float
    root_radius: float
    root_chord: float
    tip_radius: float
    tip_chord: float
    trailing_edge: float
    """Distance of the root trailing edge aft of the nose [m]."""
    trailing_edge_sweep: float = 0.0
    """Sweep of the trailing edge [rad], positive when the tip lies further aft."""
    section: str = "0012"
    """NACA four-digit symmetric section."""
    hinge: float = 0.5
    """Stock position as a fraction of the mean exposed chord behind the leading edge."""
    max_angle: float = np.radians(25.0)
    max_rate: float = np.radians(30.0)
    time_constant: float = 0.2
    dead_band: float = 0.0
    """Smallest change of the angle asked for that the actuator answers [rad]."""
    backlash: float = 0.0
    """Half the play between actuator and fin [rad]."""
    sign: float = 1.0

    @property
    def thickness(self) -> float:
        """Thickness-to-chord ratio of the section."""
        return int(self.section[-2:]) / 100.0

    @property
    def half_radius(self) -> float:
        """Half the tip radius [m]: the one section that stands for the fin, however its trapezoid is given."""
        return 0.5 * self.tip_radius

    def chord(self, y: Array | float) -> Array:
        """Chord [m] at the radius ``y`` [m] from the hull axis."""
        slope = (self.tip_chord - self.root_chord) / (self.tip_radius - self.root_radius)
        return np.asarray(self.root_chord + slope * (np.asarray(y, dtype=float) - self.root_radius))

    def trailing_edge_at(self, y: Array | float) -> Array:
        """Distance of the trailing edge aft of the nose [m] at the radius ``y`` [m]."""
        return np.asarray(
            self.trailing_edge + np.tan(self.trailing_edge_sweep) * (np.asarray(y, dtype=float) - self.root_radius)
        )


@dataclass(frozen=True)
class Strake(Radial):
    """A long thin plate fixed to the hull along its axis, with square ends.

    ``azimuth`` [rad] as for a fin.   start, end : distances aft of the nose [m].   height, end_height : what stands
    out of the hull at the start and at the end [m], linear between.   thickness [m].
    """

    name: str
    azimuth: float
    start: float
    end: float
    height: float
    end_height: float
    thickness: float

    @property
    def length(self) -> float:
        """Length along the axis [m]."""
        return self.end - self.start

    @property
    def area(self) -> float:
        """Area of one face outside the hull [m2]."""
        return 0.5 * (self.height + self.end_height) * self.length

    def height_at(self, x: Array | float) -> Array:
        """Height [m] outside the hull at the distances ``x`` [m] aft of the nose, any shape; zero beyond the ends."""
        x = np.asarray(x, dtype=float)
        share = (x - self.start) / self.length
        height = self.height + (self.end_height - self.height) * share
        return np.where((share >= 0.0) & (share <= 1.0), height, 0.0)


@dataclass(frozen=True)
class Mass:
    """Rigid body and buoyancy.

    ``mass`` and ``displaced_mass`` [kg], ``cg`` (3,) [m] from the origin, ``inertia`` (3, 3) [kg m2] about the origin
    (the tensor: off-diagonal entries are minus the products of inertia).
    """

    mass: float
    displaced_mass: float
    cg: tuple[float, float, float]
    inertia: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Propeller:
    """Thruster. Without a table the thrust is the resistance at the commanded speed, held in the manoeuvre.

    ``table``: rows (J, KT, KQ). ``wake`` and ``thrust_deduction`` are fractions; ``position`` [m] aft of the nose.
    ``torque``: sense of the propeller torque on the hull, +1 or -1; 0 switches it off.
    """

    diameter: float = 0.0
    position: float = 0.0
    wake: float = 0.0
    thrust_deduction: float = 0.0
    table: tuple[tuple[float, float, float], ...] = ()
    torque: float = 0.0


@dataclass(frozen=True)
class Craft:
    """A craft as tested.

    ``origin_from_nose`` [m]: the body origin (the centre of buoyancy unless the file says otherwise).
    ``assumed``: dotted names of the numbers the file marks as assumed. ``unsourced``: those without a source.
    ``sources``: dotted name of a table or number -> source text.
    """

    name: str
    profile: Profile
    fins: tuple[Fin, ...]
    mass: Mass
    origin_from_nose: float
    speed: float
    water: Water = FRESH_25C
    propeller: Propeller = field(default_factory=Propeller)
    title: str = ""
    assumed: tuple[str, ...] = ()
    unsourced: tuple[str, ...] = ()
    sources: tuple[tuple[str, str], ...] = ()
    strakes: tuple[Strake, ...] = ()

    @property
    def length(self) -> float:
        """Overall length [m]."""
        return self.profile.length

    @cached_property
    def diameter(self) -> float:
        """Largest hull diameter [m]."""
        return float(2.0 * np.max(self.profile.radius(np.linspace(0.0, self.length, 4001))))

    @cached_property
    def reach(self) -> float:
        """Largest distance of hull, fins and strakes from the axis [m]."""
        x = np.linspace(0.0, self.length, 2001)
        tips = [float(np.max((self.profile.radius(x) + s.height_at(x))[s.height_at(x) > 0.0])) for s in self.strakes]
        return max([0.5 * self.diameter, *(fin.tip_radius for fin in self.fins), *tips])

    @cached_property
    def mixing(self) -> Array:
        """Fin angles (n_fins,) = mixing (n_fins, 3) @ (rudder, elevator, aileron).

        Built so that +rudder gives +Y, +elevator gives -Z, +aileron gives +K, and a unit virtual angle is a unit
        angle of the fin that moves most; the columns are the least-norm solution, so an odd layout is decoupled.

        Source     THEORY section 5; for four X fins it is the matrix printed there.
        """
        if not self.fins:
            return np.zeros((0, 3))
        azimuth = np.array([fin.azimuth for fin in self.fins])
        effect = np.stack([np.sin(azimuth), np.cos(azimuth), -np.ones_like(azimuth)])
        columns = np.linalg.pinv(effect)
        peak = np.abs(columns).max(axis=0)
        return np.asarray(columns / np.where(peak > 1e-9, peak, 1.0))

    def virtual(self, delta: Array) -> Array:
        """Virtual (rudder, elevator, aileron, sum of squares) (N, 4) of fin angles ``delta`` (N, n_fins) [rad]."""
        delta = np.atleast_2d(delta)
        if not self.fins:
            return np.zeros((len(delta), 4))
        return np.concatenate([delta @ np.linalg.pinv(self.mixing).T, (delta**2).sum(axis=1, keepdims=True)], axis=1)

    @cached_property
    def symmetry(self) -> str:
        """``fourfold``, ``mirror`` (both planes), ``port-starboard`` or ``none``, from fins and strakes alone."""

        def around(item: Radial) -> float:
            return float(round(np.degrees(item.azimuth) % 360.0, 6) % 360.0)

        shapes: set[tuple[Any, ...]] = {
            (around(fin), fin.root_radius, fin.root_chord, fin.tip_radius,
             fin.tip_chord, fin.trailing_edge, fin.trailing_edge_sweep, fin.section)
            for fin in self.fins
        }  # fmt: skip
        shapes |= {(around(s), s.start, s.end, s.height, s.end_height, s.thickness) for s in self.strakes}

        def kept(turn: float, flip: float) -> bool:
            return {(round((turn + flip * s[0]) % 360.0, 6) % 360.0, *s[1:]) for s in shapes} == shapes

        if kept(90.0, 1.0):
            return "fourfold"
        port, deck = kept(180.0, -1.0), kept(0.0, -1.0)
        return "mirror" if port and deck else "port-starboard" if port else "none"
