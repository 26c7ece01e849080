"""A mission with jammed fins: what it leaves off the track and off the depth, fin by fin and angle by angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import FIT, INK, PALETTE, frame, head, legend, new_axes
from towtank.trials.jammed import JammedFins

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = {"track": ("off_track", "rms off the track [m]", 0), "depth": ("depth_error", "rms depth error [m]", 1)}
"""Word -> values, label, place among those of the sound craft."""


DECADE = 10.0
"""Ratio of the largest to the smallest value from which the axis is logarithmic."""


def jammed(it: JammedFins, quantity: str = "track", ax: Axes | None = None) -> Axes:
    """Rms off the track or off the depth [m] over the angle of the jam [deg]; open where the mission is not completed.

    quantity : of ``QUANTITIES``. A mission that was not flown to its end has no point.
    """
    name, label, place = QUANTITIES[quantity]
    ax = new_axes(ax, width=4.6, height=3.0)
    for i, fin in enumerate(it.fins):
        colour, angle, value = PALETTE[i % len(PALETTE)], np.degrees(it.angle[i]), getattr(it, name)[i]
        ax.plot(angle, value, color=colour, linewidth=1.0, label=fin)
        for done, face in ((True, colour), (False, "white")):
            at = it.completed[i] == done
            ax.plot(angle[at], value[at], "o", color=colour, markerfacecolor=face, markersize=4)
    ax.axhline(it.sound[place], color=INK, linewidth=0.9, linestyle="--", label="sound fins")
    ax.plot([], [], "o", color=FIT, markerfacecolor="white", markersize=4, label="not completed")
    frame(ax, "angle of the jammed fin [deg]", label, zero=False)
    known = getattr(it, name)[np.isfinite(getattr(it, name))]
    if known.size and known.max() > DECADE * known.min() > 0.0:
        ax.set_yscale("log")
    head(ax, f"One fin jammed, {it.mission}", it.level, f"best estimate; {it.speed:g} m/s")
    legend(ax, ncol=2)
    return ax
