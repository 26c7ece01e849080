"""Three meshes: observed order, Richardson's extrapolation, grid convergence index, ITTC's correction factor.

Values and sizes run from fine to coarse here, as in the sources: 1 is the finest mesh. Differences are
e21 = phi2 - phi1 and e32 = phi3 - phi2; ratios r21 = h2 / h1 and r32 = h3 / h2, above 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from scipy.optimize import brentq

from towtank.errors import InputError

Verdict = Literal["monotone", "oscillatory", "divergent", "exact"]

SAFETY, SAFETY_TWO = 1.25, 3.0
"""Factor of safety of the index: with the order observed on three or more meshes, and with an order that is assumed."""
NO_CHANGE = 1e-9
"""Changes below this share of the largest value are none: what is left is the round-off of a solve."""
LARGEST_ORDER = 30.0
"""Bound on the search for the order; beyond it the finest change is round-off beside the other."""
NEAR_ONE = 0.125
"""|1 - C| below which the ITTC procedure takes its quadratic factor; both branches give 1.25 there."""
NEAR_ONE_CORRECTED = 0.25
"""The same for the corrected value; both branches give 0.25 there."""


@dataclass(frozen=True)
class Triplet:
    """What three meshes tell of one quantity; fine to coarse.

    verdict : monotone, oscillatory, divergent, or exact when nothing changes.
    order : observed order p, signed; negative when the changes grow with refinement. NaN when exact.
    extrapolated : value at zero mesh size.   error, extrapolated_error : relative to phi1 and to the extrapolated.
    gci, gci_coarse : index of the finest and of the middle mesh, relative to their values.
    asymptotic : gci_coarse / (r21^p gci), 1 in the asymptotic range; it equals phi1 / phi2, as both rest on one p.
    ratio : R = e21 / e32 of the ITTC procedure.
    """

    verdict: Verdict
    order: float
    extrapolated: float
    error: float
    extrapolated_error: float
    gci: float
    gci_coarse: float
    asymptotic: float
    ratio: float


def observed_order(e21: float, e32: float, r21: float, r32: float) -> float:
    """Observed order p of two differences and two refinement ratios; negative when the changes grow.

    p ln r21 = ln |e32 / e21| + ln((r21^p - s) / (r32^p - s)), s the sign of e32 / e21.

    Source     celik2008, step 3: its fixed point. The absolute value there is that of the whole right-hand side.
    Departure  Found by bracketing: the difference of both sides has one root, and the sign of p is kept, so that
               growing changes are seen. celik2008 gives |p|.
    Valid      r21 and r32 above 1, e21 and e32 not zero. |p| is bounded by LARGEST_ORDER.
    """
    s = math.copysign(1.0, e32 / e21)
    size = math.log(abs(e32 / e21))
    a, b = math.log(r21), math.log(r32)

    def misfit(p: float) -> float:
        return size + _log_difference(a, p, s) - _log_difference(b, p, s) - a * p

    low, high = misfit(-LARGEST_ORDER), misfit(LARGEST_ORDER)
    if low <= 0.0:
        return -LARGEST_ORDER
    if high >= 0.0:
        return LARGEST_ORDER
    return float(brentq(misfit, -LARGEST_ORDER, LARGEST_ORDER, xtol=1e-12, rtol=1e-14))


def _log_difference(log_ratio: float, p: float, s: float) -> float:
    """Logarithm of |r^p - s|; at p = 0 and s = 1 its limit up to ln |p|, which the two logarithms of a misfit share."""
    x = log_ratio * p
    if s < 0.0:
        return max(x, 0.0) + math.log1p(math.exp(-abs(x)))
    return math.log(log_ratio) + 0.5 * x if abs(x) < 1e-9 else math.log(abs(math.expm1(x) / p))


def extrapolate(phi1: float, phi2: float, r21: float, p: float) -> float:
    """Value at zero mesh size by Richardson's extrapolation at order ``p`` above 0.

    Source     celik2008, step 4.
    """
    return phi1 + (phi1 - phi2) / math.expm1(p * math.log(r21))


def approximate_error(phi1: float, phi2: float) -> float:
    """|phi1 - phi2| over |phi1|. Infinite at phi1 = 0 when they differ.

    Source     celik2008, step 5.
    """
    return _share(phi1 - phi2, phi1)


def index(phi1: float, phi2: float, r21: float, p: float, meshes: int = 3) -> float:
    """Grid convergence index of the finer of two values, as a share of it: a bound of about 95 %.

    meshes : number of meshes that the order was observed on. With two the order is an assumption and the factor is 3.

    Source     celik2008, step 5; roache1998 for the two factors.
    """
    factor = SAFETY if meshes > 2 else SAFETY_TWO
    return factor * approximate_error(phi1, phi2) / math.expm1(p * math.log(r21))


def _share(part: float, whole: float) -> float:
    return abs(part / whole) if whole != 0.0 else (0.0 if part == 0.0 else math.inf)


def verdict(e21: float, e32: float, r21: float, r32: float, scale: float) -> Verdict:
    """How three values change with refinement.

    scale : size of the values; changes below NO_CHANGE of it are none.

    Source     ittc75030101: 0 < R < 1 monotone, -1 < R < 0 oscillatory, |R| > 1 divergent.
    Departure  Unequal ratios move the limit |R| = 1, so the sign of the observed order decides; they agree for equal
               ones. Differences that are both below NO_CHANGE are called exact; a change in the last step alone is
               divergent, in the first step alone monotone with the largest order.
    """
    least = NO_CHANGE * scale
    if abs(e21) <= least and abs(e32) <= least:
        return "exact"
    if abs(e21) <= least:
        return "monotone"
    if abs(e32) <= least or observed_order(e21, e32, r21, r32) <= 0.0:
        return "divergent"
    return "monotone" if e21 * e32 > 0.0 else "oscillatory"


def triplet(phi: tuple[float, float, float], size: tuple[float, float, float]) -> Triplet:
    """Everything that three values say.

    Parameters
    ----------
    phi, size : value and representative mesh size h, finest first; h in any unit, rising.

    Raises
    ------
    InputError
        Sizes that do not rise, or numbers that are not finite.

    Source     celik2008; the oscillatory case is extrapolated as there, with its order; ittc75030101 for R.
    Departure  Divergent values have no extrapolated value and no index: NaN.
    """
    _check(phi, size)
    r21, r32 = size[1] / size[0], size[2] / size[1]
    e21, e32 = phi[1] - phi[0], phi[2] - phi[1]
    found = verdict(e21, e32, r21, r32, max(abs(value) for value in phi))
    ratio = e21 / e32 if e32 != 0.0 else (math.nan if e21 == 0.0 else math.inf)
    error, nan = approximate_error(phi[0], phi[1]), math.nan
    if found == "exact":
        return Triplet(found, nan, phi[0], error, 0.0, 0.0, 0.0, nan, ratio)
    order = LARGEST_ORDER if e21 == 0.0 else -LARGEST_ORDER if e32 == 0.0 else observed_order(e21, e32, r21, r32)
    if found == "divergent":
        return Triplet(found, order, nan, error, nan, nan, nan, nan, ratio)
    limit = extrapolate(phi[0], phi[1], r21, order)
    fine, coarse = index(phi[0], phi[1], r21, order), index(phi[1], phi[2], r32, order)
    asymptotic = coarse / (r21**order * fine) if fine > 0.0 else nan
    return Triplet(found, order, limit, error, _share(limit - phi[0], limit), fine, coarse, asymptotic, ratio)


def _check(phi: tuple[float, ...], size: tuple[float, ...]) -> None:
    if not all(math.isfinite(value) for value in (*phi, *size)):
        raise InputError(f"grid: {phi} on meshes of size {size}: a value or size is not finite. Run that mesh again.")
    if not 0.0 < size[0] < size[1] < size[2]:
        raise InputError(
            f"grid: mesh sizes {size} do not rise from fine to coarse. An order needs three different meshes; "
            "name the finest first, each with its own number of cells."
        )


@dataclass(frozen=True)
class Correction:
    """The ITTC estimate: correction factor C, error delta_RE, uncertainty U_G, and U_GC of the corrected value.

    corrected : phi1 - C delta_RE, the value less the error, with the uncertainty U_GC.
    """

    factor: float
    error: float
    uncertainty: float
    corrected_uncertainty: float
    corrected: float


def correction(phi1: float, phi2: float, r21: float, order: float, order_expected: float = 2.0) -> Correction:
    """Uncertainty of the finest value by the correction factor.

    C = (r^p - 1) / (r^p_est - 1); delta_RE = e21 / (r^p - 1), the error of phi1, in the sign of phi1 - phi0.

    Parameters
    ----------
    order : observed, above 0.   order_expected : p_est, of the scheme in the limit; 2 for most codes.

    Source     ittc75030101, correction-factor method: U_G = [9.6 (1 - C)^2 + 1.1] |delta_RE| for |1 - C| < 0.125, else
               [2 |1 - C| + 1] |delta_RE|; corrected, U_GC = [2.4 (1 - C)^2 + 0.1] |delta_RE| for |1 - C| < 0.25,
               else |1 - C| |delta_RE|.
    Valid      Monotone convergence.
    """
    if order <= 0.0 or order_expected <= 0.0:
        raise InputError(
            f"grid: orders {order:g} observed and {order_expected:g} expected must be above zero. Values that diverge "
            "have no correction factor; refine the meshes until they converge."
        )
    r = math.log(r21)
    factor = math.expm1(order * r) / math.expm1(order_expected * r)
    error = (phi2 - phi1) / math.expm1(order * r)
    off = abs(1.0 - factor)
    plain = 9.6 * off**2 + 1.1 if off < NEAR_ONE else 2.0 * off + 1.0
    corrected = 2.4 * off**2 + 0.1 if off < NEAR_ONE_CORRECTED else off
    return Correction(factor, error, plain * abs(error), corrected * abs(error), phi1 - factor * error)


def oscillation_uncertainty(phi: tuple[float, ...]) -> float:
    """Half the range of the values: the ITTC bound of an oscillatory set.

    Source     ittc75030101: U_I = (S_U - S_L) / 2.
    """
    return 0.5 * (max(phi) - min(phi))
