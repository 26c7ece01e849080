"""The linear model about straight level flight or any other state, stability indices and elevator reversal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array, rotation
from towtank.model.algebra import Vector
from towtank.model.dual import DUAL, Dual, gradients, variables
from towtank.model.equations import STATE, STILL, Model
from towtank.model.values import to_variant

INPUTS = ("rudder", "elevator", "aileron", "thrust")
"""Virtual fin angles [rad] and thrust [N]."""

SLOPES = ("wide", "origin")


@dataclass(frozen=True)
class LinearModel:
    """d(states)/dt = A states + B inputs + remainder, as deviations from a reference flight.

    The reference is straight level flight at ``speed`` [m/s] (``linearise``) or any state (``linearise_at``); ``speed``
    is then its speed through the water.
    A (n, n), B (n, m) in SI with angles in radians.   states, inputs : names, as in ``STATE`` and ``INPUTS``.
    slopes : "wide" (the fit the model flies on) or "origin" (slopes at zero incidence).
    remainder (n,) : rates of the reference flight itself; not zero for a craft that is not trimmed there, for
        example a heavy one. ``linearise`` leaves out the rate of x, the travel along the track.
    """

    A: Array
    B: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    speed: float
    slopes: str
    remainder: Array

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], least damped first."""
        values = np.asarray(np.linalg.eigvals(self.A), dtype=complex)
        return values[np.lexsort((values.imag, -values.real))]

    def part(self, states: Sequence[str], inputs: Sequence[str]) -> LinearModel:
        """The subsystem of some states and inputs; what couples it to the others is left out.

        Raises
        ------
        InputError
            A name that this model does not have.
        """
        for name, names in [*((s, self.states) for s in states), *((i, self.inputs) for i in inputs)]:
            if name not in names:
                raise InputError(f"the linear model has no {name!r}; choose from {', '.join(names)}.")
        rows = [self.states.index(name) for name in states]
        columns = [self.inputs.index(name) for name in inputs]
        return LinearModel(
            self.A[np.ix_(rows, rows)],
            self.B[np.ix_(rows, columns)],
            tuple(states),
            tuple(inputs),
            self.speed,
            self.slopes,
            self.remainder[rows],
        )


@dataclass(frozen=True)
class StabilityIndices:
    """Straight-line stability indices of both planes; positive is stable, 1 is the limit of large speed or damping.

    A plane without lateral force (Yuv or Zuw zero) has no index: nan.
    """

    horizontal: float
    vertical: float
    slopes: str


def linearise(model: Model, speed: float, slopes: str = "wide") -> LinearModel:
    """All 12 states and 4 inputs, linearised exactly about straight level flight: ``linearise_at`` there.

    Parameters
    ----------
    speed : [m/s], through water at rest; the thrust balances the resistance.
    slopes : "wide" for the values the model flies on, "origin" for the slopes at zero incidence.

    Raises
    ------
    InputError
        Speed not positive, or no origin slopes in the derivatives.
    """
    if not speed > 0.0:
        raise InputError(f"speed {speed} m/s: straight flight needs a positive speed.")
    thrust = float(with_slopes(model, slopes).thrust(speed))
    straight = [0.0] * 6 + [speed] + [0.0] * (5 + len(model.craft.fins))
    linear = linearise_at(model, straight, thrust, slopes=slopes)
    return replace(linear, remainder=np.where(np.array(STATE) == "x", 0.0, linear.remainder))


def linearise_at(
    model: Model, state: Vector, thrust: float, current: Vector = STILL, slopes: str = "wide"
) -> LinearModel:
    """All 12 states and 4 inputs, linearised exactly about ``state``.

    Parameters
    ----------
    state : (12 + n_fins,) as in ``Model.states``: any state, trimmed or not; the inputs are deviations of rudder,
        elevator, aileron from its fin angles.
    thrust, current : as in ``Model.rates``.
    slopes : as in ``linearise``.

    Source     The equations of ``towtank.model.equations``, run once on dual numbers: no step size.
    Departure  Fin angles act at once; actuator lag and limits are left to the autopilot's design.
    Valid      |theta| below 90 deg. A and B are those of the moment: in a steady turn they stay as they are in still
               water, but for the rows of x and y; in a current the others change with the heading too.

    Raises
    ------
    InputError
        A state of another length or not finite, theta at 90 deg or beyond, or no origin slopes in the derivatives.
    """
    model = with_slopes(model, slopes)
    size, fins = len(STATE), len(model.craft.fins)
    start = np.asarray(state, dtype=float)
    if start.shape != (size + fins,) or not np.isfinite([*start, thrust, *current]).all():
        raise InputError(
            f"linearise_at: the state has the shape {start.shape} or holds a number that is not finite. Give "
            f"{size + fins} finite numbers, {', '.join(model.states)}, and a finite thrust and current."
        )
    if not np.cos(start[STATE.index("theta")]) > 0.0:
        raise InputError(
            f"linearise_at: theta = {np.degrees(start[STATE.index('theta')]):.4g} deg. The limit is 90 deg, where the "
            "rates of phi and psi grow without bound; give the attitude with |theta| below it."
        )
    x = variables(np.concatenate([start[:size], np.zeros(3), [thrust]]))
    moved = model.fin_angles(*x[size : size + 3])
    delta = [angle + float(held) for angle, held in zip(moved, start[size:], strict=True)]
    rates = model.rates([*x[:size], *delta], delta, x[-1], current, ops=DUAL)[:size]
    slope = gradients(rates, len(x))
    remainder = np.array([rate.value if isinstance(rate, Dual) else float(rate) for rate in rates])
    speed = float(np.linalg.norm(start[6:9] - rotation(start[3:6]).T @ np.asarray(current, dtype=float)))
    return LinearModel(slope[:, :size], slope[:, size:], STATE, INPUTS, speed, slopes, remainder)


def horizontal(model: Model, speed: float, slopes: str = "wide", states: Sequence[str] = ("v", "r")) -> LinearModel:
    """Sway and yaw with the rudder; ``states`` may add psi, p, phi."""
    inputs = ("rudder", "aileron") if "p" in states else ("rudder",)
    return linearise(model, speed, slopes).part(states, inputs)


def vertical(
    model: Model, speed: float, slopes: str = "wide", states: Sequence[str] = ("w", "q", "theta", "z")
) -> LinearModel:
    """Heave, pitch and depth with the elevator. With z one eigenvalue is 0: depth itself is not restored."""
    return linearise(model, speed, slopes).part(states, ("elevator",))


def with_slopes(model: Model, slopes: str) -> Model:
    """``model`` itself ("wide"), or with the linear terms replaced by the slopes at the origin ("origin").

    Raises
    ------
    InputError
        Another word, or derivatives without origin slopes.
    """
    if slopes not in SLOPES:
        raise InputError(f"slopes {slopes!r}: choose 'wide' (the fit the model flies on) or 'origin'.")
    if slopes == "wide":
        return model
    if not model.derivatives.origin:
        raise InputError(
            f"the derivatives of {model.derivatives.craft} hold no slopes at the origin. Use slopes='wide', or "
            "derive them again from runs that include small angles."
        )
    return model.with_values(**model.derivatives.origin)


def stability_indices(model: Model, slopes: str = "origin") -> StabilityIndices:
    """Indices of straight-line stability with fixed controls.

    G_h = 1 - Nv (Yr - m) / (Yv (Nr - xG m)),  G_v = 1 - Mw (Zq + m) / (Zw (Mq - xG m)), with primes. Every prime of a
    product has the same factor above and below the line, so the values themselves give the same number.

    Source     roddy1990; THEORY section 7. Restoring moments are left out: the limit of high speed.
    Valid      Ahead, linear force and moment that damp; NaN otherwise (a wide fit may leave all damping to |v|v).
    """
    d = to_variant(with_slopes(model, slopes).derivatives, "lumped")
    m, xG = model.constants.body.m, model.constants.body.xG
    return StabilityIndices(
        horizontal=_index(d["Nuv"] * (d["Yur"] - m), d["Yuv"] * (d["Nur"] - xG * m)),
        vertical=_index(d["Muw"] * (d["Zuq"] + m), d["Zuw"] * (d["Muq"] - xG * m)),
        slopes=slopes,
    )


def _index(driving: float, damping: float) -> float:
    """1 - driving / damping; NaN where the linear terms do not damp, since the sign then says nothing."""
    return 1.0 - driving / damping if damping > 0.0 else float("nan")


def elevator_reversal_speed(model: Model, slopes: str = "origin") -> float | None:
    """Speed [m/s] below which a steady elevator angle moves the craft the other way in depth; None if there is none.

    u_c^2 = -(m zG - b zB) g Zuude / (Zuw Muude - Muw Zuude).

    Source     THEORY section 7, from steady heave and pitch at constant depth.
    Valid      Small angles, a craft in balance without the elevator.
    """
    d = to_variant(with_slopes(model, slopes).derivatives, "lumped")
    body = model.constants.body
    stiffness = body.g * (body.m * body.zG - body.b * body.zB)
    square = -_ratio(stiffness * d["Zuude"], d["Zuw"] * d["Muude"] - d["Muw"] * d["Zuude"])
    return float(np.sqrt(square)) if square > 0.0 else None


def _ratio(above: float, below: float) -> float:
    return above / below if below != 0.0 else float("nan")
