"""The linear model about straight level flight, stability indices and elevator reversal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.dual import DUAL, Dual, gradients, variables
from towtank.model.equations import STATE, Model
from towtank.model.values import to_variant

INPUTS = ("rudder", "elevator", "aileron", "thrust")
"""Virtual fin angles [rad] and thrust [N]."""

SLOPES = ("wide", "origin")


@dataclass(frozen=True)
class LinearModel:
    """d(states)/dt = A states + B inputs, as deviations from straight level flight at ``speed`` [m/s].

    A (n, n), B (n, m) in SI with angles in radians.   states, inputs : names, as in ``STATE`` and ``INPUTS``.
    slopes : "wide" (the fit the model flies on) or "origin" (slopes at zero incidence).
    remainder (n,) : rates of the reference flight itself; not zero for a craft that is not trimmed there, for
        example a heavy one.
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
    """All 12 states and 4 inputs, linearised exactly about straight level flight.

    Parameters
    ----------
    speed : [m/s], through water at rest; the thrust balances the resistance.
    slopes : "wide" for the values the model flies on, "origin" for the slopes at zero incidence.

    Source     The equations of ``towtank.model.equations``, run once on dual numbers: no step size.
    Departure  Fin angles act at once; actuator lag and limits are left to the autopilot's design.

    Raises
    ------
    InputError
        Speed not positive, or no origin slopes in the derivatives.
    """
    if not speed > 0.0:
        raise InputError(f"speed {speed} m/s: straight flight needs a positive speed.")
    model = with_slopes(model, slopes)
    size = len(STATE)
    x = variables(np.concatenate([np.zeros(6), [speed], np.zeros(8), [model.thrust(speed)]]))
    delta = model.fin_angles(*x[size : size + 3])
    rates = model.rates([*x[:size], *delta], delta, x[-1], ops=DUAL)[:size]
    slope = gradients(rates, len(x))
    remainder = np.array([rate.value if isinstance(rate, Dual) else float(rate) for rate in rates])
    remainder[STATE.index("x")] = 0.0
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
