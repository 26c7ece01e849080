"""The derivatives: values with their intervals, and what the intervals are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from towtank.derive.table import Derivatives
from towtank.figures.paper import BAD, FIT, GREY, INK, ORIGIN, frame, head, legend, new_axes
from towtank.frames import Array
from towtank.symbols import TERMS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GROUPS: dict[str, tuple[str, ...]] = {
    "linear in sway, yaw, heave, pitch": ("Yuv", "Nuv", "Yur", "Nur", "Zuw", "Muw", "Zuq", "Muq"),
    "added mass": ("Xudot", "Yvdot", "Zwdot", "Yrdot", "Nvdot", "Zqdot", "Mwdot", "Nrdot", "Mqdot", "Kpdot"),
    "cross-flow": ("Xvv", "Yvv", "Nvv", "Yrr", "Nrr", "Zww", "Mww", "Zqq", "Mqq"),
    "fins": ("Xuudd", "Yuudr", "Nuudr", "Zuude", "Muude", "Kuudroll"),
}
"""Terms that share a chart, because their primes are of one size."""


def _primed(derivatives: Derivatives, names: Sequence[str]) -> tuple[Array, dict[str, Array]]:
    """Primed values (n,) times 1000, and standard uncertainties per source (n,) times 1000."""
    reference = derivatives.reference
    at = [derivatives.names.index(name) for name in names]
    unit = (
        np.array([TERMS[n].prime_factor(reference.density, reference.length, reference.speed) for n in names]) / 1000.0
    )
    sources = {
        "fit": derivatives.covariance_fit,
        "mesh": derivatives.covariance_mesh,
        "model form": derivatives.covariance_model,
    }
    std = {key: np.sqrt(np.maximum(np.diag(matrix)[at], 0.0)) / unit for key, matrix in sources.items()}
    return derivatives.values[at] / unit, std


def derivative_bars(
    derivatives: Derivatives, names: Sequence[str] = (), title: str = "Derivatives", ax: Axes | None = None
) -> Axes:
    """Primed derivatives times 1000 as bars; 2-std intervals of the fit, the mesh and the model form side by side.

    names : terms drawn, those not in the set left out; all of them when empty.
    """
    names = [name for name in (names or derivatives.names) if name in derivatives.names]
    ax = new_axes(ax, width=4.6, height=0.95 + 0.24 * max(len(names), 3))
    value, std = _primed(derivatives, names)
    y = np.arange(len(names), dtype=float)
    ax.barh(y, value, height=0.62, color=["#b9d4e6" if v < 0 else "#e9cbb6" for v in value], linewidth=0)
    for offset, colour, (source, bar) in zip((-0.2, 0.0, 0.2), (FIT, ORIGIN, INK), std.items(), strict=True):
        if bar.any():
            ax.errorbar(
                value, y + offset, xerr=2.0 * bar, fmt="none", ecolor=colour, elinewidth=1.1, capsize=1.8,
                label=f"{source}, 2 std",
            )  # fmt: skip
    shift = derivatives.origin
    marked = [i for i, name in enumerate(names) if name in shift]
    if marked:
        reference = derivatives.reference
        slope = [
            1000.0
            * shift[names[i]]
            / TERMS[names[i]].prime_factor(reference.density, reference.length, reference.speed)
            for i in marked
        ]
        ax.plot(slope, y[marked], "D", markersize=3.6, color=BAD, label="slope at the origin")
    ax.axvline(0.0, color=GREY, linewidth=0.7)
    ax.set_yticks(y)
    frame(ax, "primed value x 1000", "", zero=False)
    ax.set_yticklabels([f"{name}'" for name in names], fontsize="x-small", parse_math=False)
    ax.invert_yaxis()
    head(ax, title, derivatives.level, "2-std intervals apart" + _unstated(std))
    legend(ax)
    return ax


def _unstated(std: dict[str, Array]) -> str:
    """Names of the sources that are not stated, as the end of a statement on uncertainty."""
    missing = [source for source, bar in std.items() if not bar.any()]
    return f"; none stated for {', '.join(missing)}" if missing else ""


def uncertainty_shares(derivatives: Derivatives, names: Sequence[str] = (), ax: Axes | None = None) -> Axes:
    """Standard uncertainty of each term as per cent of its value, stacked by source in variance shares."""
    names = [name for name in (names or derivatives.names) if name in derivatives.names and derivatives[name] != 0.0]
    ax = new_axes(ax, width=6.2, height=2.9, bottom=0.6)
    value, std = _primed(derivatives, names)
    total = np.sqrt(np.sum([bar**2 for bar in std.values()], axis=0))
    percent = 100.0 * total / np.abs(value)
    base = np.zeros(len(names))
    for colour, (source, bar) in zip((FIT, ORIGIN, GREY), std.items(), strict=True):
        part = percent * np.divide(bar**2, total**2, out=np.zeros_like(total), where=total > 0.0)
        if part.any():
            ax.bar(np.arange(len(names)), part, bottom=base, color=colour, width=0.7, label=source)
        base += part
    ax.set_xticks(range(len(names)))
    frame(ax, "", "std [% of the value]", zero=False)
    ax.set_xticklabels(names, rotation=90, fontsize=5.6, parse_math=False)
    top = float(np.percentile(percent, 90.0)) if len(names) else 1.0
    ax.set_ylim(0.0, 1.2 * max(min(float(percent.max(initial=1.0)), 2.5 * top), 1.0))
    words = "1 std, split by variance; taller bars are cut" + _unstated(std)
    head(ax, "What the uncertainty is made of", derivatives.level, words)
    legend(ax)
    return ax
