"""Free-running trials seen from above and from the side: plan view, depth profile, turning circle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import FIT, GREY, INK, ORIGIN, PALETTE, frame, head, legend, new_axes, note, one_level
from towtank.frames import Array
from towtank.trials.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NO_BAND = "one run of the nominal model, no band"


def plan_view(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Tracks, north [m] against east [m], equal scales; start marked, the ordered track dashed where there is one."""
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    ax = new_axes(ax, width=4.4, height=4.0)
    for colour, trial in zip(np.resize(PALETTE, len(several)), several, strict=True):
        ax.plot(trial.position[:, 1], trial.position[:, 0], color=str(colour), linewidth=1.2, label=trial.name)
        ax.plot(trial.position[0, 1], trial.position[0, 0], "o", color=str(colour), markersize=3.5)
        ordered = trial.provenance.get("curves", {}).get("track")
        if ordered:
            ax.plot(ordered["east"], ordered["north"], "--", color=GREY, linewidth=0.9, label="track ordered")
    frame(ax, "east [m]", "north [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    head(
        ax,
        "Plan view" if len(several) > 1 else f"Plan view, {several[0].name}",
        one_level([trial.level for trial in several]),
        NO_BAND,
    )
    legend(ax)
    return ax


def depth_profile(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Depth [m], downwards, against distance run [m]; the set depth dashed where there is one."""
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    ax = new_axes(ax, width=6.2, height=2.5)
    for colour, trial in zip(np.resize(PALETTE, len(several)), several, strict=True):
        step = np.linalg.norm(np.diff(trial.position[:, :2], axis=0), axis=1)
        run = np.concatenate([[0.0], np.cumsum(step)])
        ax.plot(run, trial.position[:, 2], color=str(colour), linewidth=1.2, label=trial.name)
        if np.isfinite(trial.setpoint.get("depth", np.array(np.nan))).any():
            ax.plot(run, trial.setpoint["depth"], "--", color=GREY, linewidth=0.9, label="depth set")
    frame(ax, "distance run over ground [m]", "depth [m]", zero=False)
    low, high = ax.get_ylim()
    ax.set_ylim(max(high, low + 0.2), low)
    head(ax, "Depth profile", one_level([trial.level for trial in several]), NO_BAND)
    legend(ax, ncol=4)
    return ax


def _turned(trial: Trajectory) -> tuple[int, Array]:
    """Sample where the rudder was first ordered, and heading change [rad] since then, positive in the turn's sense."""
    ordered = np.flatnonzero(np.abs(trial.command[:, 0]) > 1e-9)
    start = int(ordered[0]) if len(ordered) else 0
    change = trial.attitude[:, 2] - trial.attitude[start, 2]
    return start, change * (np.sign(change[-1]) or 1.0)


def turning_circle(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Track of a turning circle [m] from the point of rudder order, the initial course upwards.

    Advance and transfer are marked at 90 deg of heading change, the tactical diameter at 180 deg.
    """
    ax = new_axes(ax, width=4.4, height=4.2)
    start, turned = _turned(trial)
    course = trial.attitude[start, 2]
    offset = trial.position[:, :2] - trial.position[start, :2]
    ahead = offset @ np.array([np.cos(course), np.sin(course)])
    aside = offset @ np.array([-np.sin(course), np.cos(course)])
    ax.plot(aside, ahead, color=FIT, linewidth=1.3)
    ax.plot(0.0, 0.0, "o", color=INK, markersize=4)
    port = float(aside[-1] + aside.min() + aside.max()) < 0.0
    note(ax, "rudder order", (0.0, 0.0), (-5 if port else 5, -9), ha="right" if port else "left")
    for angle, colour in ((90.0, ORIGIN), (180.0, INK)):
        past = np.flatnonzero(turned >= np.radians(angle))
        if not len(past):
            continue
        around = slice(max(int(past[0]) - 1, 0), int(past[0]) + 1)
        x, y = (float(np.interp(np.radians(angle), turned[around], values[around])) for values in (aside, ahead))
        ax.plot(x, y, "s", color=colour, markersize=4)
        if angle < 100.0:
            ax.plot([x, x, 0.0], [0.0, y, y], ":", color=colour, linewidth=0.9)
            note(ax, f"advance {y:.1f} m", (x, 0.5 * y), (3, 0), color=colour)
            note(ax, f"transfer {abs(x):.1f} m", (0.5 * x, y), (0, 3), color=colour, ha="center")
        else:
            arrow = {"arrowstyle": "<->", "color": colour, "linewidth": 0.8}
            ax.annotate("", (x, y), xytext=(0.0, y), arrowprops=arrow)
            note(ax, f"tactical diameter {abs(x):.1f} m", (0.5 * x, y), (0, -9), ha="center")
    frame(ax, "to starboard of the initial course [m]", "along the initial course [m]", zero=False)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.12)
    head(ax, f"Turning circle, {trial.name}", trial.level, NO_BAND)
    return ax
