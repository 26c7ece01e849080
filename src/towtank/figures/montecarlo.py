"""Trials of many drawn craft: tracks of a turning circle, bands of a channel over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import BAND, FIT, GREY, INK, ORIGIN, frame, head, legend, new_axes
from towtank.frames import Array
from towtank.montecarlo.result import MonteCarlo
from towtank.verdict.spread import QUANTILES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHANNELS = {
    "psi": ("Heading", "heading [deg]", 180.0 / np.pi),
    "theta": ("Pitch", "pitch [deg]", 180.0 / np.pi),
    "z": ("Depth", "depth [m]", 1.0),
    "r": ("Yaw rate", "yaw rate [deg/s]", 180.0 / np.pi),
    "speed": ("Speed", "speed over ground [m/s]", 1.0),
    "y": ("Offset", "east [m]", 1.0),
}
"""Channel -> title, label, factor from SI."""
_LOW, _LOWER, _MIDDLE, _UPPER, _HIGH = range(len(QUANTILES))


def circle_fan(it: MonteCarlo, trial: str, ax: Axes | None = None) -> Axes:
    """Tracks [m] of some drawn craft in a turning circle and of the best estimate, the initial course upwards.

    The box is the 5-95 % range of transfer and advance at 90 deg of heading change, the bar that of the tactical
    diameter at 180 deg. Tracks end where a tenth of the craft have finished.
    """
    bands, indices = it.bands[trial], it.trials[trial].indices
    ax = new_axes(ax, width=4.8, height=4.4)
    for i, (x, y) in enumerate(zip(bands.tracks["x"], bands.tracks["y"], strict=True)):
        label = f"{len(bands.tracks['x'])} of the drawn craft" if i == 0 else None
        ax.plot(y, x, color=GREY, linewidth=0.5, alpha=0.55, label=label)
    ax.plot(bands.best["y"], bands.best["x"], color=FIT, linewidth=1.6, label="best estimate")
    ax.plot(0.0, 0.0, "o", color=INK, markersize=4)
    side = -1.0 if np.nanmean(bands.best["y"]) < 0.0 else 1.0
    if {"advance", "transfer", "tactical_diameter"} <= set(indices):
        (x0, x1), (y0, y1) = indices["advance"].band, (side * end for end in indices["transfer"].band)
        words = f"5-95 % at 90 deg: advance {x0:.1f} to {x1:.1f} m"
        ax.plot([y0, y1, y1, y0, y0], [x0, x0, x1, x1, x0], color=ORIGIN, linewidth=1.2, label=words)
        low, high = indices["tactical_diameter"].band
        level = _northing(bands.best["psi"], bands.best["x"], np.pi)
        words = f"5-95 % at 180 deg: diameter {low:.1f} to {high:.1f} m"
        ax.plot([side * low, side * high], [level, level], "|-", color=INK, linewidth=1.2, markersize=8, label=words)
    frame(ax, "to starboard of the initial course [m]", "along the initial course [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.05)
    low, high = ax.get_ylim()
    ax.set_ylim(low - 0.24 * (high - low), high)  # room for the legend below the tracks
    head(ax, f"Turning circle, {trial}", it.level, _words(it))
    legend(ax, loc="lower left")
    return ax


def _northing(psi: Array, x: Array, turned: float) -> float:
    """Northing of the best estimate where its heading has changed by ``turned`` [rad]; the last where it has not."""
    past = np.flatnonzero(np.abs(psi) >= turned)
    there = np.flatnonzero(np.isfinite(x))
    return float(x[past[0]]) if len(past) else float(x[there[-1]]) if len(there) else 0.0


def channel_fan(it: MonteCarlo, trial: str, channel: str = "psi", ax: Axes | None = None) -> Axes:
    """Bands of one channel over time [s]: 5-95 % and 25-75 % of the craft, the median, the best estimate."""
    title, label, factor = CHANNELS[channel]
    bands = it.bands[trial]
    q, time = factor * bands.quantiles[channel], bands.time
    ax = new_axes(ax, width=4.6, height=2.7)
    ax.fill_between(time, q[_LOW], q[_HIGH], color=BAND, alpha=0.45, linewidth=0, label="5-95 %")
    ax.fill_between(time, q[_LOWER], q[_UPPER], color=BAND, alpha=0.9, linewidth=0, label="25-75 %")
    ax.plot(time, q[_MIDDLE], color=INK, linewidth=0.8, linestyle="--", label="median")
    ax.plot(time, factor * bands.best[channel], color=FIT, linewidth=1.5, label="best estimate")
    frame(ax, "time [s]", label, zero=channel != "z")
    if channel == "z":
        ax.invert_yaxis()
    head(ax, f"{title}, {trial}", it.level, _words(it))
    legend(ax, ncol=2)
    ax.margins(x=0.01)
    return ax


def _words(it: MonteCarlo) -> str:
    return f"band of drawn craft: {it.given}"
