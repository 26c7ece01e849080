"""What every figure shares: new axes, the level line under the title, colours. No global style is touched."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from towtank.derive.table import Derivatives
from towtank.frames import Array, move_load, move_velocity
from towtank.symbols import LOADS
from towtank.tank.run import Run
from towtank.terms import columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, FIT, ORIGIN, BAND, GREY, OK, BAD = "#1d2733", "#0a6aa1", "#c4511d", "#9cc9e3", "#6b7680", "#2f7d4f", "#a8322d"
PALETTE = ("#0a6aa1", "#c4511d", "#2f7d4f", "#7a4fa3", "#b08a1e", "#4d5b66", "#b04a7a", "#3f9a9a", "#8a5a3c", "#1d2733")
"""Distinct in print and for the common forms of colour blindness when taken in order."""

LEVELS = {
    "semi-empirical": "semi-empirical tank, not CFD, not experiment",
    "rans": "RANS computation, not experiment",
    "experiment": "experiment",
    "published": "published values",
    "known coefficients": "known coefficient set, not a measurement",
}
UNITS = dict(zip(LOADS, ("N", "N", "N", "N m", "N m", "N m"), strict=True))


MARKS = {
    "accepted": ("o", "full", INK),
    "down-weighted": ("o", "none", ORIGIN),
    "rejected": ("X", "none", BAD),
    "exploratory": ("P", "none", GREY),
}
"""Marker, filling and colour of a run by its verdict: open when not fully trusted, a cross when not fitted."""


def level_words(level: str) -> str:
    """The level of evidence as it is printed on every figure and table."""
    return LEVELS.get(level, level)


def new_axes(ax: Axes | None, width: float = 4.6, height: float = 3.1, bottom: float = 0.48) -> Axes:
    """``ax`` itself, or the axes of a new figure of ``width`` by ``height`` [in] with ``bottom`` [in] free below."""
    if ax is not None:
        return ax
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    left, low, top = 0.72 / width, bottom / height, 0.62 / height
    return figure.add_axes((left, low, 1.0 - left - 0.15 / width, 1.0 - low - top))


def head(ax: Axes, title: str, level: str, uncertainty: str) -> None:
    """Title of ``ax``; under it the level of evidence (none for geometry) and the statement on uncertainty."""
    inches = ax.get_position().width * ax.get_figure(root=True).get_figwidth()  # type: ignore[union-attr]
    text = f"{level_words(level)}; {uncertainty}" if level else uncertainty
    lines = textwrap.wrap(text, max(int(inches * 21), 20))
    pad = 5.0 + 8.0 * len(lines)
    # A fixed y keeps matplotlib from measuring every artist of the axes to place the title.
    ax.set_title(title, loc="left", fontsize="medium", fontweight="bold", y=1.0, pad=pad, parse_math=False)
    ax.annotate(
        "\n".join(lines), (0.0, 1.0), xycoords="axes fraction", xytext=(0.0, 3.0), textcoords="offset points",
        va="bottom", fontsize=6.2, color=GREY, linespacing=1.1, parse_math=False,
    )  # fmt: skip


def note(ax: Axes, text: str, at: tuple[float, float], offset: tuple[float, float], **options: Any) -> None:
    """Small ``text`` beside the point ``at`` (data), displaced by ``offset`` [points]."""
    ax.annotate(
        text, (float(at[0]), float(at[1])), xytext=offset, textcoords="offset points", fontsize=6.5, parse_math=False,
        **options,
    )  # fmt: skip


def frame(ax: Axes, x: str, y: str, zero: bool = True) -> None:
    """Axis labels, a light grid, and the zero line when ``zero``."""
    from matplotlib.ticker import MaxNLocator

    ax.set_xlabel(x, fontsize="small", parse_math=False)
    ax.set_ylabel(y, fontsize="small", parse_math=False)
    # Fixed places for the labels, and few ticks: measuring tick labels is half the time of drawing a figure.
    box = ax.get_position()
    figure = ax.get_figure(root=True)
    if figure is not None:
        width, height = figure.get_size_inches() * (box.width, box.height)
        ax.xaxis.set_label_coords(0.5, -0.31 / height)
        ax.yaxis.set_label_coords(-0.53 / width, 0.5)
    for axis in (ax.xaxis, ax.yaxis):
        locator = axis.get_major_locator()
        if isinstance(locator, MaxNLocator):
            locator.set_params(nbins=5)
    ax.tick_params(labelsize="x-small")
    ax.grid(True, color="#e3e7ea", linewidth=0.5)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    if zero:
        ax.axhline(0.0, color="#aab3ba", linewidth=0.6, zorder=1)


def legend(ax: Axes, **options: Any) -> None:
    """A small legend without a frame, when there is anything to name."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**{"fontsize": 6.5, "frameon": False, "handlelength": 1.6, "labelspacing": 0.3, **options})


def load_label(load: str) -> str:
    """Axis label of a load, with its unit."""
    return f"{load} [{UNITS[load]}]"


def verdicts_of(runs: Sequence[Run], derivatives: Derivatives | None) -> list[str]:
    """Verdict of each run as the screening of ``derivatives`` left it; accepted where nobody judged."""
    found = derivatives.quality.get("screening", {}) if derivatives else {}
    out = {name for name, _ in derivatives.rejected} if derivatives else set()
    verdicts = []
    for run in runs:
        entry = found.get(run.id, found.get(run.name))
        left = "exploratory" if run.exploratory else "rejected" if {run.id, run.name} & out else "accepted"
        verdicts.append(str(entry["verdict"]) if entry else left)
    return verdicts


def points(
    ax: Axes, x: Array, y: Array, std: Array | None, verdicts: Sequence[str], label: str = "runs", colour: str = ""
) -> None:
    """Points (n,) with bars of 2 ``std``, each marked by its verdict; every verdict has a line in the legend.

    colour : of the accepted and down-weighted ones, in place of that of ``MARKS``.
    """
    named = ax.get_legend_handles_labels()[1]
    for verdict, (marker, filling, own) in MARKS.items():
        words = label if verdict == "accepted" else verdict
        at = [i for i, found in enumerate(verdicts) if found == verdict]
        if at:
            ax.errorbar(
                x[at], y[at], yerr=None if std is None else 2.0 * std[at], fmt=marker, fillstyle=filling,
                markersize=3.2 if marker == "o" else 5.0, color=colour if colour and marker == "o" else own,
                markeredgewidth=0.8, ecolor=GREY, elinewidth=0.7, capsize=1.5,
                label=None if words in named else words,
            )  # fmt: skip


def one_level(levels: Sequence[str]) -> str:
    """The common level, or every level found joined by " + ": levels never mix silently."""
    return " + ".join(sorted({level_words(level) for level in levels})) or "no data"


def spread(run: Run, load: str) -> Array | None:
    """Standard deviation (N,) of ``load`` over the model-form ensemble, or None without one."""
    if run.ensemble is None or len(run.ensemble) < 2:
        return None
    return np.asarray(run.ensemble[:, :, LOADS.index(load)].std(axis=0, ddof=1))


def spread_words(runs: Sequence[Run]) -> str:
    """What the bars or band on measured points mean."""
    members = [len(run.ensemble) for run in runs if run.ensemble is not None]
    if not members:
        return "no uncertainty stated for the points"
    return f"bars: 2 std of {min(members)} model-form members"


def modelled(derivatives: Derivatives, run: Run) -> tuple[Array, Array]:
    """Loads (N, 6) of the fitted coefficients along ``run``, about its origin, and their std (N, 6).

    The std comes from the total covariance. A set taken about another point is moved along the axis first.
    """
    return modelled_at(derivatives, run.history.nu, run.history.nudot, run.control, run.origin_from_nose)


def modelled_runs(derivatives: Derivatives, runs: Sequence[Run]) -> list[Array]:
    """Fitted loads (N, 6) of every run, evaluated in one sweep over all samples; runs of one origin."""
    if not runs:
        return []
    history = [run.history for run in runs]
    nu, nudot = np.concatenate([h.nu for h in history]), np.concatenate([h.nudot for h in history])
    control = np.concatenate([run.control for run in runs])
    loads = modelled_at(derivatives, nu, nudot, control, runs[0].origin_from_nose, spread=False)[0]
    return np.split(loads, np.cumsum([len(h.time) for h in history])[:-1])


def modelled_at(
    derivatives: Derivatives, nu: Array, nudot: Array, control: Array, origin_from_nose: float, spread: bool = True
) -> tuple[Array, Array]:
    """As ``modelled`` for given velocities, accelerations (N, 6) and virtual controls (N, 4); std zero unless asked."""
    shift = np.array([origin_from_nose - derivatives.reference.origin_from_nose, 0.0, 0.0])
    nu, nudot = move_velocity(nu, shift), move_velocity(nudot, shift)
    part = np.moveaxis(move_load(np.moveaxis(columns(derivatives.names, nu, nudot, control), 2, 1), -shift), 1, 2)
    if not spread:
        return np.asarray(part @ derivatives.values), np.zeros(part.shape[:2])
    variance = np.einsum("nlj,nlj->nl", part @ derivatives.covariance, part)
    return np.asarray(part @ derivatives.values), np.sqrt(np.maximum(variance, 0.0))
