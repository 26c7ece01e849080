"""Every fitted constant of the fast tank: its value, what it was fitted on, and how uncertain it is.

The ensemble draws each constant from its distribution; the spread of the derivatives that follows is the model-form
uncertainty. Constants with ``fitted_on`` empty come from the named source and are only spread, not fitted.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.special import ndtri

from towtank.frames import Array


@dataclass(frozen=True)
class Constant:
    """A number of the model. ``spread``: standard deviation, relative (lognormal) or absolute (``additive``)."""

    name: str
    value: float
    meaning: str
    fitted_on: str
    spread: float
    additive: bool = False
    limits: tuple[float, float] = (0.0, np.inf)


CONSTANTS = (
    Constant("tail_area", 3.4, "tail-shed area over the stern momentum area", "SUBOFF bare hull Y'v (roddy1990)", 0.30),
    Constant("tail_growth", 1.7, "growth of the tail-shed area with the sine of the tail incidence",
             "SUBOFF bare hull Y', N' at 4-18 deg (roddy1990, appendix B)", 0.30),
    Constant("crossflow_cd", 0.95, "drag coefficient of the developed two-dimensional cross-flow",
             "SUBOFF bare hull Y', N' at 4-18 deg (roddy1990, appendix B)", 0.25),
    Constant("crossflow_length", 0.76, "slip in diameters over which the cross-flow develops",
             "SUBOFF bare hull Y', N' at 4-18 deg (roddy1990, appendix B)", 0.30),
    Constant("crossflow_axial", 0.38, "axial share of the cross-flow force at large drift",
             "SUBOFF bare hull X' at 4-18 deg (roddy1990, appendix B)", 0.40),
    Constant("sidewash", 0.35, "share of the upstream cross-flow taken out of the flow at the fins",
             "SUBOFF with four stern planes Y'v (roddy1990)", 0.20, True, (0.0, 0.8)),
    Constant("tail_lag", 0.15, "delay of the tail-shed lift, in lengths travelled",
             "coarse RANS of forced sway, Y'vdot (TANK notes, section 6)", 0.50),
    Constant("wake", 1.0, "factor on the dynamic pressure at the fins", "", 0.12, False, (0.0, 1.6)),
    Constant("fin_slope", 1.0, "factor on the lift slope of the fins (whickerfehlner1958)", "", 0.10),
    Constant("carry_over", 1.0, "factor on the lift carried over to the hull (pitts1957)", "", 0.35),
    Constant("added_mass", 1.0, "factor on the potential added mass", "", 0.03),
    Constant("drag", 1.0, "factor on the straight-ahead drag", "", 0.05),
    Constant("fin_stall", 1.0, "factor on the stall angle of the fins", "", 0.12),
)  # fmt: skip

STRAKES = (
    Constant("strake_lift", 1.0, "factor on the linear load of strakes (slender-body theory)", "", 0.15),
    Constant("strake_crossflow", 2.0, "drag coefficient of the cross-flow that separates at the edges of strakes", "",
             0.25),
    Constant("strake_wash", 1.0, "factor on the wash of strakes at the fins", "", 0.40),
)  # fmt: skip
"""Constants that only a craft with strakes feels. They are drawn apart, so that the draws of the others stay."""

NOMINAL: dict[str, float] = {item.name: item.value for item in CONSTANTS}


@functools.lru_cache(maxsize=4)
def sample(members: int, seed: int = 0) -> Mapping[str, Array]:
    """Constants (members + 1,): the nominal set first, then a Latin hypercube sample of the distributions.

    Source     mckay1979: each constant takes every 1/members share of its distribution once.
    """
    return MappingProxyType({**_drawn(CONSTANTS, members, (seed,)), **_drawn(STRAKES, members, (seed, 1))})


def _drawn(constants: tuple[Constant, ...], members: int, seed: tuple[int, ...]) -> dict[str, Array]:
    values = {item.name: np.full(members + 1, item.value) for item in constants}
    if members == 0:
        return values
    rng = np.random.default_rng(seed[0] if len(seed) == 1 else list(seed))
    ranks = rng.permuted(np.tile(np.arange(members), (len(constants), 1)), axis=1)
    normal = ndtri((ranks.T + rng.uniform(size=(members, len(constants)))) / members)
    for item, z in zip(constants, normal.T, strict=True):
        drawn = item.value + item.spread * z if item.additive else item.value * np.exp(item.spread * z)
        values[item.name][1:] = np.clip(drawn, *item.limits)
    return values
