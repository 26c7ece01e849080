"""Free-running trials in time: zigzag, spiral, pull-out, heading and depth steps, fin angles and effort."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from towtank.figures.paper import FIT, GREY, INK, ORIGIN, PALETTE, frame, head, legend, new_axes, note, one_level
from towtank.figures.tracks import NO_BAND
from towtank.frames import Array
from towtank.trials.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _plane(trial: Trajectory) -> tuple[Array, Array, str, str]:
    """The angle followed and the order given [deg], with their words: the plane whose control moved more."""
    rudder, elevator = np.degrees(trial.command[:, 0]), np.degrees(trial.command[:, 1])
    if np.abs(elevator).max() > np.abs(rudder).max():
        return np.degrees(trial.attitude[:, 1] - trial.attitude[0, 1]), elevator, "pitch", "elevator"
    return np.degrees(trial.attitude[:, 2] - trial.attitude[0, 2]), rudder, "heading", "rudder"


def zigzag(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Heading (or pitch) change and control order [deg] against time [s]; each overshoot marked."""
    angle, order, followed, control = _plane(trial)
    ax = new_axes(ax, width=6.2, height=2.8)
    ax.plot(trial.time, angle, color=FIT, linewidth=1.4, label=followed)
    ax.plot(trial.time, order, color=ORIGIN, linewidth=1.0, label=f"{control} ordered")
    switch = np.flatnonzero(np.sign(order[1:]) * np.sign(order[:-1]) < 0) + 1
    for begin, end in pairwise(switch):
        sense = np.sign(angle[begin]) or 1.0
        top = begin + int(np.argmax(sense * angle[begin:end]))
        over = abs(angle[top]) - abs(angle[begin])
        ax.plot(trial.time[top], angle[top], "v" if sense > 0 else "^", color=INK, markersize=4)
        note(ax, f"{over:.1f}°", (trial.time[top], angle[top]), (0, 5 if sense > 0 else -11), ha="center")
    frame(ax, "time [s]", "angle [deg]")
    ax.margins(y=0.18)
    head(ax, f"Zigzag, {trial.name}: overshoot beyond the heading at the switch", trial.level, NO_BAND)
    legend(ax, ncol=2, loc="upper right")
    return ax


def _holds(command: Array) -> list[tuple[int, int]]:
    """Stretches [begin, end) of constant command."""
    edges = np.flatnonzero(np.abs(np.diff(command)) > 1e-9) + 1
    bounds = [0, *(int(edge) for edge in edges), len(command)]
    return list(pairwise(bounds))


def spiral(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Yaw rate [deg/s] at the end of each hold against rudder [deg], in the order run.

    An unstable craft shows a loop between outward and back.
    """
    holds = _holds(trial.command[:, 0])
    longest = max(end - begin for begin, end in holds)
    last = np.array([end - 1 for begin, end in holds if end - begin > 0.2 * longest])
    rudder, rate = np.degrees(trial.command[last, 0]), np.degrees(trial.nu[last, 5])
    ax = new_axes(ax, width=4.2, height=3.3)
    turn = int(np.argmin(rudder)) if abs(rudder.min()) >= abs(rudder.max()) - 1e-9 else int(np.argmax(rudder))
    ax.plot(rudder[: turn + 1], rate[: turn + 1], "v-", color=FIT, markersize=3.5, linewidth=1.0, label="outward")
    ax.plot(rudder[turn:], rate[turn:], "^--", color=ORIGIN, markersize=3.5, linewidth=1.0, label="back")
    frame(ax, "rudder [deg]", "yaw rate at the end of the hold [deg/s]")
    ax.axvline(0.0, color="#aab3ba", linewidth=0.6, zorder=1)
    head(ax, f"Spiral, {trial.name}", trial.level, NO_BAND)
    legend(ax)
    return ax


def pull_out(trials: Trajectory | Sequence[Trajectory], ax: Axes | None = None) -> Axes:
    """Yaw rate [deg/s] against time [s] after the rudder is put amidships; a rate that stays means instability."""
    several = [trials] if isinstance(trials, Trajectory) else list(trials)
    ax = new_axes(ax, width=4.6, height=2.7)
    for colour, trial in zip(np.resize(PALETTE, len(several)), several, strict=True):
        rate = np.degrees(trial.nu[:, 5])
        ax.plot(trial.time, rate, color=str(colour), linewidth=1.2, label=trial.name)
        moving = np.flatnonzero(np.abs(trial.command[:, 0]) > 1e-9)
        if len(moving) and moving[-1] + 1 < len(rate):
            ax.axvline(trial.time[moving[-1] + 1], color=GREY, linewidth=0.7, linestyle=":")
        note(ax, f"{rate[-1]:+.2f} deg/s left", (trial.time[-1], rate[-1]), (-2, 4), ha="right")
    frame(ax, "time [s]", "yaw rate [deg/s]")
    head(ax, "Pull-out", one_level([trial.level for trial in several]), NO_BAND + "; dotted: rudder amidships")
    legend(ax)
    return ax


def step(trial: Trajectory, ax: Axes | None = None) -> Axes:
    """Heading [deg] or depth [m] against time [s] with what was asked; which one follows from the set-points held."""
    depth = "depth" in trial.kind or ("depth" in trial.setpoint and "heading" not in trial.setpoint)
    answer = trial.position[:, 2] if depth else np.degrees(trial.attitude[:, 2])
    asked = trial.setpoint.get("depth" if depth else "heading")
    ax = new_axes(ax, width=4.6, height=2.7)
    if asked is not None:
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
    ax = new_axes(ax, width=6.2, height=2.7)
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
    ax.set_xticklabels(
        [f"{t.name}\n({t.loop})" for t in several], fontsize=5.8, rotation=20, ha="right", parse_math=False
    )
    head(ax, "Fin effort", one_level([trial.level for trial in several]), NO_BAND)
    legend(ax, ncol=n)
    return ax
