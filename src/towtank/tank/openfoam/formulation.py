"""How a captive test is put to the solver: which equations, which frame, which half of the water."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from towtank.craft.craft import ACTUATOR, Craft
from towtank.errors import TankError
from towtank.frames import Array
from towtank.plan.kinds import CaptiveTest

AZIMUTH_TOLERANCE = 1e-6
"""Fins count as a mirror pair within this angle [rad], far below any tolerance of building."""

QUARTER = 0.5 * math.pi
"""The mesh is rolled by this angle [rad] for motions in the vertical plane, which then lie in its plane z = 0."""


@dataclass(frozen=True)
class Straight:
    """Steady straight run: the body at rest in body axes, the inflow turned. ``inflow`` (3,) [m/s] at the far field."""

    inflow: tuple[float, float, float]

    word = "straight"
    application = "simpleFoam"
    templates: ClassVar[tuple[str, ...]] = ("common", "steady", "straight")


@dataclass(frozen=True)
class Unsteady(Straight):
    """The same, solved in time from an impulsive start."""

    word = "unsteady"
    application = "pimpleFoam"
    templates = ("common", "unsteady", "straight", "at-rest")


@dataclass(frozen=True)
class Arm:
    """Steady turn of a rotating arm: a rotating frame, absolute velocity, water at rest far off.

    rate [rad/s] about z.   centre (2,) [m] : of the turn, in body axes.
    """

    rate: float
    centre: tuple[float, float]

    word = "arm"
    application = "simpleFoam"
    templates = ("common", "steady", "arm")


@dataclass(frozen=True)
class Moving:
    """Oscillation on a towed path: the whole mesh moves as a solid body in a stream of ``speed`` [m/s]."""

    speed: float

    word = "moving"
    application = "pimpleFoam"
    templates = ("common", "unsteady", "moving")


@dataclass(frozen=True)
class StillWater:
    """Oscillation faster than the tow: the mesh carries the whole motion, through water at rest.

    ``speed`` [m/s] is the tow. A stream needs a direction at the far field; here there is none to speak of.
    """

    speed: float

    word = "still"
    application = "pimpleFoam"
    templates = ("common", "unsteady", "still")


@dataclass(frozen=True)
class Overset:
    """Oscillation on a towed path: a mesh of the body moves in a fixed one, in a stream of ``speed`` [m/s].

    An option for comparison with sources that use it; ``Moving`` is the way of the tank.
    """

    speed: float

    word = "overset"
    application = "overPimpleDyMFoam"
    templates = ("common", "unsteady", "moving", "overset")


Formulation = Straight | Unsteady | Arm | Moving | StillWater | Overset


@dataclass(frozen=True)
class Domain:
    """Which water is meshed. ``half``: z >= 0 of the mesh alone.   turned : the mesh is rolled by ``QUARTER``."""

    half: bool
    turned: bool

    def to_mesh(self, vectors: Array) -> Array:
        """Body-axis vectors (..., 3) in the axes of the mesh."""
        x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
        return np.stack([x, z, -y] if self.turned else [x, y, z], axis=-1)

    def to_body(self, vectors: Array) -> Array:
        """Vectors (..., 3) in the axes of the mesh in body axes."""
        x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
        return np.stack([x, -z, y] if self.turned else [x, y, z], axis=-1)

    def loads_to_body(self, loads: Array) -> Array:
        """Loads (N, 6) on the meshed part, in axes of the mesh, as loads on the whole craft in body axes."""
        whole = loads * np.array([2.0, 2.0, 0.0, 0.0, 0.0, 2.0]) if self.half else loads
        return np.concatenate([self.to_body(whole[..., :3]), self.to_body(whole[..., 3:])], axis=-1)

    def craft_in_mesh(self, craft: Craft) -> Craft:
        """The craft as the mesher has to see it: its fins rolled with the mesh."""
        if not self.turned:
            return craft
        return replace(
            craft,
            fins=tuple(replace(fin, azimuth=(fin.azimuth - QUARTER) % (2.0 * math.pi)) for fin in craft.fins),
        )


def fastest(test: CaptiveTest, length: float, carriage: float = 0.0) -> float:
    """Largest speed [m/s] of a point of the hull in a period, in axes that move ahead at ``carriage`` [m/s]."""
    period = test.motion.period
    nu = test.motion.history(np.linspace(0.0, period, 65) if period else np.zeros(1)).nu
    linear = np.linalg.norm(nu[:, :3] - [carriage, 0.0, 0.0], axis=1)
    return float((linear + 0.5 * length * np.linalg.norm(nu[:, 4:], axis=1)).max())


def load_limit(test: CaptiveTest, length: float, density: float) -> float:
    """Force [N] that no solution of ``test`` reaches: 2 in primes of speed and acceleration, where hulls have 0.01.

    length [m], density [kg/m3] : beyond it the solution is lost, even where no floating-point trap was sprung.
    """
    period = test.motion.period
    nudot = test.motion.history(np.linspace(0.0, period, 65) if period else np.zeros(1)).nudot
    acceleration = np.linalg.norm(nudot[:, :3], axis=1) + 0.5 * length * np.linalg.norm(nudot[:, 4:], axis=1)
    return density * length**2 * (fastest(test, length) ** 2 + length * float(acceleration.max()))


def formulation_of(test: CaptiveTest, domain: Domain, length: float, *, unsteady: bool = False) -> Formulation:
    """The formulation that runs ``test`` on a hull of ``length`` [m], chosen by its motion.

    unsteady : a straight run is solved in time.
    """
    motion = test.motion
    if motion.period > 0.0:
        swing = fastest(test, length, test.speed)
        return (StillWater if swing > test.speed else Moving)(test.speed)
    nu = motion.history(np.array([0.0])).nu[0]
    if nu[5] != 0.0:
        return Arm(float(nu[5]), (float(-nu[1] / nu[5]), float(nu[0] / nu[5])))
    inflow = domain.to_mesh(-nu[:3]) + 0.0
    return (Unsteady if unsteady else Straight)((float(inflow[0]), float(inflow[1]), float(inflow[2])))


def overset_of(test: CaptiveTest, found: Formulation) -> Overset:
    """The overset formulation of ``test``, for which the tank would choose ``found``.

    Raises
    ------
    TankError
        Nothing moves in the test, or there is no stream for it to move in.
    """
    if isinstance(found, Moving):
        return Overset(found.speed)
    why = (
        "it oscillates faster than its tow, so its mesh would travel through water at rest and leave the background"
        if isinstance(found, StillWater)
        else f"it is a {test.motion.kind}, a steady run in which nothing moves against the water's mesh"
    )
    raise TankError(
        f"test {test.name} has no overset formulation: {why}. Run it in a tank that chooses the formulation itself "
        '(formulation = "own"); oscillations in a stream can be overset.'
    )


def domain_of(craft: Craft, test: CaptiveTest, half: bool | None = None) -> Domain:
    """The half domain where motion, layout and deflections are alike on both sides of a plane; else the whole.

    half : True and False demand one or the other.

    Raises
    ------
    TankError
        The half domain is demanded and the flow has no such symmetry.
    """
    time = np.linspace(0.0, max(test.motion.period, 1.0), 17)
    nu = test.motion.history(time).nu
    out = {False: nu[:, [2, 3, 4]], True: nu[:, [1, 3, 5]]}  # velocities that leave the plane z = 0, and y = 0
    if half is not False:
        for turned, crossing in out.items():
            domain = Domain(half=True, turned=turned)
            if not np.any(crossing) and _mirrored(domain.craft_in_mesh(craft), test.fins):
                return domain
    if half:
        raise TankError(
            f"test {test.name}: half of the water was demanded, and motion, fins or deflections differ between the two "
            "sides. Leave the choice to the test (half = None)."
        )
    return Domain(half=False, turned=False)


def _mirrored(craft: Craft, angles: tuple[float, ...]) -> bool:
    """True when fins and deflections are their own mirror image in z = 0.

    A deflection is right-handed about the outward span, so its mirror image is the opposite angle.
    """
    delta = angles or (0.0,) * len(craft.fins)
    for fin, angle in zip(craft.fins, delta, strict=True):
        image = replace(fin, azimuth=-fin.azimuth, name="", sign=1.0)
        if not any(
            abs(other_angle + angle) < 1e-9 and _same(image, replace(other, name="", sign=1.0))
            for other, other_angle in zip(craft.fins, delta, strict=True)
        ):
            return False
    return True


def _same(fin: object, other: object) -> bool:
    ours, theirs = dict(vars(fin)), dict(vars(other))
    turn = ours.pop("azimuth") - theirs.pop("azimuth")
    for key in ACTUATOR:
        ours.pop(key), theirs.pop(key)
    return abs(math.remainder(turn, 2.0 * math.pi)) < AZIMUTH_TOLERANCE and ours == theirs
