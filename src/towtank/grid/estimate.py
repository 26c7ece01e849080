"""From the values of one quantity on three or more meshes to its uncertainty on each of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from towtank.errors import InputError
from towtank.frames import Array
from towtank.grid.fit import HIGHEST, LOWEST, difference_order, observed_fit, power_fit
from towtank.grid.gci import NO_CHANGE, SAFETY, SAFETY_TWO, Triplet, Verdict, oscillation_uncertainty, triplet

BELIEVED = (LOWEST, 2.1)
"""Observed orders at which the factor of safety is 1.25 (eca2014); outside them it is 3."""
OSCILLATORY, DIVERGENT = SAFETY, SAFETY_TWO
"""Factors on half the range: of values that close in on a limit, and of values that do not (judgement: the factors of
the index, for the bound of the ITTC procedure that has none)."""
LEAST_MESHES = 3
ASYMPTOTIC = 0.1
"""Largest distance from 1 of the check gci_coarse / (r^p gci) on three meshes (judgement)."""
ORDERS_APART = 0.5
"""Largest difference between the order of the three finest meshes and that of all, as a share of it (judgement: orders
observed so are seldom better known)."""
LEAST_RATIO = 1.1
"""Least refinement ratio: below it the difference of two meshes is lost in other errors (roache1998; celik2008 advises
1.3)."""


@dataclass(frozen=True)
class Estimate:
    """What a mesh study says of one quantity; arrays coarse to fine.

    verdict : monotone, oscillatory, divergent, exact.   order : observed, on all meshes; NaN when exact.
    extrapolated : value at zero mesh size.   gci : index of the finest mesh, relative to its value; with more than
        three meshes the bound of eca2014 in its place. Both NaN when divergent, or oscillatory on more than three.
    uncertainty (n,) : 95 % bound on each mesh, in the unit of the quantity.
    in_range : True when the finest meshes are in the asymptotic range.
    used : orders of the expansion that the bounds rest on; empty when they rest on a range.
    triplet : Celik's numbers on the three finest meshes.
    """

    verdict: Verdict
    order: float
    extrapolated: float
    gci: float
    uncertainty: Array
    in_range: bool
    used: tuple[float, ...]
    triplet: Triplet


def estimate(values: Array, size: Array) -> Estimate:
    """Judge one quantity.

    Parameters
    ----------
    values, size : (n,) values and representative mesh sizes h, coarse to fine; h falls.

    Raises
    ------
    InputError
        Fewer than three meshes, sizes that do not fall by ``LEAST_RATIO``, numbers that are not finite.

    Source     celik2008 with three meshes; eca2014 with more; ittc75030101 for the oscillatory.
    Departure  The bound of celik2008 holds on the finest mesh. Here every mesh has one: the factor of safety times the
               distance from the extrapolated value; on the finest it is the index. With three meshes an order above
               2.1 is taken as 2 and one below 0.5 as 0.5, both with the factor 3. Values that do not converge get half
               their range (their own mesh, the next coarser, and all finer ones, three at least) times OSCILLATORY or
               DIVERGENT.
    """
    phi, h = np.asarray(values, dtype=float), np.asarray(size, dtype=float)
    check_sizes(h)
    finest = triplet((phi[-1], phi[-2], phi[-3]), (h[-1], h[-2], h[-3]))
    found = _verdict(phi, h, finest)
    if found == "exact":
        return Estimate(found, math.nan, float(phi[-1]), 0.0, np.abs(phi - phi[-1]), True, (), finest)
    if found == "monotone":
        return _three(phi, h, finest) if len(phi) == LEAST_MESHES else _many(phi, h, finest)
    factor = OSCILLATORY if found == "oscillatory" else DIVERGENT
    bound = factor * np.array([oscillation_uncertainty(tuple(phi[_window(i, len(phi)) :])) for i in range(len(phi))])
    if len(phi) == LEAST_MESHES:
        return Estimate(found, finest.order, finest.extrapolated, finest.gci, bound, False, (), finest)
    # The three finest may look better than the whole set: neither their limit nor their index is then believed.
    return Estimate(found, _order(phi, h, found), math.nan, math.nan, bound, False, (), finest)


def check_sizes(size: Array) -> None:
    """Refuse fewer than three meshes, or meshes that are too alike."""
    if len(size) < LEAST_MESHES:
        raise InputError(
            f"grid: {len(size)} meshes. Two meshes give no order, so an index from them would rest on an assumed one "
            "with a factor of 3; give three or more."
        )
    ratio = size[:-1] / size[1:]
    if not np.all(ratio >= LEAST_RATIO):
        raise InputError(
            f"grid: refinement ratios {', '.join(f'{r:.3g}' for r in ratio)}, coarse to fine. Below {LEAST_RATIO:g} "
            "the difference of two meshes drowns in other errors. Use meshes 1.3 apart in size: 2.2 times the cells "
            "in three dimensions."
        )


def _order(phi: Array, h: Array, found: Verdict) -> float:
    one_sign = np.all(np.diff(phi) >= 0.0) or np.all(np.diff(phi) <= 0.0)
    return observed_fit(phi, h)[0] if found == "divergent" and one_sign else difference_order(phi, h)


def _window(mesh: int, meshes: int) -> int:
    return max(min(mesh - 1, meshes - LEAST_MESHES), 0)


def _verdict(phi: Array, h: Array, finest: Triplet) -> Verdict:
    """Of all meshes: changes of one sign that shrink are monotone, of both signs oscillatory."""
    if len(phi) == LEAST_MESHES:
        return finest.verdict
    change = np.diff(phi)
    real = np.abs(change) > NO_CHANGE * np.abs(phi).max()
    if not real.any():
        return "exact"
    one_sign = np.all(change[real] > 0.0) or np.all(change[real] < 0.0)
    if not one_sign:
        return "oscillatory" if difference_order(phi, h) > 0.0 else "divergent"
    return "monotone" if power_fit(phi, h).order > 0.0 else "divergent"


def _three(phi: Array, h: Array, finest: Triplet) -> Estimate:
    """celik2008; the bound of the other meshes from the same extrapolated value.

    The check of the range is phi1 / phi2, because p makes both indices agree: it only says that the values are close.
    """
    order, believed = finest.order, BELIEVED[0] <= finest.order <= BELIEVED[1]
    used = order if believed else LOWEST if order < LOWEST else HIGHEST
    limit = phi[-1] + (phi[-1] - phi[-2]) / math.expm1(used * math.log(h[-2] / h[-1]))
    bound = (SAFETY if believed else SAFETY_TWO) * np.abs(phi - limit)
    in_range = believed and abs(finest.asymptotic - 1.0) <= ASYMPTOTIC
    return Estimate("monotone", order, finest.extrapolated, finest.gci, bound, in_range, (used,), finest)


def _many(phi: Array, h: Array, finest: Triplet) -> Estimate:
    """eca2014; one scatter for all meshes."""
    fit = power_fit(phi, h)
    spread = float(np.ptp(phi)) / (len(phi) - 1)
    good = fit.scatter < spread
    believed = BELIEVED[0] <= fit.order < BELIEVED[1] and good
    error, off = np.abs(fit.fitted - fit.limit), np.abs(phi - fit.fitted)
    if good:
        bound = (SAFETY if believed else SAFETY_TWO) * error + fit.scatter + off
    else:
        bound = 3.0 * fit.scatter / spread * (error + fit.scatter + off)
    gci = float(bound[-1] / abs(phi[-1])) if phi[-1] != 0.0 else math.inf
    steady = finest.verdict == "monotone" and abs(finest.order - fit.order) <= ORDERS_APART * fit.order
    return Estimate("monotone", fit.order, fit.limit, gci, bound, believed and steady, fit.used, finest)
