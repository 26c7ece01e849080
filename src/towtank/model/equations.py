"""The equations of motion (perron eq. 2.8 and 2.9): the only right-hand side.

    (M_RB - M_A) nudot + (C_RB - C_A) nu - D nu + G = tau

All velocities are relative to the water. In a uniform, steady current the water is a Galilean frame, so the rigid body
obeys the same equation there; the current enters through the position and through the rate -omega x v_c at which it
turns in body axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from operator import add
from types import SimpleNamespace
from typing import Any

import numpy as np

from towtank.craft.craft import Craft
from towtank.derive.table import Derivatives
from towtank.errors import InputError
from towtank.model.added_mass import added_mass_matrix, coriolis_full, coriolis_reduced
from towtank.model.algebra import Matrix, Ops, Scalar, Vector, frozen, ops_for, product, product_transposed
from towtank.model.damping import damping_matrix, optional_load
from towtank.model.extra import ExtraLoad, check_extra, extra_load
from towtank.model.fins import (
    FinSet,
    actuator_rates,
    fin_angles,
    fin_load,
    fin_set,
    virtual_angles,
)
from towtank.model.kinematics import euler_matrix, quaternion_matrix, quaternion_rates, rotation_matrix, trig_of
from towtank.model.options import ModelOptions
from towtank.model.restoring import restoring_vector
from towtank.model.rigid_body import Body, body_of, coriolis_matrix, mass_matrix
from towtank.model.thrust import Screw, screw_of, steady_thrust, thrust_load
from towtank.model.values import known, replaced, values_of
from towtank.symbols import OPTIONAL, TERMS

STATE = ("x", "y", "z", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r")
"""Position [m, NED], attitude [rad], velocity over ground in body axes [m/s, rad/s]; then one angle per fin [rad]."""

STILL = (0.0, 0.0, 0.0)

LEVEL = (0.0, 0.0, 1.0)
"""Gravity in the body axes of a level craft."""


@dataclass(frozen=True)
class Constants:
    """Everything constant in the right-hand side. Numbers may be floats, arrays or symbols.

    body, c (derivatives by name), added (6, 6), fins, screw (None for constant thrust), extra : what the terms take.
    split, optional, options : which form the terms have; ``optional`` when some of ``symbols.OPTIONAL`` are not zero.
    mass_inverse (6, 6) is (M_RB - M_A)^-1, taken once from an LU factorisation when the model is made: the matrix is
    constant, so a solve at every step would repeat the same work.
    """

    body: Body
    c: Any
    added: Matrix
    mass_inverse: Matrix
    fins: FinSet
    screw: Screw | None
    split: bool
    options: ModelOptions
    extra: ExtraLoad | None = None
    optional: bool = False


def parts(k: Constants, nu: Vector, down: Vector, delta: Vector, thrust: Scalar, ops: Ops) -> dict[str, list[Scalar]]:
    """The terms of eq. 2.9, each a load (6,) on the body [N, N m].

    nu (6,) through the water; down (3,), the unit vector of gravity in body axes: the last row of J1; delta (n_fins,).
    They add up to (M_RB - M_A) nudot: "rigid body" -C_RB nu, "added mass" +C_A nu, "damping" +D nu, "restoring" -G,
    "fins" and "thrust" (together tau); then "extra", the user's own load, if the model has one.
    """
    options = k.options
    coriolis = coriolis_full if k.split else coriolis_reduced
    extra = {"extra": extra_load(k.extra, nu, down, delta, ops)} if k.extra else {}
    force, torque = thrust_load(k.screw, thrust, nu[0], ops)
    damping = product(damping_matrix(k.c, nu, ops, options.axisymmetric_crossflow), nu)
    if k.optional:
        damping = [a + b for a, b in zip(damping, optional_load(k.c, nu, ops), strict=True)]
    return {
        "rigid body": [-x for x in product(coriolis_matrix(k.body, nu), nu)],
        "added mass": product(coriolis(k.added, nu), nu),
        "damping": damping,
        "restoring": [-x for x in restoring_vector(k.body, down)],
        "fins": fin_load(k.c, k.fins, nu, delta, ops),
        "thrust": [force, 0.0, 0.0, torque, 0.0, 0.0],
        **extra,
    }


def total_load(k: Constants, nu: Vector, down: Vector, delta: Vector, thrust: Scalar, ops: Ops) -> list[Scalar]:
    """The bracket of eq. 2.9 (6,) [N, N m]: the sum of ``parts``, equal to (M_RB - M_A) nudot.

    Source     perron, eq. 2.9.
    """
    return [reduce(add, row) for row in zip(*parts(k, nu, down, delta, thrust, ops).values(), strict=True)]


def acceleration(k: Constants, nu: Vector, down: Vector, delta: Vector, thrust: Scalar, ops: Ops) -> list[Scalar]:
    """Acceleration (6,) relative to the water, in body axes.

    Source     perron, eq. 2.9.
    Departure  The inverse mass matrix stands on the left of the bracket; +D nu with natural derivatives.
    """
    return product(k.mass_inverse, total_load(k, nu, down, delta, thrust, ops))


def acceleration_over_ground(
    k: Constants, J1: Matrix, nu: Vector, delta: Vector, thrust: Scalar, current: Vector, ops: Ops
) -> list[Scalar]:
    """Rates (6,) of the velocity over ground ``nu`` (6,), in body axes, of a body with the attitude J1 (3, 3).

    ``acceleration`` gives the rate of the velocity through the water; a steady current (3,) [m/s, NED] seen from the
    turning body adds -omega x v_c.

    Source     fossen2021, ch. 10.
    """
    u, v, w, p, q, r = nu
    u_c, v_c, w_c = product_transposed(J1, current)
    water = [u - u_c, v - v_c, w - w_c, p, q, r]
    udot, vdot, wdot, pdot, qdot, rdot = acceleration(k, water, J1[2], delta, thrust, ops)
    return [
        udot + (r * v_c - q * w_c),
        vdot + (p * w_c - r * u_c),
        wdot + (q * u_c - p * v_c),
        pdot,
        qdot,
        rdot,
    ]


def right_hand_side(
    k: Constants, state: Vector, command: Vector, thrust: Scalar, current: Vector, ops: Ops
) -> list[Scalar]:
    """Time derivatives of ``state``: 12 as in ``STATE``, then the fins.

    Source     perron, eq. 2.9 and 2.11.
    Valid      |theta| below 90 deg; ``right_hand_side_quaternion`` has no such limit.
    """
    nu, delta = state[6:12], state[12:]
    trig = trig_of(state[3:6], ops)
    J1 = rotation_matrix(trig)
    return [
        *product(J1, nu[:3]),
        *product(euler_matrix(trig), nu[3:]),
        *acceleration_over_ground(k, J1, nu, delta, thrust, current, ops),
        *actuator_rates(k.fins, delta, command, ops),
    ]


def right_hand_side_quaternion(
    k: Constants, state: Vector, command: Vector, thrust: Scalar, current: Vector, ops: Ops
) -> list[Scalar]:
    """Time derivatives of ``state`` (13 + n_fins): x y z, e0 e1 e2 e3, u v w p q r, then the fins.

    As ``right_hand_side``, with a unit quaternion (body to NED, scalar part first) for the attitude.

    Source     perron, eq. 2.9 and 2.11; fossen2021, ch. 2, for the quaternion.
    Valid      Every attitude.
    """
    e, nu, delta = state[3:7], state[7:13], state[13:]
    J1 = quaternion_matrix(e)
    return [
        *product(J1, nu[:3]),
        *quaternion_rates(e, nu[3:]),
        *acceleration_over_ground(k, J1, nu, delta, thrust, current, ops),
        *actuator_rates(k.fins, delta, command, ops),
    ]


@dataclass(frozen=True)
class Model:
    """A craft that moves: its rigid body and fins with a set of derivatives, in one of the two variants.

    extra : a load of the user's own (``towtank.model.extra``), or None.

    Raises
    ------
    InputError
        The derivatives are about another point or for another water than the craft's, of an unknown variant or term,
        or leave no positive mass; or the extra load cannot be used.
    """

    craft: Craft
    derivatives: Derivatives
    options: ModelOptions = field(default_factory=ModelOptions)
    extra: ExtraLoad | None = None

    def __post_init__(self) -> None:
        _check_reference(self.craft, self.derivatives)
        if self.extra is not None:
            check_extra(self.extra, len(self.craft.fins))
        _ = self.constants

    @classmethod
    def from_values(
        cls,
        craft: Craft,
        values: Mapping[str, float],
        *,
        variant: str = "lumped",
        level: str = "known coefficients",
        options: ModelOptions | None = None,
    ) -> Model:
        """A model of stated coefficients (SI, about the craft's origin) without uncertainty, such as published ones."""
        return cls(craft, known(craft, values, variant, level), options or ModelOptions())

    @cached_property
    def constants(self) -> Constants:
        """What the right-hand side needs, computed once."""
        values = values_of(self.derivatives)
        c = SimpleNamespace(**{name: values.get(name, 0.0) for name in TERMS})
        return Constants(
            body=self.body,
            c=c,
            added=added_mass_matrix(values),
            mass_inverse=frozen(_inverse(self.mass_matrix, self.derivatives.craft)),
            fins=self._fin_set(),
            screw=screw_of(self.craft, -c.Xuu),
            split=self.derivatives.variant == "split",
            options=self.options,
            extra=self.extra,
            optional=any(values.get(name) for group in OPTIONAL.values() for name in group),
        )

    def _fin_set(self) -> FinSet:
        o, curve = self.options, self.derivatives.fin_curve
        found = fin_set(self.craft, curve, o.faults, o.fins_apart)
        given = {name: kappa for name in ("kappa_v", "kappa_r") if (kappa := getattr(o, name)) is not None}
        return replace(found, **given)

    @cached_property
    def body(self) -> Body:
        """Mass, inertia, CG and centre of buoyancy."""
        cb = self.options.centre_of_buoyancy
        if cb is None:
            from towtank.craft.hydrostatics import hydrostatics

            cb = hydrostatics(self.craft).cb
        return body_of(self.craft, cb)

    @cached_property
    def mass_matrix(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """M_RB - M_A (6, 6) [kg, kg m, kg m2]."""
        added = added_mass_matrix(values_of(self.derivatives))
        return np.asarray(np.array(mass_matrix(self.body), dtype=float) - np.array(added, dtype=float))

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state: ``STATE``, then ``delta1``, ``delta2``, ..."""
        return (*STATE, *(f"delta{i + 1}" for i in range(len(self.craft.fins))))

    def rates(
        self,
        state: Vector,
        fin_command: Vector,
        thrust: Scalar,
        current: Vector = STILL,
        ops: Ops | None = None,
    ) -> list[Scalar]:
        """Time derivatives of the state, one entry per component.

        Parameters
        ----------
        state : (12 + n_fins,) as in ``states``; each component a float or an array (a batch).
        fin_command : (n_fins,) fin angles asked for [rad], right-handed about the outward span.
        thrust : [N] that balances the resistance at the commanded speed, from ``thrust``.
        current : (3,) velocity of the water [m/s, NED], uniform and steady.
        ops : elementary functions; chosen from the state when left out. Symbols need their own.
        """
        state, fin_command = _listed(state), _listed(fin_command)
        ops = ops or ops_for(*state, *fin_command, thrust)
        return right_hand_side(self.constants, state, fin_command, thrust, current, ops)

    def acceleration(
        self, nu: Vector, attitude: Vector, delta: Vector, thrust: Scalar, current: Vector = STILL
    ) -> list[Scalar]:
        """Acceleration (6,) [m/s2, rad/s2] over ground in body axes.

        nu (6,) over ground [m/s, rad/s]; attitude (3,) phi, theta, psi [rad]; delta (n_fins,) [rad]; thrust and
        current as in ``rates``.
        """
        state = [*STILL, *_listed(attitude), *_listed(nu), *_listed(delta)]
        return self.rates(state, list(state[12:]), thrust, current)[6:12]

    def loads(self, state: Vector, thrust: Scalar, current: Vector = STILL) -> dict[str, list[Scalar]]:
        """Loads (6,) on the body by cause [N, N m].

        "rigid body" (-C_RB nu), "added mass" (M_A nudot + C_A nu), "damping", "restoring", "fins", "thrust", and
        "extra" if there is one. They add up to M_RB nudot; velocities and accelerations are relative to the water.
        """
        state = _listed(state)
        ops = ops_for(*state, thrust)
        J1 = rotation_matrix(trig_of(state[3:6], ops))
        drift = product_transposed(J1, current)
        water = [a - b for a, b in zip(state[6:12], drift, strict=False)] + state[9:12]
        named = parts(self.constants, water, J1[2], state[12:], thrust, ops)
        nudot = acceleration(self.constants, water, J1[2], state[12:], thrust, ops)
        inertia = product(self.constants.added, nudot)
        return {**named, "added mass": [a + b for a, b in zip(named["added mass"], inertia, strict=True)]}

    def captive_load(self, nu: Vector, nudot: Vector, delta: Vector) -> list[Scalar]:
        """Hydrodynamic load (6,) [N, N m] of a prescribed motion: M_A nudot + C_A nu + D nu + fins.

        nu, nudot (6,) through water at rest; delta (n_fins,) [rad]. What a captive test measures, without weight,
        buoyancy, thrust, an extra load and the inertia of the body.
        """
        nu = _listed(nu)
        ops = ops_for(*nu, *nudot)
        named = parts(self.constants, nu, LEVEL, _listed(delta), 0.0, ops)
        inertia = product(self.constants.added, _listed(nudot))
        shares = (inertia, named["added mass"], named["damping"], named["fins"])
        return [sum(row) for row in zip(*shares, strict=True)]

    def fin_angles(self, rudder: Scalar, elevator: Scalar, aileron: Scalar) -> list[Scalar]:
        """Fin angles (n_fins,) [rad] of virtual rudder, elevator, aileron [rad]; not limited."""
        return fin_angles(self.constants.fins, rudder, elevator, aileron)

    def virtual(self, delta: Vector) -> list[Scalar]:
        """Virtual rudder, elevator, aileron [rad] of fin angles ``delta`` (n_fins,) [rad]."""
        return virtual_angles(self.constants.fins, _listed(delta))

    def thrust(self, speed: Scalar) -> Scalar:
        """Thrust [N] that balances the resistance at ``speed`` [m/s] in straight flight."""
        return steady_thrust(-self.constants.c.Xuu, speed, ops_for(speed))

    def with_values(self, **values: float) -> Model:
        """The same model with some derivatives replaced, by term name, SI."""
        return self.with_derivatives(replaced(self.derivatives, values))

    def with_derivatives(self, derivatives: Derivatives) -> Model:
        """The same craft and options with another set of derivatives."""
        return replace(self, derivatives=derivatives)

    def with_extra(self, extra: ExtraLoad | None) -> Model:
        """The same model with a load of the user's own, or without one."""
        return replace(self, extra=extra)

    def with_options(self, **options: Any) -> Model:
        """The same craft and derivatives with some options replaced."""
        return replace(self, options=replace(self.options, **options))


def _listed(vector: Sequence[Scalar] | np.ndarray[Any, Any]) -> list[Scalar]:
    """Components as a list; a one-dimensional array becomes floats, which are faster than numpy scalars."""
    return vector.tolist() if isinstance(vector, np.ndarray) and vector.ndim == 1 else list(vector)


def _inverse(matrix: np.ndarray[Any, Any], craft: str) -> np.ndarray[Any, Any]:
    """Inverse with exact zeros where the block structure has them; refuses a mass that is not positive."""
    smallest = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min())
    if not smallest > 0.0:
        raise InputError(
            f"derivatives of {craft}: the mass matrix M_RB - M_A is not positive definite (smallest eigenvalue "
            f"{smallest:.3g}). Added-mass derivatives such as Yvdot act on the body and are negative in this "
            "project; check their signs and the craft's inertia."
        )
    inverse = np.linalg.solve(matrix, np.eye(6))
    return np.where(np.abs(inverse) < 1e-15 * np.sqrt(np.outer(np.diag(inverse), np.diag(inverse))), 0.0, inverse)


def _check_reference(craft: Craft, derivatives: Derivatives) -> None:
    reference = derivatives.reference
    shift = reference.origin_from_nose - craft.origin_from_nose
    if abs(shift) > 1e-6 * craft.length:
        raise InputError(
            f"derivatives of {derivatives.craft} are about a point {reference.origin_from_nose:.4f} m aft of the nose, "
            f"craft {craft.name} has its origin at {craft.origin_from_nose:.4f} m. Moments would be wrong by "
            f"{abs(shift):.4g} m times the force: convert them with towtank.derive.convert.about_point first."
        )
    if abs(reference.density / craft.water.density - 1.0) > 0.01:
        raise InputError(
            f"derivatives of {derivatives.craft} are for water of {reference.density:g} kg/m3, craft {craft.name} is "
            f"in {craft.water.density:g} kg/m3. Derivatives grow with density: scale them, or change the craft's water."
        )
