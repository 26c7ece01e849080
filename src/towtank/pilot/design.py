"""Gains of the pilot from the craft's own linear model: nothing is set per craft."""

from __future__ import annotations

import numpy as np

from towtank.errors import InputError, TrialError
from towtank.model.equations import Model
from towtank.model.linear import LinearModel, elevator_reversal_speed, linearise
from towtank.pilot.feedback import Weights, closed_loop, margins, output_feedback
from towtank.pilot.law import Pilot
from towtank.pilot.plant import Loop, Plant, block, with_integral, with_servo

HEADING_ERROR = np.radians(20.0)
PITCH_ERROR = np.radians(10.0)
ROLL_ERROR = np.radians(5.0)
DEPTH_ERROR = 0.5
"""Largest acceptable errors [rad], depth in lengths: Bryson's weights, each against a third of the fins' range."""
CONTROL_SHARE = 1.0 / 3.0
INTEGRAL_LENGTHS = 12.0
"""Lengths travelled in which a standing error is to be taken out."""
BAND_SHARE = 0.2
"""Errors beyond this share of the acceptable ones are integrated as if they were that large."""
PITCH_LIMIT = np.radians(15.0)
"""Largest pitch asked for, from the trimmed pitch; LAUV practice is 10 to 15 deg."""
TURN_RADIUS = 4.0
"""Radius, in lengths, of the tightest turn asked for."""


def design_pilot(model: Model, speed: float | None = None) -> Pilot:
    """Heading and depth cascade with roll damping for ``model`` at ``speed`` [m/s], the craft's own by default.

    The heading loop feeds back r and psi, the depth loop q and theta inside, zdot and z outside: quantities a craft
    measures. Sway is not fed back. Each loop has the lag of the fins in it.

    Source     perron (heading and depth from rudder and elevator); cascade of the LAUV (THEORY section 7);
               levineathans1970 for the gains.
    Valid      Within 0.5 to 2 times ``speed``; outside the fins' linear range the limits and the anti-windup act.

    Raises
    ------
    InputError
        The speed is not positive.
    TrialError
        The craft has no fins, or its fins cannot stabilise heading or pitch.
    """
    speed = speed_of(model, speed)
    linear = linearise(model, speed)
    range_ = min(float(fin.max_angle) for fin in model.craft.fins)
    lag = max(float(fin.time_constant) for fin in model.craft.fins)
    length = model.craft.length
    heading = _heading(linear, speed, length, lag, range_)
    pitch, depth = _depth(linear, speed, length, lag, range_)
    roll = _roll(linear, speed, length, lag, range_)
    k_r, k_psi, k_i = heading[2]
    k_q, k_theta = pitch[2]
    order = steady_pitch_order(pitch)
    k_h, k_z, k_zi = depth[2][2:] / order
    loops: dict[str, Loop] = {"heading": heading, "depth": depth, "roll": roll}
    return Pilot(
        craft=model.craft.name,
        speed=speed,
        yaw_rate=float(k_r),
        heading=float(k_psi / k_r),
        heading_integral=float(k_i),
        turn_limit=speed / (TURN_RADIUS * length),
        pitch_rate=float(k_q),
        pitch=float(k_theta),
        pitch_order=order,
        depth=-float(k_z),
        depth_rate=-float(k_h),
        depth_integral=float(k_zi * order),
        pitch_limit=float(PITCH_LIMIT),
        roll=float(roll[2][0]),
        roll_rate=float(roll[2][1]),
        unwind=2.0 * length / speed,
        heading_band=float(HEADING_ERROR * BAND_SHARE),
        depth_band=float(DEPTH_ERROR * length * BAND_SHARE),
        reversal=reversal_below(model, speed),
        eigenvalues={name: tuple(complex(s) for s in closed_loop(*loop)) for name, loop in loops.items()},
        margins={
            "heading": margins(*heading),
            "pitch": margins(*pitch),
            "depth": margins(*depth),
            **({"roll": margins(*roll)} if np.any(roll[2]) else {}),
        },
        notes=notes_of(linear, bool(np.any(roll[2])), speed),
    )


def speed_of(model: Model, speed: float | None) -> float:
    """``speed`` [m/s], or the craft's own, if a pilot can be designed for it.

    Raises
    ------
    InputError
        The speed is not positive.
    TrialError
        The craft has no fins.
    """
    speed = model.craft.speed if speed is None else float(speed)
    if not speed > 0.0 or not np.isfinite(speed):
        raise InputError(
            f"pilot of {model.craft.name}: speed {speed:g} m/s. Fins need forward speed; give a positive one."
        )
    if not model.craft.fins:
        raise TrialError(f"craft {model.craft.name} has no fins, so no pilot can steer it. Run open-loop trials only.")
    return speed


def unstable(name: str, speed: float, growth: float = float("nan")) -> TrialError:
    """The error of a loop called ``name`` that no gains stabilise at ``speed`` [m/s]; ``growth`` [1/s]."""
    return TrialError(
        f"pilot of this craft at {speed:g} m/s: no gains stabilise {name} (largest eigenvalue {growth:+.3g} 1/s). The "
        "fins are too weak or too slow for this craft, or act the wrong way: look at Nuudr, Muude, the fins' lag and "
        "the stability indices."
    )


def _stable(loop: Loop, name: str, speed: float) -> Loop:
    """``loop`` if it is stable; an error that teaches if not."""
    growth = float(closed_loop(*loop)[0].real)
    if growth < 0.0 and np.all(np.isfinite(loop[2])):
        return loop
    raise unstable(name, speed, growth)


def _heading(linear: LinearModel, speed: float, length: float, lag: float, range_: float) -> Loop:
    """Rudder from r, psi and the integral of psi."""
    full = with_integral(with_servo(block(linear, ("v", "r", "psi"), "rudder"), lag), np.array([0.0, 0.0, 1.0, 0.0]))
    outputs = np.eye(5)[[1, 2, 4]]
    patience = INTEGRAL_LENGTHS * length / speed
    weights = Weights(
        states=np.array([np.inf, np.inf, HEADING_ERROR, np.inf, HEADING_ERROR * patience]),
        control=CONTROL_SHARE * range_,
        start=np.array([0.1 * speed, 0.1 * speed / length, HEADING_ERROR, 0.1, 0.1 * HEADING_ERROR * patience]),
    )
    return _stable((full, outputs, output_feedback(full, outputs, weights)), "heading", speed)


def _depth(linear: LinearModel, speed: float, length: float, lag: float, range_: float) -> tuple[Loop, Loop]:
    """Elevator from q and theta, then from zdot, z and the integral of z around it."""
    inner = with_servo(block(linear, ("w", "q", "theta"), "elevator"), lag)
    attitude = np.eye(4)[[1, 2]]
    pitch_weights = Weights(
        states=np.array([np.inf, np.inf, PITCH_ERROR, np.inf]),
        control=CONTROL_SHARE * range_,
        start=np.array([0.1 * speed, 0.1 * speed / length, PITCH_ERROR, 0.1]),
    )
    pitch = _stable((inner, attitude, output_feedback(inner, attitude, pitch_weights)), "pitch", speed)
    whole = with_servo(block(linear, ("w", "q", "theta", "z"), "elevator"), lag)
    sinking = whole.A[3]
    whole = with_integral(whole, np.array([0.0, 0.0, 0.0, 1.0, 0.0]))
    k_q, k_theta = pitch[2]
    k = np.array([0.0, k_q, k_theta, 0.0, 0.0, 0.0])
    # What the depth loop steers is the craft with its pitch loop closed; its control is the pitch asked for.
    order = steady_pitch_order(pitch)
    held = Plant(whole.A - whole.B @ k[None, :], whole.B * order, whole.states)
    outputs = np.vstack([[*sinking, 0.0], np.eye(6)[[3, 5]]])
    patience = INTEGRAL_LENGTHS * length / speed
    far = DEPTH_ERROR * length
    weights = Weights(
        states=np.array([np.inf, np.inf, np.inf, far, np.inf, far * patience]),
        control=min(PITCH_ERROR, CONTROL_SHARE * range_ / abs(order)),
        start=np.array([0.1 * speed, 0.1 * speed / length, PITCH_ERROR, far, 0.1, 0.1 * far * patience]),
    )
    outer = output_feedback(held, outputs, weights)
    both = np.vstack([np.eye(6)[[1, 2]], outputs])
    depth = (whole, both, np.array([k_q, k_theta, *(order * outer)]))
    return pitch, _stable(depth, "depth", speed)


def steady_pitch_order(pitch: Loop) -> float:
    """Elevator per pitch asked for [-] that makes the pitch follow it in the steady state.

    Source     Steady gain of the closed pitch loop.
    """
    plant, outputs, gains = pitch
    closed = plant.A - plant.B @ (gains @ outputs)[None, :]
    return float(-1.0 / np.linalg.solve(closed, plant.B[:, 0])[plant.states.index("theta")])


def _roll(linear: LinearModel, speed: float, length: float, lag: float, range_: float) -> Loop:
    """Aileron from phi and p; no gains when the fins make no roll moment."""
    full = with_servo(block(linear, ("p", "phi"), "aileron"), lag)
    outputs = np.eye(3)[[1, 0]]
    if not np.any(np.abs(full.B) > 0.0) or not np.any(np.abs(full.A[:2, 2]) > 1e-12):
        return full, outputs, np.zeros(2)
    weights = Weights(
        states=np.array([np.inf, ROLL_ERROR, np.inf]),
        control=CONTROL_SHARE * range_,
        start=np.array([0.1 * speed / length, ROLL_ERROR, 0.1]),
    )
    gains = output_feedback(full, outputs, weights)
    stable = closed_loop(full, outputs, gains)[0].real < 0.0
    return full, outputs, gains if stable else np.zeros(2)


def reversal_below(model: Model, speed: float) -> float:
    """Speed [m/s] below which the elevator acts reversed on depth; 0 if there is none below ``speed``.

    A pilot for less than the inversion speed is designed for the reversed elevator and has no order to hold back.
    """
    found = elevator_reversal_speed(model, "wide") or 0.0
    return found if found < speed else 0.0


def elevator_authority(linear: LinearModel, speed: float) -> float:
    """Steady rate of depth per elevator angle, zdot / delta_e [m/s per rad]; negative where the elevator acts reversed.

    Source     Steady solution of the linear vertical plane (w, q = 0, theta).
    """
    vertical = block(linear, ("w", "q", "theta"), "elevator")
    steady = np.linalg.lstsq(vertical.A, -vertical.B[:, 0], rcond=None)[0]
    return float(steady[0] - speed * steady[2])


def notes_of(linear: LinearModel, rolls: bool, speed: float) -> tuple[str, ...]:
    """What a pilot cannot do at ``speed`` [m/s], in words; ``rolls`` : it damps roll."""
    out = []
    if elevator_authority(linear, speed) < 0.0:
        out.append(
            f"At {speed:g} m/s the elevator acts reversed on depth: the speed is below the inversion speed, where the "
            "restoring moment outweighs the fins. The pilot is designed for it and must not be used above that speed."
        )
    if not rolls:
        out.append("The fins give no useful roll moment: roll is left to the righting moment.")
    return tuple(out)
