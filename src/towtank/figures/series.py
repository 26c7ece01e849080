"""Harmonic captive tests: time series, hysteresis loops, the ensemble, and the residual of every run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from towtank.derive.table import Derivatives
from towtank.figures.paper import (
    BAND,
    FIT,
    GREY,
    INK,
    PALETTE,
    frame,
    head,
    legend,
    load_label,
    modelled,
    modelled_runs,
    new_axes,
    note,
    one_level,
    verdicts_of,
)  # fmt: skip
from towtank.frames import Array
from towtank.symbols import LOADS, RATES
from towtank.tank.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAIN = {"sway": "Y", "yaw": "N", "heave": "Z", "pitch": "M", "roll": "K", "surge": "X"}
"""Load that a harmonic test is about."""
_RATE_UNIT = {"u": "m/s", "v": "m/s", "w": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s"}


def _ensemble_words(run: Run) -> str:
    return (
        "no uncertainty stated" if run.ensemble is None else f"band: 5-95 % of {len(run.ensemble)} model-form members"
    )


def time_series(run: Run, load: str = "", derivatives: Derivatives | None = None, ax: Axes | None = None) -> Axes:
    """Load [N, N m] against time [s]: the first period in grey, the cycles used shaded, the fitted model dashed.

    ``load`` defaults to the one the test is about.
    """
    load = load or MAIN.get(run.kind, "Y")
    column, time, used = LOADS.index(load), run.history.time, run.settled
    ax = new_axes(ax, width=6.2, height=2.7)
    ax.axvspan(
        time[used[0]], time[min(used[-1] + 1, len(time) - 1)], color=BAND, alpha=0.25, linewidth=0, label="cycles used"
    )
    if run.ensemble is not None:
        low, high = np.percentile(run.ensemble[:, :, column], (5.0, 95.0), axis=0)
        ax.fill_between(time, low, high, color=GREY, alpha=0.25, linewidth=0, label="5-95 % of the ensemble")
    ax.plot(time[: used[0] + 1], run.loads[: used[0] + 1, column], color=GREY, linewidth=1.0, label="dropped")
    ax.plot(time[used[0] :], run.loads[used[0] :, column], color=INK, linewidth=1.2, label="run")
    if derivatives is not None:
        ax.plot(time, modelled(derivatives, run)[0][:, column], "--", color=FIT, linewidth=1.2, label="fitted model")
    frame(ax, "time [s]", load_label(load))
    head(ax, f"{load} in {run.name}", run.level, _ensemble_words(run))
    legend(ax, ncol=3, loc="upper right")
    ax.margins(x=0.01, y=0.3)
    return ax


def hysteresis(
    run: Run, against: str = "v", load: str = "", derivatives: Derivatives | None = None, ax: Axes | None = None
) -> Axes:
    """Load [N, N m] against a rate or an acceleration over the settled cycles, measured and modelled.

    ``against``: one of u v w p q r, or the same with "dot". ``load`` defaults to the one the test is about.
    The title names the verdict of a run that is not plainly accepted.
    """
    load = load or MAIN.get(run.kind, "Y")
    column, used = LOADS.index(load), run.settled
    acceleration = against.endswith("dot")
    source = run.history.nudot if acceleration else run.history.nu
    x = source[used, RATES.index(against[0])]
    ax = new_axes(ax, width=3.6, height=3.1)
    if run.ensemble is not None:
        for member in run.ensemble[:12]:
            ax.plot(x, member[used, column], color=GREY, alpha=0.25, linewidth=0.5)
    ax.plot(x, run.loads[used, column], color=INK, linewidth=1.3, label="run")
    if derivatives is not None:
        ax.plot(x, modelled(derivatives, run)[0][used, column], "--", color=FIT, linewidth=1.3, label="fitted model")
    unit = _RATE_UNIT[against[0]] + ("2" if acceleration else "")
    frame(ax, f"{against} [{unit}]", load_label(load))
    ax.axvline(0.0, color="#aab3ba", linewidth=0.6, zorder=1)
    words = "no uncertainty stated" if run.ensemble is None else "grey: model-form members"
    verdict = verdicts_of([run], derivatives)[0]
    title = f"{load} against {against}, {run.name}" + ("" if verdict == "accepted" else f" ({verdict})")
    head(ax, title, run.level, words)
    legend(ax)
    return ax


def ensemble(run: Run, load: str = "", ax: Axes | None = None) -> Axes:
    """The model-form ensemble of one run: members as thin lines, 5-95 % band, nominal; load [N, N m] over the cycle."""
    load = load or MAIN.get(run.kind, "Y")
    column, used = LOADS.index(load), run.settled
    per = max((len(run.history.time) - 1) // run.periods, 1)
    cycle = used[-per:]
    phase = np.arange(per) / per
    ax = new_axes(ax)
    if run.ensemble is not None:
        members = run.ensemble[:, cycle, column]
        low, high = np.percentile(members, (5.0, 95.0), axis=0)
        ax.fill_between(phase, low, high, color=BAND, alpha=0.5, linewidth=0, label="5-95 %")
        for i, member in enumerate(members[:16]):
            ax.plot(phase, member, color=GREY, linewidth=0.4, alpha=0.7, label="members" if i == 0 else None)
    ax.plot(phase, run.loads[cycle, column], color=INK, linewidth=1.4, label="nominal")
    frame(ax, "share of the last cycle", load_label(load))
    head(ax, f"Model-form ensemble, {load} in {run.name}", run.level, _ensemble_words(run))
    legend(ax)
    return ax


def residual_per_run(runs: Sequence[Run], derivatives: Derivatives, ax: Axes | None = None) -> Axes:
    """Root mean square of run minus fit [% of the largest load of its kind of test], run by run, kinds side by side.

    Loads below 2 % of the largest force of a run (a moment divided by the length) are left out: symmetry makes them
    near zero. The three largest are named; runs that were not fitted stand on a tint.
    """
    ax = new_axes(ax, width=6.6, height=2.9)
    runs = sorted(runs, key=lambda run: run.kind)
    rms = residuals(runs, derivatives)
    for column, load in enumerate(LOADS):
        if np.isfinite(rms[:, column]).any():
            ax.plot(rms[:, column], "o", markersize=2.8, color=PALETTE[column], label=load)
    left = [verdict in ("rejected", "exploratory") for verdict in verdicts_of(runs, derivatives)]
    for i, out in enumerate(left):
        if out:
            ax.axvspan(i - 0.5, i + 0.5, color="#f3dcd3", linewidth=0)
    worst = np.nan_to_num(rms).max(axis=1)
    for i in np.argsort(worst)[-3:]:
        note(ax, runs[i].name, (i, worst[i]), (3, 2), ha="left" if i < 0.7 * len(runs) else "right")
    kinds = [run.kind for run in runs]
    starts = [kinds.index(kind) for kind in dict.fromkeys(kinds)]
    for start in starts[1:]:
        ax.axvline(start - 0.5, color="#c3cad0", linewidth=0.6)
    ax.set_xticks([start + 0.5 * (kinds.count(kinds[start]) - 1) for start in starts])
    frame(ax, "", "run - fit, rms [% of largest]", zero=False)
    ax.set_xticklabels([kinds[start] for start in starts], rotation=90, fontsize="x-small", parse_math=False)
    ax.set_ylim(bottom=0.0)
    shade = "; tinted: not fitted" if any(left) else ""
    level = one_level([run.level for run in runs])
    head(ax, "Residual of every run", level, "the points are misfit, not uncertainty" + shade)
    legend(ax, ncol=6)
    return ax


def residuals(runs: Sequence[Run], derivatives: Derivatives) -> Array:
    """Root mean square of run minus fit (n_runs, 6) in per cent; NaN where symmetry makes the load near zero."""
    largest = np.array([np.abs(run.loads).max(axis=0) for run in runs])
    kinds = np.array([run.kind for run in runs])
    out = np.full(largest.shape, np.nan)
    for i, (run, fit) in enumerate(zip(runs, modelled_runs(derivatives, runs), strict=True)):
        rms = np.sqrt(((run.loads - fit)[run.settled] ** 2).mean(axis=0))
        size = largest[i] / np.array([1.0, 1.0, 1.0, run.length, run.length, run.length])
        kept = size > 0.02 * size.max()
        out[i, kept] = 100.0 * rms[kept] / largest[kinds == run.kind].max(axis=0)[kept]
    return out
