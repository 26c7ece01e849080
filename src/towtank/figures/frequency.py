"""What single oscillations say of a derivative: against frequency and amplitude, with the trends and their limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from towtank.derive.study import FrequencyStudy, Point, Trend
from towtank.figures.paper import GREY, INK, PALETTE, frame, head, legend, new_axes, points
from towtank.frames import Array
from towtank.symbols import TERMS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VELOCITY = {
    "surge": "u / U",
    "sway": "v / U",
    "heave": "w / U",
    "roll": "p L / U",
    "pitch": "q L / U",
    "yaw": "r L / U",
}
"""Kind of oscillation -> its amplitude in words."""

APART = 0.1
"""Share of the largest value by which two levels of frequency or amplitude differ to be drawn apart."""


def against_frequency(study: FrequencyStudy, term: str, ax: Axes | None = None) -> Axes:
    """The derivative ``term`` (its own unit) against w'2: a point for each run, a colour and trend for each amplitude.

    The diamond at w' = 0 is the limit with its 95 % interval, the dashed line the wide fit of all runs. Runs are marked
    by verdict, see ``paper.MARKS``.

    Raises
    ------
    ValueError
        The study has no point of the term.
    """
    own = _own(study, term)
    x, level = (np.array([getattr(point, name) for point in own]) for name in ("frequency", "amplitude"))
    ax = _drawn(study, own, x**2, level, "a'", lambda trend, square, at: trend.at(math.sqrt(square), at), ax)
    frame(ax, "(w L / U) squared [-]", f"{term} [{TERMS[term].unit}]", zero=False)
    _titled(ax, study, own, f"{term} against frequency, {own[0].kind}", f"a': amplitude of {VELOCITY[own[0].kind]}")
    return ax


def against_amplitude(study: FrequencyStudy, term: str, ax: Axes | None = None) -> Axes:
    """The derivative ``term`` (its own unit) against the amplitude a', as ``against_frequency``; a colour for each w'.

    Raises
    ------
    ValueError
        The study has no point of the term.
    """
    own = _own(study, term)
    x, level = (np.array([getattr(point, name) for point in own]) for name in ("amplitude", "frequency"))
    ax = _drawn(study, own, x, level, "w'", lambda trend, size, at: trend.at(at, size), ax)
    frame(ax, f"amplitude of {VELOCITY[own[0].kind]} [-]", f"{term} [{TERMS[term].unit}]", zero=False)
    _titled(ax, study, own, f"{term} against amplitude, {own[0].kind}", "w' = w L / U")
    return ax


def levels(values: Array) -> tuple[Array, Array]:
    """Values (k,) that stand for groups of nearly equal ``values`` (n,), and the group (n,) of each."""
    order = np.argsort(values)
    steps = np.diff(values[order]) > APART * np.abs(values).max()
    group = np.empty(len(values), dtype=int)
    group[order] = np.concatenate([[0], np.cumsum(steps)])
    return np.array([values[group == k].mean() for k in range(group.max() + 1)]), group


def _own(study: FrequencyStudy, term: str) -> list[Point]:
    own = [point for point in study.points if point.term == term]
    if not own:
        known = ", ".join(dict.fromkeys(point.term for point in study.points))
        raise ValueError(f"no oscillation gives {term!r}; the study has {known}")
    return own


def _trend(study: FrequencyStudy, own: list[Point]) -> Trend | None:
    """The trend of the term, when it rests on more than one run."""
    return next((t for t in study.trends if t.term == own[0].term and t.points > 1), None)


def _drawn(
    study: FrequencyStudy, own: list[Point], x: Array, other: Array, symbol: str,
    line: Callable[[Trend, float, float], float], ax: Axes | None,
) -> Axes:  # fmt: skip
    """Points over ``x`` in a colour for each level of ``other``, the trends, their limit, and the wide fit."""
    ax = new_axes(ax, width=4.2, height=3.1)
    trend, ends = _trend(study, own), (0.0, 1.04 * float(x.max()))
    value, std = np.array([point.value for point in own]), np.array([point.std for point in own])
    verdicts = [point.verdict for point in own]
    centre, group = levels(other)
    for k, at in enumerate(centre):
        colour, mine = PALETTE[k % len(PALETTE)], np.flatnonzero(group == k)
        bars = std[mine] if np.isfinite(std[mine]).all() else None
        points(ax, x[mine], value[mine], bars, [verdicts[i] for i in mine], f"{symbol} = {at:.2g}", colour)
        if trend is not None:
            ax.plot(ends, [line(trend, end, float(at)) for end in ends], color=colour, linewidth=0.8)
    if trend is not None:
        ax.plot(ends, [line(trend, end, 0.0) for end in ends], ":", color=INK, linewidth=0.8, label=f"{symbol} = 0")
        bar = [[trend.limit - trend.low], [trend.high - trend.limit]] if np.isfinite(trend.std) else None
        ax.errorbar(0.0, trend.limit, yerr=bar, fmt="D", color=INK, markersize=4, capsize=2.5, label="limit")
    fit = next((t.fit for t in study.trends if t.term == own[0].term), float("nan"))
    if np.isfinite(fit):
        ax.axhline(fit, linestyle="--", color=GREY, linewidth=0.9, label="wide fit")
    return ax


def _titled(ax: Axes, study: FrequencyStudy, own: list[Point], title: str, symbol: str) -> None:
    trend = _trend(study, own)
    limit = "limit with 95 % interval" if trend is not None and np.isfinite(trend.std) else "no uncertainty of a limit"
    head(ax, title, study.level, f"{symbol}; {limit}; bars: 2 std of periods")
    ax.margins(x=0.05, y=0.1)
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.3 * (high - low))
    legend(ax, ncol=3, loc="upper left", columnspacing=0.8, handlelength=1.2)
