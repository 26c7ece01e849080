"""Steady captive tests: loads against drift, incidence and fin angle, with fit, residual and parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from towtank.derive.fin_fit import acting
from towtank.derive.table import Derivatives
from towtank.figures.paper import (
    BAD,
    BAND,
    FIT,
    GREY,
    INK,
    ORIGIN,
    PALETTE,
    UNITS,
    frame,
    head,
    legend,
    load_label,
    modelled_at,
    new_axes,
    one_level,
    points,
    spread,
    spread_words,
    verdicts_of,
)  # fmt: skip
from towtank.frames import Array, drift_angle, incidence_angle
from towtank.symbols import LOADS
from towtank.tank.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SLOPES = {("drift", "Y"): "Yuv", ("drift", "N"): "Nuv", ("incidence", "Z"): "Zuw", ("incidence", "M"): "Muw"}
"""The term whose slope at the origin is drawn beside the wide fit."""
WORDS = {
    "drift": "drift angle",
    "incidence": "incidence",
    "rudder": "rudder",
    "elevator": "elevator",
    "aileron": "aileron",
}
CONTROL = {"rudder": 0, "elevator": 1, "aileron": 2}


@dataclass(frozen=True)
class Sweep:
    """Steady runs ordered by angle: angle (n,) [rad], load (n,), std (n,) or None, velocity (n, 6)."""

    runs: tuple[Run, ...]
    angle: Array
    load: Array
    std: Array | None
    nu: Array


def sweep(runs: Sequence[Run], load: str, kind: str) -> Sweep:
    """The steady runs of ``kind`` ("drift", "incidence") or of one control ("rudder", ...), ordered by angle.

    The undeflected straight run, if there is one, belongs to every sweep.
    """
    chosen: list[tuple[float, Run]] = []
    for run in runs:
        nu, control = run.history.nu[:1], run.control[0, :3]
        beta, alpha, deflected = float(drift_angle(nu)[0]), float(incidence_angle(nu)[0]), bool(run.delta.any())
        if not run.steady or bool(nu[0, 3:].any()):
            continue
        if kind in CONTROL:
            pure = np.abs(np.delete(control, CONTROL[kind])).max() < 1e-9 and abs(beta) + abs(alpha) < 1e-9
            if pure and (not deflected or abs(control[CONTROL[kind]]) > 1e-9):
                chosen.append((float(control[CONTROL[kind]]), run))
        elif not deflected and abs(alpha if kind == "drift" else beta) < 1e-9:
            chosen.append((beta if kind == "drift" else alpha, run))
    chosen.sort(key=lambda pair: pair[0])
    picked = tuple(run for _, run in chosen)
    column = LOADS.index(load)
    bars = [spread(run, load) for run in picked]
    return Sweep(
        picked,
        np.array([angle for angle, _ in chosen]),
        np.array([run.loads[run.settled, column].mean() for run in picked]),
        np.array([bar.mean() for bar in bars if bar is not None])
        if picked and all(b is not None for b in bars)
        else None,
        np.array([run.history.nu[0] for run in picked]).reshape(-1, 6),
    )


def _states(kind: str, angle: Array, speed: float) -> tuple[Array, Array]:
    """Velocities (n, 6) and controls (n, 4) along a sweep of ``kind`` at ``speed``."""
    nu, control = np.zeros((len(angle), 6)), np.zeros((len(angle), 4))
    if kind in CONTROL:
        nu[:, 0], control[:, CONTROL[kind]] = speed, angle
        return nu, control
    nu[:, 0] = speed * np.cos(angle)
    nu[:, 1 if kind == "drift" else 2] = speed * np.sin(angle) * (-1.0 if kind == "drift" else 1.0)
    return nu, control


def _empty(ax: Axes, title: str, what: str) -> Axes:
    ax.set_axis_off()
    ax.annotate(f"{title}: no {what} among the runs", (0.5, 0.5), xycoords="axes fraction", ha="center", color=GREY)
    return ax


def load_against_angle(
    runs: Sequence[Run],
    load: str = "Y",
    kind: str = "drift",
    derivatives: Derivatives | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Load [N, N m] against drift or incidence [deg]: runs, wide fit with its 2-std band, slope at the origin.

    Runs are marked by verdict, see ``paper.MARKS``.
    """
    ax = new_axes(ax)
    data = sweep(runs, load, kind)
    if not data.runs:
        return _empty(ax, f"{load} against {WORDS[kind]}", f"{kind} run")
    degrees = np.degrees(data.angle)
    if derivatives is not None:
        angle = np.linspace(data.angle[0], data.angle[-1], 61)
        nu, control = _states(kind, angle, data.runs[0].speed)
        mean, std = modelled_at(derivatives, nu, np.zeros_like(nu), control, data.runs[0].origin_from_nose)
        line, bar = mean[:, LOADS.index(load)], 2.0 * std[:, LOADS.index(load)]
        ax.fill_between(
            np.degrees(angle), line - bar, line + bar, color=BAND, alpha=0.45, linewidth=0, label="fit, 2 std"
        )
        ax.plot(np.degrees(angle), line, color=FIT, linewidth=1.4, label="fit over the whole range")
        slope = SLOPES.get((kind, load), "")
        if slope in derivatives.origin:
            inner = np.abs(angle) <= 0.55 * np.abs(angle).max()
            side = nu[:, 1] if kind == "drift" else nu[:, 2]
            tangent = derivatives.origin[slope] * nu[:, 0] * side
            ax.plot(
                np.degrees(angle)[inner], tangent[inner], "--", color=ORIGIN, linewidth=1.2, label="slope at the origin"
            )
    points(ax, degrees, data.load, data.std, verdicts_of(data.runs, derivatives))
    frame(ax, f"{WORDS[kind]} [deg]", load_label(load))
    head(ax, f"{load} against {WORDS[kind]}", one_level([run.level for run in data.runs]), spread_words(data.runs))
    legend(ax)
    return ax


def residual_against_angle(
    runs: Sequence[Run], derivatives: Derivatives, load: str = "Y", kind: str = "drift", ax: Axes | None = None
) -> Axes:
    """Measured minus fitted load [N, N m] against drift or incidence [deg], with the fit's own 2-std band.

    Runs are marked by verdict, see ``paper.MARKS``.
    """
    ax = new_axes(ax, height=2.2)
    data = sweep(runs, load, kind)
    if not data.runs:
        return _empty(ax, f"residual of {load}", f"{kind} run")
    control = np.array([run.control[0] for run in data.runs])
    mean, std = modelled_at(derivatives, data.nu, np.zeros_like(data.nu), control, data.runs[0].origin_from_nose)
    bar = 2.0 * std[:, LOADS.index(load)]
    ax.fill_between(np.degrees(data.angle), -bar, bar, color=BAND, alpha=0.45, linewidth=0, label="fit, 2 std")
    degrees, left = np.degrees(data.angle), data.load - mean[:, LOADS.index(load)]
    ax.plot(degrees, left, color=INK, linewidth=0.6)
    points(ax, degrees, left, None, verdicts_of(data.runs, derivatives))
    frame(ax, f"{WORDS[kind]} [deg]", f"run - fit [{UNITS[load]}]")
    head(
        ax,
        f"Residual of {load}",
        one_level([run.level for run in data.runs]),
        "band: 2 std of the fit, total covariance",
    )
    return ax


def fin_load(
    runs: Sequence[Run],
    load: str = "Y",
    control: str = "rudder",
    derivatives: Derivatives | None = None,
    linear_to: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Load [N, N m] of the virtual rudder, elevator or aileron against its angle [deg], with derivative and fin curve.

    linear_to : end of the range the slope was fitted over [rad]; shaded. The largest load is marked as the stall
    when it lies inside the sweep; otherwise the figure says that none was reached.
    """
    ax = new_axes(ax)
    data = sweep(runs, load, control)
    if len(data.runs) < 2:
        return _empty(ax, f"{load} of the {control}", f"{control} run")
    degrees = np.degrees(data.angle)
    if linear_to is not None:
        ax.axvspan(
            -np.degrees(linear_to),
            np.degrees(linear_to),
            color=BAND,
            alpha=0.25,
            linewidth=0,
            label="linear range fitted",
        )
    if derivatives is not None:
        _fin_models(ax, data, load, control, derivatives)
    ax.errorbar(
        degrees, data.load, yerr=None if data.std is None else 2.0 * data.std, fmt="o-", markersize=3.2, linewidth=0.7,
        color=INK, ecolor=GREY, elinewidth=0.7, capsize=1.5, label="runs",
    )  # fmt: skip
    peak = int(np.argmax(np.abs(data.load)))
    inside = 0 < peak < len(degrees) - 1
    if inside:
        ax.plot(
            degrees[peak],
            data.load[peak],
            "v",
            color=BAD,
            markersize=7,
            label=f"stall: largest load at {degrees[peak]:.0f} deg",
        )
    frame(ax, f"{control} angle [deg]", load_label(load))
    note = "" if inside else ", no stall inside the sweep"
    head(ax, f"{load} of the {control}", one_level([run.level for run in data.runs]), spread_words(data.runs) + note)
    legend(ax)
    ax.set_xlim(degrees[0] - 1.5, degrees[-1] + 1.5)
    return ax


def _fin_models(ax: Axes, data: Sweep, load: str, control: str, derivatives: Derivatives) -> None:
    """The derivative as a line, and the fin curve where there is one, with its stall angle and 2 std of it."""
    angle = np.linspace(data.angle[0], data.angle[-1], 121)
    curve, run = derivatives.fin_curve, data.runs[0]

    def modelled(virtual: Array) -> Array:
        nu, controls = _states(control, virtual, run.speed)
        mean = modelled_at(derivatives, nu, np.zeros_like(nu), controls, run.origin_from_nose)[0]
        return mean[:, LOADS.index(load)]

    ax.plot(np.degrees(angle), modelled(angle), color=FIT, linewidth=1.3, label="derivative")
    deflected = [run for run in data.runs if run.delta.any()]
    if curve is not None and deflected:
        there = modelled(acting(curve, deflected, CONTROL[control], angle))
        words = f"fin curve, fins stall at {np.degrees(curve.stall):.0f} +- {2.0 * np.degrees(curve.std[0]):.0f} deg"
        ax.plot(np.degrees(angle), there, "--", color=ORIGIN, linewidth=1.3, label=words if curve.drop else "fin curve")


def shares(runs: Sequence[Run], load: str = "Y", kind: str = "drift", ax: Axes | None = None) -> Axes:
    """Parts of the load [N, N m] against drift or incidence [deg], stacked; the total as a line."""
    ax = new_axes(ax)
    data = sweep(runs, load, kind)
    names = list(dict.fromkeys(name for run in data.runs for name in run.parts))
    if not names:
        return _empty(ax, f"Parts of {load}", "part kept")
    degrees = np.degrees(data.angle)
    zero = np.zeros((2, 6))
    part = np.array([[run.parts.get(name, zero)[:, LOADS.index(load)].mean() for run in data.runs] for name in names])
    keep = np.abs(part).max(axis=1) > 5e-3 * np.abs(data.load).max()
    names, part = [name for name, kept in zip(names, keep, strict=True) if kept], part[keep]
    colours = [PALETTE[i % len(PALETTE)] for i in range(len(names))]
    ax.stackplot(degrees, np.maximum(part, 0.0), colors=colours, labels=names, alpha=0.75, linewidth=0)
    ax.stackplot(degrees, np.minimum(part, 0.0), colors=colours, alpha=0.75, linewidth=0)
    ax.plot(degrees, data.load, color=INK, linewidth=1.3, label="total")
    frame(ax, f"{WORDS[kind]} [deg]", load_label(load))
    head(
        ax,
        f"Parts of {load} against {WORDS[kind]}",
        one_level([run.level for run in data.runs]),
        "nominal values, no uncertainty shown",
    )
    legend(ax, ncol=2)
    return ax
