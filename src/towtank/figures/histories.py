"""Free-running trials in time: zigzag, spirals, pull-out, speed, course, pitch, steps, fin angles and effort."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from towtank.figures.paper import FIT, GREY, INK, ORIGIN, PALETTE, frame, head, legend, new_axes, note, one_level
from towtank.figures.tracks import NO_BAND
from towtank.frames import Array
from towtank.trials.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _plane(trial: Trajectory) -> tuple[Array, Array, str, str]:
    """The angle followed and the order given [deg], with their words. The kind of the trial names the plane."""
    if "vertical" in trial.kind:
        return np.degrees(trial.attitude[:, 1]), np.degrees(trial.command[:, 1]), "pitch", "elevator"
    heading = np.degrees(trial.attitude[:, 2] - trial.attitude[0, 2])
    return heading, np.degrees(trial.command[:, 0]), "heading", "rudder"


def zigzag(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Heading (or pitch) change and control order [deg] against time [s]; each overshoot marked."""
    angle, order, followed, control = _plane(trial)
    ax = new_axes(ax, width=6.2, height=2.8)
    ax.plot(trial.time, angle, color=FIT, linewidth=1.4, label=followed)
    ax.plot(trial.time, order, color=ORIGIN, linewidth=1.0, label=f"{control} ordered")
    switch = np.flatnonzero(np.abs(np.diff(order)) > 0.5 * np.ptp(order)) + 1 if np.ptp(order) > 0.0 else np.array([])
    for begin, end in pairwise(switch):
        sense = np.sign(angle[begin]) or 1.0
        top = begin + int(np.argmax(sense * angle[begin:end]))
        over = abs(angle[top]) - abs(_at_switch(trial, angle, int(begin)))
        ax.plot(trial.time[top], angle[top], "v" if sense > 0 else "^", color=INK, markersize=4)
        note(ax, f"{over:.1f}°", (trial.time[top], angle[top]), (0, 5 if sense > 0 else -11), ha="center")
    frame(ax, "time [s]", "angle [deg]")
    ax.margins(y=0.18)
    head(ax, f"Zigzag, {trial.name}", trial.level, NO_BAND + "; marked: swing beyond the switch")
    legend(ax, ncol=2, loc="upper right")
    return ax


def _at_switch(trial: Trajectory, angle: Array, first: int) -> float:
    """Angle [deg] at the switch before sample ``first``: at the trial's mark, or in the sample where it has none."""
    marks = (float(mark["time"]) for mark in trial.provenance.get("marks", ()))
    time = next((t for t in marks if trial.time[first - 1] <= t <= trial.time[first]), float(trial.time[first]))
    return float(np.interp(time, trial.time, angle))


def _holds(command: Array) -> list[tuple[int, int]]:
    """Stretches [begin, end) of constant command."""
    edges = np.flatnonzero(np.abs(np.diff(command)) > 1e-9) + 1
    bounds = [0, *(int(edge) for edge in edges), len(command)]
    return list(pairwise(bounds))


def spiral(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Yaw rate [deg/s] against rudder [deg]: both sweeps of a direct spiral, the curve of a reverse one, or both.

    Steady turns of the model as a line where found. An unstable craft shows a loop between the sweeps; the reverse
    spiral goes through it.
    """
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    curves = [trial.provenance.get("curves", {}) for trial in several]
    ax = new_axes(ax, width=4.4, height=3.3)
    steady = next((curve["steady turns"] for curve in curves if "steady turns" in curve), None)
    if steady is not None:
        ax.plot(steady["rudder"], steady["rate"], color=GREY, linewidth=1.0, label="steady turns of the model")
    shown = 1e-6
    for trial, curve in zip(several, curves, strict=True):
        if "reverse" in trial.kind:
            # A reverse spiral of which nothing could be read has no curve.
            held = curve.get("reverse spiral", {"rudder": [0.0], "rate": [np.nan]})
            rudder, rate = np.asarray(held["rudder"], dtype=float), np.asarray(held["rate"], dtype=float)
            ax.plot(rudder, rate, "o", color=INK, markersize=3.2, markerfacecolor="none", label="reverse spiral")
        else:
            rudder, rate, down = _spiral_points(trial)
            ax.plot(rudder[down], rate[down], "v-", color=FIT, markersize=3.5, linewidth=1.0, label="first sweep")
            ax.plot(rudder[~down], rate[~down], "^--", color=ORIGIN, markersize=3.5, linewidth=1.0, label="back")
        shown = max(shown, 1.15 * float(np.abs(rudder).max()))
    frame(ax, "rudder [deg]", "yaw rate [deg/s]")
    ax.axvline(0.0, color="#aab3ba", linewidth=0.6, zorder=1)
    ax.set_xlim(-shown, shown)
    title = " and ".join(trial.name for trial in several)
    head(ax, f"Spiral, {title}", one_level([trial.level for trial in several]), NO_BAND)
    legend(ax)
    return ax


def _spiral_points(trial: Trajectory) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Rudder [deg], rate [deg/s] and whether a point is of the first sweep; recorded points, else the ends of holds."""
    recorded = trial.provenance.get("curves", {}).get("spiral")
    if recorded:
        down = np.array([sweep == "down" for sweep in recorded["sweep"]], dtype=bool)
        return np.asarray(recorded["rudder"], dtype=float), np.asarray(recorded["rate"], dtype=float), down
    holds = _holds(trial.command[:, 0])
    longest = max(end - begin for begin, end in holds)
    last = np.array([end - 1 for begin, end in holds if end - begin > 0.2 * longest])
    rudder, rate = np.degrees(trial.command[last, 0]), np.degrees(trial.nu[last, 5])
    turn = int(np.argmin(rudder)) if rudder[0] > 0.0 else int(np.argmax(rudder))
    return rudder, rate, np.arange(len(rudder)) <= turn


def pull_out(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Yaw rate [deg/s] against time [s] after the rudder is put amidships; a rate that stays means instability."""
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    ax = new_axes(ax, width=4.6, height=2.7)
    for colour, trial in zip(np.resize(PALETTE, len(several)), several, strict=True):
        rate = np.degrees(trial.nu[:, 5])
        ax.plot(trial.time, rate, color=str(colour), linewidth=1.2, label=trial.name)
        held = np.abs(trial.command[:, 0]) > 1e-9
        for begin, end in _coasts(held):
            ax.axvline(trial.time[begin], color=GREY, linewidth=0.7, linestyle=":")
            note(ax, f"{rate[end - 1]:+.2f} deg/s left", (trial.time[end - 1], rate[end - 1]), (-2, 4), ha="right")
    frame(ax, "time [s]", "yaw rate [deg/s]")
    head(ax, "Pull-out", one_level([trial.level for trial in several]), NO_BAND + "; dotted: rudder amidships")
    legend(ax)
    return ax


def _coasts(held: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches [begin, end) with the rudder amidships that follow one with the rudder held over."""
    edges = np.flatnonzero(np.diff(held)) + 1
    bounds = [*(int(edge) for edge in edges), len(held)]
    return [(begin, end) for begin, end in pairwise(bounds) if not held[begin]]


def speed(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Speed ahead [m/s] against time [s]; surge alone in closed form dashed where it is known."""
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    ax, told = new_axes(ax, width=4.6, height=2.7), False
    for colour, trial in zip(np.resize(PALETTE, len(several)), several, strict=True):
        ax.plot(trial.time, trial.nu[:, 0], color=str(colour), linewidth=1.4, label=trial.name)
        alone = trial.provenance.get("curves", {}).get("closed form")
        if alone:
            label = None if told else "surge alone, closed form"
            ax.plot(alone["time"], alone["speed"], "--", color=GREY, linewidth=0.9, label=label)
            told = True
    frame(ax, "time [s]", "speed ahead [m/s]")
    head(ax, "Speed", one_level([trial.level for trial in several]), NO_BAND)
    legend(ax)
    return ax


def course(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Heading with what was asked, and rudder granted [deg] against time [s]."""
    return _angles(trial, "heading", trial.attitude[:, 2], "rudder", trial.command[:, 0], ax)


def pitch(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Pitch with what was asked, and elevator granted [deg] against time [s]."""
    return _angles(trial, "pitch", trial.attitude[:, 1], "elevator", trial.command[:, 1], ax)


def _angles(trial: Trajectory, followed: str, angle: Array, control: str, order: Array, ax: Axes | None) -> Axes:
    asked = trial.setpoint.get(followed)
    ax = new_axes(ax, width=4.6, height=2.7)
    if asked is not None and np.isfinite(asked).any():
        ax.plot(trial.time, np.degrees(asked), "--", color=GREY, linewidth=1.0, label=f"{followed} asked")
    ax.plot(trial.time, np.degrees(angle), color=FIT, linewidth=1.4, label=followed)
    ax.plot(trial.time, np.degrees(order), color=ORIGIN, linewidth=1.0, label=control)
    frame(ax, "time [s]", "angle [deg]")
    head(ax, f"{followed.capitalize()} and {control}, {trial.name}", trial.level, NO_BAND)
    legend(ax)
    return ax


def step(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Heading [deg] or depth [m] against time [s] with what was asked; the kind of the trial says which."""
    depth = "depth" in trial.kind
    answer = trial.position[:, 2] if depth else np.degrees(trial.attitude[:, 2])
    asked = trial.setpoint.get("depth" if depth else "heading")
    ax = new_axes(ax, width=4.6, height=2.7)
    if asked is not None and np.isfinite(asked).any():
        ax.plot(trial.time, asked if depth else np.degrees(asked), "--", color=GREY, linewidth=1.0, label="asked")
    ax.plot(trial.time, answer, color=FIT, linewidth=1.4, label="answer")
    frame(ax, "time [s]", "depth [m]" if depth else "heading [deg]", zero=False)
    if depth:
        ax.invert_yaxis()
    head(ax, f"{'Depth' if depth else 'Heading'} step, {trial.name}", trial.level, NO_BAND)
    legend(ax)
    return ax


def fin_angles(trial: Trajectory, limit: float | None = None, ax: Axes | None = None) -> Axes:
    """Angle of every fin [deg] against time [s]; ``limit`` [rad] is drawn when given."""
    ax = new_axes(ax, width=6.2, height=2.4)
    for i in range(trial.delta.shape[1]):
        ax.plot(
            trial.time,
            np.degrees(trial.delta[:, i]),
            color=PALETTE[i % len(PALETTE)],
            linewidth=0.8,
            label=f"fin {i + 1}",
        )
    if limit is not None:
        for side in (-1.0, 1.0):
            ax.axhline(side * np.degrees(limit), color=GREY, linestyle=":", linewidth=0.8)
    frame(ax, "time [s]", "fin angle [deg]")
    words = NO_BAND if limit is None else NO_BAND + "; dotted: limit"
    head(ax, f"Fin angles, {trial.name}", trial.level, words)
    legend(ax, ncol=max(trial.delta.shape[1], 1), loc="upper right")
    return ax


def fin_effort(trials: Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Root-mean-square angle [deg] of every fin in every trial, as grouped bars."""
    several = [trial for trial in trials if trial.delta.shape[1]]
    ax = new_axes(ax, width=6.2, height=3.0, bottom=0.85)
    n = max((trial.delta.shape[1] for trial in several), default=1)
    for i in range(n):
        rms = [np.degrees(np.sqrt((t.delta[:, i] ** 2).mean())) if t.delta.shape[1] > i else 0.0 for t in several]
        ax.bar(
            np.arange(len(several)) + (i - (n - 1) / 2) * 0.8 / n,
            rms,
            0.8 / n,
            color=PALETTE[i % len(PALETTE)],
            label=f"fin {i + 1}",
        )
    ax.set_xticks(range(len(several)))
    frame(ax, "", "rms fin angle [deg]", zero=False)
    names = [t.name + (" (autopilot)" if t.loop == "closed" else "") for t in several]
    ax.set_xticklabels(names, fontsize=6.2, rotation=30, ha="right", rotation_mode="anchor", parse_math=False)
    head(ax, "Fin effort", one_level([trial.level for trial in several]), NO_BAND)
    legend(ax, ncol=n)
    return ax
