"""Pilots over speed: where a loop is stable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import PALETTE, frame, head, legend, new_axes
from towtank.frames import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class LoopOverSpeed:
    """Largest real part of the eigenvalues of a closed loop over speed.

    label : of the pilot.   speed (n,) [m/s].   growth (n,) [1/s]; zero where depth is not followed.
    """

    label: str
    speed: Array
    growth: Array


def loops_over_speed(
    curves: Sequence[LoopOverSpeed], level: str, marks: Sequence[float] = (), reversal: float = 0.0,
    ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Slowest or growing mode of the whole loop against speed; above zero is unstable.

    marks : design speeds [m/s], ticked below.   reversal : the elevator's inversion speed [m/s], a line; 0 for none.
    """
    ax = new_axes(ax, width=4.8, height=3.0)
    for colour, curve in zip(PALETTE, curves, strict=False):
        ax.plot(curve.speed, curve.growth, "-", color=colour, linewidth=1.3, label=curve.label)
    frame(ax, "speed [m/s]", "largest real part [1/s]")
    settled = np.concatenate([curve.growth[curve.growth <= 0.0] for curve in curves] or [np.zeros(1)])
    depth = max(float(-settled.min(initial=0.0)), 1e-3)
    # What grows much faster than the loops settle says no more by being larger.
    ax.set_ylim(-1.15 * depth, min(max([float(curve.growth.max()) for curve in curves] + [0.3 * depth]), 1.5 * depth))
    ax.axhspan(0.0, ax.get_ylim()[1], color="#f6dfd8", alpha=0.5, linewidth=0)
    if marks:
        ax.plot(marks, np.full(len(marks), ax.get_ylim()[0]), "^", color="#1d2733", markersize=4, clip_on=False,
                label="designed at")  # fmt: skip
    if reversal > 0.0:
        ax.axvline(reversal, color="#6b7680", linewidth=0.9, linestyle="--", label="elevator acts reversed below")
    head(ax, "Loop under the pilot against speed", level, "nominal coefficients, no band; zero: depth not followed")
    legend(ax, loc="best")
    return ax
