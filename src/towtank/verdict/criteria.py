"""Straight-line stability of both planes with the uncertainty of the derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towtank.errors import InputError
from towtank.frames import Array
from towtank.model.equations import Model
from towtank.model.rigid_body import Body
from towtank.verdict.many import SAMPLES, SEED, Many, Population, drawn, lumped, total_mass

LINEAR = ("Yuv", "Nuv", "Yur", "Nur", "Zuw", "Muw", "Zuq", "Muq")


@dataclass(frozen=True)
class PlaneCriteria:
    """Stability of one plane in straight flight with fixed controls.

    eigenvalues [1/s], least damped first: (v, r), or (w, q, theta) with the righting moment.   slopes : "origin" or
    "wide", whichever the eigenvalues and the probability rest on.   index, index_std : stability index G and its
    standard uncertainty on these slopes.   index_wide : on the wide fit.   index_range : 5 and 95 % quantiles.
    stable : of the best estimate.   probability : share of the sampled derivatives that are stable.
    doubling : time to double [s] of the least damped mode; negative is a time to halve.
    """

    plane: str
    slopes: str
    eigenvalues: tuple[complex, ...]
    index: float
    index_std: float
    index_range: tuple[float, float]
    index_wide: float
    stable: bool
    probability: float
    doubling: float


def samples(model: Model, count: int = SAMPLES, slopes: str = "origin", seed: int = SEED) -> dict[str, Array]:
    """Derivatives drawn from their uncertainty: term -> (count + 1,), the first being the best estimate.

    The covariance of the wide fit is used. Slopes at the origin keep its correlations and take their own standard
    uncertainty. The variant is "lumped".

    Raises
    ------
    InputError
        Origin slopes asked of derivatives that hold none.
    """
    if slopes == "origin" and not model.derivatives.origin:
        raise InputError(
            f"the derivatives of {model.derivatives.craft} hold no slopes at the origin. Use slopes='wide'."
        )
    return lumped(model, drawn(model, count, seed).craft.columns, slopes)


def horizontal_matrix(model: Model, v: Mapping[str, Array], speed: float, body: Body | None = None) -> Array:
    """A (n, 2, 2) of d(v, r)/dt for ``v`` = term -> (n,), at ``speed`` [m/s].

    body : the model's own when left out; its entries may be (n,).

    Source     fossen2021, ch. 6: linear sway-yaw equations; damping in the lumped variant.
    Departure  The mass matrix is the whole one, so that a CG off the axis has its part.
    Valid      Small motions, fins at rest, no roll.
    """
    b, get = body or model.constants.body, _getter(v)
    zero = np.zeros(len(get("Yuv")))
    D = speed * _matrix(
        [
            [zero, zero],
            [get("Yuv"), get("Yur") - b.m],
            [zero, zero],
            [get("Kuv"), get("Kur") + b.m * b.zG],
            [zero, zero],
            [get("Nuv"), get("Nur") - b.m * b.xG],
        ]
    )
    return np.asarray(np.linalg.solve(total_mass(b, v, len(zero)), D)[:, [1, 5], :])


def vertical_matrix(model: Model, v: Mapping[str, Array], speed: float, body: Body | None = None) -> Array:
    """A (n, 3, 3) of d(w, q, theta)/dt for ``v`` = term -> (n,), at ``speed`` [m/s]; body as above.

    Source     fossen2021, ch. 8: linear heave-pitch equations with the righting moment.
    Departure  As ``horizontal_matrix``.
    Valid      Small motions about level flight at constant speed, fins at rest.
    """
    b, get = body or model.constants.body, _getter(v)
    zero = np.zeros(len(get("Zuw")))
    stiffness = b.g * (b.m * b.zG - b.b * b.zB)
    D = _matrix(
        [
            [zero, zero, zero - b.g * (b.m - b.b)],
            [zero, zero, zero],
            [speed * get("Zuw"), speed * (get("Zuq") + b.m), zero],
            [zero, zero, zero],
            [speed * get("Muw"), speed * (get("Muq") - b.m * b.xG), zero - stiffness],
            [zero, zero, zero],
        ]
    )
    A = np.zeros((len(zero), 3, 3))
    A[:, :2] = np.linalg.solve(total_mass(b, v, len(zero)), D)[:, [2, 4], :]
    A[:, 2, 1] = 1.0
    return A


def index(model: Model, v: Mapping[str, Array], plane: str, body: Body | None = None) -> Array:
    """Stability index G (n,) of ``plane`` ("horizontal" or "vertical") for ``v`` = term -> (n,).

    Source     roddy1990; THEORY section 7. As ``model.linear.stability_indices``, for many sets at once.
    Valid      Ahead; the limit of high speed in the vertical plane. NaN where the linear terms do not damp.
    """
    b, get = body or model.constants.body, _getter(v)
    if plane == "horizontal":
        above, below = get("Nuv") * (get("Yur") - b.m), get("Yuv") * (get("Nur") - b.xG * b.m)
    else:
        above, below = get("Muw") * (get("Zuq") + b.m), get("Zuw") * (get("Muq") - b.xG * b.m)
    return np.asarray(1.0 - np.divide(above, below, out=np.full_like(above, np.nan), where=below > 0.0))


def eigenvalues(craft: Many, plane: str, speed: float) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of ``plane`` ("horizontal" or "vertical") at ``speed`` [m/s] of n craft: (n, 2) or (n, 3)."""
    matrix = horizontal_matrix if plane == "horizontal" else vertical_matrix
    return np.asarray(np.linalg.eigvals(matrix(craft.model, craft.v, speed, craft.body)), dtype=complex)


def growth(craft: Many, plane: str, speed: float) -> Array:
    """Growth rate (n,) [1/s] of the least damped mode of ``plane`` at ``speed`` [m/s]; positive is unstable."""
    return np.asarray(eigenvalues(craft, plane, speed).real.max(axis=1))


def plane_criteria(model: Model, plane: str, speed: float, population: Population | None = None) -> PlaneCriteria:
    """Criteria of one plane at ``speed`` [m/s]: on slopes at the origin where the derivatives hold them.

    population : the drawn craft; ``SAMPLES`` drawn from the derivatives alone when left out.
    """
    craft = (population or drawn(model)).craft
    values = eigenvalues(craft, plane, speed)
    rate, G = values.real.max(axis=1), index(model, craft.v, plane, craft.body)
    wide = lumped(model, {name: column[:1] for name, column in craft.columns.items()}, "wide")
    best = values[0][np.lexsort((values[0].imag, -values[0].real))]
    spread = G[1:][np.isfinite(G[1:])]
    low, high = np.quantile(spread, [0.05, 0.95]) if len(spread) else (np.nan, np.nan)
    return PlaneCriteria(
        plane=plane,
        slopes=craft.slopes,
        eigenvalues=tuple(complex(s) for s in best),
        index=float(G[0]),
        # The ratio has heavy tails; the width of the middle 68 % says more than the second moment.
        index_std=float(np.diff(np.quantile(spread, [0.1587, 0.8413]))[0] / 2.0) if len(spread) else float("nan"),
        index_range=(float(low), float(high)),
        index_wide=float(index(model, wide, plane)[0]),
        stable=bool(rate[0] < 0.0),
        probability=float((rate[1:] < 0.0).mean()),
        doubling=float(np.log(2.0) / rate[0]) if rate[0] != 0.0 else float("inf"),
    )


def _getter(v: Mapping[str, Array]) -> Callable[[str], Array]:
    size = len(next(iter(v.values())))
    return lambda name: v.get(name, np.zeros(size))


def _matrix(rows: Sequence[Sequence[Array]]) -> Array:
    """(n, k, k) from a nested list of (n,)."""
    return np.moveaxis(np.array(rows), -1, 0)
