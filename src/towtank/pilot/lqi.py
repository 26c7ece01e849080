"""Full-state regulators with integrals, as gains of the pilot's law."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are

from towtank.errors import InputError, TrialError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.linear import LinearModel, linearise
from towtank.pilot.design import (
    BAND_SHARE,
    CONTROL_SHARE,
    DEPTH_ERROR,
    HEADING_ERROR,
    INTEGRAL_LENGTHS,
    PITCH_ERROR,
    PITCH_LIMIT,
    ROLL_ERROR,
    TURN_RADIUS,
    notes_of,
    reversal_below,
    speed_of,
    steady_pitch_order,
    unstable,
)
from towtank.pilot.law import Pilot
from towtank.pilot.loops import judged
from towtank.pilot.plant import block, with_integral

MEASURED = "Feeds back sway and heave through the water: the craft must measure or estimate them."


@dataclass(frozen=True)
class LqiWeights:
    """Largest acceptable values of Bryson's rule; the cost is the sum of (value / largest)^2.

    heading, pitch, roll [rad].   depth [lengths].   control : share of the fins' range [-].
    integral [lengths] : travelled in which a standing error is to be taken out.
    """

    heading: float = float(HEADING_ERROR)
    pitch: float = float(PITCH_ERROR)
    roll: float = float(ROLL_ERROR)
    depth: float = DEPTH_ERROR
    control: float = CONTROL_SHARE
    integral: float = INTEGRAL_LENGTHS

    def __post_init__(self) -> None:
        """Refuse what is no size.

        Raises
        ------
        InputError
            A weight that is not positive and finite.
        """
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (value > 0.0 and np.isfinite(value)):
                raise InputError(
                    f"weight of {name}: {value:g}. It is the largest acceptable value and divides; give a positive one."
                )


WEIGHTS = LqiWeights()


def design_lqi(model: Model, speed: float | None = None, weights: LqiWeights = WEIGHTS) -> Pilot:
    """Regulators of all states with integrals of heading and depth, for ``model`` at ``speed`` [m/s], as a ``Pilot``.

    Three regulators: v, r, psi and the integral of psi on the rudder; w, q, theta, z and the integral of z on the
    elevator; p, phi on the aileron. With K their gains, delta = -K x, the law's own are

    yaw_rate = K_r, sway = K_v, heading = K_psi / K_r, heading_integral = K_int
    pitch_rate = K_q, heave = K_w, pitch = K_theta, depth = -K_z / pitch_order, depth_rate = 0, depth_integral = K_int
    roll = K_phi, roll_rate = K_p

    so that the law flies delta = -K x up to its limits. pitch_order makes the pitch follow the pitch asked for; it
    scales the limit of that pitch and cancels in the loop.

    Source     fossen2021, ch. 16 (optimal state feedback with integral action); brysonho1975 (weights).
    Departure  The Riccati equation is that of the craft without the lag of its fins, because the law does not feed
               back fin angles. ``eigenvalues`` and ``margins`` are those with the lag.
    Valid      As for ``design_pilot``. Without the lag each loop bears any larger gain, half the gain, and 60 deg.

    Raises
    ------
    InputError
        The speed is not positive.
    TrialError
        The craft has no fins, its fins cannot stabilise heading or depth, or their lag undoes the regulator.
    """
    speed = speed_of(model, speed)
    linear, length = linearise(model, speed), model.craft.length
    control = weights.control * min(float(fin.max_angle) for fin in model.craft.fins)
    patience, far, free = weights.integral * length / speed, weights.depth * length, np.inf
    yaw = np.array([free, free, weights.heading, weights.heading * patience])
    dive = np.array([free, free, weights.pitch, far, far * patience])
    heading = regulator(linear, ("v", "r", "psi"), "rudder", yaw, control)
    depth = regulator(linear, ("w", "q", "theta", "z"), "elevator", dive, control)
    for name, gains in (("heading", heading), ("depth", depth)):
        if not np.any(gains):
            raise unstable(name, speed)
    inner = (block(linear, ("w", "q", "theta"), "elevator"), np.eye(3), depth[:3])
    order = steady_pitch_order(inner)
    if not (heading[2] / heading[1] > 0.0 and np.isfinite(order) and abs(order) > 0.0):
        raise TrialError(
            f"pilot of {model.craft.name} at {speed:g} m/s: the regulator's gains of yaw rate {heading[1]:.3g} s and "
            f"heading {heading[2]:.3g} have opposite signs, which the law's limit of turn cannot take. Allow a smaller "
            "heading error, or use design_pilot."
        )
    roll = _roll(linear, weights.roll, control)
    pilot = judged(model, Pilot(
        craft=model.craft.name, speed=speed,
        sway=float(heading[0]), yaw_rate=float(heading[1]), heading=float(heading[2] / heading[1]),
        heading_integral=float(heading[3]), turn_limit=speed / (TURN_RADIUS * length),
        heave=float(depth[0]), pitch_rate=float(depth[1]), pitch=float(depth[2]), pitch_order=order,
        depth=float(-depth[3] / order), depth_integral=float(depth[4]), pitch_limit=float(PITCH_LIMIT),
        roll_rate=float(roll[0]), roll=float(roll[1]), unwind=2.0 * length / speed,
        heading_band=weights.heading * BAND_SHARE, depth_band=far * BAND_SHARE, reversal=reversal_below(model, speed),
        notes=(*notes_of(linear, bool(np.any(roll)), speed), MEASURED),
    ))  # fmt: skip
    for name, values in pilot.eigenvalues.items():
        if not values[0].real < 0.0:
            raise unstable(name, speed, values[0].real)
    return pilot


def regulator(linear: LinearModel, states: tuple[str, ...], control: str, largest: Array, limit: float) -> Array:
    """Gains K of delta = -K x of least quadratic cost; zeros where the Riccati equation has no solution.

    states (n,) : of the sub-model.   largest (n,) or (n + 1,) : largest acceptable values, infinity leaves one free;
    one more than there are states adds the integral of the last state.   limit [rad] : of ``control``.

    Source     brysonho1975, ch. 5; scipy solves the Riccati equation.
    """
    plant = block(linear, states, control)
    plant = with_integral(plant, np.eye(len(states))[-1]) if len(largest) > len(states) else plant
    R = limit**-2.0
    try:
        P = solve_continuous_are(plant.A, plant.B, np.diag(largest**-2.0), np.array([[R]]))
    except (LinAlgError, ValueError):
        return np.zeros(len(largest))
    return np.asarray((plant.B.T @ P / R)[0])


def _roll(linear: LinearModel, largest: float, limit: float) -> Array:
    """Aileron from p and phi; zeros when the fins make no roll moment."""
    plant = block(linear, ("p", "phi"), "aileron")
    if not np.any(np.abs(plant.B) > 1e-12):
        return np.zeros(2)
    return regulator(linear, ("p", "phi"), "aileron", np.array([np.inf, largest]), limit)
